"""How a chair moves in a replay: poses of its bodies, its tires' contacts, and its signals.

In: a recording. Out: a Track, at as few samples as are needed: `RATE` a second, and more where the
motion between them is not straight, so that a pose between two samples is nowhere farther than
`CLOSE` from the recording. A run with more samples than fit keeps them evenly, and says so.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.errors import MjchairError
from mjchair.model.wheels import base_name
from mjchair.report.forces import COMPONENTS
from mjchair.simulation.contacts import wheel_contacts
from mjchair.simulation.recording import Recording

Array = NDArray[np.float64]
Samples = NDArray[np.int64]

RATE = 60.0  # Hz
CLOSE = 4e-5  # m, of a body's origin, and of a point REACH away from it
REACH = 0.35  # m, about a rear wheel's radius
MOST = 4000  # samples of a replay; a page of the manual chair is then at most 3 MB
REAR = ("left_wheel", "right_wheel")
ROUNDS = 6  # of putting samples where they are missed
EVERY = 60_000  # samples of a recording beyond which only evenly spaced ones are looked at


@dataclass(frozen=True)
class Track:
    """The motion of one chair.

    Attributes:
      label: what it is called in the page.
      time: (n,), s.
      places: (n, bodies, 3), m, world. quaternions: (n, bodies, 4), w first; neighbours in time
        lie on the same side, so that they can be averaged.
      path: (n, 3), m, on the ground, of the middle of the rear axle.
      contacts: wheel -> (n, 9): place (m), normal, forward axis; NaN where the wheel is in the air.
      signals: name -> (n,). units: name -> unit.
      inputs: names of the signals that drove the chair.
      rate: samples of the recording a second that are shown, Hz, where it is thinned below RATE,
        else None.
      status: how it ended, in a line.
    """

    label: str
    time: Array
    places: Array
    quaternions: Array
    path: Array
    contacts: dict[str, Array]
    signals: dict[str, Array]
    units: dict[str, str]
    rate: float | None
    status: str
    inputs: tuple[str, ...] = ()

    def arrays(self, name: str) -> dict[str, NDArray[Any]]:
        """The numbers for packing.pack, names beginning with `name`."""
        n = self.time.size
        arrays = {
            f"{name}.time": self.time,
            f"{name}.places": self.places.reshape(n, -1),
            f"{name}.quaternions": self.quaternions.reshape(n, -1),
            f"{name}.path": self.path,
        }
        arrays |= {f"{name}.contact.{wheel}": values for wheel, values in self.contacts.items()}
        if self.signals:
            arrays[f"{name}.signals"] = np.column_stack(list(self.signals.values()))
        return {key: values.astype(np.float32) for key, values in arrays.items()}


def track(recording: Recording, label: str = "", most: int = MOST) -> Track:
    """The track of a recording.

    Args:
      recording: of any simulation. label: for the page. most: samples to keep, at least 2.

    Raises:
      MjchairError: this MuJoCo cannot read the recorded model, or its positions do not fit it.
    """
    model = recording.model.load()
    if recording.qpos.shape[1] != model.nq:
        raise MjchairError(
            f"the recording has {recording.qpos.shape[1]} positions and its model {model.nq}; "
            "it is damaged"
        )
    if not np.isfinite(recording.qpos).all():
        raise MjchairError("the recording has positions that are not numbers; it is damaged")
    looked_at = evenly(recording.time, min(EVERY, recording.time.size))
    places, quaternions = poses(model, recording.qpos[looked_at])
    chosen = _chosen(recording.time[looked_at], places, quaternions, most)
    kept = looked_at[chosen]
    wanted = min(RATE, 1.0 / max(recording.timestep, 1e-9))
    span = float(np.ptp(recording.time))
    rate = (kept.size - 1) / span if span > 0.0 else wanted
    recorded = (recording.time.size - 1) / span if span > 0.0 else wanted
    contacts = {
        wheel: np.column_stack([c.place, c.normal, c.forward])
        for wheel, c in wheel_contacts(recording, [int(k) for k in kept]).items()
    }
    return Track(
        label=label,
        time=recording.time[kept],
        places=places[chosen],
        quaternions=quaternions[chosen],
        path=_path(places[chosen], contacts),
        contacts=contacts,
        signals={k: v[kept] for k, v in recording.columns.items() if k != "time"},
        units=dict(recording.units),
        rate=rate if rate < 0.9 * min(RATE, recorded) else None,
        status=recording.describe(),
        inputs=tuple(recording.controls),
    )


def poses(model: mujoco.MjModel, qpos: Array) -> tuple[Array, Array]:
    """Places (n, bodies, 3), m, and quaternions (n, bodies, 4) of all bodies, world.

    Args:
      model: whose bodies. qpos: (n, nq).
    """
    data = mujoco.MjData(model)
    places = np.empty((len(qpos), model.nbody, 3))
    quaternions = np.empty((len(qpos), model.nbody, 4))
    for k, row in enumerate(qpos):
        data.qpos[:] = row
        mujoco.mj_kinematics(model, data)
        places[k], quaternions[k] = data.xpos, data.xquat
    turned = np.einsum("nbi,nbi->nb", quaternions[1:], quaternions[:-1]) < 0.0
    flips = np.cumsum(turned, axis=0) % 2 == 1
    quaternions[1:][flips] *= -1.0
    return places, quaternions


def evenly(time: Array, count: int) -> Samples:
    """Indices of about `count` samples, evenly spaced, with the first and the last."""
    return np.unique(np.round(np.linspace(0, time.size - 1, count)).astype(np.int64))


def _chosen(time: Array, places: Array, quaternions: Array, most: int) -> Samples:
    """Samples to keep: RATE a second, then those that the rest misses; evenly if they are many."""
    span = float(time[-1] - time[0])
    grid = time[0] + np.arange(int(span * RATE) + 1) / RATE
    kept = np.unique(np.append(np.searchsorted(time, grid - 1e-9), time.size - 1))
    kept = kept[kept < time.size]
    if kept.size >= most:
        return evenly(time, most)
    for _ in range(ROUNDS):
        missed = _missed(time, places, quaternions, kept)
        if not missed.size:
            break
        room = most - kept.size
        kept = np.union1d(kept, missed[:room])
    return kept


def _missed(time: Array, places: Array, quaternions: Array, kept: Samples) -> Samples:
    """The worst sample of every gap between kept ones in which it is worse than CLOSE, worst first.

    The same interpolation as in the browser: straight lines and the shorter turn.
    """
    after = np.clip(np.searchsorted(kept, np.arange(time.size), side="right"), 1, kept.size - 1)
    low, high = kept[after - 1], kept[after]
    share = ((time - time[low]) / np.maximum(time[high] - time[low], 1e-12))[:, None]
    straight = places[low] + share[..., None] * (places[high] - places[low])
    error = np.linalg.norm(straight - places, axis=-1)
    cosine = np.abs(
        np.einsum("nbi,nbi->nb", slerp(quaternions[low], quaternions[high], share), quaternions)
    )
    error += REACH * 2.0 * np.arccos(np.minimum(cosine, 1.0))
    worst = error.max(axis=1)
    bad = np.flatnonzero(worst > CLOSE)
    order = bad[np.lexsort((-worst[bad], after[bad]))]
    first = order[np.unique(after[order], return_index=True)[1]]
    return first[np.argsort(-worst[first])]


def slerp(start: Array, end: Array, share: Array) -> Array:
    """The turn `share` (n, 1) of the way from quaternions (n, b, 4) to others, at even speed."""
    cosine = np.clip(np.einsum("nbi,nbi->nb", start, end), -1.0, 1.0)
    angle = np.arccos(cosine)
    sine = np.sin(angle)
    small = sine < 1e-4
    divisor = np.where(small, 1.0, sine)
    a = np.where(small, 1.0 - share, np.sin((1.0 - share) * angle) / divisor)
    b = np.where(small, share, np.sin(share * angle) / divisor)
    mixed = a[..., None] * start + b[..., None] * end
    return np.asarray(mixed / np.linalg.norm(mixed, axis=-1, keepdims=True))


def _path(places: Array, contacts: dict[str, Array]) -> Array:
    """On the ground between the rear wheels, straight where they are in the air.

    Where a chair of another kind has no such wheels, the place of its first body.
    """
    rear = [contacts[wheel][:, :3] for wheel in contacts if base_name(wheel) in REAR]
    if not rear:
        return places[:, min(1, places.shape[1] - 1)]
    path = np.mean(rear, axis=0)
    there = np.isfinite(path).all(axis=1)
    if not there.any():
        return places[:, min(1, places.shape[1] - 1)]
    samples = np.arange(len(path))
    return np.column_stack([np.interp(samples, samples[there], c[there]) for c in path.T])


def force_channels(wheel: str) -> dict[str, str]:
    """Component -> channel of the forces of a wheel."""
    return {name: f"{wheel}_tire.{axis}" for name, axis in COMPONENTS.items()}
