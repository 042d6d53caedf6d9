"""Errors and notes to the user: one base class each, and the nearest name to a wrong one.

In: a wrong name and the known ones. Out: the words that name the nearest.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterable
from difflib import SequenceMatcher

ALIKE = 0.6  # of SequenceMatcher's ratio, from which a name may have been meant
MOST, LISTED = 40, 12  # names that are listed whole; of more, so many
# words that people use for what has another name here; "" is none: a wheel's torque is its name
OTHER_WORDS = {
    "velocity": "speed",
    "omega": "speed",
    "torque": "",
    "moment": "",
    "position": "angle",
    "acceleration": "accelerometer",
    "gyroscope": "gyro",
    "rider": "occupant",
    "user": "occupant",
    "person": "occupant",
    "weight": "mass",
}


class MjchairNote(UserWarning):
    """Something that a user should know and that stops nothing."""


def note(message: str) -> None:
    """Tell the user something; the command line prints it as one line on standard error."""
    warnings.warn(message, MjchairNote, stacklevel=3)


class MjchairError(ValueError):
    """Bad input. The message is one line: the value, the rule, the nearest alternative."""


def closest(name: str, known: Iterable[str]) -> str | None:
    """The one of the `known` names that was probably meant; None where none is near.

    Two names are near when they are alike as a whole, and also behind the words that both begin
    with: `left_wheel_torque` is not near `left_wheel_tire.Mz`.
    """
    names = sorted(known)
    words, meant = _words(name), [name]
    for number, word in enumerate(words):
        if word in OTHER_WORDS:
            said = [*words[:number], *filter(None, [OTHER_WORDS[word]]), *words[number + 1 :]]
            for candidate in names:
                if _words(candidate) == said:
                    return candidate
            if OTHER_WORDS[word]:
                words = said
                meant.append("_".join(said))
    best = max(((_likeness(m, n), n) for m in meant for n in names), default=(0.0, ""))
    return best[1] if best[0] >= ALIKE else None


def _words(name: str) -> list[str]:
    return [word for word in re.split(r"[_.\s]+", name) if word]


def _likeness(one: str, two: str) -> float:
    """How alike two names are, 0 to 1."""
    whole = SequenceMatcher(None, one, two).ratio()
    a, b = _words(one), _words(two)
    while a and b and a[0] == b[0]:
        a, b = a[1:], b[1:]
    if not b:  # more words than the candidate has: something else of the same thing
        return 0.0
    if not a or [len(word) for word in (*a, *b)] == [1, 1]:  # another part of one vector
        return whole
    return min(whole, SequenceMatcher(None, "_".join(a), "_".join(b)).ratio())


def nearest(name: str, known: Iterable[str]) -> str:
    """The end of an error line about an unknown `name`: the nearest of the `known` names.

    Args:
      name: what was given.
      known: the names that would have been right.

    Returns:
      ``"; did you mean 'x'? (known: x, y)"``, without the question where nothing is near. Of more
      than MOST names those that are most alike are listed.
    """
    names = sorted(known)
    close = closest(name, names)
    listing = f"known: {', '.join(names)}" if names else "none are known"
    if len(names) > MOST:
        alike = sorted(names, key=lambda n: -SequenceMatcher(None, name, n).ratio())[:LISTED]
        listing = f"known: {', '.join(alike)} and {len(names) - LISTED} more"
    return f"; did you mean {close!r}? ({listing})" if close else f"; {listing}"
