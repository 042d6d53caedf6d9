"""mjchair: a wheelchair simulator on MuJoCo with Magic Formula tires."""

import importlib
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Any

from mjchair import tire
from mjchair.engine.install import install, installed, uninstall
from mjchair.engine.reminder import reminding
from mjchair.errors import MjchairError
from mjchair.model.ground import uneven
from mjchair.model.parameters import ChairParameters
from mjchair.model.spec import load_drive
from mjchair.model.spec import load_spec as _load_spec
from mjchair.rider.rider import Rider
from mjchair.simulation.initial import Initial
from mjchair.simulation.inputs import Inputs, constant, push_strokes, read_inputs
from mjchair.simulation.recording import Recording, Status, load_recording
from mjchair.simulation.simulate import simulate
from mjchair.simulation.simulator import ControllerError, Link, Observation, Simulator, observe

load_spec = reminding(_load_spec)

if TYPE_CHECKING:  # for editors and type checkers; at run time LATER brings them
    from mjchair import sweep as sweep
    from mjchair import tasks as tasks
    from mjchair import testlab as testlab
    from mjchair.diagnosis.data.study_file import read_study as read_study
    from mjchair.diagnosis.diagnose import diagnose as diagnose
    from mjchair.diagnosis.result import Diagnosis as Diagnosis
    from mjchair.sweep import measures as measures

try:
    __version__ = version("mjchair")
except PackageNotFoundError:  # the sources, without an installation
    __version__ = "unknown"

__all__ = [
    "ChairParameters",
    "ControllerError",
    "Diagnosis",
    "Initial",
    "Inputs",
    "Link",
    "MjchairError",
    "Observation",
    "Recording",
    "Rider",
    "Simulator",
    "Status",
    "__version__",
    "constant",
    "diagnose",
    "install",
    "installed",
    "load_drive",
    "load_recording",
    "load_spec",
    "measures",
    "observe",
    "push_strokes",
    "read_inputs",
    "read_study",
    "simulate",
    "sweep",
    "tasks",
    "testlab",
    "tire",
    "uneven",
    "uninstall",
]

# Imported when first asked for: they bring scipy.stats, dm_control and pyarrow, which take longer
# to load than a chair takes to its first step. A name without a colon is a module.
LATER = {
    "Diagnosis": "mjchair.diagnosis.result:Diagnosis",
    "diagnose": "mjchair.diagnosis.diagnose:diagnose",
    "measures": "mjchair.sweep.measures",
    "read_study": "mjchair.diagnosis.data.study_file:read_study",
    "sweep": "mjchair.sweep",
    "tasks": "mjchair.tasks",
    "testlab": "mjchair.testlab",
}


def __getattr__(name: str) -> Any:
    """The names of LATER, without an import of their own."""
    if name not in LATER:
        raise AttributeError(f"module 'mjchair' has no attribute {name!r}")
    place, _, attribute = LATER[name].partition(":")
    module = importlib.import_module(place)
    return getattr(module, attribute) if attribute else module


def __dir__() -> list[str]:
    """Every public name, also those of LATER."""
    return sorted({*globals(), *LATER})
