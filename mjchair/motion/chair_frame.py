"""Markers in the chair's axes: x forward, y left, z up, whatever the laboratory's axes are.

In: markers and a set. Out: their positions relative to the chair, frame by frame. Up is the axis
of which all markers are on one side, since laboratories have their origin on the floor, and along
which head and shoulders lie above the chair. Forward is the way the chair goes; where it stays in
place (rollers, treadmill), from its rear to its front, or ahead of the person by left and right.
The chair rolls on a level floor: it turns about the vertical.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter

from mjchair.errors import MjchairError
from mjchair.measurement.markers import SMOOTH, Markers
from mjchair.measurement.notes import Detail
from mjchair.measurement.stretches import stretches
from mjchair.motion.marker_set import MarkerSet

Array = NDArray[np.float64]

HIGH = {"c7", "sternum", "left_acromion", "right_acromion", "left_shoulder", "right_shoulder"}
HIGH_SEGMENTS = {"head", "trunk"}
TRAVELS = 1.0  # m, of a chair's way from which forward is told
RIGID = 0.03  # m, by which the distance of two markers of a chair may change
SHORT = 0.2  # s, of a gap that is bridged
ABOVE = 0.99  # share of all samples that must lie above the floor
LEAST = 0.05  # m, by which head and shoulders must lie above the chair
SURE = 0.05  # m, by which left must lie left of right to tell which is which


@dataclass(frozen=True)
class InChair:
    """Markers relative to the chair.

    Attributes:
      positions: (n, m, 3), m, x forward, y left, z up. speed: (n,), m/s, at which the chair goes
        forward over the laboratory's floor, NaN where it is not seen. heading: (n,), rad, of the
        direction in which the chair faces, about up, from the laboratory's first level axis (x, or
        z where y is up), NaN where it is not seen. axes: what up and forward are, in words.
        notes: what was found out, one line each.
    """

    positions: Array
    speed: Array
    heading: Array
    axes: str
    notes: tuple[str, ...]


def bridged(time: Array, positions: Array, longest: float = SHORT) -> Array:
    """Positions (n, m, 3) with gaps of up to `longest` (s) filled along straight lines."""
    out = positions.copy()
    for k in range(out.shape[1]):
        there = np.flatnonzero(np.isfinite(out[:, k, 0]))
        for a, b in pairwise(there):
            if b - a > 1 and time[b] - time[a] <= longest:
                part = np.linspace(0.0, 1.0, b - a + 1)[1:-1, None]
                out[a + 1 : b, k] = out[a, k] + part * (out[b, k] - out[a, k])
    return out


def in_chair(markers: Markers, chosen: MarkerSet, positions: Array | None = None) -> InChair:
    """The markers in the chair's axes.

    Args:
      markers: as read. chosen: what they are. positions: bridged ones; None: those of `markers`.

    Raises:
      MjchairError: no marker on the chair, up or forward that cannot be told, sides swapped.
    """
    positions = markers.positions if positions is None else positions
    chair = [markers.names.index(name) for name in chosen.chair]
    if not chair:
        raise MjchairError(
            f"{markers.source}: no marker on the chair or the pelvis; name some in [chair] of the "
            "marker set: the person's motion is told against the chair"
        )
    if not np.isfinite(positions[:, chair, 0]).any():
        raise MjchairError(
            f"{markers.source}: no marker on the chair or the pelvis was ever seen "
            f"({', '.join(chosen.chair)}): the person's motion is told against the chair"
        )
    up = _axis(chosen.up) if chosen.up else _up(markers, chosen, positions)
    center, heading = _chair_motion(positions[:, chair], up)
    way = _way(markers.time, center, heading, up)
    forward, how = _forward(markers, chosen, positions, (up, way))
    left = np.cross(up, forward)
    basis = np.stack([forward, left, up])
    turned = np.einsum("ij,nmj->nmi", basis, positions - center[:, None])
    cos, sin = np.cos(heading), np.sin(heading)
    x = cos[:, None] * turned[..., 0] + sin[:, None] * turned[..., 1]
    y = -sin[:, None] * turned[..., 0] + cos[:, None] * turned[..., 1]
    out = np.stack([x, y, turned[..., 2]], axis=2)
    _check_sides(markers, chosen, out)
    axes = f"up is {_axis_text(up)}, forward is {_axis_text(forward)} ({how})"
    said = Detail(f"{chosen.name}: {axes}")
    ahead = cos[:, None] * forward + sin[:, None] * left
    speed = np.einsum("ij,ij->i", _rate(markers.time, center), ahead)
    return InChair(out, speed, _in_laboratory(ahead, up), axes, (said,))


def _in_laboratory(ahead: Array, up: Array) -> Array:
    """Angle (n,) about up, rad, of level directions (n, 3).

    The laboratory's axes, taken on in their order from the one that points up, are the first and
    second level axes: x and y for z, z and x for y, y and z for x.
    """
    main = int(np.argmax(np.abs(up)))
    first = np.eye(3)[(main + 1) % 3]
    first = first - up * (up @ first)
    return np.asarray(np.arctan2(ahead @ np.cross(up, first), ahead @ first))


def _rate(time: Array, center: Array) -> Array:
    """The chair's velocity (n, 3), m/s, by local parabolas; NaN in gaps."""
    out = np.full(center.shape, np.nan)
    step = float(np.median(np.diff(time)))
    width = 2 * max(2, round(SMOOTH / step)) + 1
    for a, b in stretches(np.isfinite(center[:, 0])):
        if b - a >= width:
            out[a:b] = savgol_filter(center[a:b], width, 2, deriv=1, delta=step, axis=0)
    return out


def _axis(text: str) -> Array:
    axis = np.zeros(3)
    axis["xyz".index(text[-1])] = -1.0 if text.startswith("-") else 1.0
    return axis


def _axis_text(axis: Array) -> str:
    near = int(np.argmax(np.abs(axis)))
    if abs(axis[near]) > 0.999:
        return f"{'-' if axis[near] < 0 else '+'}{'xyz'[near]}"
    return "(" + ", ".join(f"{v:+.2f}" for v in axis) + ")"


def _up(markers: Markers, chosen: MarkerSet, positions: Array) -> Array:
    """The axis of the laboratory that points up.

    Laboratories have their origin on the floor: of the axes of which every marker is on one side,
    the one along which head and shoulders lie furthest above the chair; of all axes
    if there is none.
    """
    known = [markers.names.index(name) for name in (*chosen.body, *chosen.chair)]
    values = positions[:, known].reshape(-1, 3)
    values = values[np.isfinite(values[:, 0])]
    positive = np.mean(values > 0.0, axis=0)
    one_sided = (positive > ABOVE) | (positive < 1.0 - ABOVE)
    high = [m for m, mark in chosen.landmarks.items() if mark in HIGH]
    high += [m for m, part in chosen.clusters.items() if part in HIGH_SEGMENTS]
    chair = _middle(markers, list(chosen.chair), positions)
    apart = np.nanmedian(_middle(markers, high or list(chosen.body), positions) - chair, axis=0)
    agrees = one_sided & (np.sign(apart) == np.where(positive > 0.5, 1.0, -1.0))
    lifted = np.where(agrees if agrees.any() else True, np.nan_to_num(apart), 0.0)
    best = int(np.argmax(np.abs(lifted)))
    if abs(lifted[best]) < LEAST:
        raise MjchairError(
            f"{markers.source}: up cannot be told from the markers; say it in the marker set, "
            'as in up = "z"'
        )
    axis = np.zeros(3)
    axis[best] = np.sign(lifted[best])
    return axis


def _middle(markers: Markers, names: list[str], positions: Array) -> Array:
    """The middle (n, 3) of some markers, of those that are seen."""
    if not names:
        return np.full((len(positions), 3), np.nan)
    part = positions[:, [markers.names.index(name) for name in names]]
    there = np.isfinite(part)
    count = there.all(axis=2).sum(axis=1)
    total = np.where(there, part, 0.0).sum(axis=1)
    return np.where(count[:, None] > 0, total / np.maximum(count, 1)[:, None], np.nan)


def _chair_motion(chair: Array, up: Array) -> tuple[Array, Array]:
    """Where the chair's markers (n, k, 3) have their middle, and how far they have turned, rad.

    Every frame is laid on the shape of the chair by the best turn about the vertical. The shape is
    the frame with most markers whose distances are usual; a marker that leaves the shape is
    left out.
    """
    usual = _without_ghosts(chair)
    seen = np.isfinite(usual[..., 0])
    if not seen.any():
        return np.full((len(chair), 3), np.nan), np.full(len(chair), np.nan)
    first = np.eye(3)[int(np.argmin(np.abs(up)))]
    side = np.cross(up, first)
    flat = np.stack([usual @ first, usual @ side], axis=2)
    shape = flat[int(np.argmax(seen.sum(axis=1)))]
    height = np.nanmedian(usual @ up, axis=0)
    center, heading = np.full((len(chair), 3), np.nan), np.full(len(chair), np.nan)
    middle = np.nanmean(shape, axis=0)
    angle = 0.0
    for k in range(len(chair)):
        both = seen[k] & np.isfinite(shape[:, 0])
        if not both.any():
            continue
        mine, model = flat[k, both], shape[both]
        a, b = mine - mine.mean(axis=0), model - model.mean(axis=0)
        if both.sum() > 1:
            angle = float(np.arctan2(np.sum(b[:, 0] * a[:, 1] - b[:, 1] * a[:, 0]), np.sum(a * b)))
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        place = mine.mean(axis=0) + turn @ (middle - model.mean(axis=0))
        level = float(np.mean((usual[k, both] @ up) - height[both]) + np.nanmean(height))
        center[k] = place[0] * first + place[1] * side + level * up
        heading[k] = angle
    return center, heading


def _without_ghosts(chair: Array) -> Array:
    """The chair's markers without samples whose distances to the others are not the usual ones."""
    out = chair.copy()
    count = chair.shape[1]
    if count < 3:
        return out
    apart = np.linalg.norm(chair[:, :, None] - chair[:, None], axis=3)
    usual = np.nanmedian(np.where(np.isfinite(apart), apart, np.nan), axis=0)
    wrong = np.abs(apart - usual) > RIGID
    seen = np.isfinite(apart)
    others = seen.sum(axis=2) - 1
    out[(wrong & seen).sum(axis=2) > 0.5 * np.maximum(others, 1)] = np.nan
    return out


def _forward(
    markers: Markers, chosen: MarkerSet, positions: Array, known: tuple[Array, Array]
) -> tuple[Array, str]:
    """The horizontal direction (3,) in which the chair looks at heading 0, and how it was told."""
    up, way = known
    if chosen.forward:
        return _axis(chosen.forward), "said"
    front = None
    if chosen.front and chosen.rear:
        ahead = _middle(markers, list(chosen.front), positions) - _middle(
            markers, list(chosen.rear), positions
        )
        front = np.nanmedian(ahead, axis=0) if np.isfinite(ahead).any() else None
    if np.linalg.norm(way) > TRAVELS:
        if front is not None and front @ way < 0.0:
            return _level(-way, up), "against the way it goes: its front is behind, it rolls back"
        return _level(way, up), "the way it goes"
    if front is not None:
        return _snapped(front, up), "from its rear to its front"
    across = _left(markers, chosen, positions)
    if across is None:
        raise MjchairError(
            f"{markers.source}: the chair stays in place and nothing tells its front; say it "
            'in the marker set, as in forward = "x"'
        )
    return _level(np.cross(across, up), up), "ahead of left and right"


def _way(time: Array, center: Array, heading: Array, up: Array) -> Array:
    """The way (3,) that the chair goes on balance, m, seen from the chair at heading 0.

    Each step is turned back by the heading, so that a chair that turns round still goes forward.
    What happens while the chair is not seen does not count: it may be carried back to its start.
    """
    steps = np.diff(center, axis=0)
    seen = np.isfinite(steps[:, 0]) & (np.diff(time) < SHORT)
    level = steps - np.outer(steps @ up, up)
    angle = -heading[:-1]
    across = np.cross(up, level)
    turned = np.cos(angle)[:, None] * level + np.sin(angle)[:, None] * across
    return np.asarray(turned[seen].sum(axis=0))


def _level(vector: Array, up: Array) -> Array:
    flat = vector - up * (up @ vector)
    return np.asarray(flat / np.linalg.norm(flat))


def _snapped(vector: Array, up: Array) -> Array:
    """A level direction, on an axis of the laboratory if it is within 15 degrees of one."""
    flat = _level(vector, up)
    near = int(np.argmax(np.abs(flat)))
    if abs(flat[near]) > np.cos(np.radians(15.0)):
        axis = np.zeros(3)
        axis[near] = np.sign(flat[near])
        return axis
    return flat


def _sides(chosen: MarkerSet) -> tuple[list[str], list[str]]:
    marks = {**chosen.landmarks, **chosen.clusters}
    left = [name for name, where in marks.items() if where.startswith("left")]
    right = [name for name, where in marks.items() if where.startswith("right")]
    return left, right


def _left(markers: Markers, chosen: MarkerSet, positions: Array) -> Array | None:
    left, right = _sides(chosen)
    apart = _middle(markers, left, positions) - _middle(markers, right, positions)
    return np.nanmedian(apart, axis=0) if np.isfinite(apart).any() else None


def _check_sides(markers: Markers, chosen: MarkerSet, placed: Array) -> None:
    """Refuse markers whose left ones lie right of the right ones."""
    across = _left(markers, chosen, placed)
    if across is not None and across[1] < -SURE:
        left, right = _sides(chosen)
        raise MjchairError(
            f"{markers.source}: the left markers ({', '.join(left[:3])} ...) lie "
            f"{-across[1]:.2f} m to the right of the right ones ({', '.join(right[:3])} ...); "
            "their sides are swapped, or forward is wrong: say it in the marker set"
        )
