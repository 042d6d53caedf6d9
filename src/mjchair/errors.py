"""Errors: one base class, and the nearest name to a wrong one."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class MjchairError(ValueError):
    """Bad input. The message is one line: the value, the rule, the nearest alternative."""


def nearest(name: str, known: Iterable[str]) -> str:
    """The end of an error line about an unknown `name`: the nearest of the `known` names.

    Args:
      name: what was given.
      known: the names that would have been right.

    Returns:
      ``"; did you mean 'x'? (known: x, y)"``, without the question where nothing is near.
    """
    names = sorted(known)
    close = difflib.get_close_matches(name, names, n=1)
    listing = f"known: {', '.join(names)}" if names else "none are known"
    return f"; did you mean {close[0]!r}? ({listing})" if close else f"; {listing}"
