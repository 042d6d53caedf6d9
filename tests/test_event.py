"""What happened once, in one run, as a rival of effects."""

from types import SimpleNamespace

from mjchair.diagnosis.explain import event
from mjchair.diagnosis.explain.column_ids import Driver, ForceColumn, ForceGroup, Quantity
from mjchair.diagnosis.replay.pulses import Force

BRINGS = {("a", 0): 10.0, ("a", 1): 50.0, ("a", 2): 45.0, ("a", 4): 60.0, ("b", 1): 80.0}


def test_the_best_event_lies_in_one_run_and_in_seconds_that_follow_each_other():
    """Each force brings half; forces with other drivers are no events."""
    brings = {
        ForceColumn(ForceGroup(force, Driver(Quantity.TIME, run)), second): 0.5 * gain
        for (run, second), gain in BRINGS.items()
        for force in (Force.FORWARD, Force.YAW)
    }
    brings[ForceColumn(ForceGroup(Force.FORWARD, Driver(Quantity.SPEED)), 0)] = 900.0
    reduced = SimpleNamespace(index=list, gain=lambda which: sum(brings[c] for c in which))
    best = event.largest(SimpleNamespace(columns=brings, reduced=reduced))
    assert best == event.Event(gain=95.0, trial="a", second=1)
    assert event.largest(SimpleNamespace(columns={}, reduced=reduced)).gain == 0.0
