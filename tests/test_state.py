"""Two runs from the same integration state are equal to the bit, through any door."""

import mujoco
import numpy as np
import pytest
from conftest import roll, slalom
from mujoco import batch, rollout

import mjchair

INTEGRATION = mujoco.mjtState.mjSTATE_INTEGRATION
FULLPHYSICS = mujoco.mjtState.mjSTATE_FULLPHYSICS


@pytest.fixture(autouse=True)
def native():
    mjchair.install()


@pytest.fixture
def reference(manual):
    states = roll(manual, slalom(manual))
    assert np.ptp(states[:, 1]) > 0.5 and np.ptp(states[:, 2]) > 0.05, "it should have gone round"
    return states


@pytest.mark.parametrize("nthread", [1, 2])
def test_batch_is_mj_step(manual, reference, nthread):
    control = slalom(manual)
    many = batch.Batch(manual, nsim=3, nthread=nthread)
    many.reset(stage=mujoco.mjtStage.mjSTAGE_NONE)
    for row, expected in zip(control, reference, strict=True):
        many.ctrl = row
        many.step()
        for sim in range(3):
            assert np.array_equal(many.qpos[sim], expected[1 : 1 + manual.nq])
    assert np.array_equal(many.act[2], reference[-1][1 + manual.nq + manual.nv :][: manual.na])


@pytest.mark.parametrize("nthread", [0, 2])
def test_rollout_is_mj_step(manual, reference, nthread):
    start = np.empty(mujoco.mj_stateSize(manual, FULLPHYSICS))
    fresh = mujoco.MjData(manual)
    mujoco.mj_getState(manual, fresh, start, FULLPHYSICS)
    data = [mujoco.MjData(manual) for _ in range(max(nthread, 1))]
    with rollout.Rollout(nthread=nthread) as runner:
        states, _ = runner.rollout(manual, data, np.tile(start, (4, 1)), slalom(manual))
    for state in states:
        assert np.array_equal(state, reference)


def test_saved_xml_is_the_same_chair(manual_spec, manual, reference):
    again = mujoco.MjModel.from_xml_string(manual_spec.to_xml())
    assert np.array_equal(roll(again, slalom(again)), reference)


@pytest.mark.parametrize(("scene", "grade"), [("ramp", 1 / 12), ("cross_slope", 0.0777)])
def test_saved_xml_of_a_slope_is_the_same(scene, grade):
    spec = mjchair.load_spec(scene=scene, grade=grade)
    first = spec.compile()
    again = mujoco.MjModel.from_xml_string(spec.to_xml())
    control = slalom(first, 300)
    assert np.array_equal(roll(first, control), roll(again, control))


def columns(model, prefix):
    """Positions and activations of one chair in a model with others."""
    joints = [j for j in range(model.njnt) if model.joint(j).name.startswith(prefix)]
    qpos = np.concatenate(
        [model.jnt_qposadr[j] + np.arange(7 if model.jnt_type[j] == 0 else 1) for j in joints]
    )
    tires = [a for a in range(model.nactuator) if model.actuator(a).name.startswith(prefix)]
    act = np.concatenate(
        [model.actuator_actadr[a] + np.arange(4) for a in tires if model.actuator_actnum[a]]
    )
    return 1 + qpos, 1 + model.nq + model.nv + act


@pytest.mark.parametrize("prefix", ["a/", "chair1_"])
def test_names_are_found_behind_any_prefix(prefix):
    parent = mujoco.MjSpec()
    parent.attach(mjchair.load_spec("manual"), prefix=prefix, frame=parent.worldbody.add_frame())
    run = mjchair.simulate(parent.compile(), {"left_wheel": 5.0, "right_wheel": 5.0}, 0.3)
    assert run["position.x"][-1] > 0.0


def test_attached_under_a_prefix_is_the_same_chair(manual, reference):
    parent = mujoco.MjSpec()
    parent.option.timestep = manual.opt.timestep
    parent.option.integrator = manual.opt.integrator
    parent.option.tolerance = manual.opt.tolerance
    parent.option.cone = manual.opt.cone
    parent.attach(mjchair.load_spec("manual"), prefix="a/", frame=parent.worldbody.add_frame())
    model = parent.compile()
    states = roll(model, slalom(model, prefix="a/"))
    for mine, theirs in zip(columns(model, "a/"), columns(manual, ""), strict=True):
        assert np.array_equal(states[:, mine], reference[:, theirs])


def test_attached_by_pymjcf_is_the_same_chair(manual_spec, manual, reference):
    from dm_control import mjcf

    root = mjcf.RootElement(model="world")
    chair = mjcf.from_xml_string(manual_spec.to_xml(), escape_separators=True)
    chair.model = "a"
    for field in ("timestep", "integrator", "tolerance", "cone"):
        setattr(root.option, field, getattr(chair.option, field))
    chair.find("geom", "floor").remove()
    root.worldbody.add(
        "geom", name="floor", type="plane", size=(0, 0, 0.5), friction=(0.7, 0.005, 0.0001)
    )
    chair.find("joint", "chair").remove()  # PyMJCF wants the free joint on the frame it attaches
    root.attach(chair).add("freejoint", name="chair")
    model = mujoco.MjModel.from_xml_string(root.to_xml_string(precision=17), root.get_assets())
    states = roll(model, slalom(model, prefix="a/"))
    for mine, theirs in zip(columns(model, "a/"), columns(manual, ""), strict=True):
        assert np.array_equal(states[:, mine], reference[:, theirs])


def interrupted(model, control, spec, forwards=0):
    """The run stopped after every 100 steps, and gone on with in a fresh MjData."""
    states, data = [], mujoco.MjData(model)
    for start in range(0, len(control), 100):
        states.append(roll(model, control[start : start + 100], data))
        kept = np.empty(mujoco.mj_stateSize(model, spec))
        mujoco.mj_getState(model, data, kept, spec)
        data = mujoco.MjData(model)
        mujoco.mj_setState(model, data, kept, spec)
        for _ in range(forwards):
            mujoco.mj_forward(model, data)
    return np.concatenate(states)


def test_resumed_from_the_integration_state(manual, reference):
    assert np.array_equal(interrupted(manual, slalom(manual), INTEGRATION), reference)


def test_resumed_from_full_physics_differs_by_the_warm_start_only(manual, reference):
    found = interrupted(manual, slalom(manual), FULLPHYSICS)
    assert np.abs(found - reference).max() < 1e-7


def test_forward_in_between_changes_no_trajectory(manual, reference):
    found = interrupted(manual, slalom(manual), INTEGRATION, forwards=3)
    assert np.abs(found - reference).max() < 1e-7


def test_keyframe_keeps_deflections(manual_spec, manual):
    data = mujoco.MjData(manual)
    roll(manual, slalom(manual, 400), data)
    spec = mujoco.MjSpec.from_string(manual_spec.to_xml())
    spec.add_key(name="moving", time=data.time, qpos=data.qpos, qvel=data.qvel, act=data.act)
    model = mujoco.MjModel.from_xml_string(_compiled_xml(spec))
    again = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, again, 0)
    assert np.array_equal(again.act, data.act)
    control = slalom(manual, 600)[400:]
    found = roll(model, control, again)
    assert np.abs(found - roll(manual, control, data)).max() < 1e-7


def _compiled_xml(spec):
    spec.compile()
    return spec.to_xml()


def test_two_different_chairs_do_not_disturb_each_other(manual, reference):
    power = mjchair.load_spec("power").compile()
    alone = roll(power, slalom(power, 300))
    a, b = mujoco.MjData(manual), mujoco.MjData(power)
    first, second = slalom(manual, 300), slalom(power, 300)
    for k in range(300):
        got = roll(manual, first[k : k + 1], a)
        other = roll(power, second[k : k + 1], b)
        assert np.array_equal(got[0], reference[k])
        assert np.array_equal(other[0], alone[k])


UNTIRED = """
<mujoco>
  <worldbody>
    <geom type="plane" size="5 5 1"/>
    <body name="box" pos="0 0 0.2">
      <freejoint/><geom type="box" size="0.1 0.1 0.1" user="7"/>
      <body name="arm" pos="0.1 0 0">
        <joint name="arm" axis="0 1 0"/><geom size="0.05" pos="0.2 0 0"/>
      </body>
    </body>
  </worldbody>
  <actuator><general name="arm" joint="arm" dyntype="user" actdim="4"/></actuator>
  <sensor><user name="mine" objtype="actuator" objname="arm" dim="7" needstage="acc"/></sensor>
</mujoco>
"""


@pytest.mark.parametrize("compiled", [True, False])
def test_a_model_without_tires_is_untouched(compiled):
    model = mujoco.MjModel.from_xml_string(UNTIRED)
    mjchair.uninstall()
    data = mujoco.MjData(model)
    data.xfrc_applied[1] = (1, 2, 3, 0, 0, 0.1)
    without = roll(model, np.ones((200, 1)), data)
    mjchair.install(compiled)
    data = mujoco.MjData(model)
    data.xfrc_applied[1] = (1, 2, 3, 0, 0, 0.1)
    assert np.array_equal(roll(model, np.ones((200, 1)), data), without)
    assert np.array_equal(data.xfrc_applied[1], (1, 2, 3, 0, 0, 0.1))


def test_forces_on_other_bodies_stay_the_users(manual):
    data = mujoco.MjData(manual)
    chair = manual.body("chair").id
    data.xfrc_applied[chair] = (5, 0, 0, 0, 0, 1)
    roll(manual, slalom(manual, 100), data)
    assert np.array_equal(data.xfrc_applied[chair], (5, 0, 0, 0, 0, 1))
