"""Files of a laboratory, of a planar person, by a generator that knows nothing of the package."""

import contextlib
import dataclasses
import io

import numpy as np
import pytest
from five_segments import Chair, Hidden, Person
from lab_formats import Rim, Style
from raw_files import (
    LATE,
    Plan,
    clocks,
    gather_command,
    moved_share,
    write,
    write_static,
)

import mjchair
from mjchair.cli import main
from mjchair.commands.gather import _of_markers
from mjchair.errors import MjchairError, MjchairNote
from mjchair.measurement.baseline import hands_off
from mjchair.measurement.clocks import Signal, align_slowing
from mjchair.measurement.gather.gather import gather
from mjchair.measurement.gather.known import Known
from mjchair.measurement.markers import Markers, read_markers
from mjchair.measurement.notes import once
from mjchair.measurement.smartwheel import read_smartwheel
from mjchair.motion.chair_frame import bridged, in_chair
from mjchair.motion.marker_set import find_marker_set
from mjchair.report.gathered import gathered_figure
from mjchair.simulation.table import Table

PLAN = Plan(Person(torque=16.0), Hidden(rolling=0.005), pushes=1, coasts=0, seconds=6.0)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """One pushed run: the folder, and what truly happened."""
    place = tmp_path_factory.mktemp("raw")
    return place, write(PLAN, place / "raw", place / "truth")


@pytest.fixture(scope="module")
def gathered(made):
    """The trial of the gathered study, and gather's log."""
    place, _ = made
    with contextlib.redirect_stdout(io.StringIO()):
        assert main(gather_command(PLAN, place / "raw", place / "study")) == 0
    log = (place / "study" / "gather.log").read_text()
    return mjchair.read_study(place / "study").runs[0].trial, log


@pytest.fixture
def rims(tmp_path):
    """A function that writes a plan's rims, without markers, and gives their folder and runs."""

    def make(**changes):
        plan = dataclasses.replace(PLAN, **changes)
        runs = write(plan, tmp_path / "raw", tmp_path / "truth")
        for path in (tmp_path / "raw").glob("*.c3d"):
            path.unlink()
        return tmp_path / "raw", runs

    return make


def test_wheels_come_back_with_their_signs_speed_and_torque(made, gathered):
    _, (run,) = made
    trial, _ = gathered
    inputs = trial.inputs
    for side in ("left", "right"):
        torque = inputs.controls[f"{side}_wheel"]
        there = np.isfinite(torque)
        true = run.hand(inputs.time[there] + LATE["right"])
        assert abs(np.mean(torque[there] - true)) < 0.05  # the offset of 0.25 N m is taken off
        assert np.std(torque[there] - true) < 0.15  # noise of 0.12 N m
        angle = trial.channels[f"{side}_wheel_angle"]
        there = np.isfinite(angle)
        true = run.way(trial.time[there] + LATE["right"]) / Chair().rear_radius
        assert true[-1] > 3.0
        assert np.std(angle[there] - true) < 0.002  # rad; a tick is 0.0015


def test_clocks_and_the_persons_motion_come_back(made, gathered):
    place, runs = made
    found = clocks(gathered[1])
    assert found["right"]["push1"] == pytest.approx(LATE["right"], abs=0.0003)
    assert found["markers"]["push1"] == pytest.approx(LATE["markers"], abs=0.0008)
    # segments of Winter seen as those of de Leva: not quite the displacement that truly was
    assert 0.85 < moved_share(place / "study", place / "truth", runs) < 1.05


@pytest.mark.parametrize(
    "changes",
    [
        {"style": Style(semicolon=True, columns=25)},
        {"style": Style(wrap=False), "rim": Rim(jump=40)},
        {"start": 0.9},
    ],
    ids=["25 columns, decimal commas", "an encoder that jumps", "rolling at first, no baseline"],
)
def test_worse_files_of_the_same_motion_give_the_same(changes, rims):
    raw, (run,) = rims(**changes)
    if "start" in changes:
        for path in raw.glob("baseline*"):
            path.unlink()
    (trial,) = gather(raw, Known(mass=90.0)).trials
    for side in ("left", "right"):
        there = np.isfinite(trial.columns[f"{side}_wheel"])
        off = trial.columns[f"{side}_wheel"] - run.hand(trial.time + LATE["right"])
        assert abs(np.mean(off[there])) < 0.05 and np.std(off[there]) < 0.15
        there = np.isfinite(trial.columns[f"{side}_wheel_angle"])
        true = run.way(trial.time[there] + LATE["right"]) / Chair().rear_radius
        assert np.std(trial.columns[f"{side}_wheel_angle"][there] - true) < 0.002


def test_a_coast_that_never_stops_has_one_clock(rims):
    """A straight line has no lag of its own; two wheels of a chair have one speed."""
    raw, _ = rims(pushes=0, coasts=1)
    (trial,) = gather(raw, Known(mass=90.0)).trials
    found = trial.alignments["coast1_right.csv"]
    assert found.how == "course of the run"
    assert abs(found.offset - LATE["right"]) < 4.0 * found.offset_std < 0.01


def test_coasts_that_stop_have_the_clock_of_instruments_that_were_started_together(rims):
    raw, _ = rims(pushes=0, coasts=3, seconds=10.0)
    found = gather(raw, Known(mass=90.0))
    assert any("one for all 3 recordings" in note for note in found.notes)
    assert "# clock of right rim on that of left rim: one for all 3" in found.files["study.toml"]
    clocks = [t.alignments[f"{t.name}_right.csv"] for t in found.trials]
    assert len({one.offset for one in clocks}) == 1
    assert abs(clocks[0].offset - LATE["right"]) < 4.0 * clocks[0].offset_std < 0.0005
    late = raw / "coast2_right.csv"  # one that was started by hand
    late.write_text("\n".join(late.read_text().splitlines()[24:]) + "\n")
    found = gather(raw, Known(mass=90.0))
    assert any("each keeps its own" in note for note in found.notes)
    for trial, true in zip(found.trials, (0.15, 0.25, 0.15), strict=True):
        one = trial.alignments[f"{trial.name}_right.csv"]
        assert abs(one.offset - true) < 4.0 * one.offset_std < 0.002


def seen(path, still=None):
    """The way and the heading of a chair by its markers, without the person's joints."""
    markers = read_markers(path)
    chosen = find_marker_set(markers.names).of(markers.names)
    placed = in_chair(markers, chosen, bridged(markers.time, markers.positions))
    sways = 0.02 * np.sin(markers.time)
    columns = {"chair_speed": placed.speed, "chair_heading": placed.heading, "rider_motion": sways}
    return Table(markers.time, columns, str(path)), []


def test_runs_to_and_fro_have_their_headings(tmp_path):
    plan = dataclasses.replace(PLAN, pushes=2, seconds=10.0)
    runs = write(plan, tmp_path / "raw", tmp_path / "truth")
    found = gather(tmp_path / "raw", Known(mass=90.0), of_markers=seen)
    for name, text in found.files.items():
        (tmp_path / name).write_text(text)
    study = mjchair.read_study(tmp_path)
    for run, true, towards in zip(study.runs, runs, (0.0, np.pi), strict=True):
        assert "heading" in run.given and run.initial.heading == pytest.approx(towards, abs=0.01)
        assert true.towards == np.cos(towards)
    assert found.summary[1].endswith("left rim, right rim, markers; faces 180 deg")
    (*_, last) = gathered_figure(found.trials).axes
    assert last.get_ylabel() == "rider_motion (mm)"
    (line, _) = last.get_lines()
    assert np.ptp(line.get_ydata()) == pytest.approx(40.0, abs=1.0)
    # on rollers the chair does not go anywhere, and a floor has no slope
    rollers = gather(tmp_path / "raw", Known(mass=90.0, floor="rollers"), of_markers=seen)
    assert "heading =" not in rollers.files["study.toml"]


@pytest.mark.parametrize("turn", [0.0, 0.5 * np.pi, np.pi, 2.0])
def test_a_chair_that_rolls_backward_faces_where_its_front_is(turn):
    time = np.arange(0.0, 4.0, 0.01)
    ahead, left = (
        np.array([np.cos(turn), np.sin(turn), 0.0]),
        np.array([-np.sin(turn), np.cos(turn), 0]),
    )
    marks = {
        "LASI": (0.1, 0.12, 0.6), "RASI": (0.1, -0.12, 0.6), "LPSI": (-0.1, 0.05, 0.6),
        "RPSI": (-0.1, -0.05, 0.6), "C7": (-0.1, 0.0, 1.1), "LSHO": (0.0, 0.2, 1.1),
        "RSHO": (0.0, -0.2, 1.1),
    }  # fmt: skip
    for speed in (0.7, -0.7):
        x, y, z = np.array(list(marks.values())).T
        placed = x[:, None] * ahead + y[:, None] * left + z[:, None] * [0.0, 0.0, 1.0]
        moved = placed + speed * time[:, None, None] * ahead
        markers = Markers(time, tuple(marks), moved, "run")
        found = in_chair(markers, find_marker_set(markers.names).of(markers.names))
        assert np.allclose(np.exp(1j * found.heading), np.exp(1j * turn), atol=1e-6)
        assert np.allclose(found.speed, speed, atol=1e-6)


def test_one_reading_of_noise_is_no_hand(rims):
    raw, _ = rims(pushes=0, coasts=1)
    run = read_smartwheel(raw / "coast1_left.csv")
    forces = run.forces.copy()
    forces[500, 0] += 20.0
    assert hands_off(dataclasses.replace(run, forces=forces)).all()
    forces[900:1000, 5] += 5.0
    assert not hands_off(dataclasses.replace(run, forces=forces))[890:1010].any()


def test_a_weak_start_from_rest_is_no_coast(rims):
    # The trunk moves the chair most where the hands are off, and the wheel passes half a turn.
    raw, _ = rims(person=Person(torque=10.0), pushes=1, coasts=1, seconds=10.0)
    trials = {trial.name: trial for trial in gather(raw, Known()).trials}
    assert trials["push1"].driven
    assert not trials["coast1"].driven
    free = {one.side: one.free.mean() for one in trials["push1"].instruments}
    assert all(0.5 < share < 0.65 for share in free.values())


def test_lines_that_repeat_are_said_once():
    said = once(["a.csv: 3.5 turns", "b: left", "c.csv: 4.5 turns", "one for all: 2", "b: left"])
    assert said == ["a.csv, c.csv: 3.5 to 4.5 turns", "b: left", "one for all: 2"]


def test_the_terminal_has_a_line_or_two_a_trial(made, tmp_path, capsys):
    place, _ = made
    assert main(gather_command(PLAN, place / "raw", tmp_path / "study")) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("push1  push, 5.8 s: left rim, right rim, markers; faces 0 deg")
    assert lines[1].strip().startswith("clocks: push1_right.csv +0.1")
    assert lines[-1] == f"next: mjchair diagnose {tmp_path / 'study'}"
    assert len(lines) < 7
    log = (tmp_path / "study" / "gather.log").read_text()
    # an arm that stood at -60 deg in each recovery made the person's acceleration 28 % wrong
    assert "at the limit of what a body reaches" not in log
    assert "rim's weight 6.0 N once a turn taken off" in log and "plug_in_gait: up is +y" in log


def test_noise_is_at_least_a_step_of_the_encoder(tmp_path):
    """A chair that stands shows one reading."""
    time = np.arange(0.0, 12.0, 0.01)
    angle = np.cumsum(np.clip(3.0 - 0.4 * np.maximum(time - 2.0, 0.0), 0.0, 3.0)) * 0.01
    step = 2.0 * np.pi / 500
    rows = np.column_stack([time, step * np.floor(angle / step)])
    header = "time,left_wheel_angle"
    np.savetxt(tmp_path / "run.csv", rows, "%.7g", ",", header=header, comments="")
    noise = gather(tmp_path).noise["left_wheel_angle"]
    assert step / np.sqrt(12.0) <= noise < 1.1 * step / np.sqrt(12.0)


def test_equal_speed_tells_a_clock_only_where_a_chair_slows_alike():
    rng = np.random.default_rng(2)
    time = np.arange(0.0, 8.0, 0.01)

    def seen(speed):
        return Signal(time, speed + 0.005 * rng.normal(size=time.size))

    def found(slope):
        return align_slowing(seen(4.0 - slope * time), seen(4.0 - slope * (time + 0.2)))

    assert found(0.4).offset == pytest.approx(0.2, abs=0.01)
    assert found(0.05) is None  # 1 % of the speed is 0.7 s of it
    assert align_slowing(seen(4.0 - 0.4 * time), seen(3.9 - 0.2 * time)) is None  # another floor
    assert align_slowing(seen(1.0 + 0.4 * time), seen(1.1 + 0.4 * time)) is None


def test_swapped_names_are_asked_about(rims):
    raw, _ = rims()
    for one in ("push1", "baseline"):
        left, right = raw / f"{one}_left.csv", raw / f"{one}_right.csv"
        content = left.read_bytes(), right.read_bytes()
        left.write_bytes(content[1])
        right.write_bytes(content[0])
    with pytest.warns(MjchairNote, match=r"push1_left\.csv, push1_right\.csv: .* swapped, or"):
        gather(raw, Known(mass=90.0))


def test_a_trial_whose_sides_are_swapped_does_not_turn_the_others(rims):
    raw, (run, other) = rims(pushes=2, seconds=9.5)
    assert other.way(9.5) > run.way(9.5)
    left, right = raw / "push2_left.csv", raw / "push2_right.csv"  # the run that goes farther
    content = left.read_bytes(), right.read_bytes()
    left.write_bytes(content[1])
    right.write_bytes(content[0])
    with pytest.warns(MjchairNote, match=r"^push2_left\.csv, push2_right\.csv: .* swapped, or"):
        one, _ = gather(raw, Known(mass=90.0)).trials
    there = np.isfinite(one.columns["left_wheel"])
    off = one.columns["left_wheel"] - run.hand(one.time + LATE["right"])
    assert np.std(off[there]) < 0.15


def test_a_chair_that_is_not_seen_for_a_while_still_tells_its_clock(rims):
    raw, (run,) = rims(seconds=10.0)
    time = np.arange(0.0, 10.0 - LATE["markers"], 0.01)
    truly = time + LATE["markers"]
    speed = np.interp(truly, run.rolled.time, run.rolled.speed)
    speed[(truly > 2.0) & (truly < 4.5)] = np.nan
    rows = np.column_stack([time, np.sin(time), speed])
    lines = [",".join("" if x != x else f"{x:.6g}" for x in row) for row in rows]
    text = "\n".join(["time,rider_motion,chair_speed", *lines])
    (raw / "push1_rider.csv").write_text(text)
    (trial,) = gather(raw, Known(mass=90.0)).trials
    found = trial.alignments["push1_rider.csv"]
    assert found.offset == pytest.approx(LATE["markers"], abs=0.005)


def test_runs_of_two_persons_are_not_put_into_one_study(tmp_path):
    rng = np.random.default_rng(0)
    for name, stature in (("short", 1.75), ("tall", 2.0)):
        (tmp_path / name).mkdir()
        person = dataclasses.replace(PLAN.person, stature=stature)
        write_static(dataclasses.replace(PLAN, person=person), tmp_path / name, rng)
    read = _of_markers(Known())
    read(tmp_path / "short" / "static.c3d", None)
    read(tmp_path / "short" / "static.c3d", None)
    with pytest.raises(MjchairError, match=r"of another person than .* is 1\.1. times as long"):
        read(tmp_path / "tall" / "static.c3d", None)


def test_pushes_are_drawn_before_coasts(rims):
    raw, _ = rims(coasts=1)
    found = gather(raw, Known(mass=90.0))
    assert [trial.name for trial in found.trials] == ["coast1", "push1"]
    titles = [axes.get_title(loc="left") for axes in gathered_figure(found.trials).axes[::2]]
    assert [title.split("\n")[0] for title in titles] == ["push1", "coast1"]
