"""Windows in which the simulated chair tips, though no channel shows that it did.

In: the windows' states as a first pass fits them. Out: the largest lean in each window that tips.

Under a hard push a chair whose rider sits still lifts its casters and falls back on them or on its
anti-tippers; a person leans forward, and it does not. From such a motion no small change leads to
the measured one: linear algebra around it asked for 30 kg less on a basketball chair, and what it
left passed for noise. A chair leans as well where it rolls over something, so that only one on a
plane is said to tip.
"""

from __future__ import annotations

import math

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.diagnosis.replay.simulator import WindowSimulator
from mjchair.diagnosis.replay.window_states import Track
from mjchair.simulation import standing

TIPS = math.radians(3.0)  # casters 20 mm off the floor; strokes of up to 20 N m make 0.4 degrees
PITCH = "imu_gyro.y"  # a channel that shows a chair tip


def tipped(simulator: WindowSimulator, track: Track) -> dict[int, float]:
    """The largest lean (rad) from where a window begins, of every window that tips unseen."""
    if not is_plane(simulator.base):
        return {}
    runs = simulator.study.runs
    leans = {
        i: largest_lean(simulator.base, track.trace[i]["qpos"])
        for i, w in enumerate(simulator.windows)
        if PITCH not in runs[w.run].trial.channels
    }
    return {i: lean for i, lean in leans.items() if lean > TIPS}


def is_plane(model: mujoco.MjModel) -> bool:
    """Whether all that wheels may touch in the world is planes: no kerb, no uneven floor."""
    fixed = model.geom_bodyid == 0
    solid = (model.geom_contype | model.geom_conaffinity) != 0
    return bool((model.geom_type[fixed & solid] == mujoco.mjtGeom.mjGEOM_PLANE).all())


def largest_lean(model: mujoco.MjModel, qpos: NDArray[np.float64]) -> float:
    """Largest angle (rad) between the chair's z at first and later, at positions (n, nq)."""
    (joint, *_) = standing.chair_joints(model)
    first = standing.upward(model, joint, qpos[:1])[0]
    return float(standing.lean(model, joint, qpos, first).max())
