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

TIPS = math.radians(3.0)  # casters 20 mm off the floor; strokes of up to 20 N m make 0.4 degrees
PITCH = "imu_gyro.y"  # a channel that shows a chair tip


def tipped(simulator: WindowSimulator, track: Track) -> dict[int, float]:
    """The largest lean (rad) from where a window begins, of every window that tips unseen."""
    if not is_plane(simulator.base):
        return {}
    runs = simulator.study.runs
    leans = {
        i: largest_lean(track.trace[i]["qpos"][:, 3:7])
        for i, w in enumerate(simulator.windows)
        if PITCH not in runs[w.run].trial.channels
    }
    return {i: lean for i, lean in leans.items() if lean > TIPS}


def is_plane(model: mujoco.MjModel) -> bool:
    """Whether all that wheels may touch in the world is planes: no kerb, no uneven floor."""
    fixed = model.geom_bodyid == 0
    solid = (model.geom_contype | model.geom_conaffinity) != 0
    return bool((model.geom_type[fixed & solid] == mujoco.mjtGeom.mjGEOM_PLANE).all())


def largest_lean(quaternion: NDArray[np.float64]) -> float:
    """Largest angle (rad) between the upward axis of a body at first and later.

    Args:
      quaternion: (n, 4) of the body, w first, as MuJoCo has it.
    """
    w, x, y, z = quaternion.T
    up = np.stack([2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)])
    return float(np.arccos(np.clip(up[:, 0] @ up, -1.0, 1.0)).max())
