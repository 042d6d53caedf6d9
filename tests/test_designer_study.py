"""The designer's study says what its page says."""

import dataclasses
import importlib.util
from pathlib import Path

import matplotlib
import numpy as np

from mjchair.sweep import chunk

ROOT = Path(__file__).parents[1]


def test_the_page_has_the_numbers_of_the_script():
    matplotlib.use("Agg")
    spec = importlib.util.spec_from_file_location("study", ROOT / "scripts" / "designer_study.py")
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    study = script.studies()["turn"]
    positions = study.axes["axle_position"]
    study = dataclasses.replace(
        study, axes={**study.axes, "axle_position": [min(positions), max(positions)]}
    )
    rows = chunk.run_chunk(study, study.cases())
    assert {row["status"] for row in rows} == {"completed"}
    turn = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    page = " ".join((ROOT / "docs" / "many_chairs.md").read_text().split())
    assert script.sentence(turn) in page
