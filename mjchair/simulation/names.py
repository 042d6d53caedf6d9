"""Names in a model, with or without the prefix that attachment has added.

In: a compiled model, or a name and a list of known names. Out: the names in the order of the model,
or the index of the name in the list.
"""

from __future__ import annotations

from collections.abc import Sequence

import mujoco

from mjchair.errors import MjchairError, nearest
from mjchair.model.wheels import base_name


def names(model: mujoco.MjModel, kind: mujoco.mjtObj, count: int) -> list[str]:
    """The names of the first `count` objects of a kind; "" for an object without a name."""
    return [mujoco.mj_id2name(model, kind, i) or "" for i in range(count)]


def actuators(model: mujoco.MjModel) -> list[str]:
    """Names of the actuators, (nu,)."""
    return names(model, mujoco.mjtObj.mjOBJ_ACTUATOR, model.nu)


def joints(model: mujoco.MjModel) -> list[str]:
    """Names of the joints, (njnt,)."""
    return names(model, mujoco.mjtObj.mjOBJ_JOINT, model.njnt)


def sensors(model: mujoco.MjModel) -> list[str]:
    """Names of the sensors, (nsensor,)."""
    return names(model, mujoco.mjtObj.mjOBJ_SENSOR, model.nsensor)


def geoms(model: mujoco.MjModel) -> list[str]:
    """Names of the geoms, (ngeom,)."""
    return names(model, mujoco.mjtObj.mjOBJ_GEOM, model.ngeom)


def same(full: str, name: str) -> bool:
    """Whether `full` is `name`, with or without a prefix; both may end in a component (".x")."""
    object_name, dot, component = full.partition(".")
    return name in (full, base_name(object_name) + dot + component)


def find(name: str, known: Sequence[str], what: str) -> int:
    """The index of `name` in `known`, as it is or after a prefix.

    Raises:
      MjchairError: there is none, or the name without its prefix fits several.
    """
    if name in known:
        return list(known).index(name)
    matches = [i for i, full in enumerate(known) if same(full, name)]
    if not matches:
        raise MjchairError(f"unknown {what} {name!r}" + nearest(name, (k for k in known if k)))
    if len(matches) > 1:
        full = ", ".join(known[i] for i in matches)
        raise MjchairError(f"{what} {name!r} fits several; give one of {full}")
    return matches[0]
