import os
from pathlib import Path

# The processors are busy with tests: more threads for matrices this small only wait for each other.
# Set before NumPy is imported; processes that tests start inherit it.
os.environ.setdefault("OMP_NUM_THREADS", "1")

import mujoco
import numpy as np
import pytest

import mjchair
from mjchair.report import gl

SLALOM_STEPS = 1500
# files that take long, the longest first: they start first, so that both workers end together
LONG = (
    "test_blind.py",
    "test_diagnose_command.py",
    "test_wheel.py",
    "test_experiments.py",
    "test_diagnosis.py",
    "test_docs.py",
    "test_own_effect.py",
    "test_laboratory_page.py",
    "test_imports.py",
    "test_noise_levels.py",
)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Long files come first; `make test` hands out whole files in this order."""
    place = {name: k for k, name in enumerate(LONG)}
    items.sort(key=lambda item: place.get(Path(item.path).name, len(LONG)))


def has_graphics() -> bool:
    """Whether this machine draws offscreen."""
    try:
        gl.backend()
    except gl.NoGraphicsError:
        return False
    return True


@pytest.fixture(scope="session", autouse=True)
def compiled_tires():
    """The tires are compiled before the first test, or the line that says so is a test's output."""
    mjchair.install()
    mjchair.uninstall()


@pytest.fixture(autouse=True)
def no_callbacks_leak():
    """Every test starts and ends without callbacks."""
    mjchair.uninstall()
    yield
    mjchair.uninstall()


@pytest.fixture(scope="session")
def manual_spec():
    return mjchair.load_spec("manual")


@pytest.fixture
def manual(manual_spec):
    return manual_spec.compile()


def slalom(model: mujoco.MjModel, steps: int = SLALOM_STEPS, prefix: str = "") -> np.ndarray:
    """Controls (steps, nu) of a winding run: common drive, opposite torques left and right."""
    time = np.arange(steps) * model.opt.timestep
    control = np.zeros((steps, model.nu))
    turn = 2.5 * np.sin(2 * np.pi * time / 1.6)
    for name, sign in (("left_wheel", -1.0), ("right_wheel", 1.0)):
        control[:, model.actuator(prefix + name).id] = 4.0 + sign * turn
    return control


def roll(model: mujoco.MjModel, control: np.ndarray, data: mujoco.MjData | None = None):
    """States (steps, n) after each step of mj_step under the controls."""
    data = data or mujoco.MjData(model)
    spec = mujoco.mjtState.mjSTATE_FULLPHYSICS
    states = np.empty((len(control), mujoco.mj_stateSize(model, spec)))
    for row, state in zip(control, states, strict=True):
        data.ctrl[:] = row
        mujoco.mj_step(model, data)
        mujoco.mj_getState(model, data, state, spec)
    return states
