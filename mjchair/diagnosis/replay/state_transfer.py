"""Transfer of a state to another model that shares some of the joints and actuators.

In: two compiled models. Out: `Transfer`, which makes states of one of them from states
of the other.

An effect may add joints (a rider that moves) or activations (a drive that lags). What both models
have is copied by name; the rest has its first value of the other model.
"""

from __future__ import annotations

from collections.abc import Mapping

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.diagnosis.replay.chair_state import Chair, Rest, State
from mjchair.engine.install import installed
from mjchair.simulation import names

Array = NDArray[np.float64]
Index = NDArray[np.int64]


class Transfer:
    """Carries states from one model to another.

    Attributes:
      joints: names of the joints that only the target has, with the places of their first qpos and
        dof. activations: actuators of the target whose activation the source does not have, with
        their places in act.
    """

    def __init__(self, source: mujoco.MjModel, target: mujoco.MjModel) -> None:
        """Pair the joints and the activations by name."""
        self.target = target
        self.joints: dict[str, tuple[int, int]] = {}
        self.activations: dict[int, slice] = {}
        self._pair_joints(source)
        self._pair_activations(source)

    def _pair_joints(self, source: mujoco.MjModel) -> None:
        here = {name: j for j, name in enumerate(names.joints(source))}
        qpos: list[tuple[int, int]] = []
        qvel: list[tuple[int, int]] = []
        for j, name in enumerate(names.joints(self.target)):
            free = self.target.jnt_type[j] == mujoco.mjtJoint.mjJNT_FREE
            q, v = int(self.target.jnt_qposadr[j]), int(self.target.jnt_dofadr[j])
            if name not in here:
                self.joints[name] = (q, v)
                continue
            k = here[name]
            first_q, first_v = int(source.jnt_qposadr[k]), int(source.jnt_dofadr[k])
            qpos += [(first_q + i, q + i) for i in range(7 if free else 1)]
            qvel += [(first_v + i, v + i) for i in range(6 if free else 1)]
        self._qpos, self._qvel = _places(qpos), _places(qvel)

    def _pair_activations(self, source: mujoco.MjModel) -> None:
        here = {name: a for a, name in enumerate(names.actuators(source))}
        act: list[tuple[int, int]] = []
        for a, name in enumerate(names.actuators(self.target)):
            at, count = int(self.target.actuator_actadr[a]), int(self.target.actuator_actnum[a])
            if at < 0:
                continue
            k = here.get(name, -1)
            if k < 0 or source.actuator_actnum[k] != count:
                self.activations[a] = slice(at, at + count)
                continue
            first = int(source.actuator_actadr[k])
            act += [(first + i, at + i) for i in range(count)]
        self._act = _places(act)

    def __call__(self, state: State) -> State:
        """The state of the source in the target."""
        m = self.target
        out = State(m.qpos0.copy(), np.zeros(m.nv), np.zeros(m.na))
        out.qpos[self._qpos[1]] = state.qpos[self._qpos[0]]
        out.qvel[self._qvel[1]] = state.qvel[self._qvel[0]]
        out.act[self._act[1]] = state.act[self._act[0]]
        return out


def _places(pairs: list[tuple[int, int]]) -> tuple[Index, Index]:
    """Places in the source and in the target."""
    both = np.array(pairs, np.int64).reshape(-1, 2)
    return both[:, 0], both[:, 1]


class StateCarrier:
    """Carries states between the base model of a study and its variants, both ways.

    A variant with the same joints rests otherwise on its tires: a wheel 3 mm smaller would begin
    every window with a fall of 3 mm. Its height and attitude are changed by that.
    """

    def __init__(self, base: mujoco.MjModel, chair: Chair) -> None:
        """States of `base` are what is carried; `chair` knows its joints."""
        self.base, self.chair = base, chair
        self._transfers: dict[tuple[bytes, bytes], Transfer] = {}
        self._rests: dict[bytes, Rest] = {}

    def into(self, model: mujoco.MjModel, state: State) -> tuple[State, Transfer]:
        """A state of the base model in a variant, and what the variant has besides."""
        transfer = self._transfer(self.base, model)
        if self._like_base(model):
            return self._resting(state, self.base, model), transfer
        return transfer(state), transfer

    def back(self, model: mujoco.MjModel, trace: Mapping[str, Array], at: int) -> State:
        """The base model's state at row `at` of a trace of a variant."""
        full = State(*(trace[name][at].copy() for name in ("qpos", "qvel", "act")))
        if self._like_base(model):
            return self._resting(full, model, self.base)
        return self._transfer(model, self.base)(full)

    def _like_base(self, model: mujoco.MjModel) -> bool:
        base = self.base
        return (model.nq, model.nv, model.na) == (base.nq, base.nv, base.na)

    def _transfer(self, source: mujoco.MjModel, target: mujoco.MjModel) -> Transfer:
        """Made once for models of the same names and sizes."""
        key = (_structure(source), _structure(target))
        if key not in self._transfers:
            self._transfers[key] = Transfer(source, target)
        return self._transfers[key]

    def _resting(self, state: State, here: mujoco.MjModel, there: mujoco.MjModel) -> State:
        rests = [self._rest(model) for model in (here, there)]
        return state if rests[0] is rests[1] else self.chair.lowered(state, *rests)

    def _rest(self, model: mujoco.MjModel) -> Rest:
        key = self.chair.statics(model)
        if key not in self._rests:
            with installed():
                self._rests[key] = self.chair.rest(model)
        return self._rests[key]


def _structure(model: mujoco.MjModel) -> bytes:
    """What decides how states of a model are laid out."""
    sizes = np.array([model.nq, model.nv, model.na, model.nu], np.int64)
    return sizes.tobytes() + bytes(model.names)
