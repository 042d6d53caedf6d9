"""Simulations that are kept on disk: an interrupted diagnosis goes on from them."""

from __future__ import annotations

import hashlib
import zipfile
from collections.abc import Sequence
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.storage import whole

Array = NDArray[np.float64]


class Store:
    """A folder of predictions, by a digest of everything that they follow from."""

    def __init__(self, folder: Path) -> None:
        """Make the folder where it is not there."""
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)

    @staticmethod
    def key(model: mujoco.MjModel, parts: Sequence[Array | str | float]) -> str:
        """Digest of a model and of arrays, numbers and text."""
        digest = hashlib.sha256(mujoco.__version__.encode())
        buffer = np.empty(mujoco.mj_sizeModel(model), np.uint8)
        mujoco.mj_saveModel(model, None, buffer)
        digest.update(buffer.tobytes())
        for part in parts:
            digest.update(part.tobytes() if isinstance(part, np.ndarray) else repr(part).encode())
        return digest.hexdigest()[:32]

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
        with whole(self.folder / f"{key}.npz") as path:
            np.savez(path, **{f"w{i}": a for i, a in enumerate(arrays)})  # type: ignore[arg-type]
