"""A linear system of few columns, and starts of effects with one column each, for tests."""

import numpy as np

from mjchair.diagnosis.explain.candidates import Start
from mjchair.diagnosis.explain.column_ids import EffectColumn, EffectGroup
from mjchair.diagnosis.fit.system import System
from mjchair.effects.library import find


def start(name):
    """An effect with one column: its first parameter, by its usual change."""
    effect = find(name)
    group = EffectGroup(name, 0)
    p = effect.fitted[0]

    def combine(coefficients):
        return {p.name: p.neutral + float(coefficients[0]) * p.change}

    return Start(
        effect=effect,
        group=group,
        columns=(EffectColumn(group, 0),),
        combine=combine,
        free=(p.name,),
    )


def system(columns, J, r):
    """One window: its white columns J (samples, columns) and residual r (samples,)."""
    return System(
        columns=list(columns),
        nuisance=0,
        G=(J.T @ J)[None],
        b=(J.T @ r)[None],
        c=np.array([r @ r]),
        run=np.zeros(1, int),
        back=np.zeros(0),
    )
