"""The history: what is written comes back, what is as before is kept once, nothing half-written stays."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from actuator_lti.errors import InputError
from reports.nightly import history as files
from reports.nightly.figures import Figure
from reports.nightly.history import History, open_history
from reports.nightly.records import Result

ABOUT = {"code": "c", "code_commit": "", "study_commit": "", "host": "h", "libraries": {"numpy": "2"}}
Values = dict[str, float | None]


def add(history: History, values: Values | None, day: int = 1, unit: str = "dB", gain: str = "1") -> Result:
    """A night with one design; without a result where there are no values."""
    run = history.start_run(started=f"2026-01-{day:02d}T00:00:00Z", **ABOUT)
    result = Result(run=run.id, name="a", kind="design", status="pass" if values else "error", key=f"k{day}")
    figures = [Figure(name=n, value=v, unit=unit, better=1) for n, v in (values or {}).items()]
    reported = None if values is None else (figures, {"parameters": {"p": gain}})
    history.finish_run(run, "x", [(result, reported)])
    return history.night(run.id).by_name["a"]


@given(
    values=st.dictionaries(
        st.text(max_size=20).filter(lambda text: text.isprintable()),
        st.none() | st.floats(allow_nan=False, allow_infinity=False), min_size=1, max_size=8,
    )
)  # fmt: skip
@settings(max_examples=25)
def test_every_figure_comes_back_to_the_last_bit(tmp_path_factory, values) -> None:
    state = tmp_path_factory.mktemp("h")
    history = open_history(state)
    add(history, values)
    history = open_history(state)
    (result,) = history.results("a")
    assert {n: f.value for n, f in history.figures(result).items()} == values
    assert history.inputs(result) == {"parameters": {"p": "1"}}


@pytest.mark.parametrize(
    ("more", "homes"), [({}, [1, 1, 1]), ({"unit": "deg"}, [1, 2, 2]), ({"gain": "2"}, [1, 2, 2])]
)
def test_what_is_as_before_refers_to_the_night_that_has_it(tmp_path, more, homes) -> None:
    history = open_history(tmp_path)
    add(history, {"x": 1.0, "y": None})
    for day in (2, 3):
        add(history, {"x": 1.0, "y": None}, day, **more)
    history = open_history(tmp_path)
    results = history.results("a")
    assert [r.home for r in results] == homes
    assert history.inputs(results[2]) == {"parameters": {"p": more.get("gain", "1")}}
    assert history.figures(results[2])["x"].unit == more.get("unit", "dB")


def test_a_matrix_follows_figures_that_come_and_go_and_the_history_is_of_one_study(tmp_path) -> None:
    history = open_history(tmp_path)
    for day, values in enumerate([{"x": 1.0}, {"x": 2.0, "y": 5.0}, {"y": 6.0}, None], start=1):
        add(history, values, day)
    made = history.matrix(history.results("a"), ["x", "y"])
    nan = math.nan
    np.testing.assert_equal(made, [[1.0, nan], [2.0, 5.0], [nan, 6.0], [nan, nan]])
    assert [r.run for r in history.results("a", last=2)] == [3, 4]
    history = open_history(tmp_path)
    history.claim("one")
    history.claim("one")
    with pytest.raises(InputError, match="'one', not of 'two'"):
        history.claim("two")


NEWER = json.dumps({"schema": files.SCHEMA, "version": files.VERSION + 1, "index": 3})
NONE = "[" * 100_000, '{"schema": "other", "version": 1}'


@pytest.mark.parametrize(
    ("text", "words"),
    [(NEWER, r"has version 2.*use a newer"), *((text, "no history of a nightly") for text in NONE)],
)
def test_what_is_no_history_or_a_newer_one_is_refused(tmp_path, text, words) -> None:
    path: Path = tmp_path / files.INDEX
    path.write_text(text)
    with pytest.raises(InputError, match=words):
        open_history(tmp_path)
    assert path.read_text() == text
