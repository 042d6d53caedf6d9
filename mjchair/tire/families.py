"""The formula families that a tire may have, and the functions that choose by the block's number.

In: one record of each family, from mjchair.tire.formula. Out: `FAMILIES` by name, and
`choose_by_number`, which makes one compiled function of those of all families. A new family is its
file there and its record in `REGISTERED` here.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from numba.extending import register_jitable

from mjchair.tire.block import FAMILY
from mjchair.tire.formula import linear, mf61, pac89
from mjchair.tire.formula.family import Family

REGISTERED = (linear.LINEAR, linear.QUADRATIC, pac89.PAC89, mf61.MF52, mf61.MF61)  # by number

FAMILIES: dict[str, Family] = {family.name: family for family in REGISTERED}


def choose_by_number(functions: Sequence[Callable[..., Any]]) -> Callable[..., Any]:
    """One compiled function out of those of the families, which looks at the block's number.

    Args:
      functions: of the families in the order of their numbers, each with the block as its first
        argument. Neighbours may share one.
    """
    chosen = functions[0]
    for number, function in enumerate(functions):
        if function is not functions[max(number - 1, 0)]:
            chosen = _from(number, function, chosen)
    return chosen


def _from(number: int, function: Callable[..., Any], below: Callable[..., Any]) -> Any:
    """`function` for the families from this number on, `below` for the others."""

    @register_jitable
    def chosen(p, *rest):  # type: ignore[no-untyped-def]
        if p[FAMILY] >= number:
            return function(p, *rest)
        return below(p, *rest)

    return chosen
