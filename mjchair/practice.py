"""Practice studies: an effect hidden in simulated runs, the answer sealed beside them.

In: an effect, and the chair that it is hidden in. Out: the files of a study, with the answer in
one that nobody reads by accident.
"""

from __future__ import annotations

import base64
import csv
import io
import json
import zlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import tomli_w

from mjchair.effects import user_file
from mjchair.effects.effect import Effect
from mjchair.errors import MjchairError
from mjchair.model import parts
from mjchair.model.load import Load, strap
from mjchair.model.parameters import ChairParameters
from mjchair.model.spec import compile_spec, load_spec
from mjchair.simulation.inputs import Inputs, push_strokes
from mjchair.simulation.recording import Recording
from mjchair.simulation.simulate import simulate
from mjchair.simulation.undriven import undriven

SEAL = "answer.sealed"
HELD_OUT = "push"  # no fit sees it; what is left turns in two ways and rolls in three
RATE, SECONDS = 100.0, 6.0  # Hz, s
LOAD = Load(mass=40.0, height=0.55)  # on the seat
TURNS_OVER = 4.0  # s, until which a chair that rolled backward is driven forward
NOISE = {  # SI; sizes of encoders, a small IMU and motion capture; assumed
    "left_wheel_speed": 0.05,
    "right_wheel_speed": 0.05,
    "imu_gyro.z": 0.02,
    "imu_accelerometer.x": 0.3,
    "position.x": 0.01,
    "position.y": 0.01,
    "heading": 0.01,
}


def _slalom() -> Inputs:
    time = np.arange(0.0, SECONDS, 0.01)
    swing = 4.0 * np.sin(2.0 * np.pi * 0.4 * time)
    return Inputs(time, {"left_wheel": 2.0 + swing, "right_wheel": 2.0 - swing}, "slalom")


def _turn() -> Inputs:
    """Torque that holds a yaw rate of about 0.6 rad/s against the tires' scrub."""
    time = np.arange(0.0, SECONDS, 0.01)
    one = np.ones(time.size)
    return Inputs(time, {"left_wheel": -3.0 * one, "right_wheel": 6.5 * one}, "turn")


def _reverse() -> Inputs:
    """Torque that stops a chair that rolls backward, and drives it forward."""
    time = np.arange(0.0, SECONDS, 0.01)
    push = np.where(time < TURNS_OVER, 1.4 * (1.0 + np.tanh((time - 0.5) / 0.1)), 0.0)
    return Inputs(time, {"left_wheel": push, "right_wheel": push}, "reverse")


def _swerve(more: float) -> Inputs:
    """Torque of a turn so fast that the tires slip, `more` (N m) at the right than on the mean."""
    time = np.arange(0.0, SECONDS, 0.01)
    torque = {w: 2.5 - more * side * np.ones(time.size) for w, side in parts.SIDE.items()}
    return Inputs(time, torque, "swerve")


def _spin() -> Inputs:
    """Torque on the spot, half the time to the left and half to the right."""
    time = np.arange(0.0, SECONDS, 0.01)
    turn = 2.5 * np.tanh(np.sin(2.0 * np.pi * time / SECONDS) / 0.2)
    return Inputs(time, {"left_wheel": -turn, "right_wheel": turn}, "spin")


@dataclass(frozen=True)
class Manoeuvre:
    """One run: a word for it, how it starts, what drives it, and what is strapped to the seat."""

    word: str
    initial: dict[str, object]
    inputs: Inputs | None = None
    load: Load | None = None


def manoeuvres() -> list[Manoeuvre]:
    """The runs of a practice study.

    Together they tell apart what looks alike in a coast: a fast one shows air, a fast one each way
    a slope or a wind, a turn on the spot toe, a fast turn how tires slide, and a load the bearings,
    which do not feel it.
    """
    strokes = push_strokes({"left_wheel": 12.0, "right_wheel": 12.0}, SECONDS)
    there, back = ({"heading": h, "position": (x, 0.0)} for h, x in ((0.0, 0.0), (np.pi, 14.0)))
    return [
        Manoeuvre("coast", {"speed": 3.4, **there}),
        Manoeuvre("coast", {"speed": 2.8, **back}, load=LOAD),
        Manoeuvre("turn", {"speed": 1.0, "heading": 0.5, "yaw_rate": 0.6}, _turn()),
        Manoeuvre("push", {"speed": 0.8, "heading": 1.2}, strokes),
        Manoeuvre("slalom", {"speed": 1.0, "heading": -0.6}, _slalom(), LOAD),
        Manoeuvre("reverse", {"speed": -0.5, "heading": 2.2, "yaw_rate": 0.2}, _reverse()),
        Manoeuvre("spin", {"heading": -1.5}, _spin()),
        Manoeuvre("swerve", {"speed": 2.0, "heading": 0.3, "yaw_rate": 1.3}, _swerve(3.0)),
        Manoeuvre("swerve", {"speed": 2.1, "heading": 0.9, "yaw_rate": -1.1}, _swerve(-2.7), LOAD),
    ]


def hide(
    effect: Effect,
    values: Mapping[str, float] | None = None,
    seed: int = 0,
    model: str = "manual",
    parameters: Mapping[str, float | str | bool] | None = None,
) -> dict[str, str | bytes]:
    """The files of a study with the effect hidden in it, and the sealed answer.

    Args:
      values: parameters of the effect; None: typical ones. seed: of the noise.
      model: a shipped chair, or a path to MJCF. parameters: of the chair, see ChairParameters.

    Returns:
      File name -> content.

    Raises:
      MjchairError: a sensor effect of a channel that is not written, values out of bounds, or an
        effect whose edit fails.
    """
    rng = np.random.default_rng(seed)
    chosen = dict(values) if values else _typical(effect)
    if effect.channel and effect.channel not in NOISE:
        raise MjchairError(
            f"a practice study has no channel {effect.channel}; it has {', '.join(NOISE)}"
        )
    chair = ChairParameters.of(parameters or {})
    spec = load_spec(model, parameters=chair)
    user_file.check(effect, spec)
    effect.apply(spec, chosen)
    files: dict[str, str | bytes] = {}
    study: dict[str, Any] = {"model": _told(model), "scene": "flat"}
    if effect.commanded is False:  # else it is not looked for
        study["torque"] = "measured"
    if chair.given():
        study["chair"] = dict(chair.given())
    study |= {"noise": NOISE, "trial": []}
    for k, made in enumerate(manoeuvres()):
        file = f"{made.word}_{k}.csv"
        files[file] = _table(_run(spec, made), made.inputs, rng)
        entry: dict[str, Any] = {"file": file, "manoeuvre": made.word}
        if made.word == HELD_OUT:
            entry["hold_out"] = True
        if made.load is not None:
            entry["load"] = asdict(made.load)
        study["trial"].append(entry)
    files["study.toml"] = tomli_w.dumps(study)
    answer = json.dumps({"effect": effect.name, "channel": effect.channel, "values": chosen})
    files[SEAL] = base64.b64encode(zlib.compress(answer.encode()))
    return files


def _run(spec: mujoco.MjSpec, made: Manoeuvre) -> Recording:
    chair = spec.copy()
    if made.load is not None:
        strap(chair, made.load)
    model = compile_spec(chair)
    if made.inputs is None:  # as the diagnosis has it in such a run
        model = undriven(model)
    return simulate(
        model, made.inputs, SECONDS, initial=made.initial, timestep=0.001, sample_rate=RATE
    )


def reveal(folder: Path) -> dict[str, object]:
    """The sealed answer of a practice study.

    Raises:
      MjchairError: there is none.
    """
    path = folder / SEAL
    if not path.is_file():
        raise MjchairError(f"no sealed answer {path}; `mjchair hide` makes one")
    return dict(json.loads(zlib.decompress(base64.b64decode(path.read_bytes()))))


def _told(model: str) -> str:
    """The model as study.toml, which is read from elsewhere, names it."""
    return str(Path(model).resolve()) if Path(model).is_file() else model


def _typical(effect: Effect) -> dict[str, float]:
    """Values that practise the effect: its example, or the typical size of its first parameter."""
    if effect.example is not None:
        return dict(effect.example)
    first = effect.fitted[0]
    return {**effect.neutral(), first.name: first.typical}


def _table(recording: Recording, inputs: Inputs | None, rng: np.random.Generator) -> str:
    out = io.StringIO()
    writer = csv.writer(out)
    columns = {n: np.asarray(recording.channels[n]) for n in NOISE}
    columns = {n: v + NOISE[n] * rng.standard_normal(v.size) for n, v in columns.items()}
    if inputs is not None:
        columns |= {n: inputs.at(n, recording.time) for n in inputs.controls}
    writer.writerow(["time", *columns])
    for k, time in enumerate(recording.time):
        writer.writerow(
            [repr(round(float(v), 7)) for v in (time, *(c[k] for c in columns.values()))]
        )
    return out.getvalue()
