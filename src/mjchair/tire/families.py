"""What each formula family's coefficients are called, and how they lie in a block."""

from __future__ import annotations

from collections.abc import Mapping

from mjchair.tire.formula.mf_fold import fold
from mjchair.tire.formula.mf_names import NAMES_52, NAMES_61

COEFFICIENTS: dict[str, tuple[str, ...]] = {
    "linear": ("cornering_stiffness", "unused", "friction"),
    "quadratic": ("a", "b", "friction"),
    "pac89": (
        "load_unit",
        "has_b",
        "has_c",
        *(f"a{i}" for i in range(14)),
        *(f"b{i}" for i in range(11)),
        *(f"c{i}" for i in range(18)),
    ),
    "mf52": NAMES_52,
    "mf61": NAMES_61,
}


def packed(family: str, coefficients: Mapping[str, float], radius: float) -> list[float]:
    """The numbers that follow the header of a block.

    Args:
      family: a key of COEFFICIENTS. coefficients: by name. radius: of the tire, m.
    """
    if family in ("mf52", "mf61"):
        return fold(coefficients, radius, old=family == "mf52")
    return [coefficients.get(name, 0.0) for name in COEFFICIENTS[family]]
