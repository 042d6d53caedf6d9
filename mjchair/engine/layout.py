"""Where the fields of an mjModel, an mjData and a contact lie in memory, and what MuJoCo exports.

In: the name of a struct and of its member, or of a function or table. Out: the offset in bytes, or
the address.

The offsets differ between releases, so none is written down here: they come from MuJoCo's own
description, `mujoco.introspect`. `check` compares every one that is used with the address or the
value that the bindings give for a small model.
"""

from __future__ import annotations

import ctypes
import functools
from typing import Any

import mujoco
from mujoco.introspect import ast_nodes, structs

from mjchair.engine.views import (
    CONTACT,
    DATA_VIEWS,
    MODEL_VIEWS,
    DataView,
    Rows,
    Value,
    member_of,
    members,
)
from mjchair.errors import MjchairError
from mjchair.model import mujoco_library
from mjchair.model.spec import without_python_callbacks

VALUES: dict[str, Any] = {
    "int32": ctypes.c_int32,
    "int64": ctypes.c_int64,
    "float64": ctypes.c_double,
}
_SCALARS: dict[str, type] = {
    "mjtNum": ctypes.c_double,
    "mjtSize": ctypes.c_int64,
    "mjtBool": ctypes.c_uint8,
    "mjtByte": ctypes.c_uint8,
    "int": ctypes.c_int32,
    "float": ctypes.c_float,
    "size_t": ctypes.c_size_t,
    "uintptr_t": ctypes.c_size_t,
    "uint64_t": ctypes.c_uint64,
    "char": ctypes.c_char,
}


def _members(views: tuple[type, ...]) -> dict[str, Value | Rows]:
    """The fields of views without those of contacts, and the sizes that they name."""
    fields: dict[str, Value | Rows] = {}
    for view in views:
        for name, of in members(view).items():
            if name.startswith(CONTACT):
                continue
            fields[member_of(name, of)] = of
            if isinstance(of, Rows) and isinstance(of.width, str):
                fields[of.width] = Value("int64")
    return fields


# what the callbacks read or write, from the views, and how many contacts there are
MODEL = _members(MODEL_VIEWS)
DATA = _members(DATA_VIEWS) | {"ncon": Value("int32")}
# of mjPreContact, which a collision function fills; member -> offset in bytes
PRE_CONTACT = {"dist": 0, "pos": 8, "normal": 32, "tangent": 56}
CONTACT_FIELDS = tuple(
    name.removeprefix(CONTACT) for name in members(DataView) if name.startswith(CONTACT)
)


class LayoutError(MjchairError):
    """The fields of the installed MuJoCo do not lie where its description says."""


def _ctype(node: Any) -> Any:
    if isinstance(node, ast_nodes.PointerType):
        return ctypes.c_void_p
    if isinstance(node, ast_nodes.ArrayType):
        kind = _ctype(node.inner_type)
        for extent in reversed(node.extents):
            kind = kind * extent
        return kind
    if isinstance(node, ast_nodes.AnonymousStructDecl):
        return _structure("anonymous", node.fields)
    return _SCALARS[node.name] if node.name in _SCALARS else struct(node.name)


def _structure(name: str, members: Any) -> type[ctypes.Structure]:
    return type(
        name, (ctypes.Structure,), {"_fields_": [(m.name, _ctype(m.type)) for m in members]}
    )


@functools.cache
def struct(name: str) -> type[ctypes.Structure]:
    """The ctypes structure of a MuJoCo struct, such as "mjModel", from its own description."""
    return _structure(name, structs.STRUCTS[name].fields)


def offset(name: str, member: str) -> int:
    """Bytes from the start of the struct `name` to `member`; "opt.timestep" reaches inside."""
    total = 0
    kind: Any = struct(name)
    for part in member.split("."):
        total += getattr(kind, part).offset
        kind = dict(kind._fields_)[part]
    return total


def address(name: str) -> int:
    """Address of a function or table that MuJoCo exports, such as "mj_comVel".

    Raises:
      LayoutError: the installed MuJoCo does not export it.
    """
    library = mujoco_library.shared()
    if library is not None and hasattr(library, name):
        return ctypes.addressof(ctypes.c_char.in_dll(library, name))
    raise LayoutError(f"mujoco {mujoco.__version__} shows no {name}; use mujoco 3.17")


_PROBE = """
<mujoco>
  <option><flag warmstart="disable"/></option>
  <asset><hfield name="field" nrow="2" ncol="3" size="1 1 1 1"/></asset>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 1"/>
    <geom name="field" type="hfield" hfield="field" pos="0 0 -9"/>
    <body name="wheel" pos="0 0 0.099">
      <freejoint name="free"/>
      <site name="site"/>
      <geom name="tire" type="sphere" size="0.1" condim="1" user="1 2"/>
      <body name="spin"><joint name="spin"/><geom size="0.01"/></body>
    </body>
    <body pos="0.5 0 0.099"><freejoint/><geom size="0.1"/></body>
    <body pos="-0.5 0 0.099"><freejoint/><geom size="0.1"/></body>
    <body pos="0 0 9"><freejoint/><geom size="0.1"/></body>
  </worldbody>
  <actuator><general name="tire" joint="spin" dyntype="user" actdim="4" user="1 2 3"/></actuator>
  <sensor>
    <user name="tire" objtype="actuator" objname="tire" dim="7" needstage="acc" user="1 2 3 4"/>
  </sensor>
</mujoco>
"""


def _value_at(address: int, kind: Any) -> Any:
    return kind.from_address(address).value


def _lies_at(address: int, of: Value | Rows, expected: Any) -> bool:
    """Whether a field that the bindings show as `expected` is at an address."""
    if isinstance(of, Rows):
        return bool(_value_at(address, ctypes.c_void_p) == expected.ctypes.data)
    if of.length:
        return bool(address == expected.ctypes.data)
    return bool(_value_at(address, VALUES[of.kind]) == expected)


@functools.cache
def check() -> None:
    """Compare every offset in use with what the bindings say, once per process.

    Raises:
      LayoutError: one differs.
    """
    with without_python_callbacks():
        model = mujoco.MjModel.from_xml_string(_PROBE)
        data = mujoco.MjData(model)
        mujoco.mj_step(model, data)  # no value that is compared may be 0, as its neighbours are
        mujoco.mj_forward(model, data)
    wrong = []
    for name, owner, fields in (("mjModel", model, MODEL), ("mjData", data, DATA)):
        for member, of in fields.items():
            expected = functools.reduce(getattr, member.split("."), owner)
            if not _lies_at(owner._address + offset(name, member), of, expected):
                wrong.append(f"{name}.{member}")
    wrong += _wrong_in_contact(data)
    wrong += [
        f"mjPreContact.{m}" for m, at in PRE_CONTACT.items() if offset("mjPreContact", m) != at
    ]
    if wrong:
        raise LayoutError(
            f"mujoco {mujoco.__version__} has {', '.join(wrong)} elsewhere than it describes; "
            "use mujoco 3.17"
        )


def _wrong_in_contact(data: mujoco.MjData) -> list[str]:
    first = _value_at(data._address + offset("mjData", "contact"), ctypes.c_void_p)
    wrong = []
    for member in CONTACT_FIELDS:
        kind = getattr(struct("mjContact"), member)
        raw = ctypes.string_at(first + kind.offset, kind.size)
        if raw != getattr(data.contact, member)[0].tobytes():
            wrong.append(f"mjContact.{member}")
    return wrong


def contact_size() -> int:
    """Bytes of one contact, a multiple of 8."""
    return ctypes.sizeof(struct("mjContact"))
