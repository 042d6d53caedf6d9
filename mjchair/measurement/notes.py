"""Lines on what was found out: which of them a person must see, and the same line only once.

In: lines such as "push1_left.csv: left wheel". Out: the lines, those that differ in nothing but
their names and numbers put together.
"""

from __future__ import annotations

import re
from collections.abc import Iterable

NUMBER = re.compile(r"(?<![\w.])[+-]?\d+(?:\.\d+)?(?![\w]|\.\d)")


class Detail(str):
    """A line that is as expected: it belongs into a log, not on a terminal."""

    __slots__ = ()


def about(name: str, line: str) -> str:
    """The line with the name that it is about; a detail stays one."""
    return type(line)(f"{name}: {line}")


def once(lines: Iterable[str]) -> list[str]:
    """Lines that say the same of several names as one; numbers that differ as a range."""
    groups: dict[str, list[tuple[str, str]]] = {}
    for line in dict.fromkeys(lines):
        name, colon, text = line.partition(": ")
        if not colon or " " in name:
            name, text = "", str(line)
        groups.setdefault(NUMBER.sub("#", text), []).append((name, text))
    out = []
    for same in groups.values():
        if not same[0][0]:
            out += [text for _, text in same]
            continue
        names = ", ".join(dict.fromkeys(name for name, _ in same))
        out.append(f"{names}: {_merged([text for _, text in same])}")
    return out


def _merged(texts: list[str]) -> str:
    """One text for several that differ in their numbers."""
    columns = list(zip(*(NUMBER.findall(text) for text in texts), strict=True))
    numbers = iter(
        column[0]
        if len(set(column)) == 1
        else f"{min(column, key=float)} to {max(column, key=float)}"
        for column in columns
    )
    return NUMBER.sub(lambda _: next(numbers), texts[0])
