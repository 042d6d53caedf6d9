"""A chair on a tilting platform, with wheels locked or free, and with stops against sliding.

In: a chair, a direction, and how its wheels are held. Out: the angle at which the uphill wheels
carry no load, and the run. To tilt gravity slowly has the same effect as to tilt the platform
slowly. So gravity is tilted here, and the platform stays the plane z = 0.

With stops, a locked wheel sticks to the platform (Coulomb friction of 100), and a free wheel stands
against a wall whose force goes through its axle. The low stop of a laboratory acts in this way on a
wheel that can turn. Both are MuJoCo's own contacts, and tire forces are not used. Without stops,
the tire forces of mjchair.engine hold the chair, and it may slide.
"""

from __future__ import annotations

import math
from contextlib import AbstractContextManager
from dataclasses import dataclass, field

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.engine.install import installed, uninstalled
from mjchair.errors import MjchairError
from mjchair.model.spec import compile_spec
from mjchair.simulation.initial import lock_wheels
from mjchair.testlab.closed_form import DOWNHILL, UP, downhill, tip_angle
from mjchair.testlab.design import REAR, Design, floor_of, lowest, parts, reach
from mjchair.testlab.track import Run, Trace

Array = NDArray[np.float64]

RATE = math.radians(2.0)  # rad/s, of the platform
FITTED = math.radians(1.5)  # rad: the last part of the tilt, to which the load curve is fitted
FEWEST = 15  # samples in this fit
HURRY, NEAR = 8.0, 0.06  # rate factor until only this share of the weight is left uphill
WHEELS = 4  # that the platform knows
MOST = math.radians(60.0)  # largest tilt
TICK = 0.01  # s, between two readings of the loads
HELD = 1e6  # N m s/rad, damping of every hinge while the chair settles
# kg m^2 on every hinge that must not turn. The contact solver knows inertia but not damping, so a
# locked wheel sticks at once; 30 N m turn it by less than a milliradian during a tilt
LOCKED = 1e7
STICKS = 100.0  # friction at a stop
SLID = 0.03  # m, from which a chair without stops counts as sliding
FALLS = math.radians(0.3)  # rad beyond the tip angle, so that the chair falls onto its anti-tippers
REST_TIME = 4.0  # s, within which a chair must come to rest
REST = 1e-3  # m/s or rad/s
# A nearly rigid tire on the platform: the impedance d multiplies the stiffness by 1 / (1 - d).
RIGID = (0.999, 0.999, 0.001, 0.5, 1.0)
RIGID_SOLREF = (-4000.0, -130.0)


@dataclass(frozen=True)
class Setup:
    """How the chair stands on the platform.

    Attributes:
      direction: of the fall: forward, rearward, left or right.
      locked: whether the wheels are locked to the frame.
      anti_tippers: whether the chair has its anti-tippers in place.
      casters: angle (rad) of both swivels; at 0 the casters trail.
      stops: whether stops keep the chair from sliding.
      rigid: whether the tires are nearly rigid; else they have their own stiffness.
    """

    direction: str
    locked: bool = True
    anti_tippers: bool = False
    casters: float = 0.0
    stops: bool = True
    rigid: bool = True


@dataclass
class Tilted:
    """The result of a tilt.

    Attributes:
      angle: at which the uphill wheels carry no load, rad; None: they do up to MOST.
      held: at which the chair tips over its anti-tippers, rad; None: it has none in place.
      exact: tip angle of the closed form, rad. tilt, load: series of the tilt (rad) and of the
        share of the weight on the uphill wheels (1).
      run: the simulated run.
    """

    angle: float | None
    exact: float
    held: float | None = None
    tilt: list[float] = field(default_factory=list)
    load: list[float] = field(default_factory=list)
    run: Run | None = None


class Platform:
    """One chair on the platform, ready to tilt."""

    def __init__(self, design: Design, setup: Setup, timestep: float | None = None) -> None:
        """Stand the chair on the level platform, at rest.

        Raises:
          MjchairError: the chair does not come to rest there, or has no anti-tippers although the
            set-up needs them.
        """
        self.design, self.setup = design, setup
        if setup.direction not in DOWNHILL:
            raise MjchairError(f"direction {setup.direction!r}; it is one of {', '.join(DOWNHILL)}")
        spec = design.spec()
        if timestep is not None:
            spec.option.timestep = timestep
        first = compile_spec(spec)
        wheels = len(parts(first).geoms)
        if wheels != WHEELS:
            raise MjchairError(
                f"the tilting platform takes a chair with two rear wheels and two casters; "
                f"{design.model} has {wheels} wheels"
            )
        self._edit(first)
        data = self._settled(first)
        if setup.stops and not self._sticking():
            self._add_walls(spec, first, data)
        self.model = compile_spec(spec)
        self._edit(self.model)
        self.parts = parts(self.model)
        if setup.anti_tippers and not self.parts.anti_tippers:
            raise MjchairError("the chair has no anti-tippers")
        self.data = self._settled(self.model)
        first_dof = int(self.model.jnt_dofadr[self.model.body_jntadr[self.parts.chair]])
        self._frame = slice(first_dof, first_dof + 6)
        self.weight = float(self.model.body_subtreemass[0] * np.linalg.norm(self.model.opt.gravity))
        self._hold_for_tilt()
        chair = self.data.xmat[self.parts.chair].reshape(3, 3)
        points = [lowest(self.model, self.data, self.parts.geoms[w], UP) for w in self.downhill]
        self.way = downhill(setup.direction, points, chair)
        self.exact = tip_angle(
            self.model, self.data, self.parts, setup.direction, self.setup.locked
        )

    @property
    def downhill(self) -> tuple[str, ...]:
        """The wheels about which the chair tips."""
        return DOWNHILL[self.setup.direction][0]

    @property
    def uphill(self) -> tuple[str, ...]:
        """The other wheels."""
        return tuple(w for w in self.parts.geoms if w not in self.downhill)

    def _sticking(self) -> bool:
        return self.setup.locked or self.setup.direction in ("left", "right")

    def _edit(self, model: mujoco.MjModel) -> None:
        """Set the contacts of a platform with stops."""
        named = parts(model)
        if self.setup.rigid:
            for geom in named.geoms.values():
                model.geom_solref[geom] = RIGID_SOLREF
                model.geom_solimp[geom] = RIGID
        if self.setup.stops and self._sticking():
            for wheel in self.downhill:
                model.geom_condim[named.geoms[wheel]] = 3
                model.geom_friction[named.geoms[wheel], 0] = STICKS
        for geom in named.anti_tippers:
            if self.setup.anti_tippers:
                model.geom_condim[geom] = 3
                model.geom_friction[geom, 0] = STICKS
                model.geom_priority[geom] = 1
            else:
                model.geom_contype[geom] = model.geom_conaffinity[geom] = 0

    def _settled(self, model: mujoco.MjModel) -> mujoco.MjData:
        """The chair at rest on the level platform.

        Raises:
          MjchairError: it does not come to rest.
        """
        data = mujoco.MjData(model)
        for joint in parts(model).swivels.values():
            data.qpos[model.jnt_qposadr[joint]] += self.setup.casters
        held = model.dof_damping.copy()
        hinges = model.jnt_type == mujoco.mjtJoint.mjJNT_HINGE
        model.dof_damping[model.jnt_dofadr[hinges]] = HELD
        frame = int(model.jnt_dofadr[model.body_jntadr[parts(model).chair]])
        model.dof_damping[[frame, frame + 1, frame + 5]] = HELD  # wheels have no friction
        for _ in range(round(REST_TIME / (50 * model.opt.timestep))):
            with uninstalled():
                mujoco.mj_step(model, data, nstep=50)
            if np.abs(data.qvel).max() < 0.01 * REST:
                break
        model.dof_damping[:] = held
        up = data.xmat[parts(model).chair].reshape(3, 3)[2, 2]
        speed = float(np.abs(data.qvel).max())
        lean = math.degrees(math.acos(max(-1.0, min(1.0, float(up)))))
        if not (speed < REST and up > 0.5):
            raise MjchairError(
                f"the chair does not come to rest on the level platform: after {REST_TIME:g} s it "
                f"still moves at {speed:.2g} m/s or rad/s, {lean:.0f} deg "
                " from upright; check that its wheels carry it"
            )
        data.qvel[:] = 0.0
        data.time = 0.0
        mujoco.mj_forward(model, data)
        return data

    def _add_walls(self, spec: mujoco.MjSpec, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """Add a wall behind every free downhill wheel; it touches that wheel only."""
        named = parts(model)
        points = [data.geom_xpos[named.geoms[w]].copy() for w in self.downhill]
        chair = data.xmat[named.chair].reshape(3, 3)
        way = downhill(self.setup.direction, points, chair)
        turned = np.zeros(4)
        mujoco.mju_quatZ2Vec(turned, -way)
        for i, wheel in enumerate(self.downhill):
            geom = named.geoms[wheel]
            tire = spec.geom(model.geom(geom).name)
            bit = 1 << (20 + i)
            at = data.geom_xpos[geom] + way * (reach(model, data, geom, way) + 1e-5)
            tire.conaffinity |= bit
            spec.worldbody.add_geom(
                name=f"stop_{i}",
                type=mujoco.mjtGeom.mjGEOM_PLANE,
                size=(0.2, 0.2, 0.1),
                pos=at,
                quat=turned,
                contype=bit,
                conaffinity=0,
                group=5,
            )

    def _hold_for_tilt(self) -> None:
        """Hold the swivels and the locked wheels; the other wheels are free."""
        model, setup = self.model, self.setup
        held_joints = list(self.parts.swivels.values())
        if not setup.stops:
            if setup.locked:
                lock_wheels(model, self.data.qpos)
                self.data.eq_active[:] = model.eq_active0
            return
        if self._sticking():
            held_joints += [self.parts.joints[wheel] for wheel in self.downhill]
        if setup.locked or setup.anti_tippers:  # brakes are on while it stands on its rollers
            held_joints += [self.parts.joints[wheel] for wheel in REAR if setup.locked]
        model.dof_armature[model.jnt_dofadr[held_joints]] = LOCKED

    def _callbacks(self) -> AbstractContextManager[object]:
        return uninstalled() if self.setup.stops else installed()

    def load(self, names: tuple[str, ...]) -> float:
        """Share of the weight that these wheels carry."""
        geoms = {self.parts.geoms[name] for name in names}
        floor, data, total = floor_of(self.model), self.data, 0.0
        for c in range(data.ncon):
            pair, address = data.contact.geom[c], data.contact.efc_address[c]
            if floor in pair and address >= 0 and not geoms.isdisjoint(pair.tolist()):
                total += data.efc_force[address]
        return total / self.weight

    def set_tilt(self, angle: float) -> None:
        """Tilt the platform by an angle (rad)."""
        size = float(np.linalg.norm(self.model.opt.gravity))
        self.model.opt.gravity[:] = size * (math.sin(angle) * self.way - math.cos(angle) * UP)

    def tilt(self, rate: float = RATE, keep: bool = False) -> Tilted:
        """Tilt from level until the uphill wheels carry no load.

        With anti-tippers in place, the platform then stops until the chair rests on them, and
        tilts on until only the anti-tippers carry load.

        Args:
          rate: rad/s. keep: record the run.

        Raises:
          MjchairError: without stops the chair slides before it tips.
        """
        trace = Trace(self.model) if keep else None
        tilted = Tilted(None, self.exact)
        with self._callbacks():
            tilted.angle = self._until_light(tilted, 0.0, self.uphill, rate, trace)
            rearward = self.setup.direction == "rearward"
            if tilted.angle is not None and self.setup.anti_tippers and rearward:
                tilted.held = self._over_anti_tippers(tilted, rate, trace)
        if trace is not None:
            tilted.run = trace.run(self.design.spec(visual_geoms=True))
        return tilted

    def _until_light(
        self, tilted: Tilted, angle: float, names: tuple[str, ...], rate: float, trace: Trace | None
    ) -> float | None:
        """Tilt on from `angle` until these wheels carry no load; the angle (rad), or None."""
        steps = max(1, round(TICK / self.model.opt.timestep))
        slow = rate * steps * self.model.opt.timestep
        turn = HURRY * slow
        begin = self.data.qpos[:3].copy()
        first = len(tilted.tilt)
        while angle < MOST:
            angle += turn
            self.set_tilt(angle)
            mujoco.mj_step(self.model, self.data, nstep=steps)
            load = self.load(names)
            tilted.tilt.append(angle)
            tilted.load.append(load)
            if trace is not None:
                trace.add(self.data)
            if load < NEAR:
                turn = slow
            if load <= 1e-9:
                return _vanishing(tilted.tilt[first:], tilted.load[first:])
            if not self.setup.stops and np.linalg.norm(self.data.qpos[:3] - begin) > SLID:
                raise MjchairError(
                    f"the chair slides at {math.degrees(angle):.1f} deg before it tips; keep it "
                    "from sliding with stops, or give its tires more grip"
                )
        return None

    def _over_anti_tippers(self, tilted: Tilted, rate: float, trace: Trace | None) -> float | None:
        """Wait until the chair rests on its anti-tippers, then tilt on until it tips over them."""
        assert tilted.angle is not None
        steps = max(1, round(TICK / self.model.opt.timestep))
        self.set_tilt(tilted.angle + FALLS)
        for _ in range(round(2.0 * REST_TIME / TICK)):
            mujoco.mj_step(self.model, self.data, nstep=steps)
            if trace is not None:
                trace.add(self.data)
            if self._rests() and np.abs(self.data.qvel[self._frame]).max() < REST:
                for i in range(self.model.ngeom):  # the stop now acts on the roller
                    if self.model.geom(i).name.startswith("stop_"):
                        self.model.geom_contype[i] = 0
                everything = tuple(self.parts.geoms)
                return self._until_light(tilted, tilted.angle + FALLS, everything, rate, trace)
        return tilted.angle  # the anti-tippers do not hold the chair

    def _rests(self) -> bool:
        """Whether an anti-tipper touches the platform."""
        floor = floor_of(self.model)
        for c in range(self.data.ncon):
            pair = self.data.contact.geom[c].tolist()
            if floor in pair and any(geom in self.parts.anti_tippers for geom in pair):
                return True
        return False


def _vanishing(tilt: list[float], load: list[float]) -> float:
    """The tilt (rad) at which the load vanishes, by a fit of load = a cos(tilt) - b sin(tilt).

    A stiff contact ends at an indentation of less than a micrometre, so the simulated load ends at
    a slightly too small tilt. The fit uses the load before its end, which has no such error.

    Args:
      tilt: rad; at the last one no load was left. load: share of the weight.
    """
    end = tilt[-1]
    near = [(x, f) for x, f in zip(tilt, load, strict=True) if end - FITTED < x and 0.0 < f < NEAR]
    if len(near) < FEWEST:
        return end
    angles, loads = np.array(near[len(near) // 3 :]).T
    a, b = np.linalg.lstsq(np.column_stack([np.cos(angles), -np.sin(angles)]), loads)[0]
    root = math.atan2(a, b)
    return root if abs(root - end) < FITTED else end
