"""The tasks by name.

In: the name of a task and its options. Out: its environment for dm_control, or a description of its
observed quantities.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import dm_env
import mujoco
from dm_control.mujoco import engine

from mjchair.errors import MjchairError, nearest
from mjchair.model.spec import load_spec
from mjchair.tasks import (
    arena,
    follow_path,
    given,
    power_doorway,
    power_slalom,
    push,
    ramp_hold,
    slalom,
    straight_line,
    tight_turn,
)
from mjchair.tasks.environment import Environment
from mjchair.tasks.task import ChairTask
from mjchair.units import with_unit


@dataclass(frozen=True)
class Entry:
    """How a task is made.

    Attributes:
      task: its class. spec: makes the specification of its scene. time_limit: of an episode, s.
    """

    task: type[ChairTask]
    spec: Callable[..., mujoco.MjSpec]
    time_limit: float


TASKS: Mapping[str, Entry] = {
    "straight_line": Entry(
        straight_line.StraightLine, straight_line.spec, straight_line.TIME_LIMIT
    ),
    "slalom": Entry(slalom.Slalom, slalom.spec, slalom.TIME_LIMIT),
    "follow_path": Entry(follow_path.FollowPath, follow_path.spec, follow_path.TIME_LIMIT),
    "ramp_hold": Entry(ramp_hold.RampHold, ramp_hold.spec, ramp_hold.TIME_LIMIT),
    "tight_turn": Entry(tight_turn.TightTurn, tight_turn.spec, tight_turn.TIME_LIMIT),
    "push": Entry(push.Push, push.spec, push.TIME_LIMIT),
    "power_slalom": Entry(power_slalom.PowerSlalom, power_slalom.spec, power_slalom.TIME_LIMIT),
    "power_doorway": Entry(
        power_doorway.PowerDoorway, power_doorway.spec, power_doorway.TIME_LIMIT
    ),
}


def load(
    name: str,
    task_kwargs: Mapping[str, Any] | None = None,
    environment_kwargs: Mapping[str, Any] | None = None,
    *,
    visual_geoms: bool = True,
    pixels: Mapping[str, Any] | bool = False,
    scene_kwargs: Mapping[str, Any] | None = None,
) -> dm_env.Environment:
    """A task as a dm_control environment, which calls the native tires in this process.

    An action is two torques (N m), on the left and the right wheel, for 0.02 s; of the tasks whose
    names begin with `power_` it is the joystick, forward and to the left, -1 to 1. `describe(name)`
    lists the observed quantities. Rewards are between 0 and 1. Every random choice comes from the
    task's random state: the same `random` gives the same episodes, to the bit.

    Args:
      name: one of TASKS.
      task_kwargs: arguments of the task: `random` is a seed or a RandomState; follow_path has also
        `path` and `speed`.
      environment_kwargs: arguments of dm_control's Environment, such as flat_observation.
      visual_geoms: False leaves out geoms that are only for display: faster, but there is no chair
        to film.
      pixels: True, or render_kwargs such as {"height": 84, "width": 84, "camera_id": "follow"}:
        pictures are observed as well, as "pixels".
      scene_kwargs: options of load_spec (scene, grade, tilt, tire, ...), for follow_path.

    Raises:
      MjchairError: an unknown name of a task, an option or a camera, no seed, a size that cannot
        be drawn, or pixels with visual_geoms=False.
    """
    entry = find(name)
    _check_options(entry, task_kwargs or {}, environment_kwargs or {}, scene_kwargs or {})
    if pixels and not visual_geoms:
        raise MjchairError("pixels need the visual geoms; remove visual_geoms=False")
    physics = arena.physics(entry.spec(**dict(scene_kwargs or {})), visual_geoms)
    options = {
        "time_limit": entry.time_limit,
        "control_timestep": arena.CONTROL_STEP,
        **dict(environment_kwargs or {}),
    }
    environment = Environment(physics, entry.task(**dict(task_kwargs or {})), **options)
    if not pixels:
        return environment
    from dm_control.suite.wrappers.pixels import Wrapper

    chosen = {"height": 84, "width": 84, "camera_id": "follow"}
    chosen |= pixels if isinstance(pixels, Mapping) else {}
    model = physics.model
    given.check_names("option of pixels", chosen, engine.Physics.render, "self")
    given.check_picture(chosen, [model.id2name(i, "camera") for i in range(model.ncam)])
    return Wrapper(environment, pixels_only=False, render_kwargs=chosen)


def _check_options(
    entry: Entry,
    task: Mapping[str, Any],
    environment: Mapping[str, Any],
    scene: Mapping[str, Any],
) -> None:
    """Refuse options that a task does not have."""
    given.check_names("option of the task", task, entry.task)
    given.check_seed(task.get("random"))
    given.check_names("option of the environment", environment, Environment, "physics", "task")
    if scene:
        free = "options" in inspect.signature(entry.spec).parameters
        given.check_names("option of the scene", scene, load_spec if free else entry.spec)


def find(name: str) -> Entry:
    """The entry of a task in TASKS.

    Raises:
      MjchairError: there is no task of that name.
    """
    if name not in TASKS:
        raise MjchairError(f"unknown task {name!r}" + nearest(name, TASKS))
    return TASKS[name]


def describe(name: str) -> str:
    """The observed quantities of a task, a line for each: name, shape, unit, bounds, meaning.

    Raises:
      MjchairError: there is no task of that name.
    """
    lines = [
        f"{with_unit(f'{q.name} {q.shape}', q.unit)} [{q.low}, {q.high}]: {q.text}"
        for q in find(name).task(random=0).quantities
    ]
    return "\n".join(lines)
