"""The centripetal and gyroscopic forces of a moving rider, taken half a step later.

In: the views of a model and its data (mjchair.engine.views) after MuJoCo's velocity stage. Out:
`qfrc_bias` as it will be in the middle of the step, and a sensor that shows what this adds.

MuJoCo's step takes these forces at its beginning, while it moves the joints by their speed at its
end. Forces that turn with the joints are so half a step late, and the common centre of mass of
rider and chair drifts: by 0.1 mm in 2 s for a trunk that nods by 0.3 rad twice a second. Half the
change over the last step is added here, `1.5 now - 0.5 before` (Adams and Bashforth's second
formula): the sum over all steps is then right to the second order of the step. The speeds of the
step before are those of now less what `qacc_warmstart`, MuJoCo's own record of the last
acceleration, has added; so nothing is kept outside MuJoCo's state. Only a model with the sensor
`rider_bias_force` is touched.
"""

from __future__ import annotations

from mujoco import mjtSensor
from numba.extending import register_jitable

from mjchair.engine.views import DataView, ModelView
from mjchair.rider.bias_sensor import DIM, TAG

SENSOR_USER = int(mjtSensor.mjSENS_USER)


@register_jitable(forceinline=True)
def shows(m: ModelView, sensor: int) -> bool:
    """Whether the sensor is one that asks for the bias force of a rider."""
    return bool(m.sensor_type[sensor] == SENSOR_USER and m.sensor_user[sensor, 0] == TAG)


@register_jitable(forceinline=True)
def is_asked_for(m: ModelView) -> bool:
    """Whether the model has such a sensor."""
    if m.sensor_user.shape[1] > 0:
        for sensor in range(m.nsensor):
            if shows(m, sensor):
                return True
    return False


@register_jitable(forceinline=True)
def step_back(m: ModelView, d: DataView) -> None:
    """Put the speeds of the step before into `qvel`; those of now wait in `qfrc_smooth`.

    MuJoCo writes `qfrc_smooth` and `qacc_smooth` after this stage and does not read them before.
    """
    for i in range(m.nv):
        d.qfrc_smooth[i] = d.qvel[i]
        d.qvel[i] -= m.timestep * d.qacc_warmstart[i]


@register_jitable(forceinline=True)
def extrapolate(m: ModelView, d: DataView) -> None:
    """Bring the speeds back, and add half the change from `qacc_smooth` to `qfrc_bias`.

    The sensor of each rider shows the resultant on his chair (N), along the world's axes.
    """
    for i in range(m.nv):
        d.qvel[i] = d.qfrc_smooth[i]
        added = 0.5 * (d.qfrc_bias[i] - d.qacc_smooth[i])
        d.qfrc_bias[i] += added
        d.qfrc_smooth[i] = added
    for sensor in range(m.nsensor):
        if shows(m, sensor):
            root = m.body_dofadr[m.body_rootid[m.sensor_objid[sensor]]]
            for k in range(DIM):
                d.sensordata[m.sensor_adr[sensor] + k] = -d.qfrc_smooth[root + k]
