"""What the README shows runs, and what it points to is there."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import has_graphics

from mjchair import cli

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text()


def blocks(language):
    return re.findall(rf"```{language}\n(.*?)```", README, re.S)


def commands():
    lines = [
        line.partition("#")[0].strip() for block in blocks("sh") for line in block.splitlines()
    ]
    return [shlex.split(line) for line in lines if line]


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


def test_the_commands_run(tmp_path, monkeypatch, capsys):
    """Those of mjchair, one after the other in one folder; the viewer needs a screen."""
    monkeypatch.chdir(tmp_path)
    ran = 0
    for words in commands():
        if words[0] != "mjchair" or words[1] == "view":
            continue
        if not has_graphics():
            words = [word for word in words if word != "--video"]
            if words[1] == "render":
                continue
        if words[1] == "render":
            words = [*words, "--fps", "1", "--size", "160x120"]
        if "--video" in words:
            monkeypatch.setattr("mjchair.report.render.Film.frame", _small_frame)
        assert cli.main(words[1:]) == 0, (words, capsys.readouterr().err)
        monkeypatch.undo()
        monkeypatch.chdir(tmp_path)
        ran += 1
    assert ran >= 5


def _small_frame(film, sample):
    """A blank frame: films are tested elsewhere."""
    import numpy as np

    return np.zeros((film._rect.height, film._rect.width, 3), np.uint8)


@pytest.mark.parametrize("target", sorted(set(re.findall(r"\]\(([^)#]+)\)", README))))
def test_what_it_points_to_is_there(target):
    assert target.startswith("https://") or (ROOT / target).exists()


def test_pictures_stand_in_the_first_screen():
    assert "docs/images/demo.png" in "\n".join(README.splitlines()[:25])


def test_every_dependency_has_a_reason():
    import tomllib

    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    names = [re.split(r"[<>=]", entry)[0] for entry in project["dependencies"]]
    table = README.partition("## Dependencies")[2]
    assert not [name for name in names if f"| {name}" not in table]


def test_the_lock_pins_every_dependency():
    lock = (ROOT / "requirements.lock").read_text()
    assert all(re.fullmatch(r"[A-Za-z0-9_.-]+==[^\s]+", line) for line in lock.split())
    for name in ("mujoco==3.17.", "dm_control==1.0.50", "numba==", "pytest==", "ruff==", "mypy=="):
        assert name in lock
