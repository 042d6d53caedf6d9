"""Points of action and directions of the tire forces at a sample of a recording.

In: a recording, its model and a sample. Out: for each wheel the place of its contact with the
ground, and its forces as vectors in the world's axes.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.engine.ground_contact import GroundContact, ground_contacts
from mjchair.simulation.floor import tire_geoms
from mjchair.simulation.recording import Recording

Array = NDArray[np.float64]

COMPONENTS = {"lateral": "Fy", "longitudinal": "Fx", "load": "Fz"}


@dataclass(frozen=True)
class WheelForces:
    """The forces of one wheel at one sample, world axes.

    Attributes:
      wheel: its name.
      contact: (3,), m, the contact with the ground; in the air the tire's lowest point.
      forces: component of COMPONENTS -> (3,), N.
      left: (3,), the wheel's spin axis, pointing to the chair's left.
    """

    wheel: str
    contact: Array
    forces: dict[str, Array]
    left: Array


def wheel_forces(
    model: mujoco.MjModel, data: mujoco.MjData, recording: Recording, sample: int
) -> list[WheelForces]:
    """The forces of every wheel at a sample, at the contacts that the simulation had there.

    Args:
      model: of the recording. data: with that sample's positions; its contacts are computed here.
      recording: what was recorded. sample: index into it.
    """
    geoms = tire_geoms(model)
    contacts = ground_contacts(model, data, geoms.values())
    wheels = []
    for wheel in recording.wheels:
        geom = geoms[wheel]
        contact = contacts.get(geom) or _in_the_air(model, data, geom)
        axes = {"longitudinal": contact.forward, "lateral": contact.left, "load": contact.normal}
        forces = {
            name: recording[f"{wheel}_tire.{COMPONENTS[name]}"][sample] * axis
            for name, axis in axes.items()
        }
        spin_axis = data.geom_xmat[geom].reshape(3, 3)[:, 2].copy()
        wheels.append(WheelForces(wheel, contact.place, forces, spin_axis))
    return wheels


def _in_the_air(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> GroundContact:
    """The lowest point of a tire that touches nothing, over level ground; its forces are zero."""
    axes = data.geom_xmat[geom].reshape(3, 3)
    up = np.array([0.0, 0.0, 1.0])
    # an ellipsoid's lowest point: centre + A (size^2 * A^T d) / |size * A^T d|
    down = model.geom_size[geom] * (axes.T @ -up)
    place = data.geom_xpos[geom] + axes @ (model.geom_size[geom] * down) / np.linalg.norm(down)
    forward = np.cross(axes[:, 2], up)
    forward /= max(float(np.linalg.norm(forward)), 1e-9)
    return GroundContact(place, up, forward, np.cross(up, forward))


def round_up(value: float) -> float:
    """The next of 1, 2 and 5 times a power of ten."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(next(step * power for step in (1, 2, 5, 10) if step * power >= 0.999 * value))
