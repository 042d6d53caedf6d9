"""What a diagnosis says, in the words and files of its contract."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

NAMED, AMBIGUOUS, UNKNOWN, NONE = "named", "ambiguous", "unknown", "none"

# Frozen on the development seeds of benchmarks/blind (README there)
CLOSES = 0.8  # of the excess, that a named effect closes
CARRIED = 0.5  # of the excess on held-out trials, that it closes there
REMAINDER = 2.0  # rms of the whitened residual, beyond which what is left is no noise
NEARLY_ALL = 0.98  # closed, by an effect so large that more than that may be left
HELD = 10.0  # chi2 that it must bring on runs that it was not fitted to
SIGMAS = 4.0  # of a parameter away from neutral
RIVAL_CHI2 = 10.0  # a rival this near, in chi2 with its penalty, is not ruled out
RIVAL_ERRORS = 2.0  # nor one this near in paired standard errors over windows


@dataclass(frozen=True)
class Named:
    """An effect with its fitted parameters.

    Attributes:
      name, channel: of the effect. parameters: name -> value, std and unit.
      closure: share of the excess that it closes with those before it.
    """

    name: str
    parameters: Mapping[str, Mapping[str, Any]]
    closure: float
    channel: str | None = None

    def to_dict(self) -> dict[str, Any]:
        """As in diagnosis.json."""
        out: dict[str, Any] = {
            "name": self.name,
            "parameters": {k: dict(v) for k, v in self.parameters.items()},
            "closure": round(self.closure, 4),
        }
        if self.channel:
            out["channel"] = self.channel
        return out


@dataclass(frozen=True)
class Ranked:
    """A candidate as it was screened."""

    name: str
    held_out_gain: float
    closure: float
    detectability: float
    p_value: float
    collinear: float
    channel: str | None = None

    def to_dict(self) -> dict[str, Any]:
        """As in diagnosis.json."""
        out: dict[str, Any] = {
            "name": self.name,
            "held_out_gain": self.held_out_gain,
            "closure": self.closure,
            "detectability": self.detectability,
            "p_value": self.p_value,
            "collinear": self.collinear,
        }
        if self.channel:
            out["channel"] = self.channel
        return out


@dataclass
class Diagnosis:
    """The verdict of a study, and what it rests on.

    Attributes:
      verdict: none, named, ambiguous or unknown. effects: in the model now, most important first.
      alternatives: sets of effects that these data cannot tell apart, one set for each effect.
      candidates: every effect as screened. gap: rms of the whitened residual before and after.
      where: where the disagreement is. next_experiment: what would decide.
      notes: what was assumed or noticed. drivers: what the force that is missing goes with.
      stages: results of the stages, for the report and for further work in Python.
    """

    verdict: str
    effects: list[Named] = field(default_factory=list)
    alternatives: list[list[str]] = field(default_factory=list)
    candidates: list[Ranked] = field(default_factory=list)
    gap: dict[str, Any] = field(default_factory=dict)
    where: list[dict[str, Any]] = field(default_factory=list)
    next_experiment: str = ""
    notes: list[str] = field(default_factory=list)
    drivers: list[dict[str, Any]] = field(default_factory=list)
    stages: dict[str, Any] = field(default_factory=dict, repr=False)

    def to_dict(self) -> dict[str, Any]:
        """As in diagnosis.json."""
        return {
            "verdict": self.verdict,
            "effects": [e.to_dict() for e in self.effects],
            "alternatives": self.alternatives,
            "candidates": [c.to_dict() for c in self.candidates],
            "gap": self.gap,
            "where": self.where,
            "next_experiment": self.next_experiment,
            "drivers": self.drivers,
            "notes": self.notes,
        }
