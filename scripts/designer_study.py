"""Energy and turning effort of a manual chair over axle position, casters, tire pressure and floor.

What a designer chooses against what the rider pays. Two sweeps of the same 72 chairs:

- rolling: every chair coasts from 1.2 m/s for 4 s on the straight. Drag, which is the energy a
  metre takes, follows from the speed it loses (for the chair's whole mass; the wheels' spin is
  3 % more and left out).
- turning: every chair starts at rest with its casters behind and turns on the spot, with opposite
  torques of 5 N m for 2.5 s. The energy a full turn takes is the work of the wheels over the angle
  turned, less the kinetic energy that it still has.

The floors: hard (the tire files' own rolling resistance) and a low-pile carpet, which adds 0.014 to
it (assumption, inside the 0.01-0.05 of mjchair's effect `surface_patch`).

Writes designer_study.png, and the Parquet datasets `coast` and `turn`, which a second run reuses.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from mjchair import sweep
from mjchair.report.plots import save
from mjchair.sweep.measures import Sensed, standard

AXES = {
    "surface_patch.coefficient": [0.0, 0.014],
    "caster_radius": [0.05, 0.0625, 0.075],
    "tire_pressure": [0.25, 0.5, 1.0],
    "axle_position": [0.0, 0.02, 0.04, 0.06],
}
FLOORS = {0.0: "hard floor", 0.014: "low-pile carpet"}
EVERYWHERE = {"surface_patch.x": 0.0, "surface_patch.y": 0.0, "surface_patch.radius": 20.0}
MASS = 90.0  # kg, chair and occupant
YAW_INERTIA = 5.63  # kg m^2, of the whole chair about the vertical through its centre of mass
AHEAD = 0.12  # m, centre of mass before the axle in its standard place
TORQUE = 5.0  # N m


def turning(sensed: Sensed) -> dict[str, float]:
    """The standard measures, and the energy of a full turn (J) without what is still moving."""
    found = standard(sensed)
    speed = sensed.channels["imu_gyro.z"][-1]
    arm = AHEAD - float(sensed.case["axle_position"])
    kept = 0.5 * (YAW_INERTIA + MASS * arm * arm) * speed * speed
    angle = abs(found["turned"])
    return {**found, "energy_per_turn": 2.0 * np.pi * (found["work"] - kept) / angle}


def studies() -> dict[str, sweep.Study]:
    return {
        "coast": sweep.Study(axes=AXES, duration=4.0, fixed={**EVERYWHERE, "speed": 1.2}),
        "turn": sweep.Study(
            axes=AXES,
            duration=2.5,
            fixed={**EVERYWHERE, "torque_left": -TORQUE, "torque_right": TORQUE},
            measures=turning,
        ),
    }


def curves(axes, table, measure, factor):
    """One line a pressure and caster size over the axle position."""
    colours = {0.25: "#b2182b", 0.5: "#ef8a62", 1.0: "#2166ac"}
    styles = {0.05: ":", 0.0625: "--", 0.075: "-"}
    for pressure, colour in colours.items():
        for radius, style in styles.items():
            chosen = (table["tire_pressure"] == pressure) & (table["caster_radius"] == radius)
            x, y = 100.0 * table["axle_position"][chosen], factor * table[measure][chosen]
            axes.plot(x, y, style, color=colour)
    axes.grid(alpha=0.3)


def on_floor(table, coefficient):
    """The rows of one floor."""
    chosen = table["surface_patch.coefficient"] == coefficient
    return {name: values[chosen] for name, values in table.items()}


def columns(table):
    """A sweep's table as arrays by name."""
    return {name: np.asarray(table[name]) for name in table.column_names}


def figure(coast, turn):
    drawn, grid = plt.subplots(2, 2, figsize=(10.5, 7.5), sharex=True, sharey="row")
    drawn.set_layout_engine("constrained")
    for column, (coefficient, floor) in enumerate(FLOORS.items()):
        rows = [on_floor(table, coefficient) for table in (coast, turn)]
        curves(grid[0, column], rows[0], "deceleration", MASS)
        curves(grid[1, column], rows[1], "energy_per_turn", 1.0)
        grid[0, column].set_title(floor)
        grid[1, column].set_xlabel("rear axle forward of the standard place (cm)")
    for row in grid:
        row[0].set_ylim(bottom=0.0)
    grid[0, 0].set_ylabel("energy to roll a metre (J/m)")
    grid[1, 0].set_ylabel("energy of a full turn on the spot (J)")
    colours = {"25 %": "#b2182b", "50 %": "#ef8a62", "100 %": "#2166ac"}
    styles = {"100 mm": ":", "125 mm": "--", "150 mm": "-"}
    handles = [plt.Line2D([], [], color=c, lw=2, label=f"{p} pressure") for p, c in colours.items()]
    handles += [
        plt.Line2D([], [], color="k", ls=s, label=f"{d} casters") for d, s in styles.items()
    ]
    drawn.legend(handles=handles, loc="outside lower center", ncols=6, frameon=False)
    drawn.suptitle("Manual chair, 90 kg: what the axle, the casters, the tires and the floor cost")
    return drawn


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("out/designer_study"))
    parser.add_argument("--threads", type=int, default=0)
    parser.add_argument("--scheduler", help="of a Dask cluster")
    args = parser.parse_args()
    tables = {
        name: columns(
            sweep.run(
                study,
                args.out / name,
                threads=args.threads,
                scheduler=args.scheduler,
                progress=True,
            )
        )
        for name, study in studies().items()
    }
    save(figure(tables["coast"], tables["turn"]), args.out / "designer_study.png")
    print(args.out / "designer_study.png")


if __name__ == "__main__":
    main()
