"""Caster shimmy: the speed from which a caster that is knocked aside begins to flutter.

In: a design. Out: the lowest speed (m/s) at which the flutter of a knocked caster grows, for the
chair as it is and for other values of trail, swivel friction and load.

ISO 7176-32:2022 is about the durability of casters, not about shimmy. The method is that of
laboratory studies (Kauzlarich, Bruning and Thacker, J Rehabil Res Dev 37(3), 2000): roll at a
speed, knock the caster aside, and see whether it settles. Forks and bearings are rigid in this
model, so the test shows only the shimmy that comes from the relaxation length of the tire.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.model.wheels import base_name
from mjchair.testlab.design import Design
from mjchair.testlab.result import Grid, Result, Value
from mjchair.testlab.track import Run, Track, coast

Array = NDArray[np.float64]

NAME = "caster-shimmy"
KNOCK = math.radians(8.0)
SPEEDS = (0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0)  # m/s
TIME = 1.2  # s for which a knocked caster is observed
LEAST = math.radians(0.3)  # smallest swing that is evaluated
FINE = 0.002  # s between two samples of the swivel angle: casters flutter at up to 30 Hz
TRAILS = (0.02, 0.035, 0.05)  # m
FRICTIONS = (0.0, 0.3, 1.0, 3.0)  # factors of the chair's swivel damping
LOADS = (50.0, 75.0, 100.0)  # kg, mass of the dummy


def caster_shimmy(design: Design, *, timestep: float | None = None) -> Result:
    """The speeds from which the casters flutter.

    Returns:
      `shimmy_speed` (m/s; None: no flutter up to 6 m/s), `least_damping_ratio` (1; the smallest
      of all speeds), and one value for each row of the table.
    """
    values: dict[str, Value] = {}
    ratios, run = [], None
    for speed in SPEEDS:
        ratio, run = damping_ratio(design, speed, timestep=timestep)
        ratios.append(ratio)
    values["shimmy_speed"] = _speed_value(_onset(SPEEDS, ratios))
    values["least_damping_ratio"] = Value(min(ratios), "1", note="below 0: the flutter grows")
    rows: list[tuple[float | str | None, ...]] = []
    for name, chosen, factor in _variants(design):
        slower = []
        for speed in SPEEDS[1::2]:
            slower.append(damping_ratio(chosen, speed, factor, timestep)[0])
        onset = _onset(SPEEDS[1::2], slower)
        key = "shimmy_speed_" + name.replace(" ", "_").replace(".", "_")
        values[key] = _speed_value(onset)
        rows.append((name, onset, *slower))
    columns = ("variant", "flutters from, m/s", *(f"damping at {v:g} m/s" for v in SPEEDS[1::2]))
    return Result(
        NAME,
        values,
        setup=[
            f"rolling on the level, casters knocked apart by {math.degrees(KNOCK):g} deg each",
            "rigid forks and bearings; swivel friction as damping",
        ],
        grids=[Grid("Over trail, swivel friction and load", columns, tuple(rows))],
        notes=[
            "Damping ratio: from the decay of the swivel's swings; "
            "an overdamped swivel counts as 1."
        ],
        curves={"as it is": (list(SPEEDS), ratios)},
        axes=("speed, m/s", "damping ratio of the swivel"),
        runs={} if run is None else {"fastest": run},
    )


def _variants(design: Design) -> list[tuple[str, Design, float]]:
    """Names, designs and factors of the swivel damping."""
    variants = []
    for trail in TRAILS:
        changed = replace(design, parameters={**design.parameters, "caster_trail": trail})
        variants.append((f"trail {1000 * trail:g} mm", changed, 1.0))
    for factor in FRICTIONS:
        variants.append((f"swivel friction x {factor:g}", design, factor))
    for load in LOADS:
        variants.append((f"dummy {load:g} kg", replace(design, occupant=load), 1.0))
    return variants


def _speed_value(onset: float | None) -> Value:
    note = "" if onset is not None else f"no flutter up to {SPEEDS[-1]:g} m/s"
    return Value(onset, "m/s", note=note)


def _onset(speeds: tuple[float, ...], ratios: list[float]) -> float | None:
    """Lowest speed at which the damping ratio is 0, by linear interpolation."""
    for k, ratio in enumerate(ratios):
        if ratio < 0.0:
            if k == 0:
                return speeds[0]
            share = ratios[k - 1] / (ratios[k - 1] - ratio)
            return float(speeds[k - 1] + share * (speeds[k] - speeds[k - 1]))
    return None


def damping_ratio(
    design: Design, speed: float, friction: float = 1.0, timestep: float | None = None
) -> tuple[float, Run]:
    """Damping ratio of the left swivel after a knock at a speed (m/s), and the run.

    Args:
      friction: factor of the swivels' damping.
    """

    def edit(spec: mujoco.MjSpec) -> None:
        for joint in spec.joints:
            if base_name(joint.name).endswith("_swivel"):
                joint.damping = np.asarray(joint.damping) * friction

    # to opposite sides, so that the chair does not turn
    knock = {"left_caster": KNOCK, "right_caster": -KNOCK}
    track = Track(design, speed=speed, edit=edit, casters=knock, timestep=timestep)
    address = track.model.jnt_qposadr[track.view.parts.swivels["left_caster"]]
    angles: list[float] = []
    track.drive(
        coast,
        TIME,
        watch=lambda view: angles.append(float(view.data.qpos[address])),
        tick=FINE,
    )
    return _ratio(np.array(angles)), track.run()


def _ratio(angles: Array) -> float:
    """Damping ratio from the logarithmic decrement of the swings' peaks; 1 without swings."""
    signs = np.flatnonzero(np.diff(np.sign(angles)) != 0)
    bounds = [0, *(int(i) + 1 for i in signs), len(angles)]
    peaks = [float(np.abs(angles[a:b]).max()) for a, b in itertools.pairwise(bounds) if b - a > 1]
    peaks = [p for p in peaks if p > LEAST]
    if len(peaks) < 3:
        return 1.0
    # half a swing apart: ln(ratio) = pi zeta / sqrt(1 - zeta^2)
    decrement = (
        float(np.polyfit(np.arange(len(peaks) - 1), np.log(peaks[1:]), 1)[0])
        if len(peaks) > 3
        else math.log(peaks[2] / peaks[1])
    )
    return -decrement / math.hypot(math.pi, decrement)
