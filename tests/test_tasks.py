"""The tasks: conformance, the suite's own checks, determinism, and baselines that solve them."""

import mujoco
import numpy as np
import pytest
from absl.testing import absltest
from conftest import has_graphics
from dm_env import test_utils

import mjchair
from mjchair import tasks
from mjchair.model.mass_distribution import mass_distribution
from mjchair.simulation.standing import Fall, fall_of_run
from mjchair.tasks import arena, ramp_hold
from mjchair.tasks.baselines import Drive
from mjchair.tasks.standing_watch import StandingWatch

drawn = pytest.mark.skipif(not has_graphics(), reason="no offscreen OpenGL on this machine")

FLAT = "observations"  # what dm_control calls them where they are flat

NAMES = tuple(tasks.TASKS)
LIGHT = {"visual_geoms": False}


def load(name, seed=0, **options):
    return tasks.load(name, {"random": seed}, **{**LIGHT, **options})


def random_actions(environment, count, seed=1):
    spec = environment.action_spec()
    random = np.random.RandomState(seed)
    return [random.uniform(spec.minimum, spec.maximum) for _ in range(count)]


def play(environment, actions):
    """Time steps of an episode or more, a reset first."""
    return [environment.reset(), *(environment.step(action) for action in actions)]


# dm_env's own conformance checks, once a task
for _name in NAMES:

    class _Conformance(test_utils.EnvironmentTestMixin, absltest.TestCase):
        task = _name

        def make_object_under_test(self):
            return load(self.task, environment_kwargs={"time_limit": 0.3})

        def make_action_sequence(self):
            yield from random_actions(self.environment, 40)

    _Conformance.__name__ = _Conformance.__qualname__ = f"Test_{_name}"
    globals()[_Conformance.__name__] = _Conformance
del _Conformance


@pytest.fixture(params=NAMES)
def name(request):
    return request.param


def test_observations_and_rewards_keep_their_bounds(name):
    environment = load(name)
    spec, action_spec = environment.observation_spec(), environment.action_spec()
    assert action_spec.shape == (2,) and np.isfinite(action_spec.minimum).all()
    assert environment.physics.model.nu > 2, "the tires' own controls stay out of the action"
    for step in play(environment, random_actions(environment, 300)):
        assert set(step.observation) == set(spec)
        for key, value in step.observation.items():
            spec[key].validate(value)
            assert np.isfinite(spec[key].minimum).all() and np.isfinite(spec[key].maximum).all()
        if step.first():
            assert step.reward is None and step.discount is None
        else:
            assert isinstance(step.reward, float) and 0.0 <= step.reward <= 1.0
            assert isinstance(step.discount, float) and 0.0 <= step.discount <= 1.0


def test_every_element_is_named_and_there_are_cameras(name):
    model = tasks.load(name).physics.model
    kinds = {
        "body": "nbody",
        "joint": "njnt",
        "geom": "ngeom",
        "site": "nsite",
        "camera": "ncam",
        "light": "nlight",
        "mesh": "nmesh",
        "texture": "ntex",
        "material": "nmat",
        "equality": "neq",
        "actuator": "nu",
        "sensor": "nsensor",
    }
    for kind, size in kinds.items():
        assert all(model.id2name(i, kind) for i in range(getattr(model, size))), kind
    assert model.ncam >= 2


def test_same_seed_same_episode_to_the_bit(name):
    runs = []
    for _ in range(2):
        environment = load(name, seed=7)
        steps = play(environment, random_actions(environment, 150))
        runs.append((steps, environment.physics.get_state()))
    for one, other in zip(runs[0][0], runs[1][0], strict=True):
        assert (one.step_type, one.reward, one.discount) == (
            other.step_type,
            other.reward,
            other.discount,
        )
        for key in one.observation:
            assert np.array_equal(one.observation[key], other.observation[key]), key
    assert np.array_equal(runs[0][1], runs[1][1])


def test_another_seed_and_another_episode_differ(name):
    environment = load(name, seed=42)
    first, second = environment.reset().observation, environment.reset().observation
    other = load(name, seed=43).reset().observation
    assert any((first[key] != second[key]).any() for key in first)
    assert any((first[key] != other[key]).any() for key in first)


def test_looks_change_no_observation(name):
    runs = []
    for visual_geoms in (True, False):
        environment = tasks.load(name, {"random": 3}, visual_geoms=visual_geoms)
        runs.append(play(environment, random_actions(environment, 60))[-1].observation)
    for key in runs[0]:
        assert np.array_equal(runs[0][key], runs[1][key]), key


def test_observations_share_no_memory(name):
    environment = load(name)
    steps = play(environment, random_actions(environment, 1))
    for key, value in steps[0].observation.items():
        assert not np.may_share_memory(value, steps[1].observation[key])


def test_no_observation_is_constant(name):
    environment = load(name)
    actions = [a for k in range(40) for a in random_actions(environment, 1, k) * 12]
    seen = [step.observation for _ in range(2) for step in play(environment, actions)]
    for key in seen[0]:
        values = np.array([observation[key] for observation in seen])
        task = name.removeprefix("power_")
        if (task, key) in {("tight_turn", "walls"), ("doorway", "walls"), ("slalom", "side")}:
            values = values[:, :1]  # no wall within reach of some feelers; no post passed
        if (task, key) != ("slalom", "side"):
            assert (values != values[0]).any(axis=0).all(), key


def test_flat_observations(name):
    environment = load(name, environment_kwargs={"flat_observation": True})
    spec = environment.observation_spec()
    assert set(spec) == {FLAT}
    step = play(environment, random_actions(environment, 3))[-1]
    spec[FLAT].validate(step.observation[FLAT])


def test_the_baseline_solves_it(name):
    environment = load(name, seed=11)
    spec = environment.action_spec()
    for _ in range(2):
        controller, step, rewards = tasks.baseline(name), environment.reset(), []
        while not step.last():
            action = np.clip(controller(step.observation), spec.minimum, spec.maximum)
            step = environment.step(action)
            rewards.append(step.reward)
        assert environment.task.solved(environment.physics)
        assert np.mean(rewards) > 0.7 and step.discount == 1.0


def test_random_torques_do_not_solve_it(name):
    environment = load(name)
    for action in [environment.reset(), *random_actions(environment, 500)][1:]:
        if environment.step(action).last():
            break
    assert not environment.task.solved(environment.physics)


def test_gymnasium_takes_it(name):
    pytest.importorskip("gymnasium", reason="the extra [tasks] is not installed")
    pytest.importorskip("shimmy", reason="the extra [tasks] is not installed")
    import gymnasium
    from gymnasium.utils.env_checker import check_env

    environment = gymnasium.make(f"mjchair/{name}-v0")
    check_env(environment.unwrapped, skip_render_check=True)
    seen, _ = environment.reset(seed=5)
    same = load(name, seed=5).reset().observation
    assert all(np.array_equal(seen[key], same[key]) for key in same)


def test_observations_are_described(name):
    told = tasks.describe(name).splitlines()
    environment = load(name)
    assert [line.split()[0] for line in told] == list(environment.observation_spec())
    assert all(": " in line and "[" in line for line in told)


def test_tires_are_on():
    """Full torque to one side turns the chair; without tire forces nothing would."""
    environment = load("straight_line")
    environment.reset()
    for _ in range(40):
        environment.step(np.array([-15.0, 15.0]))
    assert environment.physics.yaw_rate() > 1.0
    mjchair.uninstall()
    environment.reset()
    for _ in range(40):
        environment.step(np.array([-15.0, 15.0]))
    assert abs(environment.physics.yaw_rate()) < 0.1


def test_touching_a_post_ends_the_episode():
    environment = load("slalom")
    step = environment.reset()
    for _ in range(400):
        step = environment.step(np.array([4.0, 4.0]))
        if step.last():
            break
    assert step.last() and step.discount == 0.0 and step.reward == 0.0
    assert environment.physics.touches()


def still(environment):
    """Let a loaded environment go without torques; the time at which its episode ends, s."""
    for _ in range(150):
        if environment.step(np.zeros(2)).last():
            break
    return environment.physics.time()


def lean(environment, angle):
    """Turn the chair about its own x axis, 2 m above the floor, where nothing touches it."""
    data = environment.physics.data
    turn, moved = np.array([np.cos(0.5 * angle), np.sin(0.5 * angle), 0.0, 0.0]), np.zeros(4)
    mujoco.mju_mulQuat(moved, data.qpos[3:7], turn)
    data.qpos[3:7] = moved
    data.qpos[2] += 2.0


@pytest.mark.parametrize(("angle", "end"), [(0.5, 0.5), (0.7, 0.5), (0.87, 0.02)])
def test_an_episode_ends_by_the_rule_of_a_recording(angle, end):
    """In the air for 0.5 s, or more than 45 deg from the floor's normal; not at 40 deg."""
    environment = load("straight_line")
    environment.reset()
    lean(environment, angle)
    assert still(environment) == pytest.approx(end, abs=0.021)
    assert environment.task.fall is (Fall.TIPPED if angle > 0.785 else Fall.OFF_GROUND)
    environment.reset()
    assert environment.task.fall is None


@pytest.mark.parametrize(("borne", "fall"), [("", Fall.OFF_GROUND), ("rear", None)])
def test_all_six_wheels_of_a_mid_drive_chair_count(borne, fall):
    """A chair on its two rear casters alone has not left the ground."""
    physics = arena.physics(mjchair.load_spec("power_mid"))
    watch = StandingWatch(physics)
    physics.data.sensordata[:] = 0.0
    if borne:
        for side in ("left", "right"):
            physics.data.sensor(f"{side}_rear_caster_tire").data[2] = 400.0
    for physics.data.time in (0.0, 0.3, 0.6):
        watch.update(physics)
    assert watch.fall is fall


def test_an_episode_and_a_recording_agree_on_a_fall():
    """A chair thrown over sideways: the fall of the run, by the recording's own function."""
    environment = load("straight_line")
    environment.reset()
    physics = environment.physics
    physics.data.qvel[3] = 4.5  # rad/s, about the chair's x axis
    samples = []
    for _ in range(150):
        step = environment.step(np.zeros(2))
        samples.append((physics.time(), physics.data.qpos.copy(), physics.data.sensordata.copy()))
        if step.last():
            break
    assert step.discount == 0.0
    time, qpos, sensed = (np.array(column) for column in zip(*samples, strict=True))
    fallen = fall_of_run(physics.model.ptr, time, qpos, sensed)
    assert fallen.kind is environment.task.fall
    assert fall_of_run(physics.model.ptr, time[:-1], qpos[:-1], sensed[:-1]) is None


def test_a_drive_has_the_numbers_of_its_chair():
    manual, power = (Drive.of(mjchair.load_spec(m).compile()) for m in ("manual", "power"))
    assert (manual.radius, manual.track, manual.arm) == pytest.approx((0.3, 0.56, 0.12), abs=1e-4)
    assert power.radius == pytest.approx(0.17)
    parts = mass_distribution(mjchair.load_spec().compile())
    assert (parts.mass, parts.ahead, parts.yaw_inertia) == pytest.approx(
        (90.0, 0.12, 5.63), abs=0.01
    )


def test_hands_rest_between_strokes():
    environment = load("push")
    environment.reset()
    torques = []
    for _ in range(100):
        environment.step(np.array([20.0, 0.0]))
        torques.append(environment.physics.data.ctrl[:2].copy())
    torques = np.array(torques)
    on = torques[:, 0] > 0.0
    strokes = np.flatnonzero(np.diff(on.astype(int)) == 1)
    assert np.diff(strokes) * 0.02 == pytest.approx(0.96, abs=0.021)
    assert 19.0 < torques[:, 0].max() <= 20.0 and not torques[:, 1].any()


def test_a_controller_that_knows_the_lateral_force_is_better():
    environment = load("follow_path", scene_kwargs={"grade": 0.06})
    spec, errors = environment.action_spec(), {}
    for lateral in (False, True):
        offsets = []
        for seed in range(3):
            environment.task.random.seed(seed)
            controller, step = tasks.baseline("follow_path", lateral=lateral), environment.reset()
            while not step.last():
                step = environment.step(
                    np.clip(controller(step.observation), spec.minimum, spec.maximum)
                )
                offsets.append(step.observation["offset"][0])
        errors[lateral] = np.sqrt(np.mean(np.square(offsets)))
    assert errors[True] < 0.6 * errors[False]


@drawn
def test_a_picture_shows_what_to_do(name):
    """Of goal, path, walls or posts, a part of the first picture (by segmentation)."""
    environment = tasks.load(name, {"random": 0})
    environment.reset()
    physics = environment.physics
    seen = {"goal", "line", "mark", "wall", "post"}
    picture = physics.render(120, 160, camera_id="follow", segmentation=True)
    kinds = picture[..., 0][picture[..., 1] == int(mujoco.mjtObj.mjOBJ_GEOM)]
    names = {physics.model.id2name(int(i), "geom").partition("_")[0] for i in set(kinds)}
    assert names & seen, names


def test_the_goal_in_the_picture_is_that_of_the_task():
    def plate(physics):
        return physics.named.data.mocap_pos["goal"]

    environment = load("ramp_hold", visual_geoms=True)
    environment.reset()
    for moment in (0.0, 9.5):
        environment.physics.data.time = moment
        environment.task.show_goal(environment.physics)
        x, _, z = plate(environment.physics)
        here = environment.physics.position()[0]
        to_go = (x - here) * np.hypot(1.0, ramp_hold.GRADE)
        assert to_go == pytest.approx(environment.task.to_go(environment.physics))
        assert z - x * ramp_hold.GRADE == pytest.approx(0.003)
    environment = load("push", visual_geoms=True)
    environment.reset()
    for _ in range(50):
        environment.step(np.zeros(2))
    assert plate(environment.physics)[0] == pytest.approx(environment.task.target * 1.0, rel=0.05)


@drawn
def test_pixels_on_request():
    environment = tasks.load(
        "straight_line", {"random": 0}, pixels={"height": 48, "width": 64, "camera_id": "follow"}
    )
    picture = environment.reset().observation["pixels"]
    assert picture.shape == (48, 64, 3) and picture.std() > 5.0
    with pytest.raises(mjchair.MjchairError, match="need the visual geoms"):
        tasks.load("straight_line", visual_geoms=False, pixels=True)


@drawn
def test_a_small_picture_costs_no_large_buffer():
    """Every size has a buffer, a shadow map and a sampling of its own, in whatever order."""
    physics = tasks.load("straight_line", {"random": 0}).physics
    before = physics.model.vis.quality.shadowsize, physics.model.vis.global_.offwidth
    alone = physics.render(84, 84, camera_id="follow")
    large = physics.render(height=300, width=400, camera_id="follow")
    assert large.shape == (300, 400, 3)
    assert np.array_equal(physics.render(84, 84, camera_id="follow"), alone)
    small = physics._sized[84, 84].mujoco.ptr
    assert (small.offWidth, small.offHeight, small.offSamples) == (84, 84, 0)
    assert small.shadowSize == 512 and physics._sized[300, 400].mujoco.ptr.offSamples > 0
    assert (physics.model.vis.quality.shadowsize, physics.model.vis.global_.offwidth) == before
    averaged = large.reshape(300, 400, 3).mean(axis=(0, 1))
    assert averaged == pytest.approx(alone.mean(axis=(0, 1)), abs=25.0), "the same scene"
    physics.free()


def test_an_unknown_task_is_named():
    with pytest.raises(mjchair.MjchairError, match="did you mean 'slalom'"):
        tasks.load("slalon")


def test_a_path_of_ones_own():
    path = [(0, 0), (1, 0), (2, 0.3), (3, 0.3), (4, 0.0)]
    environment = tasks.load("follow_path", {"random": 0, "path": path}, visual_geoms=False)
    environment.reset()
    assert environment.task.course.length == pytest.approx(4.1, abs=0.1)
    assert environment.task.course.at(1.0)[0] == pytest.approx((1.0, 0.0), abs=0.03)
    with pytest.raises(mjchair.MjchairError, match="a path has shape"):
        tasks.load("follow_path", {"path": [(0, 0), (1, 0)]}, visual_geoms=False)


def test_a_recorded_episode_is_the_episode():
    """The same rewards and places as stepping it by hand, with every sensor of the chair."""
    steps, places, rewards = 0, [], []
    environment, controller = load("tight_turn", visual_geoms=True), tasks.baseline("tight_turn")
    step = environment.reset()
    while not step.last():
        places.append(environment.physics.data.qpos.copy())
        step = environment.step(controller(step.observation))
        rewards.append(step.reward)
        steps += 1
    places.append(environment.physics.data.qpos.copy())
    episode = tasks.record(load("tight_turn", visual_geoms=True), tasks.baseline("tight_turn"))
    np.testing.assert_array_equal(episode.qpos, places)
    np.testing.assert_array_equal(episode["reward"][1:], rewards)
    assert episode.time.size == steps + 1
    load_on_wheels = sum(episode[f"{wheel}_tire.Fz"] for wheel in episode.wheels)
    weight = 9.81 * environment.physics.model.body_subtreemass[0]
    assert np.median(load_on_wheels) == pytest.approx(weight, rel=0.03)
    assert episode.replay().html.count("left_wheel_tire.Fy") >= 1


@pytest.mark.parametrize(
    ("options", "line"),
    [
        (
            {"task_kwargs": {"randm": 0}},
            "option of the task 'randm'; did you mean 'random'",
        ),
        ({"task_kwargs": {"random": "a"}}, "random is 'a'; it must be a whole number"),
        ({"task_kwargs": {"random": -1}}, "random is -1; it must be a whole number from 0"),
        ({"environment_kwargs": {"flat_obs": True}}, "of the environment 'flat_obs'"),
        ({"scene_kwargs": {"grad": 0.1}}, "option of the scene 'grad'; did you mean 'grade'"),
        ({"pixels": {"height": 0}}, "height is 0; it must be a whole number, 1 to 4096 pixels"),
        ({"pixels": {"width": 84.5}}, "width is 84.5; it must be a whole number"),
        ({"pixels": {"heigth": 84}}, "option of pixels 'heigth'; did you mean 'height'"),
        ({"pixels": {"camera_id": "folow"}}, "unknown camera 'folow'; did you mean 'follow'"),
    ],
)
def test_a_wrong_option_gets_one_line(options, line):
    with pytest.raises(mjchair.MjchairError) as refused:
        tasks.load("slalom", **options)
    assert line in str(refused.value) and "\n" not in str(refused.value)


@pytest.mark.parametrize("name", ["straight_line", "push", "power_slalom"])
@pytest.mark.parametrize(
    ("action", "line"),
    [
        ([np.nan, 0.0], " is nan; give 2 finite numbers: "),
        ([0.0, np.inf], " is inf; give 2 finite numbers: "),
        ([1.0], r"action has shape \(1,\); give 2"),
        ([1.0, 2.0, 3.0], r"action has shape \(3,\); give 2"),
        (["a", 1.0], r"action is \['a', 1.0\]; give 2"),
    ],
)
def test_a_wrong_action_gets_one_line_with_the_name_of_the_component(name, action, line):
    environment = tasks.load(name, {"random": 0}, visual_geoms=False)
    environment.reset()
    components = environment.action_spec().name.split("\t")
    with pytest.raises(mjchair.MjchairError, match=line + ".*" + ", ".join(components)[-5:]):
        environment.step(action)
    environment.step([1e3, -1e3])  # beyond the bounds it is clipped, and the chair is whole
    assert np.isfinite(environment.physics.data.qpos).all()
