"""The next experiment in words: what to do, what it decides, and what to look for.

In: a `Plan`, what a missing force goes with, or what the fit moved far. Out: sentences.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence

from mjchair.diagnosis.data.roughly_known import Nuisance
from mjchair.diagnosis.explain.column_ids import Driver, Quantity
from mjchair.diagnosis.next_experiment.comparison import Evidence
from mjchair.diagnosis.next_experiment.design import ENOUGH, Plan
from mjchair.diagnosis.next_experiment.ranking import PLENTY
from mjchair.diagnosis.replay.simulator import WindowSimulator
from mjchair.model.wheels import base_name
from mjchair.simulation.channels import channels

CLOSE = 0.7  # of the best T, that is worth a word
OFTEN = 20  # repetitions beyond which nobody would
NEARLY = 0.8  # of the strongest driver's sigmas
MOST = 30.0  # sigmas, beyond which the number says nothing more


def deciding(plan: Plan, simulator: WindowSimulator) -> str:
    """The experiment that separates hypotheses which these data cannot tell apart."""
    best = plan.best
    units = {c.name: c.unit for c in channels(simulator.base)}
    units |= {base_name(name): unit for name, unit in units.items()}
    said = [_what_to_do(plan)]
    pairs = zip(plan.chosen, plan.rivals, best.separations, plan.evidence, strict=True)
    for chosen, rival, t, evidence in pairs:
        one, other = plain_together(chosen), plain_together(rival)
        said.append(f"It separates {one} from {other} by {_sigmas(t)}.")
        if evidence is not None and evidence.noises > 1.0:
            said.append(_evidence(evidence, chosen, rival, units[evidence.channel]))
    said += _again(plan)
    near = max(CLOSE * min(best.least, PLENTY), 1.0)
    others = [e for e in plan.experiments[1:2] if e.least > near and not e.at_most]
    said += [f"Or {_lower(e.manoeuvre.words)} ({_sigmas(e.least)})." for e in others]
    return " ".join(said)


def _what_to_do(plan: Plan) -> str:
    """The manoeuvre, where it starts, for how long, and what study.toml must be told of it."""
    manoeuvre = plan.best.manoeuvre
    force = f", with up to {plan.torque:.2g} N m a wheel" if plan.torque else ""
    torques = " and the torque of each" if plan.torque else ""
    said = [f"{manoeuvre.words}{force}; record {manoeuvre.seconds:g} s{torques}."]
    if plan.run:
        moved = any(manoeuvre.shift) or manoeuvre.turned
        but = ", but for what is said here of start and heading" if moved else ""
        said.append(f"Start where {plan.run} starts, with its heading{but}.")
    if manoeuvre.load is not None:
        load = manoeuvre.load
        told = f"mass = {load.mass:g} and height = {load.height:g}"
        said.append(f"In study.toml the trial gets a [trial.load] with {told}.")
    return " ".join(said)


def plain(key: str) -> str:
    """An effect's key as words."""
    name, _, channel = key.partition(":")
    return name.replace("_", " ") + (f" of {channel}" if channel else "")


def plain_together(keys: str) -> str:
    """Keys of effects, joined by "+", as words."""
    return " and ".join(map(plain, keys.split("+")))


def _sigmas(t: float) -> str:
    size = math.sqrt(t)
    return f"more than {MOST:g} sigmas" if size > MOST else f"about {size:.2g} sigmas"


def _evidence(evidence: Evidence, chosen: str, rival: str, unit: str) -> str:
    by = evidence.rival - evidence.chosen
    unit = "" if unit in ("1", "?") else f" {unit}"
    return (
        f"Look at {evidence.channel}: {evidence.time:.1f} s after the start it is "
        f"{abs(by):.2g}{unit} {'higher' if by > 0.0 else 'lower'} if it is "
        f"{plain_together(rival)} ({evidence.rival:.3g}{unit}) than if it is "
        f"{plain_together(chosen)} ({evidence.chosen:.3g}{unit})."
    )


def _again(plan: Plan) -> list[str]:
    """What to do where one run does not decide."""
    needed = plan.needed or (ENOUGH,) * len(plan.rivals)
    pairs = zip(needed, plan.best.separations, strict=True)
    least, t = max(pairs, key=lambda pair: pair[0] / max(pair[1], 1e-9))
    if t >= least:
        return []
    times = math.ceil(least / max(t, 1e-9))
    if times > OFTEN:
        return [
            f"No manoeuvre of the library decides: this one, the best, would need more than "
            f"{OFTEN} repetitions. Better sensors or another kind of run are needed."
        ]
    return [f"One such run is below the {math.sqrt(least):.2g} sigmas that decide: repeat it "
            f"{times} times."]  # fmt: skip


def _lower(words: str) -> str:
    return words[0].lower() + words[1:]


# what is only roughly known of a chair, as a person would measure it
MEASURED = {
    "mass": "the mass of chair and person together",
    "inertia": "the inertia of chair and person about the vertical",
    "centre_x": "how far forward the centre of mass is (weigh the casters)",
    "centre_y": "how far to the left the centre of mass is (weigh the left wheels)",
    "centre_z": "how high the centre of mass is",
    "rear_stiffness": "the cornering stiffness of the rear tires",
    "caster_stiffness": "the cornering stiffness of the casters' tires",
    "rolling_radius": "the radius of the rear wheels, loaded and rolling",
    "torque": "the gain of the torques",
}


ERRORS = {"bias": "bias", "scale": "gain"}


def roughly_known(name: str) -> str:
    """What is only roughly known as words: of the chair, or the bias or gain of a sensor."""
    error, _, channel = name.partition(":")
    return f"{ERRORS[error]} of {channel}" if channel else plain(name)


def measured(name: str) -> str:
    """A number that is only roughly known, by its name, as a person would measure it."""
    return MEASURED.get(name, f"the {roughly_known(name)}")


def changed(number: Nuisance, by: float, digits: int = 0) -> str:
    """By how much a number is not that of the study's chair.

    Args:
      by: standard deviations. digits: of a share, in per cent.
    """
    change = by * number.std
    return (
        f"{100.0 * change:+.{digits}f} %" if number.unit == "1" else f"{change:+.2g} {number.unit}"
    )


def measuring(moved: Sequence[tuple[Nuisance, float]]) -> str:
    """What to measure where runs are explained by a chair that is far from what the study says.

    Args:
      moved: what is only roughly known, and by how many of its standard deviations it was moved,
        of those that are far; empty where none is.
    """
    said = [f"{measured(n.name)}: {changed(n, by)}, {abs(by):.1f} sigmas" for n, by in moved]
    if not said:
        return ""
    return (
        f"Measure what these runs put far from what the study says: {'; '.join(said)}. If it is "
        "as the study says, something else is missing."
    )


WHEEL = (
    "Lift the {wheel} off the ground and spin it by hand: a bent rim, a brake or a bearing "
    "shows as a speed that rises and falls once a turn. Then repeat the run with the wheel started "
    "half a turn further: what goes with its angle moves along."
)
# what the missing force goes with -> what to do, and what it tells
TIED = {
    Quantity.SPEED: (
        "Coast from another speed, half and twice: a force that goes with speed keeps its "
        "curve over speed, one that only happened at that speed does not."
    ),
    Quantity.YAW_RATE: (
        "Coast in turns to both sides, then straight: what goes with turning is gone in the "
        "straight one and changes sign with the side."
    ),
    Quantity.HEADING: (
        "Repeat the run with the heading turned by 180 degrees and the start moved by a "
        "metre: what comes from the floor or the air stays fixed in the room, what comes from"
        " the chair turns with it."
    ),
    Quantity.SWIVEL: (
        "Start once with the casters trailing and once with them turned aside: what goes with"
        " a swivel shows only after the second."
    ),
    Quantity.TORQUE: (
        "Coast through the same speeds without torque: what goes with the drive is gone."
    ),
    Quantity.STROKE: (
        "Push again with the rider's motion measured (a column rider_motion, m, the forward "
        "displacement of the rider's centre of mass in the chair): a body that moves on the "
        "chair pushes it to and fro with every stroke. Then let someone else push the chair "
        "with the rider still."
    ),
    Quantity.TIME: (
        "Repeat the run with the largest gap exactly as it was: what happened once does not "
        "come back, what is tied to the place or the wheel's angle does."
    ),
    Quantity.LEFT_TURN: WHEEL.format(wheel="left wheel"),
    Quantity.RIGHT_TURN: WHEEL.format(wheel="right wheel"),
}
OTHERWISE = (
    "Repeat the run with the largest gap without changes: what comes back at the same place, time "
    "or wheel angle tells what it is tied to."
)


def letting_in(run: str, left: float, others: float) -> str:
    """What to do where a held-out run alone shows what is missing.

    Args:
      run: its name. left: what it leaves, in noises. others: the most that a run of the fit leaves.
    """
    return (
        f"Hold out another run than {run} and diagnose again: at best {run} is left {left:.3g} "
        f"times the noise off, the runs of the fit at most {others:.3g} times, so that what is "
        "missing shows in none of them. With a second run of its kind, one of the two can be held "
        "out."
    )


def keeping_down() -> str:
    """What to measure where the chair of the model tips and the real one did not."""
    return (
        "Measure how the person leans as they push (docs/rider.md), or see whether [chair] has the "
        "rear axle and the centre of mass where they are; then diagnose again."
    )


def leaving_out(run: str) -> str:
    """What to do where one run differs from the others, by its name."""
    return (
        f"Diagnose again without {run}, which differs from the other runs, and look at what was "
        "different then: a brake that rubs, another floor, a tire that lost air, somebody who "
        "pushes. Repeat the run once that is mended."
    )


def looking_at(run: str, begin: int, end: int) -> str:
    """What to do about what happened once in a run, by its name, between two seconds (s)."""
    return (
        f"Look at {run} between {begin} and {end} s: a knock, a hand or a bump that acted once "
        "explains what is missing. End the trial before, or begin it after, and diagnose again; "
        "or repeat it exactly as it was: what happened once does not come back."
    )


def repeating(run: str) -> str:
    """What to do where what one run shows, by its name, may be of this run or of all."""
    return (
        f"Repeat {run}, with its heading and its speed: something that acts in {run} alone fits as "
        "well as what acts in all runs, and no other run tells the two apart."
    )


def searching(drivers: Sequence[tuple[Driver, float]], pushed: Collection[str] = ()) -> str:
    """What to do about a force that no effect explains.

    Args:
      drivers: what it goes with, and by how many sigmas, strongest first.
      pushed: runs in which the chair gains speed though no torque is given.
    """
    if not drivers:
        return OTHERWISE
    run = drivers[0][0].trial
    if run in pushed:
        return (
            f"Diagnose again without {run}, or with only what follows its last push: no torque is "
            "given there and the chair gains speed, so somebody may have pushed it, and the force "
            "that is missing most acts at times of this run."
        )
    # a force at a moment fits anything: what else goes with it nearly as well says more
    telling = [
        driver
        for driver, sigmas in drivers
        if driver.quantity != Quantity.TIME and sigmas > NEARLY * drivers[0][1]
    ]
    return TIED[(telling or [drivers[0][0]])[0].quantity]
