"""Files are written whole or not at all, beside their place first; and read within a bound.

In: a path and contents, or a folder to write into. Out: the file, whole; or one line on why not.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from filelock import FileLock, Timeout

from mjchair.errors import MjchairError


@contextmanager
def atomic_file(path: str | os.PathLike[str]) -> Iterator[Path]:
    """A temporary path beside `path`, renamed to it when the block ends without an exception.

    The temporary file keeps the suffix of `path`, since writers choose the format by it.

    Raises:
      MjchairError: the folder of `path` does not exist or cannot be written.
    """
    target = Path(path)
    try:
        handle, name = tempfile.mkstemp(
            dir=target.parent, prefix=f".{target.stem}-", suffix=target.suffix
        )
    except OSError as error:
        raise MjchairError(
            f"cannot write {target}: {error.strerror}; give a writable folder"
        ) from None
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        umask = os.umask(0)
        os.umask(umask)
        temporary.chmod(0o666 & ~umask)
        temporary.replace(target)
    finally:
        temporary.unlink(missing_ok=True)


def write_whole(path: str | os.PathLike[str], content: str | bytes) -> None:
    """Write `content` to `path`, whole or not at all; see `atomic_file` for what it raises."""
    with atomic_file(path) as temporary:
        if isinstance(content, str):
            temporary.write_text(content, encoding="utf-8")
        else:
            temporary.write_bytes(content)


def check_new(path: str | os.PathLike[str], force: bool = False) -> Path:
    """The file that a command may write; nothing is made yet.

    Args:
      path: the file.
      force: allow a file that is there already.

    Raises:
      MjchairError: the path is a folder, or a file that is there while `force` is false, or a place
        where nothing can be made.
    """
    file = Path(path)
    if file.is_dir():
        raise MjchairError(f"{file} is a folder; give the name of a file, as {file / 'result'}")
    if file.exists() and not force:
        raise MjchairError(f"{file} is there already; choose another name, or give --force")
    _check_place(file)
    return file


def make_place(file: Path) -> None:
    """Make the folder of a file that a command writes, with its parents.

    Raises:
      MjchairError: it cannot be made.
    """
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise MjchairError(f"cannot make {file.parent}: {error.strerror}") from None


def _check_place(path: Path) -> None:
    """Raise MjchairError where neither a path nor the folders above it can be made."""
    above = next(folder for folder in path.absolute().parents if folder.exists())
    if not above.is_dir():
        raise MjchairError(f"cannot write {path}: {above} is a file, and must be a folder")
    if not os.access(above, os.W_OK | os.X_OK):
        raise MjchairError(f"cannot write {path}: {above} may not be written; give another folder")


def check_vacant(path: str | os.PathLike[str], force: bool = False) -> Path:
    """The folder that a command may write into; nothing is made yet.

    Args:
      path: the folder.
      force: allow a folder that already holds files.

    Raises:
      MjchairError: the path is a file, or the folder holds files and `force` is false, or it is in
        a place where nothing can be made.
    """
    folder = Path(path)
    if folder.exists() and not folder.is_dir():
        raise MjchairError(f"{folder} is a file; --out takes a folder")
    if folder.is_dir() and any(folder.iterdir()) and not force:
        raise MjchairError(
            f"{folder} is not empty; choose another --out, or overwrite with --force"
        )
    if not folder.is_dir():
        _check_place(folder)
    return folder


def output_folder(path: str | os.PathLike[str], force: bool = False) -> Path:
    """Make the folder that a command writes into, with its parents.

    Raises:
      MjchairError: as check_vacant does, or it cannot be made.
    """
    folder = check_vacant(path, force)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise MjchairError(f"cannot make {folder}: {error.strerror}") from None
    return folder


@contextmanager
def only_writer(folder: Path) -> Iterator[None]:
    """Within the block no other process that asks for this may write into the folder.

    The operating system ends the lock with the process, however it ends.

    Args:
      folder: made where it is not there; the file `lock` in it is the lock.

    Raises:
      MjchairError: another process writes into it.
    """
    folder.mkdir(parents=True, exist_ok=True)
    try:
        lock = FileLock(folder / "lock", timeout=0).acquire()
    except Timeout:
        raise MjchairError(
            f"another mjchair writes into {folder.parent}; wait until it ends, or choose another "
            "--out"
        ) from None
    with lock:
        yield


def read_bounded(path: Path, largest: int, kind: str, reason: str) -> bytes:
    """What is in a file, if that is no more than `largest` bytes.

    Args:
      kind: what is wanted, as "a tire file". reason: the end of the line about a larger one.

    Raises:
      MjchairError: it cannot be read, or is larger.
    """
    try:
        with path.open("rb") as stream:
            data = stream.read(largest + 1)
    except OSError as error:
        raise MjchairError(f"cannot read {path}: {error.strerror}; give {kind}") from None
    if len(data) > largest:
        raise MjchairError(f"{path}: more than {reason}")
    return data
