"""Silence MuJoCo's own warnings, where a chair that fails in a search is dropped and noted.

In: a block of code. Out: the block runs without MuJoCo's warnings on the terminal or in a file.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import mujoco


@contextmanager
def without_engine_warnings() -> Iterator[None]:
    """Within the block nobody hears a warning: no terminal, no MUJOCO_LOG.TXT, and no other library
    that listens in this process, as dm_control does."""
    before, quiet = mujoco.MjLogConfig.get(), mujoco.MjLogConfig.get()
    quiet.logto_console = quiet.logto_file = False
    listener = mujoco.get_mju_user_warning()
    quiet.set()
    if listener is not None:
        mujoco.set_mju_user_warning(lambda message: None)
    try:
        yield
    finally:
        before.set()
        if listener is not None:
            mujoco.set_mju_user_warning(listener)
