"""One run of a diagnosed study in three dimensions: measured, and as both chairs go through it.

In: a study and its diagnosis. Out: HTML for the report: the chair after the correction (before it,
where nothing was corrected) with its tires' forces, and as ghosts the chair before and the measured
run. Both chairs are simulated in one go with the measured inputs, from the run's first place,
heading and speed, with everything that is only roughly known as the study has it.
"""

from __future__ import annotations

from html import escape

import mujoco

from mjchair.diagnosis.data.first_state import initial
from mjchair.diagnosis.data.study import Run, Study
from mjchair.diagnosis.diagnose import corrected
from mjchair.diagnosis.result import Diagnosis
from mjchair.errors import MjchairError
from mjchair.model.rolling import rear_axle
from mjchair.report.replay.measured import plane_motion
from mjchair.report.replay.page import Shown, replay
from mjchair.simulation.inputs import Inputs, drivable
from mjchair.simulation.recording import Recording
from mjchair.simulation.simulate import simulate

LONGEST = 30.0  # s, of the run that is shown; of a longer one the beginning
BEFORE, AFTER, MEASURED = "the chair as it was", "the corrected chair", "measured"


def section(study: Study, diagnosis: Diagnosis) -> str:
    """HTML of the replay; one sentence where no chair can be driven through the run."""
    run = shown_run(study, diagnosis)
    try:
        before = driven(study.spec, run)
        after = driven(corrected(study, diagnosis), run) if diagnosis.effects else None
    except MjchairError as error:
        return _sentence(f"No replay of {run.trial.name}: {error}.")
    ghosts: dict[str, Shown] = {} if after is None else {BEFORE: before}
    told = f"Run {run.trial.name} in three dimensions, driven by its measured inputs."
    try:
        plane_motion(run.trial, before.model.load())
        ghosts[MEASURED] = run.trial
    except MjchairError:
        told += " The measured chair is not drawn: no channel tells how far it went."
    page = replay(
        before if after is None else after,
        ghosts,
        title=f"Replay of {run.trial.name}",
        label=BEFORE if after is None else AFTER,
    )
    return _sentence(told) + page.frame()


def shown_run(study: Study, diagnosis: Diagnosis) -> Run:
    """The first of the whole runs that the report draws; else the longest run of the study."""
    drawn = [] if diagnosis.evidence is None else [r.trial for r in diagnosis.evidence.runs]
    named = [run for run in study.runs if drawn and run.trial.name == drawn[0]]
    return named[0] if named else max(study.runs, key=lambda run: run.duration)


def driven(spec: mujoco.MjSpec, run: Run) -> Recording:
    """A chair that goes through a run with its measured inputs, from its first state.

    Raises:
      MjchairError: the chair does not stand where the run begins.
    """
    spec = spec.copy()
    model = spec.compile()
    begin = float(run.trial.time[0])
    duration = min(run.duration, LONGEST)
    return simulate(
        spec, _inputs(run, model, begin), duration, initial=initial(run, rear_axle(model))
    )


def _inputs(run: Run, model: mujoco.MjModel, begin: float) -> Inputs | None:
    """What drove the run, from 0 s, and its motions that an actuator of the chair follows."""
    given = run.trial.inputs
    controls = {} if given is None else dict(given.controls)
    controls |= {name: v for name, v in run.trial.other.items() if name in drivable(model)}
    if not controls:
        return None
    return Inputs(
        run.trial.time - begin, controls, run.trial.name, given is not None and given.hold
    )


def _sentence(text: str) -> str:
    return f'<p class="note">{escape(text)}</p>'
