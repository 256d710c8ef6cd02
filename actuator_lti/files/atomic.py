"""Files that are either whole or not there: written beside their place, then moved onto it.

A symbolic link is followed: what it points to is replaced, the link stays. Devices and pipes, such as
``/dev/stdout``, are written to, never replaced; nothing else is taken for a file.
"""

import os
import re
import secrets
import shutil
import stat
import sys
import tempfile
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from operator import methodcaller
from pathlib import Path
from typing import BinaryIO, TypeVar

from actuator_lti.errors import InputError
from actuator_lti.files.reading import AnyPath, reason

Name = TypeVar("Name", bound=AnyPath)
_PART = ".part"
_NO_FILE = "is no file; allowed: a file, a pipe or a character device"
_STANDARD = ("stdin", "stdout", "stderr")
_OPEN_FILE = re.compile(r"/(?:(?:dev|proc/self)/fd/(\d{1,6})|dev/(stdin|stdout|stderr))\Z")


def write_text(path: AnyPath, text: str) -> None:
    """Write UTF-8 with the line ends given, whole or not at all; an InputError where it cannot be written."""
    write_bytes(path, text.encode("utf-8"))


def write_bytes(path: AnyPath, data: bytes) -> None:
    write_together({path: data})


def write_stream(path: AnyPath, write: Callable[[BinaryIO], None]) -> None:
    """Let ``write`` fill a file that need not fit in memory; see `write_text`."""
    _write_all([(path, write)])


def write_together(files: Mapping[Name, bytes] | Iterable[tuple[Name, bytes]]) -> None:
    """Write several files: none is moved into place before all are on disk; missing folders are made.

    Pairs are taken one by one: many files need not be in memory together.
    An InputError if a folder cannot be made or written; nothing is left behind then.
    """
    pairs = files.items() if isinstance(files, Mapping) else files
    _write_all((path, methodcaller("write", data)) for path, data in pairs)


def _write_all(files: Iterable[tuple[AnyPath, Callable[[BinaryIO], object]]]) -> None:
    """Fill all beside their places, then move them there; devices and pipes last, one wait for the disk."""
    staged: list[tuple[Path, Path]] = []
    through: list[tuple[BinaryIO, Path]] = []
    path = Path()
    try:
        for name, write in files:
            path = Path(name)
            if (target := _target(path)) is None:
                through.append((_held(write), path))
            else:
                staged.append((_stage(target, write), target))
        for held, path in through:
            _write_through(held, path)
        for temporary, target in staged:
            path = target
            _sync(temporary)
        folders = {path.parent for _, path in staged}
        while staged:
            temporary, path = staged[0]
            os.replace(temporary, path)
            staged.pop(0)
        for folder in folders if os.name == "posix" else ():
            with suppress(OSError):  # not every file system can: the files themselves are there
                _sync(folder)
    except (OSError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        named = str(getattr(error, "filename", None) or "")
        where = str(path) if not named or named.endswith(_PART) else named  # not one of our own
        raise InputError(f"cannot write: {reason(error)}", where=where) from error
    finally:
        for temporary, _ in staged:
            with suppress(OSError):
                temporary.unlink(missing_ok=True)
        for held, _ in through:
            held.close()


def _target(path: Path) -> Path | None:
    """Where a file is put: links are followed to their end; ``None`` for what is no regular file.

    Everything below ``/dev`` and ``/proc`` is an open file of some process, whatever it looks like. A socket
    or a block device is an InputError.
    """
    if str(path.absolute()).startswith(("/dev/", "/proc/")) and not str(path).startswith("/dev/shm/"):
        return None
    real = Path(os.path.realpath(path))
    try:
        mode = real.stat().st_mode
    except FileNotFoundError:
        return real
    if stat.S_ISREG(mode) or stat.S_ISDIR(mode):  # a directory is refused when it would be replaced
        return real
    if stat.S_ISCHR(mode) or stat.S_ISFIFO(mode):
        return None
    raise InputError(_NO_FILE, where=str(path))


def _held(write: Callable[[BinaryIO], object]) -> BinaryIO:
    """Fill a file without a name: what goes to a pipe may need to be complete first."""
    held: BinaryIO = tempfile.TemporaryFile()  # noqa: SIM115 - closed by the caller
    write(held)
    held.seek(0)
    return held


def _write_through(held: BinaryIO, path: Path) -> None:
    """Copy to a device or pipe that is there; a pipe that nobody reads is an error, not a wait."""
    if own := _OPEN_FILE.match(str(path.absolute())):  # opened again it would begin at the start
        sys.stdout.flush()
        handle = os.dup(int(own[1]) if own[1] else _STANDARD.index(own[2]))
    else:
        handle = os.open(path, os.O_WRONLY | getattr(os, "O_NONBLOCK", 0))
    with os.fdopen(handle, "wb", buffering=0) as device:
        mode = os.fstat(handle).st_mode
        if stat.S_ISBLK(mode) or stat.S_ISDIR(mode):
            raise InputError(_NO_FILE, where=str(path))
        if not own:
            os.set_blocking(handle, True)
        shutil.copyfileobj(held, device)


def _stage(path: Path, write: Callable[[BinaryIO], object]) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.parent / f".{secrets.token_hex(8)}{_PART}"
    try:
        with open(temporary, "xb") as file:
            write(file)
    except BaseException:
        with suppress(OSError):
            temporary.unlink()
        raise
    return temporary


def _sync(path: Path) -> None:
    """Wait until a file, or the names in a folder, are on the disk (Windows asks for the right to write)."""
    handle = os.open(path, os.O_RDONLY if path.is_dir() else os.O_RDWR)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
