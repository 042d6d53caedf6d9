import dataclasses
import subprocess

import imageio_ffmpeg
import mujoco
import numpy as np
import pytest
from conftest import has_graphics

import mjchair
from mjchair.errors import MjchairError
from mjchair.report import gl
from mjchair.report.colours import FORCES, rgb
from mjchair.report.film import LONGEST, Film, samples_at, write_film, write_frame
from mjchair.report.film_legend import Scale
from mjchair.report.forces import WheelForces, round_up, wheel_forces

drawn = pytest.mark.skipif(not has_graphics(), reason="no offscreen OpenGL on this machine")


@pytest.fixture(scope="module")
def turning():
    torque = mjchair.constant({"left_wheel": 14.0, "right_wheel": 4.0}, 1.0)
    start = {"speed": 1.0, "heading": 0.7}
    return mjchair.simulate(mjchair.load_spec("manual"), torque, initial=start, sample_rate=50.0)


def posed(run, sample):
    model = run.model.load()
    data = mujoco.MjData(model)
    data.qpos[:] = run.qpos[sample]
    mujoco.mj_kinematics(model, data)
    return model, data


def test_force_directions_are_those_of_the_wheel(turning):
    model, data = posed(turning, 20)
    for wheel in wheel_forces(model, data, turning, 20):
        forward = np.cross(wheel.left, [0.0, 0.0, 1.0])
        for component, direction, channel in (
            ("longitudinal", forward, "Fx"),
            ("lateral", wheel.left, "Fy"),
            ("load", [0.0, 0.0, 1.0], "Fz"),
        ):
            expected = turning[f"{wheel.wheel}_tire.{channel}"][20]
            assert wheel.forces[component] @ direction == pytest.approx(
                expected, abs=1e-6 + 1e-3 * abs(expected)
            )
        assert abs(wheel.contact[2]) < 0.003  # m: it sinks in a little


def test_forces_accelerate_the_chair_as_recorded(turning):
    """The tires' forces, in world axes, are the mass times the acceleration of the centre."""
    model = turning.model.load()
    data = mujoco.MjData(model)
    centres = []
    for qpos in turning.qpos:
        data.qpos[:] = qpos
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        centres.append(data.subtree_com[0].copy())
    step = turning.time[1]
    acceleration = np.diff(centres, 2, axis=0) / step**2
    mass = model.body_mass.sum()
    for sample in (15, 25, 35):
        model_, data_ = posed(turning, sample)
        forces = wheel_forces(model_, data_, turning, sample)
        total = sum(f for wheel in forces for f in wheel.forces.values())
        horizontal = acceleration[sample - 1][:2] * mass
        np.testing.assert_allclose(total[:2], horizontal, atol=3.0)  # N of some 60


def close_to(pixels, colour):
    """Where a frame shows a colour, shaded or lit."""
    wanted = np.asarray(rgb(colour)) / np.linalg.norm(rgb(colour))
    size = np.linalg.norm(pixels.astype(float), axis=-1)
    cosine = pixels.astype(float) @ wanted / np.maximum(size, 1.0)
    saturation = np.ptp(pixels.astype(float), axis=-1)
    return (cosine > 0.97) & (saturation > 80)


def one_force(run, wheel, component, newtons):
    """The recording with one force alone, the same at every sample."""
    letter = {"lateral": "Fy", "longitudinal": "Fx", "load": "Fz"}[component]
    channels = dict(run.channels)
    for name in run.channels:
        if name.endswith((".Fx", ".Fy", ".Fz")):
            value = newtons if name == f"{wheel}_tire.{letter}" else 0.0
            channels[name] = np.full(run.time.size, value)
    return dataclasses.replace(run, channels=channels)


@drawn
@pytest.mark.parametrize("component", list(FORCES))
@pytest.mark.parametrize("wheel", ["left_wheel", "right_caster"])
def test_an_arrow_of_the_right_colour_is_near_the_wheel_that_carries_the_force(
    turning, wheel, component
):
    run = one_force(turning, wheel, component, 40.0)
    nothing = one_force(turning, wheel, component, 0.0)
    # seen from where the wheel is not hidden; the top view cannot see a load
    view = "side" if component == "load" else "top"
    if wheel == "left_wheel" and view == "side":
        wheel = "right_wheel"
        run = one_force(turning, wheel, component, 40.0)
    with Film(run, 480, 360, view) as film:
        with_arrow = film.frame(20)
        forces = next(w for w in film.wheel_forces(20) if w.wheel == wheel)
        (arrow, *others) = film.arrows(forces)
        start, end = arrow.start, arrow.end
        base, tip = film.pixel(start, 20), film.pixel(end, 20)
    with Film(nothing, 480, 360, view) as film:
        without = film.frame(20)
    assert arrow.component == component and not others
    legend = np.zeros(with_arrow.shape[:2], bool)
    legend[:90, :260] = True
    new = close_to(with_arrow, FORCES[component]) & ~close_to(without, FORCES[component])
    rows, columns = np.nonzero(new & ~legend)
    assert rows.size > 15
    # all of it between the arrow's ends, and reaching from one to the other
    ends = np.array([base, tip], float)
    along = ends[1] - ends[0]
    length = np.linalg.norm(along)
    share = (np.column_stack([columns, rows]) - ends[0]) @ along / length**2
    assert -0.25 < share.min() < 0.35
    assert 0.75 < share.max() < 1.25


@drawn
def test_the_legend_names_every_colour(turning):
    with Film(turning, 480, 360) as film:
        corner = film.frame(10)[300:]
    for colour in FORCES.values():
        assert close_to(corner, colour).sum() > 20


@drawn
@pytest.mark.parametrize(("width", "height"), [(640, 480), (480, 480), (960, 540)])
@pytest.mark.parametrize("view", ["front", "behind", "side"])
def test_the_legend_hides_neither_the_person_nor_the_chair(turning, width, height, view):
    with Film(turning, width, height, view) as film:
        film.frame(10)
        hidden = np.asarray(film._overlay)[..., 3] > 0
        hair = film.model.geom("chair_manual_hair")
        first = film.model.mesh_vertadr[hair.dataid[0]]
        points = film.model.mesh_vert[first : first + film.model.mesh_vertnum[hair.dataid[0]] : 20]
        head = points @ film.data.geom(hair.id).xmat.reshape(3, 3).T + film.data.geom(hair.id).xpos
        for point in (*head, *film.data.geom_xpos[1:]):
            column, row = film.pixel(point, 10)
            assert not hidden[row, column]
    assert hidden.any()


@drawn
def test_every_film_has_the_scale_that_its_legend_shows(turning):
    """Twice the force is twice the arrow, in whatever recording; beyond the longest it is cut."""
    lengths = {}
    for newtons in (20.0, 40.0, 4000.0):
        with Film(one_force(turning, "left_wheel", "lateral", newtons), 64, 48) as film:
            forces = next(w for w in film.wheel_forces(20) if w.wheel == "left_wheel")
            (arrow,) = film.arrows(forces)
            lengths[newtons] = np.linalg.norm(arrow.end - arrow.start)
            assert arrow.cut == (newtons > 1000.0) and arrow.size == pytest.approx(newtons)
    assert lengths[20.0] == pytest.approx(20.0 / Scale().horizontal)
    assert lengths[40.0] == pytest.approx(40.0 / Scale().horizontal)
    assert lengths[4000.0] == pytest.approx(LONGEST)


@drawn
def test_from_above_the_floor_keeps_still_while_the_chair_turns(turning):
    """A point of the floor a metre ahead in the world stays in its direction in the picture."""
    with Film(turning, 480, 360, "top") as film:
        for sample in (0, 25, 50):
            film.frame(sample)
            here = turning.vector("position")[sample]
            there = here + np.array([0.5, 0.0, 0.0])
            ahead = np.subtract(film.pixel(there, sample), film.pixel(here, sample))
            assert ahead[0] > 20 and abs(ahead[1]) <= 2  # the world's x is the picture's right


@drawn
@pytest.mark.parametrize("scene", ["ramp", "cross_slope"])
def test_a_tilted_floor_is_seen_as_one(scene):
    """The horizon is level, the floor has ends, and its grade is written."""
    torque = mjchair.constant({"left_wheel": 8.0, "right_wheel": 8.0}, 0.3)
    run = mjchair.simulate(mjchair.load_spec("manual", scene), torque, sample_rate=20.0)
    with Film(run, 320, 240, "side") as film:
        pixels = film.frame(3).astype(int)
        assert film._grade == pytest.approx(1 / 12, rel=1e-3)
    sky = pixels[..., 2] > pixels[..., 0] + 25
    # below the legend, left and right of the chair: where the sky ends is level to a pixel
    ends = [int(np.flatnonzero(sky[70:, column])[-1]) for column in (4, 30, 290, 315)]
    assert max(ends) - min(ends) <= 1


@drawn
def test_gravity_that_leans_is_seen_as_a_tilted_floor():
    """Points a metre apart along gravity stand above one another in the picture."""
    spec = mjchair.load_spec("manual", "cross_slope", grade=0.2, tilt="gravity")
    run = mjchair.simulate(spec, None, 0.1, sample_rate=20.0, brakes=True)
    up = -run.down()[0]
    assert up @ [0.0, 0.0, 1.0] == pytest.approx(np.cos(np.arctan(0.2)))
    with Film(run, 320, 240, "front") as film:
        here = film._middle()
        above = np.subtract(film.pixel(here + 0.5 * up, 0), film.pixel(here, 0))
        leaning = np.subtract(film.pixel(here + np.array([0.0, 0.0, 0.5]), 0), film.pixel(here, 0))
    assert abs(above[0]) <= 1 and above[1] < -20
    assert abs(leaning[0]) > 4


@drawn
def test_a_film_has_its_frames_and_its_size(turning, tmp_path):
    write_film(turning, tmp_path / "a.mp4", fps=8, width=160, height=120)
    frames, seconds = imageio_ffmpeg.count_frames_and_secs(str(tmp_path / "a.mp4"))
    assert frames == 9
    assert seconds == pytest.approx(9 / 8, abs=0.1)
    assert [p.name for p in tmp_path.iterdir()] == ["a.mp4"]


@drawn
def test_a_frame_is_written(turning, tmp_path):
    write_frame(turning, tmp_path / "a.png", 0.5, width=160, height=120)
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")


def test_frames_are_taken_at_their_times(turning):
    assert turning.time[samples_at(turning, 10.0)] == pytest.approx(np.arange(11) / 10.0)
    assert turning.time[samples_at(turning, 10.0, 0.2)] == pytest.approx(np.arange(51) / 50.0)
    with pytest.raises(MjchairError, match="both must be positive"):
        samples_at(turning, 0.0)


@pytest.mark.parametrize(
    ("options", "line"),
    [
        ({"path": "a.avi"}, "a film is written as .mp4"),
        ({"width": 161}, "even numbers"),
        ({"width": 10, "height": 10}, "size is 10x10 pixels; each side must be 48 to 4096"),
        ({"width": 100000}, "size is 100000x540 pixels"),
        ({"view": "inside"}, "unknown view 'inside'; did you mean 'side'"),
        ({"fps": -1.0}, "both must be positive"),
    ],
)
def test_bad_options_get_one_line_and_leave_nothing(turning, tmp_path, options, line):
    path = tmp_path / options.pop("path", "a.mp4")
    with pytest.raises(MjchairError, match=line):
        write_film(turning, path, **options)
    assert not list(tmp_path.iterdir())


def test_without_opengl_there_is_one_line_that_says_what_to_install(monkeypatch):
    failed = subprocess.CompletedProcess([], 1)
    monkeypatch.setattr(gl.subprocess, "run", lambda *a, **k: failed)
    gl.backend.cache_clear()
    try:
        with pytest.raises(gl.NoGraphicsError, match="apt-get install libosmesa6") as caught:
            gl.backend()
        assert "\n" not in str(caught.value)
    finally:
        gl.backend.cache_clear()


def test_scales_are_round():
    assert [round_up(x) for x in (0.9, 1.0, 1.2, 3.0, 7.0, 130.0)] == [1, 1, 2, 5, 10, 200]


def test_wheel_forces_are_plain_data():
    assert dataclasses.is_dataclass(WheelForces)
