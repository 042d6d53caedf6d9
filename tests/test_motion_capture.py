"""A motion that is known, seen by markers, comes back; bad files get one line."""

from dataclasses import replace

import imageio_ffmpeg
import mujoco
import numpy as np
import pytest
from conftest import has_graphics
from lab_formats import write_c3d

import mjchair
from mjchair.cli import main
from mjchair.errors import MjchairError, MjchairNote
from mjchair.measurement.markers import Markers, read_markers
from mjchair.motion import inverse_kinematics
from mjchair.motion.capture import captured
from mjchair.motion.chair_frame import bridged, in_chair
from mjchair.motion.inverse_kinematics import Build
from mjchair.motion.marker_set import find_marker_set, read_marker_set
from mjchair.report.marker_film import MarkerFilm, write_marker_film
from mjchair.rider.anatomy import JOINTS
from mjchair.rider.rider import Rider

drawn = pytest.mark.skipif(not has_graphics(), reason="no offscreen OpenGL on this machine")
RATE, FRAMES = 50.0, 40
PELVIS = {"LASI": (0.1, 0.12), "RASI": (0.1, -0.12), "LPSI": (-0.1, 0.05), "RPSI": (-0.1, -0.05)}
MOVES = {  # joint -> rad about the chair's posture
    "rider_trunk_flexion": 0.25,
    "rider_trunk_twist": 0.1,
    "rider_left_shoulder_flexion": 0.5,
    "rider_right_shoulder_flexion": 0.45,
    "rider_left_elbow_flexion": -0.35,
    "rider_right_elbow_flexion": -0.3,
}


@pytest.fixture(scope="module")
def truth():
    """Angles, and the Plug-in Gait markers of a person of 1.66 m in the chair's axes."""
    model = mjchair.load_spec("manual", rider=Rider(stature=1.66)).compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    chair = model.body("chair").id
    base, axes = data.xpos[chair].copy(), data.xmat[chair].reshape(3, 3).copy()
    marks = read_marker_set("plug_in_gait")
    phase = np.arange(FRAMES) / RATE * 2 * np.pi * 0.9
    angles = {
        joint.name: MOVES.get(joint.name, 0.0) * np.sin(phase + 0.3 * i)
        for i, joint in enumerate(JOINTS)
    }
    names = [*marks.landmarks, *PELVIS]
    out = np.zeros((FRAMES, len(names), 3))
    for k in range(FRAMES):
        for name, values in angles.items():
            data.joint(name).qpos[0] = values[k]
        mujoco.mj_forward(model, data)
        for m, mark in enumerate(marks.landmarks.values()):
            out[k, m] = (data.site(f"rider_{mark}").xpos - base) @ axes
        for m, (x, y) in enumerate(PELVIS.values(), start=len(marks.landmarks)):
            out[k, m] = (x + 0.12, y, 0.6)
    noise = np.random.default_rng(0).normal(size=out.shape) * 0.001
    return names, out + noise, angles


def c3d(path, names, positions, unit="m", factor=1.0):
    """Write markers as C3D; y up, and the chair going along -z at 1 m/s."""
    turned = np.stack([-positions[..., 1], positions[..., 2], -positions[..., 0]], axis=2)
    turned[..., 1] += 0.1
    turned[..., 2] -= (np.arange(len(positions)) / RATE * 1.4)[:, None]
    return write_c3d(path, list(names), turned, RATE, unit=unit, factor=factor)


@pytest.fixture(scope="module")
def motion(truth, tmp_path_factory):
    names, positions, _ = truth
    seen = positions.copy()
    seen[10:14, names.index("LELB")] = np.nan  # 0.1 s: bridged
    seen[20:38, [names.index(n) for n in ("RWRA", "RWRB", "RFIN")]] = np.nan  # 0.36 s: left empty
    path = c3d(tmp_path_factory.mktemp("c3d") / "run.c3d", names, seen)
    return captured(path)


def test_the_angles_come_back(truth, motion):
    _, _, angles = truth
    for name in MOVES:
        there = np.isfinite(motion.angles[name])
        assert there.sum() > 15
        off = motion.angles[name][there] - angles[name][there]
        assert np.std(off) < np.radians(3.0), name  # shape; the chair's place leaves an offset
    assert max(motion.residuals.values()) < 0.012


def test_lengths_axes_and_way_are_told(motion):
    said = " ".join(motion.notes)
    assert "up is +y" in said
    assert "forward is -z" in said
    assert motion.rider.stature == pytest.approx(1.66, abs=0.04)


def test_forward_is_the_way_rolled_not_where_the_run_ends(truth):
    names, positions, _ = truth
    one = positions + np.r_[1.0, 0, 0] * np.linspace(0.0, 1.5, FRAMES)[:, None, None]
    time = np.arange(2 * FRAMES) / RATE
    back = one - np.r_[4.0, 0, 0]  # carried back behind the start, unseen for a while
    both = np.concatenate([one, back])
    both[FRAMES - 3 : FRAMES + 3] = np.nan
    marks = read_marker_set("plug_in_gait").of(names)
    placed = in_chair(Markers(time, tuple(names), both, "run"), marks)
    assert "forward is +x" in placed.axes or "forward is (+1.00" in placed.axes
    turned = np.stack([-both[..., 0], -both[..., 1], both[..., 2]], axis=2)  # along -x
    placed_turned = in_chair(Markers(time, tuple(names), turned, "run"), marks)
    seen = np.isfinite(placed.positions)
    off = placed_turned.positions[seen] - placed.positions[seen]
    assert np.abs(off).max() < 1e-9


def test_a_length_that_the_static_trial_does_not_tell_comes_from_the_run(truth):
    names, run, _ = truth
    chosen = read_marker_set("plug_in_gait")
    still = run.copy()
    still[:, names.index("LSHO")] = np.nan
    rider, _ = inverse_kinematics._rider([still, run], tuple(names), chosen, Build())
    assert {"left_upper_arm", "right_upper_arm"} <= set(rider.lengths)
    blind = run.copy()
    blind[:, [names.index(name) for name in ("LELB", "RELB")]] = np.nan
    rider, notes = inverse_kinematics._rider([blind], tuple(names), chosen, Build())
    assert (
        not rider.lengths and "none measured, since no trial has markers at both ends" in notes[0]
    )


@drawn
def test_a_film_has_a_ball_at_every_marker_that_is_seen(motion, tmp_path):
    def picture(placed):
        with MarkerFilm(replace(motion, placed=placed), 320, 180) as film:
            return film.frame(0).astype(int)

    nothing = np.full_like(motion.placed, np.nan)
    one = nothing.copy()
    one[:, 0] = (0.15, 0.0, 1.3)  # over the head, which hides no ball there
    red, green, blue = picture(one)[np.abs(picture(one) - picture(nothing)).max(axis=2) > 30].T
    ball = (red > 1.5 * green) & (green > blue)
    assert 3 < ball.sum() < 100, "one small ball of orange"
    path = tmp_path / "rider.mp4"
    short = replace(motion, time=motion.time[:7], placed=motion.placed[:7], qpos=motion.qpos[:7])
    write_marker_film(short, path)
    assert imageio_ffmpeg.count_frames_and_secs(str(path))[0] == 3  # 50 Hz filmed at 15
    with pytest.raises(MjchairError, match=r"written as \.mp4"):
        write_marker_film(short, tmp_path / "rider.avi")


def test_short_gaps_are_bridged_and_long_ones_left_empty(motion):
    assert np.isfinite(motion.angles["rider_left_elbow_flexion"][10:14]).all()
    assert np.isnan(motion.angles["rider_right_wrist_flexion"][21:36]).all()
    assert np.isfinite(motion.angles["rider_right_shoulder_flexion"]).all()


def test_the_table_drives_the_moving_rider(motion, tmp_path):
    from mjchair.motion.capture import table_text

    (tmp_path / "rider.csv").write_text(table_text(motion))
    inputs = mjchair.read_inputs(
        tmp_path / "rider.csv", mjchair.load_spec("manual", rider="moving").compile()
    )
    assert set(MOVES) <= set(inputs.controls)


def test_gaps_at_the_ends_are_not_bridged():
    time = np.arange(6) / 10.0
    track = np.full((6, 1, 3), np.nan)
    track[1, 0], track[3, 0] = 1.0, 3.0
    out = bridged(time, track)
    np.testing.assert_allclose(out[1:4, 0, 0], [1.0, 2.0, 3.0])
    assert np.isnan(out[[0, 4, 5], 0, 0]).all()


def trc(path, names, positions):
    header = ["PathFileType\t4\t(X/Y/Z)\tx.trc", "DataRate\tNumFrames\tNumMarkers\tUnits"]
    header += [
        f"{RATE}\t{len(positions)}\t{len(names)}\tmm",
        "Frame#\tTime\t" + "\t\t\t".join(names),
        "\t\tX1\tY1\tZ1",
    ]
    rows = [
        "\t".join([str(k + 1), f"{k / RATE:.4f}", *(f"{1000 * v:.3f}" for v in frame.ravel())])
        for k, frame in enumerate(positions)
    ]
    path.write_text("\n".join([*header, "", *rows]) + "\n")


def test_a_trc_file_that_is_cut_off_is_said_and_its_broken_frame_left_out(truth, tmp_path):
    names, positions, _ = truth
    trc(tmp_path / "a.trc", names, positions)
    text = (tmp_path / "a.trc").read_text()
    lines = text.splitlines()
    (tmp_path / "a.trc").write_text("\n".join(lines[:-10])[:-40])
    said = f"tells {FRAMES} frames, and {FRAMES - 10} are there: it is cut off; the last one is not"
    with pytest.warns(MjchairNote, match=said):
        read = read_markers(tmp_path / "a.trc")
    np.testing.assert_allclose(read.positions, positions[: FRAMES - 11], atol=1e-6)


def test_a_trc_file_is_the_c3d_file(truth, tmp_path):
    names, positions, _ = truth
    trc(tmp_path / "a.trc", names, positions)
    read = read_markers(tmp_path / "a.trc")
    assert read.names == tuple(names)
    np.testing.assert_allclose(read.positions, positions, atol=1e-6)
    assert read.rate == pytest.approx(RATE)


def test_sets_are_told_by_their_names(truth):
    names = [f"Subject1:{name.lower()}" for name in truth[0]]
    assert find_marker_set(names).name == "plug_in_gait"
    with pytest.raises(MjchairError, match="no marker set knows these markers"):
        find_marker_set(["a", "b", "c"])


def bad(case, names, positions):
    """A file that is wrong in one way: names, positions, unit and factor."""
    swapped = [
        {"L": "R", "R": "L"}.get(n[0], n[0]) + n[1:] if n not in PELVIS else n for n in names
    ]
    gone = positions.copy()
    gone[:, : len(names) - 4] = np.nan
    unseen = positions.copy()
    unseen[:, -4:] = np.nan
    long = positions.copy()
    arm = names.index("LELB")
    long[:, arm] += 3.0 * (positions[:, arm] - positions[:, names.index("LSHO")])
    return {
        "swapped": (swapped, positions, "m", 1.0),
        "mm called m": (names, positions, "m", 1000.0),
        "gap throughout": (names, gone, "m", 1.0),
        "no chair": (names[:-4], positions[:, :-4], "m", 1.0),
        "chair unseen": (names, unseen, "m", 1.0),
        "too long": (names, long, "m", 1.0),
        "unknown unit": (names, positions, "furlong", 1.0),
    }[case]


@pytest.mark.parametrize(
    ("case", "line"),
    [
        ("swapped", "their sides are swapped"),
        ("mm called m", "are they in mm called m?"),
        ("gap throughout", "cannot be told|0 markers of the person were ever seen"),
        ("no chair", "no marker on the chair or the pelvis"),
        ("chair unseen", "no marker on the chair or the pelvis was ever seen"),
        ("too long", "times what is usual"),
        ("unknown unit", "unit 'furlong' of its points"),
    ],
)
def test_bad_markers_get_one_line_and_nothing_is_written(case, line, truth, tmp_path, capsys):
    import re

    names, positions, unit, factor = bad(case, truth[0], truth[1])
    path = c3d(tmp_path / "bad.c3d", names, positions, unit, factor)
    out = tmp_path / "rider.csv"
    assert main(["rider", str(path), "--out", str(out)]) == 2
    said = capsys.readouterr().err
    assert re.search(line, said), said
    assert said.count("\n") == 1
    assert not out.exists()


def test_a_c3d_without_points_says_so(tmp_path):
    c3d(tmp_path / "empty.c3d", [], np.zeros((5, 0, 3)))
    with pytest.raises(MjchairError, match=r"without points"):
        read_markers(tmp_path / "empty.c3d")
    (tmp_path / "text.c3d").write_text("not a C3D")
    with pytest.raises(MjchairError, match="cannot read"):
        read_markers(tmp_path / "text.c3d")


def test_a_marker_that_is_not_where_the_set_has_it_is_named(truth, tmp_path, capsys):
    names, positions, _ = truth
    off = positions.copy()
    off[:, names.index("CLAV"), 0] += 0.3
    run, out = c3d(tmp_path / "run.c3d", names, off), str(tmp_path / "rider.csv")
    assert main(["rider", str(run), "--out", out]) == 0
    (line,) = [x for x in capsys.readouterr().out.splitlines() if x.startswith("more than 80 mm")]
    assert "CLAV" in line and "LFIN" not in line


def test_a_static_trial_with_other_names_is_refused(truth, tmp_path):
    names, positions, _ = truth
    run = c3d(tmp_path / "run.c3d", names, positions)
    static = c3d(tmp_path / "static.c3d", [f"other{k}" for k in range(len(names))], positions)
    line = r"static\.c3d: the static trial has 0 of the .* markers of the person in .*run\.c3d"
    with pytest.raises(MjchairError, match=line):
        captured(run, static=static)


def test_two_people_are_told_apart(truth, tmp_path):
    names, positions, _ = truth
    run = c3d(tmp_path / "run.c3d", names, positions)
    tall = positions[:20].copy()
    for side in "LR":
        hand = [names.index(f"{side}{n}") for n in ("WRA", "WRB", "FIN")]
        elbow = names.index(f"{side}ELB")
        tall[:, hand] += 0.25 * (tall[:, hand] - tall[:, [elbow]])
    static = c3d(tmp_path / "static.c3d", names, tall)
    with pytest.raises(
        MjchairError, match=r"static\.c3d: .* of another person: its (left|right)_forearm is 1\.2"
    ):
        captured(run, static=static)
