"""Fingerprints: digests of everything on which the results of a sweep depend.

In: a model specification, values by name, or a function of a study. Out: a digest (hexadecimal
text) that changes when the content changes. Names and paths have no influence: a model is compiled
first, so its meshes, height fields and tires are part of the digest.

The digest of a function covers its bytecode, its default arguments, its closure, and the functions,
classes and values of its module that it reads. Only the name and the version of an
installed package are covered. Files that a function reads while it runs are not covered.
"""

from __future__ import annotations

import functools
import hashlib
import inspect
import json
import pickle
import sys
import sysconfig
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from types import BuiltinFunctionType, CodeType, FunctionType, MethodType, ModuleType
from typing import Any

import mujoco
import numpy as np

from mjchair.model.spec import compile_spec

INSTALLED = tuple(
    str(Path(sysconfig.get_path(kind)).resolve()) for kind in ("stdlib", "purelib", "platlib")
)


def of_model(spec: mujoco.MjSpec) -> str:
    """Digest of a compiled specification, with all files that its MJCF names.

    Raises:
      MjchairError: the specification does not compile.
    """
    model = compile_spec(spec)
    saved = np.empty(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, saved)
    return _hexadecimal([saved.tobytes()])


def of_values(values: Mapping[str, Any]) -> str:
    """Digest of numbers and texts by name."""
    return _hexadecimal([json.dumps(values, sort_keys=True, default=float).encode()])


def of_function(function: Callable[..., Any] | None) -> str:
    """Digest of what a function computes; the empty text for None."""
    return "" if function is None else _hexadecimal(_parts(function, set()))


def _hexadecimal(parts: Iterable[bytes]) -> str:
    digest = hashlib.sha256()
    for part in parts:
        digest.update(len(part).to_bytes(8, "little") + part)
    return digest.hexdigest()


def _parts(value: Any, seen: set[int]) -> list[bytes]:
    """The content of a value as bytes, in an order that is the same in every process.

    Args:
      value: any value. seen: ids of the values that are already covered, so that circular
        references end.
    """
    if value is None or isinstance(value, (bool, int, float, complex, str, bytes)):
        return [f"{type(value).__name__} {value!r}".encode()]
    if id(value) in seen:
        return [b"again"]
    seen.add(id(value))
    if isinstance(value, np.ndarray) and value.dtype != object:
        return [f"array {value.dtype} {value.shape}".encode(), value.tobytes()]
    if isinstance(value, Mapping):
        items = sorted(value.items(), key=lambda item: repr(item[0]))
        return _joined("mapping", (part for item in items for part in item), seen)
    if isinstance(value, (set, frozenset)):
        return _joined("set", sorted(value, key=repr), seen)
    if isinstance(value, (list, tuple)):
        return _joined(type(value).__name__, value, seen)
    if isinstance(value, CodeType):
        texts = (value.co_code, value.co_names, value.co_varnames, value.co_freevars)
        return _joined("code", (*texts, value.co_argcount, value.co_flags, value.co_consts), seen)
    return _of_object(value, seen)


def _joined(kind: str, values: Iterable[Any], seen: set[int]) -> list[bytes]:
    """The parts of several values, between the name of their kind and an end mark."""
    inner = [part for value in values for part in [*_parts(value, seen), b","]]
    return [kind.encode(), *inner, b"end"]


def _of_object(value: Any, seen: set[int]) -> list[bytes]:
    """The content of a function, a class, a module, or an instance of a class, as bytes."""
    if isinstance(value, ModuleType):
        return _of_module(value)
    if isinstance(value, functools.partial):
        return _joined("partial", (value.func, value.args, value.keywords), seen)
    if isinstance(value, MethodType):
        return _joined("method", (value.__func__, value.__self__), seen)
    module = sys.modules.get(getattr(value, "__module__", None) or "")
    if isinstance(value, (FunctionType, type, BuiltinFunctionType)) and _is_installed(module):
        return [f"{value.__module__}.{value.__qualname__}".encode(), *_of_module(module)]
    if isinstance(value, FunctionType):
        cells = [_content(cell) for cell in value.__closure__ or ()]
        defaults = (value.__defaults__, value.__kwdefaults__)
        return _joined("function", (value.__code__, *defaults, cells, _globals(value)), seen)
    if isinstance(value, type):
        own = {k: v for k, v in vars(value).items() if not k.startswith("__") or callable(v)}
        return _joined("class", (value.__qualname__, value.__bases__, own), seen)
    if isinstance(value, (staticmethod, classmethod)):
        return _joined("function of a class", (value.__func__,), seen)
    if isinstance(value, property):
        return _joined("property", (value.fget, value.fset), seen)
    inner = getattr(value, "__dict__", None)
    if inner:
        return _joined("object", (type(value), inner), seen)
    try:
        return [type(value).__qualname__.encode(), pickle.dumps(value, protocol=4)]
    except Exception:  # such as a lock or an open file, on which no result depends
        return [type(value).__qualname__.encode()]


def _content(cell: Any) -> Any:
    """The value in a cell of a closure; None where it is still empty, as in recursion."""
    try:
        return cell.cell_contents
    except ValueError:
        return None


def _globals(function: FunctionType) -> dict[str, Any]:
    """Name -> value of all globals that a function, and the functions inside it, read."""
    names: set[str] = set()
    to_visit = [function.__code__]
    while to_visit:
        code = to_visit.pop()
        names.update(code.co_names)
        to_visit += [part for part in code.co_consts if isinstance(part, CodeType)]
    known = function.__globals__
    return {name: known[name] for name in sorted(names) if name in known}


def _is_installed(module: ModuleType | None) -> bool:
    """Whether a module belongs to Python or to an installed package, such as mjchair."""
    if module is None or module.__name__.partition(".")[0] in ("mjchair", "builtins"):
        return module is not None
    file = getattr(module, "__file__", None)
    return module.__name__ != "__main__" and (
        file is None or str(Path(file).resolve()).startswith(INSTALLED)
    )


def _of_module(module: ModuleType | None) -> list[bytes]:
    """Name and version of an installed module; name and source text of a user's module."""
    if module is None:
        return [b"no module"]
    name = module.__name__.encode()
    if _is_installed(module):
        package = sys.modules.get(module.__name__.partition(".")[0], module)
        return [name, str(getattr(package, "__version__", "")).encode()]
    try:
        return [name, inspect.getsource(module).encode()]
    except (OSError, TypeError):
        return [name]
