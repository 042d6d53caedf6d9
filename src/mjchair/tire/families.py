"""What each formula family's coefficients are called, in the order in which they lie in a block."""

from __future__ import annotations

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
}
