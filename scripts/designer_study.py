"""Energy and turning effort of a manual chair over axle position, casters, tire pressure and floor.

In: the axes below. Out: designer_study.png, the Parquet datasets `coast` and `turn` (a second run
uses them again), and on standard output the sentence of docs/many_chairs.md on the axle.

Two sweeps of the same 72 chairs show how a designer's choices affect the energy that is needed:

- rolling: every chair coasts straight ahead from 1.2 m/s for 4 s. The energy for a metre is the
  drag, which is the deceleration times the mass (the spin of the wheels, 3 %, is left out).
- turning: every chair starts at rest with trailing casters and turns on the spot by opposite
  torques of 5 N m for 2.5 s. The energy of a full turn is the work of the torques less the kinetic
  energy at the end, over the angle turned, times 2 pi.

The floors are a hard floor (rolling resistance of the tire files) and a low-pile carpet, which adds
0.014 to it (assumption, within the 0.01-0.05 of mjchair's effect `surface_patch`).
"""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import mjchair
from mjchair import sweep
from mjchair.model.mass_distribution import mass_distribution
from mjchair.report.figure_file import save
from mjchair.sweep.measures import Sensed, standard

AXES = {
    "surface_patch.coefficient": [0.0, 0.014],
    "caster_radius": [0.05, 0.0625, 0.075],
    "tire_pressure": [0.25, 0.5, 1.0],
    "axle_position": [0.0, 0.02, 0.04, 0.06],
}
FLOORS = {0.0: "hard floor", 0.014: "low-pile carpet"}
EVERYWHERE = {"surface_patch.x": 0.0, "surface_patch.y": 0.0, "surface_patch.radius": 20.0}
TORQUE = 5.0  # N m


def coasting(sensed: Sensed) -> dict[str, float]:
    """The standard measures, and the energy that rolling a metre takes (J)."""
    measures = standard(sensed)
    mass = mass_distribution(sensed.model).mass
    return {**measures, "energy_per_metre_rolled": mass * measures["deceleration"]}


def turning(sensed: Sensed) -> dict[str, float]:
    """The standard measures, and the energy of a full turn (J) without the kinetic energy."""
    measures = standard(sensed)
    yaw_rate = sensed.channels["imu_gyro.z"][-1]
    chair = mass_distribution(sensed.model)
    kinetic = 0.5 * (chair.yaw_inertia + chair.mass * chair.ahead**2) * yaw_rate**2
    angle = abs(measures["turned"])
    return {**measures, "energy_per_turn": 2.0 * np.pi * (measures["work"] - kinetic) / angle}


def studies() -> dict[str, sweep.Study]:
    """The two sweeps: name -> study."""
    return {
        "coast": sweep.Study(
            axes=AXES, duration=4.0, fixed={**EVERYWHERE, "speed": 1.2}, measures=coasting
        ),
        "turn": sweep.Study(
            axes=AXES,
            duration=2.5,
            fixed={**EVERYWHERE, "torque_left": -TORQUE, "torque_right": TORQUE},
            measures=turning,
        ),
    }


def curves(axes, table, measure):
    """Draw a measure over the axle position, a line for each pressure and caster size."""
    colours = {0.25: "#b2182b", 0.5: "#ef8a62", 1.0: "#2166ac"}
    styles = {0.05: ":", 0.0625: "--", 0.075: "-"}
    for pressure, colour in colours.items():
        for radius, style in styles.items():
            chosen = (table["tire_pressure"] == pressure) & (table["caster_radius"] == radius)
            axle_cm = 100.0 * table["axle_position"][chosen]
            axes.plot(axle_cm, table[measure][chosen], style, color=colour)
    axes.grid(alpha=0.3)


def on_floor(table, coefficient):
    """The rows of one floor."""
    chosen = table["surface_patch.coefficient"] == coefficient
    return {name: values[chosen] for name, values in table.items()}


def columns(table):
    """A sweep's table as arrays by name."""
    return {name: np.asarray(table[name]) for name in table.column_names}


def savings(turn):
    """Floor -> least and most (%) by which the foremost axle makes a turn lighter, over all chairs.

    Args:
      turn: columns of the sweep `turn`.
    """
    first, last = min(AXES["axle_position"]), max(AXES["axle_position"])
    least_and_most = {}
    for coefficient, floor in FLOORS.items():
        rows = on_floor(turn, coefficient)
        order = np.lexsort((rows["caster_radius"], rows["tire_pressure"]))
        axle, energy = rows["axle_position"][order], rows["energy_per_turn"][order]
        saved = 100.0 * (1.0 - energy[axle == last] / energy[axle == first])
        least_and_most[floor] = float(saved.min()), float(saved.max())
    return least_and_most


def sentence(turn):
    """The sentence of docs/many_chairs.md about the axle."""
    ranges = [
        f"{low:.0f} to {high:.0f} % on a {floor}" for floor, (low, high) in savings(turn).items()
    ]
    forward = 100.0 * max(AXES["axle_position"])
    return f"an axle {forward:.0f} cm forward saves {' and '.join(ranges)}"


def figure(coast, turn):
    drawn, grid = plt.subplots(2, 2, figsize=(10.5, 7.5), sharex=True, sharey="row")
    drawn.set_layout_engine("constrained")
    for column, (coefficient, floor) in enumerate(FLOORS.items()):
        rows = [on_floor(table, coefficient) for table in (coast, turn)]
        curves(grid[0, column], rows[0], "energy_per_metre_rolled")
        curves(grid[1, column], rows[1], "energy_per_turn")
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
    mass = mass_distribution(mjchair.load_spec().compile()).mass
    drawn.suptitle(
        f"Manual chair, {mass:.0f} kg: what the axle, the casters, the tires and the floor cost"
    )
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
    print(sentence(tables["turn"]))


if __name__ == "__main__":
    main()
