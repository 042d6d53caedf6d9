"""What the tire callbacks see of an mjModel and an mjData: the same names for both callbacks."""

from __future__ import annotations

from typing import Any, NamedTuple

import mujoco


class ModelView(NamedTuple):
    """Arrays of the model, shaped as in the bindings."""

    timestep: Any
    nsensor: Any
    actuator_trntype: Any
    actuator_dyntype: Any
    actuator_actadr: Any
    actuator_trnid: Any  # (nactuator, 2)
    actuator_user: Any  # (nactuator, nuser_actuator)
    site_bodyid: Any
    jnt_bodyid: Any
    body_geomadr: Any
    body_geomnum: Any
    body_rootid: Any
    geom_bodyid: Any
    geom_size: Any  # (ngeom, 3)
    geom_user: Any  # (ngeom, nuser_geom)
    geom_surfacevel: Any  # (ngeom, 6)
    sensor_type: Any
    sensor_objtype: Any
    sensor_objid: Any
    sensor_adr: Any
    sensor_dim: Any
    sensor_user: Any  # (nsensor, nuser_sensor)


class DataView(NamedTuple):
    """Arrays of the data, shaped as in the bindings, and the contacts as arrays."""

    time: Any  # s
    act: Any
    act_dot: Any
    xfrc_applied: Any  # (nbody, 6)
    xipos: Any  # (nbody, 3)
    geom_xpos: Any  # (ngeom, 3)
    geom_xmat: Any  # (ngeom, 9)
    site_xpos: Any  # (nsite, 3)
    site_xmat: Any  # (nsite, 9)
    cvel: Any  # (nbody, 6)
    subtree_com: Any  # (nbody, 3)
    sensordata: Any
    efc_force: Any
    efc_D: Any
    efc_R: Any
    nisland: Any
    iefc_D: Any
    map_efc2iefc: Any
    contact_dist: Any  # (ncon,)
    contact_pos: Any  # (ncon, 3)
    contact_frame: Any  # (ncon, 9)
    contact_includemargin: Any  # (ncon,)
    contact_geom: Any  # (ncon, 2)
    contact_efc_address: Any  # (ncon,)


def model_view(model: mujoco.MjModel) -> ModelView:
    """The view of a model through the bindings."""
    return ModelView(model.opt.timestep, *(getattr(model, name) for name in ModelView._fields[1:]))


def data_view(data: mujoco.MjData) -> DataView:
    """The view of a data through the bindings."""
    contacts = data.contact
    return DataView(
        *(
            getattr(contacts, name.removeprefix("contact_"))
            if name.startswith("contact_")
            else getattr(data, name)
            for name in DataView._fields
        )
    )
