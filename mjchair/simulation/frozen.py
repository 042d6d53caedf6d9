"""Frozen records of arrays that compare, copy and pickle.

In: dataclasses with arrays and read-only mappings of arrays as fields. Out: `==`, `copy.deepcopy`
and `pickle` for them, which numpy arrays and mapping proxies do not have by themselves.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np


class FrozenRecord:
    """What a frozen dataclass of arrays inherits; declare it with ``eq=False``."""

    def __eq__(self, other: object) -> bool:
        """Whether all fields hold the same values; two missing samples (NaN) are equal."""
        if type(other) is not type(self):
            return NotImplemented
        return all(_same(getattr(self, n), getattr(other, n)) for n in self._names())

    __hash__ = None  # type: ignore[assignment]

    def __reduce__(self) -> tuple[Any, ...]:
        """The class and the field values from which pickle and copy make an equal object."""
        return _again, (type(self), {n: _plain(getattr(self, n)) for n in self._names()})

    def _names(self) -> list[str]:
        return [item.name for item in fields(self)]  # type: ignore[arg-type]


def _again(kind: type, values: dict[str, Any]) -> Any:
    return kind(**values)


def _plain(value: Any) -> Any:
    return dict(value) if isinstance(value, Mapping) else value


def _same(one: Any, two: Any) -> bool:
    if isinstance(one, Mapping) and isinstance(two, Mapping):
        return list(one) == list(two) and all(_same(one[name], two[name]) for name in one)
    if isinstance(one, np.ndarray) and isinstance(two, np.ndarray):
        return one.shape == two.shape and np.array_equal(one, two, equal_nan=True)
    return bool(one == two)
