"""The compiled callbacks are held to the plain ones, and install leaves nothing behind."""

import subprocess
import sys

import mujoco
import numpy as np
import pytest
from conftest import roll, slalom

import mjchair
from mjchair.engine import layout, native
from mjchair.engine.views import DATA_VIEWS, MODEL_VIEWS, DataView
from mjchair.model.spec import compile_spec


@pytest.mark.parametrize("tire", [None, "linear", "quadratic", "genta_table1"])
@pytest.mark.parametrize(("scene", "grade"), [("flat", None), ("ramp", 0.1)])
def test_compiled_is_plain(tire, scene, grade):
    model = mjchair.load_spec(scene=scene, grade=grade, tire=tire).compile()
    control = slalom(model, 60)
    runs = []
    for compiled in (True, False):
        mjchair.install(compiled)
        data = mujoco.MjData(model)
        data.qvel[0] = 0.5
        roll(model, control, data)
        runs.append(np.concatenate([data.qpos, data.qvel, data.act, data.sensordata]))
    assert np.abs(runs[0]).max() > 100.0, "loads should be there to compare"
    np.testing.assert_allclose(runs[0], runs[1], rtol=1e-9, atol=1e-9)


def test_install_is_idempotent_and_uninstall_takes_out(manual):
    for _ in range(2):
        mjchair.install()
    assert mujoco.get_mjcb_act_dyn() is not None
    assert mujoco.get_mjcb_control() is None, "the control callback is the user's"
    mjchair.uninstall()
    assert mujoco.get_mjcb_act_dyn() is None and mujoco.get_mjcb_sensor() is None


def test_installed_restores_what_was_there_also_after_an_exception():
    def mine(model, data, actuator):
        return 0.0

    mujoco.set_mjcb_act_dyn(mine)
    with pytest.raises(RuntimeError), mjchair.installed():
        assert mujoco.get_mjcb_act_dyn() is not mine
        raise RuntimeError
    assert mujoco.get_mjcb_act_dyn() is mine


def test_installed_inside_installed(manual):
    mjchair.install()
    with mjchair.installed(compiled=False):
        pass
    states = roll(manual, slalom(manual, 50))
    assert np.abs(states[-1][1:3]).max() > 0.0
    data = mujoco.MjData(manual)
    mujoco.mj_step(manual, data, nstep=50)
    assert data.sensor("left_wheel_tire").data[2] > 100.0


OFFSETS = [
    *(("mjModel", member) for member in layout.MODEL),
    *(("mjData", member) for member in layout.DATA),
    *(("mjPreContact", member) for member in layout.PRE_CONTACT),
]


@pytest.mark.parametrize(("owner", "member"), OFFSETS, ids=lambda name: name)
def test_every_offset_is_checked(monkeypatch, owner, member):
    """A field that lies eight bytes further is noticed, and named alone."""
    real = layout.offset

    def moved(name, field):
        return real(name, field) + (8 if (name, field) == (owner, member) else 0)

    monkeypatch.setattr(layout, "offset", moved)
    with pytest.raises(layout.LayoutError) as refused:
        layout.check.__wrapped__()
    assert f" has {owner}.{member} elsewhere" in str(refused.value)


@pytest.mark.parametrize("member", layout.CONTACT_FIELDS)
def test_every_contact_offset_is_checked(monkeypatch, member):
    class Moved:
        """A contact whose field lies eight bytes further than it does."""

    real = layout.struct
    for name in layout.CONTACT_FIELDS:
        setattr(Moved, name, getattr(real("mjContact"), name))

    class Further:
        size = getattr(Moved, member).size
        offset = getattr(Moved, member).offset + 8

    setattr(Moved, member, Further)
    offset = layout.offset("mjData", "contact")
    monkeypatch.setattr(layout, "struct", lambda name: Moved if name == "mjContact" else real(name))
    monkeypatch.setattr(layout, "offset", lambda *_: offset)
    model = mujoco.MjModel.from_xml_string(layout._PROBE)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert layout._wrong_in_contact(data) == [f"mjContact.{member}"]


def test_the_fields_that_are_read_are_the_fields_that_are_checked():
    """What the compiled callbacks read by offset is what `check` compares."""
    read = {name for view in DATA_VIEWS for name in view._fields if not name.startswith("contact_")}
    assert read < set(layout.DATA)
    options = {"timestep", "gravity", "disableflags"}
    of_model = {name for view in MODEL_VIEWS for name in view._fields} - options
    of_model |= {f"opt.{name}" for name in options}
    assert of_model | set(native.Sizes._fields[:3]) == set(layout.MODEL)
    contact = {n.removeprefix("contact_") for n in DataView._fields if n.startswith("contact_")}
    assert contact == set(layout.CONTACT_FIELDS)


def test_compiled_code_is_found_again_by_another_process():
    mjchair.install()
    code = (
        "from mjchair.engine import native; "
        "print([f.cache_hits for f in (*native.callbacks(), native.field_contact())])"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert set(eval(found.stdout)) == {1}


@pytest.mark.parametrize("way", ["step", "rollout", "batch"])
def test_a_chair_without_its_tires_says_so_once(way):
    """In a process of its own, for the line comes once in a process; not while it compiles."""
    ways = {
        "step": "mujoco.mj_step(model, data, nstep=50)",
        "rollout": "rollout.rollout(model, [data], state, nstep=50)",
        "batch": "b = batch.Batch(model, 4, 2); [b.step() for _ in range(3)]",
    }
    code = f"""
import warnings, mujoco, numpy as np, mjchair
from mujoco import batch, rollout
warnings.simplefilter("always")
model = mjchair.load_spec().compile()
data = mujoco.MjData(model)
state = np.zeros((1, mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)))
mujoco.mj_getState(model, data, state[0], mujoco.mjtState.mjSTATE_FULLPHYSICS)
print("loaded")
{ways[way]}
mjchair.install()
{ways[way]}
mjchair.uninstall()
assert mujoco.get_mjcb_act_dyn() is None
"""
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert told.stderr.count("call mjchair.install() before mj_step") == 1, told.stderr


def test_a_simulation_needs_no_reminder():
    code = "import mjchair; mjchair.simulate(mjchair.load_spec(), None, 0.05)"
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "mjchair.install()" not in told.stderr


def test_load_spec_works_with_python_callbacks_in_place():
    """MuJoCo's compiler calls them, and fails then: they are out meanwhile, and come back."""
    mjchair.install(compiled=False)
    before = mujoco.get_mjcb_act_dyn()
    model = compile_spec(mjchair.load_spec())
    assert mujoco.get_mjcb_act_dyn() is before is not None
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, nstep=3)
    assert data.sensor("left_wheel_tire").data[2] > 1.0, "N: the callbacks are at work"


def test_without_compiled_callbacks_nothing_is_compiled():
    """Not even the contact with a height field."""
    code = (
        "import mjchair, mujoco; from mjchair.model.ground import uneven\n"
        "m = mjchair.load_spec(scene='hfield', heights=uneven(0.01, seed=1)).compile()\n"
        "mjchair.install(compiled=False)\n"
        "d = mujoco.MjData(m); mujoco.mj_step(m, d, nstep=2)\n"
        "import sys; assert 'mjchair.engine.native' not in sys.modules\n"
        "print(d.sensor('left_wheel_tire').data[2])"
    )
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert said.stderr == "" and float(said.stdout) > 0.0
