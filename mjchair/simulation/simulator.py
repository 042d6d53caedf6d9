"""A chair in a closed loop: a controller of one's own observes it and commands it, at its own rate.

In: a chair, and a controller, which is any function from an observation to a command. Out: a
recording with every sensor, as `simulate` makes it.

    simulator = mjchair.Simulator(mjchair.load_spec("power", drive="normal"), rate=50)
    run = simulator.run(lambda observation: (0.5, 0.0), 10.0)

An observation maps `time` (s) and the names of all sensor scalars (`velocity.x`, `imu_gyro.z`, ...)
to numbers in SI. A command is a sequence of numbers in the order of `Simulator.inputs`, or a
mapping from names of actuators; what it does not name keeps its value. `observe` gives the same
observation for any model and data, so the same controller runs in a dm_control environment.
"""

from __future__ import annotations

import copy
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.drive.block import JOYSTICK
from mjchair.engine.install import installed
from mjchair.errors import MjchairError, nearest, note
from mjchair.model.engine_warnings import without_engine_warnings
from mjchair.model.spec import compile_spec
from mjchair.model.wheels import base_name, check_timestep
from mjchair.simulation import names
from mjchair.simulation.channels import channels
from mjchair.simulation.initial import Initial, as_initial, start
from mjchair.simulation.inputs import drivable
from mjchair.simulation.recording import Recording
from mjchair.simulation.simulate import (
    FULL,
    assembled,
    check_positive,
    sound,
    steps_a_sample,
)
from mjchair.simulation.standing import leaning_on
from mjchair.simulation.stored_model import StoredModel

Array = NDArray[np.float64]
Observation = Mapping[str, float]
Command = Mapping[str, float] | Sequence[float] | NDArray[np.float64]
Controller = Callable[[Observation], Command]
ROUNDING = 1e-9  # s
WHEELS = ("left_wheel", "right_wheel")


class ControllerError(MjchairError):
    """A controller raised, or its command is not one.

    Attributes:
      recording: up to then; None: nothing was stepped yet.
    """

    recording: Recording | None = None


@dataclass(frozen=True)
class Link:
    """What happens to messages between a controller and a chair. Frozen, checked when made.

    Attributes:
      delay: s, from sending to arrival. quantum: values are rounded to whole multiples of it, one
        for all or by name; 0: not at all. dropped: probability that a message is lost, 0 to 1;
        the last that arrived then stays. seed: of that.

    Raises:
      MjchairError: a negative delay or quantum, a probability out of 0 to 1.
    """

    delay: float = 0.0
    quantum: float | Mapping[str, float] = 0.0
    dropped: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        """Check the numbers."""
        quanta = self.quantum.values() if isinstance(self.quantum, Mapping) else [self.quantum]
        for name, value in (("delay", self.delay), *(("quantum", q) for q in quanta)):
            if not 0.0 <= value < np.inf:
                raise MjchairError(f"link {name} is {value:g}; it must be 0 or more")
        if not 0.0 <= self.dropped <= 1.0:
            raise MjchairError(f"link dropped is {self.dropped:g}; it must be within 0 to 1")

    def rounded(self, values: Mapping[str, float]) -> dict[str, float]:
        """The values as they arrive."""
        quanta = self.quantum
        by_name = quanta if isinstance(quanta, Mapping) else dict.fromkeys(values, quanta)
        steps = {name: by_name.get(name, 0.0) for name in values}
        return {
            name: round(value / steps[name]) * steps[name] if steps[name] else value
            for name, value in values.items()
        }


@dataclass
class Messages:
    """The messages on a link: sent, under way, and the last that arrived."""

    link: Link
    latest: dict[str, float] = field(default_factory=dict)
    under_way: deque[tuple[float, dict[str, float]]] = field(default_factory=deque)

    def __post_init__(self) -> None:
        """Seed what drops messages."""
        self._random = np.random.default_rng(self.link.seed)

    def send(self, now: float, values: Mapping[str, float]) -> None:
        """Send values at a time, s."""
        if not (self.link.dropped and self._random.random() < self.link.dropped):
            self.under_way.append((now + self.link.delay, self.link.rounded(values)))

    def receive(self, now: float) -> dict[str, float]:
        """The last values that arrived by a time, s; earlier ones where it has no newer."""
        while self.under_way and self.under_way[0][0] <= now + ROUNDING:
            self.latest = {**self.latest, **self.under_way.popleft()[1]}
        return self.latest


class Observer:
    """Reads observations from a model and its data.

    A data that others step holds the sensors of the state before the last step; `observe` and
    `Simulator` evaluate the present one.
    """

    def __init__(self, model: mujoco.MjModel) -> None:
        """Look up the sensors of a model once."""
        self._places = {channel.name: channel.index for channel in channels(model)}

    def read(self, data: mujoco.MjData) -> dict[str, float]:
        """The observation in the data as it is: name -> number in SI."""
        values = data.sensordata.tolist()
        return {"time": data.time, **{name: values[i] for name, i in self._places.items()}}


def observe(model: mujoco.MjModel, data: mujoco.MjData) -> Observation:
    """The present observation of a chair: `time` (s) and every sensor's scalars, SI.

    Evaluates the sensors at the present state; the trajectory stays what it was to the bit. The
    callbacks must be in place (`mjchair.install`), as dm_control environments of mjchair have
    them.

    Args:
      model: of a chair; of a dm_control physics it is `physics.model.ptr`.
      data: of the model; of a dm_control physics it is `physics.data.ptr`.
    """
    warm = data.qacc_warmstart.copy()
    mujoco.mj_forward(model, data)
    data.qacc_warmstart[:] = warm
    return Observer(model).read(data)


class Simulator:
    """Steps a chair with a controller in the loop, and records everything.

    Attributes:
      model: that is stepped. data: its state; reading it is free, writing is for experts.
      inputs: names of the actuators that a command without names gives, in order: the joystick
        where the chair has a drive, else the torques of the wheels.
      period: of the controller, s. late: periods that ended later than in real time.
    """

    def __init__(
        self,
        model: mujoco.MjModel | mujoco.MjSpec,
        *,
        rate: float = 50.0,
        initial: Initial | Mapping[str, Any] | None = None,
        timestep: float | None = None,
        sample_rate: float | None = None,
        brakes: bool = False,
        commands: Link | None = None,
        observations: Link | None = None,
        real_time: bool = False,
        compiled: bool = True,
    ) -> None:
        """Place the chair, settled on its tires.

        Args:
          model: from mjchair.load_spec, or compiled from that; it is not changed.
          rate: of the controller, Hz; its period is a whole number of time steps.
          initial, timestep, sample_rate, brakes, compiled: as for `mjchair.simulate`.
          commands: the link from controller to chair. observations: from chair to controller.
            None: at once, exact, nothing lost.
          real_time: wait until the clock on the wall has gone on as far.

        Raises:
          MjchairError: bad input, as one line. NotStandingError: as `mjchair.simulate`.
        """
        spec = None
        if isinstance(model, mujoco.MjSpec):
            spec = model.copy()
            model = compile_spec(spec)
        self.model = copy.copy(model)
        if timestep is not None:
            check_positive("timestep", timestep, "s")
            self.model.opt.timestep = timestep
            check_timestep(self.model)
        check_positive("rate", rate, "Hz")
        h = float(self.model.opt.timestep)
        self._steps = max(1, round(1.0 / (rate * h)))
        if abs(self._steps * rate * h - 1.0) > 1e-6:
            raise MjchairError(
                f"rate is {rate:g} Hz; the nearest at a time step of {h:g} s is "
                f"{1.0 / (self._steps * h):g} Hz"
            )
        self.period = self._steps * h
        self._every = steps_a_sample(h, sample_rate)
        self._stored = StoredModel.of(self.model, spec)
        self._known = names.actuators(self.model)
        self._drivable = drivable(self.model)
        sticks = [n for n in self._drivable if base_name(n) in JOYSTICK]
        self.inputs = tuple(sticks or [n for n in self._drivable if base_name(n) in WHEELS])
        self._compiled, self._real_time = compiled, real_time
        with installed(compiled), without_engine_warnings():
            self.data = start(self.model, as_initial(initial), brakes)
        leaning = leaning_on(self.model, self.data)
        if leaning:
            note(leaning)
        self._observer = Observer(self.model)
        self._to_chair = Messages(commands or Link())
        self._to_controller = Messages(observations or Link())
        self._states: list[Array] = []
        self._sensed: list[Array] = []
        self._controls: list[Array] = []
        self._taken = 0
        self._broken = ""
        self._began: float | None = None
        self.late = 0
        self._to_controller.latest = dict(self._look())

    @property
    def time(self) -> float:
        """Time of the simulation, s."""
        return float(self.data.time)

    def observation(self) -> Observation:
        """What the controller knows now: the last observation that has arrived."""
        return dict(self._to_controller.receive(self.time))

    def step(self, command: Command) -> Observation:
        """Send a command and go on by one period; what has arrived at its end.

        Raises:
          ControllerError: the command is not one; the chair has not moved.
        """
        self._to_chair.send(self.time, self._checked(command))
        with installed(self._compiled), without_engine_warnings():
            for _ in range(self._steps):
                self._advance()
        self._wait()
        self._to_controller.send(self.time, self._look())
        return self.observation()

    def run(self, controller: Controller, duration: float) -> Recording:
        """Let a controller drive for a duration (s); call again to go on.

        A chair that breaks does not raise, as in `simulate`: the recording ends there.

        Raises:
          ControllerError: the controller raised, or its command is not one; the error has the
            `recording` up to then.
          MjchairError: a duration that is not positive.
        """
        check_positive("duration", duration, "s")
        for _ in range(max(1, round(duration / self.period))):
            try:
                command = controller(self.observation())
            except Exception as error:
                line = (str(error).splitlines() or [""])[0]
                raise self._refused(
                    f"the controller raised {type(error).__name__} at {self.time:g} s: {line}"
                ) from error
            self.step(command)
            if self._broken:
                break
        return self.recording()

    def recording(self) -> Recording:
        """Everything from the start until now.

        Raises:
          MjchairError: nothing has been stepped yet.
        """
        if not self._states:
            raise MjchairError("nothing is recorded yet; step or run the simulator first")
        states, sensed, controls = list(self._states), list(self._sensed), list(self._controls)
        if not self._broken and self._taken % self._every == 0:
            self._look()
            states.append(self._state())
            sensed.append(self.data.sensordata.copy())
            controls.append(self.data.ctrl.copy())
        made = assembled(
            self.model,
            self._stored,
            np.array(states),
            np.array(sensed),
            np.array(controls),
            self._broken,
            self._every,
        )
        return replace(made, hold=True)

    def _look(self) -> Observation:
        """The observation at the present state."""
        with installed(self._compiled), without_engine_warnings():
            warm = self.data.qacc_warmstart.copy()
            mujoco.mj_forward(self.model, self.data)
            self.data.qacc_warmstart[:] = warm
        return self._observer.read(self.data)

    def _state(self) -> Array:
        state = np.empty(mujoco.mj_stateSize(self.model, FULL))
        mujoco.mj_getState(self.model, self.data, state, FULL)
        return state

    def _advance(self) -> None:
        """One time step: commands that have arrived, the chair, the record."""
        if self._broken:
            return
        for name, value in self._to_chair.receive(self.time).items():
            self.data.ctrl[self._known.index(name)] = value
        before, first = self._state(), self._taken
        mujoco.mj_step(self.model, self.data)
        sensed = self.data.sensordata.copy()
        kept, self._broken = sound(self.model, self._state()[None], sensed[None], first)
        if kept and first % self._every == 0:
            self._states.append(before)
            self._sensed.append(sensed)
            self._controls.append(self.data.ctrl.copy())
        self._taken += 1

    def _wait(self) -> None:
        """In real time: until the wall's clock is where the simulation is."""
        if not self._real_time:
            return
        now = time.perf_counter()
        if self._began is None:
            self._began = now - self.period
        ahead = self._began + self.time - now
        if ahead > 0.0:
            time.sleep(ahead)
        else:
            self.late += 1

    def _checked(self, command: Command) -> dict[str, float]:
        """A command by the full names of actuators."""
        given = self._by_name(command)
        checked = {}
        for name, value in given.items():
            full = self._known[self._found(name)]
            try:
                number = float(value)
            except (TypeError, ValueError):
                raise self._refused(
                    f"the controller gives {name} as {value!r} at {self.time:g} s; it must be a "
                    "number"
                ) from None
            if not np.isfinite(number):
                raise self._refused(
                    f"the controller gives {name} as {number} at {self.time:g} s; it must be finite"
                )
            if base_name(full) in JOYSTICK and abs(number) > 1.0:
                raise self._refused(
                    f"the controller gives {name} as {number:.4g} at {self.time:g} s; a joystick "
                    "goes from -1 to 1"
                )
            checked[full] = number
        return checked

    def _by_name(self, command: Command) -> Mapping[str, float]:
        if isinstance(command, Mapping):
            return command
        values = np.atleast_1d(np.asarray(command, dtype=object)).ravel().tolist()
        if len(values) != len(self.inputs) or values == [None]:
            many = "nothing" if values == [None] else f"{len(values)} values"
            raise self._refused(
                f"the controller gives {many} at {self.time:g} s; it must give "
                f"{len(self.inputs)}: {', '.join(self.inputs)}"
            )
        return dict(zip(self.inputs, values, strict=True))

    def _found(self, name: str) -> int:
        try:
            index = names.find(name, self._known, "actuator")
        except MjchairError:
            index = -1
        if index < 0 or self._known[index] not in self._drivable:
            raise self._refused(
                f"the controller commands {name!r}, which takes no input"
                + nearest(name, self._drivable)
            )
        return index

    def _refused(self, line: str) -> ControllerError:
        error = ControllerError(line)
        error.recording = self.recording() if self._states else None
        return error
