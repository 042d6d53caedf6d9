"""The OpenGL that draws the pictures of the tasks, chosen when the first picture is drawn.

In: the environment variable MUJOCO_GL, where the user has set it. Out: the class of dm_control's
OpenGL context for this machine (`renderer`).

dm_control makes this choice when it is imported: it opens an EGL display, or takes a window system
that may not exist. If an EGL display is open when PyTorch is imported, the process crashes. So this
module delays the choice; everything in `mjchair.tasks` imports it before dm_control. Where the user
has imported dm_control earlier, its choice stays valid for the environments of dm_control itself;
the environments of `mjchair.tasks` use this module in both cases.
"""

from __future__ import annotations

import functools
import importlib
import os
import sys
from typing import Any

import mujoco  # noqa: F401  # MuJoCo reads MUJOCO_GL at import: do it before the change below

from mjchair.report import gl
from mjchair.tasks import process_environment

DISABLED = ("disable", "disabled", "off", "false", "0")  # values of MUJOCO_GL
CONTEXTS = {
    "egl": ("dm_control._render.pyopengl.egl_renderer", "EGLContext"),
    "osmesa": ("dm_control._render.pyopengl.osmesa_renderer", "OSMesaContext"),
    "glfw": ("dm_control._render.glfw_renderer", "GLFWContext"),
}


@functools.cache
def renderer() -> type[Any]:
    """dm_control's context class for MUJOCO_GL if it is set, else for an OpenGL that works here.

    Raises:
      NoGraphicsError: no OpenGL works on this machine, or MUJOCO_GL turns it off.
    """
    backend = os.environ.get("MUJOCO_GL", "").lower()
    if backend in DISABLED:
        raise gl.NoGraphicsError(
            f"MUJOCO_GL is {backend!r}, which turns pictures off; unset it to draw one"
        )
    name = "glfw" if backend == "glfw" or sys.platform != "linux" else gl.backend()
    module, kind = CONTEXTS[name]
    try:
        return getattr(importlib.import_module(module), kind)  # type: ignore[no-any-return]
    except ImportError as error:
        raise gl.NoGraphicsError(f"{gl.MISSING} ({name}: {error})") from None


def new_context(max_width: int, max_height: int) -> Any:
    """An offscreen OpenGL context for pictures up to a size (pixels).

    Raises:
      NoGraphicsError: as `renderer` does.
    """
    return renderer()(max_width=max_width, max_height=max_height)


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
