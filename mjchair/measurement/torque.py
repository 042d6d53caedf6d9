"""Whether torques can be in the unit that they are taken for.

In: torques by name, taken for N m. Out: nothing, or one line that names the unit that they look
like.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from mjchair.errors import MjchairError

Array = NDArray[np.float64]

TORQUE = 500.0  # N m, the most that a hand or a motor gives


def check_torques(controls: Mapping[str, Array], source: str) -> None:
    """Refuse torques that are most likely in N mm.

    Args:
      controls: name -> (n,), N m, NaN where a sample is missing. source: the run, for the line.

    Raises:
      MjchairError: one that is beyond TORQUE in more than a twentieth of its samples.
    """
    for name, values in controls.items():
        size = float(np.nanpercentile(np.abs(values), 95.0))
        if size > TORQUE:
            raise MjchairError(
                f"{source}: {name} looks like N mm: it reaches {size:.4g}, and neither hand nor "
                f"motor passes {TORQUE:g} N m; give N m, or the unit in its header, as in "
                f"{name} [N mm] or {name} [N cm]"
            )
