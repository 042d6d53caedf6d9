"""The sensor by which a chair with a moving rider asks for its bias force.

In: the specification of a chair whose rider moves. Out: the same with the sensor
`rider_bias_force`, whose tag mjchair.engine.bias_force looks for.
"""

from __future__ import annotations

import mujoco

NAME = "rider_bias_force"
TAG = 5066322.0  # "MJR", in the sensor's `user` field
DIM = 3


def add(spec: mujoco.MjSpec, chair: str) -> None:
    """Add the sensor, on the body of the chair, in place."""
    spec.add_sensor(
        name=NAME,
        type=mujoco.mjtSensor.mjSENS_USER,
        objtype=mujoco.mjtObj.mjOBJ_BODY,
        objname=chair,
        dim=DIM,
        needstage=mujoco.mjtStage.mjSTAGE_VEL,
        datatype=mujoco.mjtDataType.mjDATATYPE_REAL,
        userdata=[TAG],
    )


def is_in(spec: mujoco.MjSpec) -> bool:
    """Whether the specification has the sensor, under a prefix or none."""
    return any(s.name.endswith(NAME) and TAG in s.userdata for s in spec.sensors)
