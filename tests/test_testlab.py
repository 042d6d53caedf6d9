"""The tests of the laboratory against laws, closed forms and truths put in."""

import json
import math
import re

import numpy as np
import pytest

from mjchair import cli
from mjchair.errors import MjchairError
from mjchair.testlab import classes, sheet
from mjchair.testlab.brakes import brakes
from mjchair.testlab.caster_shimmy import _onset, _ratio
from mjchair.testlab.design import GRAVITY, Design, parts
from mjchair.testlab.downhill_bump import attempt as bump
from mjchair.testlab.drive import Joystick, Person, drive_of
from mjchair.testlab.drum import drum_drag
from mjchair.testlab.dummies import MASSES, dummies
from mjchair.testlab.dynamic_stability import MANOEUVRES, score_of
from mjchair.testlab.energy import CARPET, carpet, energy
from mjchair.testlab.laboratory import Request, _plain
from mjchair.testlab.obstacles import attempt as climb
from mjchair.testlab.platform import Platform, Setup
from mjchair.testlab.result import Result, Value
from mjchair.testlab.rolling import START, coast_down, component_sum, treadmill
from mjchair.testlab.speed import speed
from mjchair.testlab.track import Track
from mjchair.testlab.turning import turning
from mjchair.testlab.uncertainty import draws

MANUAL, POWER = Design("manual"), Design("power")


@pytest.fixture(scope="module")
def rope():
    return treadmill(MANUAL)


def test_the_components_add_up_to_the_whole_chairs_drag(rope):
    total, rows = component_sum(MANUAL, rope.loads)
    assert total == pytest.approx(rope.drag, rel=0.01)
    assert sum(rope.loads.values()) == pytest.approx(rope.weight, rel=1e-3)
    assert len(rows) == 4


def test_a_wheel_on_a_drum_drags_as_the_components_say(rope):
    _, rows = component_sum(MANUAL, rope.loads)
    for wheel, row in zip(("left_wheel", "left_caster"), (rows[0], rows[2]), strict=True):
        assert drum_drag(MANUAL, wheel, rope.loads[wheel]) == pytest.approx(row[-1], rel=5e-3)


def test_rope_and_coast_down_say_the_same(rope):
    straight = coast_down(MANUAL)
    assert straight.drag / straight.weight == pytest.approx(rope.drag / rope.weight, rel=0.01)
    turning_too = coast_down(MANUAL, yaw=0.5)
    # the pull towards the centre needs slip, and slip costs: more than 1 % and less than 15 %
    assert 1.01 < turning_too.drag / straight.drag < 1.15


def test_half_the_step_changes_no_printed_digit_of_the_drag(rope):
    assert f"{treadmill(MANUAL, timestep=0.001).drag:.3g}" == f"{rope.drag:.3g}"


def test_a_carpet_gives_back_what_it_has(rope):
    added = (treadmill(MANUAL, edit=carpet).drag - rope.drag) / rope.weight
    assert added == pytest.approx(CARPET, rel=0.02)


def test_the_energy_of_a_push_is_the_drag_over_the_way(rope):
    straight = energy(MANUAL)["energy_straight_tile"]
    assert straight == pytest.approx(rope.drag, rel=0.02)


def test_the_parking_brake_holds_up_to_the_tip_on_the_models_own_tires():
    result = brakes(MANUAL)
    # the closed form is 10.5 deg; the tires' sink takes 0.1 to 0.2 of it
    assert 10.2 < result["parking_uphill"] < 10.6
    assert "tips" in result.values["parking_uphill"].note
    assert "slides" in result.values["parking_downhill"].note
    assert any("no motor" in note for note in result.notes)


def test_sizes_are_the_models_and_a_turn_sweeps_the_farthest_corner():
    result = turning(MANUAL)
    # footrest's front edge at 0.69 m, rear wheels' at -0.30 m
    assert result["length"] == pytest.approx(1000.0 * (0.69 + 0.30), abs=20.0)
    assert result["ground_clearance"] == pytest.approx(52.0, abs=0.5)
    reach = 2000.0 * math.hypot(0.69, 0.125)
    assert result["turning_diameter"] == pytest.approx(reach, rel=0.03)
    assert result["turning_diameter_one_wheel"] > result["turning_diameter"]
    assert result["pivot_width"] < result["turning_diameter"]


def test_speed_is_for_motors_and_reaches_what_is_commanded():
    assert "no motor" in speed(MANUAL).missing
    assert isinstance(drive_of(MANUAL), Person)
    drive = drive_of(POWER)
    assert isinstance(drive, Joystick) and drive.top_speed == 2.0
    result = speed(POWER)
    # what the motors lose under the rolling resistance and is not compensated
    assert 0.95 < result["top_speed_forward"] / drive.top_speed < 1.0
    assert 0.95 < result["top_speed_backward"] / drive.reverse_speed < 1.0


def test_a_power_chair_is_tested_with_its_own_drive():
    """Release, reverse and power off against the profile; the range against the energy per way."""
    told = brakes(Design("power_front", 100.0, drive="indoor"), slopes=(0.0,))
    profile = Design("power_front", drive="indoor").own_drive().profile.at(1.0)
    ramp = profile["forward_speed"] ** 2 / (2.0 * profile["forward_deceleration"])
    assert 1.0 < told["stopping_release_0_deg"] / (1000.0 * ramp) < 1.5  # and the stick's filter
    ways = [told[f"stopping_{way}_0_deg"] for way in ("release", "reverse", "power_off")]
    assert ways == sorted(ways, reverse=True)
    # 60 N m a brake bear 1:2.6 of the chair; its tires do not hold that
    assert 10.0 < told["parking_uphill"] < 25.0


def test_a_power_chair_without_a_drive_is_refused_in_one_line(tmp_path):
    path = tmp_path / "mine.xml"
    path.write_text(Design("power").spec().to_xml())
    with pytest.raises(MjchairError, match=r"it has no drive: put a drive\.toml beside its file"):
        speed(Design(str(path)))


def test_the_platform_takes_four_wheels():
    with pytest.raises(MjchairError, match="power_mid has 6 wheels"):
        Platform(Design("power_mid"), Setup("rearward", False))


def test_a_low_kerb_is_climbed_and_a_high_one_is_not():
    assert climb(MANUAL, 0.005, "climbed", "forward", True)[0]
    assert not climb(MANUAL, 0.15, "climbed", "forward", True)[0]
    assert climb(MANUAL, 0.01, "descended", "backward", False)[0]


def test_a_start_lifts_no_wheel_on_the_level_and_does_on_a_slope_near_the_tip():
    start = MANOEUVRES[0]
    drive = drive_of(MANUAL)
    assert score_of(MANUAL, drive, start, 0.0)[0] == 3
    assert score_of(MANUAL, drive, start, math.radians(10.0))[0] < 3


def test_a_bump_is_passed_or_stops_the_chair():
    assert bump(MANUAL, 0.0, 0.0)[0] == "passes"
    outcome, run = bump(MANUAL, 0.0, 0.04)
    assert outcome == "stops"
    recording = run.recording()
    assert recording["velocity.x"][0] == pytest.approx(1.5, abs=0.02)
    assert recording["left_wheel_tire.Fz"][0] > 100.0


def test_dummies_weigh_what_they_should():
    result = dummies(MANUAL)
    for mass in MASSES:
        assert result[f"total_mass_{mass:g}"] == pytest.approx(15.0 + mass)


@pytest.mark.parametrize("zeta", [0.05, 0.2, -0.03])
def test_the_damping_of_a_known_swing_is_found(zeta):
    time = np.arange(0.0, 1.2, 0.002)
    swing = 0.14 * np.exp(-zeta * 30.0 * time) * np.cos(30.0 * math.sqrt(1 - zeta**2) * time)
    assert _ratio(swing) == pytest.approx(zeta, abs=0.01)


def test_flutter_begins_between_a_damped_and_an_undamped_speed():
    assert _onset((1.0, 2.0, 3.0), [0.2, 0.1, -0.1]) == pytest.approx(2.5)
    assert _onset((1.0, 2.0), [0.2, 0.1]) is None


def test_a_track_on_a_slope_pulls_with_the_slopes_part_of_gravity():
    track = Track(MANUAL, slope=math.radians(-5.0))
    view = track.view
    track.drive(lambda view: (0.0, 0.0), 1.0)
    ideal = GRAVITY * math.sin(math.radians(5.0))
    assert 0.7 * ideal < view.speed / view.time < ideal


def test_classes_of_limits():
    limits = {"A": 6.0, "B": 9.0, "C": 15.0}
    assert [classes._class(v, "more", limits) for v in (5.9, 6.0, 9.1, 15.0)] == [
        "none",
        "A",
        "B",
        "C",
    ]
    assert classes._class(1900.0, "less", {"A": 2000.0, "B": 2800.0}) == "A"
    assert classes._class(2500.0, "less", {"A": 2000.0, "B": 2800.0}) == "B"
    assert classes._class(2900.0, "less", {"A": 2000.0, "B": 2800.0}) == "C"


def test_every_limit_and_published_row_names_a_test_and_a_source():
    from mjchair.testlab.laboratory import TESTS

    for row in classes.table()["class"]:
        assert row["test"] in TESTS
    for row in classes.table()["published"]:
        assert row["source"] and row["reason"] and row["unit"]


def test_the_sheet_opens_offline_and_says_what_is_missing():
    results = {
        "static-stability": Result(
            "static-stability",
            {"rearward_locked": Value(10.49, "deg", 9.0, 12.0, note="<b>")},
            curves={"one": ([0.0, 1.0], [1.0, 0.0])},
        ),
        "speed": Result("speed", missing="the chair has no motor"),
    }
    page = sheet.page("A chair", ["about it"], {"it": results})
    assert "10.5" in page and "9.0 to 12.0" in page
    assert "the chair has no motor" in page
    assert "&lt;b&gt;" in page
    assert "http" not in page and "data:image/png" in page


def test_a_note_and_an_interval_say_of_which_design_they_are():
    def result(angle, note, same):
        values = {
            "rearward_locked": Value(angle, "deg", angle - 1.0, angle + 1.0, note=note),
            "forward_locked": Value(20.0, "deg", note=same),
        }
        return {"static-stability": Result("static-stability", values)}

    designs = {"old": result(10.0, "closed form 10.2 deg", "k"), "new": result(12.0, "13.1", "k")}
    page = sheet.page("Chairs", [], designs)
    assert "old: closed form 10.2 deg; new: 13.1" in page
    assert "old: 9.0 to 11.0; new: 11.0 to 13.0" in page
    assert '<td class="note">k</td>' in page, "what is the same of all is said once"


def test_the_sheet_leads_to_the_replays_of_its_runs(tmp_path):
    assert cli.main(["test", "rolling", "--replays", "--workers", "1", "--out", str(tmp_path)]) == 0
    pages = sorted((tmp_path / "replays").iterdir())
    assert pages and all(p.name.startswith("rolling-") for p in pages)
    links = re.findall(r'href="([^"#]+)"', (tmp_path / "sheet.html").read_text())
    assert [tmp_path / link for link in links] == pages


def test_results_go_through_json_and_back():
    result = Result("x", {"a": Value(math.inf, "m")}, curves={"c": ([1.0], [2.0])})
    told = json.loads(json.dumps(result.plain(), allow_nan=False))
    assert Result.of("x", told)["a"] is None


def test_draws_stay_in_their_ranges_and_change_the_chair():
    found = draws(MANUAL, 3, seed=1)
    assert found == draws(MANUAL, 3, seed=1)
    models = [design.spec().compile() for design in found]
    masses = {round(float(m.body_subtreemass[0]), 6) for m in models}
    assert len(masses) == 3
    assert all(85.0 < mass < 95.0 for mass in masses)
    request = Request({"it": MANUAL}, ["speed"], draws=found)
    assert request.digest() != Request({"it": MANUAL}, ["speed"]).digest()
    assert _plain(found[0])["draw"]["mass"] != 1.0


def test_a_chair_with_a_prefix_is_known_by_its_parts():
    import mujoco

    world = mujoco.MjSpec.from_string("<mujoco><worldbody/></mujoco>")
    world.attach(MANUAL.spec(), prefix="one/", frame=world.worldbody.add_frame())
    found = parts(world.compile())
    assert set(found.geoms) == {"left_wheel", "right_wheel", "left_caster", "right_caster"}
    assert len(found.brakes) == 2 and len(found.anti_tippers) == 2
    assert START > 0.0


def test_a_chair_whose_frame_meets_the_kerb_before_its_wheels_has_not_passed():
    """The power chair's footrest stands over the edge of a kerb of 150 mm before a wheel does."""
    assert climb(Design("power", 100.0), 0.15, "climbed", "forward", False) == (False, None)
