"""The training script runs from the command line, where the extra [learn] is installed."""

import subprocess
import sys
from pathlib import Path

import pytest
from conftest import has_graphics

SCRIPT = Path(__file__).parents[1] / "scripts" / "train_straight_line.py"


@pytest.mark.skipif(not has_graphics(), reason="no offscreen OpenGL on this machine")
def test_a_short_training_run(tmp_path):
    """One update of the policy, three pictures of results, and an exit code of 0."""
    for package in ("stable_baselines3", "torch", "shimmy"):
        pytest.importorskip(package, reason="the extras [tasks] and [learn] are not installed")
    arguments = ["--steps", "480", "--episodes", "1", "--width", "128", "--out", str(tmp_path)]
    done = subprocess.run([sys.executable, str(SCRIPT), *arguments], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "mean reward a step: random" in done.stdout
    for name in ("policy.zip", "learning.png", "episode.mp4"):
        assert (tmp_path / name).stat().st_size > 1000
