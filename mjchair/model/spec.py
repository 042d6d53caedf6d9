"""Combine a chair, a scene and tires into one MjSpec.

In: names of a shipped chair, scene and tires, or paths to files, and a designer's parameters. Out:
one MjSpec with the chair on the floor of the scene and the tires on its wheels.
"""

from __future__ import annotations

import functools
import math
import os
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import FunctionType
from xml.etree import ElementTree

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from mjchair import tire as tire_floor
from mjchair import units
from mjchair.drive.attach import attach
from mjchair.drive.files import read_drive
from mjchair.drive.quantities import Drive
from mjchair.errors import MjchairError, nearest
from mjchair.model import assets, merged_visual_geoms, mujoco_library, parts, seating
from mjchair.model.engine_warnings import without_engine_warnings
from mjchair.model.ground import FLOOR, read_heights, set_heights, set_step
from mjchair.model.parameters import ChairParameters
from mjchair.model.wheels import (
    REAR_CASTERS,
    SUFFIX,
    WHEELS,
    base_name,
    check,
    cut_damping,
    keep_stiffness,
    wheels,
)
from mjchair.rider import seat
from mjchair.rider.rider import Rider, as_rider
from mjchair.tire import Tire, block

TireChoice = str | os.PathLike[str] | Tire
GROUPS = {"wheels": WHEELS[:2], "casters": (*WHEELS[2:], *REAR_CASTERS)}
DEFAULT_TIRES = {"wheels": "wheelchair", "casters": "caster"}
DRIVE_FILE = "drive.toml"  # beside a power chair's MJCF
STEEPEST = 1.0  # rise over run; wheelchairs are tested on platforms of less than 45 deg


def load_spec(
    model: str | os.PathLike[str] = "manual",
    scene: str | os.PathLike[str] = "flat",
    tire: TireChoice | Mapping[str, TireChoice] | None = None,
    *,
    grade: float | str | None = None,
    tilt: str = "floor",
    timestep: float | None = None,
    heights: ArrayLike | str | os.PathLike[str] | None = None,
    step: float | None = None,
    parameters: ChairParameters | Mapping[str, float | str | bool] | None = None,
    rider: str | Rider = "rigid",
    drive: str | os.PathLike[str] | Drive | None = None,
    merge_visual_geoms: bool = True,
) -> mujoco.MjSpec:
    """A chair on its tires in a scene, ready to compile.

    The names, sensors and actuators of the result are in docs/chairs.md. Call `mjchair.install()`
    before the first step. Without the callbacks the wheels spin without friction and the tire
    sensors show 0.

    Args:
      model: a shipped chair, or a path to MJCF. A file that has its own geom `floor`, such as a
        saved chair, is used as it is: no scene is added, and its tires stay.
      scene: a shipped scene, or a path to MJCF with a geom `floor`; the chair stands at the origin
        of this geom, in its orientation.
      tire: a shipped tire, a path, or a Tire for all wheels; or a mapping from wheel names,
        "wheels" or "casters" to those. None: the tires of the file, or else the default ones. The
        damping of a tire at standstill is reduced on a wheel that is too light for it.
      grade: rise over run of the ramp (along +x) or of the cross slope (along +y), 1; or text such
        as "8%" or "1:12".
      tilt: "floor" turns floor and chair in the world; "gravity" turns gravity, and floor and chair
        stay level.
      timestep: s; None: the chair's.
      heights: of the scene `hfield`: (nrow, ncol), m, or a file of them, or "uneven"; see
        mjchair.model.ground.set_heights and read_heights.
      step: height of the scene `kerb` or `threshold`, m.
      parameters: a designer's changes to the chair: ChairParameters, or a mapping such as
        {"occupant_mass": 82, "camber": "3 deg"}.
      rider: "rigid": the occupant is part of the chair's body. "moving": trunk, head and arms move
        on joints that are driven by inputs (mjchair.rider, docs/rider.md), as do those of a Rider
        with a stature and lengths of its own. A file whose rider moves already keeps it.
      drive: of a power chair, which then takes `joystick_x` and `joystick_y` besides torques
        (docs/power_drive.md): a profile of the chair's own drive, such as "indoor"; the path of a
        drive's TOML, of which the profile `normal` is used; or a Drive. None: torques only, or the
        drive of the file.
      merge_visual_geoms: True merges the display geoms into one mesh for each body and material.
        Appearance and physics stay the same, and a step takes less time
        (mjchair.model.merged_visual_geoms). False keeps them as separate geoms with their names.

    Returns:
      The specification, which has been compiled once as a check.

    Raises:
      MjchairError: an unknown name, a missing file, MJCF that does not compile, a wheel without a
        tire, a time step beyond the stability limit of a tire, of the rider's joints or of the
        drive, a rider that does not fit the chair, or a drive that the chair does not have.
    """
    path = assets.find("model", model, assets.chairs())
    driven = None if drive is None else find_drive(drive, path)
    seated = as_rider(rider)
    if parameters is not None and not isinstance(parameters, ChairParameters):
        parameters = ChairParameters.of(parameters)
    if isinstance(grade, str):
        grade = units.grade(grade)
    spec = _read(path)
    if spec.geom(FLOOR) is None:
        ground = _read(assets.find("scene", scene, assets.scenes()))
        set_grade(ground, str(scene), grade, tilt)
        if step is not None:
            set_step(ground, step)
        spec = _place(spec, ground)
    else:
        for name, value, place in (("grade", grade, "tilt"), ("step", step, "change")):
            if value is not None:
                raise MjchairError(
                    f"{model} brings its own floor, so {name} {value:g} has no scene to {place}; "
                    "leave it out"
                )
        if parameters is not None and parameters.given():
            spec = _resolved(spec)
    if heights is not None:
        given = isinstance(heights, str | os.PathLike)
        set_heights(spec, read_heights(heights) if given else heights)  # type: ignore[arg-type]
    if timestep is not None:
        if not (math.isfinite(timestep) and timestep > 0.0):
            raise MjchairError(f"timestep is {timestep:g} s; it must be positive, such as 0.002")
        spec.option.timestep = timestep
    set_tires(spec, tire)
    compiled = finished(spec, parameters, seated, driven)
    if merge_visual_geoms and not merged_visual_geoms.is_merged(spec):
        merged_visual_geoms.merge(spec, compiled)
    elif not merge_visual_geoms:
        merged_visual_geoms.separate(spec)
    return spec


def finished(
    spec: mujoco.MjSpec,
    parameters: ChairParameters | None = None,
    rider: Rider | None = None,
    drive: Drive | None = None,
) -> mujoco.MjModel:
    """Apply a designer's changes to a chair and adapt the tires to its wheels; the checked model.

    Args:
      spec: edited in place. parameters: None: no changes. rider: a moving rider; None: a rigid one.
      drive: calibrated to the chair's wheels; None: no change.

    Raises:
      MjchairError: as load_spec does.
    """
    if rider is not None or (parameters is not None and parameters.given()):
        merged_visual_geoms.separate(spec)
    if parameters is not None:
        parameters.apply(spec)
    compiled = compile_spec(spec)
    if rider is not None and not seat.is_moving(spec):
        compiled = _let_move(spec, compiled, rider)
    if drive is not None:
        attach(spec, drive, parts.named)
        compiled = compile_spec(spec)
    cut_damping(compiled)
    for wheel in wheels(compiled):
        spec.geom(compiled.geom(wheel.geom).name).userdata = wheel.block
    check(compiled)
    return compiled


def load_drive(
    model: str | os.PathLike[str] = "power", profile: str | os.PathLike[str] = "normal"
) -> Drive:
    """The drive that load_spec uses for a chair, to read or to change its numbers.

    Args:
      model: a shipped chair, or a path to MJCF. profile: of the chair's drive; or the path of a
        drive's TOML.

    Raises:
      MjchairError: an unknown name, a missing file, or a chair without a drive.
    """
    return find_drive(profile, assets.find("model", model, assets.chairs()))


def find_drive(choice: str | os.PathLike[str] | Drive, chair: Path) -> Drive:
    """A drive from a profile of the chair's own file, from the path of a file, or a given Drive.

    Args:
      choice: as load_spec takes it. chair: MJCF file of the chair; its drive is `drive.toml`
        beside it.

    Raises:
      MjchairError: the chair has no drive, or its file has no such profile.
    """
    if isinstance(choice, Drive):
        return choice
    if Path(choice).suffix == ".toml":
        return read_drive(choice)
    path = drive_file(chair)
    if not path.is_file():
        with_drive = [n for n, file in assets.chairs().items() if drive_file(file).is_file()]
        raise MjchairError(
            f"{chair.stem} has no drive: there is no {DRIVE_FILE} beside its file; take a power "
            f"chair ({', '.join(with_drive)}) or give the path of a drive's TOML"
        )
    return read_drive(path, str(choice))


def drive_file(chair: Path) -> Path:
    """The path of a chair's drive file, beside its MJCF file; not every chair has one."""
    return chair.parent / DRIVE_FILE


def _let_move(spec: mujoco.MjSpec, rigid: mujoco.MjModel, rider: Rider) -> mujoco.MjModel:
    """The compiled model with a moving rider; the tires keep their stiffness."""
    seating.remember_masses(spec)
    mass = float(sum(geom.mass for geom in seating.occupant(spec)))
    seat.add(spec, rigid, rider, mass)
    moving = compile_spec(spec)
    seat.tune(spec, moving)
    moving = compile_spec(spec)
    for wheel in wheels(rigid):
        keep_stiffness(spec, rigid, moving, wheel)
    return compile_spec(spec)


@functools.cache
def exact_xml() -> None:
    """Let MuJoCo write numbers into XML with all their digits, in this process.

    MuJoCo writes six digits by default, which changes a saved chair slightly. It has this switch
    for its own tests; with a release that lacks the switch, saved models are less exact.
    """
    switch = getattr(mujoco_library.shared(), "_mjPRIVATE__set_xml_precision", None)
    if switch is not None:
        switch(17)


def compile_spec(spec: mujoco.MjSpec) -> mujoco.MjModel:
    """The compiled model.

    Raises:
      MjchairError: MuJoCo refuses the specification; the message is MuJoCo's, on one line.
    """
    try:
        with without_python_callbacks():
            return spec.compile()
    except ValueError as error:
        raise MjchairError(f"the model does not compile: {_one_line(error)}") from None


CALLBACKS = ("act_dyn", "act_bias", "act_gain", "sensor", "control", "passive")


@contextmanager
def without_python_callbacks() -> Iterator[None]:
    """Remove Python callbacks inside the block, since MuJoCo's compiler would call them and fail.

    Native callbacks stay, since simulations on other threads may need them.
    """
    at_first = {name: getattr(mujoco, f"get_mjcb_{name}")() for name in CALLBACKS}
    before = {name: call for name, call in at_first.items() if isinstance(call, FunctionType)}
    try:
        for name in before:
            getattr(mujoco, f"set_mjcb_{name}")(None)
        yield
    finally:
        for name, callback in before.items():
            getattr(mujoco, f"set_mjcb_{name}")(callback)


def _one_line(error: Exception) -> str:
    return "; ".join(line.strip() for line in str(error).splitlines() if line.strip())


def _read(path: os.PathLike[str]) -> mujoco.MjSpec:
    try:
        return mujoco.MjSpec.from_file(os.fspath(path))
    except ValueError as error:
        raise MjchairError(f"{path} is not a model MuJoCo can read: {_one_line(error)}") from None


def _place(chair: mujoco.MjSpec, scene: mujoco.MjSpec) -> mujoco.MjSpec:
    """Attach the chair to the scene, at the origin of the floor and in its orientation.

    Options that affect the motion of the chair are taken from the chair.
    """
    floor = scene.geom(FLOOR)
    if floor is None:
        raise MjchairError(
            f"scene {scene.modelname!r} has no geom {FLOOR!r} to stand the chair on; name one so"
        )
    exact_xml()
    for field in ("timestep", "integrator", "cone", "tolerance"):
        setattr(scene.option, field, getattr(chair.option, field))
    for body in chair.worldbody.bodies:
        body.pos, body.quat = _carried(floor, body.pos, body.quat)
    chair.default.name = f"{chair.modelname}_default"  # without a name it could not be saved
    folder = chair.modelfiledir
    with _silent(), without_python_callbacks():
        scene.attach(chair, frame=scene.worldbody.add_frame(), prefix="")
        scene.modelname = f"{chair.modelname} on {scene.modelname}"
        compile_spec(scene)
        text = scene.to_xml()
    # A specification with an attachment without prefix warns at each compilation, and may differ
    # from its saved XML. After saving and reading it again, both agree.
    return _read_back(text, chair, folder)


def _read_back(text: str, before: mujoco.MjSpec, folder: str) -> mujoco.MjSpec:
    """The specification that was saved as `text`.

    Saving drops the masses of geoms whose body has an explicit inertial; a designer's changes need
    them, so they are put back. They change nothing else.
    """
    spec = mujoco.MjSpec.from_string(_without_plain_frames(text))
    spec.modelfiledir = folder
    masses = {geom.name: geom.mass for geom in before.geoms if geom.name and geom.mass > 0.0}
    for geom in spec.geoms:
        geom.mass = masses.get(geom.name, geom.mass)
    return spec


def _resolved(spec: mujoco.MjSpec) -> mujoco.MjSpec:
    """The same specification with every orientation as a quaternion and no frames."""
    exact_xml()
    with _silent():
        compile_spec(spec)
        return _read_back(spec.to_xml(), spec, spec.modelfiledir)


def _carried(floor: mujoco.MjsGeom, pos: np.ndarray, quat: np.ndarray) -> tuple[np.ndarray, ...]:
    """Transform a position and orientation relative to the floor into world coordinates."""
    turned, at = np.zeros(4), np.zeros(3)
    mujoco.mju_mulQuat(turned, floor.quat, quat)
    mujoco.mju_rotVecQuat(at, pos, floor.quat)
    return at + floor.pos, turned


def _without_plain_frames(text: str) -> str:
    """MJCF without the frames that change nothing, which PyMJCF cannot read."""
    root = ElementTree.fromstring(text)
    for parent in root.iter():
        for frame in parent.findall("frame"):
            if set(frame.attrib) <= {"name"}:
                at = list(parent).index(frame)
                parent.remove(frame)
                for child in reversed(frame):
                    parent.insert(at, child)
    return ElementTree.tostring(root, encoding="unicode")


@contextmanager
def _silent() -> Iterator[None]:
    """Suppress MuJoCo's warnings and Python's inside the block."""
    with without_engine_warnings(), warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        yield


def set_grade(spec: mujoco.MjSpec, scene: str, grade: float | None, tilt: str = "floor") -> None:
    """Tilt the ground of the scene `ramp` or `cross_slope` to a grade; see `load_spec`.

    Raises:
      MjchairError: a scene without a grade, a grade that is not a number within +-1 (45 deg), or an
        unknown `tilt`.
    """
    if tilt not in ("floor", "gravity"):
        raise MjchairError(f"tilt {tilt!r}" + nearest(tilt, ("floor", "gravity")))
    axes = {"ramp": (0.0, -1.0, 0.0), "cross_slope": (1.0, 0.0, 0.0)}
    if grade is None and tilt == "floor":
        return
    if scene not in axes:
        raise MjchairError(f"scene {scene!r} has no grade" + nearest(scene, axes))
    floor = spec.geom(FLOOR)
    if grade is not None:
        if not math.isfinite(grade):
            raise MjchairError(f"grade is {grade}; it must be a finite rise over run, such as 0.08")
        if abs(grade) > STEEPEST:
            raise MjchairError(
                f"grade is {grade:g} ({100.0 * grade:g} %, {math.degrees(math.atan(grade)):.1f} "
                f"deg); it must be within {-STEEPEST:g} to {STEEPEST:g} (45 deg). "
                f"{abs(grade):g} % is {0.01 * grade:g}"
            )
        half = 0.5 * math.atan(grade)
        floor.quat = np.r_[math.cos(half), math.sin(half) * np.array(axes[scene])]
    if tilt == "gravity":
        down = np.zeros(3)
        back = np.r_[floor.quat[0], -np.asarray(floor.quat[1:])]
        mujoco.mju_rotVecQuat(down, np.asarray(spec.option.gravity), back)
        spec.option.gravity = down
        floor.quat = (1.0, 0.0, 0.0, 0.0)


def set_tires(
    spec: mujoco.MjSpec, tire: TireChoice | Mapping[str, TireChoice] | None = None
) -> None:
    """Write tires into the `user` fields of the geoms named `<wheel>_tire`; see `load_spec`.

    A tire of one side of the vehicle is mirrored on wheels of the other side (`Tire.on`).

    Raises:
      MjchairError: an unknown tire or wheel, or a tire file that cannot be read.
    """
    groups = dict(tire) if isinstance(tire, Mapping) else {}
    known = (*WHEELS, *REAR_CASTERS, *GROUPS)
    for key in groups:
        if key not in known:
            raise MjchairError(f"no wheel {key!r} to put a tire on" + nearest(key, known))
    read: dict[str, Tire] = {}  # each file once, so that its notes come once
    for geom in spec.geoms:
        if not geom.name.endswith(SUFFIX):
            continue
        wheel = base_name(geom.name).removesuffix(SUFFIX)
        group = "casters" if "caster" in wheel else "wheels"
        choice = groups.get(wheel, groups.get(group))
        if tire is not None and not isinstance(tire, Mapping):
            choice = tire
        if choice is None:
            if len(geom.userdata) and geom.userdata[block.TAG_AT] == block.TAG:
                continue
            choice = DEFAULT_TIRES[group]
        if not isinstance(choice, Tire):
            name = str(choice)
            if name not in read:
                read[name] = read_tire(choice)
            choice = read[name]
        packed = choice.on(wheel.partition("_")[0]).block()
        packed[block.RADIUS] = geom.size[0]
        geom.userdata = packed


def read_tire(choice: TireChoice) -> Tire:
    """A tire from a shipped name or a path, or a given Tire.

    Raises:
      MjchairError: no such tire, or a file that cannot be read.
    """
    if isinstance(choice, Tire):
        return choice
    return tire_floor.read(assets.find("tire", choice, assets.tires()))
