"""A checksum for each row that says something: nights with their results, figures, approvals.

SQLite finds torn pages, and the numbers have hashes of their own; a flipped bit in a name, a unit or a status
is found here.  A sum is over the row and the names that it refers to.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterator

from reports.nightly.text import sha256

_RESULTS = (
    "SELECT r.run, s.name, s.kind, r.status, n.key, v.sha, i.sha, r.seconds, r.cached, r.failed, r.total,"
    " r.worst, r.worst_id, r.message FROM results r JOIN subjects s ON s.id = r.subject"
    " LEFT JOIN snapshots n ON n.id = r.snapshot LEFT JOIN vectors v ON v.id = n.vector"
    " LEFT JOIN inputs i ON i.id = n.input WHERE {} ORDER BY r.run, r.subject"
)
_ROWS = {
    "run": "SELECT id, started, finished, code, code_commit, study_commit, libraries, host FROM runs"
    " WHERE state = 'done' AND {}",
    "figure": "SELECT id, name, unit, better, kind FROM figures WHERE {}",
    "approval": "SELECT b.id, b.run, b.at, b.by, b.reason, s.name FROM baselines b"
    " LEFT JOIN subjects s ON s.id = b.subject WHERE {}",
}
_ID = {"run": "id", "figure": "id", "approval": "b.id"}
_EVERY = "1"


def write(connection: sqlite3.Connection) -> None:
    """Add the sums of rows that have none yet, within the transaction that is open; no others are read."""
    connection.executemany(
        "INSERT INTO sums(kind, id, sha) VALUES (?, ?, ?)", list(_sums(connection, new=True))
    )


def forget(connection: sqlite3.Connection) -> None:
    """Drop the sums of nights and approvals that are gone, whose numbers are about to be used again."""
    connection.execute(
        "DELETE FROM sums WHERE kind = 'run' AND id NOT IN (SELECT id FROM runs WHERE state = 'done')"
    )
    connection.execute("DELETE FROM sums WHERE kind = 'approval' AND id NOT IN (SELECT id FROM baselines)")


def damage(connection: sqlite3.Connection) -> str | None:
    """What is not as it was written, in words; None where all is."""
    kept = {(row[0], row[1]): row[2] for row in connection.execute("SELECT kind, id, sha FROM sums")}
    for kind, number, sha in _sums(connection):
        if kept.get((kind, number)) != sha:
            return f"{kind} {number} is not what was written"
    return None


def _sums(connection: sqlite3.Connection, *, new: bool = False) -> Iterator[tuple[str, int, str]]:
    """Sums of all rows, or of the ``new`` ones, which have none."""

    def wanted(kind: str, column: str) -> str:
        return f"{column} NOT IN (SELECT id FROM sums WHERE kind = '{kind}')" if new else _EVERY

    results: dict[int, list[object]] = {}
    for row in connection.execute(_RESULTS.format(wanted("run", "r.run"))):
        results.setdefault(row[0], []).append(_plain(row))
    for kind, query in _ROWS.items():
        for row in connection.execute(query.format(wanted(kind, _ID[kind]))):
            body = [_plain(row), results.get(row[0], []) if kind == "run" else []]
            yield kind, int(row[0]), sha256(json.dumps(body))[:32]


def _plain(row: sqlite3.Row) -> list[object]:
    return [value.hex() if isinstance(value, bytes) else value for value in row]
