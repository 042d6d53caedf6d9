"""A driven chair: stepped with a driver in the loop, observed, and recorded.

In: a chair, a slope, obstacles on the floor, and a driver. Out: whether the condition for the end
was met, and a run from which a recording can be made. A driver is a function that is called every
10 ms with a `View` of the chair and returns a command: the torques (N m) on the left and the right
wheel, or the joystick's deflections forward and to the left on a chair that has its drive on.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.drive.attach import drives
from mjchair.engine.install import installed
from mjchair.errors import MjchairError
from mjchair.model.spec import compile_spec
from mjchair.simulation import names
from mjchair.simulation.channels import tire_place
from mjchair.simulation.from_states import FULL, recording_of
from mjchair.simulation.initial import Initial, start
from mjchair.simulation.recording import Recording
from mjchair.testlab.design import GRAVITY, Design, floor_of, parts

Array = NDArray[np.float64]
Command = tuple[float, float]  # torques, N m, or deflections of the joystick, -1 to 1

WHEELS = ("left_wheel", "right_wheel")  # torque inputs
TICK = 0.01  # s, between two calls of a driver
FAST = 1e3  # m/s or rad/s; a simulation with a larger speed has diverged


@dataclass(frozen=True)
class Run:
    """The states of a run, one for each tick, from which a recording can be made.

    Attributes:
      time: (n,), s. states: (n, size of the full physics state). controls: (n, nu).
      model: the simulated model. spec: the same model with its display geoms, or None.
      tires: whether the tire law was in place.
    """

    time: Array
    states: Array
    controls: Array
    model: mujoco.MjModel
    spec: mujoco.MjSpec | None = None
    tires: bool = True
    gravity: Array | None = None

    def recording(self) -> Recording:
        """A recording with every sensor of the chair."""
        return recording_of(
            self.model,
            self.time,
            self.states,
            self.controls,
            spec=self.spec,
            tires=self.tires,
            gravity=self.gravity,
        )


class Trace:
    """Collects states while other code steps the simulation."""

    def __init__(self, model: mujoco.MjModel, every: int = 1, tires: bool = False) -> None:
        """Collect one of `every` ticks."""
        self.model, self.every, self.tires = model, every, tires
        self._ticks = 0
        self._time: list[float] = []
        self._states: list[Array] = []
        self._controls: list[Array] = []
        self._gravity: list[Array] = []

    def add(self, data: mujoco.MjData) -> None:
        """Keep the state of the data."""
        if self._ticks % self.every == 0:
            state = np.empty(mujoco.mj_stateSize(self.model, FULL))
            mujoco.mj_getState(self.model, data, state, FULL)
            self._time.append(data.time)
            self._states.append(state)
            self._controls.append(data.ctrl.copy())
            self._gravity.append(self.model.opt.gravity.copy())
        self._ticks += 1

    def run(self, spec: mujoco.MjSpec | None = None) -> Run:
        """The collected states as a run."""
        return Run(
            np.array(self._time) - (self._time[0] if self._time else 0.0),
            np.array(self._states),
            np.array(self._controls),
            self.model,
            spec,
            self.tires,
            np.array(self._gravity),
        )


class View:
    """Motion of the chair as a driver sees it, SI, relative to the plane of the slope.

    Attributes:
      time: s. x, y: of the middle of the rear axle, m. heading: rad, continuous over full turns.
      axle: position of this point, (3,) m, world. speed: of this point along the heading, m/s.
      left, right: wheel speeds, rad/s.
      yaw_rate: rad/s. pitch: rad, positive with the front up. roll: rad, positive to the right.
      loads: wheel -> N. height: of the axle over the floor, m.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """Observe data that other code steps."""
        self.model, self.data = model, data
        self.parts = parts(model)
        self._site = names.find(
            "axle", names.names(model, mujoco.mjtObj.mjOBJ_SITE, model.nsite), "site"
        )
        self._load_places = {w: tire_place(model, w, "Fz") for w in self.parts.geoms}
        self._dofs = {w: int(model.jnt_dofadr[j]) for w, j in self.parts.joints.items()}
        self._chair = int(model.jnt_dofadr[model.body_jntadr[self.parts.chair]])
        self._heading = 0.0
        self._floor = floor_of(model)
        self.update()

    def update(self) -> None:
        """Read the data anew."""
        data = self.data
        at = self.axle = data.site_xpos[self._site]
        self.time, self.x, self.y, self.height = data.time, float(at[0]), float(at[1]), float(at[2])
        axes = data.xmat[self.parts.chair].reshape(3, 3)
        heading = math.atan2(axes[1, 0], axes[0, 0])
        turn = heading - self._heading
        self._heading += turn - 2.0 * math.pi * round(turn / (2.0 * math.pi))
        self.heading = self._heading
        self.pitch = math.asin(max(-1.0, min(1.0, float(axes[2, 0]))))
        self.roll = math.asin(max(-1.0, min(1.0, float(axes[2, 1]))))
        self.upright = float(axes[2, 2])
        velocity = data.qvel[self._chair : self._chair + 3]
        spin = axes @ data.qvel[self._chair + 3 : self._chair + 6]
        hub = velocity + np.cross(spin, at - data.xpos[self.parts.chair])
        self.speed = float(hub[0] * math.cos(heading) + hub[1] * math.sin(heading))
        self.sideways = float(hub[1] * math.cos(heading) - hub[0] * math.sin(heading))
        self.yaw_rate = float(spin[2])
        self.left = float(data.qvel[self._dofs["left_wheel"]])
        self.right = float(data.qvel[self._dofs["right_wheel"]])
        self.loads = {w: float(data.sensordata[i]) for w, i in self._load_places.items()}

    def touching(self, geoms: Sequence[int]) -> bool:
        """Whether one of these geoms has a contact force with the world."""
        data = self.data
        for c in range(data.ncon):
            if data.contact.dist[c] < 0.0:
                first, second = data.contact.geom[c]
                if first in geoms or second in geoms:
                    return True
        return False


Driver = Callable[[View], Command]


def coast(view: View) -> Command:
    """A driver that does nothing."""
    return 0.0, 0.0


class Track:
    """A chair on a plane slope with obstacles, controlled by a driver."""

    def __init__(
        self,
        design: Design,
        *,
        slope: float = 0.0,
        across: float = 0.0,
        speed: float = 0.0,
        yaw_rate: float = 0.0,
        brakes: bool = False,
        anti_tippers: bool = True,
        edit: Callable[[mujoco.MjSpec], None] | None = None,
        place: tuple[float, float, float] | None = None,
        casters: Mapping[str, float] | None = None,
        timestep: float | None = None,
        driven: bool = False,
    ) -> None:
        """Place the chair, settled on its tires; with a speed, its wheels roll without slip.

        Args:
          slope: of the ground along the chair's x at the start, rad, positive uphill.
          across: of the ground along its y, rad, positive uphill.
          speed: m/s. yaw_rate: rad/s. brakes: lock the parking brakes.
          anti_tippers: False takes them off.
          edit: changes the specification, such as a kerb on the floor.
          place: x, y (m) of the axle and heading (rad); None: as in the model.
          casters: caster -> angle by which its swivel is turned at the start, rad.
          timestep: s.
          driven: put the chair's drive on; a chair without one takes torques all the same. At rest
            its parking brakes are closed.
        """
        self.design, self._edit, self._driven = design, edit, driven
        self._off = () if anti_tippers else ("off",)
        spec = design.spec(driven=driven)
        if edit is not None:
            edit(spec)
        if timestep is not None:
            spec.option.timestep = timestep
        self.model = compile_spec(spec)
        down = np.array([-math.sin(slope), -math.sin(across), 0.0])
        if place is not None:
            c, s = math.cos(place[2]), math.sin(place[2])
            down = np.array([c * down[0] - s * down[1], s * down[0] + c * down[1], 0.0])
        down[2] = -math.sqrt(max(0.0, 1.0 - down[0] ** 2 - down[1] ** 2))
        self.model.opt.gravity[:] = GRAVITY * down
        listed = parts(self.model)
        if not anti_tippers:
            self.model.geom_contype[list(listed.anti_tippers)] = 0
            self.model.geom_conaffinity[list(listed.anti_tippers)] = 0
        position = None if place is None else place[:2]
        heading = None if place is None else place[2]
        initial = Initial(position, heading, speed, yaw_rate)
        known = names.actuators(self.model)
        self._inputs = [names.find(name, known, "actuator") for name in WHEELS]
        first = np.zeros(self.model.nu)
        drive = design.own_drive() if driven else None
        if drive is not None:
            self._inputs = list(drives(self.model)[0].joystick)
            first[self._inputs] = drive.joystick(speed, yaw_rate)
        with installed():
            self.data = start(self.model, initial, brakes, first)
            for caster, angle in (casters or {}).items():
                joint = listed.swivels[caster]
                self.data.qpos[self.model.jnt_qposadr[joint]] += angle
            mujoco.mj_forward(self.model, self.data)
        self.view = View(self.model, self.data)
        self._trace = Trace(self.model, tires=True)

    def drive(
        self,
        driver: Driver,
        duration: float,
        until: Callable[[View], bool] | None = None,
        watch: Callable[[View], None] | None = None,
        tick: float = TICK,
    ) -> bool:
        """Step with a driver in the loop; a second call continues the run.

        Args:
          duration: at most, s. until: condition that ends the run. watch: called at every tick.
            tick: s.

        Returns:
          Whether `until` ended the run.

        Raises:
          MjchairError: the simulation diverged.
        """
        steps = max(1, round(tick / self.model.opt.timestep))
        with installed():
            for _ in range(max(1, round(duration / (steps * self.model.opt.timestep)))):
                self._trace.add(self.data)
                self.data.ctrl[self._inputs] = driver(self.view)
                mujoco.mj_step(self.model, self.data, nstep=steps)
                self.view.update()
                if not np.abs(self.data.qvel).max() < FAST:
                    raise MjchairError(
                        f"the simulation diverged at {self.data.time:.2f} s; try a smaller step"
                    )
                if watch is not None:
                    watch(self.view)
                if until is not None and until(self.view):
                    return True
        return False

    def run(self, visual_geoms: bool = True) -> Run:
        """The run so far; with `visual_geoms`, its recording can be filmed."""
        spec = None
        if visual_geoms:
            spec = self.design.spec(visual_geoms=True, driven=self._driven)
            if self._edit is not None:
                self._edit(spec)
        return self._trace.run(spec)
