"""How much a controller gains on a cross slope when it knows the lateral tire forces.

In: the number of episodes. Out: lateral_force.png in a folder, and on standard output the offsets
and the sentence of docs/tasks.md with these numbers.

Silva & Dedini (COBEM 2007) propose such a controller in their conclusions. Here two controllers
follow the same ten random paths at 1.0 m/s on a cross slope of 6 %. Both are a pure pursuit with
the same gains; one of them also reads the lateral forces of its rear tires. These forces act at a
distance d behind the centre of mass, so they turn the chair: downhill on the slope, outwards in a
curve. The controller cancels their moment d (Fy_left + Fy_right) by a difference of its torques.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from mjchair import tasks
from mjchair.report.figure_file import save
from mjchair.tasks.baselines import Drive, pursue

SPEED, SLOPE = 1.0, 0.06
COLOURS = {False: "#b2182b", True: "#1b7837"}
NAMES = {False: "does not know the lateral force", True: "knows the lateral force"}


def load():
    """The environment: a cross slope, and the speed of this comparison."""
    options = {"random": 0, "speed": SPEED}
    return tasks.load("follow_path", options, visual_geoms=False, scene_kwargs={"grade": SLOPE})


def episode(environment, seed: int, lateral: bool):
    """One run as an array (n, 5): position x and y, arc length, offset (all m), lateral force (N).

    Args:
      seed: of the random path. lateral: whether the controller knows the lateral force.
    """
    environment.task.random.seed(seed)
    drive = Drive.of(environment.physics.model.ptr, lateral=lateral)
    rows, step = [], environment.reset()
    spec = environment.action_spec()
    while not step.last():
        action = pursue(step.observation, drive, SPEED, which=1)
        step = environment.step(np.clip(action, spec.minimum, spec.maximum))
        rows.append(
            (
                *environment.physics.position(),
                environment.task.progress,
                step.observation["offset"][0],
                step.observation["lateral_forces"].sum(),
            )
        )
    return np.array(rows)


def sentence(runs) -> str:
    """What docs/tasks.md says of these runs. runs: lateral -> arrays of `episode`."""
    better = sum(rms([b]) < rms([a]) for a, b in zip(runs[False], runs[True], strict=True))
    return (
        f"{100 * rms(runs[False]):.1f} cm rms offset without, {100 * rms(runs[True]):.1f} cm with; "
        f"better on {better} of {len(runs[True])} paths"
    )


def rms(runs) -> float:
    """Root mean square of the offsets of several runs, m."""
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
    environment = load()
    runs = {
        lateral: [episode(environment, seed, lateral) for seed in range(args.episodes)]
        for lateral in (False, True)
    }
    for lateral, chosen in runs.items():
        worst = max(np.abs(run[:, 3]).max() for run in chosen)
        print(f"{NAMES[lateral]}: rms {100 * rms(chosen):.2f} cm, worst {100 * worst:.1f} cm")
    print(sentence(runs))
    save(figure(environment, runs), args.out / "lateral_force.png")


if __name__ == "__main__":
    main()
