"""Types of the result of a diagnosis: the verdict, its reasons, and the arrays of the figures.

In: nothing; mjchair.diagnosis.diagnose fills these types. Out: `Diagnosis` and its parts.

`Diagnosis.to_dict` has all that the file diagnosis.json has, and more. `Evidence` has the arrays
that reports draw, so that a report simulates nothing.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjchair.diagnosis.explain.choice import Choice
from mjchair.diagnosis.explain.column_ids import Driver, Quantity
from mjchair.diagnosis.explain.gap import Gap
from mjchair.diagnosis.explain.probability import of_effects
from mjchair.diagnosis.explain.screening import Base
from mjchair.diagnosis.fit.variant import Term, Variant
from mjchair.diagnosis.next_experiment.design import Plan
from mjchair.diagnosis.replay.pulses import Force
from mjchair.diagnosis.rules import LEVEL, Verdict

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """A fitted number, its standard deviation (None: it was held), and their unit.

    at_least: the least size that the data allow, where far larger ones fit as well; else None.
    """

    value: float
    std: float | None
    unit: str
    at_least: float | None = None

    def to_dict(self) -> dict[str, Any]:
        """As in diagnosis.json."""
        known = asdict(self)
        if self.at_least is None:
            del known["at_least"]
        return known


@dataclass(frozen=True, kw_only=True)
class NamedEffect:
    """An effect with its fitted parameters.

    Attributes:
      name, channel: of the effect; a channel only for effects of a sensor.
      closure: share of the excess that all named effects close together.
      remark: what the parameters say together, where that is no list of numbers; else empty.
      recording: whether it is of how the runs were recorded, as those of a sensor are as well.
    """

    name: str
    parameters: Mapping[str, Estimate]
    closure: float
    channel: str | None = None
    remark: str = ""
    recording: bool = False

    @property
    def of_chair(self) -> bool:
        """Whether it is something that the chair lacks."""
        return self.channel is None and not self.recording

    @property
    def key(self) -> str:
        """As it stands in the probabilities: its name, with the channel where there is one."""
        return f"{self.name}:{self.channel}" if self.channel else self.name

    def to_dict(self) -> dict[str, Any]:
        """As in diagnosis.json."""
        out: dict[str, Any] = {
            "name": self.name,
            "parameters": {name: p.to_dict() for name, p in self.parameters.items()},
            "closure": round(self.closure, 4),
        }
        return {**out, "channel": self.channel} if self.channel else out


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """An effect alone, as it was screened by linear algebra.

    Attributes:
      held_out_gain: chi2 that it brings on each run when it is fitted to the others.
      closure: its gain over that of the chosen effects, or over the gap where none is chosen; 0
        without a gap. detectability: sigmas.
      p_value: of a gain this large without the effect.
      collinear: |cos| to the chosen effects, 0 to 1.
    """

    name: str
    held_out_gain: float
    closure: float
    detectability: float
    p_value: float
    collinear: float
    channel: str | None = None

    def to_dict(self) -> dict[str, Any]:
        """As in diagnosis.json."""
        out = asdict(self)
        if not self.channel:
            del out["channel"]
        return out


@dataclass(frozen=True, kw_only=True)
class GapSummary:
    """Rms of the whitened residual before and after, over the trials of `scope`; noise gives 1.

    `after` is what the corrected chair leaves, None where there is none. `unforeseen` is what is
    left, by the corrected chair where there is one, without what the fitted trials leave open of
    the numbers that are only roughly known; None where no trial is held out. `p_value` and
    `p_value_after` are of all tests together, on the trials that were fitted to; `only_held_out`
    says that no gap shows there, and one does on the held-out trials. `shows_after` says whether a
    gap shows in what is left, which asks for a single test that stands out as well.
    """

    before: float
    after: float | None
    scope: str
    p_value: float
    p_value_after: float | None
    unforeseen: float | None = None
    shows_after: bool = False
    only_held_out: bool = False
    noise_floor: float = 1.0

    @property
    def held_out(self) -> bool:
        """Whether these trials are ones that no fit saw."""
        return "held-out" in self.scope

    @property
    def shows(self) -> bool:
        """Whether more than noise is left by the chair as it was."""
        return self.p_value < LEVEL or self.only_held_out


@dataclass(frozen=True)
class Material:
    """The largest missing force (N), and the limit below which none matters (N)."""

    value: float
    limit: float

    def to_dict(self) -> dict[str, dict[str, float | str | None]]:
        """As in diagnosis.json; what no force makes has no value."""
        value = self.value if math.isfinite(self.value) else None
        return {"force": {"value": value, "limit": self.limit, "unit": "N"}}


@dataclass(frozen=True, kw_only=True)
class Disagreement:
    """One channel in one window: chi2 per degree of freedom, and how the chair moved there.

    `window` is in s; `regime` says in words at what speed and yaw rate.
    """

    trial: str
    channel: str
    window: tuple[float, float]
    regime: Mapping[str, str]
    statistic: float


@dataclass(frozen=True, kw_only=True)
class MissingForce:
    """A force that no effect in the model makes, and what it goes with.

    Attributes:
      force: FORWARD or YAW. goes_with: such as the speed, or a time in a trial.
      sigmas: of its test.
    """

    force: Force
    goes_with: Driver
    sigmas: float

    def to_dict(self) -> dict[str, Any]:
        """As in diagnosis.json."""
        return {
            "force": str(self.force),
            "goes_with": str(self.goes_with),
            "sigmas": self.sigmas,
        }


@dataclass(frozen=True, kw_only=True)
class Moved:
    """Something roughly known, and how far the fit moved it, in prior standard deviations."""

    name: str
    std: float
    unit: str
    by: float


@dataclass(frozen=True, kw_only=True)
class WindowGaps:
    """Rms of the slow residual over noise in every window and channel, (channels, windows).

    Attributes:
      trials: index of each window's trial, (windows,). times: first and last, s, (windows, 2).
      before: of the chair as it was, NaN where a channel has nothing. after: of the corrected one.
      highest: Hz, below which the residual is looked at.
    """

    channels: tuple[str, ...]
    trials: NDArray[np.int64]
    times: Array
    before: Array
    after: Array | None
    highest: float


@dataclass(frozen=True, kw_only=True)
class TrialGap:
    """Rms of the whitened residual of one trial, before and after; None: not known."""

    trial: str
    held_out: bool
    before: float | None
    after: float | None


@dataclass(frozen=True, kw_only=True)
class ForceLevels:
    """The mean missing force at levels of what it may go with; nothing draws it towards zero.

    Attributes:
      middle: (n,), of each level, in the unit of what it goes with. value, std: (n,), N or N m.
    """

    middle: Array
    value: Array
    std: Array


@dataclass(frozen=True, kw_only=True)
class Nearest:
    """The explanation that comes nearest where none is named.

    Attributes:
      effects: their keys. closure: share of the excess that they close. remainder: rms of the
        whitened residual that they leave on the trials of the gap's scope; noise gives 1.
      ends: effect and name of each of their numbers that is on the bound of what is believed of it.
    """

    effects: tuple[str, ...]
    closure: float
    remainder: float
    ends: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True)
class Shaken:
    """Two runs of one manoeuvre, of which what shakes the chair pushes one far harder, N.

    Attributes:
      trial: the one, and how hard. other: the one that is shaken least, and how hard.
    """

    trial: str
    force: float
    other: str
    least: float


@dataclass(frozen=True, kw_only=True)
class Moment:
    """Where something happened that no other run shows.

    Attributes:
      trial: name of the run.
      begin, end: between which seconds of its clock; None: it is held out, and no fit saw it.
    """

    trial: str
    begin: int | None = None
    end: int | None = None


@dataclass(frozen=True, kw_only=True)
class OneRun:
    """Effects that explain more by acting in one run alone, or as much, as any in all runs do.

    Attributes:
      trial: name of the run. effects: any one of them, best first, by linear algebra.
      gain: chi2 that the best brings. others: that effects bring which act in all runs.
    """

    trial: str
    effects: tuple[NamedEffect, ...]
    gain: float
    others: float

    def to_dict(self) -> dict[str, Any]:
        """As in diagnosis.json."""
        return {
            "trial": self.trial,
            "effects": [effect.to_dict() for effect in self.effects],
            "gain": round(self.gain, 1),
            "others": round(self.others, 1),
        }


@dataclass(frozen=True, kw_only=True)
class ForceSamples:
    """The force that would close the gap, at knots along the windows.

    Attributes:
      unit: N or N m. trials: index of each knot's trial. time: s. value, std: in the unit; (n,).
      against: what it may go with -> its value at each knot, (n,): SPEED (m/s), YAW_RATE (rad/s),
        HEADING (rad, within half a turn), SWIVEL (rad), TORQUE (N m, of both wheels), LEFT_TURN
        and RIGHT_TURN of the wheels (rad, 0 to 2 pi), STROKE (rad; NaN outside strokes).
      levels: the same names -> the mean force at levels of each; only where there are any.
    """

    unit: str
    trials: NDArray[np.int64]
    time: Array
    value: Array
    std: Array
    against: Mapping[Quantity, Array]
    levels: Mapping[Quantity, ForceLevels] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class WholeRun:
    """A trial simulated in one go from its first state, with the chair before and after.

    Attributes:
      time: (n,) s. channels: with their units and their noise (SI). measured, before, after:
        (n, channels); NaN where nothing was measured; angles that wrap stand beside the measured.
    """

    trial: str
    held_out: bool
    time: Array
    channels: tuple[str, ...]
    units: tuple[str, ...]
    noise: Array
    measured: Array
    before: Array
    after: Array | None


@dataclass(frozen=True, kw_only=True)
class Evidence:
    """What a report draws.

    Attributes:
      windows: where model and measurement disagree. trials: the gap of each, in order.
      forces: FORWARD and YAW -> the force that would close the gap.
      runs: whole runs, held-out ones, or the longest where none is held out.
      moved: what was only roughly known. turns: whether any channel tells how the chair turns;
        without, yaw is a guess and is not shown.
      plan: the manoeuvres that would decide; None: not needed.
    """

    windows: WindowGaps
    trials: tuple[TrialGap, ...]
    forces: Mapping[Force, ForceSamples]
    runs: tuple[WholeRun, ...]
    moved: tuple[Moved, ...]
    turns: bool = True
    plan: Plan | None = None


@dataclass(frozen=True, kw_only=True)
class Stages:
    """Results of the stages, for further work in Python."""

    base: Base
    gap: Gap
    choice: Choice | None


@dataclass(kw_only=True)
class Diagnosis:
    """The verdict of a study, and what it rests on.

    Attributes:
      verdict: what is said. effects: in the model now, most important first.
      alternatives: keys of effects that these data cannot tell apart, one set for each effect,
        itself first; that of a sensor's error ends in its channel, "a+b" is two that go together,
        "none" that nothing stands there, "event" that something happened once, and "one_run" that
        something acts in one run alone.
      candidates: every effect as screened. gap: rms of the whitened residual before and after.
      where: where the disagreement is. next_experiment: what would decide.
      notes: what was assumed or noticed. drivers: what the force that is missing goes with.
      nearest: the explanation that comes nearest where none is named.
      one_run: what acts in one run alone, where that explains more (the verdict is unknown then),
        or as much (it is ambiguous).
      moment: where something happened that no other run shows; None: nowhere, or not `unknown`.
      tipped: runs in which the chair of the model tips, and no channel shows that the real one did.
      probability: of every hypothesis; a pair is "a+b". more_missing: whether the effects leave
        something that is no noise. material: the largest missing force, and what matters.
      process: drive, side, yaw, wheel_turn, caster_turn -> standard deviation of what shakes the
        chair; person -> share of a moving person's force that is in no model.
      loud: which of drive, side and yaw stand at the most that is believed of them: a steady force
        may hide there.
      shaken: a run that is shaken far harder than another of its kind; None: none is.
      terms: the effects with the values that stand in the corrected chair.
      correction: the corrected chair, with what is only roughly known where the fit moved it.
      evidence: for the report. stages: for further work in Python.
    """

    verdict: Verdict
    effects: list[NamedEffect] = field(default_factory=list)
    alternatives: list[list[str]] = field(default_factory=list)
    candidates: list[Candidate] = field(default_factory=list)
    gap: GapSummary | None = None
    where: list[Disagreement] = field(default_factory=list)
    next_experiment: str = ""
    notes: list[str] = field(default_factory=list)
    drivers: list[MissingForce] = field(default_factory=list)
    nearest: Nearest | None = None
    one_run: OneRun | None = None
    moment: Moment | None = None
    tipped: list[str] = field(default_factory=list)
    probability: dict[str, float] = field(default_factory=dict)
    more_missing: bool = False
    material: Material | None = None
    process: Mapping[str, Estimate] = field(default_factory=dict)
    loud: tuple[str, ...] = ()
    shaken: Shaken | None = None
    terms: tuple[Term, ...] = ()
    correction: Variant | None = field(default=None, repr=False)
    evidence: Evidence | None = field(default=None, repr=False)
    stages: Stages | None = field(default=None, repr=False)

    def _likely(self, effect: NamedEffect) -> float:
        """How probable it is that an effect is there, alone or with others."""
        return round(of_effects(self.probability, [effect.key]), 4)

    def to_dict(self) -> dict[str, Any]:
        """As in diagnosis.json."""
        return {
            "verdict": str(self.verdict),
            "effects": [{**e.to_dict(), "probability": self._likely(e)} for e in self.effects],
            "alternatives": self.alternatives,
            "candidates": [c.to_dict() for c in self.candidates],
            "gap": asdict(self.gap) if self.gap else {},
            "one_run": self.one_run.to_dict() if self.one_run else None,
            "moment": asdict(self.moment) if self.moment else None,
            "tipped": self.tipped,
            "where": [{**asdict(w), "window": list(w.window)} for w in self.where],
            "next_experiment": self.next_experiment,
            "probability": {name: round(p, 4) for name, p in self.probability.items()},
            "more_missing": self.more_missing,
            "loud": list(self.loud),
            "material": self.material.to_dict() if self.material else {},
            "process": {n: {"value": e.value, "unit": e.unit} for n, e in self.process.items()},
            "shaken": asdict(self.shaken) if self.shaken else None,
            "drivers": [d.to_dict() for d in self.drivers],
            "notes": self.notes,
        }
