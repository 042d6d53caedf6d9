"""Hold speed and heading on a cross slope with a gyro: python scripts/hold_on_cross_slope.py

A power chair drives 8 s along a cross slope of 2 deg, once with the stick straight ahead, and once
with a controller that reads only the wheel speeds and the gyro, at 50 Hz with a delay of 20 ms.
"""

from __future__ import annotations

import argparse
import math

import numpy as np

import mjchair

SPEED = 1.0  # m/s
PERIOD = 0.02  # s
RADIUS = 0.17  # m, of the drive wheels
SLOPE = math.tan(math.radians(2.0))


class Hold:
    """Speed from the wheels, heading from the gyro; each has a P and an I part."""

    def __init__(self, drive) -> None:
        """Start at rest, the heading zero."""
        self.drive = drive
        self.heading = self.speed_sum = self.heading_sum = 0.0

    def __call__(self, observation: mjchair.Observation) -> tuple[float, float]:
        """The joystick for the next period."""
        wheels = observation["left_wheel_speed"] + observation["right_wheel_speed"]
        error = SPEED - 0.5 * RADIUS * wheels
        self.heading += PERIOD * observation["imu_gyro.z"]
        self.speed_sum += PERIOD * error
        self.heading_sum += PERIOD * self.heading
        return self.drive.joystick(
            SPEED + 0.5 * error + 0.8 * self.speed_sum,
            -2.0 * self.heading - 1.0 * self.heading_sum,
        )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--save", metavar="FILE", help="recording of the held run, .npz")
    save = parser.parse_args().save
    drive = mjchair.load_drive("power", "normal")
    straight = drive.joystick(SPEED, 0.0)
    for name, controller in (
        ("stick straight ahead", lambda seen: straight),
        ("held", Hold(drive)),
    ):
        chair = mjchair.load_spec("power", "cross_slope", grade=SLOPE, drive="normal")
        simulator = mjchair.Simulator(chair, rate=1.0 / PERIOD, commands=mjchair.Link(delay=0.02))
        run = simulator.run(controller, 8.0)
        aside = run["position.y"][-1] - run["position.y"][0]
        turned = math.degrees(np.unwrap(run["heading"])[-1])
        print(
            f"{name}: {run['velocity.x'][-1]:.3f} m/s, turned {turned:.2f} deg, {aside:+.2f} m off"
        )
    if save:
        run.save(save)


if __name__ == "__main__":
    main()
