"""Visual geoms are merged: fewer geoms, the same physics and appearance, and still to be edited."""

import mujoco
import numpy as np
import pytest
from conftest import has_graphics
from dm_control import mjcf

import mjchair
from mjchair import ChairParameters
from mjchair.model import merged_visual_geoms
from mjchair.model.visual_geoms import is_visual, without_visual_geoms
from mjchair.report import gl

CHANGES = {"seat_height": 0.52, "back_angle": 0.2, "wheel_radius": 0.28, "occupant_mass": 90.0}


@pytest.fixture(scope="module", params=["manual", "power"])
def pair(request):
    """A chair's specification as it comes, and with its parts one by one."""
    return mjchair.load_spec(request.param), mjchair.load_spec(
        request.param, merge_visual_geoms=False
    )


def _shapes(spec):
    """Name -> type, material, pose, size and mass of the parts that are only seen and no mesh."""
    return {
        g.name: (int(g.type), g.material, *g.pos, *g.quat, *g.size, max(float(g.mass), 0.0))
        for g in spec.geoms
        if g.parent.name != "world" and is_visual(g) and not g.meshname
    }


def _inertials(spec):
    model = spec.compile()
    return np.column_stack((model.body_mass, model.body_ipos, model.body_inertia, model.body_pos))


def test_a_body_has_one_mesh_for_each_material_and_both_wheels_the_same(pair):
    merged, parts = pair
    seen = [g for g in merged.geoms if g.parent.name != "world" and is_visual(g)]
    seen_parts = [(g.parent.name, g.material) for g in seen if not g.name.endswith("_pushrim")]
    assert len(seen_parts) == len(set(seen_parts))
    before = [g for g in parts.geoms if g.parent.name != "world" and is_visual(g)]
    assert {(g.parent.name, g.material) for g in seen} == {
        (g.parent.name, g.material) for g in before
    }
    left, right = (merged.body(f"{side}_wheel").geoms for side in ("left", "right"))
    assert [g.meshname for g in left] == [g.meshname for g in right]


def test_every_number_that_moves_is_the_same(pair):
    states = []
    with mjchair.installed():
        for model in (spec.compile() for spec in (*pair, without_visual_geoms(pair[0]))):
            data = mujoco.MjData(model)
            data.ctrl[:2] = 3.0, 5.0
            mujoco.mj_step(model, data, nstep=400)
            states.append(np.concatenate([data.qpos, data.qvel, data.act, data.sensordata]))
    assert np.array_equal(states[0], states[1]) and np.array_equal(states[0], states[2])


def test_the_parts_come_back_as_they_were(pair):
    merged, parts = pair
    again = mujoco.MjSpec.from_string(merged.to_xml())  # out of a file
    merged_visual_geoms.separate(again)
    assert not merged_visual_geoms.is_merged(again) and len(again.geoms) == len(parts.geoms)
    there, want = _shapes(again), _shapes(mujoco.MjSpec.from_string(parts.to_xml()))
    assert there.keys() == want.keys()
    masses = {g.name: g.mass for g in parts.geoms}
    model, before = again.compile(), parts.compile()
    for name, told in there.items():
        assert told[:2] == want[name][:2]
        assert told[-1] == pytest.approx(max(masses[name], 0.0))
        for field in ("pos", "quat", "size", "rgba"):
            a, b = getattr(model.geom(name), field), getattr(before.geom(name), field)
            np.testing.assert_allclose(a, b, atol=1e-12, err_msg=f"{name} {field}")


def test_a_merged_surface_is_that_of_the_parts(pair):
    """The boxes round body and material, by MuJoCo's own sizes of its geoms."""
    merged, parts = (spec.compile() for spec in pair)
    for i in range(merged.ngeom):
        geom = merged.geom(i)
        if geom.name in {parts.geom(k).name for k in range(parts.ngeom)}:
            continue
        alike = [
            k
            for k in range(parts.ngeom)
            if parts.geom_bodyid[k] == geom.bodyid[0] and parts.geom_matid[k] == geom.matid[0]
            and not parts.geom_contype[k] and not parts.geom_conaffinity[k]
            and not parts.geom(k).name.endswith("_pushrim")
        ]  # fmt: skip
        assert alike
        low, high = (f([_box(parts, k)[j] for k in alike], axis=0)
                     for j, f in enumerate((np.min, np.max)))  # fmt: skip
        own = _box(merged, i)
        np.testing.assert_allclose(own, (low, high), atol=4e-3, err_msg=geom.name)


def _box(model, geom):
    """Lowest and highest corner of a geom in its body's frame, m."""
    axes = np.zeros(9)
    mujoco.mju_quat2Mat(axes, model.geom_quat[geom])
    turned, at, kind = axes.reshape(3, 3), model.geom_pos[geom], model.geom_type[geom]
    size, shapes = model.geom_size[geom], mujoco.mjtGeom
    if kind == shapes.mjGEOM_MESH:
        mesh = model.geom_dataid[geom]
        first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
        points = model.mesh_vert[first : first + count] @ turned.T + at
        return points.min(axis=0), points.max(axis=0)
    if kind == shapes.mjGEOM_BOX:
        reach = np.abs(turned) @ size
    elif kind == shapes.mjGEOM_CAPSULE:
        reach = np.abs(turned[:, 2]) * size[1] + size[0]
    elif kind == shapes.mjGEOM_CYLINDER:
        across = np.sqrt(np.maximum(1.0 - turned[:, 2] ** 2, 0.0))
        reach = np.abs(turned[:, 2]) * size[1] + across * size[0]
    else:
        radii = size if kind == shapes.mjGEOM_ELLIPSOID else np.full(3, size[0])
        reach = np.linalg.norm(turned * radii, axis=1)
    return at - reach, at + reach


def test_a_change_after_loading_makes_the_chair_that_a_change_while_loading_makes(pair):
    name = pair[0].modelname.split()[0]
    changes = CHANGES if name == "manual" else {"seat_height": 0.52, "occupant_mass": 90.0}
    asked = mjchair.load_spec(name, parameters=changes)
    later = mjchair.load_spec(name)
    ChairParameters(**changes).apply(later)
    assert merged_visual_geoms.is_merged(later)
    np.testing.assert_allclose(_inertials(asked), _inertials(later), rtol=1e-9, atol=1e-12)
    a, b = asked.compile(), later.compile()
    assert [a.geom(i).name for i in range(a.ngeom)] == [b.geom(i).name for i in range(b.ngeom)]
    for i in range(a.ngeom):
        if a.geom_bodyid[i]:  # shapes follow the change
            np.testing.assert_allclose(_box(a, i), _box(b, i), atol=5e-5, err_msg=a.geom(i).name)
    assert np.abs(_inertials(asked) - _inertials(mjchair.load_spec(name))).max() > 1e-3


def test_two_chairs_in_one_scene_can_be_taken_apart():
    scene = mujoco.MjSpec()
    for k in range(2):
        chair = mjchair.load_spec()
        chair.delete(chair.geom("floor"))
        scene.attach(chair, frame=scene.worldbody.add_frame(pos=(0, 2 * k, 0)), prefix=f"c{k}/")
    scene.compile()
    merged_visual_geoms.separate(scene)
    for k in range(2):
        assert scene.geom(f"c{k}/left_thigh").parent.name == f"c{k}/chair"
    scene.compile()


def test_pymjcf_reads_the_saved_chair():
    saved = mjchair.load_spec().to_xml()
    root = mjcf.from_xml_string(saved)
    assert root.find("text", merged_visual_geoms.RECORD) is not None
    assert len(root.find_all("geom")) == mjchair.load_spec().compile().ngeom


def test_what_is_named_or_touches_or_weighs_stays_a_geom(tmp_path):
    text = mjchair.load_spec(merge_visual_geoms=False).to_xml()
    text = text.replace(
        "<sensor>", '<sensor><framepos name="knee" objtype="geom" objname="left_shank"/>'
    )
    (tmp_path / "mine.xml").write_text(text)
    model = mjchair.load_spec(tmp_path / "mine.xml").compile()
    names = {model.geom(i).name for i in range(model.ngeom)}
    assert {"left_shank", "footrest", "left_wheel_tire", "left_wheel_pushrim", "floor"} <= names
    assert not {"right_shank", "seat", "left_wheel_spoke_1"} & names


def test_a_part_that_is_deleted_does_not_come_back():
    spec = mjchair.load_spec()
    spec.delete(spec.geom("chair_manual_hair"))
    merged_visual_geoms.separate(spec)
    assert spec.geom("hair") is None and spec.geom("head") is not None


def _picture(model):
    """The chair from its camera `follow`, 240 x 400 pixels."""
    context = gl.context(400, 240)
    try:
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        scene, drawing = mujoco.MjvScene(model, 500), mujoco.MjrContext(model, 100)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, drawing)
        camera = mujoco.MjvCamera()
        camera.type, camera.fixedcamid = mujoco.mjtCamera.mjCAMERA_FIXED, model.camera("follow").id
        every = mujoco.mjtCatBit.mjCAT_ALL
        mujoco.mjv_updateScene(model, data, mujoco.MjvOption(), None, camera, every, scene)
        view, pixels = mujoco.MjrRect(0, 0, 400, 240), np.zeros((240, 400, 3), np.uint8)
        mujoco.mjr_render(view, scene, drawing)
        mujoco.mjr_readPixels(pixels, None, view, drawing)
        drawing.free()
    finally:
        context.free()
    return pixels.astype(int)


@pytest.mark.skipif(not has_graphics(), reason="no offscreen OpenGL")
def test_a_picture_is_the_same(pair):
    merged, parts, bare = (_picture(s.compile()) for s in (*pair, without_visual_geoms(pair[0])))
    apart = np.abs(merged - parts).max(axis=2)
    shown = np.abs(merged - bare).max(axis=2) > 8  # where the chair is
    assert shown.mean() > 0.02
    assert apart[shown].mean() < 3.0, "colours differ"
    assert (apart > 40).sum() < 0.02 * shown.sum(), "more than edges differ"
