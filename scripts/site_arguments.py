"""One argument a line in the docstrings of the reference pages.

In: docstrings that name several arguments or attributes on a line ("title: of the page. label: of
the run."). Out: the same with a line for each, so that the tables of the site list all of them.
mkdocstrings loads the extension (mkdocs.yml).
"""

from __future__ import annotations

import re
from collections.abc import Collection
from typing import Any

import griffe

SECTIONS = ("Args:", "Attributes:")


class OneALine(griffe.Extension):
    """Splits the lines."""

    def on_package(self, *, pkg: griffe.Module, **_: Any) -> None:
        """Go through the functions and classes of a package that has been read."""
        self._through(pkg)

    def _through(self, parent: griffe.Module | griffe.Class) -> None:
        for member in list(parent.members.values()):
            if member.is_alias:
                continue
            if member.docstring and isinstance(member, griffe.Function | griffe.Class):
                member.docstring.value = split(member.docstring.value, _names(member))
            if isinstance(member, griffe.Module | griffe.Class):
                self._through(member)


def _names(member: griffe.Function | griffe.Class) -> set[str]:
    """Of arguments, and of a class's attributes."""
    names = {parameter.name for parameter in member.parameters}
    return names | set(member.attributes) if isinstance(member, griffe.Class) else names


def split(text: str, names: Collection[str]) -> str:
    """A docstring with one of these names a line in its sections of arguments and attributes."""
    begin = re.compile(rf"(?<=[.;]) ((?:{'|'.join(map(re.escape, names))}): )") if names else None
    lines: list[str] = []
    inside = False
    for line in text.splitlines():
        if not line.startswith(" "):
            inside = line in SECTIONS or (inside and not line)
        lines.append(begin.sub(r"\n  \1", line) if begin and inside else line)
    return "\n".join(lines)
