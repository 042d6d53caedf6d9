"""A load that is strapped to a chair for some of its runs.

In: a load, and a specification or a compiled model. Out: the chair that carries it.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.model import inertials
from mjchair.model.inertials import Inertial
from mjchair.model.rolling import CHAIR, chair_body, rolling_wheel
from mjchair.model.wheels import WHEELS

Array = NDArray[np.float64]

# frames of geoms and sites that MuJoCo takes from the inertia of their body, which a load moves
_FROM_INERTIA = (
    int(mujoco.mjtSameFrame.mjSAMEFRAME_INERTIA),
    int(mujoco.mjtSameFrame.mjSAMEFRAME_INERTIAROT),
)


@dataclass(frozen=True)
class Load:
    """A point mass on the chair.

    Attributes:
      mass: kg. height: over the ground, m. forward: ahead of the rear axle, m.
    """

    mass: float
    height: float
    forward: float = 0.0


def strap(spec: mujoco.MjSpec, load: Load) -> None:
    """Put a load on the chair of a specification.

    Raises:
      MjchairError: it has no chair.
    """
    place = _place(spec.copy().compile(), load)
    inertials.add_mass(inertials.explicit(spec, CHAIR), load.mass, place)


def loaded(model: mujoco.MjModel, load: Load) -> mujoco.MjModel:
    """A copy of a chair's model that carries a load.

    Raises:
      MjchairError: the model has no chair.
    """
    out = copy.copy(model)
    i = chair_body(out)
    point = Inertial(load.mass, _place(model, load), np.zeros((3, 3)))
    whole = inertials.of_compiled(out, i).plus(point)
    out.body_mass[i], out.body_ipos[i] = whole.mass, whole.centre
    out.body_iquat[i], out.body_inertia[i] = inertials.principal(whole.tensor)
    out.body_sameframe[i] = mujoco.mjtSameFrame.mjSAMEFRAME_NONE
    for frames, bodies in (
        (out.geom_sameframe, out.geom_bodyid),
        (out.site_sameframe, out.site_bodyid),
    ):
        frames[(bodies == i) & np.isin(frames, _FROM_INERTIA)] = 0
    mujoco.mj_setConst(out, mujoco.MjData(out))
    return out


def _place(model: mujoco.MjModel, load: Load) -> Array:
    """Where the load is in the chair's frame, (3,) m."""
    return np.array([rolling_wheel(model, WHEELS[0]).ahead + load.forward, 0.0, load.height])
