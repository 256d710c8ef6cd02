"""Many new files at once, on the disk together before anything refers to them."""

from __future__ import annotations

import os
from pathlib import Path

from actuator_lti.errors import InputError


class Batch:
    """Files that nothing refers to yet; `flush` waits until all of them are on the disk.

    Written one by one without waiting, they reach the disk in few turns; whoever refers to them must do so
    only after `flush`.
    """

    def __init__(self) -> None:
        self._paths: list[Path] = []

    def write(self, path: Path, data: bytes | str) -> None:
        """Write one file; missing folders are made.

        Raises
        ------
        InputError
            If it cannot be written, in one line.
        """
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data.encode() if isinstance(data, str) else data)
        except OSError as error:
            raise _refusal(error, path) from error
        self._paths.append(path)

    def flush(self) -> None:
        """Wait until every file and its folder are on the disk.

        Raises
        ------
        InputError
            If the disk does not take them.
        """
        folders = sorted({path.parent for path in self._paths}) if os.name == "posix" else []
        for path in [*self._paths, *folders]:
            try:
                handle = os.open(path, os.O_RDONLY)
                try:
                    os.fsync(handle)
                finally:
                    os.close(handle)
            except OSError as error:
                raise _refusal(error, path) from error
        self._paths.clear()


def _refusal(error: OSError, path: Path) -> InputError:
    return InputError(f"cannot write: {error.strerror or error}", where=str(error.filename or path))
