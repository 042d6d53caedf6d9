"""The tasks as Gymnasium environments: `gymnasium.make("mjchair/slalom-v0")`, one for every task.

In: the name of a task, from the registry. Out: the dm_control environment of the task in Shimmy's
wrapper for Gymnasium. Importing `mjchair.tasks` registers the tasks where Gymnasium is installed
(extra [tasks]).
"""

from __future__ import annotations

import importlib.util
from collections.abc import Iterable, Mapping
from typing import Any

from mjchair.errors import MjchairError
from mjchair.tasks import process_environment, suite

# arguments of dm_control's render that are used unless the user gives others
PICTURE = {"height": 480, "width": 640, "camera_id": "follow"}


def register(names: Iterable[str] = tuple(suite.TASKS)) -> None:
    """Register tasks in Gymnasium as `mjchair/<name>-v0`; without Gymnasium, do nothing."""
    if importlib.util.find_spec("gymnasium") is None:
        return
    with process_environment.restored():
        import gymnasium

    for name in names:
        key = f"mjchair/{name}-v0"
        if key not in gymnasium.registry:
            gymnasium.register(key, f"{__name__}:make", kwargs={"name": name})


def make(
    name: str,
    render_mode: str | None = None,
    render_kwargs: Mapping[str, Any] | None = None,
    **options: Any,
) -> Any:
    """A task as a Gymnasium environment; `gymnasium.make` calls this.

    Args:
      name: of the task.
      render_mode: of Shimmy: None, "rgb_array", "depth_array", "multi_camera" or "human".
        With None, display geoms are left out, which is faster.
      render_kwargs: of dm_control's render: height and width (pixels), camera_id.
      options: of mjchair.tasks.load: task_kwargs, environment_kwargs, scene_kwargs, pixels,
        visual_geoms.

    Returns:
      The environment (gymnasium.Env). `reset(seed=...)` seeds the task.

    Raises:
      MjchairError: Shimmy is not installed, or as mjchair.tasks.load does.
    """
    drawn = render_mode is not None or bool(options.get("pixels"))
    environment = suite.load(name, **{"visual_geoms": drawn, **options})
    picture = {} if render_mode == "multi_camera" else PICTURE
    try:
        from shimmy import DmControlCompatibilityV0

        return DmControlCompatibilityV0(
            environment, render_mode, {**picture, **(render_kwargs or {})}
        )
    except ImportError as error:
        raise MjchairError(
            f"a Gymnasium environment needs the extra [tasks] ({error}); "
            "pip install 'mjchair[tasks]'"
        ) from None
