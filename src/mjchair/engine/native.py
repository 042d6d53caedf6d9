"""The compiled callbacks: C functions that MuJoCo calls without Python and without its lock."""

from __future__ import annotations

import functools
from typing import Any, NamedTuple

import mujoco
from llvmlite import binding, ir
from mujoco import mjtStage
from numba import carray, cfunc, njit, types
from numba.extending import intrinsic, register_jitable

from mjchair.engine import collision, element, field, layout, wheel
from mjchair.engine.views import DataView, ModelView
from mjchair.tire import block
from mjchair.tire.compiled import fingerprint

STAGE_ACC = int(mjtStage.mjSTAGE_ACC)
NATIVE = "mjchair_native_field_contact"  # MuJoCo's own function, under this name for the linker
COLLISION = types.int32(
    types.int64, types.int64, types.int64, types.int32, types.int32, types.float64
)  # model, data, contacts found, two geoms, margin -> how many
native_contact = types.ExternalFunction(NATIVE, COLLISION)
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


class Sizes(NamedTuple):
    """Offsets in bytes of sizes and of the contact array, and the size of one contact."""

    nuser_geom: int
    nuser_sensor: int
    nuser_actuator: int
    ncon: int
    contact: int
    contact_size: int


@register_jitable(forceinline=True)
def _model_view(m, at, sizes):  # type: ignore[no-untyped-def]
    """The view of the model at the address `m`; `at` holds the offsets under the view's names."""
    return ModelView(
        _load(m + at.timestep, types.float64),
        _load(m + at.nsensor, types.int64),
        _ints(m + at.actuator_trntype),
        _ints(m + at.actuator_dyntype),
        _ints(m + at.actuator_actadr),
        carray(_pointer(_load(m + at.actuator_trnid, types.int64), types.int32), (MANY, 2)),
        _rows(m + at.actuator_user, _load(m + sizes.nuser_actuator, types.int64)),
        _ints(m + at.site_bodyid),
        _ints(m + at.jnt_bodyid),
        _ints(m + at.body_geomadr),
        _ints(m + at.body_geomnum),
        _ints(m + at.body_rootid),
        _ints(m + at.geom_bodyid),
        _rows(m + at.geom_size, 3),
        _rows(m + at.geom_user, _load(m + sizes.nuser_geom, types.int64)),
        _rows(m + at.geom_surfacevel, 6),
        _ints(m + at.sensor_type),
        _ints(m + at.sensor_objtype),
        _ints(m + at.sensor_objid),
        _ints(m + at.sensor_adr),
        _ints(m + at.sensor_dim),
        _rows(m + at.sensor_user, _load(m + sizes.nuser_sensor, types.int64)),
    )


@register_jitable(forceinline=True)
def _data_view(d, at, sizes):  # type: ignore[no-untyped-def]
    """The view of the data at the address `d`; contact offsets count from a contact's start."""
    count = _load(d + sizes.ncon, types.int32)
    first = _load(d + sizes.contact, types.int64)
    reals = carray(_pointer(first, types.float64), (count, sizes.contact_size // 8))
    ints = carray(_pointer(first, types.int32), (count, sizes.contact_size // 4))
    return DataView(
        _load(d + at.time, types.float64),
        _reals(d + at.act),
        _reals(d + at.act_dot),
        _rows(d + at.xfrc_applied, 6),
        _rows(d + at.xipos, 3),
        _rows(d + at.geom_xpos, 3),
        _rows(d + at.geom_xmat, 9),
        _rows(d + at.site_xpos, 3),
        _rows(d + at.site_xmat, 9),
        _rows(d + at.cvel, 6),
        _rows(d + at.subtree_com, 3),
        _reals(d + at.sensordata),
        _reals(d + at.efc_force),
        _reals(d + at.efc_D),
        _reals(d + at.efc_R),
        _load(d + at.nisland, types.int32),
        _reals(d + at.iefc_D),
        _ints(d + at.map_efc2iefc),
        reals[:, at.contact_dist // 8],
        reals[:, at.contact_pos // 8 : at.contact_pos // 8 + 3],
        reals[:, at.contact_frame // 8 : at.contact_frame // 8 + 9],
        reals[:, at.contact_includemargin // 8],
        ints[:, at.contact_geom // 4 : at.contact_geom // 4 + 2],
        ints[:, at.contact_efc_address // 4],
    )


def _offsets() -> tuple[ModelView, DataView, Sizes]:
    """Offsets in bytes, under the names of the views; contact fields from a contact's start."""
    model = [layout.offset("mjModel", "opt.timestep")]
    model += [layout.offset("mjModel", name) for name in ModelView._fields[1:]]
    data = [
        layout.offset("mjContact", name.removeprefix("contact_"))
        if name.startswith("contact_")
        else layout.offset("mjData", name)
        for name in DataView._fields
    ]
    sizes = Sizes(
        layout.offset("mjModel", "nuser_geom"),
        layout.offset("mjModel", "nuser_sensor"),
        layout.offset("mjModel", "nuser_actuator"),
        layout.offset("mjData", "ncon"),
        layout.offset("mjData", "contact"),
        layout.contact_size(),
    )
    return ModelView(*model), DataView(*data), sizes


class FieldOffsets(NamedTuple):
    """Offsets in bytes of what a height field's contact needs, of the model and the data."""

    nuser_geom: int
    geom_user: int
    geom_dataid: int
    geom_size: int
    hfield_adr: int
    hfield_nrow: int
    hfield_ncol: int
    hfield_size: int
    hfield_data: int
    geom_xpos: int
    geom_xmat: int


@functools.cache
def field_contact() -> Any:
    """The compiled collision function of a height field and an ellipsoid, as a Numba cfunc.

    Raises:
      LayoutError: MuJoCo's memory is not as described.
    """
    layout.check()
    sources = fingerprint() + mujoco.__version__
    names = FieldOffsets._fields
    at = FieldOffsets(
        *(layout.offset("mjModel", name) for name in names[:-2]),
        *(layout.offset("mjData", name) for name in names[-2:]),
    )
    binding.add_symbol(NATIVE, collision.original())

    @cfunc(COLLISION, cache=True, error_model="numpy")  # type: ignore[untyped-decorator]
    def contact(m, d, found, ground, tire, margin):  # type: ignore[no-untyped-def]
        _ = sources
        width = _load(m + at.nuser_geom, types.int64)
        if width < block.HEADER or _rows(m + at.geom_user, width)[tire, block.TAG_AT] != block.TAG:
            return native_contact(m, d, found, ground, tire, margin)
        which = _ints(m + at.geom_dataid)[ground]
        out = carray(_pointer(found, types.float64), (10,))  # the last three: a tangent, any
        out[7] = out[8] = out[9] = 0.0
        touches = field.touch(
            _rows(d + at.geom_xpos, 3),
            _rows(d + at.geom_xmat, 9),
            _rows(m + at.geom_size, 3),
            ground,
            tire,
            carray(_pointer(_load(m + at.hfield_data, types.int64), types.float32), (MANY,)),
            _ints(m + at.hfield_adr)[which],
            _ints(m + at.hfield_nrow)[which],
            _ints(m + at.hfield_ncol)[which],
            _rows(m + at.hfield_size, 4),
            which,
            margin,
            out,
        )
        return 1 if touches else 0

    return contact


@functools.cache
def callbacks() -> tuple[Any, Any, Any]:
    """The compiled callbacks act_dyn, sensor and act_bias, as Numba cfuncs, cached on disk.

    What their closures hold is Numba's cache key, so it is plain numbers and text: a function in
    there would be another one in every process, and nothing would ever be found again.

    Raises:
      LayoutError: MuJoCo's memory is not as described.
    """
    layout.check()
    sources = fingerprint() + mujoco.__version__
    om, od, sizes = _offsets()

    @cfunc(types.float64(types.int64, types.int64, types.int32), cache=True, error_model="numpy")  # type: ignore[untyped-decorator]
    def act_dyn(m, d, actuator):  # type: ignore[no-untyped-def]
        _ = sources
        wheel.act_dyn(_model_view(m, om, sizes), _data_view(d, od, sizes), actuator)
        return 0.0

    @cfunc(types.void(types.int64, types.int64, types.int32), cache=True, error_model="numpy")  # type: ignore[untyped-decorator]
    def sensor(m, d, stage):  # type: ignore[no-untyped-def]
        _ = sources
        if stage == STAGE_ACC:
            wheel.sense(_model_view(m, om, sizes), _data_view(d, od, sizes))

    @cfunc(types.float64(types.int64, types.int64, types.int32), cache=True, error_model="numpy")  # type: ignore[untyped-decorator]
    def act_bias(m, d, actuator):  # type: ignore[no-untyped-def]
        _ = sources
        return element.force(_model_view(m, om, sizes), _data_view(d, od, sizes), actuator)

    return act_dyn, sensor, act_bias
