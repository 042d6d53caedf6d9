"""The workflow on hidden effects, made by the generator of benchmarks/blind."""

import json
import sys
from pathlib import Path

import mujoco
import numpy as np
import pytest

from mjchair.cli import main
from mjchair.diagnosis.linear import Reduced
from mjchair.diagnosis.noise import Noise

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks" / "blind"))


@pytest.fixture(scope="module")
def slope(tmp_path_factory):
    """A diagnosis, on the command line, of a floor that leans."""
    from generator import Case, make

    folder = tmp_path_factory.mktemp("slope")
    make(folder / "study", Case("one", {"floor_slope": {"x": 0.004, "y": 0.0}}), 5, 3, 4.0)
    code = main(["diagnose", str(folder / "study"), "--out", str(folder / "out")])
    return code, folder / "out"


def test_a_slope_is_found_with_its_size(slope):
    code, out = slope
    found = json.loads((out / "diagnosis.json").read_text())
    assert code == 0
    names = [e["name"] for e in found["effects"]] + [n for g in found["alternatives"] for n in g]
    assert found["verdict"] in ("named", "ambiguous")
    assert "floor_slope" in names
    assert found["gap"]["after"] < 0.5 * (found["gap"]["before"] + 1.0)


def test_the_corrected_chair_rolls_and_the_report_opens_offline(slope):
    _, out = slope
    model = mujoco.MjModel.from_xml_path(str(out / "model.xml"))
    assert model.nsensor
    page = (out / "report.html").read_text()
    assert "data:image/png;base64," in page
    assert "http://" not in page and "https://" not in page
    assert not (out / "unfinished").exists()


def test_no_effect_is_not_named(tmp_path):
    from generator import Case, make

    import mjchair

    make(tmp_path, Case("none"), 6, 3, 4.0)
    assert mjchair.diagnose(tmp_path).verdict == "none"


def test_bad_input_is_one_line(tmp_path, capsys):
    assert main(["diagnose", str(tmp_path), "--out", str(tmp_path / "out")]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_reduced_gain_is_that_of_least_squares():
    rng = np.random.default_rng(0)
    columns, r = rng.standard_normal((50, 3)), rng.standard_normal(50)
    reduced = Reduced(["a", "b", "c"], columns.T @ columns, columns.T @ r)
    fit = np.linalg.lstsq(columns[:, :2], r, rcond=None)[0]
    left = r - columns[:, :2] @ fit
    assert reduced.gain([0, 1]) == pytest.approx(r @ r - left @ left, rel=1e-6)


def test_noise_covariance_is_that_of_white_and_correlated_noise():
    noise = Noise(0.3, 0.4, 0.1, "given")
    covariance = noise.covariance(np.array([0.0, 0.1]))
    assert covariance[0, 0] == pytest.approx(0.25)
    assert covariance[0, 1] == pytest.approx(0.16 * np.exp(-1.0))
