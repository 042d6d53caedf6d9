"""mjchair: a wheelchair simulator on MuJoCo with Magic Formula tires."""

import importlib
from typing import Any

from mjchair import tire
from mjchair.diagnosis.study import read_study
from mjchair.diagnosis.verdict import Diagnosis
from mjchair.diagnosis.workflow import diagnose
from mjchair.engine.install import install, installed, uninstall
from mjchair.errors import MjchairError
from mjchair.model.spec import load_spec
from mjchair.simulation.initial import Initial
from mjchair.simulation.inputs import Inputs, constant, push_strokes, read_inputs
from mjchair.simulation.recording import Recording, Status, load_recording
from mjchair.simulation.simulate import simulate

__all__ = [
    "Diagnosis",
    "Initial",
    "Inputs",
    "MjchairError",
    "Recording",
    "Status",
    "constant",
    "diagnose",
    "install",
    "installed",
    "load_recording",
    "load_spec",
    "push_strokes",
    "read_inputs",
    "read_study",
    "simulate",
    "tire",
    "uninstall",
]

LATER = ("sweep", "tasks")  # imported when first asked for: they bring dm_control and pyarrow


def __getattr__(name: str) -> Any:
    """`mjchair.tasks` and `mjchair.sweep` without an import of their own."""
    if name in LATER:
        return importlib.import_module(f"mjchair.{name}")
    raise AttributeError(f"module 'mjchair' has no attribute {name!r}")
