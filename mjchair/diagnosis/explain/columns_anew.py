"""The columns of effects, made anew around a fit whose chair answers unlike the chair as given.

In: a base, and the fit of some effects. Out: the columns of the other effects around this fit, kept
in the base. They weigh what is missing besides. With a load of 40 kg casters swing another way, and
the column of a turning scrub changes by 0.6 of its own size. By the columns of the chair as given a
scrub of 24 sigma promised 0.4 of chi2 beside the load; its fit brought 67.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import groupby

from mjchair.diagnosis.explain import candidates
from mjchair.diagnosis.explain.screening import Base, Say
from mjchair.diagnosis.fit.column_ids import ColumnId, RoughlyKnown
from mjchair.diagnosis.fit.nonlinear import Fitted
from mjchair.diagnosis.replay.derivatives import Column
from mjchair.effects.effect import Effect

# share by which a column changes where a chair answers otherwise: 0.77 and more beside a load or a
# centre of mass 60 mm off, at most 0.37 beside a resistance, a drag, a toe or a torque's gain
OTHERWISE = 0.5


def make(base: Base, fitted: Fitted, say: Say) -> bool:
    """Make the columns around a fit and keep them in the base; False: the known ones are kept.

    The known ones are kept where those of the effects that every chair has a little of change
    little: what hides beside others is mostly one of these.

    Args:
      say: is called with the name of the stage as it begins.
    """
    keys = frozenset(t.effect.key for t in fitted.variant.terms)
    if keys in base.anew or all(t.effect.sensor is not None for t in fitted.variant.terms):
        return False
    others = [e for e in _effects(base) if e.key not in keys]
    probe = _made(base, fitted, [e for e in others if e.everywhere])
    if not _changed(base, fitted, probe):
        return False
    say("effects, around a chair that answers otherwise")
    rest = _made(base, fitted, [e for e in others if not e.everywhere])
    base.anew[keys] = {**rest, **probe}
    return True


def _effects(base: Base) -> list[Effect]:
    """The effects that were screened, but for those whose columns are made of pulses of force."""
    forms = {id(s.effect): s.effect for s in base.starts}.values()
    shaped = {e.key for e in forms if e.wave is not None or e.place is not None}
    return [e for e in forms if e.key not in shaped]


def _made(base: Base, fitted: Fitted, effects: Sequence[Effect]) -> dict[ColumnId, Column]:
    """Columns of effects around a fit; all forms of an effect, or none where a form cannot be."""
    around = replace(base.around, track=fitted.track, variant=fitted.variant)
    out: dict[ColumnId, Column] = {}
    for _, forms in groupby(sorted(effects, key=lambda e: e.key), key=lambda e: e.key):
        tried = candidates.collect(around, list(forms), lambda _: None)
        if not tried.dropped:
            out |= {name: column for name, column in tried.columns.items() if name in base.columns}
    return out


def _changed(base: Base, fitted: Fitted, made: dict[ColumnId, Column]) -> bool:
    """Whether any column is not what it was, beside what each window is free in."""
    pairs = [(RoughlyKnown(f"before:{k}"), name) for k, name in enumerate(made)]
    columns: dict[ColumnId, Column] = {before: base.columns[now] for before, now in pairs}
    columns |= made
    windows = base.bench.windows
    system = base.bench.system(fitted.track, columns, 0, fitted.variant, only=windows)
    G = system.G[windows].sum(axis=0)
    for pair in pairs:
        before, now = system.index(pair)
        apart = G[before, before] - 2.0 * G[before, now] + G[now, now]
        if apart > OTHERWISE**2 * max(G[before, before], 1.0):
            return True
    return False
