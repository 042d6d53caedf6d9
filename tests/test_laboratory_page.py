"""docs/tire_laboratory.md does what it says: every command runs, and prints the lines shown."""

import re
import shlex
from pathlib import Path

from mjchair.cli import main

PAGE = Path(__file__).parents[1] / "docs" / "tire_laboratory.md"


def shown():
    """Commands of the page, each with the lines of output that follow it."""
    commands = []
    for block in re.findall(r"```console\n(.*?)```", PAGE.read_text(), re.DOTALL):
        for line in block.splitlines():
            if line.startswith("$ mjchair "):
                commands.append((shlex.split(line.removeprefix("$ mjchair ")), []))
            elif line.strip() not in ("", "..."):
                commands[-1][1].append(line)
    return commands


def words(line):
    """A line without its numbers, which may differ in the last digit between machines."""
    return re.sub(r"[-+]?\d[\d.e+-]*", "#", line).split()


def test_every_command_prints_what_is_shown(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    commands = shown()
    assert len(commands) >= 8
    for arguments, lines in commands:
        assert main(arguments) == 0
        printed = [words(line) for line in capsys.readouterr().out.splitlines()]
        for line in lines:
            assert words(line) in printed, line


def test_every_figure_is_there():
    for figure in re.findall(r"\]\((images/[^)]+)\)", PAGE.read_text()):
        assert (PAGE.parent / figure).is_file()
