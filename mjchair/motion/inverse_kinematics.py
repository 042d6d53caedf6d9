"""Joint angles of the rider from markers in the chair's axes.

In: markers relative to the chair (n, m, 3), and what they are. Out: a `Motion`: angles of the
rider's joints frame by frame, empty where no marker tells them, the lengths of the segments, and
how far each marker is from where the rider has it.

Segment lengths come from the markers: of a static trial where it tells them, or else of the run.
Then two steps take turns: each frame's angles by bounded least squares (mujoco.minimize), within
what a body reaches; and the place of every marker on its segment, and of the chair's origin, by the
mean of what is left. A marker on a landmark stays near it; one of a cluster goes where the data put
it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import mujoco
import numpy as np
from mujoco import minimize
from numpy.typing import NDArray

from mjchair.errors import MjchairError
from mjchair.measurement.notes import Detail
from mjchair.model.parameters import ChairParameters
from mjchair.model.spec import load_spec
from mjchair.motion.marker_set import MarkerSet
from mjchair.rider.anatomy import JOINTS, PREFIX, SEGMENTS, TABLE
from mjchair.rider.rider import Rider

Array = NDArray[np.float64]

SIGMA = 0.01  # m, of a marker: skin moves by 5-20 mm on the bone
LANDMARK = 0.02  # m, by which a marker may lie off its landmark
POSTURE = 1.5  # rad, how far a joint may be from the chair's posture where markers do not tell
STEADY = 0.25  # rad, how far from the frame before
ROUNDS = 8  # of the two steps that take turns
FRAMES, STILL_FRAMES = 30, 5  # of a run and a static trial, that the places are found from
LENGTHS = {  # segment -> pairs of landmarks along it
    "upper_arm": (("acromion", "lateral_epicondyle"), ("shoulder", "lateral_epicondyle")),
    "forearm": (
        ("lateral_epicondyle", "radial_styloid"),
        ("lateral_epicondyle", "ulnar_styloid"),
        ("lateral_epicondyle", "wrist"),
    ),
}
BUILD = (0.7, 1.4)  # shares of the usual length between which a measured one is believed
NO_LENGTHS = (
    "none measured, since no trial has markers at both ends of an upper arm (acromion, lateral "
    "epicondyle) or of a forearm (lateral epicondyle, a styloid or the wrist)"
)
WORST = 0.08  # m rms over all markers, beyond which these are no markers of this person


@dataclass(frozen=True)
class Motion:
    """A person's motion in the chair.

    Attributes:
      time: (n,), s. angles: joint -> (n,), rad, NaN where no marker tells it.
      center: (n,), m, the rider's moving mass centre forward of the chair, less its mean.
      residuals: marker -> rms, m. rider: the build. placed: (n, m, 3), m, markers in the model's
        chair frame. names: of the markers. qpos: (n, joints), rad, with the joints that no marker
        tells at the chair's posture. notes: one line each. model: of the rider in the chair.
        speed: (n,), m/s, of the chair over the floor, NaN where it was not seen; None: not told.
        heading: (n,), rad, in the laboratory, as in `chair_frame`; the same.
    """

    time: Array
    angles: Mapping[str, Array]
    center: Array
    residuals: Mapping[str, float]
    rider: Rider
    placed: Array
    names: tuple[str, ...]
    qpos: Array
    notes: tuple[str, ...]
    model: mujoco.MjModel
    speed: Array | None = None
    heading: Array | None = None


@dataclass
class _Places:
    """Where the markers are on the model: body index (m,), place in its frame (m, 3), m."""

    body: NDArray[np.int64]
    local: Array
    start: Array
    free: NDArray[np.bool_]
    origin: Array


@dataclass(frozen=True)
class Build:
    """Whose body it is: stature, m, or None; mass, kg, or None; chair: a model or a path."""

    chair: str = "manual"
    stature: float | None = None
    mass: float | None = None


def lengths_of(placed: Array, names: tuple[str, ...], chosen: MarkerSet) -> dict[str, float]:
    """Ratios segment -> measured over usual length, from landmarks at both ends of it.

    Raises:
      MjchairError: a length that no person has.
    """
    where = {mark: names.index(marker) for marker, mark in chosen.landmarks.items()}
    model = load_spec("manual", rider=Rider()).compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    out: dict[str, float] = {}
    for side in ("left", "right"):
        for part, pairs in LENGTHS.items():
            for one, other in pairs:
                ends = f"{side}_{one}", f"{side}_{other}"
                if not all(end in where for end in ends):
                    continue
                between = placed[:, where[ends[0]]] - placed[:, where[ends[1]]]
                if not np.isfinite(between).any():
                    continue
                apart = float(np.nanmedian(np.linalg.norm(between, axis=1)))
                usual = [data.site(PREFIX + end).xpos for end in ends]
                ratio = apart / float(np.linalg.norm(usual[0] - usual[1]))
                if not BUILD[0] < ratio < BUILD[1]:
                    raise MjchairError(
                        f"{ends[0]} and {ends[1]} are {apart:.3f} m apart, "
                        f"{ratio:.2f} times what is usual; are these markers where the set has "
                        "them?"
                    )
                out.setdefault(f"{side}_{part}", ratio)
    return out


def fit(
    time: Array,
    placed: Array,
    names: tuple[str, ...],
    chosen: MarkerSet,
    build: Build,
    static: Array | None = None,
    say: Callable[[str], None] = lambda _: None,
) -> Motion:
    """The motion of a person from markers.

    Args:
      time: (n,), s. placed: (n, m, 3), m, from `chair_frame.in_chair`. names: m of them.
      chosen: what they are, in those names. build: whose. static: (k, m, 3), of a trial at rest,
        for lengths and places; None, or a length that it does not tell: from the run itself.
      say: called with what is under way.

    Raises:
      MjchairError: too few markers, lengths that no person has, markers that fit no person.
    """
    used = [i for i, name in enumerate(names) if name in chosen.body]
    seen = [bool(np.isfinite(placed[:, i, 0]).any()) for i in used]
    missing = [names[i] for i, there in zip(used, seen, strict=True) if not there]
    used = [i for i, there in zip(used, seen, strict=True) if there]
    if len(used) < 3:
        raise MjchairError(
            f"{len(used)} markers of the person were ever seen; at least 3 are needed"
        )
    kept = tuple(names[i] for i in used)
    run = placed[:, used]
    still = None if static is None else static[:, used]
    rider, notes = _rider([run] if still is None else [still, run], kept, chosen, build)
    if missing:
        notes.append(f"never seen, left out: {', '.join(missing)}")
    model = _model(build, rider)
    places = _first_places(model, kept, chosen, still if still is not None else run)
    solver = _Solver(model, places)
    if still is not None:
        _calibrate(solver, still, say, STILL_FRAMES)
    _calibrate(solver, run, say, FRAMES)
    say("angles")
    qpos, left = solver.solve_all(run)
    return _motion(time, run, kept, (model, solver), (qpos, left), rider, notes)


def _rider(
    trials: Sequence[Array], names: tuple[str, ...], chosen: MarkerSet, build: Build
) -> tuple[Rider, list[str]]:
    """The build from the first of the trials that tells a length, and lines on it."""
    ratios: dict[str, float] = {}
    for trial in reversed(trials):
        ratios |= lengths_of(trial, names, _only(chosen, names))
    stature = build.stature
    if stature is None:
        arms = [ratio for name, ratio in ratios.items() if name.endswith(("upper_arm", "forearm"))]
        stature = float(np.clip(1.75 * np.median(arms), 1.2, 2.1)) if arms else 1.75
    base = load_spec("manual", rider=Rider(stature=stature)).compile()
    lengths = {}
    for name, ratio in ratios.items():
        shape = _length(base, name) * 1.75 / stature
        lengths[name] = float(f"{shape * ratio:.4f}")
    said = ", ".join(f"{name} {value:.3f} m" for name, value in lengths.items()) or NO_LENGTHS
    origin = "given" if build.stature is not None else "from the arms" if ratios else "assumed"
    notes: list[str] = [Detail(f"lengths: {said}; stature {stature:.2f} m ({origin})")]
    return Rider(stature=stature, lengths=lengths), notes


def _length(model: mujoco.MjModel, segment: str) -> float:
    """The length of an upper arm or forearm of a model, m: to the next segment's joint."""
    side, _, part = segment.partition("_")
    below = {"upper_arm": "forearm", "forearm": "hand"}[part]
    return float(np.linalg.norm(model.body(f"{PREFIX}{side}_{below}").pos))


def _only(chosen: MarkerSet, names: tuple[str, ...]) -> MarkerSet:
    return replace(
        chosen,
        landmarks={m: w for m, w in chosen.landmarks.items() if m in names},
        clusters={m: w for m, w in chosen.clusters.items() if m in names},
    )


def _model(build: Build, rider: Rider) -> mujoco.MjModel:
    mass = None if build.mass is None else ChairParameters(occupant_mass=build.mass)
    return load_spec(build.chair, rider=rider, parameters=mass).compile()


def _first_places(
    model: mujoco.MjModel, names: tuple[str, ...], chosen: MarkerSet, run: Array
) -> _Places:
    """Markers at their landmarks, clusters in the middle of their segments, chair by the trunk."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    body, local, free = [], [], []
    for name in names:
        if name in chosen.landmarks:
            site = model.site(PREFIX + chosen.landmarks[name])
            body.append(int(site.bodyid[0]))
            local.append(np.array(site.pos))
        else:
            segment = next(s for s in SEGMENTS if s.name == chosen.clusters[name])
            index = model.body(segment.body).id
            body.append(int(index))
            local.append(np.array(model.body_ipos[index]))
        free.append(name in chosen.clusters)
    chair = model.body("chair").id
    offsets = []
    for k, name in enumerate(names):
        if name in chosen.landmarks and np.isfinite(run[:, k, 0]).any():
            world = data.xpos[body[k]] + data.xmat[body[k]].reshape(3, 3) @ local[k]
            local_chair = data.xmat[chair].reshape(3, 3).T @ (world - data.xpos[chair])
            weight = (
                3 if "acromion" in chosen.landmarks[name] or chosen.landmarks[name] == "c7" else 1
            )
            offsets += [local_chair - np.nanmedian(run[:, k], axis=0)] * weight
    origin = np.median(offsets, axis=0) if offsets else np.zeros(3)
    start = np.array(local)
    return _Places(np.array(body), start.copy(), start, np.array(free), np.asarray(origin))


class _Solver:
    """Least squares of one frame at a time; the chair stays where it is."""

    def __init__(self, model: mujoco.MjModel, places: _Places) -> None:
        self.model, self.places = model, places
        self.data = mujoco.MjData(model)
        mujoco.mj_forward(model, self.data)
        joints = [model.joint(joint.name) for joint in JOINTS]
        self.qpos = np.array([int(j.qposadr[0]) for j in joints])
        self.dof = np.array([int(j.dofadr[0]) for j in joints])
        self.bounds = [np.array([float(j.range[k]) for j in joints]) for k in (0, 1)]
        chair = model.body("chair").id
        self.base = np.array(self.data.xpos[chair])
        self.axes = self.data.xmat[chair].reshape(3, 3).copy()

    def world(self, points: Array) -> Array:
        """Points (..., 3) of the chair's axes, at the chair's origin in the model, in the world."""
        return np.asarray(self.base + (points + self.places.origin) @ self.axes.T)

    def pose(self, q: Array) -> None:
        """Put the model's rider in a posture."""
        self.data.qpos[self.qpos] = q
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_comPos(self.model, self.data)

    def markers(self) -> Array:
        """Where the markers are on the model, (m, 3), in the world."""
        turned = self.data.xmat[self.places.body].reshape(-1, 3, 3)
        return np.asarray(
            self.data.xpos[self.places.body] + np.einsum("mij,mj->mi", turned, self.places.local)
        )

    def solve(self, seen: Array, before: Array | None) -> tuple[Array, Array]:
        """Angles (joints,) and what is left (m, 3), m, of one frame (m, 3) in the chair's axes."""
        there = np.flatnonzero(np.isfinite(seen[:, 0]))
        target = self.world(seen[there])
        near = np.zeros(len(JOINTS)) if before is None else before
        pull = np.full(len(JOINTS), 1.0 / (POSTURE if before is None else STEADY))
        rest = 1.0 / POSTURE

        def residual(x: Array) -> Array:
            out = np.empty((3 * there.size + 2 * len(JOINTS), x.shape[1]))
            for k in range(x.shape[1]):
                self.pose(x[:, k])
                off = (self.markers()[there] - target) / SIGMA
                steady = 0.1 * pull * (x[:, k] - near)
                out[:, k] = np.concatenate([off.ravel(), steady, 0.1 * rest * x[:, k]])
            return out

        def jacobian(x: Array, _: Array) -> Array:
            self.pose(x[:, 0])
            points = self.markers()
            rows = np.empty((3 * there.size, len(JOINTS)))
            full = np.empty((3, self.model.nv))
            for i, marker in enumerate(there):
                mujoco.mj_jac(
                    self.model, self.data, full, None, points[marker], int(self.places.body[marker])
                )
                rows[3 * i : 3 * i + 3] = full[:, self.dof] / SIGMA
            eye = 0.1 * np.eye(len(JOINTS))
            return np.concatenate([rows, eye * pull, eye * rest])

        start = np.clip(near, self.bounds[0], self.bounds[1])
        found, _ = minimize.least_squares(
            start, residual, bounds=self.bounds, jacobian=jacobian, verbose=0, max_iter=25,
            xtol=1e-5, gtol=1e-6,
        )  # fmt: skip
        self.pose(found)
        left = np.full((len(seen), 3), np.nan)
        left[there] = (self.markers()[there] - target) @ self.axes
        return np.asarray(found), left

    def solve_all(self, run: Array) -> tuple[Array, Array]:
        """Angles (n, joints) and what is left (n, m, 3), m, of all frames; NaN without markers."""
        qpos = np.full((len(run), len(JOINTS)), np.nan)
        left = np.full(run.shape, np.nan)
        before = None
        for k, frame in enumerate(run):
            if np.isfinite(frame[:, 0]).sum() >= 3:
                qpos[k], left[k] = self.solve(frame, before)
                before = qpos[k]
            else:
                before = None
        return qpos, left


def _calibrate(solver: _Solver, sample: Array, say: Callable[[str], None], most: int) -> None:
    """Find where markers are on their segments, and the chair's origin, from some frames."""
    count = np.isfinite(sample[..., 0]).sum(axis=1)
    enough = np.flatnonzero(count >= max(3, 0.6 * count.max()))
    frames = enough[np.linspace(0, enough.size - 1, min(most, enough.size)).astype(int)]
    places = solver.places
    before: list[Array | None] = [None] * frames.size
    for number in range(ROUNDS):
        say(f"places of markers, round {number + 1} of {ROUNDS}")
        offs = np.full((frames.size, *sample.shape[1:]), np.nan)
        shift = []
        for k, frame in enumerate(frames):
            before[k], left = solver.solve(sample[frame], before[k])
            turned = solver.data.xmat[places.body].reshape(-1, 3, 3)
            world = -left @ solver.axes.T
            offs[k] = np.einsum("mji,mj->mi", turned, world)
            shift.append(np.nanmean(left, axis=0))
        places.origin = places.origin + np.mean(shift, axis=0)
        _move(places, offs)


def _move(places: _Places, offs: Array) -> None:
    """Move each marker by the mean of what is left; one on a landmark is held near it."""
    seen = np.isfinite(offs[..., 0]).sum(axis=0)
    mean = np.where(seen[:, None] > 0, np.nansum(offs, axis=0) / np.maximum(seen, 1)[:, None], 0.0)
    wanted = places.local + mean - places.start
    held = seen / (seen + (SIGMA / LANDMARK) ** 2 * np.maximum(seen, 1))
    share = np.where(places.free, 1.0, held)
    moved = share[:, None] * wanted
    size = np.linalg.norm(moved, axis=1, keepdims=True)
    limit = np.where(places.free, np.inf, 2.0 * LANDMARK)[:, None]
    places.local = places.start + moved * np.minimum(1.0, limit / np.maximum(size, 1e-12))


def _motion(
    time: Array,
    run: Array,
    names: tuple[str, ...],
    solved: tuple[mujoco.MjModel, _Solver],
    found: tuple[Array, Array],
    rider: Rider,
    notes: list[str],
) -> Motion:
    model, solver = solved
    qpos, left = found
    size = np.linalg.norm(left, axis=2)
    residuals = {
        name: float(np.sqrt(np.nanmean(size[:, k] ** 2)))
        for k, name in enumerate(names)
        if np.isfinite(size[:, k]).any()
    }
    if not residuals:
        raise MjchairError("no frame has three markers of the person; nothing tells the motion")
    whole = float(np.sqrt(np.nanmean(size**2)))
    if whole > WORST:
        raise MjchairError(
            f"the markers are {1e3 * whole:.0f} mm off the rider (rms): they are those of another "
            "person, or not where the marker set has them; give the static trial of the same person"
        )
    angles = _told(run, qpos, solver)
    limits = [
        joint.name.removeprefix(PREFIX)
        for i, joint in enumerate(JOINTS)
        if _at_limit(angles[joint.name], (solver.bounds[0][i], solver.bounds[1][i]))
    ]
    if limits:
        notes.append(
            f"at the limit of what a body reaches for over 5 % of the time: {', '.join(limits)}"
        )
    center = _center(model, solver, qpos)
    placed = run + solver.places.origin
    filled = np.nan_to_num(qpos)
    return Motion(
        time, angles, center, residuals, rider, placed, names, filled, tuple(notes), model
    )


def _at_limit(values: Array, bounds: tuple[float, float]) -> bool:
    there = values[np.isfinite(values)]
    if not there.size:
        return False
    near = (there < bounds[0] + 0.01) | (there > bounds[1] - 0.01)
    return bool(near.mean() > 0.05)


def _told(run: Array, qpos: Array, solver: _Solver) -> dict[str, Array]:
    """The angles of joints whose segment, or one beyond it, has a marker in that frame."""
    model = solver.model
    out = {}
    for i, joint in enumerate(JOINTS):
        own = model.body(PREFIX + joint.segment).id
        beyond = [k for k, body in enumerate(solver.places.body) if _carries(model, own, int(body))]
        seen = np.isfinite(run[:, beyond, 0]).any(axis=1) if beyond else np.zeros(len(run), bool)
        out[joint.name] = np.where(seen, qpos[:, i], np.nan)
    return out


def _carries(model: mujoco.MjModel, segment: int, body: int) -> bool:
    """Whether a body is a segment or hangs on it."""
    while body > 0:
        if body == segment:
            return True
        body = int(model.body_parentid[body])
    return False


def _center(model: mujoco.MjModel, solver: _Solver, qpos: Array) -> Array:
    """How far the whole rider's centre of mass is forward, m, less its mean; NaN where not told."""
    bodies = [model.body(segment.body).id for segment in SEGMENTS]
    mass = model.body_mass[bodies]
    share = _upper_share()
    out = np.full(len(qpos), np.nan)
    for k, q in enumerate(qpos):
        if np.isfinite(q).all():
            solver.pose(q)
            place = mass @ solver.data.xipos[bodies] / mass.sum()
            out[k] = share * float((place - solver.base) @ solver.axes[:, 0])
    return out - np.nanmean(out) if np.isfinite(out).any() else out


def _upper_share() -> float:
    """The share of the person's mass that moves: trunk, head and arms."""
    rows = TABLE["male"]
    return sum(rows[row].mass for segment in SEGMENTS for row in segment.rows)
