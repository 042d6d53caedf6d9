"""A designer's changes do to the chair what their names say."""

import math

import mujoco
import numpy as np
import pytest

import mjchair
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


def test_bad_values_are_named():
    with pytest.raises(mjchair.MjchairError, match=r"camber is 4 rad; it must be within -0.05"):
        ChairParameters(camber=4.0)
    with pytest.raises(mjchair.MjchairError, match="did you mean 'camber'"):
        ChairParameters.of({"cambre": 0.1})
    with pytest.raises(mjchair.MjchairError, match="nan"):
        ChairParameters(toe=math.nan)
