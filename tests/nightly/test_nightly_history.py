"""The history: what is written comes back, schemas migrate openly, nothing half-written stays."""

from __future__ import annotations

import math
import sqlite3

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from actuator_lti.errors import InputError
from reports.nightly import schema
from reports.nightly.figures import Figure
from reports.nightly.history import open_history
from reports.nightly.records import NewResult

RUN = {"started": "2026-01-01T00:00:00Z", "code": "c", "code_commit": "", "study_commit": "", "host": "h"}


def start(history, day: int = 1) -> int:
    return history.start_run({**RUN, "started": f"2026-01-{day:02d}T00:00:00Z", "libraries": {"numpy": "2"}})


def result(
    name: str = "a", key: str = "k", values: dict[str, float | None] | None = None, **more
) -> NewResult:
    figures = [Figure(name=n, value=v, unit="dB", better=1) for n, v in (values or {"x": 1.0}).items()]
    return NewResult(name=name, kind="design", status="pass", key=key, figures=figures, **more)


@given(
    values=st.dictionaries(
        st.text(max_size=20), st.none() | st.floats(allow_nan=False), min_size=1, max_size=8
    )
)
@settings(max_examples=25, deadline=None)
def test_every_figure_comes_back_to_the_last_bit(tmp_path_factory, values) -> None:
    with open_history(tmp_path_factory.mktemp("h") / "h.sqlite") as history:
        run = start(history)
        history.finish_run(run, "2026-01-01T01:00:00Z", [result(values=values)])
        (row,) = history.results(run=run)
        outcome = history.figures(row.snapshot)
        assert {n: f.value for n, f in outcome.items()} == values


def test_an_unchanged_result_is_stored_once(tmp_path) -> None:
    with open_history(tmp_path / "h.sqlite") as history:
        for day in (1, 2, 3):
            history.finish_run(
                start(history, day), "x", [result(cached=day > 1, inputs={"parameters": {"p": "1"}})]
            )
        assert history.connection.execute("SELECT count(*) FROM snapshots").fetchone()[0] == 1
        assert [r.cached for r in history.results(name="a")] == [False, True, True]
        assert history.inputs(history.results(name="a")[0].snapshot)["parameters"] == {"p": "1"}


def test_the_same_numbers_from_other_code_are_stored_once(tmp_path) -> None:
    with open_history(tmp_path / "h.sqlite") as history:
        for day in (1, 2, 3):
            history.finish_run(start(history, day), "x", [result(key=f"k{day}")])
        counts = [
            history.connection.execute(f"SELECT count(*) FROM {t}").fetchone()[0]
            for t in ("snapshots", "vectors")
        ]
        assert counts == [3, 1]


def test_a_matrix_follows_figures_that_come_and_go(tmp_path) -> None:
    with open_history(tmp_path / "h.sqlite") as history:
        for day, values in enumerate([{"x": 1.0}, {"x": 2.0, "y": 5.0}, {"y": 6.0}], start=1):
            history.finish_run(start(history, day), "x", [result(key=f"k{day}", values=values)])
        history.finish_run(start(history, 4), "x", [NewResult(name="a", kind="design", status="error")])
        numbers = [i for i, f in sorted(history.figure_table().items())]
        made = history.matrix(history.results(name="a"), numbers)
        nan = math.nan
        np.testing.assert_equal(made, [[1.0, nan], [2.0, 5.0], [nan, 6.0], [nan, nan]])


def test_a_night_enters_whole_or_not_at_all(tmp_path) -> None:
    path = tmp_path / "h.sqlite"
    with open_history(path) as history:
        history.finish_run(start(history), "x", [result()])
        run = start(history, 2)
        with pytest.raises(sqlite3.IntegrityError):
            history.finish_run(run, "x", [result(key="k2"), result(key="k3"), result(key="k3")])
    with open_history(path) as history:
        assert len(history.runs()) == 1
        assert (
            history.connection.execute("SELECT count(*) FROM results WHERE run = ?", (run,)).fetchone()[0]
            == 0
        )
        start(history, 3)
        assert history.interrupted() == ["2026-01-02T00:00:00Z"]


def version_1(path) -> None:
    old = sqlite3.connect(path)
    old.executescript(schema.STEPS[0])
    old.execute(f"PRAGMA application_id = {schema.APPLICATION_ID}")
    old.execute("PRAGMA user_version = 1")
    old.execute("INSERT INTO runs VALUES (7, '2025-12-31T00:00:00Z', 'x', 'done', 'c', '', '{}', 'h')")
    old.execute("INSERT INTO baselines VALUES (1, 7, 't', 'somebody', 'good')")
    old.commit()
    old.close()


def test_an_older_history_is_brought_up_to_date_and_says_so(tmp_path) -> None:
    path = tmp_path / "h.sqlite"
    version_1(path)
    with open_history(path) as history:
        assert history.notice is not None
        assert "from version 1 to 3" in history.notice
        assert history.runs()[0].study_commit == ""
        assert history.baselines()[0].by == "somebody"
        assert history.baselines()[0].name is None
    copy = sqlite3.connect(tmp_path / "h.version-1.sqlite")
    assert copy.execute("PRAGMA user_version").fetchone()[0] == 1
    assert copy.execute("SELECT count(*) FROM runs").fetchone()[0] == 1
    copy.close()
    with open_history(path) as history:
        assert history.notice is None


def test_a_failing_step_leaves_the_old_version(tmp_path, monkeypatch) -> None:
    path = tmp_path / "h.sqlite"
    version_1(path)
    monkeypatch.setattr(schema, "STEPS", (schema.STEPS[0], "ALTER TABLE runs ADD COLUMN z TEXT; NO SQL"))
    with pytest.raises(InputError, match="cannot be read or written"), open_history(path):
        pass
    plain = sqlite3.connect(path)
    assert plain.execute("PRAGMA user_version").fetchone()[0] == 1
    assert "z" not in [r[1] for r in plain.execute("PRAGMA table_info(runs)")]
    plain.close()


def test_a_newer_history_is_refused(tmp_path) -> None:
    path = tmp_path / "h.sqlite"
    with open_history(path) as history:
        history.connection.execute(f"PRAGMA user_version = {schema.VERSION + 1}")
    with (
        pytest.raises(InputError, match=rf"schema version {schema.VERSION + 1}.*use a newer"),
        open_history(path),
    ):
        pass


@pytest.mark.parametrize(
    "content", [b"no database at all, but long enough to be read as a header" * 40, None]
)
def test_what_is_no_history_is_refused(tmp_path, content) -> None:
    path = tmp_path / "h.sqlite"
    if content is None:
        other = sqlite3.connect(path)
        other.execute("CREATE TABLE t(x)")
        other.commit()
        other.close()
    else:
        path.write_bytes(content)
    before = path.read_bytes()
    with pytest.raises(InputError, match="no history of a nightly"), open_history(path):
        pass
    assert path.read_bytes() == before


def test_the_history_of_one_study_is_not_taken_for_that_of_another(tmp_path) -> None:
    with open_history(tmp_path / "h.sqlite") as history:
        history.claim("one")
        history.claim("one")
        with pytest.raises(InputError, match="'one', not of 'two'"):
            history.claim("two")


def test_each_row_has_a_sum_of_its_own_and_writing_one_reads_no_other(tmp_path) -> None:
    path = tmp_path / "h.sqlite"
    with open_history(path) as history:
        for day in (1, 2, 3):
            values = {"x": float(day), f"only {day}": 1.0}
            history.finish_run(start(history, day), "x", [result(key=f"k{day}", values=values)])
        known = {(row[0], row[1]): row[2] for row in history.connection.execute("SELECT * FROM sums")}
        assert set(known) == {("run", 1), ("run", 2), ("run", 3)} | {("figure", k) for k in range(1, 5)}
        history.connection.execute("UPDATE results SET message = 'changed' WHERE run = 2")
        run = start(history, 4)
        history.finish_run(run, "x", [result(key="k4", values={"x": 4.0})])
        after = {(row[0], row[1]): row[2] for row in history.connection.execute("SELECT * FROM sums")}
        assert {key: after[key] for key in known} == known
        assert set(after) - set(known) == {("run", run)}
    with pytest.raises(InputError, match="run 2 is not what was written"), open_history(path):
        pass
