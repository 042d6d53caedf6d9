"""Where the shipped measurements are.

In: nothing. Out: paths of the recordings and of the licence beside them.
"""

from __future__ import annotations

from pathlib import Path

_PACKAGE = Path(__file__).parents[1]


def folder() -> Path:
    """The folder `data`: inside the installed package, or beside the sources of a checkout."""
    installed = _PACKAGE / "data"
    return installed if installed.is_dir() else _PACKAGE.parent / "data"


def propulsion() -> Path:
    """The SmartWheel excerpt with pushes."""
    return folder() / "smartwheel" / "propulsion.csv"


def baseline() -> Path:
    """The SmartWheel excerpt with no hand on the rim."""
    return folder() / "smartwheel" / "baseline.csv"
