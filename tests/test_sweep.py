"""Many chairs: the same results whoever computes them, however often it was interrupted."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import mujoco
import numpy as np
import pytest

import mjchair
from mjchair import sweep
from mjchair.model import assets
from mjchair.model.parameters import ChairParameters
from mjchair.sweep import chunk, fingerprint, measures

SMALL = sweep.Study(
    axes={"axle_position": [0.0, 0.05], "tire_pressure": [0.5, 1.0], "seed": [0, 1]},
    fixed={"push_left": 8.0, "push_right": 6.0, "push_spread": 0.2, "speed": 0.5},
    duration=0.8,
    chunk=3,
)


def rows(table):
    """The rows of a table; NaN as its name, since it is equal to nothing."""
    return [{k: "nan" if v != v else v for k, v in row.items()} for row in table.to_pylist()]


@pytest.fixture(scope="module")
def small():
    return chunk.run_chunk(SMALL, SMALL.cases())


def test_every_combination_is_there_in_order(small):
    assert [row["case"] for row in small] == list(range(8))
    assert len({(r["axle_position"], r["tire_pressure"], r["seed"]) for r in small}) == 8
    assert all(row["status"] == "completed" for row in small)
    assert len({row["end_x"] for row in small}) == 8, "every value should matter"


@pytest.mark.parametrize("threads", [1, 2])
def test_results_do_not_depend_on_threads_or_company(small, threads, tmp_path):
    table = sweep.run(SMALL, tmp_path / "out", threads=threads)
    assert rows(table) == [{k: v for k, v in row.items()} for row in small]
    alone = chunk.run_chunk(SMALL, SMALL.cases()[5:6], 5, threads)
    assert alone == small[5:6]


def test_a_case_is_what_simulate_gives(small):
    """The sweep's short cuts change no bit: against load_spec and simulate."""
    case = SMALL.cases()[3]
    spec = mjchair.load_spec(parameters=ChairParameters(axle_position=0.0, tire_pressure=1.0))
    recording = mjchair.simulate(
        spec, SMALL.drive(case), SMALL.duration, initial={"speed": case["speed"]}
    )
    sensed = measures.Sensed(
        recording.time[:-1],
        {name: values[:-1] for name, values in recording.channels.items()},
        {name: values[:-1] for name, values in recording.controls.items()},
    )
    found = measures.standard(sensed)
    assert {k: small[3][k] for k in found} == found


def test_an_interrupted_sweep_goes_on(small, tmp_path, monkeypatch):
    from mjchair.sweep import runner

    ran = []

    def breaking(study, cases, first=0, threads=0):
        if len(ran) == 2:
            raise KeyboardInterrupt
        ran.append(first)
        return chunk.run_chunk(study, cases, first, threads)

    monkeypatch.setattr(runner, "run_chunk", breaking)
    with pytest.raises(KeyboardInterrupt):
        sweep.run(SMALL, tmp_path / "out")
    assert sorted(p.name for p in (tmp_path / "out/results").iterdir()) == [
        "case-00000000.parquet",
        "case-00000003.parquet",
    ]
    assert len(sweep.read(tmp_path / "out")) == 6
    monkeypatch.setattr(runner, "run_chunk", lambda *a: ran.append(a[2]) or chunk.run_chunk(*a))
    table = sweep.run(SMALL, tmp_path / "out")
    assert ran == [0, 3, 6], "only what was missing"
    assert rows(table) == small


def test_a_folder_of_another_study_is_left_alone(tmp_path):
    study = sweep.Study(axes={"speed": [0.5]}, duration=0.05)
    sweep.run(study, tmp_path / "out")
    other = sweep.Study(axes={"speed": [0.6]}, duration=0.05)
    with pytest.raises(mjchair.MjchairError, match="another study"):
        sweep.run(other, tmp_path / "out")
    assert rows(sweep.run(other, tmp_path / "out", force=True))[0]["speed"] == 0.6
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine/notes.txt").write_text("x")
    with pytest.raises(mjchair.MjchairError, match="not empty"):
        sweep.run(study, tmp_path / "mine")


def test_floors_and_effects_are_axes():
    study = sweep.Study(
        axes={"surface_patch.coefficient": [0.0, 0.03]},
        fixed={"speed": 1.0, "surface_patch.radius": 20.0, "surface_patch.x": 0.0},
        duration=0.5,
    )
    hard, soft = chunk.run_chunk(study, study.cases())
    added = soft["deceleration"] - hard["deceleration"]
    assert added == pytest.approx(0.03 * 9.81, rel=0.15)


def test_an_unstable_case_is_named_and_the_others_stand():
    study = sweep.Study(axes={"torque_left": [1.0, 1e9]}, fixed={"torque_right": 1.0}, duration=0.5)
    fine, broken = chunk.run_chunk(study, study.cases())
    assert (fine["status"], broken["status"]) == ("completed", "unstable")
    assert np.isnan(broken["distance"]) and fine["distance"] > 0.0


def test_scenes_of_different_sizes_share_a_study():
    study = sweep.Study(axes={"scene": ["flat", "kerb"]}, fixed={"speed": 1.0}, duration=0.1)
    found = chunk.run_chunk(study, study.cases())
    assert [row["scene"] for row in found] == ["flat", "kerb"]


@pytest.mark.parametrize(
    ("study", "message"),
    [
        ("axes = {cambre = [0.1]}\nduration = 1.0", "did you mean 'camber'"),
        ("axes = {camber = []}\nduration = 1.0", "no list of values"),
        ("axes = {camber = [9.0]}\nduration = 1.0", "camber is 9 rad"),
        ("axes = {axle_position = [0.0, 0.5]}\nduration = 1.0", "axle_position is 0.5 m"),
        ('axes = {camber = ["3 kg"]}\nduration = 1.0', "its unit must be one of rad, deg"),
        ('axes = {"surface_patch.coefficient" = [99]}\nduration = 1.0', "coefficient is 99; it"),
        ("axes = {torque_left = [0, 3], push_left = [0, 5]}\nduration = 1.0", "both torque_*"),
        ("axes = {seat_height = [0.5, 1.2]}\nduration = 1.0", "seat_height"),
        ('axes = {anti_tippers = [false]}\nfixed = {model = "power"}\nduration = 1.0', "anti_tip"),
        ("axes = {camber = [0.1]}\nduration = -1.0", "duration is -1 s"),
        ("axes = {camber = [0.1]}", "has no 'duration'"),
        ("axes = {camber = [0.1", "not TOML"),
        ('axes = {"toe.wrong" = [0.1]}\nduration = 1.0', "no parameter"),
        ("axes = {speed = [0.1]}\nduration = 1.0\nspeeed = 3", "unknown key 'speeed'"),
        ('axes = {grade = ["8%"]}\nduration = 1.0', "must be a number, such as 0.08"),
        ("axes = {speed = [true]}\nduration = 1.0", "speed is True; it must be a number"),
        ("axes = {model = [3]}\nduration = 1.0", "must be a name or a path"),
        ("axes = {speed = 3}\nduration = 1.0", "no list of values"),
        ('axes = {speed = [0.1]}\nduration = "1 s"', "duration is '1 s'"),
        ('axes = {speed = [0.1]}\nduration = 1.0\nchunk = "x"', "chunk is 'x'"),
        ("axes = {speed = [0.1]}\nduration = 1.0\nfixed = 3", "fixed is 3"),
    ],
)
def test_bad_studies_get_one_line(study, message, tmp_path, capsys):
    from mjchair.cli import main

    path = tmp_path / "study.toml"
    path.write_text(study)
    assert main(["sweep", str(path), "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert message in error and error.count("\n") == 1
    assert not (tmp_path / "out").exists(), "a refused study leaves nothing in the way of the next"


def test_a_refused_study_deletes_no_results(tmp_path, monkeypatch):
    from mjchair.sweep import runner

    def refusing(*given):
        raise mjchair.MjchairError("no such chair")

    fine = sweep.Study(axes={"speed": [0.5]}, duration=0.05)
    before = rows(sweep.run(fine, tmp_path / "out"))
    monkeypatch.setattr(runner, "run_chunk", refusing)
    other = sweep.Study(axes={"speed": [0.6]}, duration=0.05)
    for place, force in (("out", True), ("new", False)):
        with pytest.raises(mjchair.MjchairError, match="no such chair"):
            sweep.run(other, tmp_path / place, force=force)
    assert rows(sweep.read(tmp_path / "out")) == before
    assert not (tmp_path / "new").exists()


def test_text_with_a_unit_is_a_number_in_the_table():
    study = sweep.Study(axes={"camber": ["3deg", 0.1], "anti_tippers": ["no", True]}, duration=0.02)
    found = chunk.run_chunk(study, study.cases())
    assert [row["camber"] for row in found] == pytest.approx([np.radians(3.0)] * 2 + [0.1] * 2)
    assert [float(row["anti_tippers"]) for row in found] == [0.0, 1.0, 0.0, 1.0]


def test_energy_per_what_did_not_happen_is_not_a_number(small):
    study = sweep.Study(axes={"speed": [0.0]}, duration=0.02)
    (still,) = chunk.run_chunk(study, study.cases())
    for name in ("energy_per_metre", "energy_per_radian", "deceleration"):
        assert np.isnan(still[name]) and np.isfinite(small[-1][name])


def test_the_command(tmp_path, capsys):
    from mjchair.cli import main

    path = tmp_path / "study.toml"
    path.write_text("duration = 0.1\n[axes]\nspeed = [0.5, 1.0]\n[fixed]\ncamber = 0.05\n")
    assert main(["sweep", str(path), "--out", str(tmp_path / "out")]) == 0
    assert "2 chairs" in capsys.readouterr().out
    assert len(sweep.read(tmp_path / "out")) == 2


def test_no_scheduler_is_one_line(tmp_path):
    pytest.importorskip("distributed", reason="the extra [dask] is not installed")
    with pytest.raises(mjchair.MjchairError, match="no Dask scheduler at nowhere"):
        sweep.run(SMALL, tmp_path / "out", scheduler="nowhere://x")


def worker(address, name):
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    environment["PYTHONPATH"] = os.pathsep.join(p for p in sys.path if p)
    return subprocess.Popen(
        [
            *(sys.executable, "-m", "distributed.cli.dask_worker", address),
            *("--nthreads", "1", "--no-nanny", "--no-dashboard", "--name", name),
        ],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env=environment,
    )


def test_a_killed_worker_loses_nothing(tmp_path):
    """A real scheduler and two worker processes on the loopback; one is killed at work."""
    distributed = pytest.importorskip("distributed", reason="the extra [dask] is not installed")
    study = sweep.Study(
        axes={"axle_position": [0.0, 0.05], "seed": list(range(8))},
        fixed={"push_left": 8.0, "push_right": 6.0, "push_spread": 0.2},
        duration=4.0,
        chunk=2,
    )
    expected = chunk.run_chunk(study, study.cases())
    with distributed.LocalCluster(
        n_workers=0, host="127.0.0.1", dashboard_address=None, silence_logs=50
    ) as cluster:
        address = cluster.scheduler_address
        workers = [worker(address, name) for name in ("one", "two")]
        try:
            with distributed.Client(address, set_as_default=False) as client:
                client.wait_for_workers(2, timeout=600)
                killed = killer(client, "one", workers[0])
                table = sweep.run(study, tmp_path / "out", scheduler=address)
                assert killed.wait(), "no worker was killed: the test shows nothing"
        finally:
            for process in workers:
                process.kill()
                process.wait()
    assert rows(table) == expected, "a cluster's results are this machine's, to the bit"


def killer(client, name, process):
    """Kill the process of the worker of that name as soon as it has something to compute."""
    import threading

    done = threading.Event()

    known = client.scheduler_info()["workers"]
    address = next(place for place, told in known.items() if told["name"] == name)

    def watch():
        for _ in range(60_000):
            if client.processing().get(address):
                time.sleep(0.05)
                os.kill(process.pid, signal.SIGKILL)
                done.set()
                return
            time.sleep(0.01)

    threading.Thread(target=watch, daemon=True).start()

    class Waiter:
        @staticmethod
        def wait():
            return done.wait(1.0) and process.wait(60) == -signal.SIGKILL

    return Waiter


def test_a_slim_model_is_the_same_chair():
    from mjchair.model.visual_geoms import without_visual_geoms

    spec = mjchair.load_spec()
    states = []
    mjchair.install()
    for model in (spec.compile(), without_visual_geoms(spec).compile()):
        data = mujoco.MjData(model)
        data.ctrl[:2] = 3.0, 5.0
        mujoco.mj_step(model, data, nstep=500)
        states.append(np.concatenate([data.qpos, data.qvel, data.act]))
    assert np.array_equal(*states)


def test_the_study_file_says_what_it_is(tmp_path):
    study = sweep.Study(axes={"speed": [0.5]}, duration=0.05)
    sweep.run(study, tmp_path / "out")
    told = json.loads(Path(tmp_path / "out/study.json").read_text())
    assert told["cases"] == 1 and told["fingerprint"] == study.fingerprint()
    other = sweep.Study(axes={"speed": [0.6]}, duration=0.05).fingerprint()
    assert [k for k in other if other[k] != told["fingerprint"][k]] == [next(iter(other))]


def chair_file(folder):
    """The manual chair in two files, one included by the other, with a tire file of its own."""
    folder.mkdir(exist_ok=True)
    text = (assets.folder() / "manual/manual.xml").read_text()
    (folder / "part.xml").write_text(text)
    (folder / "chair.xml").write_text('<mujoco model="mine"><include file="part.xml"/></mujoco>')
    (folder / "my.toml").write_text((assets.folder() / "tires/wheelchair.toml").read_text())
    return folder


def edit(path, before, after):
    text = path.read_text()
    assert before in text
    path.write_text(text.replace(before, after))


def test_changed_files_are_not_answered_with_old_results(tmp_path):
    """The chair, what it includes, and its tire, changed behind unchanged names."""
    mine = chair_file(tmp_path / "mine")
    study = sweep.Study(
        axes={"speed": [1.0]},
        duration=0.2,
        fixed={"model": str(mine / "chair.xml"), "tire": str(mine / "my.toml")},
    )
    out = tmp_path / "out"
    first = rows(sweep.run(study, out))
    assert rows(sweep.run(study, out)) == first
    edits = [
        (mine / "my.toml", "rolling_resistance = 0.0", "rolling_resistance = 0.1"),
        (mine / "part.xml", 'mass="85"', 'mass="120"'),
    ]
    for path, before, after in edits:
        with pytest.raises(mjchair.MjchairError, match="changed: models, scenes or tires"):
            edit(path, before, after)
            sweep.run(study, out)
        changed = rows(sweep.run(study, out, force=True))
        assert changed[0]["end_x"] != first[0]["end_x"], "in this process as well, no cache answers"
        first = changed


FACTOR = 2.0


def helper(value):
    return FACTOR * value


def measure(power):
    def weighed(sensed):
        return {"x": helper(sensed.channels["position.x"][-1]) ** power}

    return weighed


def test_a_changed_measure_is_another_study(monkeypatch):
    """Its bytecode, what it closes over, what it calls and the values that it reads."""
    base = fingerprint.of_function(measure(1))
    assert base == fingerprint.of_function(measure(1))
    assert base != fingerprint.of_function(measure(2)), "its closure"
    monkeypatch.setattr(sys.modules[__name__], "FACTOR", 3.0)
    assert base != fingerprint.of_function(measure(1)), "a value that a function it calls reads"
    monkeypatch.undo()
    monkeypatch.setattr(sys.modules[__name__], "helper", lambda value: value + 1.0)
    assert base != fingerprint.of_function(measure(1)), "a function that it calls"
    monkeypatch.undo()
    assert base == fingerprint.of_function(measure(1))
    texts = [
        "def f(s): return {'x': 1.0}",
        "def f(s): return {'x': 2.0}",
        "def f(s):\n return {'x': 1.0}",
    ]
    made = []
    for text in texts:
        names = {"__name__": "__main__"}
        exec(text, names)
        made.append(fingerprint.of_function(names["f"]))
    assert made[0] != made[1] and made[0] == made[2], "its lines of text do not matter"


def test_a_fingerprint_is_the_same_in_every_process():
    code = (
        "from mjchair.sweep import fingerprint\n"
        "NAMES = {'a', 'b', 'c', 'd'}\n"
        "def f(s, k={'x', 'y', 'z'}): return {n: 1.0 for n in NAMES if n in {'a', 'b', 'q'}}\n"
        "print(fingerprint.of_function(f))"
    )
    told = {
        subprocess.run(
            [sys.executable, "-c", code],
            env={**os.environ, "PYTHONHASHSEED": seed},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for seed in ("1", "2")
    }
    assert len(told) == 1
