"""Rules of the search, as small functions of plain numbers: what is tried, kept, and a rival.

In go the numbers of fits (chi2, standard errors, shares); out come decisions: which hypotheses are
fitted and where a fit begins again, which effects are added and dropped, and which rivals are not
ruled out. Nothing is simulated or fitted here, so a rule is tested on numbers. The rules of the
verdict stand in ../rules.py; the thresholds of both were frozen on the development seeds of
benchmarks/blind (README there).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from mjchair.diagnosis.rules import (
    CLOSES,
    FORM,
    HELD,
    REPLACES,
    RIVAL_CHI2,
    ROUNDING,
    SIGMAS,
)

Array = NDArray[np.float64]
# how hypotheses grow and shrink
MOST = 3  # effects that are added
# simulated steps after which no further effect is sought (assumption): of nine studies five took 3
# to 10 million, and the longest 28
LONGEST = 3e7
# chi2 by which two effects at once are rarer than one of them: 2 ln(0.35 / (0.2 * 2 / 35)), of the
# priors in probability.py and of 35 effects
TOGETHER = 6.8
# how common what every chair has otherwise than its model is, over most effects (assumption)
USUAL = 4.0
PENALTY = 10.0  # chi2 that a parameter must bring: log of the number of samples
WORTH = 15.0  # chi2 that a further effect must bring besides the penalty of its parameters
LINEAR = 0.1  # share of its gain by which the linear promise of a hypothesis may be wrong
OVERSTATED = 0.5  # of what a choice brings: more lies between a chair and its own fit (assumption)
NEXT = 0.1  # share of the best linear gain by which a hypothesis that is fitted too may be behind
COARSE = 0.2  # the same share around a chair that is far from the data
TIE = 6.0  # chi2 within which hypotheses fit alike
# of the gain of all: what forms that are 4.5 % wrong leave, so less is no further effect
# (assumption; the rocking on its tires of a chair that is a little stiffer leaves as much)
LEFT_BY_FORM = 0.002
# of what a further effect must bring: where linear algebra around the fit promises less, none is
# fitted (assumption; a fit may bring more than was promised, where a place or a time is found)
HOPELESS = 0.3
SURE = 6.0  # standard errors beyond which an effect is not tried without
SHORT = 0.1  # share of the promise of the linear fit: a fit that misses more starts again elsewhere
# of what an effect in one run alone brings: by as much linear algebra promises less of effects in
# all runs (assumption; where these were right, in none of 15 studies did it promise less at all)
ALL_RUNS = 0.25
NOTHING = 1.0  # chi2 that decides nothing
# what is not of one size in all runs: share of what an effect brings, and the chance of noise
UNEVEN, BY_CHANCE = 0.1, 1e-4
# what keeps a rival
FAR_BEHIND = 3.0  # times what keeps a rival: a fit that promises no more is not followed
RIVAL_ERRORS = 2.0  # paired standard errors over windows: a rival this near is not ruled out
# what is believed of a parameter
SIZES = 5.0  # sizes worth finding: a standard error above tells nothing
SIZE_BY_FORM = 0.01  # of an effect's size: the form of no effect tells it better (assumption)


def differs_by_run(*, gained: float, free: int, brought: float) -> bool:
    """Whether an effect is not of one size in all runs.

    Args:
      gained: chi2 by sizes of their own. free: how many more these are.
      brought: chi2 that the effect brings; no form is so right that it is the same to the last.
    """
    if free < 1 or gained < UNEVEN * brought:
        return False
    return bool(stats.chi2.sf(max(gained, 0.0), free) < BY_CHANCE)


def is_of_one_run(*, by: float, gain: float) -> bool:
    """Whether an effect that acts in one run alone explains more than what acts in all runs.

    Args:
      by: chi2, with penalties, by which it is better than the best that acts in all of them.
      gain: chi2 that it brings, by linear algebra.
    """
    return by > max(WORTH, LINEAR * gain)


def is_clearly_of_one_run(*, by: float, gain: float, excess: float) -> bool:
    """Whether no effects that act in all runs need be fitted beside one that acts in one alone.

    Args:
      by, gain: as `is_of_one_run` takes them, against the best by linear algebra.
      excess: chi2 of the gap.
    """
    return by > ALL_RUNS * gain and gain >= CLOSES * excess


def fits_alike_in_one_run(*, by: float, fewer: bool) -> bool:
    """Whether an effect in one run alone is a rival of effects that act in all runs.

    Args:
      by: as `is_of_one_run` takes it. fewer: whether it has fewer numbers than these. With as many,
        it is often one of them that a single run shows.
    """
    return fewer and by > -TIE


def may_be_of_one_run(*, by: float, gain: float, excess: float) -> bool:
    """Whether an effect in one run alone stands in the place of effects that are no answer.

    Args:
      by, gain: as `is_of_one_run` takes them. excess: chi2 of the gap, or what other effects bring.
    """
    return by > 0.0 and gain >= CLOSES * excess


def believable(*, std: float, change: float, width: float) -> bool:
    """Whether a standard error tells more than bounds and typical sizes do.

    Args:
      change: a size worth finding. width: between the bounds.
    """
    return std < min(SIZES * change, width / math.sqrt(12.0))


def is_there(*, sigmas: float) -> bool:
    """Whether an effect is there that is shaped by numbers which are no size of it.

    Args:
      sigmas: by which its sizes are away from neutral.
    """
    return sigmas > SIGMAS


def needed(parameters: int) -> float:
    """Chi2 that this many further parameters, of one more effect, must bring."""
    return PENALTY * parameters + WORTH


def beyond_form(*, own: float, gain: float) -> bool:
    """Whether an effect brings more than what the forms of all effects leave.

    Args:
      own: chi2 that it brings beside the others. gain: that all bring together.
    """
    return own >= LEFT_BY_FORM * gain


def is_too_long(*, stepped: int, patience: float) -> bool:
    """Whether a search has simulated so much that no further effect is sought.

    Args:
      stepped: simulated steps. patience: times LONGEST.
    """
    return stepped > patience * LONGEST


def worth_adding(*, gained: float, parameters: int, held: float, gain: float) -> bool:
    """Whether a larger hypothesis brings enough, on its own evidence.

    Args:
      gain: chi2 that it brings in all.
      gained: chi2 that it brings more. parameters: that it has more.
      held: chi2 that it brings more on each run when it is fitted to the others.
    """
    enough = gained >= needed(parameters) and beyond_form(own=gained, gain=gain)
    return enough and held >= HELD


def may_be_worth_adding(*, promised: float, parameters: int, gain: float) -> bool:
    """Whether a larger hypothesis is fitted at all, by what linear algebra around a fit promises.

    Args:
      promised: chi2 that it brings more. parameters: that it has more. gain: that all bring.
    """
    return promised >= HOPELESS * max(needed(parameters), LEFT_BY_FORM * gain)


def worth_trying(*, score: float, best: float, gain: float, coarse: bool = False) -> bool:
    """Whether a hypothesis is fitted beside the best, which leaves a gap.

    Args:
      score, best: linear, of both. gain: chi2 of the best.
      coarse: whether the chair around which these were made is far from the data.
    """
    return best - score < max((COARSE if coarse else NEXT) * gain, RIVAL_CHI2)


def may_be_as_good(*, promised: float, behind: float, gain: float, brought: float) -> bool:
    """Whether an effect may be as good as the best though its fit, from one start, is not.

    Args:
      promised: chi2 by which linear algebra says that it is worse; gain: that it promises.
      behind: by which that promise is worse than the fit of the best. brought: that this fit
        brings; where it brings far more than all promises, these say nothing.
    """
    near = worth_trying(score=-promised, best=0.0, gain=gain)
    return near and not is_coarse(overstated=behind, gain=brought)


def ends_elsewhere(*, behind: float, promised: float, gain: float) -> bool:
    """Whether a fit is so much further behind another than linear algebra says, that it is stuck.

    Args:
      behind: chi2 by which it is worse. promised: by which linear algebra says that it is.
      gain: chi2 that the other brings; of so large a share linear algebra may be wrong.
    """
    return behind - promised > max(FAR_BEHIND * not_ruled_out(gain=gain), LINEAR * gain)


def starts_disagree(one: float, two: float) -> bool:
    """Whether two fits of one hypothesis, by their chi2, end at different places."""
    return abs(one - two) > WORTH


def surely_needed(*, sigmas: float, lost: float, parameters: int) -> bool:
    """Whether an effect need not be tried without: linear algebra already tells.

    Args:
      sigmas: of the effect. lost: chi2 that the others lose without it, by linear algebra.
    """
    return sigmas > SURE and lost > 3.0 * needed(parameters)


def can_be_dropped(*, lost: float, parameters: int) -> bool:
    """Whether the others lose too little chi2 without an effect of this many parameters."""
    return lost < needed(parameters)


def alike(score: float, best: float) -> bool:
    """Whether two hypotheses fit alike, by their scores (chi2 gained less penalties)."""
    return score > best - TIE


def fell_short(*, total: float, promised: float, gain: float) -> bool:
    """Whether a nonlinear fit misses so much of the linear promise that it starts again.

    What a small effect misses of its promise is not for its size: where it starts makes no odds.
    """
    return total >= short_of(promised=promised, gain=gain)


def short_of(*, promised: float, gain: float) -> float:
    """Chi2 from which a fit falls short of what linear algebra promises.

    No fit of a small effect does.
    """
    return promised + SHORT * gain if gain > WORTH / SHORT else math.inf


def worth_refitting(*, behind: float, gain: float, rival_gain: float) -> bool:
    """Whether a rival is near enough, by linear algebra, to be fitted.

    Args:
      behind: by how much its score is lower. gain, rival_gain: chi2 that chosen and rival bring.
    """
    if behind < max(RIVAL_CHI2, LINEAR * gain):
        return True
    near = behind < 3.0 * RIVAL_ERRORS * math.sqrt(max(gain - rival_gain, 0.0))
    return near and rival_gain > 0.8 * gain


def is_just_behind(*, gain: float, best: float) -> bool:
    """Whether an effect may be the best, though by linear algebra it brings a little less.

    Args:
      gain: chi2 that it promises. best: that the best brings.
    """
    return gain > (1.0 - LINEAR) * best


def is_coarse(*, overstated: float, gain: float) -> bool:
    """Whether linear algebra around the chair as given is too coarse to weigh what stands alike.

    Args:
      overstated: chi2 by which that chair is above its fit. gain: that the choice brings.
    """
    return overstated > OVERSTATED * gain


def may_be_alike(*, less: float, own: float) -> bool:
    """Whether the best replacement of an effect is fitted, though it is no rival by linear algebra.

    Args:
      less: chi2 that it brings less. own: that the effect brings beside the others.
    """
    return less < REPLACES * own


def is_stuck(*, total: float, promised: float) -> bool:
    """Whether a fit ended where its own linear step still promises what decides.

    Then the columns of what is only roughly known, which are made once, are too old.
    """
    return total - promised > RIVAL_CHI2


def has_settled(*, total: float, promised: float) -> bool:
    """Whether a fit is, but for a small share of what it leaves, where its own step leads."""
    return total - promised <= max(RIVAL_CHI2, SHORT * total)


def columns_hold(*, gain: float, missed: float) -> bool:
    """Whether columns that were made around a chair without effects are as good as new ones.

    Args:
      gain: chi2 that the effects bring. missed: chi2 that the fit's own linear step still promises.
    """
    return ROUNDING * gain < NOTHING and missed < NOTHING


def reaches(*, total: float, promised: float, gain: float) -> bool:
    """Whether a fit gets to what its own linear step promises, as near as a rival must come.

    Args:
      gain: chi2 that it brings.
    """
    return total - promised <= not_ruled_out(gain=gain)


def reach(*, best: float, gain: float) -> float:
    """Chi2 beyond which what a fit promises is too far behind to follow it or to start it again.

    Args:
      best: chi2 of the best fit. gain: that it brings.
    """
    return best + FAR_BEHIND * not_ruled_out(gain=gain)


def reach_of_whole(*, best: float, gain: float) -> float:
    """As `reach`, of an effect of a whole size: beside another it may be the best.

    Args:
      best: chi2 of the best fit. gain: that it brings.
    """
    return max(reach(best=best, gain=gain), best + LINEAR * gain)


def not_ruled_out(*, gain: float) -> float:
    """Chi2 by which a fit may be worse and yet as good as another that brings `gain`."""
    return max(RIVAL_CHI2, FORM * gain)


def counts(by: float, *, gain: float) -> float:
    """Chi2 by which one fit is better than another, as far as the form of effects lets it count.

    What would just not rule out a rival counts as RIVAL_CHI2, however much the effect brings.

    Args:
      gain: chi2 that the effect brings in whose place the other stands.
    """
    return by * RIVAL_CHI2 / not_ruled_out(gain=gain)


def stays_a_rival(
    *, behind: float, gain: float, errors: float, beyond_bound: bool, harm: float = 0.0
) -> bool:
    """Whether a fitted rival is not ruled out.

    Args:
      behind: chi2 with penalties by which it fits worse. gain: chi2 that the chosen brings.
      errors: `behind` in paired standard errors over windows; they speak for no rival that misses
        most of what the chosen brings. beyond_bound: it alone would have to be larger than it can
        be.
      harm: chi2 by which it fits runs worse than nothing does which the chosen fits. Something odd
        in a few windows makes a rival no better than nothing there, and none worse.
    """
    form = not_ruled_out(gain=gain)
    near = behind < form
    scattered = errors < RIVAL_ERRORS and behind < REPLACES * gain and harm < form
    return not beyond_bound and (near or scattered)


def to_rule_out(*, behind: float, gain: float) -> float:
    """Chi2 that a further run must bring against a rival, so that it stays none.

    Args:
      behind, gain: as `stays_a_rival` takes them.
    """
    return max(not_ruled_out(gain=gain) - behind, RIVAL_CHI2)


def paired_errors(behind: float, difference: Array) -> float:
    """By how many standard errors, over windows, a rival is worse: Vuong's corrected ratio.

    Vuong, "Likelihood ratio tests for model selection and non-nested hypotheses", 1989. Further
    numbers of a rival count against it; that it has fewer excuses nothing that it misses.

    Args:
      behind: chi2 with penalties by which it is. difference: of chi2, in each window, (windows,).
    """
    behind = max(behind, float(difference.sum()))
    if difference.size < 2:
        return behind
    spread = float(difference.std(ddof=1)) * math.sqrt(difference.size)
    return behind / max(spread, 1e-9)
