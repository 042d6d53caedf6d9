"""A recording: the result of a simulation, with names and units, and with the model for a film.

In: the states and sensors from `simulate`. Out: a `Recording`, which can be saved, read, converted
to a table, filmed and replayed.
"""

from __future__ import annotations

import enum
import html
import importlib
import importlib.util
import json
import os
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from mjchair.errors import MjchairError, nearest
from mjchair.simulation.frozen import FrozenRecord
from mjchair.simulation.names import same
from mjchair.simulation.stored_model import StoredModel
from mjchair.simulation.table import Array, frozen
from mjchair.storage import atomic_file

GRAVITY = ("gravity.x", "gravity.y", "gravity.z")  # channels of a run with turning gravity
FORMAT = "mjchair recording"
VERSION = 1
# exceptions from reading a file that is truncated, damaged, or of another kind
BROKEN = (OSError, EOFError, KeyError, TypeError, ValueError, zipfile.BadZipFile, zlib.error)
FILMS = "mjchair.report.film"
REPLAYS = "mjchair.report.replay.page"


class Status(enum.Enum):
    """How a simulation ended, in words.

    COMPLETED: the chair stood on its wheels. UNSTABLE: the simulation diverged, and the run ends
    there. TIPPED and OFF_GROUND: the run has all samples, but the chair tipped over or left the
    ground; the rule is in mjchair.simulation.standing.
    """

    COMPLETED = "completed"
    UNSTABLE = "unstable"
    TIPPED = "tipped over"
    OFF_GROUND = "left the ground"


@dataclass(frozen=True, eq=False, repr=False)
class Recording(FrozenRecord):
    """A simulated run. Frozen; arrays cannot be written to.

    Sample k of every array belongs to `time[k]`: sensors describe the same instant as positions.

    Attributes:
      time: (n,), s.
      channels: name -> (n,), SI: every sensor scalar (`imu_gyro.x`, `left_wheel_tire.Fx`, ...).
      units: name -> unit, for channels and controls.
      controls: actuator name -> (n,), the inputs that drove the chair.
      qpos: (n, nq), positions as MuJoCo orders them. qvel: (n, nv), velocities.
      model: the model that was simulated.
      timestep: of the simulation, s.
      status: how the run ended. stopped_at: the time at which it diverged, or the chair tipped over
        or left the ground, s; None when completed. reason: what happened then, in words; "" when
        completed.
      hold: whether the inputs kept their value from sample to sample, see Inputs; False: they were
        interpolated linearly.
      versions: package -> version with which the recording was made.
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
    hold: bool = False

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
        """The column `name` of the table, (n,): time, an input or a sensor's scalar.

        Raises:
          MjchairError: there is none, with the nearest name.
        """
        columns = self.columns
        if name in columns:
            return columns[name]
        behind = [full for full in columns if same(full, name)]
        if len(behind) == 1:
            return columns[behind[0]]
        raise MjchairError(f"no channel {name!r}" + nearest(name, behind or columns))

    def __contains__(self, name: object) -> bool:
        """Whether there is such a column."""
        return any(same(full, str(name)) for full in self.columns)

    def keys(self) -> list[str]:
        """Names of the columns, in the table's order."""
        return list(self.columns)

    @property
    def columns(self) -> dict[str, Array]:
        """The table: `time` (s), the inputs by actuator, the sensors' scalars; each (n,)."""
        return {"time": self.time, **self.controls, **self.channels}

    def vector(self, name: str) -> Array:
        """The channels `name.x`, `name.y` and `name.z` side by side, (n, 3)."""
        return np.column_stack([self[f"{name}.{axis}"] for axis in "xyz"])

    def down(self) -> Array:
        """Direction of gravity, (n, 3), 1, world; not vertical where gravity tilts the floor."""
        if GRAVITY[0] in self.channels:
            gravity = np.column_stack([self.channels[name] for name in GRAVITY])
        else:
            gravity = np.tile(self.model.load().opt.gravity, (self.time.size, 1))
        size = np.linalg.norm(gravity, axis=1, keepdims=True)
        return np.where(size > 0.0, gravity / np.maximum(size, 1e-9), (0.0, 0.0, -1.0))

    @property
    def wheels(self) -> list[str]:
        """Names of the wheels with a tire, as the tire channels have them."""
        ending = "_tire.Fx"
        return [name.removesuffix(ending) for name in self.channels if name.endswith(ending)]

    def describe(self) -> str:
        """One line: duration, number of samples, and how the run ended."""
        span = f"{self.time[-1] - self.time[0]:g} s, {self.time.size} samples"
        if self.status is Status.COMPLETED:
            return f"completed: {span}"
        kept = " kept" if self.status is Status.UNSTABLE else ""
        return f"{self.status.value} at {self.stopped_at:g} s ({self.reason}): {span}{kept}"

    def __repr__(self) -> str:
        """One line."""
        return f"<Recording {self.describe()}; {len(self.channels)} channels>"

    def _repr_html_(self) -> str:
        """A small table for notebooks: how it ended, and each column with unit and range."""
        cells = "".join(
            f"<tr><td>{html.escape(name)}</td><td>{html.escape(self.units.get(name, 's'))}</td>"
            f"<td>{np.nanmin(values):.4g}</td><td>{np.nanmax(values):.4g}</td></tr>"
            for name, values in self.columns.items()
            if not np.isnan(values).all()
        )
        return (
            f"<p>Recording {html.escape(self.describe())}</p><table><thead><tr><th>column</th>"
            f"<th>unit</th><th>least</th><th>largest</th></tr></thead><tbody>{cells}</tbody></table>"
        )

    def to_dataframe(self) -> Any:
        """The table as a DataFrame: of pandas where that is installed, else of polars.

        Raises:
          MjchairError: neither is installed.
        """
        for library in ("pandas", "polars"):
            if importlib.util.find_spec(library) is not None:
                return importlib.import_module(library).DataFrame(self.columns)
        raise MjchairError(
            "to_dataframe needs pandas or polars; install one of them, or take run.columns"
        )

    def film(self, path: str | os.PathLike[str], **options: Any) -> None:
        """Write a film of the run; options as mjchair.report's `write_film` takes them.

        Raises:
          MjchairError: an option that `write_film` refuses, a machine without OpenGL, or a folder
            that cannot be written.
        """
        # drawing stands above simulation, so it is looked up when it is asked for
        report = importlib.import_module(FILMS)
        report.write_film(self, path, **options)

    def replay(self, ghost: Any = None, **options: Any) -> Any:
        """The run in three dimensions, as a page: shown by a notebook, or saved with `.save(path)`.

        Args:
          ghost: drawn in the same scene: another recording, a measured run (Trial), or several of
            them by name. options: as mjchair.report.replay's `replay` takes them.

        Returns:
          mjchair.report.replay.page.Replay.

        Raises:
          MjchairError: as mjchair.report.replay's `replay` does.
        """
        # drawing stands above simulation, so it is looked up when it is asked for
        report = importlib.import_module(REPLAYS)
        ghosts = ghost if isinstance(ghost, Mapping) or ghost is None else {"ghost": ghost}
        return report.replay(self, ghosts, **options)

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
            "hold": self.hold,
            "versions": dict(self.versions),
            "model_form": self.model.form,
        }
        with atomic_file(path) as temporary, temporary.open("wb") as file:
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
        header = list(self.columns)
        rows = np.column_stack(list(self.columns.values())).tolist()
        with atomic_file(path) as temporary, temporary.open("w", encoding="utf-8") as file:
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
    except BROKEN:
        raise MjchairError(
            f"{path} is not an mjchair recording: it is cut off, damaged, or another kind of file"
        ) from None
    try:
        return _from_parts(header, arrays)
    except KeyError as error:
        raise MjchairError(f"{path} is not an mjchair recording: it has no {error}") from None
    except BROKEN as error:
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
        hold=header.get("hold", False),
    )


def _stack(columns: Mapping[str, Array], count: int) -> Array:
    return np.column_stack(list(columns.values())) if columns else np.empty((count, 0))
