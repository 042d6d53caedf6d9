"""One run of a diagnosed study in three dimensions: measured, and as both chairs go through it.

In: a `DrivenRun`, simulated by mjchair.diagnosis.driven_run. Out: HTML for the report: the chair
after the correction (before it, where nothing was corrected) with its tires' forces, and as ghosts
the chair before and the measured run.
"""

from __future__ import annotations

from html import escape

from mjchair.diagnosis.driven_run import DrivenRun
from mjchair.errors import MjchairError
from mjchair.report.replay.measured import plane_motion
from mjchair.report.replay.page import Shown, replay

BEFORE, AFTER, MEASURED = "the chair as it was", "the corrected chair", "measured"


def section(driven: DrivenRun) -> str:
    """HTML of the replay, below one sentence on what it shows."""
    trial, before, after = driven.run.trial, driven.before, driven.after
    ghosts: dict[str, Shown] = {} if after is None else {BEFORE: before}
    told = f"Run {trial.name} in three dimensions, driven by its measured inputs."
    try:
        plane_motion(trial, before.model.load())
        ghosts[MEASURED] = trial
    except MjchairError:
        told += " The measured chair is not drawn: no channel tells how far it went."
    page = replay(
        before if after is None else after,
        ghosts,
        title=f"Replay of {trial.name}",
        label=BEFORE if after is None else AFTER,
    )
    return _sentence(told) + page.frame()


def no_replay(reason: str) -> str:
    """HTML in place of the replay where no chair can be driven through the run."""
    return _sentence(f"No replay: {reason}.")


def _sentence(text: str) -> str:
    return f'<p class="note">{escape(text)}</p>'
