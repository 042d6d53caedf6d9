"""The 22 equations of Silva & Dedini, "Forces acting between road and wheel of the wheelchair".

In: the symbols of each equation. Out: its left side.

COBEM 2007. `EQUATIONS` maps each number to its function. Those that the tire law itself uses live
in mjchair.tire.formula and are the ones that it runs; the others are here. Signs are the paper's:
a positive slip angle gives a positive force in (5)-(8), a negative one in (1).

Misprints, corrected here (tests/test_paper.py shows why):

- (1) The text wants a negative C_alpha; with the printed minus sign it must be positive.
- (2) is printed without the minus sign of (1).
- (8) is (5) in other words: Bx - E (Bx - atan Bx) = B (1 - E) x + E atan(Bx).
- (13) lacks the second bar of |gamma|.
- (19)-(22) as printed are not a rotation.
- Section 3.2 prints a0 = 48 for the measured tire; see models/tires/wheelchair_a0_148.toml.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjchair.tire.formula.magic import magic_formula
from mjchair.tire.formula.pac89 import (
    curvature,
    horizontal_shift,
    peak,
    peak_friction,
    shape_factor,
    slope,
    vertical_shift,
)

Array = NDArray[np.float64]


def linear_force(alpha: ArrayLike, c_alpha: float) -> Array:
    """Lateral force (N), equation (1): Fy = -C_alpha alpha; rad, N/rad, C_alpha positive."""
    return -c_alpha * np.asarray(alpha, float)


def quadratic_force(alpha: ArrayLike, fz: ArrayLike, a: float, b: float) -> Array:
    """Lateral force (N), equation (2), with the sign of (1): -(a Fz - b Fz^2) alpha.

    Args:
      alpha: slip angle, rad. fz: load, N. a: 1/rad. b: 1/(N rad).
    """
    fz = np.asarray(fz, float)
    return np.asarray(-(a * fz - b * fz**2) * np.asarray(alpha, float))


def course_angle(vx: ArrayLike, vy: ArrayLike, yaw_rate: ArrayLike, x: float, y: float) -> Array:
    """Angle of travel of a wheel (rad), equation (3): atan((vy + yaw x) / (vx - yaw y)).

    Args:
      vx, vy: velocity of the body, m/s. yaw_rate: rad/s. x, y: of the wheel in the body, m.
    """
    vx, vy, yaw_rate = (np.asarray(value, float) for value in (vx, vy, yaw_rate))
    return np.arctan2(vy + yaw_rate * x, vx - yaw_rate * y)


def slip_angle(
    vx: ArrayLike, vy: ArrayLike, yaw_rate: ArrayLike, x: float, y: float, delta: ArrayLike
) -> Array:
    """Slip angle of a wheel (rad), equation (4): (3) less its steering angle delta (rad)."""
    return np.asarray(course_angle(vx, vy, yaw_rate, x, y) - np.asarray(delta, float))


def shifted_output(y: float, sv: float) -> float:
    """Y, equation (6): Y = y(x) + Sv."""
    return y + sv


def shifted_input(x: float, sh: float) -> float:
    """x, equation (7): x = X + Sh."""
    return x + sh


def lateral_force(
    alpha: float, b: float, c: float, d: float, e: float, sh: float, sv: float
) -> float:
    """Fy (N), equation (8): D sin(C atan(B (1-E) (alpha+Sh) + E atan(B (alpha+Sh)))) + Sv.

    Args:
      alpha, sh: deg (or the unit of 1/b). d, sv: N.
    """
    return shifted_output(float(magic_formula(shifted_input(alpha, sh), b, c, d, e)), sv)


def shape_from_curve(asymptote: float, d: float) -> float:
    """C from a measured curve, equation (16): 2 - C = (2/pi) asin(ya / D).

    Args:
      asymptote: ya, the force at large slip, N. d: D, the peak, N.
    """
    return 2.0 - 2.0 / np.pi * float(np.arcsin(asymptote / d))


def curvature_from_curve(b: float, c: float, alpha_peak: float) -> float:
    """E from a measured curve, equation (17): (B am - tan(pi/2C)) / (B am - atan(B am)).

    Args:
      b: B. c: C, above 1. alpha_peak: am, the slip at the peak, in the unit of 1/b.
    """
    x = b * alpha_peak
    return float((x - np.tan(np.pi / (2.0 * c))) / (x - np.arctan(x)))


def steering_angle(x1: float, y1: float, x2: float, y2: float) -> float:
    """Steering angle delta (rad), equation (18): of the line from (x1, y1) to (x2, y2).

    The printed arctangent of a quotient cannot tell forward from backward; this one can.
    """
    return float(np.arctan2(y2 - y1, x2 - x1))


def velocity_along(vx: ArrayLike, vy: ArrayLike, delta: ArrayLike) -> Array:
    """vx1 (m/s) along the wheel, equation (19): vx cos d + vy sin d."""
    return np.asarray(np.asarray(vx) * np.cos(delta) + np.asarray(vy) * np.sin(delta))


def velocity_across(vx: ArrayLike, vy: ArrayLike, delta: ArrayLike) -> Array:
    """vy1 (m/s) across the wheel, equation (20): vy cos d - vx sin d (printed with a plus)."""
    return np.asarray(np.asarray(vy) * np.cos(delta) - np.asarray(vx) * np.sin(delta))


def acceleration_along(ax: ArrayLike, ay: ArrayLike, delta: ArrayLike) -> Array:
    """Acceleration (m/s^2) along the wheel, equation (21): ax cos d + ay sin d (printed -)."""
    return velocity_along(ax, ay, delta)


def acceleration_across(ax: ArrayLike, ay: ArrayLike, delta: ArrayLike) -> Array:
    """Acceleration (m/s^2) across the wheel, equation (22): ay cos d - ax sin d.

    (21) and (22) turn the body's acceleration into the wheel's axes. They are not the derivatives
    of (19) and (20), which would have terms of the steering rate.
    """
    return velocity_across(ax, ay, delta)


EQUATIONS: dict[int, Callable[..., Any]] = {
    1: linear_force,
    2: quadratic_force,
    3: course_angle,
    4: slip_angle,
    5: magic_formula,
    6: shifted_output,
    7: shifted_input,
    8: lateral_force,
    9: shape_factor,
    10: peak,
    11: peak_friction,
    12: curvature,
    13: slope,
    14: horizontal_shift,
    15: vertical_shift,
    16: shape_from_curve,
    17: curvature_from_curve,
    18: steering_angle,
    19: velocity_along,
    20: velocity_across,
    21: acceleration_along,
    22: acceleration_across,
}
