"""Every rule of the verdict, as small functions of plain numbers.

In go the numbers of fits (chi2, standard errors, shares); out come decisions: whether a gap shows
and matters, what held-out trials say, what is shown, what the verdict is. Nothing is simulated or
fitted here, so a rule is tested on numbers. The rules of the search stand in
explain/search_rules.py; the thresholds of both were frozen on the development seeds of
benchmarks/blind (README there).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

# what a named effect must do
CLOSES = 0.8  # share of the excess that a named effect closes
PARTLY = 0.5  # share that an effect closes which is part of an answer, with a remainder
CARRIED = 0.5  # share of the excess on held-out trials that it closes there
BROUGHT = 0.2  # and that any answer closes there whose effects change more than the excess
BY_NOISE = 2.0  # standard deviations by which noise may hide that they bring it
AGAINST = 3.0  # standard deviations of noise below what is foretold, that speak against it
PROBABLE = 0.95  # probability of a named effect
FAR = 2.5  # standard deviations: what is only roughly known and was moved as far is measured
SHOWN = 0.1  # probability of what is shown as a rival whatever its chi2
LISTED = 0.02  # and of what is shown where more probable ones together have less than PROBABLE
LIKELY = 0.5  # probability of an answer to a residual that is no more than noise
HELD = 10.0  # chi2 that it must bring on runs that it was not fitted to
SIGMAS = 4.0  # standard errors of a parameter away from neutral
# what stands beside it
RIVAL_CHI2 = 10.0  # a rival this near, in chi2 with its penalty, is not ruled out
FORM = 0.02  # of the gain: the form of no effect is better known (assumption)
REPLACES = 0.5  # of what an effect brings: what misses more of it does not stand in its place
HARDER = 2.0  # times: what shakes one run so much harder than another may be no noise
# the gap
LEVEL = 0.01  # of the whole family of tests
LEAST = 5.0  # standard deviations below which a null made elsewhere shows gaps as well
CLEAR = 20.0  # standard deviations beyond which no null is asked for (assumption)
# of the gain of all: columns that are made anew, again and again around one fit, change its chi2 by
# as much (53 of 331 000 was seen), so a test that shows less shows nothing
ROUNDING = 2e-4
SMALL_GAP = 2.0  # rms of the residual over the noise up to which a gap may be none that matters
SHOWS = 2.0  # standard deviations of the whole residual: less is no more than noise
# chance of noise below which a gap shows (assumption; of 49 studies of benchmarks/blind that hide
# nothing, the least was 1e-7)
SURELY = 1e-10
CERTAIN = 10.0  # standard errors beyond which an effect is named whatever its size
MATERIAL = 0.12  # of the chair's own rolling resistance: a force that matters (assumption)
LONE = 3.0  # times what any run of the fit leaves: only a held-out run shows it (assumption)
# what happens once
CARRIES = 0.8  # share of the gain that an event must bring to stand beside an effect


class Verdict(StrEnum):
    """What a diagnosis says of a study."""

    NONE = "none"
    NAMED = "named"
    AMBIGUOUS = "ambiguous"
    UNKNOWN = "unknown"


@dataclass(frozen=True, kw_only=True)
class HeldOut:
    """Held-out trials: chi2 of the slow residual before and after, and its degrees of freedom.

    `changed`: chi2 by which the effects change what is foretold of them. `farther`: chi2 by which
    the corrected chair, with all that its fit moved, is farther from them than the chair as given.
    """

    before: float
    after: float
    dof: float
    changed: float
    farther: float = 0.0

    @property
    def gap(self) -> float:
        """Excess of chi2 before."""
        return self.before - self.dof

    @property
    def left(self) -> float:
        """Excess of chi2 after."""
        return self.after - self.dof

    @property
    def scatter(self) -> float:
        """Chi2 by which noise alone may be off."""
        return _scatter(self.dof)

    @property
    def noise(self) -> float:
        """Standard deviation of what the effects bring, by noise alone: it is in both chi2."""
        return 2.0 * math.sqrt(self.changed)

    @property
    def shown(self) -> bool:
        """Whether a gap shows, and the effects change it."""
        return min(self.gap, self.changed) > self.scatter


@dataclass(frozen=True, kw_only=True)
class Standing:
    """The numbers that the verdict on a choice of effects follows from.

    Attributes:
      closure: share of the excess that the effects close. gap_left: whether the gap test still
        fails. gain_by_run, gain_by_manoeuvre: chi2 that they bring on each run, or manoeuvre, when
        they are fitted to the others.
      sigmas: of every effect, how far it is from neutral in standard errors.
      at_bound: whether a size ended on a bound, and is not one than which far larger ones fit as
        well.
      probability: of the effects, against rivals and all else. rivals: whether something could
        stand in the place of one of them.
      once: whether something that happened once fits as well.
      runs: that were fitted to.
      held_out: the trials that no fit saw; None where there are none.
      walls: how many numbers that are only roughly known stand on their walls with the effects in,
        as `may_be_all` says: they are where what is missing pushed them.
      uneven: whether an effect is not of one size in all runs.
      one_run: whether another, in one run alone, explains more. one_alike: or about as much.
      unfinished: whether the search ended before all further effects were tried.
    """

    closure: float
    gap_left: bool
    gain_by_run: float
    gain_by_manoeuvre: float
    sigmas: tuple[float, ...]
    at_bound: bool
    probability: float = 1.0
    rivals: bool = False
    once: bool = False
    runs: int = 2
    held_out: HeldOut | None = None
    walls: int = 0
    uneven: bool = False
    one_run: bool = False
    one_alike: bool = False
    unfinished: bool = False


def gap_exists(p: float, sigmas: float, gain: float = 0.0) -> bool:
    """Whether there is a gap worth a name.

    Args:
      p: of the family of all tests. sigmas: of the largest test. gain: chi2 that the effects bring
        which are in already.
    """
    return p < LEVEL and sigmas > max(LEAST, math.sqrt(ROUNDING * max(gain, 0.0)))


def surely(p: float) -> bool:
    """Whether a gap of this chance by noise shows, whatever else is said of it."""
    return p < SURELY


def may_be_of_the_null(sigmas: float) -> bool:
    """Whether a gap may be what a chair that lacks nothing shows, computed otherwise.

    Args:
      sigmas: of the largest test.
    """
    return sigmas < CLEAR


def verdict(gap: bool, choice: Standing | None) -> Verdict:
    """The verdict of a study.

    Args:
      gap: whether there is one. choice: the effects that explain it best; None: none brings a gain.
    """
    if not gap:
        return Verdict.NONE
    if choice is None or not explains(choice):
        return Verdict.UNKNOWN
    # of 87 choices stated at 95 % beside a rival that was not ruled out, 80 were right
    # beside a number that is pushed to its wall, what pushes it may be all that is missing
    beside = choice.rivals or choice.once or choice.one_alike
    alone = not beside and choice.probability >= PROBABLE and not choice.walls
    # in a single run nothing tells an effect from what is left beside it; what was not tried may
    # stand beside an effect, or two in its place
    whole = not choice.gap_left or (choice.runs > 1 and not choice.unfinished)
    held = choice.held_out
    carried = held is None or not (_speaks_against(held) or _may_stand_in(choice, held))
    named = sure(choice) and alone and whole and carried and choice.closure >= CLOSES
    return Verdict.NAMED if named else Verdict.AMBIGUOUS


def explains(choice: Standing) -> bool:
    """Whether the effects are an answer, alone or beside their rivals, with a remainder or not.

    A size on the bound of what is believed of it is none: a chair that somebody pushed came as one
    that rolls down a slope with a rolling resistance of -0.01.
    """
    if choice.closure < PARTLY or choice.one_run or choice.at_bound:
        return False
    if choice.held_out is None:
        return choice.gain_by_run >= HELD
    foretold = choice.gain_by_run >= HELD or shows_again(choice.held_out)
    return foretold and not opens_a_gap(choice.held_out)


def _speaks_against(held: HeldOut) -> bool:
    """Whether held-out trials speak against the effects, or against the chair that has them.

    Effects that carry over may stand in a chair that does not, as its fit moved what is roughly
    known to explain what is missing besides: tires with a quarter of their friction left 9.7 times
    the noise where the chair without them had left 7.3, and a longer trail was missing.
    """
    return held.farther > held.scatter or not carries_over(held)


def _may_stand_in(choice: Standing, held: HeldOut) -> bool:
    """Whether one of several effects may stand in for what they leave in held-out trials.

    One effect that leaves something is there, with a remainder. Beside a shimmy, a rider who moves
    fitted what a motor's back EMF did, and 1.9 times the noise was left in the trial held out; the
    pairs that were named rightly leave 0.8 to 1.0 times.
    """
    return len(choice.sigmas) > 1 and foretells_wrongly(held.after, held.dof)


def carries_over(held: HeldOut) -> bool:
    """Whether the held-out trials, which no fit has seen, do not speak against the effects.

    Right effects bring there all that they change, give or take the noise. CARRIED of it is enough,
    or of the gap where they change more than there is, since forms and sizes are a little off; less
    speaks against them where noise does not explain it. Effects that change no more than noise
    does, as a gyroscope's gain where nothing turns, have no part in a gap of another cause; they
    must open none.
    """
    if held.changed <= held.scatter:
        return not opens_a_gap(held)
    enough = CARRIED * min(held.gap, held.changed)
    return held.before - held.after >= min(enough, held.changed - AGAINST * held.noise)


def opens_a_gap(held: HeldOut) -> bool:
    """Whether the effects are no better than nothing on held-out trials.

    Where a gap shows that they change, they must bring something, and BROUGHT of it where they
    change more than there is, but for what noise may take from them; where none does, none may
    open beyond the scatter of noise. What brings less than `carries_over` asks is an answer beside
    which more is missing.
    """
    if not held.shown:
        return held.left >= held.gap + held.scatter
    least = held.gap * (1.0 - BROUGHT if held.changed >= held.gap else 1.0)
    return held.left >= max(least + BY_NOISE * held.noise, held.scatter)


def shows_again(held: HeldOut) -> bool:
    """Whether held-out trials, which no fit has seen, show what the effects explain."""
    return held.shown and carries_over(held)


def foretells_wrongly(chi2: float, dof: float) -> bool:
    """Whether a chair is far off on held-out trials, where its fit may not be."""
    return chi2 - dof > 2.0 * _scatter(dof)


def _scatter(dof: float) -> float:
    """Chi2 by which noise alone may be off."""
    return 3.0 * math.sqrt(2.0 * dof)


def sure(choice: Standing) -> bool:
    """Whether every effect is clearly there, and shows in more than one manoeuvre."""
    clear = all(s > SIGMAS for s in choice.sigmas)
    return clear and choice.gain_by_manoeuvre > 0.0


def closure(
    *, gained: float, left: float, excess: float, excess_std: float, excess_after: float,
    excess_after_std: float,
) -> float:  # fmt: skip
    """Share of the excess that a fit closes, 0 to 1.

    The excess is the slow part of the residual above what noise gives, where that is known well
    enough; a small gap is below its scatter, and then what the fit gains is held against the most
    that any further test shows.

    Args:
      gained: chi2 that the fit brings. left: chi2 above expectation of the largest test after it.
      excess, excess_after: before and after, with their standard deviations.
    """
    share = gained / max(gained + max(left, 0.0), 1e-9)
    if excess > 6.0 * excess_std:
        share = min(share, 1.0 - max(excess_after - excess_after_std, 0.0) / excess)
    return float(np.clip(share, 0.0, 1.0))


def says_one_run(said: Verdict, *, alike: bool) -> bool:
    """Whether a verdict says what acts in one run alone: in the place of an answer, or beside it.

    Args:
      alike: whether it is a rival of the answer.
    """
    return said == Verdict.UNKNOWN or (said == Verdict.AMBIGUOUS and alike)


def more_missing(choice: Standing) -> bool:
    """Whether an answer leaves something that is no noise."""
    held = choice.held_out
    wrong = held is not None and (foretells_wrongly(held.after, held.dof) or _speaks_against(held))
    return choice.gap_left or choice.closure < CLOSES or choice.walls > 0 or choice.uneven or wrong


def believed(probability: float, choice: Standing | None) -> float:
    """Probability of an answer; 0 where trials that it was not fitted to speak against it.

    A delay and a cornering stiffness, 55 % likely by the trials of the fit, were no more than
    single tests that stood out: 0.94 times the noise was left without them in the trial held out,
    and 1.11 times with them; in another study one trial of the fit foretold the other 67 of chi2
    worse.

    Args:
      choice: the answer; None: there is none.
    """
    if choice is None or choice.gain_by_run <= -HELD:
        return 0.0
    held = choice.held_out
    return 0.0 if held is not None and not carries_over(held) else probability


def is_likely(probability: float) -> bool:
    """Whether effects are rather there than not, also where they are no answer."""
    return probability >= LIKELY


def matters(
    *, force: float, limit: float, gap: float, excess: float, p: float, told: bool, said: Verdict,
    sigmas: float, probability: float, nothing: bool = False, freed: bool = False,
) -> bool:  # fmt: skip
    """Whether a gap is one that matters.

    Args:
      force: the largest missing force, N. limit: below which none matters, N.
      gap: rms of the residual over the noise, on held-out trials as far as the others tell what is
        only roughly known. excess: of the whole slow residual above what noise gives, in its
        standard deviations; what makes none and is explained by nothing, or by what is rather not
        there, does not matter, however large the force of a test that stands out.
      p: of the gap, by chance, or of what surely acts in one run alone; one of SURELY shows,
        whatever the whole residual does.
      told: whether the person who asks gave the limit.
      probability: that an effect of the answer is there, or of what is rather there but explains
        too little to be one.
      nothing: whether that nothing is missing is more probable than any one explanation; then the
        whole residual must show as clearly as a gap does.
      freed: whether numbers that are only roughly known stand on their walls without the answer,
        and none does with it: then they hide the gap, and the answer is what pushed them there.
      sigmas: of the least certain effect. Without a limit that was told, what is CERTAIN
        matters whatever its size, and a gap of twice the noise is one though no force goes with it.
    """
    answered = is_likely(probability) or (said != Verdict.UNKNOWN and freed)
    shows = LEAST if nothing else SHOWS
    unclear = excess < shows and gap < SMALL_GAP and not surely(p)
    if not answered and not told and unclear:
        return False
    if force >= limit or said == Verdict.NONE:
        return True
    certain = said in (Verdict.NAMED, Verdict.AMBIGUOUS) and sigmas > CERTAIN
    return not told and (gap >= SMALL_GAP or certain)


def happened_once(
    *, event: float, gain: float, held: HeldOut | None = None, foretold: float = 0.0
) -> bool:
    """Whether an event in time carries about what the effects do.

    Args:
      event: chi2 that forces bring which act for a moment in one run. gain: that the effects bring.
      held: held-out trials; an event is over in these.
      foretold: chi2 that the effects bring on the run of the event, fitted to all others. No other
        run foretells an event.
    """
    again = held is not None and shows_again(held)
    return event > CARRIES * gain and not again and foretold < REPLACES * event


def is_clearly_once(*, event: float, gain: float, excess: float) -> bool:
    """Whether an event in time explains a gap, and stands beside the best single effect.

    Then no second effect beside that one would be named.

    Args:
      event: chi2 that forces bring which act for a moment in one run. gain: that the effect brings.
      excess: chi2 of the gap.
    """
    return event >= CLOSES * excess and happened_once(event=event, gain=gain)


def beside_event(*, linear: float, fitted: float) -> float:
    """Chi2 that effects bring, as it is held against what an event does.

    Linear algebra tells what an event brings, and so it does for effects: a patch that is fitted
    finds its place, and an event its second only. Where it sees less than half of what the effects
    bring, as of casters that turn over, their fit tells.

    Args:
      linear, fitted: chi2 that they bring by linear algebra, and by their fit.
    """
    return linear if linear > REPLACES * fitted else fitted


def shows_alone(*, held: float, others: float) -> bool:
    """Whether a held-out run shows what no run of the fit does.

    Args:
      held: rms over the noise that it leaves. others: the most that a run of the fit leaves.
    """
    return held > LONE * max(others, 1.0)


def may_be_all(*, cost: float, gain: float) -> bool:
    """Whether what pushes a roughly known number to its wall may be all that is missing.

    Tires that slid brought 1 215 889, and left a stiffness of the rear tires on its wall, which
    brought 1221: as much as the form of an effect leaves.

    Args:
      cost: chi2 that is lost where the number stands where the study has it. gain: that an effect
        brings which was found.
    """
    return cost > FORM * gain


def shakes_far_harder(one: float, other: float) -> bool:
    """Whether what shakes the chair pushes it far harder in one run than in another of its kind.

    The level of a run of 6 s is known to a quarter, and drawn to that of the others; a brake of
    4 N that rubs for 2 s in one coast of two makes 3.0 N there and 1.3 N in the other.

    Args:
      one, other: N.
    """
    return one > HARDER * other


def is_far(by: float) -> bool:
    """Whether what is only roughly known was moved far, by this many standard deviations.

    Of ten numbers that are as the study says, one is moved as far in one study of eight.
    """
    return abs(by) >= FAR


def is_shown(probability: float, before: float = 1.0) -> bool:
    """Whether a hypothesis is probable enough to be shown as a rival, whatever its chi2.

    What is shown has a probability of PROBABLE together, as far as that takes no tiny ones.

    Args:
      before: probability of all that are more probable.
    """
    return probability >= SHOWN or (probability >= LISTED and before < PROBABLE)


def to_show_again(*, event: float, gain: float) -> float:
    """Chi2 that a further run must bring, so that no event in time carries about as much.

    Args:
      event, gain: as `happened_once` takes them.
    """
    return max(event / CARRIES - gain, RIVAL_CHI2)
