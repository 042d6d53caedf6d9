"""Numba's cache, keyed by every source file that the compiled code is made of.

Numba looks only at the file of the function it caches. The law is spread over several, so the
functions that are compiled hold this fingerprint in a closure, which is part of Numba's key.
"""

from __future__ import annotations

import functools
import hashlib
from pathlib import Path


@functools.cache
def fingerprint(*folders: str) -> str:
    """Digest of the sources below `folders` of the package (tire and engine by default)."""
    package = Path(__file__).parents[1]
    digest = hashlib.sha256()
    for folder in folders or ("tire", "engine"):
        for path in sorted((package / folder).rglob("*.py")):
            digest.update(path.read_bytes())
    return digest.hexdigest()
