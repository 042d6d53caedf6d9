"""The workflow on hidden effects, made by the generator of benchmarks/blind."""

import json
from dataclasses import replace
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest
from scipy.optimize import lsq_linear

import mjchair
from mjchair.cli import main
from mjchair.diagnosis import decide, rules
from mjchair.diagnosis.diagnose import diagnose
from mjchair.diagnosis.explain import event
from mjchair.diagnosis.fit import bounded
from mjchair.diagnosis.fit.bench import Bench
from mjchair.diagnosis.fit.column_ids import RoughlyKnown
from mjchair.diagnosis.fit.system import System
from mjchair.diagnosis.replay.chair_state import Chair, State
from mjchair.diagnosis.replay.simulator import WindowSimulator
from mjchair.diagnosis.replay.window_states import track
from mjchair.effects.library import find
from mjchair.simulation.initial import Initial, start
from mjchair.simulation.inputs import Inputs

SLOPE = 0.004  # rise over run
DIAGNOSES = []  # what the command found, as objects


@pytest.fixture(scope="module")
def slope(tmp_path_factory):
    """A diagnosis, on the command line, of a floor that leans."""
    from generator import Case, make

    folder = tmp_path_factory.mktemp("slope")
    make(folder / "study", Case("one", {"floor_slope": {"x": SLOPE, "y": 0.0}}), 5, 3, 4.0)
    with pytest.MonkeyPatch.context() as patch:

        def kept(*args, **options):
            DIAGNOSES.append(diagnose(*args, **options))
            return DIAGNOSES[-1]

        patch.setattr("mjchair.diagnosis.diagnose.diagnose", kept)
        code = main(["diagnose", str(folder / "study"), "--out", str(folder / "out")])
    return code, folder / "out"


def test_the_gap_after_is_what_the_corrected_chair_leaves(slope):
    """model.xml simulated on the same windows, with nothing moved but biases of sensors."""
    told = json.loads((slope[1] / "diagnosis.json").read_text())["gap"]["after"]
    stages = DIAGNOSES[-1].stages
    bench, fitted = stages.base.bench, stages.choice.fitted
    spec = mujoco.MjSpec.from_file(str(slope[1] / "model.xml"))
    simulator = WindowSimulator(replace(bench.simulator.study, spec=spec))
    again = track(simulator, simulator.base, bench.noise, before=fitted.track)
    left = Bench(simulator, bench.noise, bench.nuisances, bench.process)
    system = left.system(again, stages.base.nuisances, len(stages.base.nuisances), fitted.variant)
    system.set_cells(fitted.step[: system.nuisance])
    cells = [system.cells[i] for i in bench.windows]
    rms = np.sqrt(sum(c.total for c in cells) / sum(c.total_dof for c in cells))
    assert told == pytest.approx(rms, rel=0.02)
    assert told < 1.3  # a chair that was not corrected leaves more
    assert DIAGNOSES[-1].gap.before > 1.5 * told


def test_a_slope_is_found_with_its_size(slope):
    code, out = slope
    found = json.loads((out / "diagnosis.json").read_text())
    assert code == 0
    names = [e["name"] for e in found["effects"]] + [n for g in found["alternatives"] for n in g]
    assert found["verdict"] in ("named", "ambiguous")
    assert "floor_slope" in names
    assert found["gap"]["after"] < 0.5 * (found["gap"]["before"] + 1.0)


def test_a_slope_that_every_run_shows_is_no_event(slope):
    stages = DIAGNOSES[-1].stages
    brings = event.largest(stages.base).gain
    assert brings > 0.0
    assert not rules.happened_once(event=brings, gain=stages.choice.hypothesis.gain)


def test_the_corrected_chair_rolls_on_as_on_the_slope(slope):
    """Along the slope the corrected chair loses the speed that gravity takes, whatever its name."""
    chairs = (mjchair.load_spec(), mujoco.MjSpec.from_file(str(slope[1] / "model.xml")))
    ends = [
        mjchair.simulate(chair, None, 1.0, initial={"speed": 1.5})["velocity.x"][-1]
        for chair in chairs
    ]
    assert ends[0] - ends[1] == pytest.approx(SLOPE * 9.81, rel=0.25)


def test_the_report_opens_offline(slope):
    _, out = slope
    page = (out / "report.html").read_text()
    assert "data:image/png;base64," in page
    assert "http://" not in page and "https://" not in page
    assert not (out / "unfinished").exists()


def test_no_effect_is_not_named(tmp_path):
    from generator import Case, make

    make(tmp_path, Case("none"), 6, 3, 4.0)
    assert mjchair.diagnose(tmp_path).verdict == "none"


def test_bad_input_is_one_line(tmp_path, capsys):
    assert main(["diagnose", str(tmp_path), "--out", str(tmp_path / "out")]) == 2
    assert capsys.readouterr().err.count("\n") == 1


@pytest.mark.parametrize("size", [0.3, 20.0])  # nuisances within their walls, and on them
def test_reduced_gain_is_that_of_bounded_least_squares(size):
    rng = np.random.default_rng(0)
    columns = rng.standard_normal((50, 5))
    r = columns @ np.array([size, -size, 0.2, 1.0, -2.0]) + rng.standard_normal(50)
    back = np.array([0.5, -1.0, 0.2])
    ids = [RoughlyKnown(name) for name in ("n0", "n1", "n2", "a", "b")]
    G, b, c = columns.T @ columns, columns.T @ r, r @ r
    system = System(
        columns=ids,
        nuisance=3,
        G=G[None],
        b=b[None],
        c=np.array([c]),
        run=np.zeros(1, int),
        back=back,
    )
    reduced = bounded.reduce(system, [0])

    def best(count):
        """Chi2 with the priors of the nuisances, which may not pass their walls."""
        prior = np.hstack([np.eye(3), np.zeros((3, count))])
        a = np.vstack([columns[:, : 3 + count], prior])
        wall = np.r_[np.full(3, bounded.WALL), np.full(count, np.inf)]
        off = np.r_[back, np.zeros(count)]
        found = lsq_linear(a, np.r_[r, -back], (-wall - off, wall - off), tol=1e-14)
        return 2.0 * found.cost

    assert (np.abs(bounded.solve(system, [0], [])[0][:3] + back) > 2.999).any() == (size > 1.0)
    assert reduced.total == pytest.approx(best(0), rel=1e-6)
    assert reduced.gain([0, 1]) == pytest.approx(best(0) - best(2), rel=1e-5)
    assert bounded.solve(system, [0], [3, 4])[1] == pytest.approx(best(2), rel=1e-6)


def test_the_phase_of_a_stroke_grows_by_a_turn_a_stroke():
    from mjchair.diagnosis.replay.strokes import phase as stroke_phase

    time = np.arange(0.0, 6.0, 0.01)
    torque = np.maximum(0.0, np.sin(2.0 * np.pi * time / 1.2)) ** 2
    inputs = Inputs(time, {"left_wheel": 9.0 * torque, "right_wheel": 8.0 * torque})
    at, phase = stroke_phase(SimpleNamespace(trial=SimpleNamespace(inputs=inputs)))
    turns = np.diff(phase[1:-1]) / (2.0 * np.pi)
    np.testing.assert_allclose(turns, 1.0)
    np.testing.assert_allclose(np.diff(at[1:-1]), 1.2, atol=0.011)
    assert np.isnan(phase[[0, -1]]).all()
    noise = 0.35 * np.random.default_rng(0).standard_normal((2, time.size))
    coast = Inputs(time, {"left_wheel": noise[0], "right_wheel": noise[1]})
    at, phase = stroke_phase(SimpleNamespace(trial=SimpleNamespace(inputs=coast)))
    assert np.isnan(phase).all()
    nothing = SimpleNamespace(trial=SimpleNamespace(inputs=None))
    assert np.isnan(stroke_phase(nothing)[1]).all()


def test_a_chair_with_a_smaller_wheel_begins_at_rest_on_it():
    spec = mjchair.load_spec()
    base = spec.copy().compile()
    find("wheel_radius").apply(spec, {"left": -0.004, "right": 0.0})
    model = spec.compile()
    chair = Chair(base)
    with mjchair.installed():
        rests = [chair.rest(m) for m in (base, model)]
        data = start(base, Initial())
        state = State(data.qpos.copy(), data.qvel.copy(), data.act.copy())
        lowered = chair.lowered(state, *rests)
        falls = [_falls(model, s) for s in (state, lowered)]
    assert falls[0] > 1.0 > 10.0 * falls[1]  # m/s^2
    back = chair.lowered(lowered, *rests[::-1])
    np.testing.assert_allclose(back.qpos, state.qpos, atol=1e-12)


def _falls(model, state):
    """The largest acceleration (m/s^2) of a chair that is let go in a state."""
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:], data.act[:] = state.qpos, state.qvel, state.act
    mujoco.mj_forward(model, data)
    return np.abs(data.qacc[2])


def test_a_phase_is_reported_within_half_a_turn():
    parameters = {p.name: p for p in find("rider_motion").parameters}
    assert decide._shown(parameters["phase"], -3.335) == pytest.approx(2.0 * np.pi - 3.335)
    assert decide._shown(parameters["frequency"], 4.0) == 4.0
    assert decide._shown(find("camber").parameters[0], 4.0) == 4.0  # rad, but of a geometry
