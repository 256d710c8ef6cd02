"""Layout of the history database, by version; every step from one version to the next is written down here.

``PRAGMA user_version`` holds the version.  A newer one than this code knows is refused; before an older
one is changed, a copy of the file is laid beside it.
"""

from __future__ import annotations

import sqlite3
from pathlib import Path

from actuator_lti.errors import InputError
from reports.nightly import sums

APPLICATION_ID = 0x414C5449  # "ALTI"

_VERSION_1 = """
CREATE TABLE meta(key TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;
CREATE TABLE runs(
    id INTEGER PRIMARY KEY, started TEXT NOT NULL, finished TEXT, state TEXT NOT NULL,
    code TEXT NOT NULL, code_commit TEXT NOT NULL, libraries TEXT NOT NULL, host TEXT NOT NULL
);
CREATE TABLE subjects(id INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE, kind TEXT NOT NULL);
CREATE TABLE figures(
    id INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE, unit TEXT NOT NULL, better INTEGER NOT NULL,
    kind TEXT NOT NULL
);
CREATE TABLE layouts(id INTEGER PRIMARY KEY, sha TEXT NOT NULL UNIQUE, figures BLOB NOT NULL);
CREATE TABLE inputs(id INTEGER PRIMARY KEY, sha TEXT NOT NULL UNIQUE, body BLOB NOT NULL);
CREATE TABLE vectors(
    id INTEGER PRIMARY KEY, sha BLOB NOT NULL UNIQUE, layout INTEGER NOT NULL REFERENCES layouts(id),
    numbers BLOB NOT NULL
);
CREATE TABLE snapshots(
    id INTEGER PRIMARY KEY, key TEXT NOT NULL UNIQUE, vector INTEGER NOT NULL REFERENCES vectors(id),
    input INTEGER NOT NULL REFERENCES inputs(id)
);
CREATE TABLE results(
    subject INTEGER NOT NULL REFERENCES subjects(id), run INTEGER NOT NULL REFERENCES runs(id),
    status TEXT NOT NULL, snapshot INTEGER REFERENCES snapshots(id), seconds REAL NOT NULL,
    cached INTEGER NOT NULL, failed INTEGER NOT NULL, total INTEGER NOT NULL,
    worst REAL, worst_id TEXT NOT NULL,
    message TEXT NOT NULL,
    PRIMARY KEY(subject, run)
) WITHOUT ROWID;
CREATE INDEX results_of_run ON results(run);
CREATE TABLE baselines(
    id INTEGER PRIMARY KEY, run INTEGER NOT NULL REFERENCES runs(id), at TEXT NOT NULL, by TEXT NOT NULL,
    reason TEXT NOT NULL
);
"""

# 2: a baseline can be approved for one design alone; the commit of the study beside that of the code.
_VERSION_2 = """
ALTER TABLE baselines ADD COLUMN subject INTEGER REFERENCES subjects(id);
ALTER TABLE runs ADD COLUMN study_commit TEXT NOT NULL DEFAULT '';
"""

# 3: a checksum for each row of text.
_VERSION_3 = """
CREATE TABLE sums(
    kind TEXT NOT NULL, id INTEGER NOT NULL, sha TEXT NOT NULL, PRIMARY KEY(kind, id)
) WITHOUT ROWID;
"""

STEPS: tuple[str, ...] = (_VERSION_1, _VERSION_2, _VERSION_3)
VERSION = len(STEPS)

_KINDS = {
    "INTEGER": "'integer', 'null'",
    "REAL": "'real', 'null'",
    "TEXT": "'text', 'null'",
    "BLOB": "'blob', 'null'",
}


def prepare(connection: sqlite3.Connection, path: Path) -> str | None:
    """Bring a database to this version; what was done in words, ``None`` where nothing had to be.

    Raises
    ------
    InputError
        Where the file is no history, or was written by a newer version.
    """
    version = checked_version(connection, path)
    if version == VERSION:
        return None
    backup = _backup(connection, path, version) if version else None
    with connection:
        connection.execute("BEGIN IMMEDIATE")
        for number in range(version, VERSION):
            for statement in STEPS[number].split(";"):
                if statement.strip():
                    connection.execute(statement)
        sums.write(connection)
        connection.execute(f"PRAGMA application_id = {APPLICATION_ID}")
        connection.execute(f"PRAGMA user_version = {VERSION}")
    if backup is None:
        return None
    return f"history brought from version {version} to {VERSION}; as it was: {backup.name}"


def checked_version(connection: sqlite3.Connection, path: Path) -> int:
    """Return the version of a history (0 of a new file); refuse what is none, changing nothing.

    Raises
    ------
    InputError
        Where the file is no history, or was written by a newer version.
    """
    try:
        version = int(connection.execute("PRAGMA user_version").fetchone()[0])
        application = int(connection.execute("PRAGMA application_id").fetchone()[0])
        tables = int(connection.execute("SELECT count(*) FROM sqlite_master").fetchone()[0])
    except sqlite3.OperationalError:  # the disk, not the file
        raise
    except (sqlite3.DatabaseError, UnicodeDecodeError) as error:  # the latter of names that are quoted
        raise InputError(f"is no history of a nightly build ({error})", where=str(path)) from error
    if tables and application != APPLICATION_ID:
        raise InputError("is a database, but no history of a nightly build", where=str(path))
    if version > VERSION:
        raise InputError(
            f"has schema version {version}, this actuator-lti knows up to {VERSION}: use a newer one",
            where=str(path),
        )
    return version


def foreign_value(connection: sqlite3.Connection) -> str | None:
    """A value of another kind than its column in words, which SQLite would keep; None where there is none."""
    tables = connection.execute("SELECT name FROM sqlite_master WHERE type = 'table'").fetchall()
    for (table,) in tables:
        columns = connection.execute("SELECT name, type FROM pragma_table_info(?)", (table,)).fetchall()
        wrong = " OR ".join(
            f"typeof({_quoted(name)}) NOT IN ({_KINDS[kind]})" for name, kind in columns if kind in _KINDS
        )
        found = (
            wrong and connection.execute(f"SELECT 1 FROM {_quoted(table)} WHERE {wrong} LIMIT 1").fetchone()
        )
        if found:
            return f"a value of {table} is of another kind than its column"
    return None


def _quoted(name: str) -> str:
    return '"' + name.replace('"', '""') + '"'


def _backup(connection: sqlite3.Connection, path: Path, version: int) -> Path:
    target = path.with_name(f"{path.stem}.version-{version}{path.suffix}")
    temporary = target.with_name(f".{target.name}.part")
    temporary.unlink(missing_ok=True)
    copy = sqlite3.connect(temporary)
    try:
        connection.backup(copy)
    finally:
        copy.close()
    temporary.replace(target)
    return target
