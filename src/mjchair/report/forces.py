"""Where the tires' forces act and which way they point, from a recording."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.simulation import names
from mjchair.simulation.initial import tire_geoms
from mjchair.simulation.recording import Recording

Array = NDArray[np.float64]

# One colour a component everywhere: RGB, 0-1. Lateral is green, as in Silva & Dedini (2007).
COLOURS = {
    "lateral": (0.05, 0.65, 0.15),
    "longitudinal": (1.0, 0.50, 0.05),
    "load": (0.12, 0.35, 0.90),
}
COMPONENTS = {"lateral": "Fy", "longitudinal": "Fx", "load": "Fz"}


@dataclass(frozen=True)
class WheelForces:
    """The forces of one wheel at one sample, world axes.

    Attributes:
      wheel: its name.
      contact: (3,), m, the lowest point of the tire.
      forces: component of COLOURS -> (3,), N.
      left: (3,), the wheel's spin axis, pointing to the chair's left.
    """

    wheel: str
    contact: Array
    forces: dict[str, Array]
    left: Array


def ground_normal(model: mujoco.MjModel, data: mujoco.MjData) -> Array:
    """Upward normal (3,) of the plane `floor`; the vertical where there is none."""
    for i, name in enumerate(names.geoms(model)):
        if names.same(name, "floor") and model.geom_type[i] == mujoco.mjtGeom.mjGEOM_PLANE:
            return np.asarray(data.geom_xmat[i].reshape(3, 3)[:, 2], float).copy()
    return np.array([0.0, 0.0, 1.0])


def wheel_forces(
    model: mujoco.MjModel, data: mujoco.MjData, recording: Recording, sample: int
) -> list[WheelForces]:
    """The forces of every wheel at a sample.

    Args:
      model: of the recording. data: with that sample's positions and their kinematics.
      recording: what was recorded. sample: index into it.
    """
    normal = ground_normal(model, data)
    geoms = tire_geoms(model)
    found = []
    for wheel in recording.wheels:
        geom = geoms[wheel]
        axes = data.geom_xmat[geom].reshape(3, 3)
        left = axes[:, 2]
        forward = np.cross(left, normal)
        forward /= np.linalg.norm(forward)
        directions = {
            "longitudinal": forward,
            "lateral": np.cross(normal, forward),
            "load": normal,
        }
        # the ellipsoid's lowest point: centre + A (size^2 * A^T d) / |size * A^T d|
        down = model.geom_size[geom] * (axes.T @ -normal)
        contact = data.geom_xpos[geom] + axes @ (model.geom_size[geom] * down) / np.linalg.norm(
            down
        )
        forces = {
            name: recording[f"{wheel}_tire.{COMPONENTS[name]}"][sample] * direction
            for name, direction in directions.items()
        }
        found.append(WheelForces(wheel, contact, forces, left.copy()))
    return found


def round_up(value: float) -> float:
    """The next of 1, 2 and 5 times a power of ten."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(next(step * power for step in (1, 2, 5, 10) if step * power >= 0.999 * value))


def peak(recording: Recording, component: str, share: float = 99.0) -> float:
    """The size that `share` percent of a component's samples on all wheels stay below, N."""
    values = [np.abs(recording[f"{w}_tire.{COMPONENTS[component]}"]) for w in recording.wheels]
    return float(np.percentile(np.concatenate(values), share)) if values else 0.0
