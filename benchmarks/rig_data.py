"""Rig tables computed from a tire's formula, with hidden causes and noise, to test fits."""

import numpy as np

from mjchair.measurement.rig import from_columns


def made(
    tire,
    seed=0,
    noise=0.02,
    toe=0.0,
    camber=0.0,
    offset=0.0,
    conicity=0.0,
    angles=(0, 5, 10, 15),
    loads=(30, 110, 210),
    repeats=2,
    turned=False,
):
    """A table of lateral runs, and the peak force; two cells with `noise` of the peak each."""
    sides = (0.0, 1.0) if turned else (0.0,)
    rows = [(a, f, s) for s in sides for _ in range(repeats) for f in loads for a in angles]
    angle, load, side = np.array(rows, float).T
    fy = tire.forces(load, 0.0, np.radians(angle + toe), np.radians(camber)).Fy
    fy = fy + offset + conicity * load * (1.0 - 2.0 * side)
    peak = np.abs(fy).max()
    fy = fy + np.random.default_rng(seed).normal(0.0, noise * peak, (2, fy.size)).mean(axis=0)
    columns = {"slip_angle_deg": angle, "load_n": load, "fy_n": fy, "turned": side}
    return from_columns(columns), peak
