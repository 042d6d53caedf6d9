"""The drag of still air."""

from __future__ import annotations

import mujoco

from mjchair.effects.air import add_air
from mjchair.effects.effect import Effect, Parameter


def edit(spec: mujoco.MjSpec, drag_area: float) -> None:
    """Add a drag area (m^2, coefficient times area) at the occupant's trunk."""
    add_air(spec, "air_drag", drag_area, 0.0, 0.0)


EFFECT = Effect(
    name="air_drag",
    parameters=(Parameter("drag_area", "m^2", 0.6, 0.0, 5.0),),
    signature="v^2, against the motion",
    source="a seated person: drag area 0.5-0.8 m^2 (Hoerner 1965, seated)",
    edit=edit,
    common=4.0,  # the chairs of this project have no drag, every real one has
)
