"""Air on the chair: the drag element, at the occupant's trunk.

In: a specification and a drag area. Out: the specification with a drag element on the chair.
"""

from __future__ import annotations

import mujoco
import numpy as np

from mjchair.engine import element
from mjchair.model import parts

DENSITY = 1.2  # kg/m^3, air at 20 degrees C
PLACE = (0.1, 0.0, 0.8)  # m in the chair's frame: the trunk of a seated person


def add_air(spec: mujoco.MjSpec, name: str, drag_area: float, x: float, y: float) -> None:
    """Add drag (m^2) against the velocity relative to air that moves at x, y (m/s, world)."""
    chair = parts.named(spec.bodies, "chair", "body")
    here = parts.unused_name(spec.sites, name)
    air = parts.unused_name(spec.sites, f"{name}_axes")
    chair.add_site(name=here, pos=PLACE, size=[0.01] * 3, group=4)
    spec.worldbody.add_site(name=air, size=[0.01] * 3, group=4)
    for axis, letter in enumerate("xy"):
        gear = np.zeros(6)
        gear[axis] = 1.0
        actuator = spec.add_actuator(
            name=parts.unused_name(spec.actuators, f"{name}_{letter}"),
            trntype=mujoco.mjtTrn.mjTRN_SITE,
            target=here,
            refsite=air,
            gear=gear,
            gainprm=np.zeros(10),
            biastype=mujoco.mjtBias.mjBIAS_USER,
        )
        numbers = [element.TAG, element.DRAG, axis, 0.5 * DENSITY * drag_area, x, y]
        parts.write_actuator(spec, actuator, numbers)
