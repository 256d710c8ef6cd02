"""Files and folders that a command is asked to write."""

from __future__ import annotations

import os
from pathlib import Path


def refuse_existing(path: Path, force: bool) -> None:
    """Refuse to overwrite a file without ``--force``, and anything that is no file always.

    Raises
    ------
    InputError
        With what is allowed.
    """
    from actuator_lti.errors import InputError

    if path.is_dir():
        raise InputError("is a directory; allowed: a file to write", where=str(path))
    if path.exists() and not force:
        raise InputError("exists already; allowed: another name, or --force", where=str(path))


def write_new(path: Path | None, text: str, force: bool) -> None:
    """Write a file that is not there yet, or with ``--force``; nothing without a path."""
    from actuator_lti.files.atomic import write_text

    if path is not None:
        refuse_existing(path, force)
        write_text(path, text)


def folder_for_results(path: Path | None) -> Path | None:
    """Refuse a folder that cannot be written, before anything is computed; made only when it is needed.

    Raises
    ------
    InputError
        With the path that stands in the way.
    """
    from actuator_lti.errors import InputError

    if path is None:
        return None
    there = path.absolute()
    while not there.exists() and there != there.parent:
        there = there.parent
    if not there.is_dir():
        raise InputError("is not a directory; allowed for --out: a folder, made if needed", where=str(there))
    if not os.access(there, os.W_OK | os.X_OK):
        raise InputError("cannot be written to; allowed for --out: a folder of your own", where=str(there))
    return path
