"""The most that something that happened once explains: a push, a bump, a gust in one run.

In: the screened columns, among them forces that act in one second of one run, and pulses of force.
Out: which brings most chi2, in two seconds, or in all of a run in which somebody may have pushed.
Where it is about what an effect brings, nothing tells the two apart: a place that is passed once
looks like a moment.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from mjchair.diagnosis import rules
from mjchair.diagnosis.data.sign_checks import gains_undriven
from mjchair.diagnosis.explain.column_ids import Driver, ForceColumn, ForceGroup, Quantity
from mjchair.diagnosis.explain.gap import Gap
from mjchair.diagnosis.explain.missing_force import add_answer
from mjchair.diagnosis.explain.screening import Base
from mjchair.diagnosis.fit import bounded
from mjchair.diagnosis.fit.column_ids import ColumnId
from mjchair.diagnosis.replay.derivatives import Column
from mjchair.diagnosis.replay.pulses import Force
from mjchair.diagnosis.replay.simulator import WindowSimulator
from mjchair.model.rolling import rear_axle

EVENT = "event"  # something that happened once: no effect, but a rival of effects seen once
LASTS = 2  # seconds that follow each other, which an event may lie across


@dataclass(frozen=True)
class Event:
    """Chi2 that an event brings, the run's name, and the seconds of the run's clock it lies in.

    Attributes:
      whole: whether it lasts for the whole run, in which somebody may have pushed.
    """

    gain: float
    trial: str = ""
    begin: int = 0
    end: int = 0
    whole: bool = False


def largest(base: Base) -> Event:
    """The event of one run that brings most: a force and a yaw moment.

    It lasts for LASTS seconds, found by forces of whole seconds, in which it may be of any course;
    for the whole run where that gains speed and no torque is given, since somebody may have pushed
    the chair.
    """
    gaining = pushed(base.bench.simulator)
    moments: dict[str, dict[int, list[ForceColumn]]] = {}
    for column in base.columns:
        if isinstance(column, ForceColumn) and column.group.driver.quantity == Quantity.TIME:
            run = moments.setdefault(column.group.driver.trial, {})
            run.setdefault(column.part, []).append(column)
    events = []
    for trial, run in moments.items():
        whole = trial in gaining
        spans = [(min(run), max(run) + 1)] if whole else [(k, k + LASTS) for k in run]
        events += [Event(_gain(base, run, span), trial, *span, whole) for span in spans]
    most = max(events, key=lambda event: event.gain, default=Event(0.0))
    return most if most.whole or not events else _of_any_course(base, most)


def explaining(base: Base, gap: Gap) -> Event | None:
    """The event that explains a gap about as well as any test shows it; None: none does."""
    once = largest(base)
    most = max((t.statistic for t in gap.tests), default=0.0)
    return once if rules.happened_once(event=once.gain, gain=most) else None


def pushed(simulator: WindowSimulator) -> set[str]:
    """Names of the runs that gain speed though no torque is given."""
    axle = rear_axle(simulator.base)
    trials = [run.trial for run in simulator.study.runs]
    return {trial.name for trial in trials if gains_undriven(trial, axle)}


def _gain(base: Base, run: dict[int, list[ForceColumn]], span: tuple[int, int]) -> float:
    """What the forces of a run bring between two seconds of its clock."""
    columns = [c for k in range(*span) for c in run.get(k, ())]
    return float(base.reduced.gain(base.reduced.index(columns)))


def _of_any_course(base: Base, event: Event) -> Event:
    """An event with a force and a yaw moment free in every pulse of its seconds.

    What these bring by chance, 1 of chi2 each, does not count. A knock of 40 N for 0.3 s lost speed
    that a force of a whole second lost too slowly: it brought 1434 of 2482, and a relaxation length
    of all runs had the rest.
    """
    bench, around = base.bench, base.around
    simulator = bench.simulator
    columns: dict[ColumnId, Column] = {}
    for k, (pulse, answer) in enumerate(zip(around.pulses, around.answers, strict=True)):
        trial = simulator.study.runs[simulator.windows[pulse.window].run].trial.name
        inside = trial == event.trial and event.begin <= pulse.time < event.end
        if inside and pulse.force != Force.LEFTWARD:
            group = ForceGroup(pulse.force, Driver(Quantity.TIME, trial))
            add_answer(columns, bench, ForceColumn(group, k), pulse, answer)
    known = {**base.nuisances, **columns}
    system = bench.system(around.track, known, len(base.nuisances), around.variant)
    reduced = bounded.reduce(system, bench.windows)
    brings = float(reduced.gain(reduced.index(list(columns)))) - len(columns)
    return replace(event, gain=max(event.gain, brings))
