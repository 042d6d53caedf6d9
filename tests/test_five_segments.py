"""A person of five segments, by equations other than MuJoCo's, against the chair."""

import dataclasses
import math
from itertools import pairwise

import numpy as np
import pytest
from five_segments import (
    Case,
    Chair,
    Hidden,
    Person,
    Start,
    body,
    centre_of_mass,
    roll,
    strokes,
    tables,
)

import mjchair
from mjchair.effects import rider_motion

SECONDS = 8.0


@pytest.fixture(scope="module")
def pushed():
    """A push of a person who moves: columns without noise in the torque, and when strokes begin."""
    case = Case(Hidden(), coasts=0, pushes=1)
    begins, strength = strokes(case.person, SECONDS, np.random.default_rng(0))
    columns = tables(case)[0]["push_1"]
    segments = body(case.person, Chair(), SECONDS, begins, strength)
    columns["rider_motion"] = centre_of_mass(case.person, segments, columns["time"])
    return columns, begins


def simulated(columns, mass):
    """Speed (m/s) of the chair with `mass` (kg) of its rider moving as was measured."""
    spec = mjchair.load_spec()
    names = ["left_wheel", "right_wheel"]
    if mass:
        rider_motion.MEASURED.on(spec).apply(spec, {"mass": mass})
        names.append("rider_motion")
    inputs = mjchair.Inputs(columns["time"], {name: columns[name] for name in names})
    run = mjchair.simulate(spec, inputs, SECONDS, initial={"speed": 0.9}, sample_rate=100.0)
    return np.interp(columns["time"], run.time, run["left_wheel_speed"]) * Chair().rear_radius


def within_strokes(speed, time, begins):
    """The speed of every stroke less its mean, and the phase (turns) of its peak."""
    parts, peaks = [], []
    for a, b in pairwise(begins):
        inside = (time >= a) & (time < b)
        part = np.convolve(speed, np.ones(5) / 5.0, "same")[inside]
        parts.append(part - part.mean())
        peaks.append(np.argmax(part) / part.size)
    return np.concatenate(parts), np.array(peaks)


def test_a_rigid_person_rolls_alike_in_both(pushed):
    """Two models of other makes: where nobody moves they agree to 1 cm/s, whatever is pushed."""
    for case in (Case(Hidden(moves=False), coasts=1, pushes=1, measured=False),):
        for columns in tables(case)[0].values():
            names = [n for n in ("left_wheel", "right_wheel") if n in columns]
            inputs = mjchair.Inputs(columns["time"], {n: columns[n] for n in names})
            start = {"speed": 0.9 if names else 1.4}
            run = mjchair.simulate(
                mjchair.load_spec(), inputs if names else None, SECONDS, initial=start
            )
            speed = np.interp(columns["time"], run.time, run["left_wheel_speed"]) * 0.3
            assert np.std(speed - 0.3 * columns["left_wheel_speed"]) < 0.012


def test_a_load_takes_part_in_what_drives_and_in_what_rolls():
    """A push of 1 N m on each rim gains F t / m; a load adds its rolling resistance and no more."""
    person, fine = Person(), np.full(801, 1.0)
    still = body(person, Chair(), 2.0, np.zeros(0), np.zeros(0))

    def gained(rolling, load):
        chair = Chair(rolling_rear=rolling, rolling_caster=rolling, load=load)
        run = roll(person, chair, Hidden(moves=False), still, fine, Start(1.0, 1.0))
        return run.gained[-1]

    spin = sum(
        2.0 * inertia / radius**2
        for inertia, radius in (
            (Chair().rear_inertia, Chair().rear_radius),
            (Chair().caster_inertia, Chair().caster_radius),
        )
    )
    for load in (0.0, 40.0):
        whole = person.mass + Chair().mass + load
        force = 2.0 / Chair().rear_radius
        assert gained(0.0, load) * (whole + spin) == pytest.approx(force)
        assert gained(0.01, load) * (whole + spin) == pytest.approx(force - 0.01 * 9.81 * whole)


def test_speed_within_a_stroke_is_the_moving_riders_and_not_the_rigid_ones(pushed):
    columns, begins = pushed
    time, measured = columns["time"], Chair().rear_radius * columns["left_wheel_speed"]
    true, peaks = within_strokes(measured, time, begins)
    rigid, _ = within_strokes(simulated(columns, 0.0), time, begins)
    moving, own = within_strokes(simulated(columns, Person().mass), time, begins)
    rms = [float(np.sqrt(np.mean((model - true) ** 2))) for model in (rigid, moving)]
    assert rms[1] < 0.6 * rms[0]
    away = np.abs((own - peaks + 0.5) % 1.0 - 0.5)
    assert np.median(away) < 0.08


def test_pushes_that_would_lift_the_casters_are_refused():
    case = dataclasses.replace(Case(Hidden()), person=Person(torque=30.0, bend=math.radians(12.0)))
    with pytest.raises(ValueError, match="the casters would lift"):
        tables(case)
