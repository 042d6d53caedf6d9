"""What effects, explanations and numbers are called in the report of a diagnosis.

In: an effect that was found, a hypothesis, a number. Out: words. **Two stars** stand about what is
to be bold and `backticks` about what is typed, for the page to show; nothing here is HTML.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from mjchair.diagnosis.explain.calibration import NONE, OUTSIDE
from mjchair.diagnosis.explain.event import EVENT
from mjchair.diagnosis.explain.probability import ONE_RUN
from mjchair.diagnosis.next_experiment.wording import plain, plain_together
from mjchair.diagnosis.result import Estimate, NamedEffect
from mjchair.units import per_cent, with_error, with_unit

LEAST = 1e-6  # a chance below this is said to be below it


def one_of(*names: str) -> str:
    """Alternatives as words: a, b or c."""
    *others, last = map(together, names)
    return f"{', '.join(others)} or {last}" if others else last


def found_words(effects: Sequence[NamedEffect]) -> str:
    """What is missing on the chair, and what was recorded wrongly, as one clause."""
    lacks = " and ".join(effect_words(e) for e in effects if e.of_chair)
    chair = [f"the model of the chair lacks {lacks}"] if lacks else []
    return ", and ".join(chair + [recording_words(e) for e in effects if not e.of_chair])


def recording_words(effect: NamedEffect) -> str:
    """What was recorded wrongly, as a clause: by a sensor, or of all columns of a kind."""
    if effect.channel is not None:
        return sensor_words(effect)
    return f"{effect.remark} ({bold(effect.name)})"


def sensor_words(effect: NamedEffect) -> str:
    """What a sensor at fault shows, as a clause."""
    number = next(iter(effect.parameters.values()))
    if effect.name == "sensor_delay":
        late = number.value >= 0.0
        shows = f"comes {size(abs(number.value))} s {'late' if late else 'early'}"
    else:
        much = "much" if number.value > 0.0 else "little"
        by = (
            f"{size(100.0 * abs(number.value))} %"
            if effect.name == "sensor_scale"
            else with_unit(size(abs(number.value)), number.unit)
        )
        shows = f"shows {by} too {much}"
    what = ", ".join(_parameters(effect))
    return f"the sensor of {effect.channel} {shows} ({bold(effect.name)}: {what})"


def capital(text: str) -> str:
    """The text as the beginning of a sentence."""
    return text[:1].upper() + text[1:]


def hypothesis_words(name: str) -> str:
    """A hypothesis of `probability` in words."""
    known = {
        NONE: "nothing missing",
        OUTSIDE: "something outside the library",
        ONE_RUN: "an effect in one run alone",
    }
    return known.get(name, plain_together(name))


def effect_words(effect: NamedEffect) -> str:
    """Name of an effect, and its parameters or what they say together."""
    on = f" on {effect.channel}" if effect.channel else ""
    return f"{bold(effect.name)}{on} ({effect.remark or ', '.join(_parameters(effect))})"


def _parameters(effect: NamedEffect) -> Iterable[str]:
    for name, p in effect.parameters.items():
        unit = "" if p.unit == "1" else f" {p.unit}"
        size = open_upwards(p) or with_error(p.value, p.std)
        held = " (held)" if p.std is None else ""
        yield f"{plain(name)} {size}{unit}{held}"


def open_upwards(p: Estimate) -> str:
    """The least size of a number that may be far larger; empty: it is no such number."""
    return "" if p.at_least is None else f"at least {p.at_least:.2g}"


def bold(name: str) -> str:
    """A name as words, to be shown bold."""
    return f"**{plain(name)}**"


def together(names: str) -> str:
    """One of the alternatives as words, bold: an effect, several that go together, or nothing."""
    known = {ONE_RUN: "something in one run alone", EVENT: "something that happened once"}
    if names in known:
        return known[names]
    return "nothing" if names == NONE else " with ".join(map(bold, names.split("+")))


def chance(p: float) -> str:
    """A probability; below LEAST its size says nothing more."""
    return f"p = {p:.2g}" if p >= LEAST else "p < 0.000001"


def share(p: float) -> str:
    """A probability as a share of cases."""
    return per_cent(p) if p >= 0.01 else f"{100 * p:.1g} %"


def size(ratio: float) -> str:
    """A ratio with two digits."""
    return f"{ratio:.0f}" if ratio >= 10 else f"{ratio:.2g}"
