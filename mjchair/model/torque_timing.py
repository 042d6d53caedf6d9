"""When torques at the wheels were recorded, against everything else that was.

In: a specification and by how much its torques were recorded late. Out: the same specification,
with that number in the `user` field of the rear wheels' actuators; and the number again, of a
compiled model. Nothing in the engine reads it: whoever gives a model its torques over time
(`Inputs.control_array`) lets each act so much earlier than its table says.

MuJoCo's own delay of an actuator would not do: it can only give a torque later.
"""

from __future__ import annotations

import mujoco

from mjchair.model import parts

TAG = 5066324.0  # "MJT": the actuator's torque is taken from a recording that is late
NUMBERS = 2  # of the block: tag, s


def record_late(spec: mujoco.MjSpec, by: float) -> None:
    """Take the torques of both rear wheels as recorded `by` (s) later than they acted, in place."""
    for wheel in parts.REAR:
        actuator = parts.named(spec.actuators, wheel, "actuator")
        tag, known = (*actuator.userdata, 0.0, 0.0)[:NUMBERS]
        known = known if tag == TAG else 0.0  # nothing else of mjchair writes in this field
        parts.write_actuator(spec, actuator, [TAG, known + by])


def recorded_late(model: mujoco.MjModel, actuator: int) -> float:
    """How much later than it acted an actuator's torque was recorded, s; 0 where nothing says."""
    user = model.actuator_user
    if user.shape[1] < NUMBERS or user[actuator, 0] != TAG:
        return 0.0
    return float(user[actuator, 1])
