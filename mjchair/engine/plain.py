"""The callbacks as ordinary Python, through the bindings: to read, to debug, to change.

In: what MuJoCo passes to a callback. Out: the same results as those of mjchair.engine.native, from
the same functions, about a hundred times slower.
"""

from __future__ import annotations

import ctypes
import functools
from typing import Any

import mujoco
import numpy as np
from mujoco import mjtStage

from mjchair.engine import bias_force, collision, element, field, layout, mass_centre, wheel
from mjchair.engine.views import data_view, model_view
from mjchair.tire import block

# model, data, contacts to fill, two geoms, margin -> how many were filled
CONTACT = ctypes.CFUNCTYPE(
    ctypes.c_int32,
    ctypes.c_void_p,
    ctypes.c_void_p,
    ctypes.c_void_p,
    ctypes.c_int32,
    ctypes.c_int32,
    ctypes.c_double,
)


def act_dyn(model: mujoco.MjModel, data: mujoco.MjData, actuator: int) -> float:
    """`mjcb_act_dyn`: the tire of one actuator, if it is a tire's."""
    wheel.act_dyn(model_view(model), data_view(data), actuator)
    return 0.0


def sensor(model: mujoco.MjModel, data: mujoco.MjData, stage: int) -> None:
    """`mjcb_sensor`: a rider's bias force, loads into the state, and mjchair's sensors."""
    if stage == mjtStage.mjSTAGE_VEL:
        _extrapolate_bias_force(model, data)
    elif stage == mjtStage.mjSTAGE_ACC:
        m, d = model_view(model), data_view(data)
        wheel.sense(m, d)
        mass_centre.keep(m, d)


def _extrapolate_bias_force(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    m, d = model_view(model), data_view(data)
    if bias_force.is_asked_for(m):
        bias_force.step_back(m, d)
        mujoco.mj_comVel(model, data)
        mujoco.mj_rne(model, data, 0, data.qacc_smooth)
        bias_force.extrapolate(m, d)
        mujoco.mj_comVel(model, data)


def act_bias(model: mujoco.MjModel, data: mujoco.MjData, actuator: int) -> float:
    """`mjcb_act_bias`: the force of one element, if the actuator is one."""
    return float(element.force(model_view(model), data_view(data), actuator))


@functools.cache
def field_contact() -> Any:
    """The collision function of a height field and an ellipsoid, in Python, for C to call.

    Raises:
      LayoutError: MuJoCo's memory is not as described.
    """
    layout.check()
    original = CONTACT(collision.original())

    def contact(m: int, d: int, contacts: int, ground: int, tire: int, margin: float) -> int:
        model = layout.struct("mjModel").from_address(m)
        data = layout.struct("mjData").from_address(d)
        real, whole = ctypes.c_double, ctypes.c_int32
        width = model.nuser_geom
        user = _array(model.geom_user, real, (model.ngeom, width)) if width else np.zeros((0, 0))
        if width < block.HEADER or user[tire, block.TAG_AT] != block.TAG:
            return int(original(m, d, contacts, ground, tire, margin))
        fields = model.nhfield
        which = _array(model.geom_dataid, whole, (model.ngeom,))[ground]
        out = _array(contacts, real, (10,))  # the last three: any tangent
        out[7:] = 0.0
        geoms = field.Geoms(
            _array(data.geom_xpos, real, (model.ngeom, 3)),
            _array(data.geom_xmat, real, (model.ngeom, 9)),
            _array(model.geom_size, real, (model.ngeom, 3)),
        )
        size = _array(model.hfield_size, real, (fields, 4))[which]
        heights = field.HeightField(
            _array(model.hfield_data, ctypes.c_float, (model.nhfielddata,)),
            _array(model.hfield_adr, whole, (fields,))[which],
            _array(model.hfield_nrow, whole, (fields,))[which],
            _array(model.hfield_ncol, whole, (fields,))[which],
            *size[:3],
        )
        return 1 if field.tire_contact(geoms, ground, tire, heights, margin, out) else 0

    return CONTACT(contact)


def _array(address: int, kind: Any, shape: tuple[int, ...]) -> Any:
    """The array of the kind and shape that lies at an address."""
    return np.ctypeslib.as_array(ctypes.cast(address, ctypes.POINTER(kind)), shape)
