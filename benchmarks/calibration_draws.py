"""Cheap studies for the calibration: data drawn from the columns of base studies.

What it does: takes the white columns of each base study (`calibration_studies.py`), hides nothing,
one to three effects, or a force that no effect makes in them, adds noise of other levels and
colours than those assumed, errors of form, and what a chair is a little other in; then runs the
diagnosis' own selection and weights on these data, with linear algebra in place of simulations. In:
the folder of the pickles. Out: a line for each drawn study in draws.jsonl there.

    python benchmarks/calibration_draws.py out/calibration --count 200
"""

from __future__ import annotations

import argparse
import contextlib
import json
import math
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest import mock

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from calibration_studies import MADE, SHAPED, Kept
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from mjchair.diagnosis import rules
from mjchair.diagnosis.explain import (
    alternatives,
    forward_selection,
    hypotheses,
    search_rules,
    selection,
)
from mjchair.diagnosis.explain import gap as gaps
from mjchair.diagnosis.explain.candidates import Start
from mjchair.diagnosis.explain.fits import Fits
from mjchair.diagnosis.explain.hypotheses import Hypothesis
from mjchair.diagnosis.explain.probability import (
    NONE,
    OUTSIDE,
    PRIOR_NONE,
    PRIOR_OUTSIDE,
    PRIOR_THREE,
    PRIOR_TWO,
    weights,
)
from mjchair.diagnosis.explain.screening import silent
from mjchair.diagnosis.fit import bounded
from mjchair.diagnosis.fit.bounded import Reduced
from mjchair.diagnosis.fit.column_ids import ParameterId
from mjchair.diagnosis.fit.process import KINDS
from mjchair.diagnosis.fit.system import System
from mjchair.effects.effect import step

Array = NDArray[np.float64]
SIGMAS = (1.5, 100.0)  # size of what is hidden, log-uniform
FAINT = rules.LEAST  # sigmas below which what is hidden counts as not there
FORM = (0.005, 0.04)  # relative error of a column's form, log-uniform
OTHER = 1.5  # sigmas, standard deviation of each unnamed difference of a chair
SENSORS, LEVELS, RUNS, COLOURS = 0.2, 0.4, 0.25, 0.5  # log standard deviations of the true noise
SLOW_HZ = 1.5  # below which a sensor's power is not estimated but assumed
PLANAR = 0.6  # share of the studies on planar bases whose data are all of that generator
LEAST = 1.0  # sigmas that a planar form shows at its first size, or it is left out
EXPLAINED = 0.8  # share of a strange force that one effect makes: more, and it is not strange
SHOWN = 80  # hypotheses that are kept, the best by evidence / 4
DRAWS = 200  # of the null of the gap test
BEHIND = 30.0  # chi2 by which a pair may be behind the best single effect


@dataclass(frozen=True)
class Truth:
    """What is hidden: keys of effects, or OUTSIDE; none where empty. sigmas: of each.

    What shows less than FAINT is not there: nobody could say so, and it changes no answer.
    """

    keys: tuple[str, ...]
    sigmas: tuple[float, ...]

    @property
    def name(self) -> str:
        """As a hypothesis is named."""
        seen = [k for k, s in zip(self.keys, self.sigmas, strict=True) if s >= FAINT]
        return "+".join(sorted(seen)) or NONE


class Bed:
    """A base study from which data are drawn.

    Attributes:
      kept: the columns. G: (windows, p, p), H: windows of (n, p), so that b is H' y. size: of the
        columns once nuisances are eliminated, (q, q).
    """

    def __init__(self, kept: Kept) -> None:
        """Take the windows that are fitted to."""
        self.kept = kept
        self.blocks = [kept.blocks[int(i)] for i in kept.fitted]
        self.factors = [cho_factor(b.Z.T @ b.Z + np.diag(b.precision)) for b in self.blocks]
        self.H, self.strange = [], []
        for b, factor in zip(self.blocks, self.factors, strict=True):
            off = cho_solve(factor, b.Z.T @ np.hstack([b.J, b.strange]))
            both = np.hstack([b.J, b.strange]) - b.Z @ off
            both[:, : b.J.shape[1]][:, kept.hidden] = 0.0
            self.H.append(both[:, : b.J.shape[1]])
            self.strange.append(both[:, b.J.shape[1] :])
        self.G = np.stack([b.J.T @ H for b, H in zip(self.blocks, self.H, strict=True)])
        self.G[:, kept.hidden, :] = 0.0
        self.G[:, :, kept.hidden] = 0.0
        self.run = np.array([b.run for b in self.blocks])
        nothing = [np.zeros(len(b.J)) for b in self.blocks]
        self.size = bounded.reduce(self.system(nothing), self.windows).G

    @property
    def windows(self) -> NDArray[np.int64]:
        """Indices of the windows."""
        return np.arange(len(self.blocks))

    def system(self, y: Sequence[Array]) -> System:
        """The linear system of white data (n,) a window."""
        left = [
            v - b.Z @ cho_solve(f, b.Z.T @ v)
            for v, b, f in zip(y, self.blocks, self.factors, strict=True)
        ]
        return System(
            columns=self.kept.columns,
            nuisance=self.kept.nuisance,
            G=self.G,
            b=np.stack([H.T @ v for H, v in zip(self.H, y, strict=True)]),
            c=np.array([float(v @ w) for v, w in zip(y, left, strict=True)]),
            run=self.run,
            back=np.zeros(self.kept.nuisance),
        )

    def strange_force(self, rng: np.random.Generator) -> list[Array] | None:
        """White columns (n,) a window, of one sigma, of a force that no effect makes."""
        count = self.blocks[0].strange.shape[1]
        for k in rng.permutation(count):
            raw = [b.strange[:, k] for b in self.blocks]
            seen = bounded.reduce(self.system(raw), self.windows)
            whole = seen.total
            if whole < 1e-12:
                continue
            best = max(hypotheses.weigh(seen, [s]).gain for s in self.kept.starts)
            if best < EXPLAINED * whole:
                return [v / math.sqrt(whole) for v in raw]
        return None

    def signal(self, start: Start, sigma: float, rng: np.random.Generator) -> Array | None:
        """Coefficients (p,) of an effect of this size; None: it cannot be, or does not show."""
        at = [self.kept.columns.index(c) for c in start.columns]
        c = rng.standard_normal(len(at))
        if start.effect.seeds is None and len(at) == len(start.free):
            sides = [start.effect.parameter(n) for n in start.free]
            c = np.where([p.neutral in (p.low, p.high) for p in sides], np.abs(c), c)
        if np.isfinite(start.least):
            c = np.maximum(np.abs(c), start.least)
        inner = [i - self.kept.nuisance for i in at]
        one = math.sqrt(max(float(c @ self.size[np.ix_(inner, inner)] @ c), 0.0))
        if one < 1e-6:
            return None
        out = np.zeros(len(self.kept.columns))
        out[at] = c * sigma / one
        out *= self.factor([b.J @ out for b in self.blocks], sigma)
        return None if _clipped(start, out[at]) else out

    def factor(self, y: Sequence[Array], sigma: float) -> float:
        """What white data (n,) a window must be multiplied by to show about so many sigmas.

        A nuisance on its wall takes no more of an effect, so that half of it is less than half.
        """
        by = 1.0
        for _ in range(12):
            whole = self.shown(y, by)
            if 0.9 * sigma < whole < 1.1 * sigma:
                break
            by *= sigma / max(whole, 1e-9)
        return by

    def shown(self, y: Sequence[Array], by: float) -> float:
        """Sigmas that white data show once the nuisances did their best within their walls."""
        system = self.system([by * v for v in y])
        return math.sqrt(max(bounded.reduce(system, self.windows).total, 0.0))


def _clipped(start: Start, coefficients: Array) -> bool:
    """Whether a size is on a bound."""
    values = start.combine(coefficients)
    return any(
        p.sized and p.fitted and values[p.name] in (p.low, p.high) and values[p.name] != p.neutral
        for p in start.effect.parameters
        if p.name in start.free
    )


def draw(bed: Bed, rng: np.random.Generator) -> tuple[Truth, list[Array]]:
    """What is hidden, and white data (n,) a window."""
    planar = bool(bed.kept.noises) and rng.random() < PLANAR
    truth, signal = _hidden(bed, rng, planar)
    if planar:  # its own forms, chair, floor and sensors
        noise = bed.kept.noises[rng.integers(len(bed.kept.noises))]
        return truth, [s + e for s, e in zip(signal, _fitted(bed, noise), strict=True)]
    form = math.exp(rng.uniform(*np.log(FORM)))
    signal = _misshapen(bed, signal, form, rng)
    if rng.random() < 0.5:
        for _ in range(rng.integers(1, 5)):
            more = _any_effect(bed, abs(OTHER * rng.standard_normal()), rng)[1]
            signal = [s + m for s, m in zip(signal, more, strict=True)]
    known = np.clip(0.8 * rng.standard_normal(bed.kept.nuisance), -2.0, 2.0)
    noise = _noise(bed, rng)
    return truth, [
        s + b.J[:, : known.size] @ known + e
        for s, b, e in zip(signal, bed.blocks, noise, strict=True)
    ]


def _fitted(bed: Bed, windows: Sequence[Array]) -> list[Array]:
    """The windows that are fitted to."""
    return [windows[int(i)] for i in bed.kept.fitted]


def _hidden(bed: Bed, rng: np.random.Generator, planar: bool) -> tuple[Truth, list[Array]]:
    nothing = [np.zeros(len(b.J)) for b in bed.blocks]
    kind = rng.random()
    sizes = np.exp(rng.uniform(*np.log(SIGMAS), size=3))
    if kind < PRIOR_NONE:
        return Truth((), ()), nothing
    if kind < PRIOR_NONE + PRIOR_OUTSIDE:
        force = _planar_signal(bed, OUTSIDE, 1.0, rng) if planar else bed.strange_force(rng)
        if force is not None:
            return Truth((OUTSIDE,), (sizes[0],)), [sizes[0] * f for f in force]
    count = 1 + int(kind > 1.0 - PRIOR_TWO - PRIOR_THREE) + int(kind > 1.0 - PRIOR_THREE)
    keys: list[str] = []
    while len(keys) < count:
        key, more = (_any_planar if planar else _any_effect)(bed, sizes[len(keys)], rng)
        if key not in keys:
            keys.append(key)
            nothing = [a + b for a, b in zip(nothing, more, strict=True)]
    return Truth(tuple(keys), tuple(sizes[:count])), nothing


def _any_planar(bed: Bed, sigma: float, rng: np.random.Generator) -> tuple[str, list[Array]]:
    """Name and white data of an effect as the planar generator makes it."""
    known = {s.effect.name: s.effect.common for s in bed.kept.starts}
    names = [n for n in bed.kept.signals if n in known]
    common = np.array([known[n] if rng.random() < 0.5 else 1.0 for n in names])
    while True:
        name = str(rng.choice(names, p=common / common.sum()))
        signal = _planar_signal(bed, name, sigma, rng)
        if signal is not None:
            return name, signal


def _planar_signal(
    bed: Bed, name: str, sigma: float, rng: np.random.Generator
) -> list[Array] | None:
    """White data of one of its forms; None: it does not show."""
    forms = bed.kept.signals[name]
    form = _fitted(bed, forms[rng.integers(len(forms))])
    if bed.shown(form, 1.0) < LEAST:
        return None
    by = bed.factor(form, sigma)
    return [by * v for v in form]


def _any_effect(bed: Bed, sigma: float, rng: np.random.Generator) -> tuple[str, list[Array]]:
    """Key and white data of an effect: half as often as it is common, half each name alike."""
    starts = bed.kept.starts
    keys = {s.effect.key: s.effect for s in starts}
    names = list(dict.fromkeys(e.name for e in keys.values()))
    while True:
        if rng.random() < 0.5:
            common = np.array([e.common for e in keys.values()])
            key = str(rng.choice(list(keys), p=common / common.sum()))
        else:
            name = rng.choice(names)
            key = str(rng.choice([k for k, e in keys.items() if e.name == name]))
        mine = [s for s in starts if s.effect.key == key]
        coefficients = bed.signal(mine[rng.integers(len(mine))], sigma, rng)
        if coefficients is not None:
            return key, [b.J @ coefficients for b in bed.blocks]


def _misshapen(bed: Bed, signal: list[Array], form: float, rng: np.random.Generator) -> list[Array]:
    """A signal of a form that is a little other: gains, sizes in windows, a smooth force."""
    size = math.sqrt(sum(float(s @ s) for s in signal))
    if size == 0.0:
        return signal
    channels = 1 + max(int(b.channel.max()) for b in bed.blocks)
    gains = 1.0 + form * rng.standard_normal(channels)
    forces = [_coloured(b, {f: (1.0, 0.4) for f in b.pulses}, rng) for b in bed.blocks]
    whole = math.sqrt(sum(float(f @ f) for f in forces))
    return [
        s * gains[b.channel] * (1.0 + form * rng.standard_normal()) + form * size / whole * f
        for s, b, f in zip(signal, bed.blocks, forces, strict=True)
    ]


def _coloured(block: Any, parts: dict, rng: np.random.Generator) -> Array:
    """White answers (n,) to forces of (level, correlation time) each."""
    out = np.zeros(len(block.J))
    for force, (level, time) in parts.items():
        at, answers = block.pulses[force]
        cover = np.exp(-np.abs(at[:, None] - at[None, :]) / time) + 1e-9 * np.eye(at.size)
        out += level * answers @ np.linalg.cholesky(cover) @ rng.standard_normal(at.size)
    return out


def _noise(bed: Bed, rng: np.random.Generator) -> list[Array]:
    """White noise that is a little louder or quieter, and of other colours, than is assumed."""
    channels = 1 + max(int(b.channel.max()) for b in bed.blocks)
    sensor = np.exp(SENSORS * rng.standard_normal((2, channels)))
    runs = len(bed.kept.manoeuvres)
    out = []
    levels = {
        p: bed.kept.levels[str(p)]
        * np.exp(LEVELS * rng.standard_normal())
        * np.exp(RUNS * rng.standard_normal(runs))
        for p in KINDS
    }
    times = {
        p: kind.time * math.exp(COLOURS * rng.standard_normal())
        for p, kind in KINDS.items()
        if p not in SHAPED
    }
    for b in bed.blocks:
        e = sensor[0][b.channel] * rng.standard_normal(len(b.J))
        e = np.where(b.frequency < SLOW_HZ, e * sensor[1][b.channel], e)
        for p, time in times.items():
            e += _coloured(b, {KINDS[p].force: (float(levels[p][b.run]), time)}, rng)
        for p, columns in b.shaped.items():
            e += levels[p][b.run] * columns @ rng.standard_normal(columns.shape[1])
        out.append(e)
    return out


class LinearFits(Fits):
    """The diagnosis' fits, made by the linear system."""

    def _from_starts(self, hypothesis: Hypothesis, best: Any) -> Any:
        """The linear fit: from any start it ends in the same place."""
        return _fit(self.base, hypothesis)

    def screen_anew(self, fitted: Any) -> bool:
        """False: the columns are the same around every fit."""
        return False

    def in_states_of(self, tried: Any, other: Any) -> Any:
        """The fit: no window has states."""
        return tried

    def near_to(self, tried: Any) -> Any:
        """Nothing else to weigh by: a linear system is the same around any chair."""
        return contextlib.nullcontext()

    def begin_at(self, fewer: Hypothesis, more: Any) -> None:
        """Nothing: a linear fit is the same from wherever it begins."""

    def with_least_sizes(self, tried: Any) -> Any:
        """The fit itself: of a linear system every size is told."""
        return tried

    def anew(self, tried: Any) -> Any:
        """The fit itself: a linear system is the same around any chair."""
        return tried.fitted

    def last_fit(self, tried: Any) -> Any:
        """The fit itself: a linear one ends in the same place from wherever it begins."""
        return tried.fitted

    def gap_after(self, fitted: Any) -> Any:
        """The gap test with the effects of a fit put in."""
        system, bench = self.base.system, self.base.bench
        put = system.index(fitted.columns)
        rest = [i for i in range(system.nuisance, len(system.columns)) if i not in set(put)]
        use = [*range(system.nuisance), *put, *rest]
        count = system.nuisance + len(put)
        inner = System(
            columns=[system.columns[i] for i in use],
            nuisance=count,
            free=len(put),
            G=system.G[:, use][:, :, use],
            b=system.b[:, use],
            c=system.c,
            run=system.run,
            back=np.r_[system.back, np.zeros(len(put))],
        )
        keys = [t.effect.key for t in fitted.variant.terms]
        return gaps.test_gap(bench, inner, bench.windows, keys)


def _fit(base: Any, hypothesis: Hypothesis) -> Any:
    """What a fit of this hypothesis is, by linear algebra."""
    system, windows = base.system, base.bench.windows
    at = system.index(hypothesis.columns)
    step_, total = bounded.solve(system, windows, at)
    use = [*range(system.nuisance), *at]
    inner = System(
        columns=[system.columns[i] for i in use],
        nuisance=system.nuisance,
        G=system.G[np.ix_(windows, use, use)],
        b=system.b[np.ix_(windows, use)],
        c=system.c,
        run=system.run,
        back=system.back,
    )
    covariance = bounded.covariance(inner, windows)
    sigmas, std, stuck, terms = {}, {}, [], []
    place = system.nuisance
    for start in hypothesis.starts:
        own = list(range(place, place + len(start.columns)))
        place += len(start.columns)
        c, cover = step_[at][np.array(own) - system.nuisance], covariance[np.ix_(own, own)]
        sigmas[start.effect.key] = float(np.sqrt(max(c @ np.linalg.solve(cover, c), 0.0)))
        terms.append(start.term(c))
        plain = start.effect.seeds is None and len(own) == len(start.free)
        for k, name in enumerate(start.free):
            p = start.effect.parameter(name)
            error = math.sqrt(max(cover[k, k], 0.0)) * abs(step(p)) if plain else 0.0
            std[ParameterId(start.effect.key, name)] = error
        if _clipped(start, c):
            stuck.append(ParameterId(start.effect.key, start.free[0]))
    return SimpleNamespace(
        variant=SimpleNamespace(terms=tuple(terms), offsets={}),
        system=inner,
        total=total,
        confined=0.0,
        promised=total,
        chi2=np.array([bounded.chi2(system, int(i), step_) for i in windows]),
        std=std,
        sigmas=sigmas,
        at_bound=tuple(stuck),
        at_least={},
        columns=hypothesis.columns,
    )


def base_of(bed: Bed, y: Sequence[Array]) -> Any:
    """What stands for a screened study."""
    system = bed.system(y)
    runs = [SimpleNamespace(manoeuvre=m, hold_out=False) for m in bed.kept.manoeuvres]
    simulator = SimpleNamespace(study=SimpleNamespace(runs=runs), stepped=0)
    bench = SimpleNamespace(windows=bed.windows, simulator=simulator)
    reduced = bounded.reduce(system, bed.windows)
    nothing = np.zeros(len(system.columns))
    step_ = bounded.solve(system, bed.windows, [])[0] if bed.kept.nuisance else nothing
    plain = SimpleNamespace(
        total=reduced.total,
        confined=0.0,
        chi2=np.array([bounded.chi2(system, int(i), step_) for i in bed.windows]),
        system=system,
        columns=[],
        variant=SimpleNamespace(terms=(), offsets={}),
    )
    return SimpleNamespace(
        bench=bench,
        plain=plain,
        reduced=reduced,
        system=system,
        starts=bed.kept.starts,
        found=None,
        best=None,
        anew={},
        patience=1.0,
    )


class Weighing:
    """`hypotheses.weigh` that remembers, and leaves out pairs and triples that cannot come near.

    With walls that hold no nuisance the gain of columns is largest; where even that score is BEHIND
    the best single effect's, the exact one is not needed.
    """

    def __init__(self) -> None:
        """Nothing is known yet."""
        self.exact = hypotheses.weigh
        self.known: dict[tuple[int, tuple[int, ...]], Hypothesis] = {}
        self.best: dict[int, float] = {}

    def __call__(self, reduced: Reduced, starts: Sequence[Start]) -> Hypothesis:
        """As `hypotheses.weigh`."""
        key = (id(reduced), tuple(id(s) for s in starts))
        if key not in self.known:
            if len(starts) > 1 and self._far(reduced, starts):
                self.known[key] = Hypothesis(tuple(starts), 0.0, -np.inf)
            else:
                self.known[key] = self.exact(reduced, starts)
            if len(starts) == 1:
                score = self.known[key].score
                self.best[id(reduced)] = max(score, self.best.get(id(reduced), -np.inf))
        return self.known[key]

    def _far(self, reduced: Reduced, starts: Sequence[Start]) -> bool:
        w = reduced.index([c for s in starts for c in s.columns])
        free = reduced.sums.eliminated(())
        block, right = free.G[np.ix_(w, w)], free.b[w]
        scale = np.sqrt(np.maximum(np.diag(block), 1e-12))
        unit = block / np.outer(scale, scale) + 1e-8 * np.eye(len(w))
        gain = (
            reduced.total
            - free.total
            + float(right @ (np.linalg.solve(unit, right / scale) / scale))
        )
        penalty = search_rules.PENALTY * sum(len(s.free) for s in starts)
        prior = 2.0 * sum(math.log(s.effect.common) for s in starts)
        return gain - penalty + prior < self.best.get(id(reduced), -np.inf) - BEHIND


@contextlib.contextmanager
def linear() -> Iterator[None]:
    """The selection with linear algebra in place of simulations."""
    with (
        # a linear system neither slides nor shimmies, and goes another way nowhere
        mock.patch.object(alternatives, "or_whole", lambda _fits, here: here),
        mock.patch.object(alternatives, "or_whole_beside", lambda _fits, here: here),
        mock.patch.object(alternatives, "or_by_most_windows", lambda _fits, here: here),
        # what happened once is sought with pulses, and what is drawn acts in every run
        mock.patch.object(forward_selection, "_happened_once", lambda *_: False),
        mock.patch.object(selection, "confirmed", lambda _base, _fitted, gap: gap),
        mock.patch.object(gaps, "DRAWS", DRAWS),
        mock.patch.object(gaps, "_cell_tests", lambda *_: []),
        mock.patch.object(hypotheses, "weigh", Weighing()),
    ):
        yield


def diagnosed(bed: Bed, y: Sequence[Array]) -> dict[str, Any]:
    """What the diagnosis' own selection and weights say of drawn data."""
    base = base_of(bed, y)
    gap = gaps.test_gap(base.bench, base.system, base.bench.windows)
    choice = selection.choose(LinearFits(base, silent)) if gap.exists else None
    found = weights(base, choice)
    first = sorted(found, key=lambda n: -(found[n].prior + found[n].evidence / 4.0))[:SHOWN]
    name = "+".join(choice.hypothesis.keys) if choice is not None else ""
    shown = {*first, NONE, OUTSIDE, name}
    line: dict[str, Any] = {
        "gap": gap.exists,
        "chosen": name,
        "weights": {
            n: [round(w.prior, 4), round(w.evidence, 4), w.fitted]
            for n, w in found.items()
            if n in shown
        },
    }
    if choice is not None:
        line |= {
            "gap_left": choice.after.exists,
            "rivals": sum(len(group) for group in choice.rivals),
        }
    return line


def main() -> None:
    """Draw from every base study in the folder."""
    import cloudpickle  # whoever only draws needs none

    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("out", type=Path)
    parser.add_argument("--count", type=int, default=500)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", nargs="*")
    args = parser.parse_args()
    path = args.out / "draws.jsonl"
    lines = path.read_text().splitlines() if path.exists() else []
    have = [(r["study"], r["seed"], r["number"]) for r in map(json.loads, lines)]
    for file in (args.out / f"{made.name}.pkl" for made in MADE if made.drawn):
        if args.only and file.stem not in args.only:
            continue
        with file.open("rb") as source:
            bed = Bed(cloudpickle.load(source))
        done = {n for s, d, n in have if s == file.stem and d == args.seed}
        for number in range(args.count):
            if number in done:
                continue
            seed = [args.seed, number, *file.stem.encode()]
            truth, y = draw(bed, np.random.default_rng(seed))
            with linear():
                said = diagnosed(bed, y)
            line = {"study": file.stem, "seed": args.seed, "number": number,
                    "truth": truth.name, "sizes": truth.sigmas, **said}  # fmt: skip
            with path.open("a") as out:
                out.write(json.dumps(line) + "\n")
        print(file.stem, args.count, flush=True)


if __name__ == "__main__":
    main()
