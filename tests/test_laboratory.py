"""The laboratory's command: what it writes, how it goes on, and what it says to bad input."""

import json

import pytest

from mjchair import cli
from mjchair.testlab import laboratory
from mjchair.testlab.design import Design
from mjchair.testlab.result import Result, Value

CALLS = []


def quick(design):
    """A test that costs nothing: the design's dummy."""
    CALLS.append(design)
    return Result("quick", {"dummy": Value(design.occupant or 75.0, "kg")})


@pytest.fixture
def quick_tests(monkeypatch):
    """Two tests in the laboratory's place, the second of which fails for a dummy of 50 kg."""
    CALLS.clear()

    def perform(test, design, stops=True, adjust=None):
        if test == "picky" and design.occupant == 50.0:
            raise laboratory.MjchairError("the chair never comes to rest")
        return quick(design)

    monkeypatch.setattr(laboratory, "TESTS", {"quick": ("", "Quick"), "picky": ("", "Picky")})
    monkeypatch.setattr(laboratory, "LONGEST", ())
    monkeypatch.setattr(laboratory, "perform", perform)


def request(occupant=100.0, draws=()):
    return laboratory.Request({"it": Design(occupant=occupant)}, laboratory.chosen([]), draws=draws)


def test_results_and_an_interrupted_run_that_goes_on(quick_tests, tmp_path):
    out = tmp_path / "sheet"
    laboratory.run(request(), out, workers=1)
    told = json.loads((out / "results.json").read_text())
    assert told["model"] == "manual"
    assert told["tests"]["quick"]["dummy"]["value"] == 100.0
    assert told["tests"]["quick"]["dummy"]["unit"] == "kg"
    assert set(told["tests"]["quick"]["dummy"]) >= {"value", "unit", "low", "high", "source"}
    (out / "parts" / "design-0-picky.json").unlink()
    assert len(CALLS) == 2
    laboratory.run(request(), out, workers=1)
    assert len(CALLS) == 3  # only what was not there


def test_a_test_that_fails_keeps_the_others(quick_tests, tmp_path):
    with pytest.raises(laboratory.MjchairError, match=r"picky: .* never comes to rest; what was"):
        laboratory.run(request(50.0), tmp_path / "sheet", workers=1)
    told = json.loads((tmp_path / "sheet" / "results.json").read_text())
    assert list(told["tests"]) == ["quick"]


def test_anothers_folder_is_not_written_into(quick_tests, tmp_path):
    laboratory.run(request(), tmp_path / "sheet", workers=1)
    with pytest.raises(laboratory.MjchairError, match="not empty"):
        laboratory.run(request(125.0), tmp_path / "sheet", workers=1)


def test_intervals_stand_beside_the_numbers(quick_tests, tmp_path):
    draws = tuple(Design(occupant=mass) for mass in (90.0, 95.0, 105.0, 110.0))
    found = laboratory.run(request(draws=draws), tmp_path / "sheet", workers=1)
    value = found["it"]["quick"].values["dummy"]
    assert value.value == 100.0
    assert 90.0 <= value.low < 100.0 < value.high <= 110.0


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["static-stabilty"], "did you mean 'static-stability'?"),
        (["static-stability", "--occupant", "20"], "the dummy is 20 kg"),
        (["static-stability", "--set", "axel_position=0.03"], "did you mean 'axle_position'?"),
        (["static-stability", "--set", "axle_position"], "is not NAME=VALUE"),
        (["static-stability", "--adjust", "axle_position=1"], "is not NAME=LOW:HIGH"),
        (["static-stability", "--uncertainty", "1"], "--uncertainty is 1"),
        (["static-stability", "--model", "no_such"], "unknown model"),
    ],
)
def test_bad_input_is_one_line(arguments, line, tmp_path, capsys):
    out = tmp_path / "sheet"
    assert cli.main(["test", *arguments, "--out", str(out)]) == 2
    told = capsys.readouterr().err
    assert line in told
    assert told.count("\n") == 1
    assert not out.exists()


def test_a_chair_without_casters(tmp_path, capsys):
    spec = Design("manual").spec()
    for name in ("left_caster_swivel", "right_caster_swivel"):
        spec.delete(spec.body(name))
    path = tmp_path / "two_wheels.xml"
    path.write_text(spec.to_xml())
    code = cli.main(["test", "--model", str(path), "--out", str(tmp_path / "sheet")])
    assert code == 2
    assert "has no left_caster and no right_caster" in capsys.readouterr().err


def test_without_stops_the_command_says_where_it_slides(tmp_path, capsys):
    out = tmp_path / "sheet"
    arguments = ["test", "static-stability", "--no-stops", "--workers", "1", "--out", str(out)]
    assert cli.main(arguments) == 2
    assert "slides at" in capsys.readouterr().err
