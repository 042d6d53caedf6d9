"""Figure 7 of Silva & Dedini (COBEM 2007): unequal propulsion, seen from above, Table 1's tires.

The paper shows the path of a chair whose rear wheels are pushed unequally, with the lateral force
as green arrows, and says that the force "tries to correct the movement" and grows in a curve.

Given by the paper: Magic Formula (5)-(15), Table 1's a0..a13, unequal force on the rear wheels.
Not given, and assumed here: the chair (the shipped manual one, 90 kg); the pushes (bells of 16 and
5 N m a wheel, then the stronger side changes, so that the chair turns one way and then the other;
the paper's path changes its direction); the speed at the start (0.8 m/s); the longitudinal force
(the paper has none: the tire's lateral curve serves along as well); the standstill law; casters
that swivel, on the shipped caster tire. The paper's model is plane and has no load transfer.

Table 1 is a car tire: see the caption.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

import mjchair
from mjchair.report.figure_file import save
from mjchair.report.trajectory import trajectory
from mjchair.storage import output_folder

STRONG, WEAK = 16.0, 5.0  # N m, peak of a push
DURATION = 12.0  # s
CHANGE = 6.0  # s, when the stronger side changes
SPEED = 0.8  # m/s at the start
TIMESTEP = 0.0005  # s; the car tire is too stiff for the shipped 0.002 s
CAPTION = (
    "Coefficients of Table 1 (Genta 1997), a car tire made for loads near 3 kN: the chair's 90 kg "
    "put 0.3 kN on a rear wheel, where it is so stiff across ({stiffness:.0f} N/deg) that the slip "
    "angle stays below {slip:.2f} deg and the chair goes where its wheels point. Pushes, chair and "
    "speed are assumptions."
)


def unequal_pushes() -> mjchair.Inputs:
    """Push strokes, stronger on the right until CHANGE and on the left afterwards."""
    bell = mjchair.push_strokes({"left_wheel": 1.0}, DURATION)
    first = bell.time < CHANGE
    stroke = bell.controls["left_wheel"]
    left = stroke * np.where(first, WEAK, STRONG)
    right = stroke * np.where(first, STRONG, WEAK)
    return mjchair.Inputs(bell.time, {"left_wheel": left, "right_wheel": right}, "unequal pushes")


def run(tire: str) -> mjchair.Recording:
    """The paper's simulation on the rear tire given."""
    spec = mjchair.load_spec("manual", tire={"wheels": tire})
    return mjchair.simulate(
        spec,
        unequal_pushes(),
        timestep=TIMESTEP,
        sample_rate=250.0,
        initial=mjchair.Initial(speed=SPEED),
    )


def largest_slip(recording: mjchair.Recording) -> float:
    """Largest slip angle of the rear tires, deg."""
    slips = [recording[f"{side}_wheel_tire.tan_alpha"] for side in ("left", "right")]
    return float(np.rad2deg(np.arctan(np.abs(slips).max())))


def main(tire: str, name: str, title: str, caption: str) -> int:
    parser = argparse.ArgumentParser(description=title)
    parser.add_argument("--out", default="out/paper", metavar="DIR")
    folder = output_folder(parser.parse_args().out, force=True)
    recording = run(tire)
    recording.save(folder / f"{name}.npz")
    stiffness = abs(float(lateral_stiffness(tire)))
    text = caption.format(stiffness=stiffness, slip=largest_slip(recording))
    figure = trajectory(recording, title, text, arrows=24, components=("lateral",))
    save(figure, folder / f"{name}.png")
    print(f"{recording.describe()}; {Path(folder) / name}.png")
    print(text)
    return 0


def lateral_stiffness(tire: str) -> float:
    """Slope of the lateral force at 300 N and no slip, N/deg."""
    from mjchair.model.spec import read_tire

    small = np.deg2rad(0.01)
    force = read_tire(tire).forces(300.0, 0.0, np.array([small, -small])).Fy
    return float((force[1] - force[0]) / 0.02)


if __name__ == "__main__":
    raise SystemExit(
        main("genta_table1", "figure7", "Unequal propulsion on Table 1's tires", CAPTION)
    )
