"""Wheelchair tasks as dm_control environments, with the native tires on.

Where there is no screen and MUJOCO_GL is not set, it is set to the offscreen OpenGL that works
here, since dm_control chooses its own when it is imported, and chooses one that needs a screen.
"""

from mjchair.tasks import offscreen  # isort: skip  # before dm_control is imported
from mjchair.tasks.baselines import baseline
from mjchair.tasks.suite import TASKS, describe, load

__all__ = ["TASKS", "baseline", "describe", "load", "offscreen"]
