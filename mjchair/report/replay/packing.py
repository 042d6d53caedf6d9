"""Numbers as text in a page: arrays, compressed, in base64, with a table of where each begins.

In: arrays by name. Out: the table, for JSON, and the text. The bytes of an array are sorted: first
the first byte of every number, then the second, and so on, column after column; numbers that
follow one another differ in their last bytes only, and so compress well. Level 9 of zlib.
"""

from __future__ import annotations

import base64
import zlib
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

KINDS = ("float32", "uint32", "uint16", "int16", "int8")


def pack(arrays: Mapping[str, NDArray[Any]]) -> tuple[list[dict[str, Any]], str]:
    """The table and the text.

    Args:
      arrays: one- or two-dimensional, of KINDS.
    """
    table, parts = [], []
    for name, array in arrays.items():
        kind = array.dtype.name
        assert kind in KINDS, f"{name} is {kind}"
        table.append({"name": name, "kind": kind, "shape": list(array.shape)})
        columns = np.ascontiguousarray(array.T).astype(array.dtype.newbyteorder("<"))
        bytes_of = columns.ravel().view(np.uint8).reshape(-1, array.dtype.itemsize)
        parts.append(np.ascontiguousarray(bytes_of.T).tobytes())
    return table, packed(b"".join(parts))


def packed(content: bytes) -> str:
    """Bytes, compressed, as base64."""
    return base64.b64encode(zlib.compress(content, 9)).decode()
