"""What every stage of a diagnosis works with: the simulator, the noise, what is roughly known.

In: columns around a track. Out: the linear system of a variant of the chair.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mjchair.diagnosis.data.roughly_known import Nuisance
from mjchair.diagnosis.fit import bounded, shaken
from mjchair.diagnosis.fit.column_ids import ColumnId
from mjchair.diagnosis.fit.process import Process
from mjchair.diagnosis.fit.system import System, build
from mjchair.diagnosis.fit.variant import Variant
from mjchair.diagnosis.fit.whitening import Whitener
from mjchair.diagnosis.replay.derivatives import Column
from mjchair.diagnosis.replay.noise import Noise
from mjchair.diagnosis.replay.simulator import WindowSimulator
from mjchair.diagnosis.replay.window_states import Track


@dataclass
class Bench:
    """What every stage works with.

    Attributes:
      simulator: of the windows. noise: of the channels. nuisances: of the study.
      process: what shakes the chair in the windows; None: nothing.
      tipped: windows in which the chair tips unseen, with its largest lean there, rad.
    """

    simulator: WindowSimulator
    noise: dict[str, Noise]
    nuisances: tuple[Nuisance, ...]
    process: Process | None = None
    tipped: Mapping[int, float] = field(default_factory=dict)
    _shaken: tuple[Track, Column] | None = field(default=None, init=False, repr=False)

    @cached_property
    def whitener(self) -> Whitener:
        """Of the noise."""
        return Whitener(self.simulator, self.noise)

    @cached_property
    def windows(self) -> NDArray[np.int64]:
        """Indices of the windows that may be fitted to."""
        return self.windows_of(self.simulator.study.fitted)

    def windows_of(self, runs: Collection[int]) -> NDArray[np.int64]:
        """Indices of the windows of some runs: those that tip only where all do."""
        every = [i for i, w in enumerate(self.simulator.windows) if w.run in runs]
        return np.array([i for i in every if i not in self.tipped] or every, int)

    def shaken(self, track: Track) -> Column:
        """What shakes the chair of a track, as every channel would show it by what others tell.

        See `shaken.told_by_others`. That of the last track is kept.
        """
        if self._shaken is None or self._shaken[0] is not track:
            self._shaken = track, self._told_by_others(track)
        return self._shaken[1]

    def _told_by_others(self, track: Track) -> Column:
        if self.process is None:
            return [np.zeros_like(y) for y in track.predicted]
        return [
            shaken.told_by_others(self.simulator, track, self.whitener, self.process, i)
            for i in range(len(self.simulator.windows))
        ]

    def _shown(self, track: Track, variant: Variant) -> Column:
        """What the channels show of a variant, (rows, channels) a window.

        A gain of a sensor is also one of what shakes the chair, as far as the other channels tell.
        """
        gains = variant.sensor_errors(self.simulator.channels).scale
        if not gains:
            return track.predicted
        by = np.array([gains.get(c, 0.0) for c in self.simulator.channels])
        return [y + by * s for y, s in zip(track.predicted, self.shaken(track), strict=True)]

    def system(
        self,
        track: Track,
        columns: Mapping[ColumnId, Column],
        nuisance: int,
        variant: Variant,
        free: int = 0,
        only: Collection[int] | None = None,
    ) -> System:
        """The linear system around a track of a variant; see `system.build`.

        One of some windows `only` has no cells.
        """
        system = build(
            self.simulator,
            track,
            self.whitener,
            columns,
            nuisance=nuisance,
            offsets=variant.offsets,
            free=free,
            process=self.process,
            only=only,
            shown=self._shown(track, variant),
        )
        if only is None:
            system.set_cells(bounded.solve(system, self.windows, [])[0][:nuisance])
        return system
