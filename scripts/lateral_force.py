"""Control that takes the lateral tire force into account: what it is worth on a cross slope.

The paper closes with the wish for such a control. Here two controllers follow the same ten winding
paths at 1.0 m/s on a floor that slopes 6 % across the start. They are the same pure pursuit with
the same gains; one of them also reads the lateral forces of its rear tires. Those act behind the
centre of mass, at the arm d, and turn the chair: with the slope downhill, in a curve outwards.
It cancels their moment d (Fy_left + Fy_right) by the difference of its torques.

Writes lateral_force.png.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from mjchair import tasks
from mjchair.report.plots import save
from mjchair.tasks.baselines import Drive, pursue

SPEED, SLOPE = 1.0, 0.06
COLOURS = {False: "#b2182b", True: "#1b7837"}
NAMES = {False: "does not know the lateral force", True: "knows the lateral force"}


def episode(environment, seed: int, lateral: bool):
    """Positions (n, 2), arc lengths and offsets (n,), m, and rear lateral forces (n,), N."""
    environment.task.random.seed(seed)
    environment.task.speed = SPEED
    drive = Drive(lateral=lateral)
    found, step = [], environment.reset()
    spec = environment.action_spec()
    while not step.last():
        action = pursue(step.observation, drive, SPEED, which=1)
        step = environment.step(np.clip(action, spec.minimum, spec.maximum))
        seen = step.observation
        found.append(
            (
                *environment.physics.position(),
                environment.task.progress,
                seen["offset"][0],
                seen["lateral_forces"].sum(),
            )
        )
    return np.array(found)


def rms(runs) -> float:
    return float(np.sqrt(np.mean(np.concatenate([run[:, 3] ** 2 for run in runs]))))


def figure(environment, runs):
    drawn, (top, left, right) = plt.subplots(1, 3, figsize=(12.5, 4.2), layout="constrained")
    environment.task.random.seed(0)
    environment.reset()
    path = environment.task.course.points
    top.plot(*path.T, color="0.6", lw=5, alpha=0.6, label="path")
    for lateral, colour in COLOURS.items():
        run = runs[lateral][0]
        top.plot(run[:, 0], run[:, 1], color=colour, lw=1.3, label=NAMES[lateral])
        left.plot(run[:, 2], 100 * run[:, 3], color=colour, lw=1.3)
        values = [100 * rms([r]) for r in runs[lateral]]
        right.bar(np.arange(len(values)) + 0.4 * lateral, values, 0.4, color=colour)
    top.set_aspect("equal", "datalim")
    top.annotate("", (0.06, 0.75), (0.06, 0.95), "axes fraction", arrowprops={"arrowstyle": "->"})
    top.text(0.09, 0.85, f"downhill {100 * SLOPE:.0f} %", transform=top.transAxes)
    top.set_xlabel("x (m)")
    top.set_ylabel("y (m)")
    top.legend(loc="lower right", fontsize=8)
    left.set_xlabel("along the path (m)")
    left.set_ylabel("offset to the left (cm)")
    right.set_xlabel("path")
    right.set_ylabel("rms offset (cm)")
    for axes in (left, right):
        axes.grid(alpha=0.3)
    drawn.suptitle(
        f"Following a path at {SPEED} m/s: rms offset {100 * rms(runs[False]):.1f} cm without, "
        f"{100 * rms(runs[True]):.1f} cm with the lateral force of the rear tires"
    )
    return drawn


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("out/lateral_force"))
    parser.add_argument("--episodes", type=int, default=10)
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    environment = tasks.load(
        "follow_path", {"random": 0}, looks=False, scene_kwargs={"grade": SLOPE}
    )
    runs = {
        lateral: [episode(environment, seed, lateral) for seed in range(args.episodes)]
        for lateral in (False, True)
    }
    for lateral, found in runs.items():
        worst = max(np.abs(run[:, 3]).max() for run in found)
        print(f"{NAMES[lateral]}: rms {100 * rms(found):.2f} cm, worst {100 * worst:.1f} cm")
    save(figure(environment, runs), args.out / "lateral_force.png")


if __name__ == "__main__":
    main()
