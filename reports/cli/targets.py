"""Files that a command is asked to write."""

from __future__ import annotations

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
