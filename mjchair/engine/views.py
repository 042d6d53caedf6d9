"""The arrays of an mjModel and an mjData that the callbacks use, under MuJoCo's names.

In: a model or its data, through the bindings. Out: a named tuple of arrays. Compiled code makes the
same tuples from memory (mjchair.engine.native), so both kinds of callback run the same functions.

The annotations below are the one table of the fields that are used: mjchair.engine.layout takes
from it what it checks, mjchair.engine.native what it reads. A field more is a line more here.
"""

from __future__ import annotations

import functools
import operator
import typing
from collections.abc import Callable
from typing import Annotated, Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
IntArray = NDArray[np.int32]


class Value(NamedTuple):
    """A number that lies in the struct itself, or a few of them.

    Attributes:
      kind: of the number. member: of the struct, where it is called otherwise. length: of an
        array of them, 0: one number.
    """

    kind: str
    member: str = ""
    length: int = 0


class Rows(NamedTuple):
    """An array that a pointer in the struct leads to.

    Attributes:
      kind: of its numbers. width: of its rows, 0: no rows, or the member that holds the width.
    """

    kind: str = "float64"
    width: int | str = 0


Reals = Annotated[Array, Rows()]
Ints = Annotated[IntArray, Rows("int32")]
Pairs = Annotated[IntArray, Rows("int32", 2)]
Triples = Annotated[Array, Rows(width=3)]
Sixes = Annotated[Array, Rows(width=6)]
Nines = Annotated[Array, Rows(width=9)]

CONTACT = "contact_"  # begins the name of a field of the contacts, of which there are ncon


class ModelView(NamedTuple):
    """Arrays of the model, shaped as in the bindings."""

    timestep: Annotated[float, Value("float64", "opt.timestep")]
    gravity: Annotated[Array, Value("float64", "opt.gravity", length=3)]
    disableflags: Annotated[int, Value("int32", "opt.disableflags")]
    nbody: Annotated[int, Value("int64")]
    nv: Annotated[int, Value("int64")]
    nsensor: Annotated[int, Value("int64")]
    actuator_trntype: Ints
    actuator_dyntype: Ints
    actuator_actadr: Ints
    actuator_trnid: Pairs
    actuator_user: Annotated[Array, Rows(width="nuser_actuator")]
    actuator_ctrladr: Ints
    site_bodyid: Ints
    jnt_type: Ints
    jnt_bodyid: Ints
    jnt_dofadr: Ints
    dof_jntid: Ints
    dof_parentid: Ints
    body_geomadr: Ints
    body_geomnum: Ints
    body_rootid: Ints
    body_weldid: Ints
    body_dofadr: Ints
    body_dofnum: Ints
    body_mass: Reals
    body_subtreemass: Reals
    geom_bodyid: Ints
    geom_size: Triples
    geom_user: Annotated[Array, Rows(width="nuser_geom")]
    geom_surfacevel: Sixes
    sensor_type: Ints
    sensor_objtype: Ints
    sensor_objid: Ints
    sensor_adr: Ints
    sensor_dim: Ints
    sensor_user: Annotated[Array, Rows(width="nuser_sensor")]


class DataView(NamedTuple):
    """Arrays of the data, shaped as in the bindings, and the contacts as arrays."""

    time: Annotated[float, Value("float64")]
    qvel: Reals
    qacc: Reals
    qacc_warmstart: Reals
    qacc_smooth: Reals
    qfrc_smooth: Reals
    qfrc_bias: Reals
    qfrc_constraint: Reals
    ctrl: Reals
    act: Reals
    act_dot: Reals
    xfrc_applied: Sixes
    xipos: Triples
    geom_xpos: Triples
    geom_xmat: Nines
    site_xpos: Triples
    site_xmat: Nines
    cdof: Sixes
    cvel: Sixes
    subtree_com: Triples
    sensordata: Reals
    efc_force: Reals
    efc_D: Reals
    efc_R: Reals
    nisland: Annotated[int, Value("int32")]
    iefc_D: Reals
    map_efc2iefc: Ints
    contact_dist: Reals
    contact_pos: Triples
    contact_frame: Nines
    contact_includemargin: Reals
    contact_geom: Pairs
    contact_efc_address: Ints


class FieldModelView(NamedTuple):
    """Arrays of the model that the contact with a height field needs."""

    geom_user: Annotated[Array, Rows(width="nuser_geom")]
    geom_dataid: Ints
    geom_size: Triples
    hfield_adr: Ints
    hfield_nrow: Ints
    hfield_ncol: Ints
    hfield_size: Annotated[Array, Rows(width=4)]
    hfield_data: Annotated[NDArray[np.float32], Rows("float32")]


class FieldDataView(NamedTuple):
    """Arrays of the data that the contact with a height field needs."""

    geom_xpos: Triples
    geom_xmat: Nines


MODEL_VIEWS: tuple[type, ...] = (ModelView, FieldModelView)
DATA_VIEWS: tuple[type, ...] = (DataView, FieldDataView)


@functools.cache
def members(view: type) -> dict[str, Value | Rows]:
    """The fields of a view, by MuJoCo's names, with their kinds."""
    hints = typing.get_type_hints(view, include_extras=True)
    return {name: typing.get_args(hint)[1] for name, hint in hints.items()}


def member_of(name: str, of: Value | Rows) -> str:
    """The member of the struct that a field is."""
    return of.member if isinstance(of, Value) and of.member else name


@functools.cache
def _getter(view: type) -> Callable[[Any], tuple[Any, ...]]:
    """What reads the fields of a view through the bindings."""
    paths = [
        name.replace(CONTACT, "contact.", 1) if name.startswith(CONTACT) else member_of(name, of)
        for name, of in members(view).items()
    ]
    return operator.attrgetter(*paths)


def model_view(model: mujoco.MjModel) -> ModelView:
    """The view of a model through the bindings."""
    return ModelView(*_getter(ModelView)(model))


def data_view(data: mujoco.MjData) -> DataView:
    """The view of a data through the bindings."""
    return DataView(*_getter(DataView)(data))
