"""One run of a diagnosed study, simulated with the chair before and after its correction.

In: a study and its diagnosis. Out: `DrivenRun`, the measured run and the recordings of both chairs,
which a report draws. The chairs carry the load of the run and are driven by the measured inputs,
from its first place, heading and speed, with everything that is only roughly known as the study has
it.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco

from mjchair.diagnosis.data.first_state import initial
from mjchair.diagnosis.data.study import Run, Study
from mjchair.diagnosis.diagnose import corrected
from mjchair.diagnosis.result import Diagnosis
from mjchair.model.load import strap
from mjchair.model.rolling import rear_axle
from mjchair.simulation.inputs import Inputs, drivable
from mjchair.simulation.recording import Recording
from mjchair.simulation.simulate import simulate
from mjchair.simulation.table import Table, merged

LONGEST = 30.0  # s, of the run that is simulated; of a longer one the beginning


@dataclass(frozen=True, kw_only=True)
class DrivenRun:
    """A measured run, and how chairs go through it.

    Attributes:
      run: measured. before: of the study's chair. after: of the corrected chair; None where nothing
        was corrected.
    """

    run: Run
    before: Recording
    after: Recording | None


def drive_run(study: Study, diagnosis: Diagnosis) -> DrivenRun:
    """Simulate the run that `representative_run` chooses.

    Raises:
      MjchairError: a chair does not stand where the run begins.
    """
    run = representative_run(study, diagnosis)
    return DrivenRun(
        run=run,
        before=_driven(study.spec, run),
        after=_driven(corrected(study, diagnosis), run) if diagnosis.effects else None,
    )


def representative_run(study: Study, diagnosis: Diagnosis) -> Run:
    """The first of the whole runs that the report draws; else the longest run of the study."""
    drawn = [] if diagnosis.evidence is None else [r.trial for r in diagnosis.evidence.runs]
    named = [run for run in study.runs if drawn and run.trial.name == drawn[0]]
    return named[0] if named else max(study.runs, key=lambda run: run.duration)


def _driven(spec: mujoco.MjSpec, run: Run) -> Recording:
    spec = spec.copy()
    if run.load is not None:
        strap(spec, run.load)
    model = spec.compile()
    begin = float(run.trial.time[0])
    duration = min(run.duration, LONGEST)
    return simulate(
        spec, _inputs(run, model, begin), duration, initial=initial(run, rear_axle(model))
    )


def _inputs(run: Run, model: mujoco.MjModel, begin: float) -> Inputs | None:
    """What drove the run, from 0 s, and its motions that an actuator of the chair follows."""
    given = run.trial.inputs
    followed = {name: v for name, v in run.trial.other.items() if name in drivable(model)}
    tables = [] if given is None else [Table(given.time, given.controls, run.trial.name)]
    tables += [Table(run.trial.time, followed, run.trial.name)] if followed else []
    if not tables:
        return None
    table = merged(tables)
    hold = given is not None and given.hold
    return Inputs(table.time - begin, table.columns, run.trial.name, hold)
