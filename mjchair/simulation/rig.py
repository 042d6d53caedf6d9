"""The paper's experiment in MuJoCo: one wheel held at an angle on a sliding table with load cells.

In: a tire and the points to set. Out: a `Run` for each, with the cells' readings and the forces.

Silva & Dedini (COBEM 2007), section 3. The wheel is simulated with the same callbacks as a chair.
Assumption: the two lateral cells carry the lateral force together, and the reading of each is twice
the force that it carries. The mean of their readings is then the lateral force, as in the paper,
wherever the wheel stands on the table. Readings are forces on the wheel in the table's axes;
equations (19) and (20) turn them into the axes of the wheel.

A run begins with an undeflected tire; its travel is given in relaxation lengths of the tire.
"""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import mujoco
import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from mjchair.engine.install import installed
from mjchair.errors import MjchairError, note
from mjchair.model import assets
from mjchair.model.wheels import check_timestep
from mjchair.tire import Tire, law
from mjchair.tire.paper import velocity_across, velocity_along
from mjchair.units import with_unit

Array = NDArray[np.float64]

ANGLES = (0.0, 5.0, 10.0, 15.0)  # deg, of the paper
LOADS = (30.0, 110.0, 210.0)  # N, of the paper
SPEEDS = (0.002, 0.004)  # m/s, of the paper
TRAVEL = 9.0  # relaxation lengths; the force is then 1e-4 too small, its average over the end 3e-4
SETTLE = 1.0  # s of standing under load before the table starts
SAMPLES = 200  # of a trace
STEADY = 0.1  # share of a trace, at its end, that is averaged
LONGEST_STEP = 0.02  # s
CELL_ARM = 0.3  # m, of the lateral cells ahead of and behind the wheel
FAR = 5.0  # times the nominal load, from which a tire's formula is far extrapolated: an assumption
HELD = 1e9  # kg m^2, armature of a wheel whose spin is prescribed


def _check_range(name: str, value: float, low: float, high: float, unit: str) -> None:
    if not low <= value <= high:
        raise MjchairError(
            f"{name} is {with_unit(value, unit)}; it must be within {low:g} to {high:g}"
        )


@dataclass(frozen=True)
class Point:
    """One run of the rig.

    Attributes:
      angle: slip angle, deg; a positive one gives a negative lateral force (ISO-W).
      load: N. speed: of the table, m/s. camber: deg, about the heading.
      kappa: longitudinal slip that the wheel is driven or braked at; None: it rolls freely.
      turned: the wheel is turned round on its axle, left side to the right.

    Raises:
      MjchairError: a number out of range.
    """

    angle: float
    load: float
    speed: float
    camber: float = 0.0
    kappa: float | None = None
    turned: bool = False

    def __post_init__(self) -> None:
        """Check the ranges."""
        for name, value, low, high, unit in (
            ("slip angle", self.angle, -60.0, 60.0, "deg"),
            ("load", self.load, 1.0, 1e5, "N"),
            ("speed", self.speed, 1e-4, 50.0, "m/s"),
            ("camber", self.camber, -45.0, 45.0, "deg"),
            ("kappa", 0.0 if self.kappa is None else self.kappa, -1.0, 10.0, "1"),
        ):
            _check_range(name, value, low, high, unit)


@dataclass(frozen=True)
class Faults:
    """Errors of the rig, which the table of its measurements does not show.

    Attributes:
      toe: added to the slip angle, deg. camber: added to the camber, deg.
      offset: of each cell's reading, N. noise: of each cell's reading, standard deviation over the
        largest lateral force of the sweep. seed: of the noise.
    """

    toe: float = 0.0
    camber: float = 0.0
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    noise: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        """Check the ranges."""
        for name, value, low, high, unit in (
            ("toe", self.toe, -30.0, 30.0, "deg"),
            ("hidden camber", self.camber, -45.0, 45.0, "deg"),
            ("noise", self.noise, 0.0, 10.0, "of the largest force"),
        ):
            _check_range(name, value, low, high, unit)


@dataclass(frozen=True)
class Run:
    """The result of a run of the rig.

    Attributes:
      point: the set values.
      time: (n,), s. cells: (n, 3), readings of cells 1, 2 (lateral) and 3 (longitudinal), N.
      reading: (3,), the cells' means over the end of the trace.
      force: Fx and Fy on the wheel, in its axes as set, from the readings, N.
      moment: about the vertical at the wheel, from the difference of the lateral cells, N m.
      slip: kappa and tan(alpha) of the tire at the end, 1.
      formula: Fx and Fy of the tire's formula at the actual slip, load and camber, N.
    """

    point: Point
    time: Array
    cells: Array
    reading: Array
    force: tuple[float, float]
    moment: float
    slip: tuple[float, float]
    formula: tuple[float, float]


def sweep(
    angles: Sequence[float] = ANGLES,
    loads: Sequence[float] = LOADS,
    speeds: Sequence[float] = SPEEDS,
    **others: float | bool | None,
) -> list[Point]:
    """Points for all combinations of angle, load and speed; by default those of the paper.

    Args:
      angles: deg. loads: N. speeds: m/s. others: further fields of Point.
    """
    return [
        Point(angle, load, speed, **others)  # type: ignore[arg-type]
        for speed in speeds
        for load in loads
        for angle in angles
    ]


def measure(
    tire: Tire,
    points: Sequence[Point],
    faults: Faults | None = None,
    *,
    travel: float = TRAVEL,
    progress: bool = False,
) -> list[Run]:
    """Run the rig at every point, on as many threads as there are processors.

    Args:
      tire: of the wheel. points: the values to set. faults: errors of the rig; None: no errors.
      travel: of the table, relaxation lengths of the tire.
      progress: show a bar where standard error is a terminal.

    Raises:
      MjchairError: no points, a travel that is not positive, or a tire that the rig cannot run.
    """
    faults = faults or Faults()
    if not points:
        raise MjchairError("the sweep has no points; give an angle, a load and a speed")
    if not travel > 0.0:
        raise MjchairError(f"travel is {travel:g} relaxation lengths; it must be above 0")
    _note_load(tire, max(point.load for point in points))
    with installed(), ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:
        coming = pool.map(lambda point: _run(tire, point, faults, travel), points)
        disable = None if progress else True
        runs = list(tqdm(coming, total=len(points), unit="run", disable=disable))
    return _with_noise(runs, faults)


def _note_load(tire: Tire, largest: float) -> None:
    """Note a load (N) that is far beyond those that the tire's numbers are for."""
    limit = tire.coefficients.get("FZMAX", 0.0)
    if 0.0 < limit < largest:
        note(
            f"the load {largest:g} N is beyond FZMAX of {tire.name}, {limit:g} N; its formula is "
            f"held at {limit:g} N"
        )
    elif limit <= 0.0 and largest > FAR * tire.nominal_load:
        note(
            f"the load {largest:g} N is {largest / tire.nominal_load:.0f} times the nominal load "
            f"of {tire.name}, {tire.nominal_load:g} N; its formula is extrapolated to it"
        )


def specification(tire: Tire, point: Point, faults: Faults | None = None) -> mujoco.MjSpec:
    """The rig set up for a point, with the tire on its wheel, ready to compile."""
    faults = faults or Faults()
    spec = mujoco.MjSpec.from_file(str(assets.folder() / "rig" / "sliding_table.xml"))
    packed = turned_round(tire).block() if point.turned else tire.block()
    geom, radius = spec.geom("wheel_tire"), float(tire.radius)
    geom.size = (radius, radius, 0.5 * radius * math.sqrt(0.2))
    geom.userdata = packed
    spec.body("guide").pos = (0.0, 0.0, radius)
    yaw, roll = -math.radians(point.angle + faults.toe), math.radians(point.camber + faults.camber)
    spec.body("fork").quat = _turned(yaw, roll)
    _strengthen(spec, max(1.0, point.load / max(LOADS)))
    if point.kappa is not None:
        spec.joint("wheel").armature = HELD
    spec.option.timestep = _timestep(spec)
    return spec


def _strengthen(spec: mujoco.MjSpec, factor: float) -> None:
    """Make cells, guide and wheel heavier for loads beyond the paper's, in proportion."""
    for tendon in spec.tendons:
        tendon.stiffness = np.asarray(tendon.stiffness) * factor
        tendon.damping = np.asarray(tendon.damping) * factor
    for name in ("guide", "wheel"):
        body = spec.body(name)
        body.mass *= factor
        body.inertia = np.asarray(body.inertia) * factor


def turned_round(tire: Tire) -> Tire:
    """The tire turned round on its axle: its conicity points the other way.

    In PAC89 the shifts of the force (a12 in proportion to the load, a13 constant) are conicity and
    change their sign. The shifts of the angle (a9, a10) are ply steer and keep theirs.

    Raises:
      MjchairError: the family does not distinguish conicity from ply steer.
    """
    if tire.family in ("linear", "quadratic"):
        return tire
    if tire.family != "pac89":
        raise MjchairError(
            f"tire {tire.name}: {tire.family} does not distinguish conicity from ply steer, so "
            "the rig cannot turn the wheel round; use a pac89 tire"
        )
    flipped = {key: -tire.coefficients.get(key, 0.0) for key in ("a12", "a13")}
    return replace(tire, coefficients={**tire.coefficients, **flipped})


def _turned(yaw: float, roll: float) -> Array:
    """Quaternion of a turn about z, then about the turned x."""
    about_z, about_x, both = np.zeros(4), np.zeros(4), np.zeros(4)
    mujoco.mju_axisAngle2Quat(about_z, [0.0, 0.0, 1.0], yaw)
    mujoco.mju_axisAngle2Quat(about_x, [1.0, 0.0, 0.0], roll)
    mujoco.mju_mulQuat(both, about_z, about_x)
    return both


def _relaxation(packed: Array, load: float) -> float:
    """The longer of the two relaxation lengths, m."""
    return float(max(law.relaxation(packed, load, 0.0)))


def _timestep(spec: mujoco.MjSpec) -> float:
    """LONGEST_STEP, halved until it is at most half of the tire's stability limit."""
    step = LONGEST_STEP
    while step > 1e-5:
        spec.option.timestep = 1.5 * step
        model = spec.compile()
        try:
            check_timestep(model)
        except MjchairError:
            step /= 2.0
            continue
        return step
    raise MjchairError("the tire is too stiff for the rig at any step above 10 us")


def _run(tire: Tire, point: Point, faults: Faults, travel: float) -> Run:
    """One point: settle under load, start the table, travel, read the cells."""
    model = specification(tire, point, faults).compile()
    data = mujoco.MjData(model)
    weight = -model.opt.gravity[2] * model.body_subtreemass[model.body("guide").id]
    data.ctrl[model.actuator("load").id] = weight - point.load
    h = model.opt.timestep
    mujoco.mj_step(model, data, round(SETTLE / h))
    _start(model, data, point, faults)
    packed = model.geom_user[model.geom("wheel_tire").id]
    seconds = travel * _relaxation(packed, point.load) / point.speed
    every = max(1, round(seconds / h / SAMPLES))
    time, cells, sensed = [], [], []
    begin = data.time
    for _ in range(SAMPLES):
        mujoco.mj_step(model, data, every)
        time.append(data.time - begin)
        cells.append(_readings(model, data) + np.array(faults.offset))
        sensed.append(data.sensor("wheel_tire").data.copy())
    if not np.isfinite(cells).all():
        raise MjchairError(
            f"the run at {point.angle:g} deg, {point.load:g} N and {point.speed:g} m/s broke; "
            "give the tire a longer relaxation or less damping"
        )
    last = np.mean(sensed[-max(1, round(STEADY * SAMPLES)) :], axis=0)
    formula = _formula(packed, last, point.speed)
    empty = Run(
        point, np.array(time), np.array(cells), np.zeros(3), (0.0, 0.0), 0.0, (0.0, 0.0), formula
    )
    return _read(replace(empty, slip=(float(last[4]), float(last[5]))))


def _start(model: mujoco.MjModel, data: mujoco.MjData, point: Point, faults: Faults) -> None:
    """Give the table its speed, and the wheel the corresponding spin."""
    contact = data.contact
    if data.ncon != 1:
        raise MjchairError("the wheel does not stand on the table by one contact")
    geom = model.geom("wheel_tire").id
    centre = data.geom_xpos[geom] - contact.pos[0]
    axis = data.geom_xmat[geom].reshape(3, 3)[:, 2]
    heading = np.cross(axis, [0.0, 0.0, 1.0])
    heading /= np.linalg.norm(heading)
    arm = float(np.cross(axis, centre) @ heading)
    rolling = point.speed * heading[0] / arm
    model.geom_surfacevel[model.geom("table").id, 0] = -point.speed
    data.joint("wheel").qvel[0] = rolling * (1.0 + (point.kappa or 0.0))
    data.act[:3] = 0.0


def _readings(model: mujoco.MjModel, data: mujoco.MjData) -> Array:
    """Readings of the cells, N: forces on the wheel, doubled for the lateral cells (see above)."""
    stretch = data.ten_length - model.tendon_length0
    pull = model.tendon_stiffness * stretch + model.tendon_damping * data.ten_velocity
    # tension in the lateral cells, on the left, balances a force to the right; tension in cell 3,
    # behind the wheel, balances a forward force
    return np.asarray(np.array([-2.0, -2.0, 1.0]) * pull)


def _formula(packed: Array, sensed: Array, speed: float) -> tuple[float, float]:
    """Fx and Fy (N) of the tire's formula at the sensed load, slip and camber."""
    slip = law.Slip(sensed[4], sensed[5], sensed[6])
    force = law.steady_forces(packed, sensed[2], slip, law.Rolling(speed, 1.0, 1.0, 0.3), 1.0)
    return float(force.fx), float(force.fy)


def _read(run: Run) -> Run:
    """Force and moment from the end of the cells' trace."""
    reading = run.cells[-max(1, round(STEADY * SAMPLES)) :].mean(axis=0)
    lateral = 0.5 * (reading[0] + reading[1])  # the paper's mean of the two
    yaw = -math.radians(run.point.angle)
    fx = float(velocity_along(reading[2], lateral, yaw))
    fy = float(velocity_across(reading[2], lateral, yaw))
    moment = 0.5 * CELL_ARM * float(reading[0] - reading[1])
    return replace(run, reading=reading, force=(fx, fy), moment=moment)


def _with_noise(runs: list[Run], faults: Faults) -> list[Run]:
    """The runs with noise, the same in size for each run and along its trace.

    Averaging a trace reduces the noise along it, but not the one error of each cell in the run.
    """
    if faults.noise == 0.0:
        return runs
    size = faults.noise * max(abs(run.force[1]) for run in runs)
    rng = np.random.default_rng(faults.seed)
    noisy = []
    for run in runs:
        along = rng.normal(0.0, size, run.cells.shape)
        along -= along[-max(1, round(STEADY * SAMPLES)) :].mean(axis=0)
        noisy.append(_read(replace(run, cells=run.cells + rng.normal(0.0, size, 3) + along)))
    return noisy
