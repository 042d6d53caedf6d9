"""A fingerprint of the source files of compiled code, which keeps Numba's cache up to date.

In: names of source files. Out: a digest of their contents.

For its cache Numba looks only at the file of the function that it compiles. The law is spread over
several files, so a compiled function holds this fingerprint in its closure, and the closure is part
of Numba's key.
"""

from __future__ import annotations

import functools
import hashlib
from pathlib import Path

# the files that compiled code is made of, below the package
TIRE = tuple(f"tire/{n}" for n in ("block.py", "families.py", "formula", "law.py", "transient.py"))
DRIVE = ("drive/block.py", "drive/law.py")
ENGINE = (
    "engine/bias_force.py",
    "engine/contact.py",
    "engine/drivetrain.py",
    "engine/element.py",
    "engine/field.py",
    "engine/mass_centre.py",
    "engine/native.py",
    "engine/views.py",
    "engine/wheel.py",
    "rider/bias_sensor.py",
)


@functools.cache
def fingerprint(*sources: str) -> str:
    """Digest of source files, and of folders of them, below the package; "": of all of it."""
    package = Path(__file__).parents[1]
    digest = hashlib.sha256()
    for name in sources:
        given = package / name
        for path in sorted(given.rglob("*.py")) if given.is_dir() else [given]:
            digest.update(path.read_bytes())
    return digest.hexdigest()
