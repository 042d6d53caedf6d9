"""Identifiers of the columns of a linear system.

In: nothing. Out: types that name a column of the linear system.

A column is the derivative of every prediction by one thing: something only roughly known, a
parameter of an effect that is in the chair, or (mjchair.diagnosis.explain) an effect or a
force to be tested.
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
class Otherwise(ColumnId):
    """What the same chair shows otherwise that is computed in another way, by a number."""

    member: int


@dataclass(frozen=True)
class ParameterId(ColumnId):
    """A parameter of an effect that is in the chair."""

    effect: str
    parameter: str

    def __str__(self) -> str:
        """As a person reads it."""
        return f"{self.effect}.{self.parameter}"
