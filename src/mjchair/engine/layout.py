"""Where MuJoCo's fields lie in memory, from its own description, checked against its bindings.

The offsets move between releases, so none is written down here: they are built from
`mujoco.introspect`, and `check` compares every one that is used with the address or the value
that the bindings give for a small model.
"""

from __future__ import annotations

import ctypes
import functools
from typing import Any

import mujoco
from mujoco.introspect import ast_nodes, structs

from mjchair.errors import MjchairError

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

# the fields that the callbacks read or write, by the kind of their elements
MODEL_VALUES = ("nuser_geom", "nuser_sensor", "nuser_actuator", "nsensor")
MODEL_ARRAYS = (
    "actuator_trntype",
    "actuator_dyntype",
    "actuator_actadr",
    "actuator_trnid",
    "actuator_user",
    "site_bodyid",
    "jnt_bodyid",
    "body_geomadr",
    "body_geomnum",
    "body_rootid",
    "geom_bodyid",
    "geom_size",
    "geom_user",
    "geom_surfacevel",
    "geom_dataid",
    "hfield_adr",
    "hfield_nrow",
    "hfield_ncol",
    "hfield_size",
    "hfield_data",
    "sensor_type",
    "sensor_objtype",
    "sensor_objid",
    "sensor_adr",
    "sensor_dim",
    "sensor_user",
)
DATA_VALUES = ("ncon", "nisland", "time")
DATA_ARRAYS = (
    "act",
    "act_dot",
    "xfrc_applied",
    "xipos",
    "geom_xpos",
    "geom_xmat",
    "site_xpos",
    "site_xmat",
    "cvel",
    "subtree_com",
    "sensordata",
    "efc_force",
    "efc_D",
    "efc_R",
    "iefc_D",
    "map_efc2iefc",
)
FOUND = {"dist": 0, "pos": 8, "normal": 32, "tangent": 56}  # bytes; a contact as it is found
CONTACT_FIELDS = ("dist", "pos", "frame", "includemargin", "geom", "efc_address")


class LayoutError(MjchairError):
    """The installed MuJoCo lays out its fields in a way that its description does not tell."""


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


_PROBE = """
<mujoco>
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
  </worldbody>
  <actuator><general name="tire" joint="spin" dyntype="user" actdim="4" user="1"/></actuator>
  <sensor>
    <user name="tire" objtype="actuator" objname="tire" dim="7" needstage="acc" user="1"/>
  </sensor>
</mujoco>
"""


def _value_at(address: int, kind: Any) -> Any:
    return kind.from_address(address).value


@functools.cache
def check() -> None:
    """Compare every offset in use with what the bindings say, once per process.

    Raises:
      LayoutError: one differs.
    """
    model = mujoco.MjModel.from_xml_string(_PROBE)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    wrong = []
    for name, owner, values, arrays in (
        ("mjModel", model, MODEL_VALUES, MODEL_ARRAYS),
        ("mjData", data, DATA_VALUES, DATA_ARRAYS),
    ):
        base = owner._address
        for member in values:
            kind = dict(struct(name)._fields_)[member]  # type: ignore[misc,arg-type]
            if _value_at(base + offset(name, member), kind) != getattr(owner, member):
                wrong.append(f"{name}.{member}")
        for member in arrays:
            found = _value_at(base + offset(name, member), ctypes.c_void_p)
            if found != getattr(owner, member).ctypes.data:
                wrong.append(f"{name}.{member}")
    step = _value_at(model._address + offset("mjModel", "opt.timestep"), ctypes.c_double)
    if step != model.opt.timestep:
        wrong.append("mjModel.opt.timestep")
    wrong += _wrong_in_contact(data)
    wrong += [f"mjPreContact.{m}" for m, at in FOUND.items() if offset("mjPreContact", m) != at]
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
