"""Wheelchair tasks as dm_control environments, with the native tires on."""

from mjchair.tasks.baselines import baseline
from mjchair.tasks.suite import TASKS, describe, load

__all__ = ["TASKS", "baseline", "describe", "load"]
