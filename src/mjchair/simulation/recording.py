"""A recording: what a simulation left, with names and units, complete enough to be filmed."""

from __future__ import annotations

import enum
import json
import os
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from mjchair.errors import MjchairError, nearest
from mjchair.simulation.names import same
from mjchair.simulation.stored_model import StoredModel
from mjchair.simulation.table import Array, frozen
from mjchair.storage import whole

FORMAT = "mjchair recording"
VERSION = 1


class Status(enum.Enum):
    """How a simulation ended, in words."""

    COMPLETED = "completed"
    UNSTABLE = "unstable"


@dataclass(frozen=True)
class Recording:
    """A simulated run. Frozen; arrays cannot be written to.

    Sample k of every array belongs to `time[k]`: sensors describe the same instant as positions.

    Attributes:
      time: (n,), s.
      channels: name -> (n,), SI: every sensor scalar (`imu_gyro.x`, `left_wheel_tire.Fx`, ...).
      units: name -> unit, for channels and controls.
      controls: actuator name -> (n,), what drove the chair.
      qpos: (n, nq), positions as MuJoCo orders them. qvel: (n, nv), velocities.
      model: the model that was simulated.
      timestep: of the simulation, s.
      status: how it ended. stopped_at: the time at which it broke, s; None when completed.
      reason: what broke, in words; "" when completed.
      versions: package -> version that made it.
    """

    time: Array
    channels: Mapping[str, Array]
    units: Mapping[str, str]
    controls: Mapping[str, Array]
    qpos: Array
    qvel: Array
    model: StoredModel
    timestep: float
    status: Status = Status.COMPLETED
    stopped_at: float | None = None
    reason: str = ""
    versions: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Freeze the arrays and check their lengths."""
        for name in ("time", "qpos", "qvel"):
            object.__setattr__(self, name, frozen(getattr(self, name)))
        for name in ("channels", "controls"):
            arrays = {key: frozen(value) for key, value in getattr(self, name).items()}
            object.__setattr__(self, name, MappingProxyType(arrays))
        for name in ("units", "versions"):
            object.__setattr__(self, name, MappingProxyType(dict(getattr(self, name))))
        lengths = {len(a) for a in (*self.channels.values(), *self.controls.values())}
        lengths |= {len(self.qpos), len(self.qvel)}
        if lengths != {self.time.size}:
            raise MjchairError(
                f"a recording of {self.time.size} samples has arrays of {sorted(lengths)}"
            )

    def __getitem__(self, name: str) -> Array:
        """The channel `name`, (n,).

        Raises:
          MjchairError: there is none, with the nearest name.
        """
        if name in self.channels:
            return self.channels[name]
        behind = [full for full in self.channels if same(full, name)]
        if len(behind) == 1:
            return self.channels[behind[0]]
        raise MjchairError(f"no channel {name!r}" + nearest(name, behind or self.channels))

    def vector(self, name: str) -> Array:
        """The channels `name.x`, `name.y` and `name.z` side by side, (n, 3)."""
        return np.column_stack([self[f"{name}.{axis}"] for axis in "xyz"])

    @property
    def wheels(self) -> list[str]:
        """Names of the wheels with a tire, as the tire channels have them."""
        ending = "_tire.Fx"
        return [name.removesuffix(ending) for name in self.channels if name.endswith(ending)]

    def describe(self) -> str:
        """One line: how long, how many samples, how it ended."""
        span = f"{self.time[-1] - self.time[0]:g} s, {self.time.size} samples"
        if self.status is Status.COMPLETED:
            return f"completed: {span}"
        return f"{self.status.value} at {self.stopped_at:g} s ({self.reason}): {span} kept"

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write everything to one `.npz` file (numpy arrays and JSON; no pickle), whole.

        Raises:
          MjchairError: another suffix, or a folder that cannot be written.
        """
        if Path(path).suffix != ".npz":
            raise MjchairError(f"{path}: a recording is saved as .npz")
        header = {
            "format": FORMAT,
            "version": VERSION,
            "channels": list(self.channels),
            "controls": list(self.controls),
            "units": dict(self.units),
            "timestep": self.timestep,
            "status": self.status.value,
            "stopped_at": self.stopped_at,
            "reason": self.reason,
            "versions": dict(self.versions),
            "model_form": self.model.form,
        }
        with whole(path) as temporary, temporary.open("wb") as file:
            np.savez_compressed(
                file,
                header=np.array(json.dumps(header)),
                time=self.time,
                channels=_stack(self.channels, self.time.size),
                controls=_stack(self.controls, self.time.size),
                qpos=self.qpos,
                qvel=self.qvel,
                model=np.frombuffer(self.model.content, np.uint8),
            )

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Write a table: `time`, controls by actuator, sensors; SI. NaN becomes an empty cell.

        Raises:
          MjchairError: a folder that cannot be written.
        """
        header = ["time", *self.controls, *self.channels]
        columns = [self.time, *self.controls.values(), *self.channels.values()]
        rows = np.column_stack(columns).tolist()
        with whole(path) as temporary, temporary.open("w", encoding="utf-8") as file:
            file.write(",".join(header) + "\n")
            for row in rows:
                file.write(",".join("" if x != x else f"{x:.9g}" for x in row) + "\n")


def load_recording(path: str | os.PathLike[str]) -> Recording:
    """Read what `Recording.save` wrote.

    Raises:
      MjchairError: no such file, or not a recording of this format.
    """
    path = Path(path)
    if not path.is_file():
        raise MjchairError(f"no recording {path}; `mjchair simulate` writes recording.npz")
    try:
        with np.load(path, allow_pickle=False) as file:
            header = json.loads(str(file["header"]))
            arrays = {name: file[name] for name in file.files if name != "header"}
        return _from_parts(header, arrays)
    except (OSError, EOFError, KeyError, TypeError, ValueError, zipfile.BadZipFile) as error:
        line = (str(error) or type(error).__name__).splitlines()[0]
        raise MjchairError(f"{path} is not an mjchair recording: {line}") from None


def _from_parts(header: dict[str, Any], arrays: dict[str, Any]) -> Recording:
    if header.get("format") != FORMAT:
        raise ValueError(f"its format is {header.get('format')!r}")
    if header["version"] > VERSION:
        raise ValueError(f"version {header['version']}, newer than this mjchair's {VERSION}")
    return Recording(
        time=arrays["time"],
        channels=dict(zip(header["channels"], arrays["channels"].T, strict=True)),
        units=header["units"],
        controls=dict(zip(header["controls"], arrays["controls"].T, strict=True)),
        qpos=arrays["qpos"],
        qvel=arrays["qvel"],
        model=StoredModel(header["model_form"], arrays["model"].tobytes()),
        timestep=header["timestep"],
        status=Status(header["status"]),
        stopped_at=header["stopped_at"],
        reason=header["reason"],
        versions=header["versions"],
    )


def _stack(columns: Mapping[str, Array], count: int) -> Array:
    return np.column_stack(list(columns.values())) if columns else np.empty((count, 0))
