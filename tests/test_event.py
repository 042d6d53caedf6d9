"""What happened once, in one run, as a rival of effects."""

from types import SimpleNamespace

import numpy as np

import mjchair
from mjchair.diagnosis import notes
from mjchair.diagnosis.explain import event
from mjchair.diagnosis.explain.column_ids import Driver, ForceColumn, ForceGroup, Quantity
from mjchair.diagnosis.replay.pulses import Force
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


def test_what_to_do_about_an_event_is_to_cut_it_out_but_not_a_whole_run():
    """Where somebody may have pushed all along, the next step is to leave the run out."""
    note = notes.of_event(event.Event(gain=95.0, trial="a", begin=1, end=3), share=0.9)
    assert "between 1 and 3 s" in note and "90 %" in note
    assert note.endswith("cut the trial there")
    pushed = event.Event(gain=165.0, trial="a", begin=0, end=5, whole=True)
    assert "cut" not in notes.of_event(pushed, share=0.9)
