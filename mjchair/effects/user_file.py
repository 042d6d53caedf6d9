"""An effect that a user has written, from a Python file that holds an `EFFECT`.

In: a path. Out: the effect.
"""

from __future__ import annotations

import importlib.util
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mujoco

from mjchair.effects.effect import Effect, Parameter, step
from mjchair.effects.library import names
from mjchair.errors import MjchairError


def from_file(path: str | os.PathLike[str]) -> Effect:
    """The `EFFECT` of a Python file.

    Raises:
      MjchairError: no such file, one that does not run, no Effect named EFFECT in it, a name that
        the library has, or parameters that cannot be fitted.
    """
    file = Path(path)
    described = importlib.util.spec_from_file_location(file.stem, file)
    if not file.is_file() or described is None or described.loader is None:
        raise MjchairError(f"no effect file {file}; give a Python file with an EFFECT")
    module = importlib.util.module_from_spec(described)
    loader = described.loader
    _guarded(str(file), lambda: loader.exec_module(module))
    effect = getattr(module, "EFFECT", None)
    if not isinstance(effect, Effect):
        raise MjchairError(f"{file} has no EFFECT that is an mjchair.effects.effect.Effect")
    if effect.name in names():
        raise MjchairError(f"{file}: the library has an effect {effect.name!r}; name yours anew")
    if not effect.sizes:
        raise MjchairError(f"{file}: {effect.name} has no parameter to fit; give it one")
    for p in effect.parameters:
        _check_parameter(p, str(file))
    return effect


def check(effect: Effect, spec: mujoco.MjSpec) -> None:
    """Apply the effect, with a typical value of each parameter, to a copy of its chair.

    Raises:
      MjchairError: its edit fails, or the edited specification does not compile.
    """

    def attempt() -> None:
        for p in effect.sizes:
            tried = spec.copy()
            effect.apply(tried, {p.name: p.neutral + step(p)})
            tried.compile()

    _guarded(f"effect {effect.name}", attempt)


def _check_parameter(p: Parameter, source: str) -> None:
    if not p.low <= p.neutral <= p.high or not p.low <= p.neutral + step(p) <= p.high:
        raise MjchairError(
            f"{source}: {p.name} is {p.neutral:g} where nothing acts and {p.typical:g} as a rule; "
            f"both must be within {p.low:g} to {p.high:g}"
        )
    if p.fitted and p.sized and p.typical == p.neutral:
        raise MjchairError(
            f"{source}: {p.name} is {p.typical:g} as a rule and where nothing acts; "
            "the two must differ"
        )


def _guarded(what: str, act: Callable[[], Any]) -> None:
    """Run code of the user; any exception that it raises becomes a one-line error."""
    try:
        act()
    except MjchairError:
        raise
    except SyntaxError as error:
        raise MjchairError(f"{what}: line {error.lineno}: {error.msg}") from error
    except (Exception, SystemExit) as error:
        line = " ".join(str(error).split())
        raise MjchairError(f"{what} fails: {type(error).__name__}: {line}") from error
