"""Static stability (after ISO 7176-1:2014): the tilt of the platform at which a chair tips.

In: a design. Out: tip angles (deg) forward, rearward, left and right; with the downhill wheels
locked and free; with the anti-tippers out and in; in the least and the most stable set-up.

These follow the standard: the directions, wheels free and downhill wheels locked, the two set-ups,
separate tests with anti-tippers, no sliding, and the definition that a chair tips when its uphill
wheels carry no load. The text of the standard was not available, so these are assumptions: the
tires are nearly rigid (they are inflated hard; separate keys show the effect of their stiffness);
stops let a free wheel turn on its axle, and hold a locked one at its contact; for left and right
the line through the two downhill contacts lies across the slope; once the anti-tippers stand on
the platform, the stop holds them.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping
from dataclasses import replace

import mujoco
from tqdm import tqdm

from mjchair.errors import MjchairError
from mjchair.model.spec import compile_spec
from mjchair.testlab.closed_form import DOWNHILL, anti_tip_angle
from mjchair.testlab.design import Design, parts
from mjchair.testlab.drive import has_motors
from mjchair.testlab.platform import MOST, RATE, Platform, Setup, Tilted
from mjchair.testlab.result import Grid, Result, Value

NAME = "static-stability"
STANDARD = "ISO 7176-1:2014"
# Adjustment ranges about the model's positions: assumptions, within those of manual chairs.
AXLE_RANGE = (-0.03, 0.03)  # m
SEAT_RANGE = (-0.02, 0.02)  # m, of the person with the seat


def static_stability(
    design: Design,
    *,
    stops: bool = True,
    rate: float = RATE,
    timestep: float | None = None,
    adjust: Mapping[str, tuple[float, float]] | None = None,
    progress: bool = False,
) -> Result:
    """Tip angles of a chair on the tilting platform.

    Args:
      design: the chair. stops: keep it from sliding, as in the standard.
      rate: of the platform, rad/s. timestep: s; None: the model's.
      adjust: chair parameter -> lowest and highest that a user may choose, for the least and the
        most stable set-up; None: the seat by SEAT_RANGE and, on a chair without
        motors, the rear axle by AXLE_RANGE.
      progress: show a bar where standard error is a terminal.

    Returns:
      Values in deg, by the keys `forward_locked`, `forward_unlocked`, `rearward_locked`,
      `rearward_unlocked`, `left`, `right` (without anti-tippers), and the same keys with
      `_anti_tippers`, with `_least` and `_most` (the least and the most stable set-up), and with
      `_own_tires` (tires with the stiffness of the model).

    Raises:
      MjchairError: the chair does not come to rest; or without stops it slides before it tips.
    """
    values: dict[str, Value] = {}
    rows: list[tuple[float | str | None, ...]] = []
    curves, runs = {}, {}
    model = compile_spec(design.spec())
    named = parts(model)
    tilted: Tilted
    cases = list(_cases(bool(named.anti_tippers), stops))
    for key, setup in tqdm(cases, unit="set-up", disable=None if progress else True):
        platform = Platform(design, setup, timestep)
        plain = not (setup.anti_tippers or not setup.rigid)
        tilted = platform.tilt(rate, keep=key == "rearward_unlocked")
        exact = tilted.exact
        if setup.anti_tippers and setup.direction == "rearward":
            exact = max(exact, anti_tip_angle(platform.model, _level(platform), platform.parts))
        angle = tilted.held if tilted.held is not None else tilted.angle
        values[key] = _value(angle, exact, setup)
        rows.append((_words(key), values[key].value, math.degrees(exact)))
        if plain:
            curves[key] = ([math.degrees(a) for a in tilted.tilt], tilted.load)
        if tilted.run is not None:
            runs[key] = tilted.run
    if not named.anti_tippers:
        for key, _ in _cases(True, stops):
            if key.endswith("_anti_tippers"):
                values[key] = Value(None, "deg", note="the chair has no anti-tippers")
    ranges = _ranges(design, model) if adjust is None else dict(adjust)
    extremes = _extremes(design, ranges, rate, timestep) if stops else {}
    values |= extremes
    rows += [(_words(key), value.value, None) for key, value in extremes.items()]
    return Result(
        NAME,
        values,
        setup=_setup(stops, ranges),
        grids=[Grid("Tip angles", ("set-up", "tilt, deg", "closed form, deg"), tuple(rows))],
        notes=[_NOTE],
        curves=curves,
        axes=("tilt of the platform, deg", "load uphill, share of the weight"),
        runs=runs,
    )


_NOTE = (
    'The closed form is that of a rigid chair. "own tires" repeats the test on tires of the '
    "model's stiffness. The downhill tires deflect under the growing load, so the chair tips at a "
    "slightly smaller angle."
)


def _level(platform: Platform) -> mujoco.MjData:
    """The data of a chair at rest on the level platform."""
    return Platform(platform.design, platform.setup).data


def _cases(anti_tippers: bool, stops: bool) -> Iterator[tuple[str, Setup]]:
    """Keys and set-ups; those without anti-tippers first."""
    plain = {}
    for direction in DOWNHILL:
        if direction in ("left", "right"):
            plain[direction] = Setup(direction, stops=stops)
        else:
            plain[f"{direction}_locked"] = Setup(direction, True, stops=stops)
            plain[f"{direction}_unlocked"] = Setup(direction, False, stops=stops)
    yield from plain.items()
    if not stops:
        return
    for key, setup in plain.items():
        if anti_tippers:
            yield f"{key}_anti_tippers", replace(setup, anti_tippers=True)
        yield f"{key}_own_tires", replace(setup, rigid=False)


def _value(angle: float | None, exact: float, setup: Setup) -> Value:
    if angle is None:
        return Value(None, "deg", note=f"does not tip up to {math.degrees(MOST):g} deg")
    note = f"closed form {math.degrees(exact):.1f} deg" if setup.rigid else ""
    return Value(math.degrees(angle), "deg", source=f"tilting platform, {STANDARD}", note=note)


def _words(key: str) -> str:
    return key.replace("_", " ")


def _ranges(design: Design, model) -> dict[str, tuple[float, float]]:  # type: ignore[no-untyped-def]
    """Default adjustment ranges: the seat; on a chair without motors also the axle."""
    ranges = {"rider_position": SEAT_RANGE}
    if not has_motors(model):
        ranges["axle_position"] = AXLE_RANGE
    named = {}
    for name, (low, high) in ranges.items():
        at = design.parameters.get(name, 0.0)
        try:
            for end in (low, high):
                replace(design, parameters={**design.parameters, name: at + end}).spec()
        except MjchairError:
            continue  # a user's chair without these parts
        named[name] = (at + low, at + high)
    return named


def _extremes(
    design: Design,
    ranges: Mapping[str, tuple[float, float]],
    rate: float,
    timestep: float | None,
) -> dict[str, Value]:
    """The least and the most stable set-up for every direction, by the closed form."""
    choices = [
        (
            replace(
                design, parameters={**design.parameters, **dict(zip(ranges, corner, strict=True))}
            ),
            turn,
        )
        for corner in itertools.product(*ranges.values())
        for turn in (0.0, math.pi)
    ]
    named: dict[str, Value] = {}
    for key, setup in _cases(False, True):
        if not setup.rigid:
            continue
        ready = []
        for chosen, turn in choices:
            try:
                platform = Platform(chosen, replace(setup, casters=turn), timestep)
            except MjchairError:
                continue  # the chair does not stand in this set-up
            ready.append((platform.exact, chosen, turn, platform))
        ready.sort(key=lambda item: item[0])
        for name, (_, chosen, turn, platform) in (("least", ready[0]), ("most", ready[-1])):
            texts = [f"{k} {chosen.parameters[k]:g}" for k in ranges]
            texts.append("casters trailing" if turn == 0.0 else "casters leading")
            angle = platform.tilt(rate).angle
            value = _value(angle, platform.exact, setup)
            named[f"{key}_{name}"] = replace(value, note=f"{', '.join(texts)}; {value.note}")
    return named


def _setup(stops: bool, ranges: Mapping[str, tuple[float, float]]) -> list[str]:
    sentences = ["dummy on the seat, casters trailing unless a row says otherwise"]
    held = "stops keep the chair from sliding"
    sentences.append(held if stops else "no stops: the tires hold the chair")
    for name, (low, high) in ranges.items():
        sentences.append(
            f"least and most stable set-up: {name} from {low:g} to {high:g}, casters both ways"
        )
    return sentences
