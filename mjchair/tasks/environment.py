"""dm_control's environment, with bounds also for flat observations.

In: the physics and a task. Out: an environment whose observation has known bounds, whether it comes
as named parts or as one flat array.
"""

from __future__ import annotations

from collections import OrderedDict

import numpy as np
from dm_control.rl import control
from dm_env import specs


class Environment(control.Environment):  # type: ignore[misc]
    """dm_control's environment; its flat observation has the bounds of the named parts."""

    def observation_spec(self) -> OrderedDict[str, specs.BoundedArray]:
        """Shape and bounds of every part, or of the flat array, which is named "observations"."""
        parts = self._task.observation_spec(self._physics)
        if not self._flat_observation:
            return parts  # type: ignore[no-any-return]
        low = np.concatenate([np.broadcast_to(p.minimum, p.shape) for p in parts.values()])
        high = np.concatenate([np.broadcast_to(p.maximum, p.shape) for p in parts.values()])
        key = control.FLAT_OBSERVATION_KEY
        return OrderedDict({key: specs.BoundedArray(low.shape, np.float64, low, high, name=key)})
