"""Identifiers of the columns of a linear system, in place of names that have to be taken apart.

A column is how every prediction answers to one thing: something only roughly known, a parameter of
an effect that is in, or (in the room `explain`) an effect or a force that might be there.
"""

from __future__ import annotations

from dataclasses import dataclass


class ColumnId:
    """What a column answers to; equal ones are the same column."""


@dataclass(frozen=True)
class RoughlyKnown(ColumnId):
    """Something only roughly known, by its name in study.toml, or a numerical difference."""

    name: str


@dataclass(frozen=True)
class ParameterId(ColumnId):
    """A parameter of an effect that is in the chair."""

    effect: str
    parameter: str

    def __str__(self) -> str:
        """As a person reads it."""
        return f"{self.effect}.{self.parameter}"
