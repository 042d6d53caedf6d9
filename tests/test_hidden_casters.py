"""Casters whose angles no channel sees, in a run in which they turn over."""

import numpy as np
import pytest

import mjchair
from mjchair.diagnosis.data.study import Run, make_study
from mjchair.diagnosis.replay import noise
from mjchair.diagnosis.replay.simulator import WindowSimulator
from mjchair.diagnosis.replay.window_states import track
from mjchair.effects import caster_friction
from mjchair.measurement.trial import Trial
from mjchair.practice import NOISE, SECONDS, manoeuvres
from mjchair.simulation.initial import Initial

EVERY = 5  # steps a sample
SIDES = ("left", "right")


def _edit(spec):
    caster_friction.edit(spec, 0.2, 2.0)


@pytest.fixture(scope="module")
def turned_over():
    """Windows of a chair that rolls backward and is driven forward; the casters' angles at each."""
    (made,) = (m for m in manoeuvres() if m.word == "reverse")
    spec = mjchair.load_spec("manual")
    _edit(spec)
    run = mjchair.simulate(spec, made.inputs, SECONDS, initial=made.initial)
    rng = np.random.default_rng(4)
    time = run.time[::EVERY]
    measured = {
        c: np.asarray(run.channels[c])[::EVERY] + std * rng.standard_normal(time.size)
        for c, std in NOISE.items()
    }
    trial = Trial("reverse", time, measured, made.inputs, {})
    begun = Run(trial, "reverse", False, Initial(**made.initial), frozenset())
    study = make_study(mjchair.load_spec("manual"), [begun], NOISE)
    simulator = WindowSimulator(study, threads=1)
    starts = [w.start for w in simulator.windows]
    angles = [np.interp(starts, run.time, run.channels[f"{s}_caster_angle"]) for s in SIDES]
    return simulator, np.transpose(angles)


def _off(simulator, found, angles):
    """By how much the casters of each window stand otherwise than they did, rad, (windows, 2)."""
    stand = np.array([state.qpos[simulator.chair.swivel_q] for state in found.states])
    return np.abs(np.angle(np.exp(1j * (stand - angles))))


def test_casters_turn_over_with_the_right_chair_though_they_did_not_with_another(turned_over):
    """Where no step leads from one side to the other, the window before tells the side."""
    simulator, angles = turned_over
    known = noise.estimate(simulator.study)
    found = track(simulator, simulator.base, known)
    assert (_off(simulator, found, angles)[-1] > 2.0).all()
    found = track(simulator, simulator.compile(_edit), known, before=found, anew=True)
    assert (_off(simulator, found, angles)[1:] < 0.1).all()
