"""Simulations that are kept on disk: an interrupted diagnosis goes on from them.

In: arrays, and everything that they follow from. Out: the arrays again, under a digest of that.
"""

from __future__ import annotations

import hashlib
import zipfile
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.storage import atomic_file
from mjchair.tire import compiled

Array = NDArray[np.float64]
Part = NDArray[Any] | str | float


def digest(parts: Iterable[Part]) -> str:
    """A name for what the parts are, in this order."""
    digested = hashlib.sha256()
    for part in parts:
        digested.update(part.tobytes() if isinstance(part, np.ndarray) else repr(part).encode())
    return digested.hexdigest()[:32]


class Store:
    """A folder of predictions, by a digest of everything that they follow from."""

    def __init__(self, folder: Path) -> None:
        """Make the folder where it is not there."""
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)

    @staticmethod
    def key(models: Iterable[mujoco.MjModel], parts: Iterable[Part]) -> str:
        """Digest of models, arrays, numbers and text, of MuJoCo's version and mjchair's code."""
        saved = []
        for model in models:
            saved.append(np.empty(mujoco.mj_sizeModel(model), np.uint8))
            mujoco.mj_saveModel(model, None, saved[-1])
        return digest([mujoco.__version__, compiled.fingerprint(""), *saved, *parts])

    def load(self, key: str) -> list[Array] | None:
        """The arrays that were kept, or None."""
        path = self.folder / f"{key}.npz"
        if not path.is_file():
            return None
        try:
            with np.load(path, allow_pickle=False) as data:
                return [data[f"w{i}"] for i in range(len(data.files))]
        except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
            return None  # cut short: it is made again

    def save(self, key: str, arrays: Sequence[Array]) -> None:
        """Keep arrays, whole or not at all."""
        with atomic_file(self.folder / f"{key}.npz") as path:
            np.savez(path, **{f"w{i}": a for i, a in enumerate(arrays)})  # type: ignore[arg-type]
