"""The study.toml of gathered trials, with a comment at every line.

In: trials, noise, what is known. Out: the text. What is not known stands in it as a comment that
names it, its unit and its flag, so that it can be filled in by hand.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from mjchair.measurement.gather.instruments import RADIUS, RIDER_COLUMNS
from mjchair.measurement.gather.join import GatheredTrial
from mjchair.measurement.gather.known import MODEL_CHAIR, Known
from mjchair.rider.anatomy import JOINT_NAMES

LOOSE = 0.3  # relative standard deviation of a mass that nobody has weighed
ENOUGH = 3  # trials of one manoeuvre, from which on one is kept for the final check
COLUMN = 44  # where comments begin
HEADINGS = (
    "Headings are in the laboratory's axes: z up, x the axis nearest to where the chair faces as "
    "the first trial begins"
)


def study_text(
    trials: Sequence[GatheredTrial],
    noise: Mapping[str, float],
    known: Known,
    radius: float | None,
    shared: Sequence[str] = (),
) -> str:
    """The text of study.toml; `shared`: lines on clocks that several trials share."""
    out = ["# Made by `mjchair gather`; every line may be changed by hand. Units are SI."]
    out += [_line('model = "manual"', "the chair that is to explain these runs, or a path to MJCF")]
    out += _rider(trials)
    if any(trial.driven and not trial.torque_estimated for trial in trials):
        out += [_line('torque = "measured"', "at the push rims; commanded: by a motor")]
    out += _floor(known)
    out += ["", "# What the person who measured knows, and no instrument on the chair can tell"]
    out += ["[chair]", *_masses(known), _radius(known, radius)]
    weighed = known.rider_mass is not None and known.chair_mass is not None
    if not weighed and known.mass is None:
        out += ["", "[nuisance]"]
        out += [
            _line(f"mass = {LOOSE}", "nobody said the mass: it may be 30 % off; weigh to tell more")
        ]
    if noise:
        out += ["", "# Standard deviations while the chair stands, one a sensor", "[noise]"]
        out += [
            _line(f'"{name}" = {size:g}', unit_of(name)) for name, size in sorted(noise.items())
        ]
    out += ["", *(f"# {line}" for line in shared)] if shared else []
    if any(trial.heading is not None for trial in trials):
        out += ["", f"# {HEADINGS}"]
    kept = _held_out(trials)
    for trial in trials:
        out += ["", *_trial(trial, trial is kept)]
    return "\n".join(out) + "\n"


def _line(text: str, comment: str) -> str:
    return f"{text:<{COLUMN}}  # {comment}"


def _ask(name: str, example: str, comment: str) -> str:
    return _line(f"# {name} = {example}", f"NOT KNOWN: {comment}; take the # away and fill it in")


def _rider(trials: Sequence[GatheredTrial]) -> list[str]:
    """Whether the rider's motion is in the tables, and what is made of it."""
    columns = {name for trial in trials for name in trial.columns}
    if not columns & RIDER_COLUMNS:
        return []
    how = "rigid: how much of the person moved with rider_motion is estimated"
    if columns & set(JOINT_NAMES):
        how += '; "moving": segments of de Leva follow the joints of the tables'
    return [_line('rider = "rigid"', how)]


def _floor(known: Known) -> list[str]:
    said = {
        None: "NOT KNOWN: overground, treadmill or rollers (--floor); taken as a level floor",
        "overground": "a level floor, as rolled on",
        "treadmill": "a treadmill: the floor is its belt, which moves evenly",
        "rollers": "rollers: wheels turn and the chair stays; its casters do not roll",
    }[known.floor]
    if known.grade is None:
        return [_line('scene = "flat"', said)]
    return [
        _line('scene = "ramp"', said),
        _line(f"grade = {known.grade:g}", "rise over run along +x, as given"),
    ]


def _masses(known: Known) -> list[str]:
    if known.rider_mass is None and known.chair_mass is None and known.mass is not None:
        return [
            _line(
                f"occupant_mass = {known.mass - MODEL_CHAIR:g}",
                f"kg; {known.mass:g} kg together, less the {MODEL_CHAIR:g} kg of the model's chair",
            )
        ]
    rider = (
        _ask("occupant_mass", "75", "mass of the person, kg (--rider-mass)")
        if known.rider_mass is None
        else _line(f"occupant_mass = {known.rider_mass:g}", "kg, the person, as given")
    )
    chair = (
        _ask("chair_mass", "15", "mass of the chair and what is fixed to it, kg (--chair-mass)")
        if known.chair_mass is None
        else _line(
            f"chair_mass = {known.chair_mass:g}", "kg, the chair without the person, as given"
        )
    )
    return [rider, chair]


def _radius(known: Known, radius: float | None) -> str:
    if known.wheel_radius is not None:
        return _line(f"wheel_radius = {known.wheel_radius:g}", "m, of the rear wheels, as given")
    if radius is not None:
        return _line(f"wheel_radius = {radius:.3f}", "m, that the instrumented wheel was set to")
    return _ask("wheel_radius", f"{RADIUS:g}", "radius of the rear wheels, m (--wheel-radius)")


def unit_of(channel: str) -> str:
    """Unit and origin of a channel's noise, in words."""
    ends = {"_angle": "rad", "_speed": "rad/s", "gyro": "rad/s", "accelerometer": "m/s^2"}
    stem = channel.rsplit(".", 1)[0] if channel.startswith("imu_") else channel
    unit = next((unit for end, unit in ends.items() if stem.endswith(end)), "SI")
    return f"{unit}, seen at rest"


def _held_out(trials: Sequence[GatheredTrial]) -> GatheredTrial | None:
    """The trial that is kept for the final check: the last push, or coast, of three or more."""
    telling = [trial for trial in trials if not trial.torque_estimated]
    for word in ("push", "coast"):
        mine = [trial for trial in telling if trial.manoeuvre == word]
        if len(mine) >= ENOUGH or (len(mine) == 2 and len(telling) > 2):
            return mine[-1]
    return None


def _trial(trial: GatheredTrial, held_out: bool) -> list[str]:
    names = ", ".join(one.name for one in trial.instruments)
    lasts = trial.time[-1] - trial.time[0]
    out = ["[[trial]]", _line(f'file = "{trial.name}.csv"', f"{lasts:.1f} s of {names}")]
    is_push = trial.manoeuvre == "push"
    word = "with a hand's torque" if is_push else "no torque: it rolls freely"
    out.append(_line(f'manoeuvre = "{trial.manoeuvre}"', f"{word}; runs of one word are compared"))
    kept = "kept for the final check" if held_out else "used to fit"
    out.append(_line(f"hold_out = {'true' if held_out else 'false'}", f"{kept}; keep at least one"))
    if trial.torque_estimated:
        out.append(_line('torque = "estimated"', "from the motion; a diagnosis leaves it out"))
    for name, found in trial.alignments.items():
        out.append(f"# clock of {name}: {found.text()}")
    if trial.heading is not None:
        out.append("[trial.initial]")
        way = "rad, where the chair faces at first, not where it goes; by markers"
        out.append(_line(f"heading = {trial.heading:.4f}", way))
    return out
