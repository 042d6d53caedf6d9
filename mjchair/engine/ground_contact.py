"""Where the ground touches a tire and along which normal, for a state outside of a simulation.

In: a model, and data with positions. Out: the contact that the compiled wheel (engine/wheel.py)
uses in a step from these positions: several contacts of MuJoCo as one, on a kerb, a threshold, a
height field or a plane. The contact depends on the positions alone, so it is computed again
from a recorded position and is equal to the bit to the one that was simulated.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.engine import collision, native
from mjchair.engine.contact import contact_patch, share_stiffness
from mjchair.engine.views import data_view, model_view
from mjchair.engine.wheel import wheel_axes

Array = NDArray[np.float64]


class GroundContact(NamedTuple):
    """The contact of one tire with the ground, (3,) each, in world axes.

    Attributes:
      place: m. normal: of the ground, towards the wheel, 1.
      forward: the wheel's heading in the ground plane, the axis of Fx. left: the axis of Fy.
    """

    place: Array
    normal: Array
    forward: Array
    left: Array


def ground_contacts(
    model: mujoco.MjModel, data: mujoco.MjData, geoms: Iterable[int]
) -> dict[int, GroundContact]:
    """The contacts of tire geoms at the positions in `data`.

    Args:
      model: with tires. data: whose `qpos` counts; positions and contacts are computed anew in
        it. geoms: ids of the tire geoms.

    Returns:
      Geom -> its contact. A tire that touches nothing is left out.

    Raises:
      LayoutError: the installed MuJoCo's memory is not as it describes it.
    """
    before = collision.current()
    collision.put(native.field_contact().address)
    try:
        mujoco.mj_fwdPosition(model, data)
    finally:
        collision.put(before)
    m, d = model_view(model), data_view(data)
    contacts = {}
    for geom in geoms:
        patch = contact_patch(d, geom)
        if patch[0] > 1:
            patch = share_stiffness(m, d, geom)
        _, nx, ny, nz, px, py, pz, ground = patch
        if ground >= 0:
            axes = wheel_axes(d, geom, nx, ny, nz)
            contacts[geom] = GroundContact(
                np.array([px, py, pz]),
                np.array([nx, ny, nz]),
                np.array(axes[:3]),
                np.array(axes[3:6]),
            )
    return contacts
