"""Files as laboratories have them, of one motion that is known: two push rims, sensors, clocks.

The motion is that of a rigid chair by plain equations; nothing of the package is used.
"""

import lab_formats
import numpy as np

RADIUS, TRACK, RATE = 0.3, 0.56, lab_formats.RATE
GRAVITY = 9.80665


def motion(seconds=30.0, seed=3, rest=3.0, coast=6.0, pushed=True):
    """Time (s), wheel speeds (rad/s) and torques (N m), left and right, at 1 kHz."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, seconds, 1e-3)
    torque = np.zeros((time.size, 2))
    start = rest
    while pushed and start < seconds - coast - 1.2:
        lasts = 0.4 + 0.1 * rng.random()
        both = 14.0 + 8.0 * rng.random()
        sides = both * (1.0 + 0.1 * np.array([1, -1]) * rng.normal())
        bell = np.where(
            (time >= start) & (time < start + lasts), np.sin(np.pi * (time - start) / lasts) ** 2, 0
        )
        torque += bell[:, None] * sides
        start += 0.9 + 0.35 * rng.random()
    first = 0.0 if pushed else 1.8
    speed, yaw = np.zeros(time.size), np.zeros(time.size)
    speed[0] = first
    for k in range(time.size - 1):
        drag = 9.0 * np.tanh(speed[k] / 0.02) + 5.0 * speed[k] ** 2
        speed[k + 1] = speed[k] + 1e-3 * (torque[k].sum() / RADIUS - drag) / 92.0
        moment = (torque[k, 1] - torque[k, 0]) / RADIUS * TRACK / 2
        yaw[k + 1] = yaw[k] + 1e-3 * (moment - 6.0 * yaw[k]) / 6.0
    wheels = np.column_stack([speed - yaw * TRACK / 2, speed + yaw * TRACK / 2]) / RADIUS
    return time, wheels, torque


def smartwheel(path, run, side, *, start=0.0, wrap=True, seed=0, semicolon=False, rate=RATE):
    """A push rim's file: left counts down, right has Mz < 0, the rim's weight once a turn."""
    time, wheels, torque = run
    rng = np.random.default_rng(seed)
    at = np.arange(start, time[-1], 1.0 / rate)
    column = 0 if side == "left" else 1
    angle = np.r_[0.0, np.cumsum(wheels[:-1, column] * 1e-3)]
    moment = np.interp(at, time, torque[:, column])
    hand = moment[:, None] * [2.4, -1.8, 0.0, 0.0, 0.0, 1.0]
    lab_formats.write_smartwheel(
        path, side, 1.234 + np.interp(at, time, angle), np.interp(at, time, wheels[:, column]),
        hand, rng, radius=RADIUS, style=lab_formats.Style(wrap=wrap, semicolon=semicolon),
    )  # fmt: skip


def signals(run, rate, offset, drift=0.0, seed=1, seconds=None):
    """Times on the sensor's own clock, and forward acceleration, yaw rate and wheel speeds."""
    time, wheels, _ = run
    rng = np.random.default_rng(seed)
    true = np.arange(time[0] + 0.7, seconds or time[-1] - 0.3, 1.0 / rate)
    own = (true - offset) / (1.0 + drift)
    speed = wheels.mean(axis=1) * RADIUS
    pull = np.interp(true, time, np.gradient(speed, time))
    yaw = np.interp(true, time, (wheels[:, 1] - wheels[:, 0]) * RADIUS / TRACK)
    turning = np.column_stack([np.interp(true, time, w) for w in wheels.T])
    return own - own[0], own[0], pull, yaw, turning, rng


def frame_sensor(run, rate=100.0, offset=1.5, drift=0.0, mounted=None, seed=1):
    """Own time, true start of it, gyroscope (rad/s) and accelerometer (m/s^2) in odd axes."""
    own, first, pull, yaw, _, rng = signals(run, rate, offset, drift, seed)
    mounted = np.eye(3) if mounted is None else mounted  # rows: the chair's axes in the sensor's
    gyroscope = np.column_stack([np.zeros_like(yaw), np.zeros_like(yaw), yaw]) @ mounted
    level = np.column_stack([pull, np.zeros_like(yaw), np.full_like(yaw, GRAVITY)]) @ mounted
    gyroscope += rng.normal(size=gyroscope.shape) * 0.005 + [0.01, -0.02, 0.015]
    level += rng.normal(size=level.shape) * 0.05
    return own, first, gyroscope, level


def ngimu(path, own, gyroscope, accelerometer):
    names = [
        f"{s} {a} ({u})" for s, u in (("Gyroscope", "deg/s"), ("Accelerometer", "g")) for a in "XYZ"
    ]
    rows = np.column_stack([own, np.degrees(gyroscope), accelerometer / GRAVITY])
    path.parent.mkdir(parents=True, exist_ok=True)
    write(path, ",".join(["Time (s)", *names]), rows)


def write(path, header, rows, before=()):
    lines = [*before, header, *(",".join(f"{x:.6f}" for x in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n")
