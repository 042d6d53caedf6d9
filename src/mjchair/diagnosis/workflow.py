"""From a study to a verdict: the stages one after another, each usable alone."""

from __future__ import annotations

import os
from collections.abc import Sequence

import mujoco
from threadpoolctl import threadpool_limits

from mjchair.diagnosis.conclusion import conclude
from mjchair.diagnosis.fitting import Fitted
from mjchair.diagnosis.screening import Say, gap_after, prepare, screen_columns, silent
from mjchair.diagnosis.search import choose
from mjchair.diagnosis.shooting import THREADS
from mjchair.diagnosis.store import Store
from mjchair.diagnosis.study import Study, read_study
from mjchair.diagnosis.verdict import AMBIGUOUS, NAMED, Diagnosis
from mjchair.effects import rider_sway
from mjchair.effects.effect import Effect
from mjchair.effects.library import library


def study_effects(study: Study, more: Sequence[Effect] = ()) -> list[Effect]:
    """The effects that this study could show."""
    motion = any(rider_sway.MOTION in run.trial.other for run in study.runs)
    driven = any(run.trial.inputs is not None for run in study.runs)
    return [*library(study.channels, motion, driven), *more]


def diagnose(
    study: Study | str | os.PathLike[str],
    *,
    effects: Sequence[Effect] = (),
    say: Say = silent,
    store: Store | None = None,
    threads: int = THREADS,
) -> Diagnosis:
    """Find where model and measurement disagree, and name the effect that is missing.

    Args:
      study: a study, or its folder.
      effects: of your own, besides the library's.
      say: is called with the name of every stage as it begins.
      store: keeps simulations, so that a second start goes on from an interrupted one.
      threads: that simulate.

    Raises:
      MjchairError: a study that cannot be read or simulated, as one line.
    """
    known = study if isinstance(study, Study) else read_study(study)
    # threads cost the linear algebra more than they bring on matrices this small
    with threadpool_limits(1, user_api="blas"):
        bench, found = prepare(known, say, store, threads)
        base = screen_columns(bench, found, study_effects(known, effects), say)
        say("the gap")
        gap, _, _ = gap_after(base, base.plain)
        say("effects, one and two at a time")
        return conclude(base, gap, choose(base, gap, say) if gap.exists else None)


def corrected(study: Study, diagnosis: Diagnosis) -> mujoco.MjSpec:
    """The study's chair with the effects of the diagnosis in it; nuisances stay as they were."""
    spec = study.spec.copy()
    fitted: Fitted | None = diagnosis.stages.get("fitted")
    if fitted is not None and diagnosis.verdict in (NAMED, AMBIGUOUS):
        for term in fitted.fit.terms:
            term.effect.apply(spec, term.values)
    return spec
