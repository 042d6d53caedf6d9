"""Floors that are not plane: the heights of a height field, and the height of a kerb or threshold.

In: heights as an array, a file or a text such as "uneven:rms=5mm,seed=1"; or a height of a step.
Out: the scene's specification with that floor.
"""

from __future__ import annotations

import math
import os
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjchair.errors import MjchairError, nearest
from mjchair.units import quantity, with_unit

FLOOR = "floor"
STEP = "step"  # the geom of the scenes `kerb` and `threshold`
HIGHEST_STEP = 0.3  # m
# of generated heights: rms and wavelength, m; a rolling floor is no staircase, nor finer than cells
UNEVEN = {"rms": (0.0, 0.2), "wavelength": (0.1, 20.0), "seed": (0, 2**32 - 1)}
FOOTPRINT = (1.0, 0.6)  # m, half lengths along x and y of what a chair stands on

Array = NDArray[np.float64]


def set_heights(spec: mujoco.MjSpec, heights: ArrayLike) -> None:
    """Fill the height field of the floor, and lift the chair above the ground under it.

    Args:
      spec: whose geom `floor` is a height field.
      heights: (nrow, ncol), m above the floor's origin; rows along y, columns along x, both
        from the lowest. Any number of rows and columns; the extent stays the field's.

    Raises:
      MjchairError: the floor is not a height field, or `heights` is not such an array.
    """
    geom = spec.geom(FLOOR)
    if geom is None or geom.type != mujoco.mjtGeom.mjGEOM_HFIELD:
        raise MjchairError("the floor is not a height field; use scene 'hfield' for heights")
    values = np.asarray(heights, dtype=np.float64)
    if values.ndim != 2 or min(values.shape) < 2 or not np.isfinite(values).all():
        raise MjchairError(
            f"heights of shape {values.shape}; they must be finite, (nrow, ncol), each at least 2"
        )
    field = next(f for f in spec.hfields if f.name == geom.hfieldname)
    low, rise = float(values.min()), max(float(np.ptp(values)), 1e-3)
    field.nrow, field.ncol = values.shape
    size = np.array(field.size)
    size[2] = rise
    field.size = size
    field.userdata = ((values - low) / rise).ravel()
    geom.pos = np.add(geom.pos, (0.0, 0.0, low))
    top = _highest_underneath(values, size[0], size[1])
    for body in spec.worldbody.bodies:
        body.pos = np.add(body.pos, (0.0, 0.0, top))


def read_heights(choice: str | os.PathLike[str]) -> Array:
    """Heights from a file, or generated ones.

    Args:
      choice: a file of heights in m: ``.npy``, or ``.csv`` with a row of numbers for each row along
        y and no header; or ``uneven``, also with numbers of `uneven` behind a colon, as in
        ``uneven:rms=5mm,wavelength=0.8,seed=3``.

    Returns:
      (nrow, ncol), m.

    Raises:
      MjchairError: no such file, a cell that is not a number, or an unknown name after the colon.
    """
    word, _, told = str(choice).partition(":")
    if word == "uneven":
        return uneven(**_uneven_numbers(told))  # type: ignore[arg-type]
    path = Path(choice)
    try:
        if path.suffix.lower() == ".npy":
            return np.asarray(np.load(path, allow_pickle=False), dtype=np.float64)
        return np.loadtxt(path, delimiter=",", ndmin=2)
    except OSError as error:
        raise MjchairError(
            f"heights: cannot read {path}: {error.strerror or error}; give a file of heights, or "
            "'uneven'"
        ) from None
    except ValueError as error:
        line = str(error).splitlines()[0]
        raise MjchairError(f"heights: {path} is no table of numbers: {line}") from None


def _uneven_numbers(text: str) -> dict[str, float]:
    """The arguments of `uneven` in text such as ``rms=5mm,seed=3``."""
    units = {"rms": "m", "wavelength": "m", "seed": "1"}
    numbers: dict[str, float] = {"seed": 0}
    for part in filter(None, text.split(",")):
        name, equals, value = part.partition("=")
        if name not in units or not equals:
            raise MjchairError(f"heights: {part!r} is not NAME=VALUE" + nearest(name, units))
        number = quantity(value, units[name], f"heights: {name}")
        low, high = UNEVEN[name]
        if not low <= number <= high:
            raise MjchairError(
                f"heights: {name} is {with_unit(number, units[name])}; it must be within "
                f"{low:g} to {high:g}" + ("; write mm, as rms=5mm" if name == "rms" else "")
            )
        numbers[name] = int(number) if name == "seed" else number
    return numbers


def _highest_underneath(heights: Array, half_x: float, half_y: float) -> float:
    x = np.linspace(-half_x, half_x, heights.shape[1])
    y = np.linspace(-half_y, half_y, heights.shape[0])
    under = (np.abs(y) <= FOOTPRINT[1])[:, None] & (np.abs(x) <= FOOTPRINT[0])
    return float(heights[under].max()) if under.any() else float(heights.max())


def uneven(
    rms: float = 0.003,
    wavelength: float = 1.0,
    *,
    seed: int,
    shape: tuple[int, int] = (101, 201),
    size: tuple[float, float] = (5.0, 2.5),
) -> Array:
    """Heights of a rolling, uneven floor that is level where a chair starts.

    A sum of 32 waves of random direction and phase, of about one wavelength. Around the origin
    (1.2 m) it is faded out.

    Args:
      rms: of the heights away from the origin, m. wavelength: m.
      seed: of the random numbers. shape: (nrow, ncol). size: half lengths along x and y, m.

    Returns:
      (nrow, ncol), m, for `load_spec(scene="hfield", heights=...)`.
    """
    random = np.random.default_rng(seed)
    x = np.linspace(-size[0], size[0], shape[1])[None]
    y = np.linspace(-size[1], size[1], shape[0])[:, None]
    heights = np.zeros(shape)
    count = 32
    for direction, phase, stretch in zip(
        random.uniform(0.0, 2.0 * math.pi, count),
        random.uniform(0.0, 2.0 * math.pi, count),
        random.uniform(0.7, 1.4, count),
        strict=True,
    ):
        wave = 2.0 * math.pi / (wavelength * stretch)
        along = x * math.cos(direction) + y * math.sin(direction)
        heights += np.sin(wave * along + phase)
    heights *= rms / math.sqrt(0.5 * count)
    distance = np.clip((np.hypot(x, y) - 1.2) / 0.6, 0.0, 1.0)
    return np.asarray(heights * distance * distance * (3.0 - 2.0 * distance))


def set_step(spec: mujoco.MjSpec, height: float) -> None:
    """Give the kerb or the threshold of a scene its height.

    Args:
      spec: with a geom `step`, a box or a mesh that is 1 m high before its scale.
      height: m.

    Raises:
      MjchairError: no such geom, or a height that is not positive or above 0.3 m.
    """
    geom = spec.geom(STEP)
    if geom is None:
        raise MjchairError(f"the scene has no geom {STEP!r} to give a height; use kerb, threshold")
    if not 0.0 < height <= HIGHEST_STEP:
        raise MjchairError(f"step is {height:g} m; it must be above 0 and at most {HIGHEST_STEP} m")
    if geom.type == mujoco.mjtGeom.mjGEOM_MESH:
        mesh = spec.mesh(geom.meshname)
        mesh.scale = (mesh.scale[0], mesh.scale[1], height)
        return
    geom.size = (geom.size[0], geom.size[1], 0.5 * height)
    geom.pos = (geom.pos[0], geom.pos[1], 0.5 * height)
