"""The benchmark of the closed loop: its generator makes what a proposal says, and it counts right.

The loop itself takes minutes a case; here stand its parts.
"""

from types import SimpleNamespace

import loop
import mujoco
import numpy as np
import pytest
from generator import STEP, Case, World, add_trial, make, run
from generator import Manoeuvre as Made

import mjchair
from mjchair.diagnosis.data import first_state
from mjchair.diagnosis.data.study_file import read_study
from mjchair.diagnosis.next_experiment.manoeuvres import LIBRARY, LOAD, setting
from mjchair.effects.library import find
from mjchair.model.load import loaded

BY_NAME = {m.name: m for m in LIBRARY}
SEED, NOTHING = 7, Case("none")


@pytest.fixture
def study(tmp_path):
    """A coast, pushes and a slalom, with nothing hidden."""
    make(tmp_path, NOTHING, SEED, trials=3, seconds=2.0, held=None)
    return tmp_path


@pytest.mark.parametrize("name", ["coast reversed", "driven spin", "loaded coast in a turn"])
def test_the_generator_makes_what_is_proposed(study, name):
    man = BY_NAME[name]
    before = read_study(study)
    here = setting(before)
    stages = SimpleNamespace(base=SimpleNamespace(bench=SimpleNamespace(simulator=SimpleNamespace(
        study=before))))  # fmt: skip
    plan = SimpleNamespace(best=SimpleNamespace(manoeuvre=man))
    loop.perform(study, NOTHING, SEED, SimpleNamespace(stages=stages), plan, 1)
    after = read_study(study)
    made, asked = after.runs[-1], here.initial(man)
    assert len(after.runs) == len(before.runs) + 1 and made.manoeuvre == name
    begins = first_state.initial(made, after.axle)
    assert np.hypot(*np.subtract(begins.position, asked.position)) < 5.0 * loop.PLACE
    turned = np.angle(np.exp(1j * (begins.heading - asked.heading)))
    assert abs(turned) < 5.0 * loop.HEADING
    assert begins.speed == pytest.approx(asked.speed, rel=5.0 * loop.SPEED, abs=0.05)
    assert begins.yaw_rate == pytest.approx(asked.yaw_rate, rel=5.0 * loop.SPEED, abs=0.1)
    assert made.load == man.load
    inputs = made.trial.inputs
    most = 0.0 if inputs is None else max(np.abs(v).max() for v in inputs.controls.values())
    assert most == pytest.approx(here.largest(man), rel=1e-3)


def test_a_further_trial_is_of_the_same_chair_with_other_noise(study):
    coast = Made("coast", 0.0, 1.8)
    for nth in (1, 2):
        add_trial(study, NOTHING, SEED, coast, 2.0, nth)
    one, two = (r.trial.channels["position.x"] for r in read_study(study).runs[-2:])
    apart = one - two
    assert 0.01 < np.nanstd(apart) < 0.02  # two runs with 0.01 m of noise
    assert abs(np.nanmean(apart)) < 0.006


def test_the_loads_of_generator_and_library_are_one():
    world = World(None, {})
    theirs = loaded(world.m, LOAD)
    world.load(LOAD.mass, LOAD.height)
    c = world.chair
    assert world.m.body_mass[c] == pytest.approx(theirs.body_mass[c])
    assert world.m.body_ipos[c] == pytest.approx(theirs.body_ipos[c])
    assert sorted(world.m.body_inertia[c]) == pytest.approx(sorted(theirs.body_inertia[c]))


def test_rolling_resistance_of_generator_and_library_slow_a_spin_alike():
    spec = mjchair.load_spec()
    find("rolling_resistance").apply(spec, {"coefficient": 0.01})
    theirs = World(None, {})
    theirs.m = spec.compile()
    theirs.m.opt.timestep, theirs.m.opt.integrator = STEP, mujoco.mjtIntegrator.mjINT_EULER
    spin = Made("spin", 0.0, 0.0, 1.5)
    worlds = (World(None, {}), World(None, {"rolling_resistance": {"coefficient": 0.01}}), theirs)
    free, ours, known = (run(w, spin, 1.5)[0]["imu_gyro.z"][-1] for w in worlds)
    assert free - known > 0.1
    assert free - ours == pytest.approx(free - known, rel=0.05)


def line(number, *verdicts):
    """A made-up case with rolling resistance hidden: verdicts as (word, effects, alternatives)."""
    said = [
        {"verdict": word, "effects": [{"name": n} for n in names], "alternatives": others,
         "seconds": 1.0}
        for word, names, others in verdicts
    ]  # fmt: skip
    experiment = {"manoeuvre": "coast", "promised": [4.0], "shown": [2.0]}
    answer = {"kind": "one", "hidden": {"rolling_resistance": {}}, "channel": "", "reached": {}}
    return {"number": number, "answer": answer, "diagnoses": said,
            "experiments": [experiment] * (len(said) - 1)}  # fmt: skip


def test_the_table_counts_loops_that_close():
    rolling, toe = "rolling_resistance", "toe"
    open_ = ("ambiguous", [rolling], [[rolling, toe]])
    unsure, closed = ("ambiguous", [rolling], []), ("named", [rolling], [])
    lines = [
        line(0, closed),
        line(1, open_, closed),
        line(2, open_, open_, closed),
        line(3, open_, ("named", [toe], [])),
        line(4, unsure, closed),
        line(5, ("ambiguous", [toe], [])),
    ]
    rows = dict(
        (cells[1], cells[3])
        for cells in ([c.strip() for c in row.split("|")] for row in loop.table(lines).split("\n"))
        if len(cells) == 5
    )
    assert rows["right name alone at once"] == "1 of 6"
    assert rows["ambiguous, with the truth in the set"] == "4 of 6"
    assert rows["of those: right name alone after one experiment"] == "2 of 4"
    assert rows["right name alone after two"] == "3 of 4"
    assert rows["ambiguous, with others in the set: alone after one"] == "1 of 3"
    assert rows["a wrong name after them"] == "1 of 4"
    assert rows["sigmas shown over sigmas promised, median and middle half"].startswith("0.50 ")
    assert not loop.goes_on(lines[3], 2) and not loop.goes_on(lines[5], 2)
    assert loop.goes_on(line(6, open_), 1) and not loop.goes_on(line(6, open_, open_), 1)
