"""The page about people's own files: its commands run as they stand."""

import re
import shlex
from pathlib import Path

import mjchair.cli

ROOT = Path(__file__).parents[1]


def test_the_first_two_commands_of_the_page_run(tmp_path, monkeypatch, capsys):
    page = (ROOT / "docs" / "your_data.md").read_text()
    block = next(b for b in re.findall(r"```sh\n(.*?)```", page, re.S) if "gather" in b)
    commands = [shlex.split(line) for line in block.strip().splitlines()]
    assert [c[1] for c in commands] == ["gather", "outcomes", "diagnose"]
    monkeypatch.chdir(tmp_path)
    (tmp_path / "data").symlink_to(ROOT / "data")
    for command in commands[:2]:
        assert mjchair.cli.main(command[1:]) == 0
    capsys.readouterr()
    # what the third one begins with; a diagnosis itself is tested elsewhere
    study = mjchair.read_study(tmp_path / commands[2][2])
    assert study.runs[0].trial.inputs is not None
