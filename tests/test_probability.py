"""Probabilities of hypotheses on small systems: they sum to 1 and follow evidence and priors."""

from types import SimpleNamespace

import numpy as np
import pytest

from mjchair.diagnosis.explain.candidates import Start
from mjchair.diagnosis.explain.column_ids import (
    Driver,
    EffectColumn,
    EffectGroup,
    ForceColumn,
    ForceGroup,
    Quantity,
)
from mjchair.diagnosis.explain.probability import NONE, OUTSIDE, of_effects, probabilities
from mjchair.diagnosis.fit import bounded
from mjchair.diagnosis.fit.system import System
from mjchair.diagnosis.replay.pulses import Force
from mjchair.effects.library import find

NAMES = ("rolling_resistance", "caster_trail", "caster_friction")


def start(name):
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


def base(size, alike=0.0, force=0.0):
    """Three effects and a force; the first has a size, the second looks like it by |cos| alike."""
    rng = np.random.default_rng(4)
    J = np.linalg.qr(rng.standard_normal((60, 4)))[0] * 10.0
    J[:, 1] = alike * J[:, 0] + np.sqrt(1.0 - alike**2) * J[:, 1]
    r = size * J[:, 0] + force * J[:, 3]
    starts = [start(name) for name in NAMES]
    columns = [s.columns[0] for s in starts]
    columns.append(ForceColumn(ForceGroup(Force.FORWARD, Driver(Quantity.SPEED)), 0))
    system = System(
        columns=columns,
        nuisance=0,
        G=(J.T @ J)[None],
        b=(J.T @ r)[None],
        c=np.array([r @ r]),
        run=np.zeros(1, int),
        back=np.zeros(0),
    )
    return SimpleNamespace(reduced=bounded.reduce(system, [0]), starts=starts)


@pytest.mark.parametrize("size", [0.0, 0.3, 2.0])
def test_they_sum_to_one(size):
    assert sum(probabilities(base(size), None).values()) == pytest.approx(1.0)


def test_without_a_gap_nothing_is_missing():
    assert max(probabilities(base(0.0), None).items(), key=lambda item: item[1])[0] == NONE


def test_a_clear_effect_is_nearly_certain():
    known = probabilities(base(2.0), None)
    assert known["rolling_resistance"] > 0.99
    assert of_effects(known, ["rolling_resistance"]) > 0.99


def test_effects_that_look_alike_share_it_the_common_one_first():
    known = probabilities(base(2.0, alike=0.9999), None)
    assert known["rolling_resistance"] > 2.0 * known["caster_trail"] > 0.2


def test_a_force_that_no_effect_makes_is_outside_the_library():
    assert probabilities(base(0.0, force=3.0), None)[OUTSIDE] > 0.95


def test_pairs_that_hold_an_effect_count_for_it():
    known = {"a": 0.5, "a+b": 0.3, "b": 0.1, "none": 0.1}
    assert of_effects(known, ["a"]) == pytest.approx(0.8)
    assert of_effects(known, ["a", "b"]) == pytest.approx(0.3)
