"""Importing mjchair touches neither environment nor graphics; any order of imports works."""

import importlib.util
import os
import subprocess
import sys

import pytest
from conftest import has_graphics

drawn = pytest.mark.skipif(not has_graphics(), reason="no offscreen OpenGL on this machine")

EVERY_MODULE = """
import importlib, os, pkgutil, sys
before = dict(os.environ)
import mjchair
names = ["mjchair", *(m.name for m in pkgutil.walk_packages(mjchair.__path__, "mjchair."))]
for name in names:
    if name != "mjchair.__main__":
        importlib.import_module(name)
    changed = {k for k in before.keys() | os.environ.keys() if before.get(k) != os.environ.get(k)}
    assert not changed, f"import {name} changes {changed}"
    assert not [m for m in sys.modules if m.startswith("OpenGL")], f"import {name} takes an OpenGL"
    with open("/proc/self/maps") as maps:
        assert "libEGL" not in maps.read(), f"import {name} opens EGL"
assert "mjchair.tasks.suite" in names
"""
PICTURE = """
environment = tasks.load("straight_line", {"random": 0})
environment.reset()
assert environment.physics.render(height=24, width=32, camera_id="follow").std() > 5.0
"""
GYMNASIUM_PICTURE = """
environment = gymnasium.make(
    "mjchair/straight_line-v0", render_mode="rgb_array", render_kwargs={"height": 24, "width": 32}
)
environment.reset(seed=0)
assert environment.render().std() > 5.0
"""


def run(code: str, quiet: bool = False) -> None:
    """Run code in a Python of its own, without what this one has set for graphics.

    Args:
      quiet: whether it may write nothing to standard error.
    """
    ours = ("MUJOCO_GL", "PYOPENGL_PLATFORM", "PYGAME_HIDE_SUPPORT_PROMPT")
    environment = {name: value for name, value in os.environ.items() if name not in ours}
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0 and not (quiet and done.stderr), done.stderr


@pytest.mark.skipif(sys.platform != "linux", reason="reads the loaded libraries of a Linux process")
def test_no_import_touches_the_environment_or_graphics():
    run(EVERY_MODULE)


@drawn
def test_pictures_where_others_were_imported_first():
    pytest.importorskip("shimmy", reason="the extra [tasks] is not installed")
    run("import shimmy, gymnasium\nfrom mjchair import tasks" + GYMNASIUM_PICTURE)


@drawn
def test_pictures_where_the_tasks_were_imported_first():
    """PyTorch may come after the tasks, and dm_control's own environments draw as well."""
    rest = "\nimport torch" if importlib.util.find_spec("torch") else ""
    rest += "\nimport gymnasium" + GYMNASIUM_PICTURE if importlib.util.find_spec("shimmy") else ""
    run(
        "from mjchair import tasks" + rest + PICTURE + "from dm_control import suite\n"
        "physics = suite.load('pendulum', 'swingup').physics\n"
        "assert physics.render(height=24, width=32).std() > 5.0"
    )


@drawn
def test_a_film_and_a_task_draw_in_turn():
    """Each draws what it draws alone, whichever drew before, and nothing is wrong at the end."""
    run(
        """
import numpy as np
import mjchair
from mjchair import tasks
from mjchair.report.film import Film

run = mjchair.simulate(mjchair.load_spec("manual"), mjchair.constant({}, 0.1))
physics = tasks.load("straight_line", {"random": 0}).physics
with Film(run, width=160, height=120) as film:
    alone = [film.frame(0), film.frame(0)]
picture = physics.render(84, 84, camera_id="follow")
with Film(run, width=160, height=120) as film:
    for frame in alone:
        assert np.array_equal(film.frame(0), frame)
        assert np.array_equal(physics.render(84, 84, camera_id="follow"), picture)
assert np.array_equal(physics.render(84, 84, camera_id="follow"), picture)
assert picture.std() > 5.0
""",
        quiet=True,
    )
