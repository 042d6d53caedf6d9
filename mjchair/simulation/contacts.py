"""Where the wheels of a recording touched the ground, and along which axes their forces act.

In: a recording. Out: for every wheel and sample the place and the normal of its contact, and the
forward and left axes of its forces. They are equal to the bit to those that the simulation used. A
contact depends on the positions alone, and every recording contains the positions, also one of an
earlier version.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from mjchair.engine.ground_contact import ground_contacts
from mjchair.simulation.floor import tire_geoms
from mjchair.simulation.recording import Recording
from mjchair.simulation.table import Array


@dataclass(frozen=True)
class WheelContacts:
    """The contacts of one wheel over the samples of a recording; NaN where it is off the ground.

    The force on the wheel in world axes is Fx forward + Fy left + Fz normal, with the channels
    `<wheel>_tire.Fx`, `.Fy` and `.Fz` of the same sample. It acts at `place`.

    Attributes:
      place: (n, 3), m, world. normal: (n, 3), of the ground, towards the wheel.
      forward: (n, 3), the wheel's heading in the ground plane. left: (n, 3).
    """

    place: Array
    normal: Array
    forward: Array
    left: Array


def wheel_contacts(
    recording: Recording, samples: Sequence[int] | None = None
) -> dict[str, WheelContacts]:
    """The contacts of every wheel of a recording.

    Args:
      recording: of any simulation. samples: indices of the n samples wanted; None: all.

    Returns:
      Wheel name -> its contacts.

    Raises:
      MjchairError: this MuJoCo cannot read the recorded model.
    """
    model = recording.model.load()
    data = mujoco.MjData(model)
    geoms = {wheel: geom for wheel, geom in tire_geoms(model).items() if wheel in recording.wheels}
    rows = range(recording.time.size) if samples is None else samples
    axes = {wheel: np.full((4, len(rows), 3), np.nan) for wheel in geoms}
    for k, sample in enumerate(rows):
        data.qpos[:] = recording.qpos[sample]
        contacts = ground_contacts(model, data, geoms.values())
        for wheel, geom in geoms.items():
            if geom in contacts:
                axes[wheel][:, k] = contacts[geom]
    return {wheel: WheelContacts(*arrays) for wheel, arrays in axes.items()}
