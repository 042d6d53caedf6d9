"""Words for a drag on the rear wheels that is not alike on both: which wheel it acts on.

In: the values of an effect with the parameters `left` and `right`. Out: the wheel, in words.
"""

from __future__ import annotations

from collections.abc import Mapping


def wheel_words(values: Mapping[str, float]) -> str:
    """The rear wheel whose value is not zero, or each of them."""
    sides = [side for side, value in values.items() if value]
    wheel = f"the {sides[0]} rear wheel" if len(sides) == 1 else "each rear wheel"
    return f"{wheel} by itself"
