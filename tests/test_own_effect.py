"""An effect of a user's own: the example of the documentation is hidden, and found."""

import json
import re
import tomllib
from pathlib import Path

import pytest
import tomli_w

from mjchair import cli

PAGE = Path(__file__).parents[1] / "docs" / "diagnosis.md"
EXAMPLE = re.search(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL).group(1)


def write(folder, text=EXAMPLE):
    file = folder / "brake.py"
    file.write_text(text)
    return str(file)


def test_the_example_is_of_thirty_lines():
    assert len(EXAMPLE.splitlines()) <= 30


def test_the_example_is_hidden_found_and_in_the_corrected_chair(tmp_path):
    file, study, out = write(tmp_path), tmp_path / "study", tmp_path / "out"
    assert cli.main(["hide", file, "--out", str(study)]) == 0
    shorten(study / "study.toml")
    assert cli.main(["diagnose", str(study), "--effect", file, "--out", str(out)]) == 0
    found = json.loads((out / "diagnosis.json").read_text())
    assert "rubbing_brake" in {e["name"] for e in found["effects"]} | set().union(
        *found["alternatives"]
    )
    (brake,) = (e for e in found["effects"] if e["name"] == "rubbing_brake")
    moment = brake["parameters"]["moment"]
    assert abs(moment["value"] - 0.3) < 4.0 * moment["std"] < 0.15
    corrected = (out / "model.xml").read_text()
    losses = re.findall(r'<joint name="(\w+)_wheel"[^>]*frictionloss="([\d.]+)"', corrected)
    assert [side for side, loss in losses if float(loss) > 0.2] == ["left"]


def shorten(study):
    """A coast and the turn are enough for a brake."""
    table = tomllib.loads(study.read_text())
    table["trial"] = [t for t in table["trial"] if t["file"] in ("coast_1.csv", "turn_2.csv")]
    assert len(table["trial"]) == 2
    study.write_text(tomli_w.dumps(table))


WRONG = {
    "a fault of syntax": (EXAMPLE.replace("def edit(", "def edit("[:-1]), "line 7: "),
    "no EFFECT": (EXAMPLE.replace("EFFECT =", "EFECT ="), "has no EFFECT"),
    "an EFFECT that is none": ("EFFECT = 3\n", "has no EFFECT that is an"),
    "a module that is not there": ("import brakes\n", "ModuleNotFoundError: No module named"),
    "a file that ends the program": ("raise SystemExit(3)\n", "fails: SystemExit: 3"),
    "an edit that raises": (
        EXAMPLE.replace("wheel.frictionloss +=", "wheel.friction +="),
        "effect rubbing_brake fails: AttributeError: ",
    ),
    "a joint that is not there": (
        EXAMPLE.replace('"left_wheel", "joint"', '"left_weel", "joint"'),
        "the model has no joint 'left_weel'; did you mean 'left_wheel'",
    ),
    "a parameter that edit does not take": (
        EXAMPLE.replace('Parameter("moment"', 'Parameter("torque"'),
        "unexpected keyword argument 'torque'",
    ),
    "what does not compile": (
        EXAMPLE.replace("wheel.frictionloss += moment", 'wheel.name = "right_wheel"'),
        "fails: ValueError: .*repeated name",
    ),
    "a name of the library": (EXAMPLE.replace("rubbing_brake", "toe"), "name yours anew"),
    "bounds without the neutral value": (
        EXAMPLE.replace("0.3, 0.0, 10.0", "0.3, 0.1, 10.0"),
        "moment is 0 where nothing acts and 0.3 as a rule; both must be within 0.1 to 10",
    ),
    "no size worth finding": (EXAMPLE.replace("0.3, 0.0, 10.0", "0.0, 0.0, 10.0"), "must differ"),
    "no parameter": (
        re.sub(
            r"parameters=\(.*?\),\n    sig", "parameters=(),\n    sig", EXAMPLE, flags=re.DOTALL
        ),
        "has no parameter to fit",
    ),
}


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study")
    rows = [f"{0.02 * k:.2f},{3.0 - 0.002 * k:.4f}" for k in range(100)]
    (folder / "a.csv").write_text("\n".join(["time,left_wheel_speed", *rows]) + "\n")
    (folder / "study.toml").write_text('[[trial]]\nfile = "a.csv"\n')
    return str(folder)


@pytest.mark.parametrize("case", WRONG)
def test_a_broken_effect_is_one_line_and_nothing_is_written(case, study, tmp_path, capsys):
    text, words = WRONG[case]
    assert text != EXAMPLE
    file, out = write(tmp_path, text), tmp_path / "out"
    for command in (["hide", file], ["diagnose", study, "--effect", file]):
        assert cli.main([*command, "--out", str(out)]) == 2
        said = capsys.readouterr().err
        assert said.startswith("mjchair: ") and said.count("\n") == 1, said
        assert re.search(words, said), said
        assert not out.exists()
