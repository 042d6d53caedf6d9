"""`mjchair diagnose` and `mjchair hide`: what they write, and what they say to bad input."""

import json
import math
import re
import shutil
import signal
import subprocess
import sys
from types import SimpleNamespace

import browser
import mujoco
import numpy as np
import pytest

import mjchair
from mjchair import cli
from mjchair.commands import diagnose
from mjchair.commands.diagnose import CANDIDATE, GAP
from mjchair.diagnosis.replay.cache import Store
from mjchair.diagnosis.replay.simulator import Job, Outcome, Sofar, WindowSimulator
from mjchair.diagnosis.result import Diagnosis, GapSummary, NamedEffect
from mjchair.diagnosis.rules import Verdict
from mjchair.effects.library import find
from mjchair.storage import only_writer

TOP = {  # what outside users rely on
    *("verdict", "effects", "alternatives", "candidates", "gap", "where", "next_experiment"),
    *("probability", "more_missing", "loud", "one_run", "moment", "tipped", "material"),
    *("process", "shaken", "drivers", "notes"),
}
CHANNELS = {"left_wheel_speed": 0.02, "right_wheel_speed": 0.02, "imu_gyro.z": 0.01}


def write_study(folder, coefficient=0.02, seconds=3.0, extra=""):
    """Two coasts, one each way, with rolling resistance that the chair does not have."""
    folder.mkdir(parents=True)
    rng = np.random.default_rng(1)
    spec = mjchair.load_spec()
    find("rolling_resistance").apply(spec, {"coefficient": coefficient})
    lines = ['model = "manual"', *extra.splitlines()]
    for k, heading in enumerate((0.0, math.pi)):
        start = {"speed": 1.4, "heading": heading}
        run = mjchair.simulate(spec, None, seconds, initial=start, sample_rate=50.0)
        noisy = [run[c] + std * rng.standard_normal(run.time.size) for c, std in CHANNELS.items()]
        table = np.column_stack([run.time, *noisy])
        header = ",".join(["time", *CHANNELS])
        np.savetxt(folder / f"coast_{k}.csv", table, "%.6f", ",", header=header, comments="")
        lines += ["[[trial]]", f'file = "coast_{k}.csv"', 'manoeuvre = "coast"']
        lines += ["[trial.initial]", f"heading = {heading}"]
    (folder / "study.toml").write_text("\n".join(lines) + "\n")
    return folder


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """A study that was diagnosed, and where its results are."""
    top = tmp_path_factory.mktemp("diagnose")
    study = write_study(top / "study")
    assert cli.main(["diagnose", str(study), "--out", str(top / "out")]) == 0
    return study, top / "out"


def test_writes_what_it_says(done):
    _, out = done
    names = {p.name for p in out.iterdir()}
    assert {"diagnosis.json", "report.html", "model.xml", "where.png", "compared.png"} <= names
    assert "unfinished" not in names and not [n for n in names if n.startswith(".")]
    for name in (n for n in names if n.endswith(".png")):
        assert (out / name).read_bytes().startswith(b"\x89PNG")


def test_the_first_line_tells_effects_together_from_rivals():
    def line(verdict, *alternatives):
        names = ("floor_slope", "payload")
        effects = [NamedEffect(name=name, parameters={}, closure=1.0) for name in names]
        gap = GapSummary(before=3.0, after=1.0, scope="", p_value=0.0, p_value_after=1.0)
        found = Diagnosis(verdict=verdict, effects=effects, alternatives=alternatives, gap=gap)
        return diagnose._line(found).split(";")[0]

    assert line(Verdict.NAMED) == "named: floor_slope, payload"
    two = line(Verdict.AMBIGUOUS, ["payload", "torque_gain", "none"], ["floor_slope", "toe"])
    assert two == "ambiguous: floor_slope (or toe), payload (or torque_gain or none)"
    both = line(Verdict.AMBIGUOUS, ["floor_slope+payload", "wind"])
    assert both == "ambiguous: floor_slope, payload, or wind for floor_slope+payload"


def test_json_has_the_keys_of_its_contract(done):
    found = json.loads((done[1] / "diagnosis.json").read_text())
    assert set(found) == TOP
    assert found["verdict"] in ("none", "named", "ambiguous", "unknown")
    assert tuple(found["gap"]) == GAP
    assert found["candidates"]
    for candidate in found["candidates"]:
        assert set(candidate) | {"channel"} == set(CANDIDATE)
    for effect in found["effects"]:
        assert {"name", "parameters", "closure", "probability"} <= set(effect)
        assert found["verdict"] != "named" or effect["probability"] >= 0.95
        for parameter in effect["parameters"].values():
            assert set(parameter) == {"value", "std", "unit"}
    for cell in found["where"]:
        assert set(cell) == {"trial", "channel", "window", "regime", "statistic"}


def test_a_gap_this_large_is_seen(done):
    found = json.loads((done[1] / "diagnosis.json").read_text())
    assert found["verdict"] != "none"
    assert found["gap"]["before"] > 1.0


def test_report_opens_offline(done):
    page = (done[1] / "report.html").read_text()
    assert not re.search(r"""(src|href)\s*=\s*(?!"data:)""", page)
    assert not re.search(r"https?://|<script|<link|@import|url\(", page)
    assert page.count("data:image/png;base64,") == len(list(done[1].glob("*.png")))
    assert [int(n) for n in re.findall(r"<h2>(\d)\.", page)] == [1, 2, 3, 4, 5, 6, 7, 8]


@pytest.mark.skipif(browser.program() is None, reason="no Chromium on this machine")
def test_the_report_carries_a_replay_of_a_run(done):
    """Before, after and the measured run in one scene; nothing is asked of the network."""
    with browser.Page(done[1] / "report.html", 900, 700) as page:
        page.value("window.mjchair.ready.then(() => 0)")
        tracks = page.value("mjchair.tracks")
        assert tracks[-1] == "measured" and len(tracks) in (2, 3)
        measured, chair = (
            np.array(page.value(f"mjchair.pose(3, 'chair', {k})"))[:3] for k in (len(tracks) - 1, 0)
        )
        start = np.array(page.value("mjchair.pose(0, 'chair', 0)"))[:3]
        assert np.linalg.norm(measured - start) == pytest.approx(3.0, abs=0.6)  # m, slowing down
        assert np.linalg.norm(measured - chair) < (0.15 if len(tracks) == 3 else 1.5)
        assert page.requests == [] and page.errors == []


def test_the_corrected_chair_rolls(done, tmp_path):
    model = done[1] / "model.xml"
    assert mujoco.MjModel.from_xml_path(str(model)).nu > 0
    out = str(tmp_path / "roll")
    arguments = ["simulate", "--model", str(model), "--duration", "0.2", "--out", out]
    assert cli.main(arguments) == 0


def test_a_second_diagnosis_of_the_corrected_chair_finds_nothing(done, tmp_path):
    study, out = done
    again = tmp_path / "again"
    shutil.copytree(study, again)
    shutil.copy(out / "model.xml", again / "corrected.xml")
    text = (again / "study.toml").read_text()
    (again / "study.toml").write_text(text.replace('"manual"', '"corrected.xml"'))
    assert cli.main(["diagnose", str(again), "--out", str(tmp_path / "out")]) == 0
    found = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    assert found["verdict"] == "none" and not found["effects"]
    assert found["gap"]["before"] < 0.1 * gap_before(out)


def gap_before(out):
    return json.loads((out / "diagnosis.json").read_text())["gap"]["before"]


def test_results_are_not_overwritten(done, capsys):
    study, out = done
    before = {p.name: p.stat().st_mtime_ns for p in out.iterdir()}
    assert cli.main(["diagnose", str(study), "--out", str(out)]) == 2
    assert one_line(capsys) and before == {p.name: p.stat().st_mtime_ns for p in out.iterdir()}


def one_line(capsys) -> str:
    said = capsys.readouterr().err.strip()
    assert said and "\n" not in said and "Traceback" not in said
    return said


def broken_toml(study):
    (study / "study.toml").write_text("model = ")


def no_table(study):
    (study / "coast_1.csv").unlink()


def no_trial(study):
    (study / "study.toml").write_text('model = "manual"\n')


def all_held_out(study):
    text = (study / "study.toml").read_text()
    (study / "study.toml").write_text(text.replace("[trial.", "hold_out = true\n[trial."))


def unknown_model(study):
    text = (study / "study.toml").read_text()
    (study / "study.toml").write_text(text.replace('"manual"', '"manuall"'))


def short_trial(study):
    lines = (study / "coast_0.csv").read_text().splitlines()
    (study / "coast_0.csv").write_text("\n".join(lines[:20]) + "\n")


@pytest.mark.parametrize(
    "spoil", [broken_toml, no_table, no_trial, all_held_out, unknown_model, short_trial]
)
def test_bad_studies_are_one_line_and_nothing_is_written(spoil, done, tmp_path, capsys):
    study = tmp_path / "study"
    study.mkdir()
    for path in done[0].iterdir():
        (study / path.name).write_bytes(path.read_bytes())
    spoil(study)
    assert cli.main(["diagnose", str(study), "--out", str(tmp_path / "out")]) == 2
    assert one_line(capsys).startswith("mjchair: ")
    assert not (tmp_path / "out").exists()


def test_bad_arguments_are_one_line_and_nothing_is_written(done, tmp_path, capsys):
    out = tmp_path / "out"
    for arguments in (
        ["diagnose", str(tmp_path / "nowhere"), "--out", str(out)],
        ["diagnose", str(done[0]), "--out", str(out), "--effect", str(tmp_path / "mine.py")],
        ["hide", "--out", str(out)],
        ["hide", "rolling_resistence", "--out", str(out)],
        ["hide", "rolling_resistance", "--set", "coefficient=9", "--out", str(out)],
        ["hide", "rolling_resistance", "--set", "coefficient=x", "--out", str(out)],
        ["hide", "sensor_bias", "--out", str(out)],
        ["hide", "sensor_bias:imu_gyro.x", "--out", str(out)],
        ["hide", "--reveal", str(tmp_path / "nowhere")],
    ):
        assert cli.main(arguments) == 2, arguments
        assert one_line(capsys)
        assert not out.exists(), arguments
    with pytest.raises(SystemExit):
        cli.main(["diagnose", str(done[0]), "--out", str(out), "--threads", "-1"])
    assert "is no number of processors" in one_line(capsys) and not out.exists()
    with pytest.raises(SystemExit):
        cli.main(["diagnose", str(done[0]), "--out", str(out), "--patience", "0"])
    assert "'0' is no number above 0" in one_line(capsys) and not out.exists()


# a diagnosis that sends itself a signal as soon as it has kept so many simulations
INTERRUPTED = """
import os, signal, sys
from mjchair import cli
from mjchair.diagnosis.replay.cache import Store
from mjchair.diagnosis.replay.simulator import Job, Outcome, Sofar, WindowSimulator
from mjchair.storage import only_writer
number, after = int(sys.argv[1]), int(sys.argv[2])
signal.signal(signal.SIGINT, signal.default_int_handler)  # a background job ignores Ctrl-C
save, saved = Store.save, []

def counted(self, key, arrays):
    save(self, key, arrays)
    saved.append(key)
    if len(saved) == after:
        os.kill(os.getpid(), number)

Store.save = counted
sys.exit(cli.main(sys.argv[3:]))
"""


def interrupted(study, out, number, after):
    """A diagnosis in a process of its own, ended by a signal once it has kept `after` more."""
    arguments = [str(int(number)), str(after), "diagnose", str(study), "--out", str(out)]
    return subprocess.run(
        [sys.executable, "-c", INTERRUPTED, *arguments], capture_output=True, text=True
    )


def kept(out):
    return {p.name: p.stat().st_mtime_ns for p in (out / "unfinished").glob("[!.]*.npz")}


def test_an_interrupted_run_goes_on_from_what_was_kept(done, tmp_path, monkeypatch):
    study, whole = done
    out = tmp_path / "out"

    ended = interrupted(study, out, signal.SIGINT, 2)
    assert ended.returncode == 130, ended.stderr
    assert ended.stderr.startswith("mjchair: interrupted") and ended.stderr.count("\n") == 1
    first = kept(out)
    assert len(first) >= 2

    ended = interrupted(study, out, signal.SIGKILL, 3)
    assert ended.returncode == -signal.SIGKILL, ended.stderr
    second = kept(out)
    assert first.items() <= second.items()  # none was made again
    assert len(second) == len(first) + 3
    assert {p.name for p in out.iterdir()} == {"unfinished"}

    loaded = set()
    load = Store.load

    def counted(self, key):
        found = load(self, key)
        if found is not None:
            loaded.add(f"{key}.npz")
        return found

    monkeypatch.setattr(Store, "load", counted)
    assert cli.main(["diagnose", str(study), "--out", str(out)]) == 0
    assert set(second) <= loaded
    assert (out / "diagnosis.json").read_text() == (whole / "diagnosis.json").read_text()
    assert not (out / "unfinished").exists()


def test_a_simulation_that_was_cut_short_is_made_again(tmp_path):
    store = Store(tmp_path)
    store.save("a", [np.arange(1000.0), np.ones((2, 2))])
    assert np.array_equal(store.load("a")[0], np.arange(1000.0))
    path = tmp_path / "a.npz"
    for size in (0, 10, 500, path.stat().st_size - 1):
        whole = path.read_bytes()
        path.write_bytes(whole[:size])
        assert store.load("a") is None
        path.write_bytes(whole)


def test_what_was_kept_counts_as_simulated(tmp_path):
    """So a search that was interrupted ends where one that was not does."""
    simulator = SimpleNamespace(
        store=Store(tmp_path),
        stepped=0,
        steps=lambda *_: 500,
        _key=lambda *_: "a",
        _simulate=lambda jobs, _: [Outcome(np.ones(3)) for _ in jobs],
    )
    jobs = [Job(None, None, None), Job(None, None, None, sofar=Sofar(200, None, None))]
    for times in (1, 2):
        WindowSimulator.run(simulator, jobs)
        assert simulator.stepped == 800 * times


def test_two_diagnoses_do_not_write_into_one_folder(done, tmp_path, capsys):
    study, _ = done
    out = tmp_path / "out"
    with only_writer(out / "unfinished"):
        assert cli.main(["diagnose", str(study), "--out", str(out)]) == 2
        assert {p.name for p in (out / "unfinished").iterdir()} == {"lock"}
    assert capsys.readouterr().err == (
        f"mjchair: another mjchair writes into {out}; wait until it ends, or choose another --out\n"
    )
