"""A designer's parameters of a chair: wheels, casters, seat, masses, and who sits in it.

In: names with values, in SI or as text with a unit. Out: `ChairParameters`, which edit an MjSpec.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from typing import Any

import mujoco
import numpy as np

from mjchair.errors import MjchairError, nearest
from mjchair.model import edits, inertials, merged_visual_geoms, parts, seating
from mjchair.tire import block
from mjchair.units import quantity, with_unit

# Rolling resistance grows as pressure falls: steeply below half the recommended pressure
# (PMC8049518; Sawatzky et al. 2005: 12 and 24 % more energy at 50 and 25 %, of which rolling is
# a part). A power law, its exponent an assumption: 1.32 times at 50 %, 1.74 at 25 %.
PRESSURE_EXPONENT = 0.4
# Share of the stiffness that is the casing's and stays without pressure; assumption.
CASING = 0.2

YES = ("yes", "true", "on", "1")
NO = ("no", "false", "off", "0")


def change(unit: str, low: float, high: float, text: str) -> Any:
    """A field that is None for "as the model has it", with its unit, range and meaning."""
    metadata = {"unit": unit, "low": low, "high": high, "text": text}
    return field(default=None, metadata=metadata)


@dataclass(frozen=True)
class ChairParameters:
    """What a designer chooses; None leaves the model as it is. Frozen, validated when made.

    Wheels of another radius are other wheels: they keep their masses, and their inertias go with
    the square of the radius (assumption: a bigger rim of the same make would be a little heavier).
    Their rolling resistance goes with 1 / radius (Coulomb's law; the lever arm of the load stays).
    The frame stays level: hubs move up and down with radius and camber. Ranges are those in which
    the shipped chairs keep their shape; they are no advice.

    Attributes:
      axle_position: forward of where the model has the rear axle, m.
      wheelbase: from the rear axle to the caster's contact, rolling forward, m.
      track: between the rear hubs, m.
      wheel_radius: of the rear wheels, m.
      wheel_mass: of each rear wheel, kg; its inertia goes along.
      camber: of the rear wheels, rad, positive with their tops together.
      toe: of the rear wheels, rad, positive with their fronts together.
      tire_pressure: of the rear tires, as a share of the recommended pressure, 1. It scales
        slip stiffness and vertical stiffness by 0.2 + 0.8 p, and rolling resistance by
        p^-0.4 (see the constants of this module for sources and assumptions).
      caster_radius: m. caster_trail: from the swivel axis back to the caster's axle, m.
      chair_mass: of the chair without its occupant, kg; wheels and casters keep theirs, the rest
        keeps its shape.
      occupant_mass: kg; the shape stays, mass and inertia scale.
      rider_position: forward of where the model has the occupant, m.
      seat_height: of the front edge of the seat's surface above the ground, m (where ISO 7176-7
        measures it). Feet and footrest stay where they are.
      seat_angle: of the seat from the horizontal, rad, positive with its front up; it turns about
        its front edge.
      back_angle: of the back rest from the vertical, rad, positive reclined; the occupant's trunk
        and arms turn with it about the hips.
      anti_tippers: False takes them off.

    Raises:
      MjchairError: a value out of its range.
    """

    axle_position: float | None = change("m", -0.15, 0.15, "rear axle forward of the model's")
    caster_radius: float | None = change(
        "m", 0.04, 0.15, "of the casters; smaller ones roll harder, as 1 / radius"
    )
    caster_trail: float | None = change("m", 0.01, 0.15, "caster axle behind its swivel axis")
    wheelbase: float | None = change("m", 0.25, 0.80, "rear axle to caster contact")
    track: float | None = change("m", 0.40, 0.90, "between the rear hubs")
    wheel_radius: float | None = change(
        "m", 0.10, 0.36, "of the rear wheels; smaller ones roll harder, as 1 / radius"
    )
    wheel_mass: float | None = change("kg", 0.3, 15.0, "of each rear wheel")
    camber: float | None = change("rad", -0.05, 0.42, "tops of the rear wheels together")
    toe: float | None = change("rad", -0.1, 0.1, "fronts of the rear wheels together")
    tire_pressure: float | None = change("1", 0.1, 2.0, "of the recommended, rear tires")
    seat_height: float | None = change("m", 0.30, 0.80, "front edge of the seat above ground")
    seat_angle: float | None = change("rad", -0.1, 0.5, "seat from the horizontal, front up")
    back_angle: float | None = change("rad", -0.2, 0.8, "back rest from the vertical, reclined")
    chair_mass: float | None = change("kg", 4.0, 250.0, "of the chair without its occupant")
    occupant_mass: float | None = change("kg", 5.0, 250.0, "of the occupant")
    rider_position: float | None = change("m", -0.15, 0.15, "occupant forward of the model's")
    anti_tippers: bool | None = change("yes or no", 0, 1, "no: without them")

    def __post_init__(self) -> None:
        """Check every number against its range."""
        for item in fields(self):
            value = getattr(self, item.name)
            unit, low, high = (item.metadata[key] for key in ("unit", "low", "high"))
            if value is None:
                continue
            if unit == "yes or no":
                if not isinstance(value, bool):
                    raise MjchairError(f"{item.name} is {value!r}; it must be True or False")
                continue
            if isinstance(value, bool | str) or not low <= value <= high:
                told = f"{value:g}" if isinstance(value, float | int) else repr(value)
                raise MjchairError(
                    f"{item.name} is {with_unit(told, unit)}; "
                    f"it must be within {_range(unit, low, high)}"
                )

    @staticmethod
    def of(values: Mapping[str, float | str | bool]) -> ChairParameters:
        """Parameters from names and values: numbers in SI, or text with a unit such as "3 deg".

        Raises:
          MjchairError: an unknown name, a value that is none, or a value out of its range.
        """
        known = {item.name: item.metadata["unit"] for item in fields(ChairParameters)}
        read: dict[str, Any] = {}
        for name, value in values.items():
            if name not in known:
                raise MjchairError(f"unknown chair parameter {name!r}" + nearest(name, known))
            read[name] = _value(name, value, known[name])
        return ChairParameters(**read)

    def given(self) -> dict[str, float | bool]:
        """The parameters that are not None: name -> value in SI."""
        values = {item.name: getattr(self, item.name) for item in fields(self)}
        return {name: value for name, value in values.items() if value is not None}

    def apply(self, spec: mujoco.MjSpec) -> None:
        """Edit the chair in `spec`, whose tires are set (load_spec does it in this order).

        Raises:
          MjchairError: the specification lacks what a parameter is about.
        """
        if self.given():
            with merged_visual_geoms.apart(spec):
                self._edit(spec)

    def _edit(self, spec: mujoco.MjSpec) -> None:
        """Edit the chair, whose parts are separate geoms."""
        seating.remember_masses(spec)
        for name, value in self.given().items():
            try:
                EDITS[name](spec, value)
            except MjchairError as error:
                text = str(error)
                raise MjchairError(text if text.startswith(name) else f"{name}: {text}") from None


NAMES = tuple(item.name for item in fields(ChairParameters))


def _range(unit: str, low: float, high: float) -> str:
    """A range in SI, and angles in degrees besides."""
    text = f"{low:g} to {high:g}"
    if unit == "rad":
        text += f" (in degrees {math.degrees(low):.3g} to {math.degrees(high):.3g}; write 3deg)"
    return text


def _value(name: str, value: float | str | bool, unit: str) -> float | bool:
    """A value of any of the forms that it may be given in, in SI.

    Raises:
      MjchairError: it is none.
    """
    if unit == "yes or no":
        word = str(value).strip().lower()
        if word not in (*YES, *NO):
            raise MjchairError(f"{name} is {value!r}; it must be yes or no")
        return word in YES
    if isinstance(value, str):
        return quantity(value, unit, name)
    if isinstance(value, bool) or not isinstance(value, int | float | np.number):
        raise MjchairError(f"{name} is {value!r}; it must be a number, or text such as '3 deg'")
    return float(value)


def _axle_position(spec: mujoco.MjSpec, value: float) -> None:
    for wheel in parts.REAR:
        body = parts.named(spec.bodies, wheel, "body")
        body.pos = np.add(body.pos, (value, 0.0, 0.0))
    site = parts.named(spec.sites, "axle", "site")
    site.pos = np.add(site.pos, (value, 0.0, 0.0))


def _resize(spec: mujoco.MjSpec, wheels: tuple[str, ...], radius: float) -> float:
    """Put on other wheels of that radius under a level frame; how far the hubs rose (m)."""
    risen, scaled = 0.0, set[str]()
    for wheel in wheels:
        old = edits.set_radius(spec, wheel, radius)
        body = inertials.explicit(spec, wheel)
        body.inertia = np.asarray(body.inertia) * (radius / old) ** 2
        parts.scale_tires(spec, block.ROLLING_RESISTANCE, old / radius, (wheel,))
        risen = radius - old
        edits.raise_hub(spec, wheel, risen)
        _scale_looks(spec, wheel, radius / old, scaled)
    return risen


def _scale_looks(spec: mujoco.MjSpec, wheel: str, ratio: float, scaled: set[str]) -> None:
    """Scale what is only seen of a wheel; a mesh that both wheels have, once.

    Args:
      scaled: names of the meshes that are scaled already; added to.
    """
    body, tire = parts.named(spec.bodies, wheel, "body"), parts.tire_geom(spec, wheel)
    for geom in body.geoms:
        if geom.name == tire.name or geom.contype or geom.conaffinity:
            continue
        if geom.type != mujoco.mjtGeom.mjGEOM_MESH:
            geom.pos = np.asarray(geom.pos) * (ratio, 1.0, ratio)
            size = np.asarray(geom.size)
            geom.size = size * (1.0, ratio, 1.0) if size[1] > 5.0 * size[0] else size
        elif geom.meshname not in scaled:
            scaled.add(geom.meshname)
            mesh = spec.mesh(geom.meshname)
            mesh.scale = np.asarray(mesh.scale) * ratio


def _wheel_radius(spec: mujoco.MjSpec, value: float) -> None:
    risen = _resize(spec, parts.REAR, value)
    site = parts.named(spec.sites, "axle", "site")
    site.pos = np.add(site.pos, (0.0, 0.0, risen))


def _caster_radius(spec: mujoco.MjSpec, value: float) -> None:
    _resize(spec, parts.casters(spec), value)


def _trail(spec: mujoco.MjSpec) -> float:
    """From the swivel axis back to the caster's axle, m."""
    return -float(parts.named(spec.bodies, parts.CASTERS[0], "body").pos[0])


def _caster_trail(spec: mujoco.MjSpec, value: float) -> None:
    for caster in parts.casters(spec):
        body = parts.named(spec.bodies, caster, "body")
        edits.add_trail(spec, caster, value + float(body.pos[0]))


def _wheelbase(spec: mujoco.MjSpec, value: float) -> None:
    stem = parts.named(spec.bodies, f"{parts.CASTERS[0]}_swivel", "body")
    axle = parts.named(spec.bodies, parts.REAR[0], "body")
    seating.move_stems(spec, value + _trail(spec) + float(axle.pos[0]) - float(stem.pos[0]))


def _wheel_mass(spec: mujoco.MjSpec, value: float) -> None:
    for wheel in parts.REAR:
        body = inertials.explicit(spec, wheel)
        body.inertia = np.asarray(body.inertia) * (value / float(body.mass))
        body.mass = value


def _camber(spec: mujoco.MjSpec, value: float) -> None:
    for wheel in parts.REAR:
        before = edits.reach(spec, wheel)
        edits.add_camber(spec, wheel, value - edits.camber(spec, wheel))
        edits.raise_hub(spec, wheel, edits.reach(spec, wheel) - before)


def _toe(spec: mujoco.MjSpec, value: float) -> None:
    for wheel, side in parts.SIDE.items():
        edits.steer_wheel(spec, wheel, -side * (value - edits.toe(spec, wheel)))


def _track(spec: mujoco.MjSpec, value: float) -> None:
    for wheel, side in parts.SIDE.items():
        body = parts.named(spec.bodies, wheel, "body")
        body.pos = (body.pos[0], side * 0.5 * value, body.pos[2])


def _tire_pressure(spec: mujoco.MjSpec, value: float) -> None:
    stiffness = CASING + (1.0 - CASING) * value
    parts.scale_tires(spec, block.STIFFNESS_FACTOR, stiffness, parts.REAR)
    parts.scale_tires(spec, block.ROLLING_RESISTANCE, value**-PRESSURE_EXPONENT, parts.REAR)
    for wheel in parts.REAR:
        geom = parts.tire_geom(spec, wheel)
        # direct solref (-stiffness, -damping): the damping ratio stays
        geom.solref = np.asarray(geom.solref) * (stiffness, math.sqrt(stiffness))


def _anti_tippers(spec: mujoco.MjSpec, value: bool) -> None:
    seating.anti_tippers(spec)
    if not value:
        seating.remove_anti_tippers(spec)


EDITS: Mapping[str, Callable[[mujoco.MjSpec, Any], None]] = {
    "axle_position": _axle_position,
    "caster_radius": _caster_radius,
    "caster_trail": _caster_trail,
    "wheelbase": _wheelbase,
    "track": _track,
    "wheel_radius": _wheel_radius,
    "wheel_mass": _wheel_mass,
    "camber": _camber,
    "toe": _toe,
    "tire_pressure": _tire_pressure,
    "seat_height": seating.set_seat_height,
    "seat_angle": seating.set_seat_angle,
    "back_angle": seating.set_back_angle,
    "chair_mass": seating.set_chair_mass,
    "occupant_mass": seating.set_occupant_mass,
    "rider_position": seating.move_occupant,
    "anti_tippers": _anti_tippers,
}
