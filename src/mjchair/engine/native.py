"""The compiled callbacks: C functions that MuJoCo calls without Python and without its lock."""

from __future__ import annotations

import functools
from typing import Any

import mujoco
from llvmlite import ir
from mujoco import mjtStage
from numba import carray, cfunc, njit, types
from numba.extending import intrinsic

from mjchair.engine import element, layout, wheel
from mjchair.engine.views import DataView, ModelView
from mjchair.tire.compiled import fingerprint

STAGE_ACC = int(mjtStage.mjSTAGE_ACC)
MANY = 1 << 40  # bounds are not checked: only the trailing sizes matter


@intrinsic  # type: ignore[untyped-decorator]
def _pointer(typingctx: Any, address: Any, kind: Any) -> Any:
    """A typed pointer from an address."""
    target = types.CPointer(kind.dtype)

    def build(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.inttoptr(args[0], context.get_value_type(target))

    return target(address, kind), build


@intrinsic  # type: ignore[untyped-decorator]
def _load(typingctx: Any, address: Any, kind: Any) -> Any:
    """The number of the given kind that lies at an address."""

    def build(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        value = context.get_value_type(kind.dtype)
        return builder.load(builder.inttoptr(args[0], ir.PointerType(value)), typ=value)

    return kind.dtype(address, kind), build


@njit(inline="always")  # type: ignore[untyped-decorator]
def _ints(field):  # type: ignore[no-untyped-def]
    """The int32 array that the pointer at the address `field` leads to."""
    return carray(_pointer(_load(field, types.int64), types.int32), (MANY,))


@njit(inline="always")  # type: ignore[untyped-decorator]
def _reals(field):  # type: ignore[no-untyped-def]
    """The float64 array that the pointer at the address `field` leads to."""
    return carray(_pointer(_load(field, types.int64), types.float64), (MANY,))


@njit(inline="always")  # type: ignore[untyped-decorator]
def _rows(field, width):  # type: ignore[no-untyped-def]
    """The same, in rows of `width` numbers."""
    return carray(_pointer(_load(field, types.int64), types.float64), (MANY, width))


def _offsets() -> tuple[ModelView, DataView, tuple[int, int, int, int, int]]:
    """Offsets in bytes, under the names of the views; contact fields from a contact's start.

    The last tuple: nuser_geom, nuser_sensor, nuser_actuator, ncon, contact.
    """
    model = [layout.offset("mjModel", "opt.timestep")]
    model += [layout.offset("mjModel", name) for name in ModelView._fields[1:]]
    data = [
        layout.offset("mjContact", name.removeprefix("contact_"))
        if name.startswith("contact_")
        else layout.offset("mjData", name)
        for name in DataView._fields
    ]
    sizes = (
        layout.offset("mjModel", "nuser_geom"),
        layout.offset("mjModel", "nuser_sensor"),
        layout.offset("mjModel", "nuser_actuator"),
        layout.offset("mjData", "ncon"),
        layout.offset("mjData", "contact"),
    )
    return ModelView(*model), DataView(*data), sizes


@functools.cache
def callbacks() -> tuple[Any, Any, Any]:
    """The compiled `mjcb_act_dyn`, `mjcb_sensor` and `mjcb_act_bias`, as Numba cfuncs (cached on disk).

    Raises:
      LayoutError: MuJoCo's memory is not as described.
    """
    layout.check()
    sources = fingerprint() + mujoco.__version__  # in the closure: part of Numba's cache key
    om, od, (nuser_geom, nuser_sensor, nuser_actuator, ncon, contact) = _offsets()
    size = layout.contact_size()

    @njit(error_model="numpy", forceinline=True)  # type: ignore[untyped-decorator]
    def model_view(m):  # type: ignore[no-untyped-def]
        return ModelView(
            _load(m + om.timestep, types.float64),
            _load(m + om.nsensor, types.int64),
            _ints(m + om.actuator_trntype),
            _ints(m + om.actuator_dyntype),
            _ints(m + om.actuator_actadr),
            carray(_pointer(_load(m + om.actuator_trnid, types.int64), types.int32), (MANY, 2)),
            _rows(m + om.actuator_user, _load(m + nuser_actuator, types.int64)),
            _ints(m + om.site_bodyid),
            _ints(m + om.jnt_bodyid),
            _ints(m + om.body_geomadr),
            _ints(m + om.body_geomnum),
            _ints(m + om.body_rootid),
            _ints(m + om.geom_bodyid),
            _rows(m + om.geom_user, _load(m + nuser_geom, types.int64)),
            _rows(m + om.geom_surfacevel, 6),
            _ints(m + om.sensor_type),
            _ints(m + om.sensor_objtype),
            _ints(m + om.sensor_objid),
            _ints(m + om.sensor_adr),
            _ints(m + om.sensor_dim),
            _rows(m + om.sensor_user, _load(m + nuser_sensor, types.int64)),
        )

    @njit(error_model="numpy", forceinline=True)  # type: ignore[untyped-decorator]
    def data_view(d):  # type: ignore[no-untyped-def]
        count = _load(d + ncon, types.int32)
        first = _load(d + contact, types.int64)
        reals = carray(_pointer(first, types.float64), (count, size // 8))
        ints = carray(_pointer(first, types.int32), (count, size // 4))
        return DataView(
            _load(d + od.time, types.float64),
            _reals(d + od.act),
            _reals(d + od.act_dot),
            _rows(d + od.xfrc_applied, 6),
            _rows(d + od.xipos, 3),
            _rows(d + od.geom_xpos, 3),
            _rows(d + od.geom_xmat, 9),
            _rows(d + od.site_xpos, 3),
            _rows(d + od.site_xmat, 9),
            _rows(d + od.cvel, 6),
            _rows(d + od.subtree_com, 3),
            _reals(d + od.sensordata),
            _reals(d + od.efc_force),
            reals[:, od.contact_dist // 8],
            reals[:, od.contact_pos // 8 : od.contact_pos // 8 + 3],
            reals[:, od.contact_frame // 8 : od.contact_frame // 8 + 9],
            reals[:, od.contact_includemargin // 8],
            ints[:, od.contact_geom // 4 : od.contact_geom // 4 + 2],
            ints[:, od.contact_efc_address // 4],
        )

    @cfunc(types.float64(types.int64, types.int64, types.int32), cache=True, error_model="numpy")  # type: ignore[untyped-decorator]
    def act_dyn(m, d, actuator):  # type: ignore[no-untyped-def]
        _ = sources
        wheel.act_dyn(model_view(m), data_view(d), actuator)
        return 0.0

    @cfunc(types.void(types.int64, types.int64, types.int32), cache=True, error_model="numpy")  # type: ignore[untyped-decorator]
    def sensor(m, d, stage):  # type: ignore[no-untyped-def]
        _ = sources
        if stage == STAGE_ACC:
            wheel.sense(model_view(m), data_view(d))

    @cfunc(types.float64(types.int64, types.int64, types.int32), cache=True, error_model="numpy")  # type: ignore[untyped-decorator]
    def act_bias(m, d, actuator):  # type: ignore[no-untyped-def]
        _ = sources
        return element.force(model_view(m), data_view(d), actuator)

    return act_dyn, sensor, act_bias
