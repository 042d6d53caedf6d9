"""Eight cases of the blind benchmark, of another seed than its table: no wrong name is given.

Two hide nothing, five hide one effect, one something outside the library. Of the first ten of the
seed these are all but a pair of effects, of which nothing is asserted here, and a third of nothing.
"""

import json
import subprocess
import sys
from pathlib import Path

import pytest

BLIND = Path(__file__).parents[1] / "benchmarks" / "blind"
NUMBERS = (0, 1, 2, 3, 5, 7, 8, 9)
SLICE = ("--seed", "60", "--trials", "3", "--seconds", "4", "--numbers", *map(str, NUMBERS))


@pytest.fixture(scope="module")
def lines(tmp_path_factory):
    """Results of the slice, as the benchmark's own command writes them."""
    work = tmp_path_factory.mktemp("blind")
    command = [sys.executable, str(BLIND / "run.py"), *SLICE, "--work", str(work)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    path = work / "results_mujoco_60.jsonl"
    assert "| figure | aim | result |" in done.stdout
    again = subprocess.run(command, capture_output=True, text=True, check=True)
    assert again.stdout.startswith("| figure"), "a second start has nothing left to run"
    return [json.loads(line) for line in path.read_text().splitlines()]


def test_the_slice_is_whole(lines):
    assert sorted(line["number"] for line in lines) == list(NUMBERS)
    assert not any(line["verdict"] == "error" for line in lines)


def test_nothing_is_named_where_nothing_is_hidden_or_known(lines):
    from table import named

    for line in lines:
        if line["answer"]["kind"] in ("none", "outside"):
            assert not named(line), line["answer"]


def test_what_is_named_is_what_was_hidden(lines):
    from table import clear, kept, returned, wrong

    ones = [line for line in lines if line["answer"]["kind"] == "one"]
    assert not any(wrong(line) for line in ones)
    seen = [line for line in ones if clear(line) and returned(line)]
    assert len(seen) >= 3
    assert all(kept(line) for line in seen)


def test_a_pair_is_told_apart_where_nothing_else_that_was_fitted_is_as_near():
    from table import decided

    answer = {"kind": "two", "hidden": {"toe": {}, "wind": {}}, "channel": "",
              "reached": {"toe": 40.0, "wind": 30.0}}  # fmt: skip
    near = {"toe+wind": 1.0, "floor_slope+toe": 6.0, "floor_slope+toe+wind": -4.0}
    far = near | {"floor_slope+toe": 11.0}
    assert not decided({"answer": answer, "fits": near})
    assert decided({"answer": answer, "fits": far})
    assert decided({"answer": answer, "fits": {"floor_slope+toe": 0.0}}), "what was not tried"
