"""The chair that is tested: a model, a designer's changes, and the test dummy on it.

In: the name of a shipped chair or a path to MJCF, chair parameters by name, the mass of the dummy,
and the profile of a power chair's controller. Out: MuJoCo specifications of this chair, with and
without its drive, and the ids of its wheels, joints and contact geoms.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.drive.attach import has_drive
from mjchair.drive.files import USUAL
from mjchair.drive.quantities import Drive
from mjchair.errors import MjchairError
from mjchair.model import assets
from mjchair.model.parameters import ChairParameters
from mjchair.model.spec import compile_spec, drive_file, find_drive, finished, load_spec
from mjchair.model.visual_geoms import without_visual_geoms
from mjchair.model.wheels import base_name, wheels
from mjchair.tire import block

Array = NDArray[np.float64]

REAR = ("left_wheel", "right_wheel")
CASTERS = ("left_caster", "right_caster")
LIGHTEST, HEAVIEST = 25.0, 150.0  # kg; ISO 7176-11:2012 begins at 25 kg; upper end: assumption
GRAVITY = 9.81  # m/s^2


@dataclass(frozen=True)
class Draw:
    """How a randomly drawn chair differs from the stated one; see mjchair.testlab.uncertainty.

    Attributes:
      mass: factor of the chair body's mass. forward, up: shift of its centre of mass, m.
      rolling, friction, stiffness: factors of the tires' numbers.
    """

    mass: float = 1.0
    forward: float = 0.0
    up: float = 0.0
    rolling: float = 1.0
    friction: float = 1.0
    stiffness: float = 1.0


@dataclass(frozen=True)
class Design:
    """A chair to test.

    Attributes:
      model: a shipped chair or a path to MJCF.
      occupant: mass of the dummy, kg; None: the occupant of the model.
      parameters: chair parameters by name (see ChairParameters), SI or text with a unit.
      draw: how the chair differs from the stated one; None: it is the stated chair.
      drive: of a power chair: a profile of the chair's own drive, the path of a drive's TOML, or
        a Drive; None: the profile `normal` of its own drive, where it has one.

    Raises:
      MjchairError: a dummy outside 25 to 150 kg; an unknown parameter or a value out of its range;
        an unknown profile, or a profile for a chair without a drive.
    """

    model: str = "manual"
    occupant: float | None = None
    parameters: Mapping[str, Any] = field(default_factory=dict)
    draw: Draw | None = None
    drive: str | Drive | None = None

    def __post_init__(self) -> None:
        """Freeze and check."""
        read = ChairParameters.of(self.parameters).given()
        object.__setattr__(self, "parameters", MappingProxyType(dict(read)))
        if self.occupant is not None and not LIGHTEST <= self.occupant <= HEAVIEST:
            raise MjchairError(
                f"the dummy is {self.occupant:g} kg; it must be within {LIGHTEST:g} to "
                f"{HEAVIEST:g} kg"
            )
        self.chair_parameters()
        if self.drive is not None:
            self.own_drive()

    def __reduce__(self) -> tuple[object, ...]:
        """Pickle as dictionaries, since a mapping proxy cannot be sent to another process."""
        return Design, (self.model, self.occupant, dict(self.parameters), self.draw, self.drive)

    def own_drive(self) -> Drive | None:
        """The drive of the chair; None: a chair without one.

        Raises:
          MjchairError: as mjchair.load_drive does.
        """
        path = assets.find("model", self.model, assets.chairs())
        if self.drive is None and not drive_file(path).is_file():
            return None
        return find_drive(USUAL if self.drive is None else self.drive, path)

    def chair_parameters(self) -> ChairParameters:
        """The chair parameters, with the mass of the dummy among them.

        Raises:
          MjchairError: an unknown name, or a value out of its range.
        """
        given = dict(self.parameters)
        if self.occupant is not None:
            given["occupant_mass"] = self.occupant
        return ChairParameters.of(given)

    def spec(self, visual_geoms: bool = False, driven: bool = False) -> mujoco.MjSpec:
        """The chair on a level floor, as a copy that may be edited.

        Args:
          visual_geoms: keep the geoms that are only for display.
          driven: with the drive of the chair, whose parking brakes are closed then.

        Raises:
          MjchairError: as load_spec does; or the chair does not have two rear wheels and two
            casters.
        """
        key = (
            self.model,
            self.occupant,
            tuple(sorted(self.parameters.items())),
            self.draw,
            visual_geoms,
        )
        spec = _spec(*key).copy()
        drive = self.own_drive() if driven else None
        if drive is not None:
            finished(spec, drive=drive)
        return spec


@functools.lru_cache(maxsize=8)
def _spec(
    model: str,
    occupant: float | None,
    parameters: tuple[tuple[str, Any], ...],
    draw: Draw | None,
    visual_geoms: bool,
) -> mujoco.MjSpec:
    chosen = Design(model, occupant, dict(parameters)).chair_parameters()
    spec = load_spec(model, "flat", parameters=chosen, merge_visual_geoms=False)
    if draw is not None:
        _apply(spec, draw)
    if has_drive(spec):
        raise MjchairError(
            f"{model} has a drive in its MJCF; the tests put it on where they need it: take the "
            "chair without it, with a drive.toml beside its file"
        )
    compiled = compile_spec(spec)
    known = {base_name(wheel.name) for wheel in wheels(compiled)}
    absent = [name for name in (*REAR, *CASTERS) if name not in known]
    if absent:
        raise MjchairError(
            f"{model} has no {' and no '.join(absent)}; the tests need a chair with joints "
            f"{', '.join((*REAR, *CASTERS))}"
        )
    return spec if visual_geoms else without_visual_geoms(spec)


def _apply(spec: mujoco.MjSpec, draw: Draw) -> None:
    chair = next(body for body in spec.bodies if base_name(body.name) == "chair")
    chair.mass *= draw.mass
    chair.inertia = np.asarray(chair.inertia) * draw.mass
    chair.ipos = np.add(chair.ipos, (draw.forward, 0.0, draw.up))
    for geom in spec.geoms:
        if len(geom.userdata) and geom.userdata[block.TAG_AT] == block.TAG:
            tire = np.array(geom.userdata)
            tire[block.ROLLING_RESISTANCE] *= draw.rolling
            tire[block.FRICTION_FACTOR] *= draw.friction
            tire[block.STIFFNESS_FACTOR] *= draw.stiffness
            geom.userdata = tire


@dataclass(frozen=True)
class Parts:
    """The ids of a chair's parts in a compiled model.

    Attributes:
      chair: body. wheels: name -> (geom, body, joint). swivels: caster -> joint.
      brakes: equalities. anti_tippers: geoms with contacts that are anti-tippers by their names.
      solids: the other geoms of the chair that can touch the world.
    """

    chair: int
    geoms: Mapping[str, int]
    bodies: Mapping[str, int]
    joints: Mapping[str, int]
    swivels: Mapping[str, int]
    brakes: tuple[int, ...]
    anti_tippers: tuple[int, ...]
    solids: tuple[int, ...]


def is_anti_tipper(name: str) -> bool:
    """Whether a geom is an anti-tipper by its name, such as left_anti_tip."""
    return "anti_tip" in name or "antitip" in name


def parts(model: mujoco.MjModel) -> Parts:
    """The parts of a compiled chair."""
    by_name = {base_name(wheel.name): wheel for wheel in wheels(model)}
    joints = {base_name(model.joint(i).name): i for i in range(model.njnt)}
    brakes = tuple(
        i
        for i in range(model.neq)
        if model.eq_type[i] == mujoco.mjtEq.mjEQ_JOINT
        and base_name(model.equality(i).name).endswith("_brake")
    )
    tires = {wheel.geom for wheel in by_name.values()}
    touching = [
        i
        for i in range(model.ngeom)
        if (model.geom_contype[i] or model.geom_conaffinity[i])
        and model.geom_bodyid[i] != 0
        and i not in tires
    ]
    anti = tuple(i for i in touching if is_anti_tipper(model.geom(i).name))
    return Parts(
        chair=int(model.jnt_bodyid[joints["chair"]]),
        geoms={name: wheel.geom for name, wheel in by_name.items()},
        bodies={name: wheel.body for name, wheel in by_name.items()},
        joints={name: wheel.joint for name, wheel in by_name.items()},
        swivels={name: joints[f"{name}_swivel"] for name in CASTERS if f"{name}_swivel" in joints},
        brakes=brakes,
        anti_tippers=anti,
        solids=tuple(i for i in touching if i not in anti),
    )


def floor_of(model: mujoco.MjModel) -> int:
    """The geom `floor`."""
    for i in range(model.ngeom):
        if base_name(model.geom(i).name) == "floor":
            return i
    raise MjchairError("the model has no geom named floor; the tests need one")


def reach(model: mujoco.MjModel, data: mujoco.MjData, geom: int, direction: Array) -> float:
    """How far an ellipsoid reaches from its centre along a direction (3,), m."""
    axes = data.geom_xmat[geom].reshape(3, 3)
    return float(np.linalg.norm(model.geom_size[geom] * (direction @ axes)))


def lowest(model: mujoco.MjModel, data: mujoco.MjData, geom: int, up: Array) -> Array:
    """The lowest point (3,) of an ellipsoid, where `up` (3,) points upward."""
    axes = data.geom_xmat[geom].reshape(3, 3)
    size = model.geom_size[geom]
    along = axes @ (size**2 * (up @ axes))
    return np.asarray(data.geom_xpos[geom] - along / np.linalg.norm(size * (up @ axes)))


def center_of_mass(
    model: mujoco.MjModel, data: mujoco.MjData, without: tuple[int, ...] = ()
) -> tuple[float, Array]:
    """Mass (kg) and centre of mass (3,) of all bodies except those in `without`."""
    kept = np.ones(model.nbody, bool)
    kept[0] = False
    kept[list(without)] = False
    mass = model.body_mass[kept]
    return float(mass.sum()), np.asarray(mass @ data.xipos[kept] / mass.sum())
