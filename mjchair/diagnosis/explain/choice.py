"""The choice of effects that explains a study best: its fit, its rivals, and what it closes.

In: the fits of effects on all windows. Out: `Choice`, and how much of the gap it closes.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from mjchair.diagnosis import rules
from mjchair.diagnosis.explain import search_rules
from mjchair.diagnosis.explain.column_ids import EffectGroup, ForceGroup
from mjchair.diagnosis.explain.gap import Gap
from mjchair.diagnosis.explain.hypotheses import Hypothesis
from mjchair.diagnosis.explain.screening import Base, gain
from mjchair.diagnosis.fit import bounded
from mjchair.diagnosis.fit.nonlinear import Fitted, open_upwards

FURTHER = 3.5  # sigmas of a test whose statistic may count as left


@dataclass(frozen=True)
class Tried:
    """A hypothesis and its fit."""

    hypothesis: Hypothesis
    fitted: Fitted

    @property
    def price(self) -> float:
        """Chi2 with the penalty of the parameters, less for effects that are common.

        And with what it costs that windows must begin so: a long relaxation that makes two casters
        shimmy as in a mirror brakes as much as the data ask for, and no turn shows it.
        """
        return self.fitted.total + self.fitted.confined + self.hypothesis.penalty


@dataclass(kw_only=True)
class Choice:
    """What was chosen.

    Attributes:
      hypothesis: effects. fitted: their fit, everything made anew around it.
      after: the gap that they leave.
      rivals: for every effect, what could stand in its place, best first.
      others: what could stand in the place of several, or be several in the place of some.
      own_gains: of every effect, the chi2 that it brings beside the others.
      tried: every fit that was made.
      dropped: a line for each hypothesis that this chair cannot have.
      unfinished: whether effects are left that were not tried: the search had become too long.
    """

    hypothesis: Hypothesis
    fitted: Fitted
    after: Gap
    rivals: list[list[Tried]]
    own_gains: list[float]
    others: list[Tried] = field(default_factory=list)
    tried: list[Tried] = field(default_factory=list)
    dropped: list[str] = field(default_factory=list)
    unfinished: bool = False

    @property
    def own(self) -> Tried:
        """The hypothesis with its fit."""
        return Tried(self.hypothesis, self.fitted)

    @property
    def brought(self) -> dict[str, float]:
        """Key of every effect -> the chi2 that it brings beside the others."""
        keys = (s.effect.key for s in self.hypothesis.starts)
        return dict(zip(keys, self.own_gains, strict=True))

    def brought_beyond(self, other: Hypothesis) -> float:
        """Chi2 that the effects bring which another hypothesis does without."""
        return sum(gain for key, gain in self.brought.items() if key not in other.keys)

    def is_pushed(self, rival: Tried) -> bool:
        """Whether a rival pushes a number to its wall that the choice does not; see `is_pushed`."""
        return is_pushed(rival, self.own, self.brought_beyond(rival.hypothesis))


def is_there(fitted: Fitted) -> bool:
    """Whether effects are there by their own sizes, and not by numbers that only shape them.

    A wind has a drag area, so one that ends nearly still stands for the drag of the air. Of a size
    that is open upwards no standard error tells.
    """
    shaped = [t for t in fitted.variant.terms if any(not p.sized for _, p in t.parameters)]
    return all(
        search_rules.is_there(sigmas=fitted.sigmas[t.effect.key])
        or t.effect.key in open_upwards(fitted)
        for t in shaped
    )


def is_pushed(rival: Tried, chosen: Tried, brought: float) -> bool:
    """Whether a rival fits worse, with a number on its wall that the chosen effects leave off it.

    What is only roughly known stands there where something else is missing: a turning scrub with
    the centre of mass at its wall stood beside a centre of mass aside, and so did nothing at all.

    Args:
      brought: chi2, by the effect in whose place the rival would stand.
    """
    theirs, ours = (set(bounded.at_walls(t.fitted.variant.offsets)) for t in (rival, chosen))
    behind = rival.price - chosen.price
    return bool(theirs - ours) and behind >= search_rules.not_ruled_out(gain=brought)


def closure(gap: Gap, base: Base, fitted: Fitted, after: Gap) -> float:
    """Share of the excess that a fit closes, 0 to 1; see `rules.closure`."""
    further = [
        t.statistic - t.dof
        for t in after.tests
        if isinstance(t.subject, EffectGroup | ForceGroup) and t.sigmas > FURTHER
    ]
    return rules.closure(
        gained=gain(base, fitted),
        left=max(further, default=0.0),
        excess=gap.excess,
        excess_std=gap.excess_std,
        excess_after=after.excess,
        excess_after_std=after.excess_std,
    )
