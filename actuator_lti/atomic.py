"""Files that are either whole or not there: written beside their place, then moved onto it."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import BinaryIO

from actuator_lti.errors import InputError

_PART = ".part"


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Write text as UTF-8 with the line ends given; the old content stays until the new one is on disk.

    Raises
    ------
    InputError
        If the folder cannot be made or written.
    """
    write_bytes(path, text.encode("utf-8"))


def write_bytes(path: str | os.PathLike[str], data: bytes) -> None:
    """Write bytes; see `write_text`."""
    write_together({path: data})


def write_stream(path: str | os.PathLike[str], write: Callable[[BinaryIO], None]) -> None:
    """Let ``write`` fill a file that need not fit in memory; see `write_text`."""
    _write_all({path: write})


def write_together(files: Mapping[str | os.PathLike[str], bytes]) -> None:
    """Write several files: none is moved into place before all are on disk.

    Parameters
    ----------
    files : mapping of path to bytes
        Missing folders are made.

    Raises
    ------
    InputError
        If a folder cannot be made or written; nothing is left behind then.
    """
    _write_all({path: partial(_put, data) for path, data in files.items()})


def _put(data: bytes, file: BinaryIO) -> None:
    file.write(data)


def _write_all(files: Mapping[str | os.PathLike[str], Callable[[BinaryIO], object]]) -> None:
    """Fill every file beside its place, then move all into place."""
    staged: list[tuple[Path, Path]] = []
    try:
        for name, write in files.items():
            path = Path(name)
            staged.append((_stage(path, write), path))
        while staged:
            temporary, path = staged[0]
            os.replace(temporary, path)
            staged.pop(0)
    except OSError as error:
        named = str(error.filename or "")
        where = str(path) if named.endswith(_PART) else named
        raise InputError(f"cannot write: {error.strerror or error}", where=where) from error
    finally:
        for temporary, _ in staged:
            with suppress(OSError):
                temporary.unlink(missing_ok=True)


def _stage(path: Path, write: Callable[[BinaryIO], object]) -> Path:
    """Fill a file beside its place, flushed to disk, and give the temporary path."""
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(prefix=".", suffix=_PART, dir=path.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            write(file)
            file.flush()
            os.fsync(file.fileno())
        os.chmod(name, 0o666 & ~_umask())
    except BaseException:
        with suppress(OSError):
            os.unlink(name)
        raise
    return Path(name)


def _umask() -> int:
    """Give the mask that new files of this process get."""
    mask = os.umask(0o022)
    os.umask(mask)
    return mask
