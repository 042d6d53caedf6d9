"""Practice studies: an effect hidden in simulated runs, the answer sealed beside them."""

from __future__ import annotations

import base64
import csv
import io
import json
import zlib
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from mjchair.effects import own
from mjchair.effects.effect import Effect
from mjchair.errors import MjchairError
from mjchair.model.spec import load_spec
from mjchair.simulation.inputs import Inputs, push_strokes
from mjchair.simulation.recording import Recording
from mjchair.simulation.simulate import simulate

SEAL = "answer.sealed"
HELD_OUT = "push"  # no fit sees it; what is left turns in two ways and rolls in three
RATE, SECONDS = 100.0, 6.0  # Hz, s
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


def runs() -> list[tuple[str, dict[str, object], Inputs | None]]:
    """The manoeuvres: word, how it starts, what drives it."""
    strokes = push_strokes({"left_wheel": 12.0, "right_wheel": 12.0}, SECONDS)
    return [
        ("coast", {"speed": 1.8, "heading": 0.0, "position": (0.0, 0.0)}, None),
        ("coast", {"speed": 1.4, "heading": np.pi, "position": (6.0, 0.0)}, None),
        ("turn", {"speed": 1.0, "heading": 0.5, "yaw_rate": 0.6}, _turn()),
        ("push", {"speed": 0.8, "heading": 1.2}, strokes),
        ("slalom", {"speed": 1.0, "heading": -0.6}, _slalom()),
    ]


def hide(
    effect: Effect,
    values: Mapping[str, float] | None = None,
    seed: int = 0,
    model: str = "manual",
) -> dict[str, str | bytes]:
    """The files of a study with the effect hidden in it, and the sealed answer.

    Args:
      values: parameters; None: typical ones. seed: of the noise.

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
    spec = load_spec(model)
    own.check(effect, spec)
    effect.apply(spec, chosen)
    files: dict[str, str | bytes] = {}
    lines = [f'model = "{model}"', 'scene = "flat"', "", "[noise]"]
    lines += [f'"{name}" = {std}' for name, std in NOISE.items()]
    for k, (word, initial, inputs) in enumerate(runs()):
        recording = simulate(
            spec, inputs, SECONDS, initial=initial, timestep=0.001, sample_rate=RATE
        )
        files[f"{word}_{k}.csv"] = _table(recording, inputs, rng)
        lines += ["", "[[trial]]", f'file = "{word}_{k}.csv"', f'manoeuvre = "{word}"']
        if word == HELD_OUT:
            lines.append("hold_out = true")
    files["study.toml"] = "\n".join(lines) + "\n"
    answer = json.dumps({"effect": effect.name, "channel": effect.channel, "values": chosen})
    files[SEAL] = base64.b64encode(zlib.compress(answer.encode()))
    return files


def reveal(folder: Path) -> dict[str, object]:
    """The sealed answer of a practice study.

    Raises:
      MjchairError: there is none.
    """
    path = folder / SEAL
    if not path.is_file():
        raise MjchairError(f"no sealed answer {path}; `mjchair hide` makes one")
    return dict(json.loads(zlib.decompress(base64.b64decode(path.read_bytes()))))


def _typical(effect: Effect) -> dict[str, float]:
    if effect.name == "rider_sway":
        return {"mass": 40.0, "amplitude": 0.03, "frequency": 0.9, "phase": 0.5}
    if effect.name == "surface_patch":
        return {"x": 3.0, "y": 0.0, "radius": 0.6, "coefficient": 0.03}
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
