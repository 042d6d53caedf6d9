"""The tilting platform against the closed form of a rigid chair, worked out here anew."""

import math
import subprocess
import sys

import mujoco
import numpy as np
import pytest

from mjchair.errors import MjchairError
from mjchair.testlab.closed_form import anti_tip_angle
from mjchair.testlab.design import Design
from mjchair.testlab.platform import RATE, Platform, Setup

# from the geometry of the shipped manual chair, deg
MANUAL = {
    ("forward", True): 23.4,
    ("rearward", True): 10.5,
    ("rearward", False): 19.0,
    ("left", True): 22.1,
    ("right", True): 22.1,
}


def by_hand(name: str, direction: str, locked: bool) -> float:
    """Tip angle (deg) from body masses and places at the model's own pose."""
    model = Design(name).spec().compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    mass, at = model.body_mass[1:].copy(), data.xipos[1:].copy()

    def hub(wheel):
        return data.body(wheel).xpos.copy()

    if direction in ("forward", "rearward"):
        pair = "caster" if direction == "forward" else "wheel"
        sign = 1.0 if direction == "forward" else -1.0
        pivot = hub(f"left_{pair}")
        if locked:
            pivot[2] = 0.0
        else:
            for side in ("left", "right"):
                mass[model.body(f"{side}_{pair}").id - 1] = 0.0
        center = mass @ at / mass.sum()
        return math.degrees(math.atan(sign * (pivot[0] - center[0]) / (center[2] - pivot[2])))
    center = mass @ at / mass.sum()
    rear, front = hub(f"{direction}_wheel")[:2], hub(f"{direction}_caster")[:2]
    along, to = front - rear, center[:2] - rear
    distance = abs(along[0] * to[1] - along[1] * to[0]) / np.linalg.norm(along)
    return math.degrees(math.atan(distance / center[2]))


CASES = [
    ("forward", True),
    ("forward", False),
    ("rearward", True),
    ("rearward", False),
    ("left", True),
    ("right", True),
]


@pytest.mark.parametrize("name", ["manual", "power"])
@pytest.mark.parametrize(("direction", "locked"), CASES)
def test_a_chair_tips_where_the_closed_form_says(name, direction, locked):
    expected = by_hand(name, direction, locked)
    if name == "manual" and (direction, locked) in MANUAL:
        assert expected == pytest.approx(MANUAL[direction, locked], abs=0.06)
    tilted = Platform(Design(name), Setup(direction, locked)).tilt()
    assert math.degrees(tilted.angle) == pytest.approx(expected, abs=0.05)
    assert math.degrees(tilted.exact) == pytest.approx(expected, abs=0.05)


def test_a_chair_on_its_anti_tippers_tips_over_them():
    platform = Platform(Design("manual"), Setup("rearward", True, anti_tippers=True))
    standing = mujoco.MjData(platform.model)
    mujoco.mj_kinematics(platform.model, standing)
    expected = anti_tip_angle(platform.model, standing, platform.parts)
    # rollers 0.28 m behind and 0.24 m beneath the axle touch when the frame leans by 5.33 deg
    lean = math.radians(49.399 - math.degrees(math.acos(0.265 / math.hypot(0.28, 0.24))))
    back = -0.28 * math.cos(lean) + 0.24 * math.sin(lean)
    front = 0.12 * math.cos(lean) - 0.348 * math.sin(lean)
    height = 0.3 + 0.12 * math.sin(lean) + 0.348 * math.cos(lean)
    assert expected == pytest.approx(math.atan((front - back) / height), abs=2e-3)
    tilted = platform.tilt()
    assert math.degrees(tilted.angle) == pytest.approx(10.5, abs=0.06)
    assert math.degrees(tilted.held) == pytest.approx(math.degrees(expected), abs=0.1)


def test_step_and_slowness_change_no_printed_digit():
    design, setup = Design("manual"), Setup("forward", True)
    usual = math.degrees(Platform(design, setup).tilt().angle)
    finer = math.degrees(Platform(design, setup, timestep=0.001).tilt().angle)
    slower = math.degrees(Platform(design, setup).tilt(rate=0.5 * RATE).angle)
    assert f"{usual:.1f}" == f"{finer:.1f}" == f"{slower:.1f}"
    assert max(abs(finer - usual), abs(slower - usual)) < 0.02


class Aside(Design):
    """The manual chair with its centre of mass 20 mm to the left, or to the right."""

    to_the_left = 1.0

    def spec(self, visual_geoms=False):
        found = super().spec(visual_geoms)
        body = found.body("chair")
        body.ipos = np.add(body.ipos, (0.0, 0.02 * self.to_the_left, 0.0))
        return found


class AsideRight(Aside):
    to_the_left = -1.0


def test_a_mirrored_chair_gives_mirrored_numbers():
    heavy_left, heavy_right = Aside(), AsideRight()
    left = Platform(heavy_left, Setup("left")).tilt().angle
    right = Platform(heavy_left, Setup("right")).tilt().angle
    assert left < right - math.radians(2.0)
    assert Platform(heavy_right, Setup("right")).tilt().angle == pytest.approx(left, abs=1e-5)


def test_without_stops_a_chair_slides_and_says_so():
    with pytest.raises(MjchairError, match=r"slides at .* deg before it tips"):
        Platform(Design("manual"), Setup("forward", False, stops=False)).tilt()


def test_a_dummy_outside_its_range():
    with pytest.raises(MjchairError, match="the dummy is 300 kg; it must be within 25 to 150 kg"):
        Design("manual", occupant=300.0)


def test_a_chair_that_falls_over_while_it_is_put_down(tmp_path):
    spec = Design("manual").spec()
    spec.body("chair").ipos = (-0.4, 0.0, 0.8)
    path = tmp_path / "falls.xml"
    path.write_text(spec.to_xml())
    with pytest.raises(MjchairError, match="does not come to rest"):
        Platform(Design(str(path)), Setup("forward"))


@pytest.mark.parametrize("before", ["reminder", "tires"])
def test_what_the_process_did_before_changes_no_number_and_warns_of_nothing(before):
    """The stops' platform has no tires by intent: neither the reminder nor tires may be there."""
    code = f"""
import sys, warnings, mujoco, mjchair
from mjchair.testlab.design import Design
from mjchair.testlab.platform import Platform, Setup
def angle():
    return Platform(Design("manual"), Setup("rearward", stops=True)).tilt(0.02).angle
first = angle()
warnings.simplefilter("always")
mjchair.load_spec() if {before == "reminder"} else mjchair.install()
here = mujoco.get_mjcb_act_dyn()
assert here is not None and angle() == first and mujoco.get_mjcb_act_dyn() == here
print("the chair is stepped", file=sys.stderr)
if {before == "reminder"}:
    model = mjchair.load_spec().compile()
    mujoco.mj_step(model, mujoco.MjData(model), nstep=5)
"""
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert told.returncode == 0, told.stderr
    on_platform, stepped = told.stderr.split("the chair is stepped")
    assert on_platform == ""
    assert ("without its tires" in stepped) is (before == "reminder"), "the true one comes"
