"""The compiled callbacks are held to the plain ones, and install leaves nothing behind."""

import subprocess
import sys

import mujoco
import numpy as np
import pytest
from conftest import roll, slalom

import mjchair
from mjchair.engine import layout


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


def test_every_offset_is_checked(monkeypatch):
    real = layout.offset
    layout.check.__wrapped__()
    for owner, member in (("mjData", "cvel"), ("mjModel", "nsensor"), ("mjContact", "geom")):

        def moved(name, field, owner=owner, member=member):
            return real(name, field) + (8 if (name, field) == (owner, member) else 0)

        monkeypatch.setattr(layout, "offset", moved)
        if owner == "mjContact":
            continue
        with pytest.raises(layout.LayoutError, match=f"{owner}.{member}"):
            layout.check.__wrapped__()


def test_contact_offsets_are_checked(monkeypatch):
    class Wrong:
        size, offset = 8, 16

    struct = layout.struct

    def moved(name):
        kind = struct(name)
        return (
            type(
                "moved", (), {**{k: getattr(kind, k) for k in layout.CONTACT_FIELDS}, "pos": Wrong}
            )
            if name == "mjContact"
            else kind
        )

    monkeypatch.setattr(layout, "struct", moved)
    data = mujoco.MjData(mujoco.MjModel.from_xml_string(layout._PROBE))
    mujoco.mj_forward(mujoco.MjModel.from_xml_string(layout._PROBE), data)
    assert layout._wrong_in_contact(data) == ["mjContact.pos"]


def test_compiled_code_is_found_again_by_another_process():
    mjchair.install()
    code = (
        "from mjchair.engine import native; "
        "print([f.cache_hits for f in (*native.callbacks(), native.field_contact())])"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert set(eval(found.stdout)) == {1}


def test_load_spec_works_with_python_callbacks_in_place():
    mjchair.install(compiled=False)
    before = mujoco.get_mjcb_act_dyn()
    assert mjchair.load_spec().compile is not None
    assert mujoco.get_mjcb_act_dyn() is before
