"""mjchair: a wheelchair simulator on MuJoCo with Magic Formula tires."""

import importlib
from typing import Any

from mjchair import tire
from mjchair.engine.install import install, installed, uninstall
from mjchair.errors import MjchairError
from mjchair.model.spec import load_spec
from mjchair.simulation.initial import Initial
from mjchair.simulation.inputs import Inputs, constant, push_strokes, read_inputs
from mjchair.simulation.recording import Recording, Status, load_recording
from mjchair.simulation.simulate import simulate

__all__ = [
    "Initial",
    "Inputs",
    "MjchairError",
    "Recording",
    "Status",
    "constant",
    "install",
    "installed",
    "load_recording",
    "load_spec",
    "push_strokes",
    "read_inputs",
    "simulate",
    "tire",
    "uninstall",
]

# imported when first asked for: they bring scipy.stats, dm_control and pyarrow, which take longer
# to load than a chair takes to its first step
LATER = {
    "Diagnosis": "mjchair.diagnosis.verdict",
    "diagnose": "mjchair.diagnosis.workflow",
    "read_study": "mjchair.diagnosis.study",
    "sweep": "mjchair.sweep",
    "tasks": "mjchair.tasks",
}


def __getattr__(name: str) -> Any:
    """The names of LATER, without an import of their own."""
    if name not in LATER:
        raise AttributeError(f"module 'mjchair' has no attribute {name!r}")
    module = importlib.import_module(LATER[name])
    return module if LATER[name] == f"mjchair.{name}" else getattr(module, name)
