"""A history that is lost or damaged is told, by name, and never opens the gate."""

from __future__ import annotations

import json
import random
import shutil
import sqlite3
from pathlib import Path

import pytest
from nightly_fakes import CODE, INLINE, job, study

from actuator_lti.errors import InputError
from reports.cli.main import main
from reports.nightly import sums
from reports.nightly.history import open_history
from reports.nightly.memory import HistoryLost, Memory, remembered
from reports.nightly.night import Settings, approve, run_night

AGAIN = Settings(workers=0, build=INLINE.build, accept_lost_history=True)
DAMAGE_ROUNDS = 250


def night(site: Path, margin: float, settings: Settings = INLINE):
    return run_night(study(job("a", margin), job("b")), site, settings, code=CODE)


def state(site: Path) -> Path:
    return site.with_name(site.name + ".state")


@pytest.fixture
def site(tmp_path) -> Path:
    """Two nights and an approval."""
    site = tmp_path / "site"
    night(site, 10.0)
    approve(study(job("a"), job("b")), site, by="x", reason="y", settings=INLINE)
    night(site, 10.5)
    return site


def forget_all(site: Path) -> None:
    shutil.rmtree(state(site))


def forget_history(site: Path) -> None:
    for path in state(site).glob("history.sqlite*"):
        path.unlink()


def empty_history(site: Path) -> None:
    forget_history(site)
    (state(site) / "history.sqlite").touch()


def forget_last_night(site: Path) -> None:
    with sqlite3.connect(state(site) / "history.sqlite") as database:
        database.execute("DELETE FROM results WHERE run = (SELECT max(id) FROM runs)")
        database.execute("DELETE FROM runs WHERE id = (SELECT max(id) FROM runs)")
    database.close()


def forget_baseline(site: Path) -> None:
    with sqlite3.connect(state(site) / "history.sqlite") as database:
        database.execute("DELETE FROM baselines")
    database.close()


def take_that_of_another(site: Path) -> None:
    other = site.with_name("other")
    for margin in (1.0, 2.0, 3.0):
        night(other, margin)
    forget_history(site)
    shutil.copy(state(other) / "history.sqlite", state(site) / "history.sqlite")


@pytest.mark.parametrize(
    "lose",
    [forget_all, forget_history, empty_history, forget_last_night, forget_baseline, take_that_of_another],
)
def test_a_lost_history_closes_the_gate_until_somebody_says_so(site, lose) -> None:
    index = (site / "index.html").read_bytes()
    lose(site)
    for _ in range(2):  # the first refusal must not make the second night pass
        with pytest.raises(HistoryLost, match="--accept-lost-history") as caught:
            night(site, 3.0)
        assert "2 night(s) and 1 approval(s)" in str(caught.value)
        assert "\n" not in str(caught.value)
    with pytest.raises(HistoryLost):
        approve(study(job("a"), job("b")), site, by="x", reason="y", settings=INLINE)
    assert (site / "index.html").read_bytes() == index
    assert night(site, 12.0, AGAIN).exit_status in (0, 1)
    night(site, 12.0)  # from here on it is known again
    with open_history(state(site) / "history.sqlite") as history:
        assert remembered(site) == history.memory()


def test_a_site_of_an_older_version_or_a_damaged_summary_remembers_one_night(site) -> None:
    summary = site / "summary.json"
    for text in ("{}", "[]", "{", '{"history": {"nights": "many", "approvals": true}}', ""):
        summary.write_text(text)
        result = remembered(site)
        assert result == Memory("", 1, 0), text
    summary.unlink()
    assert remembered(site) == Memory("", 1, 0)
    forget_history(site)
    with pytest.raises(HistoryLost, match="1 night"):
        night(site, 3.0)


def test_the_command_exits_1_with_one_line(tmp_path, capsys, monkeypatch) -> None:
    monkeypatch.setattr("reports.nightly.compute.build", lambda payload: pytest.fail("built"))
    site = tmp_path / "site"
    site.mkdir()
    (site / ".nightly-site").write_text("x")
    (site / "summary.json").write_text(json.dumps({"history": {"id": "i", "nights": 7, "approvals": 1}}))
    assert main(["nightly", "ilr33-amber", "--site", str(site), "--quiet"]) == 1
    line = capsys.readouterr().err
    assert line.count("\n") == 1
    assert "7 night(s) and 1 approval(s)" in line


def test_any_damage_is_told_or_harmless(site, tmp_path) -> None:
    """Bytes are overwritten, cut off and inserted; a night never ends otherwise than well or named."""
    path = state(site) / "history.sqlite"
    with sqlite3.connect(path) as database:
        database.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    database.close()
    whole, draw, lines = path.read_bytes(), random.Random(18), []
    target = tmp_path / "h.sqlite"
    for _ in range(DAMAGE_ROUNDS):
        data = bytearray(whole)
        for _ in range(draw.choice((1, 1, 4, 40))):
            place = draw.randrange(len(data))
            data[place : place + draw.randrange(1, 9)] = draw.randbytes(draw.randrange(1, 9))
        if draw.random() < 0.1:
            del data[draw.randrange(len(data)) :]
        target.write_bytes(bytes(data))
        for beside in tmp_path.glob("h.*sqlite-*"):
            beside.unlink()
        try:
            with open_history(target) as history:
                everything(history)
        except InputError as error:
            lines.append(str(error))
    assert all(line.isprintable() and "h.sqlite" in line for line in lines)
    assert len(lines) > DAMAGE_ROUNDS // 10


def everything(history) -> None:
    history.runs()
    history.baselines()
    history.memory()
    result = history.results()
    for one in result:
        history.figures(one.snapshot)
        if one.snapshot is not None:
            history.inputs(one.snapshot)
    history.matrix(result, list(history.figure_table()))


def rewritten(site: Path, statement: str, *values: object) -> None:
    with sqlite3.connect(state(site) / "history.sqlite") as database:
        database.execute("PRAGMA foreign_keys = OFF")
        database.execute(statement, values)
    database.close()


@pytest.mark.parametrize(
    ("statement", "value"),
    [
        ("UPDATE vectors SET numbers = zeroblob(length(numbers))", None),
        ("UPDATE vectors SET numbers = substr(numbers, 9)", None),
        ("UPDATE layouts SET figures = ?", b"no zlib"),
        ("UPDATE inputs SET body = ?", b"\x78\x9c"),
        ("UPDATE runs SET libraries = ?", "{"),
        ("UPDATE runs SET started = ?", "yesterday"),
        ("DELETE FROM figures WHERE id = 1", None),
        ("DELETE FROM snapshots", None),
    ],
)
def test_what_sqlite_cannot_see_is_told_when_it_is_read(site, statement, value) -> None:
    rewritten(site, statement, *([] if value is None else [value]))
    damaged = pytest.raises(InputError, match=r"history\.sqlite: is damaged .*restore it from a copy")
    with damaged, open_history(state(site) / "history.sqlite") as history:
        everything(history)
    with pytest.raises((InputError, HistoryLost), match=r"history\.sqlite"):
        night(site, 4.0)


@pytest.mark.parametrize(
    "change",
    [
        "UPDATE subjects SET name = 'c' WHERE name = 'a'",
        "UPDATE subjects SET kind = 'studx' WHERE name = 'a'",
        "UPDATE results SET status = 'error' WHERE run = 2",
        "UPDATE results SET worst_id = worst_id || 'x' WHERE run = 1",
        "UPDATE results SET failed = failed + 1 WHERE run = 1",
        "UPDATE results SET message = 'x' WHERE run = 2",
        "UPDATE figures SET unit = 'dC' WHERE id = 1",
        "UPDATE figures SET name = name || 'x' WHERE id = 1",
        "UPDATE figures SET better = better + 1 WHERE id = 1",
        "UPDATE runs SET host = 'elsewhere' WHERE id = 1",
        "UPDATE runs SET finished = '2020-01-01T00:00:00+00:00' WHERE id = 2",
        "UPDATE baselines SET by = 'z'",
        "UPDATE baselines SET run = 3 - run",
        "UPDATE snapshots SET key = key || '0' WHERE id = 1",
    ],
)
def test_a_changed_name_or_status_is_damage(site, change: str) -> None:
    """Every text and count of the history is held by a checksum, not only its numbers."""
    path = state(site) / "history.sqlite"
    with sqlite3.connect(path) as database:
        changed = database.execute(change).rowcount
    database.close()
    assert changed
    with pytest.raises(InputError, match="is not what was written"), open_history(path):
        pass


@pytest.mark.parametrize(
    "change",
    [
        "UPDATE subjects SET name = x'ff00' WHERE id = 1",
        "UPDATE figures SET better = 'x'",
        "UPDATE figures SET unit = x'ff'",
        "UPDATE baselines SET by = x'ff'",
        "UPDATE results SET seconds = 'long'",
        "UPDATE vectors SET numbers = 'none'",
    ],
)
def test_a_value_of_another_kind_is_damage_even_with_its_sum(site, change: str) -> None:
    path = state(site) / "history.sqlite"
    database = sqlite3.connect(path)
    database.row_factory = sqlite3.Row
    with database:
        assert database.execute(change).rowcount
        database.execute("DELETE FROM sums")
        sums.write(database)
    database.close()
    with pytest.raises(InputError, match="another kind than its column"), open_history(path):
        pass


def test_sums_are_written_once_and_hold_over_nights(site) -> None:
    path = state(site) / "history.sqlite"
    with open_history(path) as history:
        before = history.connection.execute("SELECT * FROM sums ORDER BY kind, id").fetchall()
    night(site, 11.0)
    with open_history(path) as history:
        after = history.connection.execute("SELECT * FROM sums ORDER BY kind, id").fetchall()
    assert {tuple(row) for row in before} < {tuple(row) for row in after}
    assert {row[0] for row in after} == {"run", "figure", "approval"}
