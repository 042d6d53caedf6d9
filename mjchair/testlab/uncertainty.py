"""Chairs drawn at random around a stated one, within the uncertainty of masses and tires.

In: a design and a number of draws. Out: designs with a `Draw` each, from uniform ranges whose
sources are stated. The same seed gives the same draws.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mjchair.errors import MjchairError
from mjchair.testlab.design import Design, Draw

# half widths and ends of the uniform ranges
RANGES = {
    # a chair of 15 kg on a bathroom scale, and its dummy: assumption
    "mass": (0.95, 1.05),
    # uncertainty of a centre of mass that was not measured on scales: assumption
    "forward": (-0.02, 0.02),
    "up": (-0.02, 0.02),
    # whole chairs roll at 0.006 to 0.02 (coast-down 0.0070, treadmill 0.0106); here 0.010
    "rolling": (0.7, 1.5),
    # rubber on dry smooth floors, 0.65 to 0.95 about 0.8: assumption
    "friction": (0.8, 1.2),
    # 0.15 to 0.35 of the load per degree (Dressel 2013) about 0.209
    "stiffness": (0.72, 1.67),
}
MOST = 1000


def draws(design: Design, count: int, seed: int = 0) -> tuple[Design, ...]:
    """Designs drawn around one.

    Raises:
      MjchairError: a count that is negative, 1 or above MOST.
    """
    if count == 0:
        return ()
    if not 2 <= count <= MOST:
        raise MjchairError(f"--uncertainty is {count}; it must be 0, or 2 to {MOST} draws")
    random = np.random.default_rng(seed)
    designs = []
    for _ in range(count):
        numbers = {name: float(random.uniform(*span)) for name, span in RANGES.items()}
        designs.append(replace(design, draw=Draw(**numbers)))
    return tuple(designs)
