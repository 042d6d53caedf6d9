"""Compile the tires for this machine, so that no first run waits for them.

In: nothing. Out: Numba's cache on disk beside the package; nothing happens where it is filled.

    python scripts/compile_tires.py
"""

from mjchair.engine import native
from mjchair.model.spec import read_tire

native.callbacks()
native.field_contact()
native.rider_sensor()
read_tire("wheelchair").forces(200.0, 0.0, 0.1)
