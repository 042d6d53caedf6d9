"""Rolling resistance of a chair on level ground: the measure of forces that matter.

In: the specification of a chair. Out: its rolling resistance on level ground, N.
"""

from __future__ import annotations

import mujoco

from mjchair.engine.install import installed
from mjchair.model import parts
from mjchair.model.wheels import WHEELS, base_name
from mjchair.simulation.channels import channels
from mjchair.simulation.initial import Initial, start
from mjchair.tire import block


def own_resistance(spec: mujoco.MjSpec) -> float:
    """Rolling resistance of a chair that stands on level ground, N."""
    model = spec.copy().compile()
    with installed():
        data = start(model, Initial())
        mujoco.mj_forward(model, data)
    places = {base_name(c.name): c.index for c in channels(model)}
    return sum(
        float(parts.tire_geom(spec, wheel).userdata[block.ROLLING_RESISTANCE])
        * max(float(data.sensordata[places[f"{wheel}_tire.Fz"]]), 0.0)
        for wheel in WHEELS
    )
