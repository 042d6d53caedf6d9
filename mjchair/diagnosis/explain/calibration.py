"""What evidence is worth: from a computed logarithm to one that keeps its word.

In: the logarithm of a hypothesis' prior times evidence. Out: the same, tempered. The forms of the
library's effects are never quite those of a real chair, so that a difference of evidence is less
certain than it computes.
"""

from __future__ import annotations

TEMPER = 2.0  # by how much a computed difference is too sure


def worth(logarithm: float) -> float:
    """The tempered logarithm."""
    return logarithm / TEMPER
