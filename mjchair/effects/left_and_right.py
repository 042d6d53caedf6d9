"""Words for what two wheels do not have alike: which wheel has it, or how much each has.

In: the values of an effect with the parameters `left` and `right`, and their standard errors; what
only shapes the effect may stand beside them. Out: words.
"""

from __future__ import annotations

from collections.abc import Mapping

SIDES = ("left", "right")
DIFFERENCE = "left less right"  # beside the parameters' standard errors, that of their difference


def wheel_words(values: Mapping[str, float], wheel: str = "rear wheel") -> str:
    """The wheel whose value is not zero, or each of them.

    Args:
      wheel: which kind of it.
    """
    sides = list(_sized_sides(values))
    return f"the {sides[0]} {wheel} by itself" if len(sides) == 1 else f"each {wheel} by itself"


def size_words(
    values: Mapping[str, float], std: Mapping[str, float], per: float, shown: str
) -> str:
    """The sizes of those sides that have one; of two also the difference, which is known better.

    Args:
      per: units shown in one of the parameters'. shown: format of a size with its sign, and unit.
    """
    digits, _, unit = shown.partition(" ")

    def sized(name: str, value: float) -> str:
        error = f" ± {per * std[name]:.2g}" if std.get(name) else ""
        return f"{name} {per * value:{digits}}{error} {unit}".rstrip()

    said = [sized(side, value) for side, value in _sized_sides(values).items()]
    if len(said) > 1:
        said.append(sized(DIFFERENCE, values["left"] - values["right"]))
    return ", ".join(said)


def _sized_sides(values: Mapping[str, float]) -> dict[str, float]:
    """Side -> its value, of those that are not zero."""
    return {side: values[side] for side in SIDES if values.get(side)}
