"""A designer's changes do to the chair what their names say."""

import math
from dataclasses import fields
from pathlib import Path

import mujoco
import numpy as np
import pytest

import mjchair
from mjchair.effects.library import find
from mjchair.model import assets
from mjchair.model.parameters import ChairParameters
from mjchair.tire import block

GRAVITY = 9.81


def settled(**changes):
    model = mjchair.load_spec(parameters=ChairParameters(**changes)).compile()
    data = mujoco.MjData(model)
    mjchair.install()
    mujoco.mj_step(model, data, nstep=3000)
    assert np.abs(data.qvel).max() < 1e-2, "not at rest"
    mujoco.mj_forward(model, data)
    return model, data


def load(data, wheel):
    return data.sensor(f"{wheel}_tire").data[2]


def test_no_change_is_the_same_chair(manual):
    model = mjchair.load_spec(parameters=ChairParameters()).compile()
    for field in ("body_pos", "body_inertia", "geom_user", "geom_size"):
        assert np.array_equal(getattr(model, field), getattr(manual, field))


@pytest.mark.parametrize(
    "change",
    [
        {"axle_position": 0.06},
        {"wheel_radius": 0.28},
        {"caster_radius": 0.05},
        {"caster_trail": 0.07},
        {"camber": 0.1},
        {"toe": 0.02},
        {"track": 0.65},
        {"tire_pressure": 0.5},
        {"wheelbase": 0.46},
        {"seat_height": 0.45, "seat_angle": 0.15, "back_angle": 0.0},
        {"chair_mass": 9.0, "occupant_mass": 60.0, "anti_tippers": False},
    ],
)
def test_the_chair_stays_level_and_carries_its_weight(change):
    model, data = settled(**change)
    total = sum(load(data, w) for w in ("left_wheel", "right_wheel", "left_caster", "right_caster"))
    assert total == pytest.approx(model.body_subtreemass[0] * GRAVITY, rel=1e-3)
    forward = data.body("chair").xmat.reshape(3, 3)[:, 0]
    assert abs(math.asin(forward[2])) < 0.012, "frame no longer level"


def test_the_axle_forward_takes_load_off_the_casters():
    _, before = settled()
    model, after = settled(axle_position=0.06)
    assert load(after, "left_caster") < 0.7 * load(before, "left_caster")
    assert model.site("axle").pos[0] == pytest.approx(0.06)


def test_camber_and_toe_turn_the_wheels_as_they_say():
    _, data = settled(camber=0.1, toe=0.0)
    assert data.sensor("left_wheel_tire").data[6] == pytest.approx(
        -data.sensor("right_wheel_tire").data[6], abs=1e-6
    )
    top = data.body("left_wheel").xmat.reshape(3, 3)[:, 2]
    assert top[1] == pytest.approx(-math.sin(0.1), abs=1e-3), "the left top leans right: inwards"
    _, data = settled(toe=0.05)
    heading = data.body("left_wheel").xmat.reshape(3, 3) @ (0, 1, 0)
    assert heading[0] == pytest.approx(math.sin(0.05), abs=1e-3), "the left front points inwards"


def test_occupant_mass_is_what_geoms_of_that_mass_would_give():
    """The inertial against MuJoCo's own sum of all parts, the occupant's scaled."""
    light = mjchair.load_spec().compile()
    heavy = mjchair.load_spec(parameters=ChairParameters(occupant_mass=100.0)).compile()
    chair = heavy.body("chair").id
    assert heavy.body_mass[chair] - light.body_mass[chair] == pytest.approx(25.0, rel=1e-3)
    spec = mujoco.MjSpec.from_file(str(assets.chairs()["manual"]))
    for geom in spec.body("chair").geoms:
        if geom.classname.name == "manual_person" and geom.mass > 0:
            geom.mass *= 100.0 / 75.0
    spec.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE
    summed = spec.compile()
    chair = summed.body("chair").id
    assert heavy.body("chair").ipos == pytest.approx(summed.body_ipos[chair], abs=1e-4)
    assert np.sort(heavy.body("chair").inertia) == pytest.approx(
        np.sort(summed.body_inertia[chair]), rel=1e-3
    )


def test_pressure_changes_rolling_and_stiffness_of_the_rear_tires_only(manual):
    model = mjchair.load_spec(parameters=ChairParameters(tire_pressure=0.25)).compile()
    rear, caster = (model.geom(f"left_{w}_tire").user for w in ("wheel", "caster"))
    before = manual.geom("left_wheel_tire").user
    assert rear[block.ROLLING_RESISTANCE] == pytest.approx(
        before[block.ROLLING_RESISTANCE] * 0.25**-0.4
    )
    assert rear[block.STIFFNESS_FACTOR] == pytest.approx(0.4)
    assert np.array_equal(caster, manual.geom("left_caster_tire").user)
    sink = {p: -_sink(p) for p in (1.0, 0.25)}
    assert sink[0.25] == pytest.approx(sink[1.0] / 0.4, rel=0.05)


def _sink(pressure):
    _, data = settled(tire_pressure=pressure)
    return data.geom("left_wheel_tire").xpos[2] - 0.3


def by_parts(spec):
    """Mass, centre and principal inertia of body `chair` as MuJoCo sums them over its geoms."""
    summed = spec.copy()
    summed.body("chair").explicitinertial = False
    chair = summed.compile().body("chair")
    return np.r_[chair.mass, chair.ipos, np.sort(chair.inertia)]


@pytest.mark.parametrize(
    "change",
    [
        {"seat_height": 0.6},
        {"seat_angle": 0.2},
        {"back_angle": 0.35},
        {"rider_position": -0.05},
        {"chair_mass": 11.0},
        {"wheelbase": 0.45},
        {"occupant_mass": 60.0, "chair_mass": 20.0, "rider_position": 0.04, "seat_angle": 0.1},
    ],
    ids=str,
)
def test_the_inertial_is_that_of_the_parts_where_they_are(change):
    """The manual chair's frame and occupant are nothing but their geoms."""
    spec = mjchair.load_spec(parameters=change, merge_visual_geoms=False)
    chair = spec.compile().body("chair")
    told = np.r_[chair.mass, chair.ipos, np.sort(chair.inertia)]
    np.testing.assert_allclose(told, by_parts(spec), rtol=2e-4, atol=2e-5)
    before = by_parts(mjchair.load_spec(merge_visual_geoms=False))
    assert np.abs(told - before).max() > 1e-3, "the parts did not move"


@pytest.mark.parametrize("model", ["manual", "power"])
def test_the_seat_stands_and_leans_as_asked(model):
    asked = {"seat_height": "52 cm", "seat_angle": "9 deg", "back_angle": "14deg"}
    spec = mjchair.load_spec(model, parameters=asked, merge_visual_geoms=False)
    compiled = spec.compile()
    seat, back = (_turned(compiled.geom(name).quat) for name in ("seat", "back_rest"))
    assert math.degrees(math.asin(seat[2, 0])) == pytest.approx(9.0)
    assert math.degrees(math.acos(back[2, 2])) == pytest.approx(14.0) and back[0, 2] < 0.0
    top = compiled.geom("cushion" if model == "manual" else "seat")
    front = top.pos + _turned(top.quat) @ (top.size[0], 0.0, top.size[2])
    assert front[2] == pytest.approx(0.52, abs=2e-3)
    before = mjchair.load_spec(model, merge_visual_geoms=False)
    hips, rest = compiled.geom("pelvis").pos, before.geom("pelvis").pos
    lowered = hips[2] - rest[2] - (0.52 - _edge(model))
    assert lowered < -0.03, "the hips sink as the seat's rear does"
    assert compiled.geom("left_foot").pos[2] == before.geom("left_foot").pos[2]


def _turned(quat):
    matrix = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, quat)
    return matrix.reshape(3, 3)


def _edge(model):
    """Height of the front edge of the shipped seats, by hand from their files, m."""
    return {"manual": 0.487 + 0.018 + 0.225 * 0.04, "power": 0.475 + 0.035 + 0.235 * 0.04}[model]


def test_a_camber_or_toe_is_the_one_the_chair_has_and_not_one_more():
    spec = mjchair.load_spec(parameters={"camber": 0.1, "toe": 0.02})
    twice = spec.copy()
    ChairParameters(camber=0.1, toe=0.02).apply(twice)
    for wheel in ("left_wheel", "right_wheel"):
        np.testing.assert_allclose(spec.body(wheel).quat, twice.body(wheel).quat, atol=1e-12)


def test_an_effect_and_a_parameter_of_the_same_name_make_the_same_chair():
    """But for what is a designer's alone: hubs that keep the frame level, and another rim."""
    apart = {
        "camber": {"body_pos"},
        "wheel_radius": {"body_pos", "body_inertia", "geom_user", "geom_size"},
    }
    made = {
        "camber": ({"camber": 0.06}, {"angle": 0.06}),
        "toe": ({"toe": 0.02}, {"symmetric": 0.02, "asymmetric": 0.0}),
        "caster_trail": ({"caster_trail": 0.07}, {"length": 0.02}),
        "wheel_radius": ({"wheel_radius": 0.29}, {"left": -0.01, "right": -0.01}),
    }
    for name, (chosen, values) in made.items():
        one = mjchair.load_spec(parameters=chosen).compile()
        spec = mjchair.load_spec()
        find(name).apply(spec, values)
        two = spec.compile()
        every = {"geom_user", "geom_size", "body_quat", "body_inertia", "body_mass", "body_pos"}
        for field in every - apart.get(name, set()):
            a, b = getattr(one, field), getattr(two, field)
            np.testing.assert_allclose(a, b, atol=1e-9, err_msg=f"{name} {field}")


def test_a_saved_chair_and_ones_own_take_parameters(tmp_path):
    heavy = mjchair.load_spec(parameters={"occupant_mass": 90.0, "camber": "2deg"})
    file = tmp_path / "mine.xml"
    file.write_text(heavy.to_xml())
    light = mjchair.load_spec(file, parameters={"occupant_mass": 60.0, "camber": "5deg"})
    plain = mjchair.load_spec(parameters={"occupant_mass": 60.0, "camber": "5deg"}).compile()
    again = light.compile()
    assert again.body_mass[again.body("chair").id] == pytest.approx(70.0)
    for field in ("body_ipos", "body_inertia", "body_quat", "body_pos"):
        np.testing.assert_allclose(getattr(again, field), getattr(plain, field), atol=1e-6)
    # merged parts keep their masses in the file; MuJoCo writes none for a part on its own
    raised = mjchair.load_spec(file, parameters={"seat_height": 0.5}).compile()
    assert raised.body("chair").ipos[2] != heavy.compile().body("chair").ipos[2]
    file.write_text(mjchair.load_spec(merge_visual_geoms=False).to_xml())
    with pytest.raises(mjchair.MjchairError, match="seat_height: geom 'seat' has no mass"):
        mjchair.load_spec(file, parameters={"seat_height": 0.5})
    other = assets.chairs()["manual"].read_text().replace('name="pelvis"', 'name="hips"')
    (tmp_path / "other.xml").write_text(other)
    with pytest.raises(mjchair.MjchairError, match="occupant_mass: the model has no geom 'pelvis'"):
        mjchair.load_spec(tmp_path / "other.xml", parameters={"occupant_mass": 60.0})


def test_anti_tippers_come_off_and_wheels_weigh_what_is_asked():
    model = mjchair.load_spec(parameters={"anti_tippers": "no", "wheel_mass": 1.2}).compile()
    assert not [i for i in range(model.ngeom) if "anti_tip" in model.geom(i).name]
    assert model.body("left_wheel").mass == pytest.approx(1.2)
    assert model.body("left_wheel").inertia == pytest.approx(np.array([0.053, 0.105, 0.053]) / 1.5)


@pytest.mark.parametrize(
    ("given", "line"),
    [
        ({"camber": "3 degrees"}, "its unit must be one of rad, deg"),
        ({"camber": "steep"}, "camber is 'steep'; it must be a number"),
        ({"camber": 3}, r"camber is 3 rad; .*write 3deg"),
        ({"anti_tippers": "perhaps"}, "must be yes or no"),
        ({"occupant_mass": "82 m"}, "its unit must be one of kg, lb"),
        ({"chair_mass": 5.0}, "its wheels and casters alone weigh 5 kg"),
    ],
)
def test_values_with_units_are_read_or_refused_in_one_line(given, line):
    with pytest.raises(mjchair.MjchairError, match=line) as caught:
        mjchair.load_spec(parameters=given)
    assert "\n" not in str(caught.value)


def test_text_and_numbers_are_the_same_value():
    told = ChairParameters.of({"camber": "3 deg", "wheel_radius": "12in", "tire_pressure": "50%"})
    assert told == ChairParameters(
        camber=math.radians(3.0), wheel_radius=12 * 0.0254, tire_pressure=0.5
    )


def test_bad_values_are_named():
    with pytest.raises(mjchair.MjchairError, match=r"camber is 4 rad; it must be within -0.05"):
        ChairParameters(camber=4.0)
    with pytest.raises(mjchair.MjchairError, match="did you mean 'camber'"):
        ChairParameters.of({"cambre": 0.1})
    with pytest.raises(mjchair.MjchairError, match="nan"):
        ChairParameters(toe=math.nan)


def test_the_documentation_lists_every_parameter_with_its_range():
    text = (Path(__file__).parents[1] / "docs" / "chairs.md").read_text()
    for item in fields(ChairParameters):
        unit, low, high, what = (item.metadata[k] for k in ("unit", "low", "high", "text"))
        told = "" if unit == "yes or no" else f"{low:g} to {high:g}"
        assert f"| `{item.name}` | {unit} | {told} | {what} |" in text, item.name
