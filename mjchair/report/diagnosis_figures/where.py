"""The map of what is left: channels over time, before and after the correction.

In: a diagnosis. Out: a figure in which a colour is the residual over the noise, on a scale by
factors, so that a gap of 250 times the noise is as legible as one of 2.
"""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm
from numpy.typing import NDArray

from mjchair.diagnosis.result import Diagnosis, TrialGap, WindowGaps
from mjchair.report.colours import SIZES
from mjchair.report.diagnosis_figures.factor_axis import write_factors
from mjchair.report.figure import Figure

Array = NDArray[np.float64]

LEAST = 4.0  # the scale reaches from the noise to this at least
TICKS = 12  # of time, at most
LETTERS = 26  # of a trial's name
CROWD = 26  # trials beyond which not every name is written
LINE = 80  # letters in a row of names above the map; more stand upright
TALL = 0.075  # inches, of a letter that stands upright
STEPS = (0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 60.0, 120.0, 300.0, 600.0, 1800.0, 3600.0)  # s


def figure(diagnosis: Diagnosis) -> Figure | None:
    """Residual over noise, channel by time, of the chair as it was and as it is corrected."""
    if diagnosis.evidence is None:
        return None
    gaps = diagnosis.evidence.windows
    parts = [("the chair as it was", gaps.before)]
    if gaps.after is not None and diagnosis.effects:
        parts.append(("the corrected chair", gaps.after))
    high = max(LEAST, *(float(np.nanmax(part, initial=LEAST)) for _, part in parts))
    norm = LogNorm(1.0, high)
    names = _trial_names(diagnosis.evidence.trials, sorted(set(gaps.trials.tolist())))
    upright = len(names) * max(map(len, names)) > LINE
    above = TALL * max(map(len, names)) if upright else 0.2
    height = len(parts) * max(0.24 * len(gaps.channels) + 0.8, 1.5) + above + 0.5
    drawn = Figure(figsize=(9.4, height), layout="constrained")
    axes = drawn.subplots(len(parts), 1, sharex=True, squeeze=False)[:, 0]
    begins = _begins(gaps)
    for ax, (name, part) in zip(axes, parts, strict=True):
        _map(ax, gaps, part, begins, norm)
        ax.set_title(name, loc="left", fontsize=10)
    _write_names(axes[0], gaps, names, begins, upright)
    axes[-1].set_xlabel("time within the trial (s)")
    scale = drawn.colorbar(ScalarMappable(norm, SIZES), ax=list(axes), extend="min", pad=0.02)
    scale.set_label("rms over noise (1)")
    write_factors(scale.ax.yaxis, 1.0, high)
    return drawn


def caption(diagnosis: Diagnosis) -> str:
    """What the figure shows."""
    highest = diagnosis.evidence.windows.highest if diagnosis.evidence else 0.0
    return (
        f"Rms of the residual below {highest:g} Hz over the noise of the channel. The lightest "
        "colour is what noise gives; where a channel has no data there is no colour."
    )


def _begins(gaps: WindowGaps) -> dict[int, float]:
    """Where each trial begins on the common axis, less its own first time, s."""
    begins, end = {}, 0.0
    for trial in sorted(set(gaps.trials.tolist())):
        times = gaps.times[gaps.trials == trial]
        begins[trial] = end - float(times.min())
        end += float(times.max() - times.min())
    return begins


def _map(ax: Axes, gaps: WindowGaps, part: Array, begins: dict[int, float], norm: LogNorm) -> None:
    """The coloured cells of every trial, with times below."""
    rows = np.arange(len(gaps.channels) + 1) - 0.5
    for trial, begin in begins.items():
        which = np.flatnonzero(gaps.trials == trial)
        times = gaps.times[which]
        edges = begin + np.append(times[:, 0], times[-1, 1])
        ax.pcolormesh(edges, rows, part[:, which], norm=norm, cmap=SIZES)
        ax.axvline(edges[-1], color="white", lw=3.0)
    ax.set_yticks(range(len(gaps.channels)), gaps.channels, fontsize=8)
    ax.invert_yaxis()
    _time_ticks(ax, gaps, begins)


def _time_ticks(ax: Axes, gaps: WindowGaps, begins: dict[int, float]) -> None:
    """Round times of every trial, none so near to another that they would touch."""
    ends = {t: begins[t] + float(gaps.times[gaps.trials == t].max()) for t in begins}
    step = next((s for s in STEPS if max(ends.values()) / s <= TICKS), STEPS[-1])
    ticks: list[tuple[float, str]] = []
    for trial, begin in begins.items():
        first = float(gaps.times[gaps.trials == trial].min())
        for time in np.arange(np.ceil(first / step - 1e-6) * step, ends[trial] - begin, step):
            if not ticks or begin + time - ticks[-1][0] > 0.75 * step:
                ticks.append((begin + float(time), f"{time + 0.0:g}"))
    ax.set_xticks([at for at, _ in ticks], [text for _, text in ticks], fontsize=8)


def _trial_names(trials: tuple[TrialGap, ...], shown: list[int]) -> list[str]:
    """Names that are not too long, and whether a trial is held out."""
    out = []
    for k in shown:
        name = trials[k].trial
        short = name if len(name) <= LETTERS else name[: LETTERS - 1] + "…"
        out.append(short + (", held out" if trials[k].held_out else ""))
    return out


def _write_names(
    ax: Axes, gaps: WindowGaps, names: list[str], begins: dict[int, float], upright: bool
) -> None:
    """The name of each trial above its beginning; of a crowd not every one."""
    every = -(-len(names) // CROWD)
    at = [begin + float(gaps.times[gaps.trials == t].min()) for t, begin in begins.items()]
    above = ax.secondary_xaxis("top")
    above.set_xticks(
        at[::every],
        names[::every],
        rotation=90 if upright else 0,
        ha="left",
        fontsize=8,
    )
    above.tick_params(length=0)
