"""A controller in the loop: what it sees, when it acts, and what happens when it fails."""

import subprocess
import sys

import mujoco
import numpy as np
import pytest

import mjchair


@pytest.fixture(scope="module")
def spec():
    return mjchair.load_spec("power", drive="normal")


def weave(observation):
    """A stick that follows the clock and the gyro."""
    return 0.6, float(
        np.clip(0.5 * np.sin(3.0 * observation["time"]) - observation["imu_gyro.z"], -1, 1)
    )


def test_the_recorded_commands_give_the_same_run(spec):
    run = mjchair.Simulator(spec, rate=50).run(weave, 1.5)
    again = mjchair.simulate(
        spec, mjchair.Inputs(run.time, dict(run.controls), hold=True), float(run.time[-1])
    )
    assert run.channels.keys() == again.channels.keys()
    for name in run.channels:
        assert np.array_equal(run[name], again[name]), name
    assert np.array_equal(run.qpos, again.qpos)


def test_a_controller_sees_the_present_and_acts_at_its_rate(spec):
    seen = []

    def controller(observation):
        seen.append(dict(observation))
        return [0.5 + 0.01 * len(seen), 0.0]

    simulator = mjchair.Simulator(spec, rate=25)
    run = simulator.run(controller, 0.4)
    assert len(seen) == 10 and simulator.period == pytest.approx(0.04)
    for k, observation in enumerate(seen):
        assert observation["time"] == pytest.approx(0.04 * k)
        for name in ("velocity.x", "left_motor.current", "left_wheel_tire.Fx"):
            at = np.searchsorted(run.time, 0.04 * k - 1e-9)
            # forces belong to the command that was there before the controller's new one
            if name == "velocity.x":
                assert observation[name] == run[name][at]
    assert np.unique(run["joystick_x"]).size == 10


def test_delay_quantum_and_loss(spec):
    late = mjchair.Simulator(spec, rate=50, commands=mjchair.Link(delay=0.05))
    run = late.run(lambda o: (0.7, 0.0), 0.3)
    first = run.time[np.flatnonzero(run["joystick_x"])[0]]
    assert first == pytest.approx(0.05, abs=0.002)

    coarse = mjchair.Simulator(spec, rate=50, commands=mjchair.Link(quantum=0.25))
    run = coarse.run(lambda o: (min(1.0, o["time"]), 0.0), 1.0)
    assert set(np.unique(run["joystick_x"])) <= {0.0, 0.25, 0.5, 0.75, 1.0}

    calls = iter(np.linspace(0.0, 1.0, 200))
    lossy = mjchair.Simulator(spec, rate=50, commands=mjchair.Link(dropped=0.4, seed=3))
    run = lossy.run(lambda o: (next(calls), 0.0), 4.0)
    assert 90 < np.unique(run["joystick_x"]).size < 150

    blind = mjchair.Simulator(spec, rate=50, observations=mjchair.Link(delay=0.1))
    times = []
    blind.run(lambda o: times.append(o["time"]) or (0.0, 0.0), 0.5)
    assert times[:5] == [0.0] * 5 and times[20] == pytest.approx(0.3)


def test_going_on_is_one_recording(spec):
    simulator = mjchair.Simulator(spec, rate=50)
    simulator.run(lambda o: (0.5, 0.0), 0.2)
    run = simulator.run(lambda o: {"joystick_y": 0.8}, 0.2)
    whole = mjchair.Simulator(spec, rate=50).run(
        lambda o: (0.5, 0.0 if o["time"] < 0.199 else 0.8), 0.4
    )
    assert np.array_equal(run.qpos, whole.qpos)


def test_a_manual_chair_takes_torques():
    simulator = mjchair.Simulator(mjchair.load_spec("manual"), rate=100, sample_rate=100)
    assert simulator.inputs == ("left_wheel", "right_wheel")
    run = simulator.run(lambda o: np.array([5.0, 5.0]), 0.5)
    assert run["velocity.x"][-1] > 0.1 and run.time.size == 51


def test_in_real_time_it_waits(spec):
    import time

    begin = time.perf_counter()
    mjchair.Simulator(spec, rate=50, real_time=True).run(lambda o: (0.0, 0.0), 0.3)
    assert time.perf_counter() - begin > 0.25


@pytest.mark.parametrize(
    ("command", "words"),
    [
        ((np.nan, 0.0), "gives joystick_x as nan at 0.2 s"),
        ((0.5,), "gives 1 values at 0.2 s; it must give 2: joystick_x, joystick_y"),
        (None, "gives nothing at 0.2 s"),
        ((0.5, "left"), "gives joystick_y as 'left'"),
        ((1.5, 0.0), "gives joystick_x as 1.5 at 0.2 s; a joystick"),
        ({"joystick_z": 1.0}, "did you mean 'joystick_"),
        ({"left_motor": 1.0}, "takes no input"),
        (ZeroDivisionError("by\nzero"), "raised ZeroDivisionError at 0.2 s: by"),
    ],
)
def test_a_bad_controller_keeps_the_recording_up_to_then(spec, command, words):
    def controller(observation):
        if observation["time"] < 0.199:
            return 0.5, 0.0
        if isinstance(command, Exception):
            raise command
        return command

    with pytest.raises(mjchair.ControllerError) as error:
        mjchair.Simulator(spec, rate=50).run(controller, 1.0)
    assert words in str(error.value) and "\n" not in str(error.value)
    assert error.value.recording.time[-1] == pytest.approx(0.2)
    assert error.value.recording["velocity.x"][-1] > 0.0


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"rate": 300.0}, "rate is 300 Hz; the nearest"),
        ({"rate": 0.0}, "rate is 0 Hz"),
    ],
)
def test_bad_options(spec, options, words):
    with pytest.raises(mjchair.MjchairError, match=words):
        mjchair.Simulator(spec, **options)


@pytest.mark.parametrize("numbers", [{"delay": -1.0}, {"dropped": 1.5}, {"quantum": {"a": -1}}])
def test_bad_links(numbers):
    with pytest.raises(mjchair.MjchairError, match="link"):
        mjchair.Link(**numbers)


def test_observing_changes_no_trajectory(spec):
    model = spec.compile()
    mjchair.install()
    seen, unseen = mujoco.MjData(model), mujoco.MjData(model)
    for data in (seen, unseen):
        data.actuator("joystick_x").ctrl[0] = 0.8
    for _ in range(200):
        mujoco.mj_step(model, seen)
        mjchair.observe(model, seen)
        mujoco.mj_step(model, unseen)
    assert np.array_equal(seen.qpos, unseen.qpos)


BAD = """
def controller(observation):
    return (0.5, 0.0) if observation["time"] < 0.5 else (float("nan"), 0.0)
def short(observation):
    return 0.5
"""


def test_at_the_command_line(tmp_path):
    (tmp_path / "mine.py").write_text(BAD)
    run = [sys.executable, "-m", "mjchair", "simulate", "--model", "power", "--profile", "indoor"]

    def called(*arguments):
        return subprocess.run(
            [*run, *arguments], cwd=tmp_path, capture_output=True, text=True, check=False
        )

    first = called("--controller", "mine.py", "--duration", "1", "--out", "a")
    assert first.returncode == 2 and "Traceback" not in first.stderr
    assert "gives joystick_x as nan at 0.5 s" in first.stderr
    kept = mjchair.load_recording(tmp_path / "a" / "recording.npz")
    assert kept.time[-1] == pytest.approx(0.5)
    second = called("--controller", "mine.py:shorter", "--out", "b")
    assert second.returncode == 2 and "did you mean 'short'" in second.stderr
    assert not (tmp_path / "b").exists()


def test_the_same_controller_drives_a_dm_control_environment(spec):
    """From the same start both ways give the same run."""
    from mjchair import tasks

    environment = tasks.load("power_doorway", {"random": 0}, visual_geoms=False)
    environment.reset()
    physics = environment.physics
    model, data = physics.model.ptr, physics.data.ptr
    simulator = mjchair.Simulator(model, rate=50)
    state = mujoco.mjtState.mjSTATE_INTEGRATION
    begin = np.empty(mujoco.mj_stateSize(model, state))
    mujoco.mj_getState(model, data, begin, state)
    mujoco.mj_setState(simulator.model, simulator.data, begin, state)
    simulator.step(weave(mjchair.observe(simulator.model, simulator.data)))
    environment.step(np.array(weave(mjchair.observe(model, data))))
    for _ in range(50):
        environment.step(np.array(weave(mjchair.observe(model, data))))
        simulator.step(weave(simulator.observation()))
    assert data.time > 1.0 and data.site("axle").xpos[0] > 0.1
    assert np.abs(simulator.data.qpos - data.qpos).max() < 1e-9
