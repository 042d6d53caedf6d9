"""A body moves on the chair in step with the strokes; its motion was not measured.

In: the specification of a chair, and the first moments of the harmonics of the motion, that is,
the mass that moves times its forward displacement (kg m). Out: the same chair with the rider's
upper body on a slide along the chair's x. The slide follows a sum of sines and cosines of the phase
of the strokes, which the diagnosis takes from the pushes of every run (columns `stroke_sine_1`,
`stroke_cosine_1` and so on, each within -1 to 1).

Such data determine only the product of mass and displacement. The edit moves the mass of the upper
body; half of this mass with twice the displacement has the same effect on the chair.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import mujoco
import numpy as np

from mjchair.effects.effect import Effect, Parameter, Seed, Values, clip
from mjchair.model import moving_share, slide

JOINT = "stroke_motion"
HARMONICS = 3  # of the phase of the strokes
WAVES = tuple(f"{wave}_{k}" for k in range(1, HARMONICS + 1) for wave in ("sine", "cosine"))
COLUMNS = tuple(f"stroke_{wave}" for wave in WAVES)
# Largest displacement of the common centre of trunk, head and arms from its mean in a stroke, m. A
# trunk with its centre 0.3 m above the hips that bends by 20 deg to both sides of its mean moves by
# 0.10 m; arms (a tenth of the person, a quarter of the moving mass) that swing by 0.2 m add 0.05 m.
# Assumption.
REACH = 0.15
UPPER = 37.0  # kg: head, arms and trunk above the pelvis, 0.491 of 75 kg (de Leva 1996)
# Who pushes moves: a rigid rider misses the speed within a stroke by 0.044 m/s rms, over 19 users
# (Chenier et al. 2016). Weight over most other effects: assumption.
PUSHES = 10.0
CONFIDENCE = 1.96  # standard errors of a 95 % interval


def waves(phase: float | np.ndarray) -> dict[str, np.ndarray]:
    """The course of every column at a phase (rad) of the strokes."""
    angle = np.asarray(phase, np.float64)
    return {
        f"stroke_{name}_{k}": wave(k * angle)
        for k in range(1, HARMONICS + 1)
        for name, wave in (("sine", np.sin), ("cosine", np.cos))
    }


def upper_body(spec: mujoco.MjSpec) -> float:
    """Mass (kg) of the upper body; of a chair without a rider, half of the mass that can move."""
    sitting = moving_share.person(spec)
    return 0.5 * moving_share.most(spec) if sitting is None else sitting[0].mass


def move(spec: mujoco.MjSpec, **moments: float) -> None:
    """Let the rider's upper body move so that its first moment has these harmonics (kg m).

    Raises:
      MjchairError: a chair without a rider that could move.
    """
    if not any(moments.values()):
        return
    moving = moving_share.take(spec, upper_body(spec))
    slide.add(spec, JOINT, moving)
    for k, wave in enumerate(WAVES):
        displacement = moments.get(wave, 0.0) / moving.mass
        slide.drive(spec, JOINT, f"stroke_{wave}", displacement, holds=k == 0)


def first_moment(values: Mapping[str, float], std: Mapping[str, float]) -> tuple[float, float]:
    """Half of the range of the first moment in a stroke, and its standard error, kg m."""
    phase = np.linspace(0.0, 2.0 * math.pi, 361)
    course = waves(phase)
    total = np.sum([values.get(w, 0.0) * course[f"stroke_{w}"] for w in WAVES], axis=0)
    high, low = int(np.argmax(total)), int(np.argmin(total))
    slopes = {w: 0.5 * float(np.diff(course[f"stroke_{w}"][[low, high]])[0]) for w in WAVES}
    error = math.sqrt(sum((slopes[w] * std.get(w, 0.0)) ** 2 for w in WAVES))
    return 0.5 * float(total[high] - total[low]), error


def remark(values: Mapping[str, float], std: Mapping[str, float]) -> str:
    """The meaning of the values, in one sentence."""
    size, error = first_moment(values, std)
    low, high = max(size - CONFIDENCE * error, 0.0), size + CONFIDENCE * error
    return (
        f"a body moves on the chair in step with the strokes: its mass times its displacement goes "
        f"{size:.2f} kg m to both sides of its middle (95 %: {low:.2f} to {high:.2f}), such as "
        f"30 kg by {100.0 * size / 30.0:.1f} cm or 15 kg by {100.0 * size / 15.0:.1f} cm; the mass "
        "alone is not known"
    )


def _most(spec: mujoco.MjSpec) -> Values:
    mass = upper_body(spec)
    return {wave: mass * REACH / _order(wave) for wave in WAVES}


def _least(spec: mujoco.MjSpec) -> Values:
    return {wave: -value for wave, value in _most(spec).items()}


def _order(wave: str) -> int:
    return int(wave.rpartition("_")[2])


PARAMETERS = tuple(
    Parameter(w, "kg m", 0.0, -UPPER * REACH / _order(w), UPPER * REACH / _order(w), scale=0.5)
    for w in WAVES
)


def _seed(parameters: tuple[Parameter, ...]) -> Seed:
    """Where a fit of these harmonics begins: each alone, of a typical size."""

    def combined(coefficients: np.ndarray) -> Values:
        return {
            p.name: clip(p, p.change * float(c))
            for p, c in zip(parameters, coefficients, strict=True)
        }

    def alone(parameter: Parameter) -> Values:
        return {p.name: p.change if p is parameter else 0.0 for p in parameters}

    return Seed(tuple(map(alone, parameters)), combined)


EFFECT = Effect(
    name="rider_motion",
    parameters=PARAMETERS,
    signature="a body moves on the chair in step with the strokes",
    source="bounds: trunk and arms of de Leva (1996), bent by 20 deg to both sides (assumption)",
    edit=move,
    seeds=(_seed(PARAMETERS),),
    measured=COLUMNS[0],
    beside=True,
    most=_most,
    least=_least,
    example={"sine_1": 1.5, "cosine_1": -1.0, "sine_2": 0.3},
    common=PUSHES,
    remark=remark,
)
# A few strokes need no more than a wave, which has a third of the parameters
WAVE = replace(EFFECT, parameters=PARAMETERS[:2], seeds=(_seed(PARAMETERS[:2]),))
