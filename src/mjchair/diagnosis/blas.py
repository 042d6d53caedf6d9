"""One thread for linear algebra: its threads cost more than they bring on matrices this small."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy
import scipy

PREFIXES = ("scipy_openblas", "openblas")


def _controls() -> list[tuple[Any, Any]]:
    """Getter and setter of the number of threads of every OpenBLAS that is loaded."""
    found = []
    for package in (numpy, scipy):
        folder = Path(str(package.__file__)).parent
        for path in (folder.parent / f"{package.__name__}.libs").glob("*openblas*"):
            library = ctypes.CDLL(str(path))
            for prefix in PREFIXES:
                for suffix in ("64_", ""):  # the ones that end in "_" alone are Fortran's
                    get = getattr(library, f"{prefix}_get_num_threads{suffix}", None)
                    put = getattr(library, f"{prefix}_set_num_threads{suffix}", None)
                    if get is not None and put is not None:
                        found.append((get, put))
    return found


@contextmanager
def one_thread() -> Iterator[None]:
    """OpenBLAS with one thread inside the block; nothing happens with another library."""
    controls = _controls()
    before = [get() for get, _ in controls]
    for _, put in controls:
        put(1)
    try:
        yield
    finally:
        for (_, put), count in zip(controls, before, strict=True):
            put(count)
