"""The history comes back; a full disk, a read-only site, damaged caches are one line, nothing is lost."""

import json
import math
import os
import re
import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from nightly_fakes import CODE, INLINE, job, study
from site_checks import check_whole

from actuator_lti.errors import InputError
from reports.nightly import history as files
from reports.nightly.figures import Figure
from reports.nightly.history import History, open_history
from reports.nightly.night import run_night
from reports.nightly.records import Result
from tests.refusals import refused

TOLD = "No space left on device|disk is full|disk I/O error"


@pytest.fixture
def small_disk(tmp_path) -> Iterator[Path]:
    """A file system of 16 MB, where this process may mount one."""
    place = tmp_path / "disk"
    place.mkdir()
    mount("-t", "tmpfs", "-o", "size=16m", "tmpfs", str(place))
    yield place
    subprocess.run(["umount", "-l", str(place)], check=False, capture_output=True)


def mount(*words: str) -> None:
    """Skip the test where that may not be done."""
    try:
        subprocess.run(["mount", *words], capture_output=True, check=True)
    except (OSError, subprocess.CalledProcessError) as error:
        pytest.skip(f"no mount here: {error}")


def nightly(site: Path, margin: float, **more):
    return run_night(study(*(job(f"d{k}", margin) for k in range(5))), site, INLINE, code=CODE, **more)


def test_a_disk_that_fills_up_at_any_point_leaves_the_last_night(small_disk: Path) -> None:
    site = small_disk / "site"
    nightly(site, 10.0)
    refused = 0
    for step, leave in enumerate(range(0, 690_000, 23_000)):
        ballast, free = small_disk / "ballast", os.statvfs(small_disk)
        ballast.write_bytes(b"\0" * max(0, free.f_bavail * free.f_frsize - leave))
        before, words = (site / "index.html").read_bytes(), ""
        try:
            nightly(site, 11.0 + step)
        except InputError as error:
            words = str(error)
        assert words or leave
        if words:
            refused += 1
            assert re.fullmatch(rf".*({TOLD}).*", words), words
            assert (site / "index.html").read_bytes() == before
        check_whole(site)
        ballast.unlink()
    assert refused >= 5
    nightly(site, 99.0)
    assert "did not end" in check_whole(site).text


def test_a_read_only_site_keeps_the_old_night_and_catches_up(tmp_path) -> None:
    site = tmp_path / "site"
    nightly(site, 10.0)
    before = (site / "index.html").read_bytes()
    mount("--bind", str(site), str(site))
    try:
        mount("-o", "remount,ro,bind", str(site))
        refused(nightly, site, 11.0, words="Read-only file system")
        assert (site / "index.html").read_bytes() == before
        check_whole(site)
    finally:
        subprocess.run(["umount", str(site)], check=True, capture_output=True)
    nightly(site, 11.0)
    check_whole(site)


def test_a_result_that_cannot_be_read_back_makes_no_night_without_verdicts(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr("reports.nightly.cache.MAX_ENTRY_BYTES", 100)
    refused(nightly, tmp_path / "site", 10.0, words="vanished from the cache")
    assert not (tmp_path / "site" / "index.html").exists()


def test_a_site_that_cannot_be_written_at_the_end_is_published_next_time(tmp_path, monkeypatch) -> None:
    site = tmp_path / "site"
    nightly(site, 10.0)
    before = (site / "index.html").read_bytes()

    def refuse(_night, folder: str) -> str:
        assert list((site / folder).glob("d0-*.html"))  # the pages are there
        raise InputError("cannot write: Read-only file system", where=str(site / "index.html"))

    with monkeypatch.context() as patch:
        patch.setattr("reports.nightly.pages.index", refuse)
        refused(nightly, site, 11.0, words="Read-only")
    assert (site / "index.html").read_bytes() == before
    assert len(list((site / "nights").iterdir())) == 1
    night = nightly(site, 11.0)
    assert (len(night.runs), {d.result.cached for d in night.designs}) == (3, {True})
    check_whole(site)


def test_a_corrupt_cache_entry_is_told_and_built_again(tmp_path) -> None:
    """What else is damage to an entry: test_nightly_parts.py."""
    site, said = tmp_path / "site", []
    nightly(site, 10.0)
    for entry in (tmp_path / "site.state" / "cache").glob("*/*.entry"):
        entry.write_bytes(entry.read_bytes()[:-9])
    night = nightly(site, 10.0, say=said.append)
    assert [bool(re.search("is corrupt.*built again", line)) for line in said] == [True] * 5
    assert not any(d.result.cached for d in night.designs)
    check_whole(site)


def test_a_report_that_was_damaged_on_the_site_is_put_right(tmp_path) -> None:
    site = tmp_path / "site"
    nightly(site, 10.0)
    report = next(site.glob("reports/*/*/report.html"))
    whole = report.read_bytes()
    report.write_bytes(b"half")
    nightly(site, 10.0)
    assert report.read_bytes() == whole


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
    add(open_history(state), values)
    history = open_history(state)
    (result,) = history.results("a")
    assert {n: f.value for n, f in history.figures(result).items()} == values
    assert history.inputs(result) == {"parameters": {"p": "1"}}


@pytest.mark.parametrize(
    ("more", "homes"), [({}, [1, 1, 1]), ({"unit": "deg"}, [1, 2, 2]), ({"gain": "2"}, [1, 2, 2])]
)
def test_what_is_as_before_refers_to_the_night_that_has_it(tmp_path, more, homes) -> None:
    history = open_history(tmp_path)
    for day, own in enumerate(({}, more, more), 1):
        add(history, {"x": 1.0, "y": None}, day, **own)
    history = open_history(tmp_path)
    results = history.results("a")
    assert [r.home for r in results] == homes
    assert history.inputs(results[2]) == {"parameters": {"p": more.get("gain", "1")}}
    assert history.figures(results[2])["x"].unit == more.get("unit", "dB")


def test_a_matrix_follows_figures_that_come_and_go_and_the_history_is_of_one_study(tmp_path) -> None:
    history = open_history(tmp_path)
    for day, values in enumerate([{"x": 1.0}, {"x": 2.0, "y": 5.0}, {"y": 6.0}, None], start=1):
        add(history, values, day)
    made, nan = history.matrix(history.results("a"), ["x", "y"]), math.nan
    np.testing.assert_equal(made, [[1.0, nan], [2.0, 5.0], [nan, 6.0], [nan, nan]])
    assert [r.run for r in history.results("a", last=2)] == [3, 4]
    for _ in range(2):
        history.claim("one")
    refused(history.claim, "two", words="'one', not of 'two'")


NEWER = json.dumps({"schema": files.SCHEMA, "version": files.VERSION + 1, "index": 3})
NONE = "[" * 100_000, '{"schema": "other", "version": 1}'


@pytest.mark.parametrize(
    ("text", "words"),
    [(NEWER, ("has version 2", "use a newer")), *((text, "no history of a nightly") for text in NONE)],
)
def test_what_is_no_history_or_a_newer_one_is_refused(tmp_path, text, words) -> None:
    path: Path = tmp_path / files.INDEX
    path.write_text(text)
    refused(open_history, tmp_path, words=words)
    assert path.read_text() == text
