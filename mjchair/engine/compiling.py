"""Say that the tires are being compiled, while Numba does so for the first time on a machine.

In: a function that makes compiled functions. Out: the same function, which writes one line to
standard error when Numba begins to compile, and shows a bar where that is a terminal. Nothing is
said when the compiled code is read from Numba's cache on disk, as from the second process on.
"""

from __future__ import annotations

import functools
import sys
from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar

from numba.core import event
from tqdm import tqdm

P = ParamSpec("P")
R = TypeVar("R")

FUNCTIONS = 95  # that are compiled in all; the bar's length, no more
NOTICE = (
    "mjchair: compiling the tires for this machine; this takes about half a minute, the first time "
    "only"
)


class _Notice(event.Listener):
    """Writes the line at the first function that is compiled, and moves the bar at each."""

    said = False  # in this process
    bar: tqdm[Any] | None = None

    def on_start(self, event: Any) -> None:
        """Numba begins to compile a function."""
        if not _Notice.said:
            _Notice.said = True
            print(NOTICE, file=sys.stderr, flush=True)
        if _Notice.bar is None:
            _Notice.bar = tqdm(total=FUNCTIONS, unit="function", leave=False, disable=None)

    def on_end(self, event: Any) -> None:
        """It has compiled the function."""
        if _Notice.bar is not None:
            _Notice.bar.update()

    def close(self) -> None:
        """Take the bar away."""
        if _Notice.bar is not None:
            _Notice.bar.close()
            _Notice.bar = None


def announced(make: Callable[P, R]) -> Callable[P, R]:
    """The function, which says so when Numba compiles in it."""

    @functools.wraps(make)
    def made(*args: P.args, **kwargs: P.kwargs) -> R:
        notice = _Notice()
        with event.install_listener("numba:compile", notice):
            try:
                return make(*args, **kwargs)
            finally:
                notice.close()

    return made
