"""Words for a size with two components: how large, and which way.

In: the values of an effect with the parameters `x` and `y`, and their standard errors. Out: words.
Along the world's axes x is heading 0 and y is heading 90 degrees; along the chair's, ahead and to
its left.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from mjchair.units import with_error

Remark = Callable[[Mapping[str, float], Mapping[str, float]], str]
WORLD = {
    "x": ("towards heading 0", "towards heading 180 deg"),
    "y": ("towards heading 90 deg", "towards heading 270 deg"),
}
CHAIR = {"x": ("ahead", "behind"), "y": ("to the left", "to the right")}


def remark(ways: Mapping[str, tuple[str, str]], unit: str, per: float, begin: str = "") -> Remark:
    """A function of values and standard errors, as `Effect.remark` is.

    Args:
      ways: of each component, the words for a value above zero, and for one below.
      unit: that is shown. per: how many of it are in one of the parameter's.
      begin: what the sentence begins with.
    """

    def words(values: Mapping[str, float], std: Mapping[str, float]) -> str:
        said = [
            f"{with_error(per * abs(values[name]), per * std.get(name, 0.0) or None)} {unit} "
            f"{way[values[name] < 0.0]}"
            for name, way in ways.items()
            if values[name]
        ]
        return " ".join(part for part in (begin, " and ".join(said)) if part)

    return words
