"""A replay shows what was recorded, in one file, in a browser without a network."""

import dataclasses
import html
import io
import json
import re
import zipfile

import mujoco
import numpy as np
import pytest
from browser import Page, program
from PIL import Image

import mjchair
from mjchair.cli import main
from mjchair.errors import MjchairError
from mjchair.measurement.trial import Trial
from mjchair.report.replay.measured import measured_track
from mjchair.report.replay.page import Replay, replay
from mjchair.report.replay.track import RATE, poses, slerp, track
from mjchair.simulation.recording import GRAVITY
from mjchair.simulation.stored_model import StoredModel

CLOSE = 1e-4  # m
LARGEST = 3e6  # bytes
browser = pytest.mark.skipif(program() is None, reason="no Chromium on this machine")


@pytest.fixture(scope="module")
def turning():
    """A run that pushes, turns and bumps over a threshold, 12 s."""
    spec = mjchair.load_spec("manual", scene="threshold", step=0.01)
    pushes = mjchair.push_strokes({"left_wheel": 16.0, "right_wheel": 13.0}, duration=12.0)
    return mjchair.simulate(spec, pushes, initial={"speed": 0.7}, sample_rate=250.0)


@pytest.fixture(scope="module")
def other():
    torque = mjchair.constant({"left_wheel": 4.0, "right_wheel": 6.0}, 2.0)
    return mjchair.simulate(mjchair.load_spec("manual"), torque, initial={"speed": 1.0})


@pytest.fixture(scope="module")
def shown(turning, other, tmp_path_factory):
    """The page of both, on disk."""
    path = tmp_path_factory.mktemp("replay") / "run.html"
    replay(turning, {"the other": other}).save(path)
    return path


@pytest.fixture(scope="module")
def page(shown):
    """The page in a browser, drawn."""
    with Page(shown, 640, 720) as opened:
        opened.value("window.mjchair.ready.then(() => 0)")
        yield opened


def recorded_poses(recording, samples):
    return poses(recording.model.load(), recording.qpos[samples])


# ---- what is put into the page -----------------------------------------------------------------


def test_twelve_seconds_at_sixty_pictures_fit(turning, tmp_path):
    whole = replay(turning)
    assert len(whole.html.encode()) <= LARGEST
    assert np.diff(track(turning).time).max() <= 1.0 / RATE + 1.0 / 250.0
    assert not any("thinned" in note for note in whole.notes)


def test_between_its_samples_it_stays_close_to_the_recording(turning):
    kept = track(turning)
    places, quaternions = recorded_poses(turning, slice(None))
    after = np.clip(np.searchsorted(kept.time, turning.time, side="right"), 1, kept.time.size - 1)
    span = kept.time[after] - kept.time[after - 1]
    share = ((turning.time - kept.time[after - 1]) / span)[:, None]
    straight = (
        kept.places[after - 1] * (1 - share[..., None]) + kept.places[after] * share[..., None]
    )
    assert np.abs(straight - places).max() < CLOSE
    turned = slerp(kept.quaternions[after - 1], kept.quaternions[after], share)
    cosine = np.abs(np.einsum("nbi,nbi->nb", turned, quaternions))
    assert 2.0 * np.arccos(np.minimum(cosine, 1.0)).max() < 3e-4  # rad


def test_an_hour_is_thinned_and_says_so(other):
    samples = np.minimum(np.arange(36_000) * 7 % other.time.size, other.time.size - 1)
    hour = dataclasses.replace(
        other,
        time=0.1 * np.arange(samples.size),
        channels={name: values[samples] for name, values in other.channels.items()},
        controls={name: values[samples] for name, values in other.controls.items()},
        qpos=other.qpos[samples],
        qvel=other.qvel[samples],
    )
    thinned = replay(hour, most=1000)
    assert any(note.startswith("thinned: 0.278 samples a second") for note in thinned.notes)
    assert "thinned: 0.278" in thinned.html
    assert len(thinned.html) <= LARGEST


def test_the_page_names_no_address(turning):
    assert not re.search(
        r"https?://|@import|url\(|<link (?!rel=.icon. href=.data:)", replay(turning).html
    )


def test_names_from_outside_are_text_and_no_page(other):
    page = replay(other, title="</title><b>x", label="</script><b>y").html
    assert "<b>x" not in page and "<b>y" not in page


def test_a_frame_holds_the_whole_page(other):
    frame = Replay('<p title="a">b & c</p>').frame(300)
    held = re.search(r'srcdoc="(.*?)"', frame)[1]
    assert html.unescape(held) == '<p title="a">b & c</p>'
    assert "=" not in held and "<" not in held
    assert "height:300px" in frame


# ---- a measured run as a ghost -----------------------------------------------------------------


@pytest.mark.parametrize(
    ("channels", "within"),
    [
        (["position.x", "position.y", "heading"], 0.005),
        (["left_wheel_angle", "right_wheel_angle", "heading"], 0.03),
        (["left_wheel_speed", "right_wheel_speed"], 0.12),
        (["velocity.x", "imu_gyro.z"], 0.03),
    ],
)
def test_a_measured_chair_goes_where_its_channels_say(other, channels, within):
    """Told from channels that a simulation made, the chair's bodies are where they were."""
    trial = Trial("m", other.time, {name: other[name] for name in channels}, None, {})
    told = measured_track(other, trial, "m")
    places, _ = recorded_poses(other, np.searchsorted(other.time, told.time - 1e-9))
    assert np.ptp(places[:, 1, 0]) > 1.0  # m: it went somewhere
    assert np.linalg.norm(told.places - places, axis=-1).max() < within


def test_where_it_was_measured_from_another_corner_of_the_room(other):
    """Places and heading in other axes: the same motion from the recording's start."""
    turn, shift = 1.1, np.array([4.0, -2.0])
    c, s = np.cos(turn), np.sin(turn)
    moved = other.vector("position")[:, :2] @ np.array([[c, s], [-s, c]]) + shift
    channels = {
        "position.x": moved[:, 0],
        "position.y": moved[:, 1],
        "heading": (other["heading"] + turn + np.pi) % (2 * np.pi) - np.pi,
    }
    told = measured_track(other, Trial("m", other.time + 7.0, channels, None, {}), "m")
    places, _ = recorded_poses(other, slice(None))
    assert told.time[0] == other.time[0]
    assert np.linalg.norm(told.places - places, axis=-1).max() < 0.005


def test_without_a_channel_of_travel_it_is_refused(other):
    trial = Trial("m", other.time, {"imu_gyro.z": other["imu_gyro.z"]}, None, {})
    with pytest.raises(MjchairError, match="how far the chair went"):
        measured_track(other, trial, "m")


# ---- in a browser ------------------------------------------------------------------------------


@browser
def test_it_opens_offline_without_a_request_or_an_error(page):
    assert page.value("mjchair.drawn")
    assert page.requests == [] and page.errors == []
    assert page.value("performance.getEntriesByType('resource').length") == 0


@browser
def test_poses_read_back_are_those_of_the_recording(page, turning, other):
    for number, recording in enumerate((turning, other)):
        model = recording.model.load()
        data = mujoco.MjData(model)
        names = [model.body(i).name for i in range(model.nbody)]
        for sample in np.random.default_rng(3).integers(0, recording.time.size, 12):
            data.qpos[:] = recording.qpos[sample]
            mujoco.mj_kinematics(model, data)
            asked, time = json.dumps(names), float(recording.time[sample])
            got = page.value(f"{asked}.map((body) => mjchair.pose({time}, body, {number}))")
            got = np.array(got)
            assert np.linalg.norm(got[:, :3] - data.xpos, axis=1).max() < CLOSE
            assert np.abs(np.einsum("bi,bi->b", got[:, 3:], data.xquat)).min() > 1 - 1e-7


@browser
def test_what_is_drawn_stands_at_the_poses(page):
    """The forces' switch and the time change the picture, and the picture is one."""
    page.value("mjchair.seek(2.0)")
    first = picture(page)
    assert len(np.unique(first.reshape(-1, 3), axis=0)) > 500
    page.press("f")
    without = picture(page)
    assert (first != without).any()
    page.press("f")
    assert (picture(page) == first).mean() > 0.999
    page.value("mjchair.seek(6.0)")
    assert (picture(page) != first).any()


@browser
def test_keys_mouse_and_touch_move_the_time(page, turning):
    page.value("mjchair.seek(1.0)")
    page.press("End")
    assert page.value("mjchair.time") == pytest.approx(turning.time[-1], abs=1e-4)
    page.press("Home")
    page.press("ArrowRight")
    assert 0.0 < page.value("mjchair.time") <= 1.0 / RATE + 1e-6
    page.press(" ")
    page.wait("mjchair.time > 0.05")
    page.press(" ")
    played = page.value("mjchair.time")
    assert page.value("new Promise((d) => setTimeout(() => d(mjchair.time), 200))") == played
    box = first_diagram(page)
    middle = (box[0] + 0.5 * box[2], box[1] + 0.5 * box[3])
    page.mouse("mousePressed", *middle)
    page.mouse("mouseReleased", *middle)
    assert page.value("mjchair.time") == pytest.approx(0.5 * turning.time[-1], rel=0.1)
    page.touch("touchStart", [(box[0] + 0.25 * box[2], middle[1])])
    page.touch("touchEnd", [])
    assert page.value("mjchair.time") < 0.4 * turning.time[-1]


@browser
def test_the_pointer_over_a_diagram_tells_the_values_there(page, turning):
    page.value("mjchair.seek(0)")
    box = first_diagram(page)
    torque = turning["left_wheel"]
    at = turning.time[int(np.argmax(torque))]
    x = box[0] + 46 + at / turning.time[-1] * (box[2] - 50)
    page.mouse("mouseMoved", x, box[1] + 20)
    told = (
        "parseFloat((document.querySelector('.panel p').innerText.match(/left (\\S+)/) || [])[1])"
    )
    page.wait(f"Math.abs({told} / {torque.max()} - 1.0) < 0.02")


@browser
def test_the_camera_follows_stays_or_looks_from_above(page):
    page.value("mjchair.seek(0)")
    seen = []
    for key in "123":
        page.press(key)
        seen.append(picture(page))
    assert (seen[2] != seen[0]).any()
    page.press("2")
    pressed = page.value("document.querySelector('[aria-pressed=true]').textContent")
    assert pressed == "Orbit"
    assert page.errors == []


@browser
def test_gravity_that_leans_points_down_in_the_picture_of_a_telephone(other, tmp_path):
    """As on a platform that tilts. The window is small, and all of the page fits its width."""
    lean = np.linspace(0.1, 0.4, other.time.size)  # rad, towards the chair's front left
    down = np.column_stack([np.sin(lean) * 0.8, np.sin(lean) * 0.6, -np.cos(lean)])
    gravity = dict(zip(GRAVITY, (9.81 * down).T, strict=True))
    tilted = dataclasses.replace(other, channels=dict(other.channels) | gravity)
    replay(tilted).save(tmp_path / "run.html")
    sample = other.time.size // 2
    followed = track(other)
    at = int(np.searchsorted(followed.time, other.time[sample]))
    middle = followed.path[at] + (0.0, 0.0, 0.4)
    with Page(tmp_path / "run.html", 390, 780) as opened:
        opened.value("window.mjchair.ready.then(() => 0)")
        opened.value(f"mjchair.seek({followed.time[at]})")
        along = [list(middle + s * down[sample]) for s in (-0.4, 0.0, 0.4)]
        columns, rows = np.transpose(opened.value(f"{json.dumps(along)}.map(mjchair.pixel)"))
        assert np.ptp(columns) < 1.0 and (np.diff(rows) > 20.0).all()
        assert opened.value("document.documentElement.scrollWidth") <= 390
        under = "document.getElementById('forces').getBoundingClientRect().top"
        assert opened.value(f"{under} >= document.getElementById('scene').clientHeight")
        assert opened.errors == []


@browser
def test_without_webgl_it_is_a_still_picture_and_one_line(shown):
    with Page(shown, webgl=False) as opened:
        opened.value("window.mjchair.ready.then(() => 0)")
        assert not opened.value("mjchair.drawn")
        assert "no WebGL" in opened.value("document.getElementById('notice').innerText")
        assert opened.value("document.getElementById('still').naturalWidth") > 100
        assert opened.value("document.getElementById('scene').hidden")
        assert len(opened.value("mjchair.pose(1, 'chair')")) == 7
        assert opened.requests == [] and opened.errors == []


def first_diagram(page):
    """Left, top, width and height of the first diagram, pixels, after it has been scrolled to."""
    return page.value(
        "(() => {const box = document.querySelector('.panel .box'); box.scrollIntoView();"
        "const r = box.getBoundingClientRect(); return [r.left, r.top, r.width, r.height]})()"
    )


def picture(page):
    """The drawn part of the page as an array, after it has been drawn."""
    page.value("scrollTo(0, 0)")
    page.value("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
    return np.asarray(Image.open(io.BytesIO(page.picture())).convert("RGB"))[:400]


# ---- the command, and bad input ----------------------------------------------------------------


def replayed(*arguments):
    return main(["replay", *(str(a) for a in arguments)])


def test_the_command_writes_one_file(other, tmp_path, capsys):
    other.save(tmp_path / "recording.npz")
    columns = ["time", "left_wheel_speed", "right_wheel_speed"]
    rows = np.column_stack([other[c] for c in columns])[::10]
    table = tmp_path / "measured.csv"
    table.write_text(",".join(columns) + "\n" + "\n".join(",".join(map(str, r)) for r in rows))
    out = tmp_path / "new" / "run.html"
    assert replayed(tmp_path, "--ghost", table, "--ghost", tmp_path, "--out", out) == 0
    assert f"{out}: " in capsys.readouterr().out
    assert [p.name for p in out.parent.iterdir()] == ["run.html"]
    header = re.search(r'id="header">(.*?)</script>', out.read_text())[1]
    labels = [t["label"] for t in json.loads(header)["tracks"]]
    assert labels == ["simulated", "measured", tmp_path.name]
    before = out.read_text()
    assert replayed(tmp_path, "--out", out) == 2
    assert "--force" in capsys.readouterr().err and out.read_text() == before
    assert replayed(tmp_path, "--out", out, "--force") == 0


def damaged(recording, path, **changes):
    """A saved recording with entries of its file changed."""
    recording.save(path)
    with np.load(path) as file:
        arrays = {name: file[name] for name in file.files}
    arrays |= changes
    np.savez_compressed(path, **arrays)
    return path


def refused(path, capsys):
    """The one line on standard error."""
    out = path.parent / "run.html"
    assert replayed(path, "--out", out) == 2
    assert not out.exists()
    error = capsys.readouterr().err
    assert (
        error.startswith("mjchair: ") and error.count("\n") == 1 and "fault of mjchair" not in error
    )
    return error


def test_a_truncated_or_broken_recording_is_one_line(other, tmp_path, capsys):
    path = tmp_path / "recording.npz"
    other.save(path)
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    assert "not an mjchair recording" in refused(path, capsys)
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        start = archive.getinfo("qpos.npy").header_offset + 60
    path.write_bytes(content[:start] + bytes(200) + content[start + 200 :])
    assert "not an mjchair recording" in refused(path, capsys)


def test_positions_of_another_model_are_refused(other, tmp_path, capsys):
    path = damaged(other, tmp_path / "recording.npz", qpos=other.qpos[:, :-1])
    assert "its model" in refused(path, capsys)
    path = damaged(other, tmp_path / "recording.npz", qpos=other.qpos * np.nan)
    assert "not numbers" in refused(path, capsys)


def test_a_model_without_its_meshes_is_one_line(other, tmp_path, capsys):
    text = b'<mujoco><asset><mesh name="a" file="gone.stl"/></asset></mujoco>'
    path = damaged(other, tmp_path / "recording.npz", model=np.frombuffer(text, np.uint8))
    assert "gone.stl" in refused(path, capsys)
    cut = dataclasses.replace(other, model=StoredModel("mjb", other.model.content[:1000]))
    cut.save(path)
    assert "does not load" in refused(path, capsys)


def test_a_recording_of_an_older_version_is_shown(other, tmp_path):
    """Version 1 as it was at first: no `hold`, no `reason`, no tire channels beyond the forces."""
    path = tmp_path / "recording.npz"
    other.save(path)
    with np.load(path) as file:
        arrays = {name: file[name] for name in file.files}
    header = json.loads(str(arrays["header"]))
    del header["hold"]
    keep = [i for i, name in enumerate(header["channels"]) if "_tire" not in name]
    header["channels"] = [header["channels"][i] for i in keep]
    arrays["channels"] = arrays["channels"][:, keep]
    arrays["header"] = np.array(json.dumps(header))
    np.savez_compressed(path, **arrays)
    assert replayed(path, "--out", tmp_path / "run.html") == 0


@pytest.mark.parametrize("name", ["run.mp4", "run"])
def test_another_ending_is_refused(name, other, tmp_path, capsys):
    other.save(tmp_path / "recording.npz")
    assert replayed(tmp_path, "--out", tmp_path / name) == 2
    assert ".html" in capsys.readouterr().err
