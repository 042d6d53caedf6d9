"""Chair, scene and tires into one MjSpec."""

from __future__ import annotations

import ctypes
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
from mjchair.errors import MjchairError, nearest
from mjchair.model import assets
from mjchair.model.ground import FLOOR, set_heights, set_step
from mjchair.model.parameters import ChairParameters
from mjchair.model.wheels import SUFFIX, WHEELS, base_name, check, cut_damping, wheels
from mjchair.tire import Tire, block

TireChoice = str | os.PathLike[str] | Tire
GROUPS = {"wheels": WHEELS[:2], "casters": WHEELS[2:]}
DEFAULT_TIRES = {"wheels": "wheelchair", "casters": "caster"}


def load_spec(
    model: str | os.PathLike[str] = "manual",
    scene: str | os.PathLike[str] = "flat",
    tire: TireChoice | Mapping[str, TireChoice] | None = None,
    *,
    grade: float | None = None,
    tilt: str = "floor",
    timestep: float | None = None,
    heights: ArrayLike | None = None,
    step: float | None = None,
    parameters: ChairParameters | None = None,
) -> mujoco.MjSpec:
    """A chair on its tires in a scene, ready to compile.

    The names, sensors and actuators of the result are in the README ("What is in every chair").
    Call `mjchair.install()` before it rolls.

    Args:
      model: a shipped chair, or a path to MJCF. A file that brings a geom `floor` of its own, as
        a saved chair does, is taken whole: the scene is not used, and its tires stay.
      scene: a shipped scene, or a path to MJCF with a geom `floor`, which the chair stands on:
        at its origin, in its orientation.
      tire: a shipped tire, a path, or a Tire for all wheels; or a mapping from wheel names,
        "wheels" or "casters" to those. None: the tires that the file has, else the default ones.
        On a wheel too light for a tire's damping at standstill that damping is cut.
      grade: rise over run of the ramp (along +x) or of the cross slope (along +y), 1.
      tilt: "floor" turns floor and chair in the world; "gravity" leaves them level and turns
        gravity.
      timestep: s; None: the chair's.
      heights: (nrow, ncol), m, of the scene `hfield`; see mjchair.model.ground.set_heights.
      step: height of the scene `kerb` or `threshold`, m.
      parameters: a designer's changes to the chair; see ChairParameters.

    Returns:
      The specification; it has been compiled once, to check it.

    Raises:
      MjchairError: a name or file that is not there, MJCF that does not compile, a wheel without
        a tire, a time step beyond the stability limit of a tire.
    """
    path = assets.find("model", model, assets.chairs())
    spec = _read(path)
    if spec.geom(FLOOR) is None:
        ground = _read(assets.find("scene", scene, assets.scenes()))
        set_grade(ground, str(scene), grade, tilt)
        if step is not None:
            set_step(ground, step)
        spec = _place(spec, ground)
    elif grade is not None:
        raise MjchairError(
            f"{model} brings its own floor, so grade {grade:g} has no scene to tilt; leave it out"
        )
    if heights is not None:
        set_heights(spec, heights)
    if timestep is not None:
        if not (math.isfinite(timestep) and timestep > 0.0):
            raise MjchairError(f"timestep is {timestep:g} s; it must be positive, such as 0.002")
        spec.option.timestep = timestep
    set_tires(spec, tire)
    return finished(spec, parameters)


def finished(spec: mujoco.MjSpec, parameters: ChairParameters | None = None) -> mujoco.MjSpec:
    """The specification with a designer's changes, its tires suited to its wheels, and checked.

    Raises:
      MjchairError: as load_spec does.
    """
    if parameters is not None:
        parameters.apply(spec)
    compiled = compile_spec(spec)
    cut_damping(compiled)
    for wheel in wheels(compiled):
        spec.geom(compiled.geom(wheel.geom).name).userdata = wheel.block
    check(compiled)
    return spec


@functools.cache
def exact_xml() -> None:
    """Let MuJoCo write numbers into XML with all their digits, in this process.

    It writes six by default, and a chair saved so is another chair. MuJoCo has the switch for its
    own tests; where a release lacks it, saved models lose digits and nothing else.
    """
    library = next(Path(mujoco.__file__).parent.glob("libmujoco*"), None)
    switch = getattr(ctypes.CDLL(str(library)), "_mjPRIVATE__set_xml_precision", None)
    if switch is not None:
        switch(17)


def compile_spec(spec: mujoco.MjSpec) -> mujoco.MjModel:
    """The compiled model.

    Raises:
      MjchairError: MuJoCo refuses the specification, in its own words on one line.
    """
    try:
        with _without_callbacks():
            return spec.compile()
    except ValueError as error:
        raise MjchairError(f"the model does not compile: {_one_line(error)}") from None


CALLBACKS = ("act_dyn", "act_bias", "sensor")


@contextmanager
def _without_callbacks() -> Iterator[None]:
    """Python callbacks out inside the block: MuJoCo's compiler calls them, and fails then.

    Native ones stay: simulations on other threads may be running on them.
    """
    found = {name: getattr(mujoco, f"get_mjcb_{name}")() for name in CALLBACKS}
    before = {name: call for name, call in found.items() if isinstance(call, FunctionType)}
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
    """Stand the chair on the scene's floor: at its origin, in its orientation.

    Options that decide how the chair rolls are the chair's.
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
    with _silent(), _without_callbacks():
        scene.attach(chair, frame=scene.worldbody.add_frame(), prefix="")
        scene.modelname = f"{chair.modelname} on {scene.modelname}"
        compile_spec(scene)
        text = scene.to_xml()
    # attached without a prefix, a specification warns whenever it compiles and may differ from
    # what it saves; read back, it is what it saves
    placed = mujoco.MjSpec.from_string(_without_plain_frames(text))
    placed.modelfiledir = folder
    return placed


def _carried(floor: mujoco.MjsGeom, pos: np.ndarray, quat: np.ndarray) -> tuple[np.ndarray, ...]:
    """Position and orientation on the floor of what would stand so at the world's origin."""
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
    """MuJoCo's warnings unheard inside the block."""
    before, quiet = mujoco.MjLogConfig.get(), mujoco.MjLogConfig.get()
    quiet.logto_console = quiet.logto_file = False
    quiet.set()
    heard = mujoco.get_mju_user_warning()  # dm_control sets one
    mujoco.set_mju_user_warning(lambda message: None)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)
            yield
    finally:
        mujoco.set_mju_user_warning(heard)
        before.set()


def set_grade(spec: mujoco.MjSpec, scene: str, grade: float | None, tilt: str = "floor") -> None:
    """Tilt the ground of the scene `ramp` or `cross_slope` to a grade; see `load_spec`.

    Raises:
      MjchairError: a scene without a grade, a grade that is not a finite number, another `tilt`.
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

    Raises:
      MjchairError: an unknown tire or wheel, or a tire file that cannot be read.
    """
    groups = dict(tire) if isinstance(tire, Mapping) else {}
    known = (*WHEELS, *GROUPS)
    for key in groups:
        if key not in known:
            raise MjchairError(f"no wheel {key!r} to put a tire on" + nearest(key, known))
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
        packed = read_tire(choice).block()
        packed[block.RADIUS] = geom.size[0]
        geom.userdata = packed


def read_tire(choice: TireChoice) -> Tire:
    """A tire from a shipped name, a path, or itself.

    Raises:
      MjchairError: no such tire, or a file that cannot be read.
    """
    if isinstance(choice, Tire):
        return choice
    return tire_floor.read(assets.find("tire", choice, assets.tires()))
