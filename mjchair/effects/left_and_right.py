"""Words for what the rear wheels do not have alike: which wheel has it, or how much each has.

In: the values of an effect with the parameters `left` and `right`, and their standard errors. Out:
words.
"""

from __future__ import annotations

from collections.abc import Mapping

SIDES = ("left", "right")
DIFFERENCE = "left less right"  # beside the parameters' standard errors, that of their difference


def wheel_words(values: Mapping[str, float]) -> str:
    """The rear wheel whose value is not zero, or each of them."""
    sides = [side for side, value in values.items() if value]
    wheel = f"the {sides[0]} rear wheel" if len(sides) == 1 else "each rear wheel"
    return f"{wheel} by itself"


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

    said = [sized(side, value) for side, value in values.items() if value]
    if len(said) > 1:
        said.append(sized(DIFFERENCE, values["left"] - values["right"]))
    return ", ".join(said)
