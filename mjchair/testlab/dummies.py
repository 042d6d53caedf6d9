"""Test dummies of 25 kg and more, in steps of 25 kg (ISO 7176-11:2012): the chair with each one.

In: a design. Out, for dummies of 25 to 150 kg: the masses of their segments, mass and centre of
mass of the chair with the dummy, and its tip angles from the closed form.

The dummies of the standard are blocks whose masses follow formulas, which were not available. Here
a dummy has the segment masses of de Leva (1996), and the shape and position of the model's
occupant. Above 100 kg this underestimates how far the mass moves forward (Cooper, J Rehabil Res Dev
36(1), 1999).
"""

from __future__ import annotations

import math
from dataclasses import replace

import mujoco

from mjchair.errors import MjchairError
from mjchair.model.seating import OCCUPANT
from mjchair.testlab.closed_form import tip_angle
from mjchair.testlab.design import Design, center_of_mass, parts
from mjchair.testlab.result import Grid, Result, Value

NAME = "dummies"
MASSES = (25.0, 50.0, 75.0, 100.0, 125.0, 150.0)  # kg
SEGMENTS = {
    "head": ("head",),
    "trunk": ("chest", "abdomen", "pelvis"),
    "arms": ("upper_arm", "forearm", "hand"),
    "legs": ("thigh", "shank", "foot"),
}


def dummies(design: Design, *, timestep: float | None = None) -> Result:
    """The chair with every dummy.

    Returns:
      `total_mass_<kg>` (kg), `center_forward_<kg>`, `center_height_<kg>` (mm),
      `rearward_unlocked_<kg>`, `forward_locked_<kg>` (deg).
    """
    values: dict[str, Value] = {}
    rows, angles = [], []
    try:
        for mass in MASSES:
            model = replace(design, occupant=mass).spec().compile()
            data = mujoco.MjData(model)
            mujoco.mj_kinematics(model, data)
            mujoco.mj_comPos(model, data)
            named = parts(model)
            total, center = center_of_mass(model, data)
            axle = data.geom_xpos[named.geoms["left_wheel"]]
            back = math.degrees(tip_angle(model, data, named, "rearward", False))
            ahead = math.degrees(tip_angle(model, data, named, "forward", True))
            values[f"total_mass_{mass:g}"] = Value(total, "kg", source="masses of the model")
            forward, height = 1000.0 * float(center[0] - axle[0]), 1000.0 * float(center[2])
            values[f"center_forward_{mass:g}"] = Value(forward, "mm", source="masses of the model")
            values[f"center_height_{mass:g}"] = Value(height, "mm", source="masses of the model")
            values[f"rearward_unlocked_{mass:g}"] = Value(back, "deg", source="closed form")
            values[f"forward_locked_{mass:g}"] = Value(ahead, "deg", source="closed form")
            shares = [mass * _share(names) for names in SEGMENTS.values()]
            rows.append((mass, *shares, total, forward, height))
            angles.append((back, ahead))
    except MjchairError as error:
        return Result(NAME, missing=f"the model's occupant cannot be exchanged: {error}")
    columns = (
        "dummy, kg",
        *(f"{name}, kg" for name in SEGMENTS),
        "total, kg",
        "ahead of axle, mm",
        "height, mm",
    )
    return Result(
        NAME,
        values,
        setup=["segment shares of de Leva (1996); shape and place of the model's occupant"],
        grids=[Grid("Dummies", columns, tuple(rows))],
        curves={
            "rearward unlocked": (list(MASSES), [a for a, _ in angles]),
            "forward locked": (list(MASSES), [a for _, a in angles]),
        },
        axes=("dummy, kg", "tip angle, deg"),
    )


def _share(names: tuple[str, ...]) -> float:
    """Share of these segments in the body mass; a limb counts with both sides."""
    return sum(
        share
        for name, share in OCCUPANT.items()
        if name.removeprefix("left_").removeprefix("right_") in names
    )
