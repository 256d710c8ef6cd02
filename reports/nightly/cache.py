"""Content-addressed store of results: one file an entry, whole or refused.

An entry is one line (magic, version, SHA-256 of the rest) and a ZIP archive with ``meta.json`` (figures,
verdicts, what the pages need) and the files of the report.  It is written beside and put in place, so a
killed run leaves no half entry; one that was damaged later fails its checksum and is built again.
"""

import io
import json
import os
import time
import zipfile
import zlib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from actuator_lti.files.atomic import write_bytes
from reports.nightly.text import sha256

MAGIC = b"actuator-lti/nightly-cache 1 "
MAX_ENTRY_BYTES = 256_000_000
MAX_UNPACKED_BYTES = 2_000_000_000
_COMPRESSION = 3
_NO_ENTRY = (zipfile.BadZipFile, KeyError, ValueError, zlib.error, NotImplementedError)


class CorruptEntry(ValueError):
    """An entry whose checksum or layout is wrong."""


@dataclass(frozen=True)
class Entry:
    """A result as stored: ``meta`` at once, the files of the report when asked for."""

    meta: Mapping[str, Any]
    archive: bytes

    def file(self, name: str) -> bytes:
        with zipfile.ZipFile(io.BytesIO(self.archive)) as archive:
            return archive.read(f"files/{name}")


@dataclass(frozen=True)
class Cache:
    """The store below one folder."""

    folder: Path

    def path(self, key: str) -> Path:
        return self.folder / key[:2] / f"{key}.entry"

    def take(self, key: str, data: bytes) -> Entry:
        """Store an entry that was made elsewhere (see `sealed`), whole or not at all (`CorruptEntry`)."""
        entry = _opened(key, data)
        write_bytes(self.path(key), data)
        return entry

    def read(self, key: str) -> Entry | None:
        """Return an entry, or ``None``; a file that is not whole raises `CorruptEntry`."""
        path = self.path(key)
        if path.is_symlink():
            raise CorruptEntry("is a symbolic link")
        if not path.exists():
            return None
        if path.stat().st_size > MAX_ENTRY_BYTES:
            raise CorruptEntry(f"larger than {MAX_ENTRY_BYTES} bytes")
        entry = _opened(key, path.read_bytes())
        os.utime(path)
        return entry

    def whole(self, key: str, tell: Callable[[str], None] = lambda _why: None) -> Entry | None:
        """Return an entry, or ``None``; one that is corrupt is removed, and told why."""
        try:
            return self.read(key)
        except CorruptEntry as error:
            tell(str(error))
            self.path(key).unlink(missing_ok=True)
            return None

    def collect_garbage(self, keep: Iterable[str], older_than_days: float) -> None:
        """Remove entries that are not in ``keep`` and have not been used for so long."""
        kept, limit = set(map(self.path, keep)), time.time() - older_than_days * 86400.0
        for path in self.folder.glob("*/*.entry"):
            if path not in kept and path.stat().st_mtime < limit:
                path.unlink(missing_ok=True)


def sealed(key: str, meta: Mapping[str, Any], files: Mapping[str, bytes]) -> bytes:
    """Make the entry of a result; the hashes of its files go into ``meta["files"]``."""
    full = {**meta, "key": key, "files": {name: sha256(data) for name, data in files.items()}}
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED, compresslevel=_COMPRESSION) as archive:
        archive.writestr("meta.json", json.dumps(full, allow_nan=False))
        for name, data in files.items():
            archive.writestr(f"files/{name}", data)
    body = buffer.getvalue()
    return MAGIC + sha256(body).encode() + b"\n" + body


def _opened(key: str, data: bytes) -> Entry:
    header, separator, body = data.partition(b"\n")
    if not separator or header != MAGIC + sha256(body).encode():
        raise CorruptEntry("checksum differs")
    try:
        with zipfile.ZipFile(io.BytesIO(body)) as archive:
            size = sum(item.file_size for item in archive.infolist())
            meta = json.loads(archive.read("meta.json")) if size <= MAX_UNPACKED_BYTES else {}
    except _NO_ENTRY as error:
        raise CorruptEntry("layout differs") from error
    if size > MAX_UNPACKED_BYTES:
        raise CorruptEntry(f"more than {MAX_UNPACKED_BYTES} bytes unpacked")
    if not isinstance(meta, dict) or meta.get("key") != key:
        raise CorruptEntry("stored under another key")
    return Entry(meta, body)
