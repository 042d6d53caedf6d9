"""Keep the environment variables of the process unchanged while other packages are imported.

In: variables to set during a block of code. Out: nothing; after the block all variables have their
old values. dm_control and Gymnasium set variables when they are imported; mjchair must not.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def restored(**values: str) -> Iterator[None]:
    """Set environment variables to `values` in a block; after it, all have their old values."""
    before = dict(os.environ)
    os.environ.update(values)
    try:
        yield
    finally:
        for name in os.environ.keys() - before.keys():
            del os.environ[name]
        os.environ.update(before)
