"""What happened once, in one run, as a rival of effects."""

from dataclasses import replace
from types import SimpleNamespace

import linear_system
import numpy as np
import pytest

import mjchair
from mjchair.diagnosis import notes, rules
from mjchair.diagnosis.explain import event
from mjchair.diagnosis.explain.column_ids import Driver, ForceColumn, ForceGroup, Quantity
from mjchair.diagnosis.next_experiment import wording
from mjchair.diagnosis.replay.pulses import Force, Pulse
from mjchair.measurement.trial import Trial

BRINGS = {("a", 0): 10.0, ("a", 1): 50.0, ("a", 2): 45.0, ("a", 4): 60.0, ("b", 1): 80.0}


def bench(**speeds):
    """Runs that roll from one speed (m/s) to another in 2 s, without torque."""
    time = np.arange(0.0, 2.0, 0.02)
    runs = []
    for name, ends in speeds.items():
        rolls = {"velocity.x": np.interp(time, [0.5, 1.5], ends)}
        trial = Trial(name, time, rolls, None, {})
        runs.append(SimpleNamespace(trial=trial))
    simulator = SimpleNamespace(
        base=mjchair.load_spec("manual").compile(), study=SimpleNamespace(runs=runs)
    )
    return SimpleNamespace(simulator=simulator)


@pytest.fixture
def by_seconds(monkeypatch):
    """An event is no better than forces of whole seconds say."""
    monkeypatch.setattr(event, "_of_any_course", lambda _, most: most)


@pytest.mark.usefixtures("by_seconds")
def test_the_best_event_lies_in_one_run_and_in_seconds_that_follow_each_other():
    """Each force brings half; forces with other drivers are no events."""
    brings = {
        ForceColumn(ForceGroup(force, Driver(Quantity.TIME, run)), second): 0.5 * gain
        for (run, second), gain in BRINGS.items()
        for force in (Force.FORWARD, Force.YAW)
    }
    brings[ForceColumn(ForceGroup(Force.FORWARD, Driver(Quantity.SPEED)), 0)] = 900.0
    reduced = SimpleNamespace(index=list, gain=lambda which: sum(brings[c] for c in which))
    base = SimpleNamespace(columns=brings, reduced=reduced, bench=bench(a=[1.0, 0.9]))
    assert event.largest(base) == event.Event(gain=95.0, trial="a", begin=1, end=3)
    none = SimpleNamespace(columns={}, reduced=reduced, bench=base.bench)
    assert event.largest(none).gain == 0.0


@pytest.mark.usefixtures("by_seconds")
def test_where_a_chair_gains_speed_without_torque_somebody_may_have_pushed_all_along():
    """From 0 to 1 m/s in run a: all of its forces are one event; run b only slows down."""
    brings = {
        ForceColumn(ForceGroup(Force.FORWARD, Driver(Quantity.TIME, run)), second): gain
        for (run, second), gain in BRINGS.items()
    }
    reduced = SimpleNamespace(index=list, gain=lambda which: sum(brings[c] for c in which))
    slows = SimpleNamespace(
        columns=brings, reduced=reduced, bench=bench(a=[1.0, 0.9], b=[1.0, 0.9])
    )
    assert event.largest(slows).gain == 95.0
    gains = SimpleNamespace(
        columns=brings, reduced=reduced, bench=bench(a=[0.0, 1.0], b=[1.0, 0.9])
    )
    assert event.largest(gains) == event.Event(gain=165.0, trial="a", begin=0, end=5, whole=True)


@pytest.mark.parametrize(("knock", "brings"), [(0.3, 2500.0), (0.0, 0.0)])
def test_a_knock_that_is_shorter_than_a_second_is_an_event(knock, brings):
    """Two seconds of a coast, in which speed is lost within 0.3 s; the second window is of another
    run, and no force that turns."""
    at = np.linspace(0.0, 2.0, 11)
    time = np.linspace(0.0, 2.0, 200)

    def lost(since, last):  # speed, by a force of 1 from `since` on
        return np.clip((time - since) / 0.2, 0.0, 1.0) if last else np.zeros(time.size)

    pulses = [Pulse(Force.FORWARD, w, float(t), 0.2) for w in (0, 1) for t in at]
    answers = [lost(p.time, p.window == 0)[:, None] for p in pulses]
    made = lost(1.15, True) * knock
    size = np.sqrt(brings / np.sum(made**2)) if brings else 0.0
    miss = [size * made, np.zeros(time.size)]
    windows = [SimpleNamespace(run=0, rows=time), SimpleNamespace(run=1, rows=time)]
    runs = [SimpleNamespace(trial=SimpleNamespace(name=name)) for name in "ab"]

    def system(track, columns, nuisance, variant):
        J = [np.stack([c[w][:, 0] for c in columns.values()], axis=1) for w in (0, 1)]
        both = [linear_system.system(columns, j, r) for j, r in zip(J, miss, strict=True)]
        joined = {n: np.concatenate([getattr(s, n) for s in both]) for n in "Gbc"}
        return replace(both[0], run=np.arange(2), **joined)

    simulator = SimpleNamespace(
        windows=windows, channels=("speed",), study=SimpleNamespace(runs=runs)
    )
    base = SimpleNamespace(
        bench=SimpleNamespace(simulator=simulator, windows=np.arange(2), system=system),
        around=SimpleNamespace(pulses=pulses, answers=answers, track=None, variant=None),
        nuisances={},
    )
    rough = event.Event(gain=0.6 * brings, trial="a", begin=0, end=2)
    found = event._of_any_course(base, rough)
    assert found.gain == pytest.approx(brings, rel=0.05, abs=1e-6)
    assert (found.trial, found.begin, found.end) == ("a", 0, 2)


def test_where_a_knock_explains_the_gap_no_second_effect_is_sought():
    assert rules.is_clearly_once(event=2480.0, gain=390.0, excess=2400.0)
    assert not rules.is_clearly_once(event=2000.0, gain=2600.0, excess=2400.0)
    assert not rules.is_clearly_once(event=1400.0, gain=390.0, excess=2400.0)


@pytest.mark.parametrize(("gain", "explains"), [(500.0, True), (300.0, False)])
def test_an_event_that_explains_a_gap_is_told_with_its_run_and_time(gain, explains, monkeypatch):
    once = event.Event(gain=gain, trial="r2", begin=2, end=4)
    monkeypatch.setattr(event, "largest", lambda _: once)
    gap = SimpleNamespace(tests=[SimpleNamespace(statistic=x) for x in (450.0, 20.0)])
    assert event.explaining(None, gap) == (once if explains else None)
    assert "r2 between 2 and 4 s" in wording.looking_at("r2", 2, 4)


def test_what_to_do_about_an_event_is_to_cut_it_out_but_not_a_whole_run():
    """Where somebody may have pushed all along, the next step is to leave the run out."""
    note = notes.of_event(event.Event(gain=95.0, trial="a", begin=1, end=3), share=0.9)
    assert "between 1 and 3 s" in note and "90 %" in note
    assert note.endswith("cut the trial there")
    pushed = event.Event(gain=165.0, trial="a", begin=0, end=5, whole=True)
    assert "cut" not in notes.of_event(pushed, share=0.9)
