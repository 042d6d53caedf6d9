"""Wheelchair tasks as dm_control environments, with the native tires on.

In: the name of a task and its options. Out: an environment (`load`), a controller that solves the
task (`baseline`), a recording of an episode (`record`), a description of the observed quantities
(`describe`). Where Gymnasium is installed, importing this package registers the tasks there as
`mjchair/<name>-v0`.
"""

from mjchair.tasks import graphics  # isort: skip  # noqa: F401  # must run before dm_control is imported
from mjchair.tasks import gymnasium_environments
from mjchair.tasks.baselines import baseline
from mjchair.tasks.episode import record
from mjchair.tasks.suite import TASKS, describe, load

__all__ = ["TASKS", "baseline", "describe", "load", "record"]

gymnasium_environments.register()
