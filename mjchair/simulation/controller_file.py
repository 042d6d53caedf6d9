"""A controller that a user has written, from a Python file.

In: `FILE` or `FILE:NAME`, where NAME is `controller` unless another is given. Out: the function of
that name, for `mjchair.Simulator`.
"""

from __future__ import annotations

import importlib.util
from pathlib import Path

from mjchair.errors import MjchairError, nearest
from mjchair.simulation.simulator import Controller

USUAL = "controller"


def read_controller(given: str) -> Controller:
    """The controller that `given` names.

    Raises:
      MjchairError: no such file, one that does not run, or no function of that name in it.
    """
    place, _, name = given.partition(":") if ":" in Path(given).name else (given, "", "")
    file, name = Path(place), name or USUAL
    described = importlib.util.spec_from_file_location(file.stem, file)
    if not file.is_file() or described is None or described.loader is None:
        raise MjchairError(f"no controller file {file}; give a Python file with a {name}")
    module = importlib.util.module_from_spec(described)
    try:
        described.loader.exec_module(module)
    except SyntaxError as error:
        raise MjchairError(f"{file}: line {error.lineno}: {error.msg}") from error
    except (Exception, SystemExit) as error:
        line = " ".join(str(error).split())
        raise MjchairError(f"{file} fails: {type(error).__name__}: {line}") from error
    controller = getattr(module, name, None)
    if not callable(controller):
        functions = [n for n, value in vars(module).items() if callable(value)]
        raise MjchairError(f"{file} has no function {name!r}" + nearest(name, functions))
    return controller  # type: ignore[no-any-return]
