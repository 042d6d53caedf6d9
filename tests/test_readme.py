"""What the README shows runs, and what it points to is there."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import has_graphics

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text()


def blocks(language):
    return re.findall(rf"```{language}\n(.*?)```", README, re.S)


@pytest.mark.parametrize("code", blocks("python"))
def test_the_python_runs(code, tmp_path):
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "completed" in done.stdout
    assert (tmp_path / "run.csv").is_file()


def test_the_first_block_is_the_two_commands_and_make_knows_them():
    first = [line.split() for line in blocks("sh")[0].splitlines()]
    assert [words[:2] for words in first] == [["make", "demo"], ["make", "test"]]
    makefile = (ROOT / "Makefile").read_text()
    assert re.search(r"^demo:", makefile, re.M) and re.search(r"^test:", makefile, re.M)


def test_the_commands_run_as_printed(tmp_path):
    """In a shell with nothing on its path but the system, after the line that the README gives.

    The viewer needs a screen; films, which are tested elsewhere, are left out or made small.
    """
    activate = ". .venv/bin/activate"
    assert f"`{activate}`" in README and "`pip install .`" in README
    lines = [activate]
    for line in re.findall(r"^mjchair .*$", "".join(blocks("sh")), re.M):
        line = line.partition("#")[0].strip().replace(" --video", "")
        if line.startswith("mjchair render"):
            line += " --frame 1 --size 160x120" if has_graphics() else " --help"
        if not line.startswith("mjchair view"):
            lines.append(line)
    assert len(lines) > 4
    (tmp_path / ".venv").symlink_to(sys.prefix)
    done = subprocess.run(
        ["/bin/bash", "-euc", "\n".join(lines)],
        cwd=tmp_path,
        env={"PATH": "/usr/bin:/bin", "HOME": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "out" / "turn" / "recording.csv").is_file()


@pytest.mark.parametrize("target", sorted(set(re.findall(r"\]\(([^)#]+)\)", README))))
def test_what_it_points_to_is_there(target):
    assert target.startswith("https://") or (ROOT / target).exists()


def test_pictures_stand_in_the_first_screen():
    assert "docs/images/demo.png" in "\n".join(README.splitlines()[:25])


def test_every_dependency_has_a_reason():
    import tomllib

    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    names = [re.split(r"[<>=]", entry)[0] for entry in project["dependencies"]]
    table = (ROOT / "docs" / "dependencies.md").read_text()
    assert not [name for name in names if f"| {name}" not in table]


def test_the_lock_pins_every_dependency():
    lock = (ROOT / "requirements.lock").read_text()
    assert all(re.fullmatch(r"[A-Za-z0-9_.-]+==[^\s]+", line) for line in lock.split())
    for name in ("mujoco==3.17.", "dm_control==1.0.50", "numba==", "pytest==", "ruff==", "mypy=="):
        assert name in lock
