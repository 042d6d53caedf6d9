"""How far a moving rider carries the common centre of mass on a frictionless floor.

In: nothing. Out, on standard output: the table of docs/rider.md, and what the bias force of the
rider (mjchair/engine/bias_force.py) costs a step.

    python benchmarks/momentum.py
"""

from __future__ import annotations

import statistics
import time
import warnings
from collections.abc import Sequence
from typing import NamedTuple

import mujoco
import numpy as np

import mjchair
from mjchair.rider.bias_sensor import NAME
from mjchair.rider.stroke import Stroke, push_motion

SECONDS = 2.0
STEPS = (0.002, 0.001, 0.0005)
TRUNK = ("trunk_flexion",)


def model_of(timestep: float, bias_force: bool = True) -> mujoco.MjModel:
    """The manual chair with a moving rider."""
    spec = mjchair.load_spec("manual", rider="moving", timestep=timestep)
    if not bias_force:
        spec.delete(spec.sensor(NAME))
    return spec.compile()


def swing(
    model: mujoco.MjModel, joints: Sequence[str], angle: float, frequency: float
) -> np.ndarray:
    """Inputs (steps, nu) of the rider's joints that swing from zero to `angle` (rad) and back."""
    at = np.arange(0.0, SECONDS, model.opt.timestep)
    inputs = np.zeros((at.size, model.nu))
    for name in joints:
        inputs[:, model.actuator("rider_" + name).id] = (
            0.5 * angle * (1.0 - np.cos(2.0 * np.pi * frequency * at))
        )
    return inputs


def strokes(model: mujoco.MjModel) -> np.ndarray:
    """Inputs (steps, nu) of both arms and the trunk, one stroke a second."""
    at = np.arange(0.0, SECONDS, model.opt.timestep)
    inputs = np.zeros((at.size, model.nu))
    stroke = Stroke(period=1.0, push=0.4, start=0.0, duration=SECONDS)
    for name, angles in push_motion(model, stroke, at).items():
        inputs[:, model.actuator(name).id] = angles
    return inputs


class Wandering(NamedTuple):
    """What a motion does on a floor without friction.

    Attributes:
      centre: how far the common centre of mass goes, m. turn: largest angular momentum about the
        vertical, kg m^2/s. chair: how far the chair goes, m.
    """

    centre: float
    turn: float
    chair: float


def wandering(model: mujoco.MjModel, inputs: np.ndarray) -> Wandering:
    """What inputs (steps, nu) do to a chair without tires, which is on a floor without friction.

    MuJoCo's speeds belong to the middle of the step that led to them, so the angular momentum is
    taken at the places half a step before.
    """
    data, root = mujoco.MjData(model), model.body("chair").id
    data.ctrl[:] = inputs[0]
    for _ in range(round(1.0 / model.opt.timestep)):  # on to its wheels, into the first posture
        mujoco.mj_step(model, data)
        data.qvel[:] *= 0.9
    data.qvel[:], data.time = 0.0, 0.0
    mujoco.mj_forward(model, data)
    began, chair = data.subtree_com[root].copy(), data.qpos[0]
    centre = turn = moved = 0.0
    middle = mujoco.MjData(model)
    for row in inputs:
        data.ctrl[:] = row
        mujoco.mj_step(model, data)
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        centre = max(centre, np.abs((data.subtree_com[root] - began)[:2]).max())
        moved = max(moved, abs(data.qpos[0] - chair))
        middle.qpos[:], middle.qvel[:] = data.qpos, data.qvel
        mujoco.mj_integratePos(model, middle.qpos, data.qvel, -0.5 * model.opt.timestep)
        for stage in (mujoco.mj_kinematics, mujoco.mj_comPos, mujoco.mj_comVel):
            stage(model, middle)
        mujoco.mj_subtreeVel(model, middle)
        turn = max(turn, abs(middle.subtree_angmom[root][2]))
    return Wandering(centre, turn, moved)


def step_time(model: mujoco.MjModel) -> float:
    """Seconds for 500 steps."""
    data = mujoco.MjData(model)
    began = time.perf_counter()
    for _ in range(500):
        mujoco.mj_step(model, data)
    return time.perf_counter() - began


def main() -> None:
    """Print the table and the cost."""
    warnings.simplefilter("ignore")  # of the missing tires, which are missing on purpose
    motions = {
        "trunk, 0.1 rad peak to peak, 1 Hz": lambda model: swing(model, TRUNK, 0.1, 1.0),
        "trunk, 0.3 rad peak to peak, 2 Hz": lambda model: swing(model, TRUNK, 0.3, 2.0),
        "strokes of both arms and trunk, one a second": strokes,
    }
    print("| motion | 2 ms | 1 ms | 0.5 ms | 2 ms, MuJoCo's own step | the chair moves by |")
    print("|---|---|---|---|---|---|")
    for name, motion in motions.items():
        went = [wandering(model, motion(model)) for model in map(model_of, STEPS)]
        bare = model_of(STEPS[0], bias_force=False)
        numbers = [*(w.centre for w in went), wandering(bare, motion(bare)).centre]
        cells = " | ".join(f"{number:.1e} m" for number in numbers)
        print(f"| {name} | {cells} | {went[0].chair:.3f} m |")
    with mjchair.installed():
        rigid = mjchair.load_spec("manual").compile()
        models = (model_of(0.002), model_of(0.002, bias_force=False), rigid)
        times = np.array([[step_time(model) for model in models] for _ in range(21)])
    medians = [statistics.median(times[:, 0] / times[:, k]) for k in (1, 2)]
    print(f"a step: {medians[0]:.2f} times that without the bias force, ", end="")
    print(f"{medians[1]:.2f} times that of the rigid rider")


if __name__ == "__main__":
    main()
