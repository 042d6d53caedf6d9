"""A model inside a recording, so that a film needs no other file.

In: a compiled model. Out: its bytes, and the model from them.
"""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from mjchair.errors import MjchairError
from mjchair.model.engine_warnings import without_engine_warnings
from mjchair.model.spec import without_python_callbacks


@dataclass(frozen=True)
class StoredModel:
    """A model as bytes.

    Attributes:
      form: "xml", which any MuJoCo reads, or "mjb", MuJoCo's own binary, which only the version
        that wrote it reads.
      content: the file's bytes.
    """

    form: str
    content: bytes

    @staticmethod
    def of(model: mujoco.MjModel, spec: mujoco.MjSpec | None = None) -> StoredModel:
        """XML where there is a spec whose XML loads without other files, else MJB."""
        if spec is not None and not _refers_to_files(model):
            with without_python_callbacks():
                text = spec.to_xml()
            if _loads(text):
                return StoredModel("xml", text.encode())
        buffer = np.empty(mujoco.mj_sizeModel(model), np.uint8)
        mujoco.mj_saveModel(model, None, buffer)
        return StoredModel("mjb", buffer.tobytes())

    def load(self) -> mujoco.MjModel:
        """The model.

        Raises:
          MjchairError: this MuJoCo cannot read it.
        """
        try:
            if self.form == "xml":
                with without_python_callbacks():
                    return mujoco.MjModel.from_xml_string(self.content.decode())
            with tempfile.TemporaryDirectory() as folder:
                path = Path(folder) / "model.mjb"
                path.write_bytes(self.content)
                with without_engine_warnings():
                    return mujoco.MjModel.from_binary_path(str(path))
        except (ValueError, UnicodeDecodeError) as error:
            line = str(error).strip().splitlines()[0]
            raise MjchairError(
                f"the recorded model ({self.form}) does not load in MuJoCo {mujoco.__version__}: "
                f"{line}; render with the version that simulated it"
            ) from None


def _refers_to_files(model: mujoco.MjModel) -> bool:
    addresses = (model.mesh_pathadr, model.tex_pathadr, model.hfield_pathadr, model.skin_pathadr)
    return any((np.asarray(a) >= 0).any() for a in addresses)


def _loads(xml: str) -> bool:
    try:
        with without_python_callbacks():
            mujoco.MjModel.from_xml_string(xml)
    except ValueError:
        return False
    return True
