"""Studies with a hidden effect, made by code that is independent of the diagnosis.

This file shares no effect code with the library. A hidden effect is an edit of the compiled
MjModel, or a force that this file computes and applies in its own loop of mj_step, with half the
time step of the diagnosis and another integrator. Masses, stiffnesses and sensors have errors of a
few percent; the samples are noisy, rounded, and sometimes missing. The answer goes into a sealed
file.
"""

from __future__ import annotations

import base64
import csv
import json
import zlib
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path

import mujoco
import numpy as np

import mjchair
from mjchair.simulation.initial import Initial, start

STEP = 0.001  # s
RATE = 100  # Hz, of the tables
SEAL = "answer.sealed"
WHEELS = ("left_wheel", "right_wheel", "left_caster", "right_caster")
NOISE = {  # standard deviations, SI, and rounding
    "left_wheel_angle": (0.01, 2 * np.pi / 2048),
    "right_wheel_angle": (0.01, 2 * np.pi / 2048),
    "left_wheel_speed": (0.05, 0.0),
    "right_wheel_speed": (0.05, 0.0),
    "left_caster_angle": (0.01, 0.0),
    "right_caster_angle": (0.01, 0.0),
    "imu_gyro.z": (0.02, 0.0),
    "imu_accelerometer.x": (0.3, 0.0),
    "imu_accelerometer.y": (0.3, 0.0),
    "position.x": (0.01, 0.0),
    "position.y": (0.01, 0.0),
    "heading": (0.01, 0.0),
}


@dataclass
class Manoeuvre:
    """One run: how it starts and what drives it."""

    name: str
    heading: float
    speed: float
    yaw: float = 0.0
    torque: object = None  # t -> (left, right), N m; None: a coast
    position: tuple[float, float] = (0.0, 0.0)


def _pushes(t: float) -> tuple[float, float]:
    phase = (t - 0.2) % 1.15
    bell = 14.0 * np.sin(np.pi * phase / 0.46) ** 2 if 0.0 <= phase < 0.46 and t > 0.2 else 0.0
    return bell, bell


def _slalom(t: float) -> tuple[float, float]:
    swing = 11.0 * np.sin(2 * np.pi * (0.35 * t + 0.04 * t * t))  # 0.35 to 0.85 Hz
    return 2.5 + swing, 2.5 - swing


def _circle(t: float) -> tuple[float, float]:
    more = 9.0 * np.tanh(t / 0.4)
    return 3.0 - more, 3.0 + more


def _stop_and_go(t: float) -> tuple[float, float]:
    # ramps of 0.1 s: a table at RATE must be able to tell its torque
    on = 0.5 * (1.0 + np.tanh((t - 1.0) / 0.05))
    base = 2.5 + 5.5 * np.tanh(np.sin(2.0 * np.pi * (t - 1.0) / 3.0) / 0.2)
    return on * (base + 2.5 * np.sin(1.7 * t)), on * (base - 2.5 * np.sin(1.7 * t))


MANOEUVRES = (
    Manoeuvre("coast", 0.0, 1.8),
    Manoeuvre("coast", np.pi, 1.4, position=(6.0, 0.2)),
    Manoeuvre("turn", 0.5, 1.7, 0.0, _circle),
    Manoeuvre("push", 1.2, 0.8, 0.0, _pushes),
    Manoeuvre("slalom", -0.6, 1.8, 0.0, _slalom),
    Manoeuvre("start", 2.4, 0.0, 0.0, _stop_and_go),
)


@dataclass
class Case:
    """A hidden answer: kind is none, one, two or outside; hidden maps names to parameters.

    sigma: intended detectability of each effect. reached: the one that it has, after the fit of the
    roughly known numbers.
    """

    kind: str
    hidden: dict[str, dict[str, float]] = field(default_factory=dict)
    sigma: float = 0.0
    channel: str = ""
    reached: dict[str, float] = field(default_factory=dict)


class World:
    """A chair with something hidden in it, stepped by this file."""

    def __init__(
        self, rng: np.random.Generator | None, hidden: dict[str, dict[str, float]]
    ) -> None:
        """Perturb the roughly known numbers (None: no perturbation), then hide the effects."""
        self.hidden = hidden
        self.forces = [n for n in hidden if hasattr(self, f"_force_{n}")]
        spec = mjchair.load_spec()
        for geom in list(spec.geoms):
            if not geom.contype and not geom.conaffinity:
                spec.delete(geom)
        m = spec.compile()
        m.opt.timestep = STEP
        m.opt.integrator = mujoco.mjtIntegrator.mjINT_EULER
        self.m = m
        self.chair = m.body("chair").id
        self.dof = {j: int(m.joint(j).dofadr[0]) for j in (*WHEELS, *SWIVELS)}
        self.tire = {w: m.geom(f"{w}_tire").id for w in WHEELS}
        if rng is not None:
            self._perturb(rng)
        for name, values in hidden.items():
            edit = getattr(self, f"_edit_{name}", None)
            if edit is not None:
                edit(**values)
        mujoco.mj_setConst(m, mujoco.MjData(m))

    def _perturb(self, rng: np.random.Generator) -> None:
        m, c = self.m, self.chair
        factor = 1.0 + 0.03 * rng.standard_normal()
        m.body_mass[c] *= factor
        m.body_inertia[c] *= factor * (1.0 + 0.05 * rng.standard_normal())
        m.body_ipos[c] += rng.standard_normal(3) * [0.006, 0.001, 0.012]
        for pair in (WHEELS[:2], WHEELS[2:]):
            self._stiffen(pair, 1.0 + 0.04 * rng.standard_normal())

    def _stiffen(self, wheels: tuple[str, ...], factor: float) -> None:
        for w in wheels:
            self.m.geom_user[self.tire[w], COEFFICIENTS + 3] *= factor  # a3 of PAC89

    def load(self, mass: float, height: float) -> None:
        """Strap a mass (kg) to the chair, above its rear axle, at a height (m)."""
        self._add_mass(mass, np.array([0.0, 0.0, height]))
        mujoco.mj_setConst(self.m, mujoco.MjData(self.m))

    def change(self, name: str, by: float) -> None:
        """Change one of the ROUGHLY known numbers."""
        m, c = self.m, self.chair
        if name == "mass":
            m.body_mass[c] *= 1.0 + by
        if name in ("mass", "inertia"):
            m.body_inertia[c] *= 1.0 + by
        elif name.startswith("ipos"):
            m.body_ipos[c, int(name[-1])] += by
        elif name == "wheel_inertia":
            for wheel in WHEELS[:2]:
                m.body_inertia[m.body(wheel).id] *= 1.0 + by
        elif name == "radius":
            self._edit_wheel_radius(by, by)
        else:
            self._stiffen(WHEELS[:2] if name == "rear" else WHEELS[2:], 1.0 + by)
        mujoco.mj_setConst(m, mujoco.MjData(m))

    # -- edits of MuJoCo's own model -----------------------------------------------------------

    def _edit_floor_slope(self, x: float, y: float) -> None:
        g = np.array([-x, -y, -1.0])
        self.m.opt.gravity[:] = 9.81 * g / np.linalg.norm(g)

    def _turn(self, wheel: str, axis: int, angle: float) -> None:
        b = self.m.body(wheel).id
        r = np.zeros(4)
        by = np.zeros(4)
        by[0], by[1 + axis] = np.cos(angle / 2), np.sin(angle / 2)
        mujoco.mju_mulQuat(r, by, self.m.body_quat[b])
        self.m.body_quat[b] = r

    def _edit_toe(self, symmetric: float = 0.0, asymmetric: float = 0.0) -> None:
        self._turn("left_wheel", 2, asymmetric - symmetric)
        self._turn("right_wheel", 2, asymmetric + symmetric)

    def _edit_camber(self, angle: float) -> None:
        self._turn("left_wheel", 0, angle)
        self._turn("right_wheel", 0, -angle)

    def _edit_mass_offset(self, x: float = 0.0, y: float = 0.0) -> None:
        self.m.body_ipos[self.chair, :2] += x, y

    def _edit_payload(self, mass: float, height: float) -> None:
        ahead, left = self.m.body_ipos[self.chair, :2]
        self._add_mass(mass, np.array([ahead, left, height]))

    def _add_mass(self, mass: float, at: np.ndarray) -> None:
        m, c = self.m, self.chair
        rotation = np.zeros(9)
        mujoco.mju_quat2Mat(rotation, m.body_iquat[c])
        r = rotation.reshape(3, 3)
        old = r @ np.diag(m.body_inertia[c]) @ r.T
        apart = at - m.body_ipos[c]
        shared = m.body_mass[c] * mass / (m.body_mass[c] + mass)
        new = old + shared * (apart @ apart * np.eye(3) - np.outer(apart, apart))
        w, v = np.linalg.eigh(new)
        v[:, 0] *= np.sign(np.linalg.det(v))
        mujoco.mju_mat2Quat(m.body_iquat[c], v.ravel())
        m.body_inertia[c] = w
        m.body_ipos[c] += apart * mass / (m.body_mass[c] + mass)
        m.body_mass[c] += mass

    def _edit_wheel_radius(self, left: float = 0.0, right: float = 0.0) -> None:
        for w, change in (("left_wheel", left), ("right_wheel", right)):
            self.m.geom_size[self.tire[w], :2] += change
            self.m.geom_rbound[self.tire[w]] += change

    def _edit_cornering_stiffness(self, front: float = 0.0, rear: float = 0.0) -> None:
        self._stiffen(WHEELS[:2], 1.0 + rear)
        self._stiffen(WHEELS[2:], 1.0 + front)

    def _edit_load_sensitivity(self, exponent: float) -> None:
        for w in WHEELS:
            self.m.geom_user[self.tire[w], 12] += exponent

    def _edit_tire_friction(self, factor: float) -> None:
        for w in WHEELS:
            self.m.geom_user[self.tire[w], COEFFICIENTS + 2] *= factor  # a2 of PAC89

    def _edit_relaxation_length(self, length: float) -> None:
        for w in WHEELS:
            self.m.geom_user[self.tire[w], 4] += length

    def _edit_caster_friction(self, moment: float) -> None:
        for j in SWIVELS:
            self.m.dof_frictionloss[self.dof[j]] += moment

    def _edit_caster_trail(self, length: float) -> None:
        for w in WHEELS[2:]:
            self.m.body_pos[self.m.body(w).id, 0] -= length

    # -- forces of this file -------------------------------------------------------------------

    def push(self, d: mujoco.MjData, driven: bool) -> None:
        """Apply the hidden forces for the next step."""
        d.qfrc_applied[:] = 0.0
        d.xfrc_applied[self.chair] = 0.0
        c = self.chair
        r = d.xmat[c].reshape(3, 3)
        v = d.qvel[0:3]
        speed = float(r[:, 0] @ v)
        yaw = float(d.qvel[5])
        total = np.zeros(6)
        for name in self.forces:
            p = self.hidden[name]
            getattr(self, f"_force_{name}")(d, p, r, v, speed, yaw, driven, total)
        d.xfrc_applied[c] = total

    def _force_rolling_resistance(self, d, p, r, v, speed, yaw, driven, total):
        # on every wheel by itself, so that a chair that turns on the spot feels it too
        weight = 9.81 * float(self.m.body_subtreemass[self.chair])
        centre = d.subtree_com[self.chair]
        hubs = [d.xpos[self.m.body(w).id] - centre for w in WHEELS]
        ahead = [float(r[:, 0] @ (hubs[k] + hubs[k + 1])) / 2.0 for k in (0, 2)]
        casters = ahead[0] / (ahead[0] - ahead[1])  # share of the load, as of a chair that rests
        shares = (1.0 - casters, 1.0 - casters, casters, casters)
        for w, hub, share in zip(WHEELS, hubs, shares, strict=True):
            rolls = np.cross(d.geom_xmat[self.tire[w]].reshape(3, 3)[:, 2], (0.0, 0.0, 1.0))
            rolls /= np.linalg.norm(rolls)
            velocity = v + np.cross((0.0, 0.0, yaw), hub + centre - d.xpos[self.chair])
            load = 0.5 * share * weight
            force = -p["coefficient"] * load * np.tanh(float(velocity @ rolls) / 0.01) * rolls
            total[:3] += force
            total[5] += hub[0] * force[1] - hub[1] * force[0]

    def _force_bearing_friction(self, d, p, r, v, speed, yaw, driven, total):
        for w in WHEELS[:2]:
            spin = d.qvel[self.dof[w]]
            drag = p.get("coulomb", 0.0) * np.tanh(spin / 0.03) + p.get("viscous", 0.0) * spin
            d.qfrc_applied[self.dof[w]] -= drag

    def _force_air_drag(self, d, p, r, v, speed, yaw, driven, total):
        total[:2] -= 0.6 * p["drag_area"] * np.hypot(v[0], v[1]) * v[:2]

    def _force_wind(self, d, p, r, v, speed, yaw, driven, total):
        rel = v[:2] - [p["x"], p["y"]]
        total[:2] -= 0.6 * 0.6 * np.hypot(*rel) * rel

    def _force_turning_scrub(self, d, p, r, v, speed, yaw, driven, total):
        total[5] -= p["moment"] * np.tanh(yaw / 0.05)

    def _force_back_emf(self, d, p, r, v, speed, yaw, driven, total):
        if driven:
            for w in WHEELS[:2]:
                d.qfrc_applied[self.dof[w]] -= p["coefficient"] * d.qvel[self.dof[w]]

    def _force_rider_motion(self, d, p, r, v, speed, yaw, driven, total):
        w = 2 * np.pi * p["frequency"]
        place = p["amplitude"] * np.sin(w * d.time + p["phase"])
        force = p["mass"] * w**2 * place
        total[:3] += force * r[:, 0]
        arm = 0.9 - d.xipos[self.chair, 2]
        total[3:] += r[:, 1] * (force * arm + p["mass"] * 9.81 * place)

    def _force_surface_patch(self, d, p, r, v, speed, yaw, driven, total):
        for w in WHEELS:
            at = d.geom_xpos[self.tire[w]]
            if np.hypot(at[0] - p["x"], at[1] - p["y"]) > p["radius"]:
                continue
            load = 300.0 if "caster" not in w else 140.0
            spin = np.tanh(d.qvel[self.dof[w]] / 0.03)
            d.qfrc_applied[self.dof[w]] -= (
                p["coefficient"] * load * self.m.geom_size[self.tire[w], 0] * spin
            )

    # outside the library
    def _force_bent_rim(self, d, p, r, v, speed, yaw, driven, total):
        angle = d.qpos[int(self.m.joint("left_wheel").qposadr[0])]
        total[:3] += p["force"] * np.sin(angle) * r[:, 0]
        total[5] -= 0.28 * p["force"] * np.sin(angle)

    def _force_strap(self, d, p, r, v, speed, yaw, driven, total):
        catch = 0.5 * (1.0 + np.tanh((abs(speed) - 1.15) / 0.02))
        total[:3] -= p["force"] * catch * np.sign(speed) * r[:, 0]
        total[5] += 0.25 * p["force"] * catch * np.sign(speed)

    def _force_gust(self, d, p, r, v, speed, yaw, driven, total):
        bell = np.exp(-0.5 * ((d.time - p["when"]) / 0.35) ** 2)
        total[:2] += p["force"] * bell * np.array([np.cos(p["way"]), np.sin(p["way"])])

    def _force_fork_spring(self, d, p, r, v, speed, yaw, driven, total):
        for j in SWIVELS:
            q = d.qpos[int(self.m.joint(j).qposadr[0])]
            d.qfrc_applied[self.dof[j]] -= p["stiffness"] * q


SWIVELS = ("left_caster_swivel", "right_caster_swivel")
COEFFICIENTS = 23  # where the coefficients a0, a1, ... of PAC89 begin in geom_user


def run(world: World, man: Manoeuvre, seconds: float) -> tuple[dict, np.ndarray]:
    """One run: exact channels at RATE, and the torques for the table."""
    m = world.m
    every = round(1.0 / (RATE * STEP))
    sensors = {n: int(m.sensor(n.partition(".")[0]).adr[0]) for n in NOISE}
    place = [sensors[n] + "xyz".index(n[-1]) if "." in n else sensors[n] for n in NOISE]
    rows = []
    with mjchair.installed():
        d = start(m, Initial(man.position, man.heading, man.speed, man.yaw))
        gain = world.hidden.get("torque_gain", {})
        lag = world.hidden.get("drive_lag", {}).get("time_constant", 0.0)
        passed = np.zeros(2)
        told = []
        for k in range(round(seconds / STEP)):
            asked = np.array(man.torque(d.time)) if man.torque else np.zeros(2)
            passed = asked if lag == 0.0 else passed + (asked - passed) * -np.expm1(-STEP / lag)
            d.ctrl[:2] = passed * [1.0 + gain.get("left", 0.0), 1.0 + gain.get("right", 0.0)]
            if world.forces:
                world.push(d, man.torque is not None)
            now = d.time
            mujoco.mj_step(m, d)
            if k % every == 0:
                told.append([now, *asked])
                rows.append(d.sensordata[place])
    return dict(zip(NOISE, np.array(rows).T, strict=True)), np.array(told)


def sense(rng: np.random.Generator, case: Case, exact: dict, told: np.ndarray) -> dict:
    """Add sensor faults, noise, rounding and missing samples."""
    table = {"time": told[:, 0]}
    for name, (std, step) in NOISE.items():
        values = exact[name].copy()
        if name == case.channel:
            fault = case.hidden
            if "sensor_delay" in fault:
                late = told[:, 0] - fault["sensor_delay"]["delay"]
                values = np.interp(late, told[:, 0], values)
            values *= 1.0 + fault.get("sensor_scale", {}).get("scale", 0.0)
            values += fault.get("sensor_bias", {}).get("bias", 0.0)
        if "gyro" in name:
            values += 0.001
        values += std * rng.standard_normal(values.size)
        if step:
            values = step * np.round(values / step)
        values[rng.random(values.size) < 0.02] = np.nan
        table[name] = values
    return table


def make(
    folder: Path,
    case: Case,
    seed: int,
    trials: int = 6,
    seconds: float = 6.0,
    channels: tuple[str, ...] | None = None,
    held: int | None = None,
) -> None:
    """Write a study and its sealed answer; trial `held` is held out."""
    folder.mkdir(parents=True, exist_ok=True)
    which = _chosen(trials)
    chosen = [MANOEUVRES[k] for k in which]
    if case.kind in ("one", "two", "outside") and case.sigma:
        _size(case, seed, tuple(t for k, t in enumerate(which) if k != held), seconds)
    rng = np.random.default_rng([seed, 1])
    world = World(np.random.default_rng([seed, 2]), case.hidden)
    lines = ['model = "manual"', 'scene = "flat"', "", "[noise]"]
    kept = tuple(n for n in NOISE if channels is None or n in channels)
    lines += [f'"{n}" = {NOISE[n][0]}' for n in kept]
    for k, man in enumerate(chosen):
        file = f"{man.name}_{k}.csv"
        _write(folder / file, _table(world, man, seconds, rng, case, kept))
        lines += ["", "[[trial]]", f'file = "{file}"', f'manoeuvre = "{man.name}"']
        lines += ["hold_out = true"] if k == held else []
    (folder / "study.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    seal(folder / SEAL, case)


def add_trial(
    folder: Path,
    case: Case,
    seed: int,
    man: Manoeuvre,
    seconds: float,
    nth: int,
    load: tuple[float, float] | None = None,
) -> None:
    """Make one run more with the chair of a study from `make`, and write it into the study.

    Args:
      case, seed: as in `make`, which has sized the case. nth: further run of the study, from 1.
      load: mass (kg) and height (m) of what is strapped down above the rear axle.
    """
    world = World(np.random.default_rng([seed, 2]), case.hidden)
    lines = ["", "[[trial]]", f'file = "further_{nth}.csv"', f'manoeuvre = "{man.name}"']
    if load is not None:
        world.load(*load)
        lines += ["", "[trial.load]", f"mass = {load[0]}", f"height = {load[1]}"]
    rng = np.random.default_rng([seed, 3, nth])
    _write(folder / f"further_{nth}.csv", _table(world, man, seconds, rng, case, tuple(NOISE)))
    with (folder / "study.toml").open("a", encoding="utf-8") as file:
        file.write("\n".join(lines) + "\n")


def _table(
    world: World,
    man: Manoeuvre,
    seconds: float,
    rng: np.random.Generator,
    case: Case,
    kept: tuple[str, ...],
) -> dict[str, np.ndarray]:
    """What the sensors in `kept` record of one run, with the torques that were asked for."""
    exact, told = run(world, man, seconds)
    table = sense(rng, case, exact, told)
    table = {n: v for n, v in table.items() if n == "time" or n in kept}
    if man.torque:
        table["left_wheel"], table["right_wheel"] = told[:, 1], told[:, 2]
    return table


def _chosen(trials: int) -> tuple[int, ...]:
    return {3: (0, 3, 4), 4: (0, 1, 3, 4)}.get(trials, tuple(k % 6 for k in range(trials)))


def _write(path: Path, table: dict[str, np.ndarray]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(table)
        for row in zip(*table.values(), strict=True):
            writer.writerow(["" if np.isnan(x) else repr(float(round(x, 7))) for x in row])


def seal(path: Path, case: Case) -> None:
    """Store the answer in a form that cannot be read by accident."""
    text = json.dumps(
        {
            "kind": case.kind,
            "hidden": case.hidden,
            "sigma": case.sigma,
            "channel": case.channel,
            "reached": case.reached,
        }
    )
    path.write_bytes(base64.b64encode(zlib.compress(text.encode())))


def unseal(path: Path) -> dict:
    """The answer."""
    return json.loads(zlib.decompress(base64.b64decode(path.read_bytes())))


# -- sizes ---------------------------------------------------------------------------------------

LINEAR = {  # channel -> order of the polynomial that a free initial state takes from a window
    "position": 1,
    "heading": 1,
    "angle": 1,
    "speed": 0,
    "gyro": 0,
    "accelerometer": -1,
}


def apart(with_it: list[dict], without: list[dict], afresh: bool = True) -> np.ndarray:
    """Differences between two sets of exact runs, over the noise, (n,).

    Args:
      afresh: every interval of 2 s may start from another position and speed.
    """
    out = []
    for a, b in zip(with_it, without, strict=True):
        n = len(next(iter(a.values())))
        for first in range(0, n, 2 * RATE):
            rows = slice(first, min(first + 2 * RATE, n))
            for name, (std, _) in NOISE.items():
                order = next((o for end, o in LINEAR.items() if end in name), 0)
                x = (a[name] - b[name])[rows]
                if "heading" in name:
                    x = np.angle(np.exp(1j * x))
                t = np.arange(x.size)
                if afresh and order >= 0 and "caster" not in name:
                    x = x - np.polyval(np.polyfit(t, x, order), t)
                out.append(x / std)
    return np.concatenate(out)


ROUGHLY = {  # what a study knows only roughly: standard deviations, as the documentation has them
    "mass": 0.05,
    "inertia": 0.1,
    "ipos.0": 0.01,
    "ipos.1": 0.002,
    "ipos.2": 0.03,
    "rear": 0.07,
    "casters": 0.07,
    "wheel_inertia": 0.05,
    "radius": 0.0015,
    **{
        f"gain.{name}": 0.01
        for name in NOISE
        if name.endswith("wheel_speed") or name.startswith("imu_")
    },
    "bias.imu_gyro.z": 0.003,
    "bias.imu_accelerometer.x": 0.05,
    "bias.imu_accelerometer.y": 0.05,
}


@lru_cache
def roughly(trial: int, seconds: float, afresh: bool = True) -> np.ndarray:
    """Change of a run by one standard deviation of each roughly known number, (n, numbers)."""
    man = MANOEUVRES[trial]
    plain = run(World(None, {}), man, seconds)[0]
    columns = []
    for name, std in ROUGHLY.items():
        kind, _, channel = name.partition(".")
        if kind == "bias":
            moved = dict(plain, **{channel: plain[channel] + std})
        elif kind == "gain":
            moved = dict(plain, **{channel: plain[channel] * (1.0 + std)})
        else:
            world = World(None, {})
            world.change(name, std)
            moved = run(world, man, seconds)[0]
        columns.append(apart([moved], [plain], afresh))
    return np.column_stack(columns)


def detectability(difference: np.ndarray, known: np.ndarray) -> float:
    """Size in sigmas of a difference (n,), after the roughly known numbers have been fitted."""
    inner = known.T @ known + np.eye(known.shape[1])
    off = known.T @ difference
    return float(np.sqrt(max(difference @ difference - off @ np.linalg.solve(inner, off), 0.0)))


def _size(case: Case, seed: int, trials: tuple[int, ...], seconds: float) -> None:
    """Scale the hidden effects until each has about case.sigma; `reached` is the value obtained.

    Responses are not linear (casters begin to shimmy), so the scaling is iterated.
    """
    chosen = [MANOEUVRES[k] for k in trials]
    plain = World(np.random.default_rng([seed, 2]), {})
    without = [run(plain, man, seconds)[0] for man in chosen]
    for name in case.hidden:
        # a new initial position or speed of one channel alone is not a possible motion
        moves = not name.startswith("sensor")
        known = np.vstack([roughly(k, seconds, moves) for k in trials])

        def reached(name: str = name, moves: bool = moves, known: np.ndarray = known) -> float:
            if name.startswith("sensor"):
                only = Case("one", {name: case.hidden[name]}, 0.0, case.channel)
                exact = [_fault(only, e) for e in without]
            else:
                world = World(np.random.default_rng([seed, 2]), {name: case.hidden[name]})
                exact = [run(world, man, seconds)[0] for man in chosen]
            return detectability(apart(exact, without, moves), known)

        fit_size(case, name, reached)


def fit_size(
    case: Case,
    name: str,
    reached: Callable[[], float],
    tries: int = 6,
    factors: tuple[float, float] = (0.02, 6.0),
) -> None:
    """Scale one hidden effect until it reaches about case.sigma, or the largest size there is.

    Args:
      reached: sigmas of the effect as it stands in the case. tries: sizes at most.
      factors: the least and the most that one step may change the size by.
    """
    first, size = dict(case.hidden[name]), 1.0
    low, high = 0.0, np.inf
    for _ in range(tries):
        case.hidden[name] = scaled(first, name, size)
        case.reached[name] = reached()
        factor = case.sigma / max(case.reached[name], 1e-6)
        if 0.8 < factor < 1.25 or scaled(first, name, 1.2 * size) == case.hidden[name]:
            break
        low, high = (max(low, size), high) if factor > 1.0 else (low, min(high, size))
        size *= float(np.clip(factor, *factors))
        if not low < size < high:
            size = float(np.sqrt(max(low, 0.01 * high) * high))


def _fault(case: Case, exact: dict) -> dict:
    out = dict(exact)
    time = np.arange(len(exact[case.channel])) / RATE
    values = exact[case.channel]
    p = next(iter(case.hidden.values()))
    values = np.interp(time - p.get("delay", 0.0), time, values)
    out[case.channel] = values * (1.0 + p.get("scale", 0.0)) + p.get("bias", 0.0)
    return out


MOST = {  # largest sizes; beyond them the chair is no longer plausible
    "toe": 0.08,
    "camber": 0.25,
    "wheel_radius": 0.02,
    "mass_offset": 0.08,
    "payload": 40.0,
    "cornering_stiffness": 0.7,
    "load_sensitivity": 0.6,
    "relaxation_length": 0.09,  # casters shimmy beyond
    "caster_trail": 0.05,
    "torque_gain": 0.5,
    "drive_lag": 0.4,
    "sensor_scale": 0.5,
    "sensor_delay": 0.2,
    "rolling_resistance": 0.05,
    "floor_slope": 0.06,
    "wind": 8.0,
    "air_drag": 4.0,
    "rider_motion": 0.15,
    "turning_scrub": 15.0,
    "caster_friction": 4.0,
    "surface_patch": 0.2,
    "back_emf": 2.0,
}


def scaled(p: dict[str, float], name: str, factor: float) -> dict[str, float]:
    """An effect of another size, at the same place and time."""
    fixed = {
        "surface_patch": ("x", "y", "radius"),
        "rider_motion": ("mass", "frequency", "phase"),
        "payload": ("height",),
        "gust": ("when", "way"),
    }.get(name, ())
    most = MOST.get(name, np.inf)
    by = np.sqrt(factor) if name == "wind" else factor
    if name == "tire_friction":
        return {"factor": float(np.clip(1.0 - (1.0 - p["factor"]) * factor, 0.08, 1.0))}
    return {k: v if k in fixed else float(np.clip(v * by, -most, most)) for k, v in p.items()}
