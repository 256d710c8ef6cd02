"""Results of a numbered study on disk: one Parquet file a chunk, and a manifest that says of what.

A chunk appears under its name only when it is complete (written beside, synchronised, renamed); a run that
is interrupted, killed included, goes on from the chunks that are there.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from actuator_lti.errors import InputError
from actuator_lti.files.atomic import write_bytes
from actuator_lti.files.tree import Tree
from analyses.studies.engine import Arrays, Chunk

SCHEMA = "actuator-lti/samples"
VERSION = 1
CHUNK = 4096


@dataclass(frozen=True)
class Store:
    """A folder of chunks of so many numbers; ``manifest``, written before the first, says of what study."""

    folder: Path
    chunk: int
    manifest: bytes

    @classmethod
    def open(cls, folder: Path, identity: Mapping[str, Any], chunk: int = CHUNK) -> Store:
        """Open a folder for a study, new or begun before; one that holds another study is refused.

        ``identity`` is everything that decides the numbers (hashes, seed, settings), plain JSON.
        """
        path = folder / "manifest.json"
        wanted = {"schema": SCHEMA, "version": VERSION, "identity": dict(identity)}
        if path.exists():
            result = _read_manifest(path)
            if {key: result.get(key) for key in wanted} != wanted:
                words = "holds another study (design, seed, settings or code); take another folder"
                raise InputError(words, where=str(folder))
            chunk = int(result["chunk"])
        text = json.dumps({**wanted, "chunk": chunk}, indent=1, sort_keys=True)
        return cls(folder, chunk, text.encode())

    def put(self, path: Path, data: bytes) -> None:
        """Put a file of the study on disk, in a folder that says of what it is."""
        manifest = self.folder / "manifest.json"
        if not manifest.exists():
            write_bytes(manifest, self.manifest)
        write_bytes(path, data)

    def path(self, chunk: Chunk) -> Path:
        """File of a chunk."""
        return self.folder / f"samples-{chunk[0]:010d}-{chunk[1]}.parquet"

    def chunks(self, total: int) -> list[Chunk]:
        """All chunks of a study of so many numbers."""
        return [(first, min(self.chunk, total - first)) for first in range(0, total, self.chunk)]

    def missing(self, total: int) -> list[Chunk]:
        """Chunks that are not on disk, or whose file is damaged."""
        return [chunk for chunk in self.chunks(total) if not _whole(self.path(chunk), chunk[1])]

    def write(self, chunk: Chunk, arrays: Arrays) -> None:
        """Put a chunk on disk."""
        import pyarrow as pa
        import pyarrow.parquet as pq

        sink = pa.BufferOutputStream()
        pq.write_table(pa.table(dict(arrays)), sink, compression="zstd")
        self.put(self.path(chunk), sink.getvalue().to_pybytes())

    def blocks(self, total: int) -> Iterator[Arrays]:
        """The columns of one chunk after the other."""
        import pyarrow.parquet as pq

        for chunk in self.chunks(total):
            part = pq.read_table(self.path(chunk), partitioning=None)
            yield {name: part.column(name).to_numpy() for name in part.column_names}


def _read_manifest(path: Path) -> Tree:
    try:
        result = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"cannot be read: {error}", where=str(path)) from error
    if not isinstance(result, dict) or not isinstance(result.get("chunk"), int) or result["chunk"] < 1:
        raise InputError("is no manifest of a study", where=str(path))
    return result


def _whole(path: Path, count: int) -> bool:
    """Whether a chunk's file is there and holds as many rows as it should."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        return int(pq.read_metadata(path).num_rows) == count
    except (OSError, pa.ArrowInvalid):
        return False
