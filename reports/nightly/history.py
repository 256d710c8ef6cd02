"""The history: every figure of every night, in one SQLite file in write-ahead mode.

The numbers of a result are one block of float64 in the order of its layout (the list of its figures).
Numbers, layouts and inputs that are the same as before are stored once and referred to.  A night
is written in one transaction: it is there whole, or not at all.
"""

from __future__ import annotations

import json
import math
import secrets
import sqlite3
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import datetime
from functools import wraps
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import numpy as np

from actuator_lti.errors import InputError
from actuator_lti.tree import Tree
from reports.nightly import schema, sums
from reports.nightly.figures import Figure
from reports.nightly.job import BROKEN, canonical
from reports.nightly.memory import Memory
from reports.nightly.records import Baseline, NewResult, Result, Run
from reports.nightly.text import sha256

PAGE_BYTES = 16384
RECENT = 8
MOST_UNPACKED = 64_000_000  # bytes of a list of figures or of parameters


P = ParamSpec("P")
R = TypeVar("R")


class DamagedError(Exception):
    """What was read is not what was written."""


def vector_sha(layout: int, numbers: bytes) -> bytes:
    """Half of the SHA-256 of a vector of numbers and its layout."""
    return bytes.fromhex(sha256(f"{layout}:".encode() + numbers))[:16]


def _unpacked(data: bytes) -> bytes:
    """Unpack within bounds."""
    unpack = zlib.decompressobj()
    content = unpack.decompress(data, MOST_UNPACKED)
    if not unpack.eof:
        raise DamagedError("packed data do not end")
    return content


def _whole(read: Callable[P, R]) -> Callable[P, R]:
    """A reading method whose misfits (a text where a number belongs, half a JSON) are damage of the file."""

    @wraps(read)
    def checked(*arguments: P.args, **named: P.kwargs) -> R:
        try:
            return read(*arguments, **named)
        except (TypeError, ValueError, KeyError, IndexError, OverflowError) as error:
            raise DamagedError(f"{type(error).__name__} while reading: {str(error)[:200]}") from error

    return checked


class History:
    """Reader and writer of one history file; see `open_history`."""

    def __init__(self, connection: sqlite3.Connection, notice: str | None) -> None:
        self.connection = connection
        self.notice = notice
        self._figure_ids: dict[str, int] = {}
        self._table: dict[int, Figure] = {}
        self._recent: dict[int, dict[str, Figure]] = {}

    # ---- writing -----------------------------------------------------------------------------------

    def start_run(self, run: Mapping[str, Any]) -> int:
        """Note that a night has begun; earlier ones that never ended become ``interrupted``."""
        with self.connection as c:
            c.execute("BEGIN IMMEDIATE")
            c.execute("UPDATE runs SET state = 'interrupted' WHERE state = 'running'")
            sums.forget(c)
            cursor = c.execute(
                "INSERT INTO runs(started, state, code, code_commit, study_commit, libraries, host)"
                " VALUES (:started, 'running', :code, :code_commit, :study_commit, :libraries, :host)",
                {**run, "libraries": canonical(run["libraries"])},
            )
        return int(cursor.lastrowid or 0)

    def finish_run(self, run: int, finished: str, results: Iterable[NewResult]) -> None:
        """Write a whole night in one transaction."""
        with self.connection as c:
            c.execute("BEGIN IMMEDIATE")
            self._figure_ids = {figure.name: number for number, figure in self.figure_table().items()}
            for result in results:
                self._insert(run, result)
            c.execute("UPDATE runs SET state = 'done', finished = ? WHERE id = ?", (finished, run))
            sums.write(c)

    def _insert(self, run: int, result: NewResult) -> None:
        snapshot = self._snapshot(result) if result.key and result.status not in BROKEN else None
        subject = self._id("subjects", "name", {"name": result.name, "kind": result.kind})
        self.connection.execute(
            "INSERT INTO results VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
            (
                subject, run, result.status, snapshot, result.seconds, int(result.cached), result.failed,
                result.total, result.worst, result.worst_id, result.message,
            ),
        )  # fmt: skip

    def _snapshot(self, result: NewResult) -> int:
        outcome = self.connection.execute("SELECT id FROM snapshots WHERE key = ?", (result.key,)).fetchone()
        if outcome:
            return int(outcome[0])
        ids = np.array([self._figure(f) for f in result.figures], dtype="<i4")
        layout = self._id(
            "layouts", "sha", {"sha": sha256(ids.tobytes()), "figures": zlib.compress(ids.tobytes())}
        )
        body = canonical(result.inputs or {})
        inputs = self._id("inputs", "sha", {"sha": sha256(body), "body": zlib.compress(body.encode())})
        values = np.array([np.nan if f.value is None else f.value for f in result.figures], dtype="<f8")
        numbers = values.tobytes()
        vector = self._id(
            "vectors", "sha", {"sha": vector_sha(layout, numbers), "layout": layout, "numbers": numbers}
        )
        cursor = self.connection.execute(
            "INSERT INTO snapshots(key, vector, input) VALUES (?, ?, ?)", (result.key, vector, inputs)
        )
        return int(cursor.lastrowid or 0)

    def _figure(self, figure: Figure) -> int:
        if figure.name not in self._figure_ids:
            row = {"name": figure.name, "unit": figure.unit, "better": figure.better, "kind": figure.kind}
            self._figure_ids[figure.name] = self._id("figures", "name", row)
        return self._figure_ids[figure.name]

    def _id(self, table: str, unique: str, row: Mapping[str, Any]) -> int:
        query = f"SELECT id FROM {table} WHERE {unique} = ?"
        result = self.connection.execute(query, (row[unique],)).fetchone()
        if result:
            return int(result[0])
        columns = ", ".join(row)
        marks = ", ".join(f":{name}" for name in row)
        cursor = self.connection.execute(f"INSERT INTO {table}({columns}) VALUES ({marks})", dict(row))
        return int(cursor.lastrowid or 0)

    def approve(self, run: int, names: Sequence[str] | None, *, by: str, reason: str, at: str) -> None:
        """Make a night the baseline of some designs, or of all (``None``)."""
        with self.connection as c:
            c.execute("BEGIN IMMEDIATE")
            sums.forget(c)
            for name in [None] if names is None else names:
                c.execute(
                    "INSERT INTO baselines(run, at, by, reason, subject)"
                    " VALUES (?, ?, ?, ?, (SELECT id FROM subjects WHERE name = ?))",
                    (run, at, by, reason, name),
                )
            sums.write(c)

    def claim(self, study: str) -> None:
        """Note whose history this is.

        Raises
        ------
        InputError
            Where it is that of another study.
        """
        result = self.connection.execute("SELECT value FROM meta WHERE key = 'study'").fetchone()
        if result is None:
            with self.connection as c:
                c.execute("INSERT INTO meta VALUES ('study', ?)", (study,))
        elif result[0] != study:
            raise InputError(
                f"holds the nights of study {result[0][:80]!r}, not of {study[:80]!r}: use another --site"
            )

    def memory(self) -> Memory:
        """How much there is, for the site to remember; a history gets its id when it is first asked."""
        result = self.connection.execute("SELECT value FROM meta WHERE key = 'id'").fetchone()
        id = result[0] if result else secrets.token_hex(16)
        if result is None:
            with self.connection as c:
                c.execute("INSERT INTO meta VALUES ('id', ?)", (id,))
        nights = self.connection.execute("SELECT count(*) FROM runs WHERE state = 'done'").fetchone()[0]
        approvals = self.connection.execute("SELECT count(*) FROM baselines").fetchone()[0]
        return Memory(str(id), int(nights), int(approvals))

    # ---- reading -----------------------------------------------------------------------------------

    @_whole
    def runs(self) -> list[Run]:
        """Return the finished nights, oldest first."""
        rows = self.connection.execute("SELECT * FROM runs WHERE state = 'done' ORDER BY id").fetchall()
        return [_run(r) for r in rows]

    @_whole
    def interrupted(self) -> list[str]:
        """When nights began that never ended."""
        rows = self.connection.execute("SELECT started FROM runs WHERE state = 'interrupted' ORDER BY id")
        return [str(r[0]) for r in rows]

    @_whole
    def baselines(self) -> list[Baseline]:
        """Return all approvals, oldest first."""
        rows = self.connection.execute(
            "SELECT b.id, b.run, b.at, b.by, b.reason, s.name FROM baselines b"
            " LEFT JOIN subjects s ON s.id = b.subject ORDER BY b.id"
        )
        return [Baseline(**dict(r)) for r in rows]

    @_whole
    def results(
        self, *, run: int | None = None, name: str | None = None, good: bool = False, last: int | None = None
    ) -> list[Result]:
        """Return results in the order of the nights, of finished nights only.

        Parameters
        ----------
        run, name : optional
            Only of this night, of this design.
        good : bool
            Only those that have figures.
        last : int, optional
            Only the last so many; the first so many where negative.
        """
        conditions = ["u.state = 'done'"]
        conditions += ["r.run = :run"] if run is not None else []
        conditions += ["r.subject = (SELECT id FROM subjects WHERE name = :name)"] if name is not None else []
        conditions += ["r.snapshot IS NOT NULL"] if good else []
        order = "r.run, r.subject" if last is None or last < 0 else "r.run DESC, r.subject"
        rows = self.connection.execute(
            "SELECT r.run, s.name, s.kind, r.status, r.snapshot, r.seconds,"
            " coalesce(n.key, '') AS key,"
            " r.cached, r.failed, r.total, r.worst, r.worst_id, r.message"
            " FROM results r JOIN runs u ON u.id = r.run"
            " JOIN subjects s ON s.id = r.subject LEFT JOIN snapshots n ON n.id = r.snapshot"
            f" WHERE {' AND '.join(conditions)} ORDER BY {order} LIMIT :count",
            {"run": run, "name": name, "count": -1 if last is None else abs(last)},
        ).fetchall()
        if last is not None and last > 0:
            rows.reverse()
        return [Result(**{**dict(r), "cached": bool(r["cached"])}) for r in rows]

    @_whole
    def contents(self, runs: Iterable[int]) -> list[tuple[str, str]]:
        """Return name and content address of all that some nights show, each once."""
        ids = sorted(runs)
        rows = self.connection.execute(
            "SELECT DISTINCT s.name, n.key FROM results r JOIN subjects s ON s.id = r.subject"
            f" JOIN snapshots n ON n.id = r.snapshot WHERE r.run IN ({','.join('?' * len(ids))})",
            ids,
        )
        return [(row[0], row[1]) for row in rows]

    @_whole
    def inputs(self, snapshot: int) -> Tree:
        """Return parameters and settings behind a result."""
        row = self.connection.execute(
            "SELECT i.body, i.sha FROM snapshots s JOIN inputs i ON i.id = s.input WHERE s.id = ?",
            (snapshot,),
        ).fetchone()
        body = _unpacked(row[0]) if row else b"{}"
        if row and sha256(body) != row[1]:
            raise DamagedError(f"the inputs of result {snapshot} are not what was written")
        return dict(json.loads(body))

    @_whole
    def figures(self, snapshot: int | None) -> dict[str, Figure]:
        """Return the figures of one result by name."""
        if snapshot is None:
            return {}
        if snapshot not in self._recent:
            if len(self._recent) >= RECENT:
                self._recent.clear()
            self._recent[snapshot] = self._read_figures(snapshot)
        return self._recent[snapshot]

    def _read_figures(self, snapshot: int) -> dict[str, Figure]:
        ((_, layout, numbers),) = self._numbers([snapshot])
        known = self.figure_table()
        values = np.frombuffer(numbers, dtype="<f8").tolist()
        out = {}
        for number, value in zip(self._layout(layout), values, strict=True):
            f = known[number]
            shown = None if math.isnan(value) else value
            out[f.name] = Figure(name=f.name, value=shown, unit=f.unit, better=f.better, kind=f.kind)
        return out

    def known(self, keys: Iterable[str]) -> set[str]:
        """Return those of some content addresses whose results are stored."""
        query = "SELECT 1 FROM snapshots WHERE key = ?"
        return {key for key in keys if self.connection.execute(query, (key,)).fetchone()}

    @_whole
    def figure_table(self) -> dict[int, Figure]:
        """Return name, unit and direction of every figure by its number (without values)."""
        count = self.connection.execute("SELECT count(*) FROM figures").fetchone()[0]
        if len(self._table) != count:
            rows = self.connection.execute("SELECT id, name, unit, better, kind FROM figures")
            self._table = {
                r[0]: Figure(name=r[1], value=None, unit=r[2], better=r[3], kind=r[4]) for r in rows
            }
        return self._table

    def _layout(self, layout: int) -> list[int]:
        sha, figures = self.connection.execute(
            "SELECT sha, figures FROM layouts WHERE id = ?", (layout,)
        ).fetchone()
        ids = _unpacked(figures)
        if sha256(ids) != sha:
            raise DamagedError(f"layout {layout} is not what was written")
        return [int(v) for v in np.frombuffer(ids, dtype="<i4")]

    @_whole
    def matrix(self, results: Sequence[Result], figures: Sequence[int]) -> np.ndarray:
        """Values of some figures over some results, (results x figures); NaN where there is none."""
        wanted = sorted({r.snapshot for r in results if r.snapshot is not None})
        rows: dict[int, np.ndarray] = {}
        column = {number: j for j, number in enumerate(figures)}
        places: dict[int, tuple[np.ndarray, np.ndarray]] = {}
        for snapshot, layout, numbers in self._numbers(wanted):
            if layout not in places:
                ids = self._layout(layout)
                result = [(i, column[n]) for i, n in enumerate(ids) if n in column]
                pairs = np.array(result, dtype=int).reshape(-1, 2)
                places[layout] = (pairs[:, 0], pairs[:, 1])
            source, target = places[layout]
            row = np.full(len(figures), np.nan)
            row[target] = np.frombuffer(numbers, dtype="<f8")[source]
            rows[snapshot] = row
        nothing = np.full(len(figures), np.nan)
        values = [nothing if r.snapshot is None else rows[r.snapshot] for r in results]
        return np.array(values).reshape(len(results), len(figures))

    def _numbers(self, snapshots: Sequence[int]) -> Iterator[tuple[int, int, bytes]]:
        for start in range(0, len(snapshots), 500):
            part = snapshots[start : start + 500]
            marks = ",".join("?" * len(part))
            rows = self.connection.execute(
                "SELECT s.id, v.layout, v.numbers, v.sha FROM snapshots s JOIN vectors v ON v.id = s.vector"
                f" WHERE s.id IN ({marks})",
                part,
            ).fetchall()
            if len(rows) != len(part):
                raise DamagedError("a result's figures are missing")
            for snapshot, layout, numbers, sha in rows:
                if vector_sha(layout, numbers) != sha:
                    raise DamagedError(f"the figures of result {snapshot} are not what was written")
                yield snapshot, layout, numbers


def _run(row: sqlite3.Row) -> Run:
    """Make a night of its row; times that are none are damage."""
    run = Run(**{**dict(row), "libraries": dict(json.loads(row["libraries"]))})
    datetime.fromisoformat(run.started)
    texts = (run.code, run.code_commit, run.study_commit, run.host, *run.libraries.values())
    if not all(isinstance(text, str) for text in texts):
        raise ValueError("a text is wanted")
    return run


@contextmanager
def open_history(path: Path) -> Iterator[History]:
    """Open (or begin) a history, brought to the schema of this version.

    Raises
    ------
    InputError
        Where the file is no history, is damaged or was written by a newer version.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        connection = sqlite3.connect(path, isolation_level=None, timeout=30.0)
    except sqlite3.OperationalError as error:
        raise InputError(f"cannot be opened ({error})", where=str(path)) from error
    try:
        connection.row_factory = sqlite3.Row
        notice = _configure(connection, path)
        yield History(connection, notice)
    except sqlite3.OperationalError as error:
        raise InputError(f"cannot be read or written: {error}", where=str(path)) from error
    except (sqlite3.Error, sqlite3.Warning, zlib.error, DamagedError) as error:
        raise InputError(f"is damaged ({error}): restore it from a copy", where=str(path)) from error
    finally:
        connection.close()


def _configure(connection: sqlite3.Connection, path: Path) -> str | None:
    try:
        schema.checked_version(connection, path)
        connection.execute(f"PRAGMA page_size = {PAGE_BYTES}")
        connection.execute("PRAGMA journal_mode = WAL")
        connection.execute("PRAGMA synchronous = FULL")
        connection.execute("PRAGMA foreign_keys = ON")
        notice = schema.prepare(connection, path)
        damage = connection.execute("PRAGMA quick_check(1)").fetchone()[0]
        if damage == "ok" and connection.execute("PRAGMA foreign_key_check").fetchone() is not None:
            damage = "an entry refers to one that is missing"
        if damage == "ok":
            damage = schema.foreign_value(connection) or sums.damage(connection) or "ok"
    except (sqlite3.DatabaseError, UnicodeDecodeError) as error:
        if isinstance(error, sqlite3.OperationalError):
            raise
        raise InputError(f"is no history of a nightly build ({error})", where=str(path)) from error
    if damage != "ok":
        raise InputError(f"is damaged ({damage}): restore it from a copy", where=str(path))
    return notice
