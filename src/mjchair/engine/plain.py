"""The same callbacks as ordinary Python, through the bindings: to read, to debug, to change."""

from __future__ import annotations

import mujoco
from mujoco import mjtStage

from mjchair.engine import element, wheel
from mjchair.engine.views import data_view, model_view


def act_dyn(model: mujoco.MjModel, data: mujoco.MjData, actuator: int) -> float:
    """`mjcb_act_dyn`: the tire of one actuator, if it is a tire's."""
    wheel.act_dyn(model_view(model), data_view(data), actuator)
    return 0.0


def sensor(model: mujoco.MjModel, data: mujoco.MjData, stage: int) -> None:
    """`mjcb_sensor`: loads into the state, and mjchair's sensors."""
    if stage == mjtStage.mjSTAGE_ACC:
        wheel.sense(model_view(model), data_view(data))


def act_bias(model: mujoco.MjModel, data: mujoco.MjData, actuator: int) -> float:
    """`mjcb_act_bias`: the force of one element, if the actuator is one."""
    return float(element.force(model_view(model), data_view(data), actuator))
