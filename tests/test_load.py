"""A load that was strapped to the chair for some of a study's runs."""

import mujoco
import numpy as np
import pytest

import mjchair
from mjchair.diagnosis.data.study import Run, make_study
from mjchair.diagnosis.data.study_file import read_study
from mjchair.diagnosis.replay import noise
from mjchair.diagnosis.replay.simulator import WindowSimulator
from mjchair.diagnosis.replay.window_states import track
from mjchair.engine.install import installed
from mjchair.errors import MjchairError
from mjchair.measurement.trial import Trial
from mjchair.model.load import Load, loaded, strap
from mjchair.simulation.initial import Initial
from mjchair.simulation.inputs import push_strokes

LOAD = Load(mass=15.0, height=0.55, forward=0.1)
CHANNELS = ("left_wheel_speed", "right_wheel_speed", "imu_gyro.z", "imu_accelerometer.x")


def carrying(model="manual", load=LOAD):
    """A specification whose chair has the load in it."""
    spec = mjchair.load_spec(model)
    strap(spec, load)
    return spec


def test_a_load_moves_the_centre_of_mass_as_a_lever_does():
    body, more = (carrying(load=Load(m, 0.5, 0.2)).compile().body("chair") for m in (1e-9, 20.0))
    mass, centre = float(body.mass[0]), body.ipos
    assert more.mass[0] == pytest.approx(mass + 20.0)
    assert more.ipos == pytest.approx((mass * centre + 20.0 * np.r_[0.2, 0.0, 0.5]) / (mass + 20.0))


@pytest.mark.parametrize("model", ["manual", "power"])
def test_a_loaded_model_is_that_of_a_chair_with_the_mass_in_it(model):
    plain = mjchair.load_spec(model).compile()
    before = bytes(plain.body_mass), bytes(plain.body_ipos)
    one, other = loaded(plain, LOAD), carrying(model).compile()
    assert before == (bytes(plain.body_mass), bytes(plain.body_ipos))
    for name in ("body_mass", "body_ipos", "body_subtreemass", "dof_invweight0", "dof_M0"):
        assert getattr(one, name) == pytest.approx(getattr(other, name), abs=1e-9), name
    states = []
    for made in (one, other):
        data = mujoco.MjData(made)
        data.qvel[:6] = 0.3, -0.2, 0.1, 0.4, -0.5, 0.6
        with installed():
            for _ in range(50):
                mujoco.mj_step(made, data)
        states.append(np.r_[data.qpos, data.qvel, data.geom_xpos.ravel(), data.site_xpos.ravel()])
    assert states[0] == pytest.approx(states[1], abs=1e-9)


@pytest.fixture(scope="module")
def pushed():
    """Trials without noise, driven alike: the chair as it is, and with the load."""
    inputs = push_strokes({"left_wheel": 12.0, "right_wheel": 10.0}, 3.0)
    out = []
    for spec in (mjchair.load_spec("manual"), carrying()):
        run = mjchair.simulate(spec, inputs, 3.0, initial={"speed": 0.8}, sample_rate=100.0)
        measured = {c: np.asarray(run.channels[c]) for c in CHANNELS}
        out.append(Trial(f"run_{len(out)}", run.time, measured, inputs, {}))
    return out


def left_over(trials, loads):
    """Largest misfit of each run: wheel speeds in rad/s, gyro in rad/s, accelerometer in m/s^2."""
    runs = [
        Run(trial, "push", False, Initial(speed=0.8), frozenset({"speed"}), load)
        for trial, load in zip(trials, loads, strict=True)
    ]
    study = make_study(mjchair.load_spec("manual"), runs, dict.fromkeys(CHANNELS, 0.01))
    simulator = WindowSimulator(study, threads=1)
    found = track(simulator, simulator.base, noise.estimate(study))
    out = [0.0, 0.0]
    for w, predicted in zip(simulator.windows, found.predicted, strict=True):
        out[w.run] = max(out[w.run], np.abs(predicted - simulator.measured(w)).max())
    return out


def test_a_run_is_replayed_with_its_own_load(pushed):
    right = left_over(pushed, (None, LOAD))
    assert max(right) < 1e-4  # 2e-7 without a load, 3e-6 with it
    wrong = left_over(pushed, (LOAD, None))
    assert min(wrong) > 0.01


def study(folder, load):
    """A study folder of one coast, with what is told of its load."""
    time = np.arange(0.0, 2.0, 0.02)
    rows = "\n".join(f"{t:.3f},{5.0 - 0.1 * t:.5f}" for t in time)
    (folder / "a.csv").write_text(f"time,left_wheel_speed\n{rows}\n")
    (folder / "study.toml").write_text(f'[[trial]]\nfile = "a.csv"\n[trial.load]\n{load}\n')
    return folder


def test_study_toml_tells_it(tmp_path):
    read = read_study(study(tmp_path, "mass = 15\nheight = 0.55\nforward = 0.1"))
    assert read.runs[0].load == LOAD


@pytest.mark.parametrize(
    ("load", "line"),
    [
        ("mass = -2\nheight = 0.5", "load mass is -2; it must be positive"),
        ("mass = 2000\nheight = 0.5", "load mass is 2000; it must be a number of at most 250"),
        ("mass = 2\nheight = 55", "load height is 55; it must be a number of at most 2"),
        ("mass = 2\nheight = 0.5\nahead = 1", "unknown key 'ahead' in load"),
        ("mass = 2", "load has no 'height'"),
    ],
)
def test_a_load_that_cannot_be_is_one_line(tmp_path, load, line):
    with pytest.raises(MjchairError, match=line):
        read_study(study(tmp_path, load))
