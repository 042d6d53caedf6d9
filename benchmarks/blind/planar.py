"""Studies of a chair that is a little other than the model, made without MuJoCo.

What it does: integrates planar equations of motion of a chair with a frame that flexes in
yaw, a rider on a cushion spring, casters with play, brush tires with relaxation, a rippled floor
with joints, and coloured disturbances; then senses it with gains 1 % off, filtered and resampled
channels, an encoder that errs once a turn, and noise. An effect may be hidden in it.
What goes in: a Case (generator.py), a seed, trials and seconds. What comes out: a study folder and
its sealed answer. Frames are those of ISO 8855; all numbers are SI.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path

import generator
import numpy as np
from generator import MANOEUVRES, SEAL, Case, Manoeuvre, _write, fit_size, seal
from numba import njit
from numpy.typing import NDArray
from scipy.linalg import block_diag
from scipy.optimize import least_squares
from scipy.signal import butter, filtfilt

Array = NDArray[np.float64]
GRAVITY = 9.81  # m/s^2
RATE = 100.0  # Hz, of the tables
FINE = 500.0  # Hz, at which a run is kept before it is sensed

# state: X, Y, yaw, u, v, yaw rate; two wheel speeds, two wheel angles; two swivel angles and
# rates; lateral deflections of four tires; longitudinal ones of the rear; frame flex and rate;
# cushion displacement and rate; filtered accelerations (load transfer)
STATES = 26
SUBSTEPS = 5  # of 0.4 ms: half as long changes no run by more than the sensors' noise

# numbers of the manual chair, read off its MJCF; the generator moves them by a few percent
CHAIR = {
    "mass": 90.0,
    "yaw_inertia": 5.63,  # about the centre of mass, of all bodies together
    "com_x": 0.120,
    "com_y": 0.0,
    "com_z": 0.648,
    "half_track": 0.28,
    "radius_left": 0.30,
    "radius_right": 0.30,
    "wheel_inertia": 0.105,
    "caster_x": 0.45,
    "caster_y": 0.23,
    "trail": 0.05,
    "swivel_inertia": 0.0026,
    "swivel_damping": 0.01,
    "rear_stiffness": 12.0,  # cornering stiffness over load, 1/rad
    "caster_stiffness": 6.9,
    "relaxation_rear": 0.04,
    "relaxation_caster": 0.03,
    "rolling_rear": 0.010,
    "rolling_caster": 0.015,
    "friction": 0.8,
    "wheel_damping": 0.002,
    # what the model has not
    "flex_stiffness": 4000.0,  # N m/rad, front of the frame against the rear, assumed
    "flex_damping": 8.0,
    "rider_mass": 45.0,  # kg on the cushion, assumed
    "cushion_stiffness": 60000.0,  # N/m, fore and aft, assumed: about 6 Hz
    "cushion_damping": 900.0,
    "play": 0.01,  # rad, of each caster's bearings, assumed
}
# what may be hidden, zero when absent
HIDDEN = (
    "slope_x", "slope_y", "coulomb", "viscous", "drag_area", "wind_x", "wind_y", "scrub",
    "gain_left", "gain_right", "toe_left", "toe_right", "sway_force", "sway_rate", "sway_phase",
    "rolling", "caster_friction", "strap", "bent_rim",
)  # fmt: skip
NAMES = (*CHAIR, *HIDDEN)
PLACE = {name: i for i, name in enumerate(NAMES)}
LENGTHS = np.geomspace(0.15, 3.0, 12)  # m, of the floor's ripples
RIPPLES = LENGTHS.size
RIPPLE = 0.0006  # slope of each
JOINT = 0.02  # slope of a joint of the floor
COLOUR = 0.25  # s, correlation time of what pushes and twists the chair
GAIN = 0.01  # standard deviation of a sensor's gain
GAINED = ("speed", "gyro", "accel")  # of sensors whose names hold one of these
COUNTED = ("angle", "position.x", "position.y", "heading")  # channels that no start afresh ties
ENCODER = 0.004  # rad, once a turn
ROUGHLY = {  # of any chair, as documented: factors, and lengths in m
    ours: generator.ROUGHLY[theirs]
    for ours, theirs in {
        "mass": "mass", "yaw_inertia": "inertia", "wheel_inertia": "wheel_inertia",
        "rear_stiffness": "rear", "caster_stiffness": "casters",
        "com_x": "ipos.0", "com_y": "ipos.1", "com_z": "ipos.2", "radius": "radius",
    }.items()
}  # fmt: skip
BIAS = {n: generator.ROUGHLY[f"bias.{n}"] for n in ("imu_gyro.z", "imu_accelerometer.x")}

(
    MASS, IZ, COM_X, COM_Y, COM_Z, HALF, R_LEFT, R_RIGHT, I_WHEEL, CASTER_X, CASTER_Y, TRAIL,
    I_SWIVEL, C_SWIVEL, C_REAR, C_CASTER, S_REAR, S_CASTER, RR_REAR, RR_CASTER, MU, C_WHEEL,
    K_FLEX, C_FLEX, M_RIDER, K_CUSHION, C_CUSHION, PLAY,
    SLOPE_X, SLOPE_Y, COULOMB, VISCOUS, DRAG, WIND_X, WIND_Y, SCRUB,
    GAIN_L, GAIN_R, TOE_L, TOE_R, SWAY, SWAY_RATE, SWAY_PHASE, ROLLING, CASTER_FRICTION,
    STRAP, BENT,
) = range(len(NAMES))  # fmt: skip


@njit(cache=True)
def brush(slip_x, slip_y, stiffness, load, friction):
    """Forces (along, across) of a brush tire (Pacejka, ch. 3) at its transient slips."""
    size = np.hypot(slip_x, slip_y)
    if size < 1e-12 or load <= 0.0:
        return 0.0, 0.0
    limit = friction * load
    share = min(stiffness * load * size / (3.0 * limit), 1.0)
    force = limit * (1.0 - (1.0 - share) ** 3)
    return force * slip_x / size, force * slip_y / size


@njit(cache=True)
def ripple(x, y, waves, joints):
    """Slope of the floor along x at a place: ripples (k, amplitude, phase, direction), joints."""
    slope = 0.0
    for i in range(waves.shape[0]):
        k, a, p, way = waves[i]
        slope += a * np.sin(k * (x * np.cos(way) + y * np.sin(way)) + p)
    joint = (x % 0.6) / 0.012  # a joint every 0.6 m, 12 mm wide: down, then up
    if joint < 1.0:
        slope += joints * np.sin(2.0 * np.pi * joint)
    return slope


@njit(cache=True)
def rates(t, s, p, waves, joints, grid_step, torque, noise):
    """Time derivative of the state."""
    d = np.zeros(s.size)
    yaw, u, v, r = s[2], s[3], s[4], s[5]
    cos, sin = np.cos(yaw), np.sin(yaw)
    at = min(max(t / grid_step, 0.0), torque.shape[0] - 1.001)
    i0 = int(at)
    f = at - i0
    left = (1.0 - f) * torque[i0, 0] + f * torque[i0 + 1, 0]
    right = (1.0 - f) * torque[i0, 1] + f * torque[i0 + 1, 1]
    push_x = (1.0 - f) * noise[i0, 0] + f * noise[i0 + 1, 0]
    push_m = (1.0 - f) * noise[i0, 1] + f * noise[i0 + 1, 1]
    m, base = p[MASS], p[CASTER_X] - p[TRAIL]
    ax, ay = s[24], s[25]
    front = m * (GRAVITY * p[COM_X] - ax * p[COM_Z]) / base
    front = min(max(front, 40.0), 0.9 * m * GRAVITY)
    rear = m * GRAVITY - front
    lean = m * (ay * p[COM_Z] - GRAVITY * p[COM_Y])
    shift_rear = 0.7 * lean / (2.0 * p[HALF])
    shift_front = 0.3 * lean / (2.0 * p[CASTER_Y])
    fx_sum = push_x
    fy_sum = 0.0
    mz_sum = push_m
    # rear wheels
    for k in range(2):
        side = 1.0 if k == 0 else -1.0
        load = max(0.5 * rear - side * shift_rear, 5.0)
        radius = p[R_LEFT] if k == 0 else p[R_RIGHT]
        toe = p[TOE_L] if k == 0 else p[TOE_R]
        y = side * p[HALF]
        ct, st = np.cos(toe), np.sin(toe)
        bx, by = u - r * y, v
        vx, vy = ct * bx + st * by, -st * bx + ct * by
        slide = vx - s[6 + k] * radius
        d[18 + k] = slide - abs(vx) * s[18 + k] / p[S_REAR]
        d[14 + k] = vy - abs(vx) * s[14 + k] / p[S_REAR]
        along, across = brush(
            -s[18 + k] / p[S_REAR], -s[14 + k] / p[S_REAR], p[C_REAR], load, p[MU]
        )
        stiff = p[C_REAR] * load / p[S_REAR]
        along -= 0.003 * stiff * d[18 + k]
        across -= 0.003 * stiff * d[14 + k]
        px, py = s[0] - sin * y, s[1] + cos * y
        level = ripple(px, py, waves, joints)
        fx = ct * along - st * across - load * level
        fy = st * along + ct * across
        drive = (left * (1.0 + p[GAIN_L])) if k == 0 else (right * (1.0 + p[GAIN_R]))
        spin = s[6 + k]
        drag = (p[RR_REAR] + p[ROLLING]) * load * radius * np.tanh(vx / 0.01)
        drag += p[C_WHEEL] * spin + p[COULOMB] * np.tanh(spin / 0.03) + p[VISCOUS] * spin
        d[6 + k] = (drive - along * radius - drag) / p[I_WHEEL]
        d[8 + k] = spin
        fx_sum += fx
        fy_sum += fy
        mz_sum -= y * fx
        if k == 0:
            fx_sum += p[BENT] * np.sin(s[8])
            mz_sum -= y * p[BENT] * np.sin(s[8])
    # casters, on the front of a frame that flexes in yaw by s[20]
    flex_moment = 0.0
    for k in range(2):
        side = 1.0 if k == 0 else -1.0
        load = max(0.5 * front - side * shift_front, 2.0)
        y = side * p[CASTER_Y]
        angle = s[10 + k] + s[20]
        sway = s[16 + k] * p[C_CASTER] * load / p[S_CASTER]  # N, about the lateral force
        wheel = angle + p[PLAY] * np.tanh(-sway / 5.0)
        cw, sw = np.cos(wheel), np.sin(wheel)
        turn = r + s[12 + k] + s[21]
        cx, cy = p[CASTER_X] - p[TRAIL] * np.cos(angle), y - p[TRAIL] * np.sin(angle)
        # velocity of the contact: the stem moves with the chair, the trail turns with the fork
        sx, sy = u - r * y, v + (r + s[21]) * p[CASTER_X]
        bx = sx + turn * p[TRAIL] * np.sin(angle)
        by = sy - turn * p[TRAIL] * np.cos(angle)
        vx, vy = cw * bx + sw * by, -sw * bx + cw * by
        d[16 + k] = vy - abs(vx) * s[16 + k] / p[S_CASTER]
        _, across = brush(0.0, -s[16 + k] / p[S_CASTER], p[C_CASTER], load, p[MU])
        across -= 0.003 * p[C_CASTER] * load / p[S_CASTER] * d[16 + k]
        px, py = s[0] + cos * cx - sin * cy, s[1] + sin * cx + cos * cy
        along = -(p[RR_CASTER] + p[ROLLING]) * load * np.tanh(vx / 0.01)
        fx = cw * along - sw * across - load * ripple(px, py, waves, joints)
        fy = sw * along + cw * across
        moment = -p[TRAIL] * (-np.sin(angle) * fx + np.cos(angle) * fy)
        stem = p[C_SWIVEL] * s[12 + k] + p[CASTER_FRICTION] * np.tanh(s[12 + k] / 0.05)
        d[10 + k] = s[12 + k]
        d[12 + k] = (moment - stem) / p[I_SWIVEL]
        fx_sum += fx
        fy_sum += fy
        mz_sum += p[CASTER_X] * fy - y * fx + stem
        flex_moment += p[CASTER_X] * fy
    d[20] = s[21]
    d[21] = (flex_moment - p[K_FLEX] * s[20] - p[C_FLEX] * s[21]) / 1.5
    # what else pushes the chair
    weight = m * GRAVITY  # at the centre of mass: a cross slope turns the chair downhill
    down_x = weight * (-p[SLOPE_X] * cos - p[SLOPE_Y] * sin)
    down_y = weight * (p[SLOPE_X] * sin - p[SLOPE_Y] * cos)
    fx_sum += down_x
    fy_sum += down_y
    mz_sum += p[COM_X] * down_y - p[COM_Y] * down_x
    wx, wy = u * cos - v * sin - p[WIND_X], u * sin + v * cos - p[WIND_Y]
    air = -0.6 * p[DRAG] * np.hypot(wx, wy)
    across = air * (-sin * wx + cos * wy)
    fx_sum += air * (cos * wx + sin * wy)
    fy_sum += across
    mz_sum += p[COM_X] * across  # of a seated person, the middle of whose area is near that of mass
    fx_sum += p[SWAY] * np.sin(p[SWAY_RATE] * t + p[SWAY_PHASE])
    mz_sum -= p[SCRUB] * np.tanh(r / 0.05)
    catch = 0.5 * (1.0 + np.tanh((abs(u) - 1.15) / 0.02)) * np.sign(u) * p[STRAP]
    fx_sum -= catch
    mz_sum += 0.25 * catch
    # the rider on the cushion: mr (ax + s'') = spring, the same taken off the chair
    spring = -p[K_CUSHION] * s[22] - p[C_CUSHION] * s[23]
    mr = p[M_RIDER]
    a = np.zeros((4, 4))
    b = np.zeros(4)
    # M (u' - r v - xg r^2 - yg r') + mr s'' = Fx
    a[0, 0], a[0, 2], a[0, 3] = m, -m * p[COM_Y], mr
    b[0] = fx_sum + m * (r * v + p[COM_X] * r * r)
    a[1, 1], a[1, 2] = m, m * p[COM_X]
    b[1] = fy_sum - m * (r * u - p[COM_Y] * r * r)
    a[2, 0], a[2, 1] = -m * p[COM_Y], m * p[COM_X]
    a[2, 2] = p[IZ] + m * (p[COM_X] ** 2 + p[COM_Y] ** 2)
    b[2] = mz_sum + m * (-p[COM_X] * r * u - p[COM_Y] * r * v)
    a[3, 0], a[3, 3] = mr, mr
    b[3] = spring + mr * r * v - mr * 0.0
    acc = np.linalg.solve(a, b)
    d[0], d[1], d[2] = u * cos - v * sin, u * sin + v * cos, r
    d[3], d[4], d[5] = acc[0], acc[1], acc[2]
    d[22], d[23] = s[23], acc[3]
    now_x = acc[0] - r * v - p[COM_X] * r * r
    now_y = acc[1] + r * u + p[COM_X] * acc[2]
    d[24], d[25] = (now_x - s[24]) / 0.03, (now_y - s[25]) / 0.03
    return d


@njit(cache=True)
def integrate(first, count, p, waves, joints, grid_step, torque, noise):
    """States (count, STATES) at every grid step: Runge-Kutta of fourth order, SUBSTEPS a step.

    An integrator that chooses its steps takes a hundred times longer over the floor's joints.
    """
    out = np.empty((count, first.size))
    s = first.copy()
    h = grid_step / SUBSTEPS
    for i in range(count):
        out[i] = s
        for k in range(SUBSTEPS):
            t = (i + k / SUBSTEPS) * grid_step
            a = rates(t, s, p, waves, joints, grid_step, torque, noise)
            b = rates(t + 0.5 * h, s + 0.5 * h * a, p, waves, joints, grid_step, torque, noise)
            c = rates(t + 0.5 * h, s + 0.5 * h * b, p, waves, joints, grid_step, torque, noise)
            e = rates(t + h, s + h * c, p, waves, joints, grid_step, torque, noise)
            s = s + h / 6.0 * (a + 2.0 * b + 2.0 * c + e)
    return out


@dataclass
class Chair:
    """Numbers of one chair and its floor.

    Attributes:
      p: (numbers,) in the order of NAMES. waves: (RIPPLES, 4) of the floor. joints: slope at one.
      push, twist: standard deviations of the coloured disturbance, N and N m.
    """

    p: Array
    waves: Array
    joints: float
    push: float
    twist: float


def chair(rng: np.random.Generator, hidden: dict[str, dict[str, float]]) -> Chair:
    """A chair a few percent off, with the effects in it."""
    off = {
        "mass": 0.03, "yaw_inertia": 0.06, "wheel_inertia": 0.03, "rear_stiffness": 0.05,
        "caster_stiffness": 0.05, "relaxation_rear": 0.1, "relaxation_caster": 0.1,
        "swivel_damping": 0.3, "cushion_stiffness": 0.3, "flex_stiffness": 0.3, "rider_mass": 0.1,
    }  # fmt: skip
    values = {n: v * (1.0 + off.get(n, 0.0) * rng.standard_normal()) for n, v in CHAIR.items()}
    values["com_x"] += 0.006 * rng.standard_normal()
    values["com_y"] += 0.001 * rng.standard_normal()
    values |= dict.fromkeys(HIDDEN, 0.0)
    for name, given in hidden.items():
        _hide(values, name, given)
    k = 2.0 * np.pi / LENGTHS
    waves = np.column_stack(
        [
            k,
            np.full(RIPPLES, RIPPLE * rng.uniform(0.5, 1.5)),
            rng.uniform(0.0, 2.0 * np.pi, RIPPLES),
            rng.uniform(-0.4, 0.4, RIPPLES),
        ]
    )
    push, twist = 0.8 * rng.uniform(0.4, 1.6), 0.15 * rng.uniform(0.4, 1.6)
    return Chair(np.array([values[n] for n in NAMES]), waves, JOINT, push, twist)


def _hide(v: dict[str, float], name: str, given: dict[str, float]) -> None:
    """Put one effect into the numbers."""
    if name == "rolling_resistance":
        v["rolling"] += given["coefficient"]
    elif name == "floor_slope":
        v["slope_x"], v["slope_y"] = given["x"], given["y"]
    elif name == "bearing_friction":
        v["coulomb"], v["viscous"] = given.get("coulomb", 0.0), given.get("viscous", 0.0)
    elif name == "air_drag":
        v["drag_area"] += given["drag_area"]
    elif name == "wind":
        v["wind_x"], v["wind_y"] = given["x"], given["y"]
        v["drag_area"] += 0.45  # not the library's
    elif name == "turning_scrub":
        v["scrub"] = given["moment"]
    elif name == "torque_gain":
        v["gain_left"], v["gain_right"] = given.get("left", 0.0), given.get("right", 0.0)
    elif name == "toe":
        even, odd = given.get("symmetric", 0.0), given.get("asymmetric", 0.0)
        v["toe_left"], v["toe_right"] = odd - even, odd + even
    elif name == "wheel_radius":
        v["radius_left"] += given.get("left", 0.0)
        v["radius_right"] += given.get("right", 0.0)
    elif name == "mass_offset":
        v["com_x"] += given.get("x", 0.0)
        v["com_y"] += given.get("y", 0.0)
    elif name == "caster_friction":
        v["caster_friction"] = given["moment"]
    elif name == "rider_motion":
        rate = 2.0 * np.pi * given["frequency"]
        v["sway_force"] = given["mass"] * rate**2 * given["amplitude"]
        v["sway_rate"], v["sway_phase"] = rate, given["phase"]
    elif name == "strap":
        v["strap"] = given["force"]
    elif name == "bent_rim":
        v["bent_rim"] = given["force"]
    elif not name.startswith("sensor"):
        raise ValueError(f"no planar form of {name}")


EFFECTS = (
    "rolling_resistance", "floor_slope", "bearing_friction", "air_drag", "wind", "turning_scrub",
    "torque_gain", "toe", "wheel_radius", "mass_offset", "caster_friction", "rider_motion",
    "sensor_bias", "sensor_scale",
)  # fmt: skip
OUTSIDE = ("strap", "bent_rim")


def drive(c: Chair, man: Manoeuvre, seconds: float, seed: int) -> tuple[Array, Array, Array]:
    """One run: times (n,), states (n, STATES), and the torques (n, 2) that the table tells."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, seconds, 1.0 / FINE)
    torque = _torque(man, time)
    noise = np.column_stack([_coloured(rng, time.size, s) for s in (c.push, c.twist)])
    first = _first(man, c.p)
    states = integrate(first, time.size, c.p, c.waves, c.joints, 1.0 / FINE, torque, noise)
    if not np.isfinite(states).all():
        raise RuntimeError(f"planar run {man.name}: the state is not finite")
    return time, states, torque


def _torque(man: Manoeuvre, time: Array) -> Array:
    """Torques (n, 2) of a manoeuvre, N m."""
    return np.array([man.torque(t) if man.torque else (0.0, 0.0) for t in time], float)


def _first(man: Manoeuvre, p: Array) -> Array:
    """The state in which a run begins."""
    first = np.zeros(STATES)
    first[:3] = *man.position, man.heading
    first[3], first[5] = man.speed, man.yaw
    first[6:8] = man.speed / p[[R_LEFT, R_RIGHT]]
    return first


def _coloured(rng: np.random.Generator, n: int, std: float) -> Array:
    """An Ornstein-Uhlenbeck force of the correlation time COLOUR, on the fine grid."""
    keep = np.exp(-1.0 / (FINE * COLOUR))
    out = np.empty(n)
    out[0] = std * rng.standard_normal()
    kicks = std * np.sqrt(1.0 - keep**2) * rng.standard_normal(n)
    for k in range(1, n):
        out[k] = keep * out[k - 1] + kicks[k]
    return out


@dataclass
class Senses:
    """How a run is measured.

    Attributes:
      gains: channel -> factor. cutoff: Hz, of the filter that speeds went through.
      every: channel -> samples of the table's rate that one of its own takes.
    """

    gains: dict[str, float]
    cutoff: float
    every: dict[str, int]
    noise: dict[str, float] = field(
        default_factory=lambda: {
            "left_wheel_angle": 0.004, "right_wheel_angle": 0.004,
            "left_wheel_speed": 0.04, "right_wheel_speed": 0.04,
            "imu_gyro.z": 0.01, "imu_accelerometer.x": 0.15,
            "position.x": 0.003, "position.y": 0.003, "heading": 0.004,
        }
    )  # fmt: skip


def senses(rng: np.random.Generator) -> Senses:
    """Gains 1 % off, a filter of 4 to 8 Hz, some channels at half the rate."""
    names = Senses({}, 0.0, {}).noise
    gains = {n: 1.0 + GAIN * rng.standard_normal() for n in names if _has_gain(n)}
    every = {n: 2 for n in names if n.startswith(("position", "heading"))}
    return Senses(gains, rng.uniform(4.0, 8.0), every)


def _has_gain(channel: str) -> bool:
    return any(part in channel for part in GAINED)


def exact(c: Chair, time: Array, states: Array) -> dict[str, Array]:
    """What perfect sensors would tell, on the fine grid."""
    u, v, r = states[:, 3], states[:, 4], states[:, 5]
    ahead = 0.10  # m, of the IMU before the axle
    r_dot, u_dot = np.gradient(r, time), np.gradient(u, time)
    return {
        "left_wheel_angle": states[:, 8],
        "right_wheel_angle": states[:, 9],
        "left_wheel_speed": states[:, 6],
        "right_wheel_speed": states[:, 7],
        "imu_gyro.z": r,
        "imu_accelerometer.x": u_dot
        - r * v
        - ahead * r**2
        + GRAVITY * (c.p[SLOPE_X] * np.cos(states[:, 2]) + c.p[SLOPE_Y] * np.sin(states[:, 2])),
        "position.x": states[:, 0],
        "position.y": states[:, 1],
        "heading": states[:, 2] + 0.0 * r_dot,
    }


def sense(
    rng: np.random.Generator, kind: Senses, time: Array, truth: dict[str, Array], case: Case
) -> tuple[Array, dict[str, Array]]:
    """Times (n,) of the table and its columns, NaN where a channel has no sample."""
    table_time = np.arange(0.0, time[-1], 1.0 / RATE)
    low = butter(2, kind.cutoff / (0.5 * FINE))
    out = {}
    for name, values in truth.items():
        raw = values.copy()
        if name.endswith("_angle"):  # the encoder sits off centre: once a turn
            raw = raw + ENCODER * np.sin(raw)
        std = kind.noise[name]
        raw = raw + std * np.sqrt(FINE / RATE) * rng.standard_normal(raw.size) * 0.5
        if "speed" in name or "position" in name or "heading" in name:
            raw = filtfilt(*low, raw)
        raw = raw * kind.gains.get(name, 1.0)
        sampled = np.interp(table_time, time, raw) + 0.5 * std * rng.standard_normal(
            table_time.size
        )
        if name == case.channel:
            fault = next(iter(case.hidden.values()))
            sampled = sampled * (1.0 + fault.get("scale", 0.0)) + fault.get("bias", 0.0)
        every = kind.every.get(name, 1)
        if every > 1:
            sampled[np.arange(sampled.size) % every != 0] = np.nan
        out[name] = sampled
    return table_time, out


def _runs(c: Chair, seed: int, which: tuple[int, ...], seconds: float) -> list[dict[str, Array]]:
    """Exact channels of some trials of a chair."""
    return [exact(c, *drive(c, MANOEUVRES[k], seconds, 1000 * seed + k)[:2]) for k in which]


def _parts(run: dict[str, Array], noise: dict[str, float], afresh: int | None = 1) -> Array:
    """All channels of a run over their noise, averaged in steps of 0.1 s.

    Args:
      afresh: what each 2 s is taken less, since a window may start from another state: 1: a line;
        0: its mean, of what is counted from a start (angles, places); None: nothing.
    """
    out = []
    width = int(FINE / 10)
    for name, std in noise.items():
        order = afresh if afresh or name.endswith(COUNTED) else None
        x = run[name][: len(run[name]) // width * width].reshape(-1, width).mean(axis=1)
        for first in range(0, x.size, 20):
            part = x[first : first + 20]
            t = np.arange(part.size)
            if order is not None and part.size > 3:
                part = part - np.polyval(np.polyfit(t, part, order), t)
            out.append(part / (std / np.sqrt(width * RATE / FINE)))
    return np.concatenate(out)


HAT = 0.2  # s, half the width of the triangles of force that a disturbance is made of
SLOPE = 0.1  # standard deviations of a roughly known number, over which slopes are taken
WALL = 3.0  # of them: further away a study is wrong about its chair
FITTED = 8  # chairs at most that are tried in one fit
SMALL = 0.3  # N and N m of them: small enough to add up


@dataclass
class Answers:
    """What disturbances of one standard deviation change in a manoeuvre of the chair as designed.

    Attributes:
      pushes, twists: (samples, hats) of a force of 1 N forward and a moment of 1 N m, coloured.
      floor: (samples, 2 RIPPLES) of the sine and cosine of every ripple, and the joints, last.
    """

    pushes: Array
    twists: Array
    floor: Array


@cache
def answers(manoeuvre: int, seconds: float, afresh: int | None = 1) -> Answers:
    """Simulated once for each manoeuvre, one triangle of force and one ripple after the other."""
    man, noise = MANOEUVRES[manoeuvre], Senses({}, 0.0, {}).noise
    p = np.array([*CHAIR.values(), *(0.0 for _ in HIDDEN)])
    time = np.arange(0.0, seconds, 1.0 / FINE)
    torque = _torque(man, time)
    first = _first(man, p)

    def parts(push: Array, waves: Array, joints: float = 0.0) -> Array:
        states = integrate(first, time.size, p, waves, joints, 1.0 / FINE, torque, push)
        return _parts(exact(Chair(p, waves, joints, 0.0, 0.0), time, states), noise, afresh)

    still, level = np.zeros((time.size, 2)), np.zeros((1, 4))
    plain = parts(still, level)
    middles = np.arange(0.0, seconds + HAT, HAT)
    hats = np.clip(1.0 - np.abs(time[:, None] - middles) / HAT, 0.0, None)
    cover = np.exp(-np.abs(middles[:, None] - middles) / COLOUR)
    root = np.linalg.cholesky(cover + 1e-9 * np.eye(middles.size))
    moved = []
    for axis in range(2):
        shape = np.eye(2)[axis] * SMALL
        pushed = [parts(hat[:, None] * shape, level) - plain for hat in hats.T]
        moved.append(np.array(pushed).T / SMALL @ root)
    waves = [[k, RIPPLE, phase, 0.0] for k in 2.0 * np.pi / LENGTHS for phase in (0.0, 0.5 * np.pi)]
    floor = [parts(still, np.array([w])) - plain for w in waves]
    floor.append(parts(still, level, JOINT) - plain)
    return Answers(*moved, np.array(floor).T)


def _disturbances(c: Chair, which: tuple[int, ...], seconds: float, afresh: int | None) -> Array:
    """Columns (samples of all trials, k) of one standard deviation of what disturbs a chair.

    Pushes and twists are each trial's own; the floor is one.
    """
    known = [answers(k, seconds, afresh) for k in which]
    own = [np.hstack([c.push * a.pushes, c.twist * a.twists]) for a in known]
    return np.hstack([block_diag(*own), np.vstack([a.floor for a in known])])


def _moved(p: Array, numbers: Array) -> Array:
    """The numbers of a chair whose roughly known ones are off by as many standard deviations."""
    out = p.copy()
    for (name, std), off in zip(ROUGHLY.items(), numbers, strict=True):
        if name == "radius":  # of both wheels: pressure and load change it
            out[[R_LEFT, R_RIGHT]] += std * off
        elif name.startswith("com"):
            out[PLACE[name]] += std * off
        else:
            out[PLACE[name]] *= 1.0 + std * off
    return out


def _sensed(
    right: Sequence[dict[str, Array]], noise: dict[str, float], afresh: int | None
) -> Array:
    """Columns of one standard deviation of errors of sensors: gains, biases, once a turn.

    Args:
      afresh: as of `_parts`.
    """
    angles = [n for n in noise if n.endswith("_angle")]
    errors: list[tuple[str, Callable[[Array], Array]]] = [
        *((n, lambda x: GAIN * x) for n in noise if _has_gain(n)),
        *((n, lambda x, b=b: np.full_like(x, b)) for n, b in BIAS.items()),
        *((n, lambda x, wave=wave: ENCODER * wave(x)) for n in angles for wave in (np.sin, np.cos)),
    ]
    out = []
    for name, of in errors:
        error = [{**r, name: of(r[name])} for r in right]
        parts = [_parts(e, {name: noise[name]}, afresh) for e in error]
        at = list(noise).index(name)
        whole = [np.zeros((len(noise), p.size)) for p in parts]
        for w, p in zip(whole, parts, strict=True):
            w[at] = p
        out.append(np.concatenate([w.ravel() for w in whole]))
    return np.array(out).T


def size(case: Case, seed: int, which: tuple[int, ...], seconds: float) -> None:
    """Scale what is hidden until it shows at about case.sigma of the whole noise.

    The whole noise is the sensors', what pushes and twists the chair, a floor like its own, and
    what is only roughly known of the chair and of the sensors.
    """
    noise = Senses({}, 0.0, {}).noise
    sensor = any(name.startswith("sensor") for name in case.hidden)
    # what sets one channel against another no start afresh hides, but of angles where they begin
    afresh = None if sensor else 0 if "wheel_radius" in case.hidden else 1
    c = chair(np.random.default_rng([seed, 2]), {})
    right = _runs(c, seed, which, seconds)
    free = np.hstack([_disturbances(c, which, seconds, afresh), _sensed(right, noise, afresh)])
    u, s, _ = np.linalg.svd(free, full_matrices=False)
    shrink = u * (1.0 - 1.0 / np.sqrt(1.0 + s**2))  # (I + F F')^-1/2 is I - shrink u'

    def seen(runs: Sequence[dict[str, Array]]) -> Array:
        parts = np.concatenate([_parts(r, noise, afresh) for r in runs])
        return parts - shrink @ (u.T @ parts)

    def without(numbers: Array) -> Array:
        return seen(_runs(replace(c, p=_moved(c.p, numbers)), seed, which, seconds))

    for name in case.hidden:
        numbers = np.zeros(len(ROUGHLY))

        def reached(name: str = name, numbers: Array = numbers) -> float:
            if sensor:
                runs = [_faulty(case, r) for r in right]
            else:
                other = chair(np.random.default_rng([seed, 2]), {name: case.hidden[name]})
                runs = _runs(other, seed, which, seconds)
            sigmas, found = _left(seen(runs), without, numbers)
            if sigmas < case.sigma:
                numbers[:] = found  # larger sizes are fitted from here
            return sigmas

        fit_size(case, name, reached, 8, (0.05, 3.0))


def _left(seen: Array, without: Callable[[Array], Array], first: Array) -> tuple[float, Array]:
    """What is left of runs, in sigmas, once a chair without the effect is fitted; its numbers.

    The fit is no linear one: a turn answers to a centre of mass 20 mm ahead in another way than
    twice to 10 mm.

    Args:
      seen: whitened samples. without: numbers in standard deviations -> samples. first: numbers.
    """

    def miss(numbers: Array) -> Array:
        return np.concatenate([without(numbers) - seen, numbers])

    def slopes(numbers: Array) -> Array:
        here = miss(numbers)
        steps = SLOPE * np.eye(numbers.size)
        return np.column_stack([(miss(numbers + step) - here) / SLOPE for step in steps])

    found = least_squares(miss, 0.99 * first, slopes, (-WALL, WALL), max_nfev=FITTED)
    return float(np.sqrt(2.0 * found.cost)), found.x


def _faulty(case: Case, run: dict[str, Array]) -> dict[str, Array]:
    """A run with its one sensor at fault."""
    fault = next(iter(case.hidden.values()))
    values = run[case.channel] * (1.0 + fault.get("scale", 0.0)) + fault.get("bias", 0.0)
    return {**run, case.channel: values}


def make(
    folder: Path, case: Case, seed: int, trials: int = 6, seconds: float = 6.0,
    held: int | None = None,
) -> None:  # fmt: skip
    """Write a study and its sealed answer; trial `held` is held out."""
    folder.mkdir(parents=True, exist_ok=True)
    which = tuple(k % len(MANOEUVRES) for k in range(trials))
    if case.hidden and case.sigma:
        size(case, seed, tuple(w for k, w in enumerate(which) if k != held), seconds)
    rng = np.random.default_rng([seed, 1])
    c = chair(np.random.default_rng([seed, 2]), case.hidden)
    kind = senses(rng)
    lines = ['model = "manual"', 'scene = "flat"']
    for k, w in enumerate(which):
        man = MANOEUVRES[w]
        time, states, torque = drive(c, man, seconds, 1000 * seed + k)
        when, columns = sense(rng, kind, time, exact(c, time, states), case)
        table = {"time": when, **columns}
        if man.torque:
            for i, name in enumerate(("left_wheel", "right_wheel")):
                table[name] = np.interp(when, time, torque[:, i])
        file = f"{man.name}_{k}.csv"
        _write(folder / file, table)
        lines += ["", "[[trial]]", f'file = "{file}"', f'manoeuvre = "{man.name}"']
        lines += ["hold_out = true"] if k == held else []
    (folder / "study.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    seal(folder / SEAL, case)
