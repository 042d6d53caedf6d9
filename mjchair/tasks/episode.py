"""An episode of a task as a recording, for replays, films and evaluation.

In: an environment of `mjchair.tasks.load` and a controller. Out: a recording of the episode, with
the rewards as a channel.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import mujoco
import numpy as np

from mjchair.errors import MjchairError
from mjchair.simulation.from_states import FULL, recording_of
from mjchair.simulation.recording import Recording
from mjchair.tasks.baselines import Controller


def record(environment: Any, controller: Controller) -> Recording:
    """One episode, from its reset to its end.

    Args:
      environment: as `load` gives it, with visual geoms. controller: from an observation to an
        action, such as one of `baseline`.

    Returns:
      A recording with one sample for each control step. The channel `reward` has the reward of the
      step that ends at the sample; 0 in the first sample.

    Raises:
      MjchairError: an environment without the physics of a chair, such as a Gymnasium wrapper.
    """
    physics = getattr(environment, "physics", None)
    if physics is None:
        raise MjchairError("record takes an environment of mjchair.tasks.load, not a wrapped one")
    model, data = physics.model.ptr, physics.data.ptr
    step = environment.reset()
    begin = float(data.time)
    times, states, controls, rewards = [], [], [], []
    while True:
        state = np.empty(mujoco.mj_stateSize(model, FULL))
        mujoco.mj_getState(model, data, state, FULL)
        times.append(float(data.time) - begin)
        states.append(state)
        rewards.append(float(step.reward or 0.0))
        if step.last():
            controls.append(data.ctrl.copy())
            break
        step = environment.step(controller(step.observation))
        controls.append(data.ctrl.copy())
    recording = recording_of(model, np.array(times), np.array(states), np.array(controls))
    return replace(
        recording,
        channels={**recording.channels, "reward": np.array(rewards)},
        units={**recording.units, "reward": "1"},
    )
