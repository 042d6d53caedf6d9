"""A velocity command (v, w), as robots use it, on a power chair: python scripts/velocity_command.py

Velocity commands arrive at 10 Hz, and one of ten is lost; the chair drives a figure of eight by its
joystick. The script prints how well forward speed and yaw rate follow the commands.
"""

from __future__ import annotations

import argparse
import math

import numpy as np

import mjchair

SPEED, TURN, LOOP = 0.6, 0.6, 2.0 * math.pi / 0.6  # m/s, rad/s, s of one loop


def wanted(time: float) -> tuple[float, float]:
    """Speed (m/s) and yaw rate (rad/s) of a figure of eight."""
    return SPEED, TURN if time % (2.0 * LOOP) < LOOP else -TURN


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--save", metavar="FILE", help="recording, .npz")
    save = parser.parse_args().save
    drive = mjchair.load_drive("power", "normal")
    simulator = mjchair.Simulator(
        mjchair.load_spec("power", drive="normal"),
        rate=10.0,
        commands=mjchair.Link(dropped=0.1, seed=1),
    )
    run = simulator.run(lambda seen: drive.joystick(*wanted(seen["time"])), 2.0 * LOOP)
    asked = np.array([wanted(t) for t in run.time])
    settled = (run.time > 2.0) & (abs(run.time - LOOP) > 2.0)
    got = np.column_stack([run["velocity.x"], run["imu_gyro.z"]])
    speed, turn = np.sqrt(np.mean((got - asked)[settled] ** 2, axis=0))
    print(f"{run.describe()}")
    print(f"misses {SPEED} m/s by {speed:.3f} m/s and {TURN} rad/s by {turn:.3f} rad/s (rms)")
    if save:
        run.save(save)


if __name__ == "__main__":
    main()
