"""Tell dm_control which OpenGL to use, before it is imported."""

from __future__ import annotations

import os
import sys

from mjchair.report.gl import NoGraphicsError, backend


def choose() -> None:
    """Set MUJOCO_GL where nobody has, on a Linux machine without a screen."""
    screen = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    if sys.platform != "linux" or screen or "MUJOCO_GL" in os.environ:
        return
    if "dm_control" in sys.modules:
        return  # too late: it has chosen
    try:
        os.environ["MUJOCO_GL"] = backend()
    except NoGraphicsError:
        os.environ["MUJOCO_GL"] = "disabled"


choose()
