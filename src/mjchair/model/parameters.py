"""A designer's changes to a chair: where the axle is, which wheels and casters, who sits in it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.errors import MjchairError, nearest
from mjchair.tire import block

Array = NDArray[np.float64]

REAR = {"left_wheel": 1.0, "right_wheel": -1.0}  # and the side they are on, along y
CASTERS = ("left_caster", "right_caster")
# The occupant of the shipped chairs: mass in kg, and the geoms that are its segments with their
# shares of it (de Leva 1996, J Biomech 29, 1223-1230, male; the chairs' READMEs).
OCCUPANT_MASS = 75.0
OCCUPANT = {
    "head": 0.0694,
    "chest": 0.1596,
    "abdomen": 0.1633,
    "pelvis": 0.1117,
    **{
        f"{side}_{part}": share
        for side in ("left", "right")
        for part, share in {
            "upper_arm": 0.0271,
            "forearm": 0.0162,
            "hand": 0.0061,
            "thigh": 0.1416,
            "shank": 0.0433,
            "foot": 0.0137,
        }.items()
    },
}

# Rolling resistance grows as pressure falls: steeply below half the recommended pressure
# (PMC8049518; Sawatzky et al. 2005: 12 and 24 % more energy at 50 and 25 %, of which rolling is
# a part). A power law, its exponent an assumption: 1.32 times at 50 %, 1.74 at 25 %.
PRESSURE_EXPONENT = 0.4
# Share of the stiffness that is the casing's and stays without pressure; assumption.
CASING = 0.2


def change(unit: str, low: float, high: float, text: str) -> float | None:
    """A field that is None for "as the model has it", with its unit, range and meaning."""
    metadata = {"unit": unit, "low": low, "high": high, "text": text}
    return field(default=None, metadata=metadata)  # type: ignore[no-any-return]


@dataclass(frozen=True)
class ChairParameters:
    """What a designer chooses; None leaves the model as it is. Frozen, validated when made.

    Wheels keep their masses when their radius changes, and their inertias go with its square
    (assumption: a bigger rim of the same make would be a little heavier). Their rolling resistance
    goes with 1 / radius (Coulomb's law; the lever arm of the load stays). The frame stays level:
    hubs move up and down with the radius.

    Attributes:
      axle_position: forward of where the model has the rear axle, m.
      wheel_radius: of the rear wheels, m. caster_radius: m.
      caster_trail: from the swivel axis back to the caster's axle, m.
      camber: of the rear wheels, rad, positive with their tops together.
      toe: of the rear wheels, rad, positive with their fronts together.
      track: between the rear hubs, m.
      occupant_mass: kg; the shape stays, mass and inertia scale.
      tire_pressure: of the rear tires, as a share of the recommended pressure, 1. It scales
        slip stiffness and vertical stiffness by 0.2 + 0.8 p, and rolling resistance by
        p^-0.4 (see the constants of this module for sources and assumptions).

    Raises:
      MjchairError: a value out of its range.
    """

    axle_position: float | None = change("m", -0.10, 0.10, "rear axle forward of the model's")
    wheel_radius: float | None = change("m", 0.20, 0.36, "of the rear wheels")
    caster_radius: float | None = change("m", 0.04, 0.11, "of the casters")
    caster_trail: float | None = change("m", 0.01, 0.10, "caster axle behind its swivel axis")
    camber: float | None = change("rad", -0.05, 0.35, "tops of the rear wheels together")
    toe: float | None = change("rad", -0.1, 0.1, "fronts of the rear wheels together")
    track: float | None = change("m", 0.40, 0.90, "between the rear hubs")
    occupant_mass: float | None = change("kg", 5.0, 250.0, "of the occupant")
    tire_pressure: float | None = change("1", 0.1, 2.0, "of the recommended, rear tires")

    def __post_init__(self) -> None:
        """Check every number against its range."""
        for item in fields(self):
            value = getattr(self, item.name)
            low, high = item.metadata["low"], item.metadata["high"]
            if value is not None and not low <= value <= high:
                raise MjchairError(
                    f"{item.name} is {value:g} {item.metadata['unit']}; "
                    f"it must be within {low:g} to {high:g}"
                )

    @staticmethod
    def of(values: Mapping[str, float]) -> ChairParameters:
        """Parameters from names and numbers.

        Raises:
          MjchairError: an unknown name, or a value out of its range.
        """
        known = [item.name for item in fields(ChairParameters)]
        for name in values:
            if name not in known:
                raise MjchairError(f"unknown chair parameter {name!r}" + nearest(name, known))
        return ChairParameters(**values)

    def apply(self, spec: mujoco.MjSpec) -> None:
        """Edit the chair in `spec`, whose tires are set (load_spec does it in this order).

        Raises:
          MjchairError: the specification lacks what a parameter is about.
        """
        for item in fields(self):
            value = getattr(self, item.name)
            if value is not None:
                EDITS[item.name](spec, value)


def _body(spec: mujoco.MjSpec, name: str) -> mujoco.MjsBody:
    body = spec.body(name)
    if body is None:
        raise MjchairError(f"the model has no body {name!r} to change")
    return body


def _tire_geom(spec: mujoco.MjSpec, wheel: str) -> mujoco.MjsGeom:
    geom = spec.geom(f"{wheel}_tire")
    if geom is None:
        raise MjchairError(f"the model has no geom {wheel + '_tire'!r} to change")
    return geom


def _axle_position(spec: mujoco.MjSpec, value: float) -> None:
    for wheel in REAR:
        body = _body(spec, wheel)
        body.pos = np.add(body.pos, (value, 0.0, 0.0))
    site = spec.site("axle")
    site.pos = np.add(site.pos, (value, 0.0, 0.0))


def _set_radius(spec: mujoco.MjSpec, wheel: str, radius: float) -> None:
    """Another radius with the same crown, the hub moved so that the wheel still touches."""
    geom, body = _tire_geom(spec, wheel), _body(spec, wheel)
    old, half = geom.size[0], geom.size[2]
    geom.size = (radius, radius, half * math.sqrt(radius / old))
    tire = np.array(geom.userdata)
    tire[block.RADIUS] = radius
    tire[block.ROLLING_RESISTANCE] *= old / radius
    geom.userdata = tire
    body.pos = np.add(body.pos, (0.0, 0.0, radius - old))
    body.inertia = np.asarray(body.inertia) * (radius / old) ** 2
    _scale_looks(spec, body, geom, radius / old)


def _scale_looks(
    spec: mujoco.MjSpec, body: mujoco.MjsBody, tire: mujoco.MjsGeom, ratio: float
) -> None:
    """Scale what is only seen of a wheel; a ring that both wheels have, once."""
    for geom in body.geoms:
        if geom.name == tire.name or geom.contype or geom.conaffinity:
            continue
        if geom.type != mujoco.mjtGeom.mjGEOM_MESH:
            geom.pos = np.asarray(geom.pos) * (ratio, 1.0, ratio)
            size = np.asarray(geom.size)
            geom.size = size * (1.0, ratio, 1.0) if size[1] > 5.0 * size[0] else size
        elif body.name.startswith("left"):
            mesh = spec.mesh(geom.meshname)
            mesh.scale = np.asarray(mesh.scale) * ratio


def _wheel_radius(spec: mujoco.MjSpec, value: float) -> None:
    old = _tire_geom(spec, "left_wheel").size[0]
    for wheel in REAR:
        _set_radius(spec, wheel, value)
    site = spec.site("axle")
    site.pos = np.add(site.pos, (0.0, 0.0, value - old))


def _caster_radius(spec: mujoco.MjSpec, value: float) -> None:
    for caster in CASTERS:
        _set_radius(spec, caster, value)


def _caster_trail(spec: mujoco.MjSpec, value: float) -> None:
    for caster in CASTERS:
        body = _body(spec, caster)
        body.pos = (-value, body.pos[1], body.pos[2])


def _turn(body: mujoco.MjsBody, angle: float, axis: tuple[float, float, float]) -> None:
    """Turn a body about an axis of its parent."""
    half = 0.5 * angle
    turned = np.zeros(4)
    by = np.r_[math.cos(half), math.sin(half) * np.array(axis)]
    mujoco.mju_mulQuat(turned, by, np.asarray(body.quat))
    body.quat = turned


def _camber(spec: mujoco.MjSpec, value: float) -> None:
    for wheel, side in REAR.items():
        body, size = _body(spec, wheel), _tire_geom(spec, wheel).size
        _turn(body, side * value, (1.0, 0.0, 0.0))
        reach = math.hypot(size[0] * math.cos(value), size[2] * math.sin(value))
        body.pos = np.add(body.pos, (0.0, 0.0, reach - size[0]))


def _toe(spec: mujoco.MjSpec, value: float) -> None:
    for wheel, side in REAR.items():
        _turn(_body(spec, wheel), -side * value, (0.0, 0.0, 1.0))


def _track(spec: mujoco.MjSpec, value: float) -> None:
    for wheel, side in REAR.items():
        body = _body(spec, wheel)
        body.pos = (body.pos[0], side * 0.5 * value, body.pos[2])


def _occupant(spec: mujoco.MjSpec) -> tuple[float, Array, Array]:
    """Mass (kg), centre of mass (3,) m and inertia (3, 3) kg m^2 of the occupant, chair frame."""
    alone = mujoco.MjSpec()
    body = alone.worldbody.add_body(name="occupant")
    body.add_freejoint()
    for name, share in OCCUPANT.items():
        geom = spec.geom(name)
        if geom is None:
            raise MjchairError(f"the model has no geom {name!r}; its occupant cannot be changed")
        body.add_geom(
            type=geom.type,
            pos=geom.pos,
            quat=geom.quat,
            fromto=geom.fromto,
            size=geom.size,
            mass=share * OCCUPANT_MASS,
        )
    model = alone.compile()
    inertia = _matrix(model.body_inertia[1], model.body_iquat[1])
    return float(model.body_mass[1]), model.body_ipos[1].copy(), inertia


def _matrix(principal: Array, quat: Array) -> Array:
    axes = np.zeros(9)
    mujoco.mju_quat2Mat(axes, np.asarray(quat, dtype=np.float64))
    turn = axes.reshape(3, 3)
    return np.asarray(turn @ np.diag(principal) @ turn.T)


def _about(inertia: Array, mass: float, offset: Array) -> Array:
    """Inertia about a point `offset` away from the centre of mass."""
    return inertia + mass * (offset @ offset * np.eye(3) - np.outer(offset, offset))


def _occupant_mass(spec: mujoco.MjSpec, value: float) -> None:
    chair = _body(spec, "chair")
    mass, center, inertia = _occupant(spec)
    added = value / mass - 1.0
    total = chair.mass + added * mass
    old = np.asarray(chair.ipos)
    new = (chair.mass * old + added * mass * center) / total
    matrix = _about(_matrix(chair.inertia, chair.iquat), chair.mass, old - new)
    matrix = matrix + added * _about(inertia, mass, center - new)
    principal, axes = np.linalg.eigh(matrix)
    if np.linalg.det(axes) < 0.0:
        axes[:, 0] *= -1.0
    quat = np.zeros(4)
    mujoco.mju_mat2Quat(quat, axes.ravel())
    chair.mass, chair.ipos, chair.inertia, chair.iquat = total, new, principal, quat


def _tire_pressure(spec: mujoco.MjSpec, value: float) -> None:
    stiffness = CASING + (1.0 - CASING) * value
    for wheel in REAR:
        geom = _tire_geom(spec, wheel)
        tire = np.array(geom.userdata)
        tire[block.STIFFNESS_FACTOR] *= stiffness
        tire[block.ROLLING_RESISTANCE] *= value**-PRESSURE_EXPONENT
        geom.userdata = tire
        # direct solref (-stiffness, -damping): the damping ratio stays
        solref = np.asarray(geom.solref)
        geom.solref = solref * (stiffness, math.sqrt(stiffness))


EDITS: Mapping[str, Callable[[mujoco.MjSpec, float], None]] = {
    "axle_position": _axle_position,
    "wheel_radius": _wheel_radius,
    "caster_radius": _caster_radius,
    "caster_trail": _caster_trail,
    "camber": _camber,
    "toe": _toe,
    "track": _track,
    "occupant_mass": _occupant_mass,
    "tire_pressure": _tire_pressure,
}
