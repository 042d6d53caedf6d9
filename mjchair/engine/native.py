"""The compiled callbacks: C functions that MuJoCo calls without Python and without its lock.

In: the offsets of mjchair.engine.layout. Out: the callbacks `act_dyn`, `sensor` and `act_bias`, the
one that only a moving rider needs, and the collision function of a height field and a tire. They
make the views of mjchair.engine.views from the addresses that MuJoCo passes, and call the functions
of wheel.py, element.py, field.py, bias_force.py and mass_centre.py.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, NamedTuple

import mujoco
from llvmlite import binding, ir
from mujoco import mjtStage
from numba import carray, cfunc, types
from numba.extending import intrinsic, register_jitable

from mjchair.engine import (
    bias_force,
    collision,
    compiling,
    element,
    field,
    layout,
    mass_centre,
    wheel,
)
from mjchair.engine.views import (
    CONTACT,
    DataView,
    FieldDataView,
    FieldModelView,
    ModelView,
    Rows,
    Value,
    member_of,
    members,
)
from mjchair.tire import block
from mjchair.tire.compiled import DRIVE, ENGINE, TIRE, fingerprint

STAGE_VEL, STAGE_ACC = int(mjtStage.mjSTAGE_VEL), int(mjtStage.mjSTAGE_ACC)
NATIVE = "mjchair_native_field_contact"  # MuJoCo's own function, under this name for the linker
COLLISION = types.int32(
    types.int64, types.int64, types.int64, types.int32, types.int32, types.float64
)  # model, data, contacts to fill, two geoms, margin -> how many were filled
native_contact = types.ExternalFunction(NATIVE, COLLISION)
COM_VEL, RNE = "mjchair_mj_comVel", "mjchair_mj_rne"  # MuJoCo's own, likewise
com_vel = types.ExternalFunction(COM_VEL, types.void(types.int64, types.int64))
rne = types.ExternalFunction(RNE, types.void(types.int64, types.int64, types.int32, types.int64))
BYTES = {"float64": 8, "int32": 4}  # of a number of a contact
MANY = 1 << 40  # bounds are not checked: only the trailing sizes matter


@intrinsic
def _pointer(typingctx: Any, address: Any, kind: Any) -> Any:
    """A typed pointer from an address."""
    target = types.CPointer(kind.dtype)

    def build(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.inttoptr(args[0], context.get_value_type(target))

    return target(address, kind), build


@intrinsic
def _load(typingctx: Any, address: Any, kind: Any) -> Any:
    """The number of the given kind that lies at an address."""

    def build(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        value = context.get_value_type(kind.dtype)
        return builder.load(builder.inttoptr(args[0], ir.PointerType(value)), typ=value)

    return kind.dtype(address, kind), build


class Sizes(NamedTuple):
    """Offsets in bytes of sizes and of the contact array, and the size of one contact."""

    nuser_geom: int
    nuser_sensor: int
    nuser_actuator: int
    ncon: int
    contact: int
    contact_size: int


def _reader(view: Any) -> Callable[..., Any]:
    """The compiled function that makes a view from memory.

    It takes the address of the struct, the offsets under the view's names (of contact fields: from
    a contact's start) and the sizes. Numba compiles the text that is written here, a line a field,
    because it cannot loop over fields of different types.
    """
    fields = [_expression(name, of) for name, of in members(view).items()]
    contacts = [
        "    count = _load(base + sizes.ncon, types.int32)",
        "    first = _load(base + sizes.contact, types.int64)",
        *(
            f"    in_{kind} = carray("
            f"_pointer(first, types.{kind}), (count, sizes.contact_size // {size}))"
            for kind, size in BYTES.items()
        ),
    ]
    lines = [
        "def read(base, at, sizes):",
        *(contacts if any(name.startswith(CONTACT) for name in members(view)) else ()),
        f"    return view({', '.join(fields)})",
    ]
    scope = {
        "_load": _load,
        "_pointer": _pointer,
        "carray": carray,
        "types": types,
        "MANY": MANY,
        "view": view,
    }
    exec("\n".join(lines), scope)
    made: Callable[..., Any] = register_jitable(forceinline=True)(scope["read"])
    return made


def _expression(name: str, of: Value | Rows) -> str:
    """What reads a field, in compiled code."""
    if isinstance(of, Value):
        if of.length:
            return f"carray(_pointer(base + at.{name}, types.{of.kind}), ({of.length},))"
        return f"_load(base + at.{name}, types.{of.kind})"
    if name.startswith(CONTACT):
        first = f"at.{name} // {BYTES[of.kind]}"
        return f"in_{of.kind}[:, {first}" + (f" : {first} + {of.width}]" if of.width else "]")
    width = (
        f"_load(base + sizes.{of.width}, types.int64)" if isinstance(of.width, str) else of.width
    )
    shape = f"(MANY, {width})" if of.width else "(MANY,)"
    return f"carray(_pointer(_load(base + at.{name}, types.int64), types.{of.kind}), {shape})"


model_view, data_view = _reader(ModelView), _reader(DataView)
field_model_view, field_data_view = _reader(FieldModelView), _reader(FieldDataView)


def _offsets(owner: str, view: Any) -> Any:
    """Offsets in bytes of a view's fields, as such a view; of a contact from its start."""
    return view(
        *(
            layout.offset("mjContact", name.removeprefix(CONTACT))
            if name.startswith(CONTACT)
            else layout.offset(owner, member_of(name, of))
            for name, of in members(view).items()
        )
    )


def _sizes() -> Sizes:
    return Sizes(
        *(layout.offset("mjModel", name) for name in Sizes._fields[:3]),
        layout.offset("mjData", "ncon"),
        layout.offset("mjData", "contact"),
        layout.contact_size(),
    )


def _closure(model: Any, data: Any) -> tuple[str, Any, Any, Sizes]:
    """What a callback closes over: digest of its sources, offsets of its two views, and sizes.

    Raises:
      LayoutError: MuJoCo's memory is not as described.
    """
    layout.check()
    binding.add_symbol(NATIVE, collision.original())
    binding.add_symbol(COM_VEL, layout.address("mj_comVel"))
    binding.add_symbol(RNE, layout.address("mj_rne"))
    sources = fingerprint(*TIRE, *DRIVE, *ENGINE) + mujoco.__version__
    return sources, _offsets("mjModel", model), _offsets("mjData", data), _sizes()


@functools.cache
@compiling.announced
def field_contact() -> Any:
    """The compiled collision function of a height field and an ellipsoid, as a Numba cfunc.

    Raises:
      LayoutError: MuJoCo's memory is not as described.
    """
    sources, om, od, sizes = _closure(FieldModelView, FieldDataView)

    @cfunc(COLLISION, cache=True, error_model="numpy")
    def contact(m: int, d: int, contacts: int, ground: int, tire: int, margin: float) -> int:
        _ = sources
        model = field_model_view(m, om, sizes)
        user = model.geom_user
        if user.shape[1] < block.HEADER or user[tire, block.TAG_AT] != block.TAG:
            return native_contact(m, d, contacts, ground, tire, margin)
        data = field_data_view(d, od, sizes)
        which = model.geom_dataid[ground]
        out = carray(_pointer(contacts, types.float64), (10,))  # the last three: any tangent
        out[7] = out[8] = out[9] = 0.0
        geoms = field.Geoms(data.geom_xpos, data.geom_xmat, model.geom_size)
        heights = field.HeightField(
            model.hfield_data,
            model.hfield_adr[which],
            model.hfield_nrow[which],
            model.hfield_ncol[which],
            model.hfield_size[which, 0],
            model.hfield_size[which, 1],
            model.hfield_size[which, 2],
        )
        return 1 if field.tire_contact(geoms, ground, tire, heights, margin, out) else 0

    return contact


@register_jitable(forceinline=True)
def _extrapolate_bias_force(m: int, d: int, om: Any, od: Any, sizes: Any) -> None:
    """The bias force of a moving rider, if there is one."""
    model, data = model_view(m, om, sizes), data_view(d, od, sizes)
    if bias_force.is_asked_for(model):
        bias_force.step_back(model, data)
        com_vel(m, d)
        rne(m, d, 0, _load(d + od.qacc_smooth, types.int64))
        bias_force.extrapolate(model, data)
        com_vel(m, d)


@functools.cache
@compiling.announced
def rider_sensor() -> Any:
    """The compiled callback `mjcb_sensor` of a moving rider without tires, as a Numba cfunc.

    Raises:
      LayoutError: MuJoCo's memory is not as described.
    """
    sources, om, od, sizes = _closure(ModelView, DataView)

    @cfunc(types.void(types.int64, types.int64, types.int32), cache=True, error_model="numpy")
    def sensor(m: int, d: int, stage: int) -> None:
        _ = sources
        if stage == STAGE_VEL:
            _extrapolate_bias_force(m, d, om, od, sizes)
        elif stage == STAGE_ACC:
            mass_centre.keep(model_view(m, om, sizes), data_view(d, od, sizes))

    return sensor


@functools.cache
@compiling.announced
def callbacks() -> tuple[Any, Any, Any]:
    """The compiled callbacks act_dyn, sensor and act_bias, as Numba cfuncs, cached on disk.

    The values in their closures are part of Numba's cache key, so they are plain numbers and text.
    A function among them would be a new object in every process, and the cache would never match.

    Raises:
      LayoutError: MuJoCo's memory is not as described.
    """
    sources, om, od, sizes = _closure(ModelView, DataView)

    @cfunc(types.float64(types.int64, types.int64, types.int32), cache=True, error_model="numpy")
    def act_dyn(m: int, d: int, actuator: int) -> float:
        _ = sources
        wheel.act_dyn(model_view(m, om, sizes), data_view(d, od, sizes), actuator)
        return 0.0

    @cfunc(types.void(types.int64, types.int64, types.int32), cache=True, error_model="numpy")
    def sensor(m: int, d: int, stage: int) -> None:
        _ = sources
        if stage == STAGE_ACC:
            model, data = model_view(m, om, sizes), data_view(d, od, sizes)
            wheel.sense(model, data)
            mass_centre.keep(model, data)
        elif stage == STAGE_VEL:
            _extrapolate_bias_force(m, d, om, od, sizes)

    @cfunc(types.float64(types.int64, types.int64, types.int32), cache=True, error_model="numpy")
    def act_bias(m: int, d: int, actuator: int) -> float:
        _ = sources
        return element.force(model_view(m, om, sizes), data_view(d, od, sizes), actuator)

    return act_dyn, sensor, act_bias
