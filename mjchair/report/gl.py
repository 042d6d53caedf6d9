"""An offscreen OpenGL context, by EGL or OSMesa, depending on the machine.

In: a size in pixels. Out: a context that is current inside a block; or an error that says what is
missing on the machine.
"""

from __future__ import annotations

import functools
import importlib
import os
import subprocess
import sys
from typing import Any

from mjchair.errors import MjchairError

OFFSCREEN = ("egl", "osmesa")
LARGEST = 4096  # pixels, of a side of a picture
MISSING = (
    "no offscreen OpenGL: install one with `apt-get install libosmesa6` (or libegl1 with "
    "libgl1-mesa-dri); everything but pictures works without"
)


class NoGraphicsError(MjchairError):
    """There is no offscreen OpenGL on this machine."""


@functools.cache
def backend() -> str:
    """The first of EGL and OSMesa that works; only that in MUJOCO_GL, where it names one.

    The attempt runs in a separate process, since PyOpenGL stays bound to the platform of its
    import.

    Raises:
      NoGraphicsError: none does.
    """
    wanted = os.environ.get("MUJOCO_GL", "").lower()
    for name in (wanted,) if wanted in OFFSCREEN else OFFSCREEN:
        code = f"import mujoco.{name} as gl; c = gl.GLContext(8, 8); c.make_current(); c.free()"
        environment = os.environ | {"MUJOCO_GL": name, "PYOPENGL_PLATFORM": name}
        try:
            tried = subprocess.run(
                [sys.executable, "-c", code], env=environment, capture_output=True, timeout=60
            )
        except subprocess.TimeoutExpired:
            continue
        if tried.returncode == 0:
            return name
    raise NoGraphicsError(MISSING)


def context(width: int, height: int) -> Any:
    """A current offscreen context of the size given (pixels); free it with `.free()`.

    Raises:
      NoGraphicsError: there is none to be had.
    """
    if sys.platform == "linux":
        name = backend()
        os.environ.setdefault("PYOPENGL_PLATFORM", name)
        kind = importlib.import_module(f"mujoco.{name}").GLContext
    else:
        from mujoco.gl_context import GLContext as kind
    try:
        made = kind(width, height)
        made.make_current()
    except (ImportError, RuntimeError, AttributeError) as error:
        line = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise NoGraphicsError(f"{MISSING} ({line})") from None
    return made
