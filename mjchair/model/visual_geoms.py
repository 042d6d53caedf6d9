"""The display geoms of a chair: which geoms they are, and the chair without them.

In: an MjSpec of a chair. Out: a copy without these geoms: the same physics, in less time.
"""

from __future__ import annotations

from typing import Any

import mujoco


def named_elsewhere(spec: mujoco.MjSpec) -> set[str]:
    """Names of the geoms that a sensor, a contact pair or a tuple of the specification names."""
    geom = mujoco.mjtObj.mjOBJ_GEOM
    names = {s.objname for s in spec.sensors if s.objtype == geom}
    names |= {s.refname for s in spec.sensors if s.reftype == geom}
    names |= {name for pair in spec.pairs for name in (pair.geomname1, pair.geomname2)}
    return names | {name for several in spec.tuples for name in several.objname}


def is_visual(geom: Any) -> bool:
    """Whether a geom is only for display: it has no contacts and gives its body no inertia."""
    body = geom.parent
    return bool(body.explicitinertial and not geom.contype and not geom.conaffinity)


def without_visual_geoms(spec: mujoco.MjSpec) -> mujoco.MjSpec:
    """A copy without the display geoms of bodies that have explicit inertials.

    The bodies of the shipped chairs have explicit inertials, so trajectories stay equal to the bit.
    A body whose inertia comes from its geoms keeps them. Meshes that are no longer used are removed
    too.
    """
    light = spec.copy()
    meshes = set()
    for body in light.bodies[1:]:
        for geom in [g for g in body.geoms if is_visual(g)]:
            meshes.add(geom.meshname)
            light.delete(geom)
    shown = {geom.meshname for geom in light.geoms}
    for mesh in list(light.meshes):
        if mesh.name in meshes - shown:
            light.delete(mesh)
    return light
