"""Write a matplotlib figure to a file.

In: a figure and a path. Out: a picture file that is written whole or not at all.
"""

from __future__ import annotations

import os
from pathlib import Path

from matplotlib.figure import Figure

from mjchair.errors import MjchairError
from mjchair.storage import atomic_file

# Metadata that matplotlib would write, such as its version, are left out, so that equal pictures
# give equal files.
SAME_BYTES = {".png": {"Software": None}, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}


def save(figure: Figure, path: str | os.PathLike[str], dpi: int = 130) -> None:
    """Write a figure.

    Args:
      figure: what to write. path: its suffix says the format. dpi: dots per inch.

    Raises:
      MjchairError: a folder that cannot be written, or a suffix that matplotlib does not know.
    """
    suffix = Path(path).suffix
    known = figure.canvas.get_supported_filetypes()
    if suffix.lstrip(".") not in known:
        raise MjchairError(f"{path}: a figure ends in one of {', '.join(sorted(known))}")
    with atomic_file(path) as temporary:
        figure.savefig(temporary, dpi=dpi, metadata=SAME_BYTES.get(suffix))
