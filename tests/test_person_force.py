"""What a person who moves does to the chair besides what was measured of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import mjchair
from mjchair.diagnosis.data.study import Run, make_study
from mjchair.diagnosis.fit import process
from mjchair.diagnosis.fit.process import KINDS, Part, Process
from mjchair.diagnosis.replay.person_force import person_force
from mjchair.diagnosis.replay.pulses import Force, Pulse
from mjchair.diagnosis.replay.simulator import WindowSimulator
from mjchair.errors import MjchairError
from mjchair.measurement.trial import Trial
from mjchair.model import inertials, moving_share
from mjchair.simulation.inputs import Inputs

TIME = np.arange(0.0, 10.0, 0.01)
AMPLITUDE, HZ = 0.03, 1.0  # m, of a trunk that bends once a second


def run(other=None, inputs=None):
    channels = {"left_wheel_speed": np.full(TIME.size, 3.0)}
    return Run(Trial("a", TIME, channels, inputs, other or {}), "a", False, {}, frozenset())


def study(*runs, measured=True):
    return replace(make_study(mjchair.load_spec(), list(runs)), torque_measured=measured)


def test_a_measured_motion_pushes_by_mass_times_acceleration():
    moves = run({"rider_motion": AMPLITUDE * np.sin(2.0 * np.pi * HZ * TIME)})
    made = study(moves)
    time, force = person_force(made, moves)
    mass = moving_share.rider_mass(made.spec)
    assert mass == pytest.approx(75.0, abs=0.1)
    rms = mass * AMPLITUDE * (2.0 * np.pi * HZ) ** 2 / np.sqrt(2.0)
    inside = (time > 1.5) & (time < 8.5)
    np.testing.assert_allclose(force[inside], rms, rtol=0.03)


def test_strokes_push_by_torque_over_radius_and_only_where_hands_were_measured():
    stroke = 20.0 * np.maximum(np.sin(2.0 * np.pi * HZ * TIME), 0.0) ** 2
    pushed = run(inputs=Inputs(TIME, {"left_wheel": stroke, "right_wheel": stroke}))
    time, force = person_force(study(pushed), pushed)
    radius = study(pushed).axle.left
    inside = (time > 1.0) & (time < 9.0)
    rms = 2.0 * np.sqrt(np.mean(stroke**2)) / radius
    np.testing.assert_allclose(force[inside], rms, rtol=0.02)
    assert not person_force(study(pushed, measured=False), pushed)[1].any()


def test_nobody_pushes_where_nothing_tells_of_a_person():
    coast = run()
    assert not person_force(study(coast), coast)[1].any()
    still = run({"rider_motion": np.zeros(TIME.size)})
    assert person_force(study(still), still)[1].max() < 1e-9


def test_what_is_in_no_model_comes_and_goes_with_the_force():
    """A tenth of 30 N in the first half of a window, of nothing in the second."""
    pulses = [Pulse(Force.FORWARD, 0, t, 0.2) for t in np.arange(0.0, 2.0, 0.2)]
    size = np.where(np.array([p.time for p in pulses]) < 1.0, 30.0, 0.0)
    made = Process(
        np.zeros(1, np.int64), pulses, [], {p: np.zeros(1) for p in KINDS}, size, np.zeros((10, 4))
    )
    cover = 0.1**2 * made.correlation(range(len(pulses)), Part.PERSON)
    np.testing.assert_allclose(np.sqrt(np.diag(cover)), 0.1 * size)
    assert np.linalg.eigvalsh(cover).min() > -1e-12


def test_a_share_is_no_newton():
    levels = {part: np.zeros(3) for part in KINDS} | {Part.PERSON: np.full(3, 0.07)}
    assert process.level(levels, "person") == pytest.approx(0.07)
    assert process.level(levels, "drive") == 0.0


def test_a_wheel_that_is_not_round_pushes_once_a_turn_in_one_phase():
    """The covariance is that of a sine of unknown phase; what turns too fast is left out."""
    time = np.arange(0.0, 2.0, 0.2)
    pulses = [Pulse(Force.FORWARD, 0, t, 0.2) for t in time]
    angles = np.column_stack([3.0 * time, 3.0 * time, 12.0 * time, 12.0 * time])
    made = Process(
        np.zeros(1, np.int64), pulses, [], {p: np.zeros(1) for p in KINDS}, 0.0 * time, angles
    )
    which = range(len(pulses))
    cover = made.correlation(which, Part.WHEEL_TURN)
    np.testing.assert_allclose(cover, np.cos(3.0 * (time[:, None] - time)), atol=1e-12)
    assert np.linalg.matrix_rank(cover, tol=1e-9) == 2
    assert not made.correlation(which, Part.CASTER_TURN).any()


@pytest.mark.parametrize("inertia", [(-1.0, 1.0, 1.0), (1.0, 1.0, 3.0)])
def test_a_body_that_cannot_be_is_said_in_plain_words(inertia):
    """As much of a person may be asked to move as leaves a chair of no mass."""

    def edit(spec):
        body = inertials.explicit(spec, "chair")
        body.mass, body.inertia, body.fullinertia = 10.0, inertia, [np.nan] * 6

    with pytest.raises(MjchairError, match="no body can have the mass or the inertia") as error:
        WindowSimulator(study(run())).compile(edit)
    assert "\n" not in str(error.value) and "mjMINVAL" not in str(error.value)
