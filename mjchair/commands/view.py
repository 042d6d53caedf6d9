"""`mjchair view`: a chair in MuJoCo's own viewer, tires on.

In: a chair and a scene. Out: a window, until it is closed.
"""

from __future__ import annotations

import argparse
import os
import sys

from mjchair.commands import options
from mjchair.errors import MjchairError


def add(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the subcommand."""
    parser = subparsers.add_parser(
        "view",
        help="open a chair in MuJoCo's viewer, tires on",
        description="Open a chair in MuJoCo's own viewer, tires on. Drive it with the sliders of "
        "the actuators left_wheel and right_wheel (N m).",
    )
    options.add_model(parser)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Open the viewer, and wait until it is closed."""
    from mjchair.engine.install import installed

    model = options.chair(args).compile()
    if sys.platform == "linux" and not _has_screen():
        raise MjchairError(
            "there is no screen here (DISPLAY and WAYLAND_DISPLAY are not set); film the chair "
            "with `mjchair simulate --video`"
        )
    import mujoco.viewer

    with installed():
        mujoco.viewer.launch(model)
    return 0


def _has_screen() -> bool:
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
