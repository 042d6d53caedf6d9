"""A short training run on the CPU: PPO learns to go 5 m and stop.

In: the number of training steps, each 0.1 s of driving. Out, in a folder: learning.png (the mean
reward of episodes over training, with that of random torques and of the baseline controller),
policy.zip, and episode.mp4: an episode of the trained policy.

Needs the extras [tasks] and [learn] (Gymnasium, Shimmy, Stable-Baselines3, PyTorch). 80,000 steps
take some minutes on two cores; the rewards are in docs/tasks.md.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import gymnasium
import imageio_ffmpeg
import matplotlib
import mediapy
import numpy as np
from gymnasium.wrappers import FlattenObservation, RescaleAction
from shimmy import DmControlCompatibilityV0
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import DummyVecEnv, VecNormalize

from mjchair import tasks
from mjchair.report.figure_file import save
from mjchair.storage import atomic_file, output_folder

matplotlib.use("Agg")
import matplotlib.pyplot as plt

TASK, SEED, GAMMA = "straight_line", 0, 0.98
ENVIRONMENTS = 4  # that are stepped in turn


def environment(seed: int, visual_geoms: bool = False) -> gymnasium.Env:
    """The task, ten decisions a second, with flat observations, and actions within -1 and 1."""
    task = tasks.load(TASK, {"random": seed}, {"control_timestep": 0.1}, visual_geoms=visual_geoms)
    wrapped = FlattenObservation(DmControlCompatibilityV0(task))
    return Monitor(RescaleAction(wrapped, -1.0, 1.0))


def mean_reward(policy, seed: int, episodes: int) -> float:
    """Mean reward a step of a policy: observation -> action of the wrapped environment."""
    env = environment(seed)
    rewards = []
    for _ in range(episodes):
        (seen, _), over = env.reset(), False
        while not over:
            seen, reward, ended, cut, _ = env.step(policy(seen))
            rewards.append(reward)
            over = ended or cut
    return float(np.mean(rewards))


def baseline_reward(seed: int, episodes: int) -> float:
    """Mean reward a step of the hand-made controller."""
    env, rewards = tasks.load(TASK, {"random": seed}, visual_geoms=False), []
    spec = env.action_spec()
    for _ in range(episodes):
        controller, step = tasks.baseline(TASK), env.reset()
        while not step.last():
            step = env.step(np.clip(controller(step.observation), spec.minimum, spec.maximum))
            rewards.append(step.reward)
    return float(np.mean(rewards))


class Curve(BaseCallback):
    """Mean reward a step of the episodes that end, over the steps of training."""

    def __init__(self) -> None:
        """Begin with nothing."""
        super().__init__()
        self.steps, self.rewards = [], []

    def _on_step(self) -> bool:
        for info in self.locals["infos"]:
            if "episode" in info:
                self.steps.append(self.num_timesteps)
                self.rewards.append(info["episode"]["r"] / info["episode"]["l"])
        return True


def film(policy, path: Path, seed: int, width: int) -> None:
    """An episode of the trained policy, one picture a decision."""
    env, height = environment(seed, visual_geoms=True), 2 * round(width * 9 / 32)
    physics = env.unwrapped._env.physics  # Shimmy keeps the dm_control environment there
    (seen, _), over, frames = env.reset(), False, []
    while not over:
        seen, _, ended, cut, _ = env.step(policy(seen))
        frames.append(physics.render(height, width, camera_id="follow"))
        over = ended or cut
    mediapy.set_ffmpeg(imageio_ffmpeg.get_ffmpeg_exe())
    with atomic_file(path) as temporary:
        mediapy.write_video(temporary, frames, fps=10)


def figure(curve: Curve, random: float, baseline: float):
    drawn, axes = plt.subplots(figsize=(8.0, 4.5), layout="constrained")
    axes.plot(np.array(curve.steps) / 1e3, curve.rewards, ".", ms=3, alpha=0.4, color="#2166ac")
    window = max(1, len(curve.rewards) // 12)
    smooth = np.convolve(curve.rewards, np.ones(window) / window, "valid")
    axes.plot(np.array(curve.steps[window - 1 :]) / 1e3, smooth, color="#2166ac", label="PPO")
    axes.axhline(random, color="0.5", ls=":", label="random torques")
    axes.axhline(baseline, color="#1b7837", ls="--", label="baseline controller")
    axes.set_xlabel("steps of training (thousand)")
    axes.set_ylabel("mean reward a step")
    axes.set_ylim(0.0, 1.0)
    axes.grid(alpha=0.3)
    axes.legend()
    axes.set_title(f"{TASK}: go 5 m and stop")
    return drawn


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("out/train_straight_line"))
    parser.add_argument("--steps", type=int, default=80_000)
    parser.add_argument("--episodes", type=int, default=5, help="of every evaluation")
    parser.add_argument("--width", type=int, default=640, help="of the film, pixels, even")
    parser.add_argument("--force", action="store_true")
    args = parser.parse_args()
    out = output_folder(args.out, args.force)

    envs = VecNormalize(
        DummyVecEnv([lambda seed=seed: environment(seed) for seed in range(ENVIRONMENTS)]),
        gamma=GAMMA,
    )
    random = np.random.default_rng(SEED)
    untrained = mean_reward(lambda seen: random.uniform(-1, 1, 2), SEED, args.episodes)
    model = PPO(
        "MlpPolicy",
        envs,
        n_steps=min(480, max(60, args.steps // ENVIRONMENTS)),
        batch_size=240,
        n_epochs=10,
        learning_rate=5e-4,
        gamma=GAMMA,
        ent_coef=0.0,
        policy_kwargs={"net_arch": [64, 64], "log_std_init": -0.7},
        seed=SEED,
        device="cpu",
    )
    curve = Curve()
    model.learn(args.steps, callback=curve)

    def policy(seen):
        return model.predict(envs.normalize_obs(seen), deterministic=True)[0]

    trained = mean_reward(policy, 100, args.episodes)
    baseline = baseline_reward(100, args.episodes)
    print(f"mean reward a step: random {untrained:.3f}, PPO {trained:.3f}, baseline {baseline:.3f}")
    model.save(out / "policy.zip")
    save(figure(curve, untrained, baseline), out / "learning.png")
    film(policy, out / "episode.mp4", 100, args.width)


if __name__ == "__main__":
    main()
