"""What a newcomer meets first: `mjchair` alone, the shell's completion, and the demo."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from mjchair import cli
from mjchair.commands import completion

ROOT = Path(__file__).parents[1]


def test_mjchair_alone_prints_commands_that_exist(capsys):
    assert cli.main([]) == 0
    printed = capsys.readouterr().out
    named = re.findall(r"^  mjchair (\S+)", printed, re.M)
    known = completion.commands(cli.parser())
    assert {"simulate", "replay", "diagnose"} <= set(named) <= set(known)
    assert completion.SWITCH in printed
    assert all(len(line) <= 100 for line in printed.splitlines())


def test_its_commands_run_as_printed(capsys, tmp_path, monkeypatch):
    """The two that need no file of the user's."""
    monkeypatch.chdir(tmp_path)
    cli.main([])
    lines = re.findall(r"^  mjchair ((?:simulate|replay) .*)$", capsys.readouterr().out, re.M)
    assert len(lines) == 2
    for line in lines:
        assert cli.main(re.split(r"\s{2,}", line)[0].split()) == 0
    assert (tmp_path / "out" / "turn.html").is_file()


def completed(line, folder):
    """What the shell would offer at the end of a line."""
    answer = folder / "answer"
    environment = {
        **os.environ,
        "_ARGCOMPLETE": "1",
        "_ARGCOMPLETE_SHELL": "bash",
        "_ARGCOMPLETE_STDOUT_FILENAME": str(answer),
        "COMP_LINE": line,
        "COMP_POINT": str(len(line)),
        "COMP_TYPE": "9",
        "IFS": "\n",
    }
    command = [sys.executable, "-m", "mjchair"]
    subprocess.run(command, env=environment, cwd=folder, check=False, capture_output=True)
    return {word.strip() for word in re.split(r"[\v\n]", answer.read_text()) if word.strip()}


@pytest.mark.parametrize(
    ("line", "offered"),
    [
        ("mjchair sim", {"simulate"}),
        ("mjchair simulate --scene cr", {"cross_slope"}),
        ("mjchair simulate --set occupant_m", {"occupant_mass="}),
        ("mjchair render --view t", {"top"}),
        ("mjchair replay --gh", {"--ghost"}),
        ("mjchair diagnose stu", {"study_of_mine/"}),
    ],
)
def test_the_shell_completes_commands_names_and_files(line, offered, tmp_path):
    (tmp_path / "study_of_mine").mkdir()
    assert completed(line, tmp_path) == offered


def test_every_name_is_of_an_argument_and_offers_something():
    known = completion.commands(cli.parser())
    for (command, dest), names in completion.NAMES.items():
        parsers = [known[command]] if command else known.values()
        assert any(action.dest == dest for p in parsers for action in p._actions), (command, dest)
        assert list(names())


def test_the_demo_ends_by_naming_the_replay(tmp_path):
    command = [sys.executable, "scripts/demo.py", "--out", str(tmp_path / "demo")]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    last = done.stdout.splitlines()[-1]
    page = Path(last.partition(": ")[2])
    assert page.name == "replay.html" and page.is_file()
    assert page.stat().st_size <= 3e6
    assert "measured chair" in page.read_text()
