"""From a study to a verdict: the stages one after another, each usable alone.

In: a study or its folder. Out: a `Diagnosis`, and from it the corrected chair.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace

import mujoco

from mjchair.diagnosis.data.roughly_known import mistaken
from mjchair.diagnosis.data.study import Study, without_estimated_torques
from mjchair.diagnosis.data.study_file import read_study
from mjchair.diagnosis.decide import conclude
from mjchair.diagnosis.explain.fits import Fits
from mjchair.diagnosis.explain.further_effects import without_hidden
from mjchair.diagnosis.explain.screening import Say, prepare, screen_columns, silent
from mjchair.diagnosis.explain.selection import explained
from mjchair.diagnosis.replay import strokes
from mjchair.diagnosis.replay.cache import Store
from mjchair.diagnosis.result import Diagnosis
from mjchair.effects.effect import Effect
from mjchair.effects.library import library
from mjchair.effects.torque_gain import EFFECT as TORQUE_GAIN
from mjchair.model.engine_warnings import without_engine_warnings

# times as common as others: who writes an effect has a reason to suspect it, and no two hands push
# alike where the torque of one was measured for both (assumptions)
SUSPECTED = 8.0


def study_effects(study: Study, more: Sequence[Effect] = ()) -> list[Effect]:
    """The effects that this study could show."""
    columns = {name for run in study.runs for name in (*run.trial.other, *strokes.courses(run))}
    driven = any(run.trial.inputs is not None for run in study.runs)
    known = library(study.channels, columns, driven, study.spec)
    possible = [
        effect
        for effect in known
        if not (effect.outdoors and study.indoors)
        and not (effect.place and study.unplaced)
        and not (effect.turning and study.straight)
        and effect.commanded in (None, not study.torque_measured)
    ]
    wrong = mistaken(study.channels, study.nuisance, study.driven_as_measured)
    suspected = (replace(effect, common=SUSPECTED * effect.common) for effect in more)
    if any(run.torque_assumed for run in study.runs):
        possible = [_of_two_hands(effect) for effect in possible]
    return [*(_rarer(effect, wrong) for effect in possible), *suspected]


def _of_two_hands(effect: Effect) -> Effect:
    """The effect, more common where it says that the two torques are not alike."""
    doubted = effect.key == TORQUE_GAIN.key
    return replace(effect, common=SUSPECTED * effect.common) if doubted else effect


def _rarer(effect: Effect, wrong: Mapping[str, float]) -> Effect:
    """The effect, less common where it says that something measured is wrong."""
    share = min((wrong[name] for name in effect.doubts if name in wrong), default=1.0)
    return replace(effect, common=effect.common * share)


def diagnose(
    study: Study | str | os.PathLike[str],
    *,
    effects: Sequence[Effect] = (),
    say: Say = silent,
    store: Store | None = None,
    threads: int = 0,
    patience: float = 1.0,
) -> Diagnosis:
    """Find where model and measurement disagree, and name the effect that is missing.

    Args:
      study: a study, or its folder.
      effects: of your own, besides the library's.
      say: is called with the name of every stage as it begins.
      store: keeps simulations, so that a second start goes on from an interrupted one.
      threads: that simulate; 0: all processors. The result does not depend on their number.
      patience: times as many simulations as usual, after which no further effect is sought. Only
        long searches come to this end, and the diagnosis says so.

    Raises:
      MjchairError: a study that cannot be read or simulated, as one line.
    """
    told = study if isinstance(study, Study) else read_study(study)
    known = without_estimated_torques(told)
    # threads cost the linear algebra more than they bring on matrices this small
    from threadpoolctl import threadpool_limits  # sets an environment variable when imported

    with threadpool_limits(1, user_api="blas"), without_engine_warnings():
        bench, first = prepare(known, say, store, threads)
        base = screen_columns(bench, first, study_effects(known, effects), say)
        base.patience = patience
        found = explained(without_hidden(Fits(base, say)))
        say("the verdict, and the experiment to do next")
        return conclude(*found)


def corrected(study: Study, diagnosis: Diagnosis) -> mujoco.MjSpec:
    """The study's chair with the effects of the diagnosis in it.

    What is only roughly known stands where the fit of these effects moved it, so that the chair
    leaves the gap that the diagnosis says. Biases and scales of sensors are no chair's.
    """
    spec = study.spec.copy()
    if diagnosis.correction is not None:
        diagnosis.correction.edit_chair(spec)
    for term in diagnosis.terms:
        term.effect.apply(spec, term.values)
    return spec
