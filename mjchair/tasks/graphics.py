"""The OpenGL that draws the pictures of the tasks, chosen when the first picture is drawn.

In: a size in pixels; the environment variable MUJOCO_GL, where the user has set it. Out: a context
of OpenGL as dm_control asks for it (`Context`), around the one that films draw with as well
(`mjchair.report.gl`): two libraries that open one display each would close it for one another.

dm_control makes its choice of OpenGL when it is imported: it opens an EGL display, or takes a
window system that may not exist. If an EGL display is open when PyTorch is imported, the process
crashes. So this module delays the choice; everything in `mjchair.tasks` imports it before
dm_control. Where the user has imported dm_control earlier, its choice stays valid for the
environments of dm_control itself; the environments of `mjchair.tasks` use this module in both
cases.
"""

from __future__ import annotations

import functools
import importlib
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import mujoco  # noqa: F401  # MuJoCo reads MUJOCO_GL at import: do it before the change below

from mjchair.report import gl
from mjchair.tasks import process_environment

DISABLED = ("disable", "disabled", "off", "false", "0")  # values of MUJOCO_GL


@functools.cache
def context_class() -> type[Any]:
    """dm_control's kind of context around that of `mjchair.report.gl`.

    Raises:
      NoGraphicsError: no OpenGL works on this machine, or MUJOCO_GL turns it off.
    """
    backend = os.environ.get("MUJOCO_GL", "").lower()
    if backend in DISABLED:
        raise gl.NoGraphicsError(
            f"MUJOCO_GL is {backend!r}, which turns pictures off; unset it to draw one"
        )
    # dm_control frees its contexts at exit; the display that closes there is opened before them
    gl.context(8, 8).free()
    from dm_control._render import base, executor

    class Context(base.ContextBase):  # type: ignore[misc]
        """An offscreen context that is made current whenever it is drawn with.

        dm_control does not do so where its own context was the last; a film may have been.
        """

        def __init__(self, max_width: int, max_height: int) -> None:
            """A context for pictures up to a size (pixels)."""
            self._context: Any = None
            super().__init__(max_width, max_height, executor.PassthroughRenderExecutor)

        def _platform_init(self, max_width: int, max_height: int) -> None:
            self._context = gl.context(max_width, max_height)

        def _platform_make_current(self) -> None:
            if self._context is not None:
                self._context.make_current()

        def _platform_free(self) -> None:
            if self._context is not None:
                self._context.free()
            self._context = None

        @contextmanager
        def make_current(self) -> Iterator[Any]:
            """As dm_control's, and current for certain."""
            with super().make_current() as thread:
                thread.call(self._platform_make_current)
                yield thread

    return Context


def new_context(max_width: int, max_height: int) -> Any:
    """An offscreen OpenGL context for pictures up to a size (pixels).

    Raises:
      NoGraphicsError: as `context_class` does.
    """
    return context_class()(max_width, max_height)


def delay_the_choice() -> None:
    """Import dm_control's rendering module such that it chooses no OpenGL yet.

    Environment variables are afterwards as they were before.
    """
    if "dm_control._render" in sys.modules:
        return
    with process_environment.restored(MUJOCO_GL="disabled"):
        rendering: Any = importlib.import_module("dm_control._render")
    rendering.Renderer = new_context


delay_the_choice()
