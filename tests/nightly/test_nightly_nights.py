"""Whole nights: what is built, what is not built again, what changed and what is approved."""

import json
import re
from dataclasses import replace
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from nightly_fakes import CODE, INLINE, Calendar, job, study
from site_checks import check_whole

from actuator_lti.bounds import NIGHTLY_JOBS
from reports.nightly.changes import Columns, headlines
from reports.nightly.figures import Figure
from reports.nightly.history import History
from reports.nightly.moves import Tolerances, change_points, flaps, missing_nights, read_tolerances
from reports.nightly.night import approve, run_night
from reports.nightly.records import Result
from reports.nightly.source import Job, read_study
from reports.sections.nightly import section
from tests.refusals import refused


class Nights:
    """Runs one night a day on one site."""

    def __init__(self, site) -> None:
        self.site = site
        self.clock = Calendar()

    def __call__(self, *jobs: Job, days: int = 1, code=CODE, **more):
        self.clock.next(days)
        night = run_night(study(*jobs, **more), self.site, INLINE, code=code, clock=self.clock)
        check_whole(self.site)
        return night

    def approve(self, *jobs: Job, **more):
        words = {"by": "A. Engineer", "reason": "reviewed", **more}
        return approve(study(*jobs), self.site, settings=INLINE, clock=self.clock, **words)


@pytest.fixture
def nights(tmp_path) -> Nights:
    return Nights(tmp_path / "site")


def test_the_same_study_is_not_built_again(nights, tmp_path) -> None:
    log = tmp_path / "log"
    each = (("a", 10.0), ("b", 10.0), ("b", 11.0))
    a, b, moved = (job(name, margin, log=str(log)) for name, margin in each)

    def cached(*jobs: Job, **more) -> dict[str, bool]:
        return {d.name: d.result.cached for d in nights(*jobs, **more).designs}

    assert [cached(a, b), cached(a, b)] == [{"a": False, "b": False}, {"a": True, "b": True}]
    assert log.read_text().split() == ["a", "b"]
    assert cached(a, moved) == {"a": True, "b": False}
    assert cached(a, code=replace(CODE, sources="t")) == {"a": False}


def test_the_worst_comes_first_and_a_failed_requirement_fails_the_night(nights) -> None:
    part = job("only a part", 20.0, part="fail")  # that is no requirement, like the page of a whole study
    night = nights(job("good", 12.0), job("bad", 5.0), job("broken", mode="raise"), job("fair", 7.0), part)
    assert [d.name for d in night.designs] == ["broken", "bad", "only a part", "fair", "good"]
    assert [d.state for d in night.designs] == ["broken", "fail", "fail", "pass", "pass"]
    assert not night.passed
    assert nights(job("good", 12.0)).passed
    nights(job("a", 7.0))
    first = nights(job("a", 5.0)).designs[0].last_night.changes[0]
    assert (first.kind, first.worse) == ("verdict", True)


def test_what_is_not_stable_is_the_worst_and_a_comparison_that_fails_is_counted_apart(nights) -> None:
    whole = replace(job("All compared", 5.0), kind="comparison")
    night = nights(job("far", -9.0), job("torn", unstable=True), job("good", 12.0), whole)
    assert [d.name for d in night.designs] == ["torn", "far", "All compared", "good"]
    assert (night.designs[0].result.worst, night.designs[0].result.worst_id) == (None, "GM")
    assert night.counts == "2 failing, 1 passing; All compared: failing"
    for file, words in (
        ("summary.md", "| torn | ✗ failing | GM | not met | 0 |"),
        ("nights/*/torn-*.html", "the position loop is unstable"),
        ("nights/*/torn-*.html", "of a margin, in % of the distance from −1 that the limit keeps"),
        ("index.html", '<span class="worst neg">not met</span>'),
    ):
        assert words in next(nights.site.glob(file)).read_text()


def test_what_passes_says_no_more_than_what_was_asked_and_compared(nights) -> None:
    """The comparison of all is a row of its own, which no count has; the terminal's count is the page's."""
    jobs = job("a"), job("b"), replace(job("All compared"), kind="comparison")
    first, second = nights(*jobs), nights(*jobs)
    assert first.said_of_all == "All 2 designs are built and meet their requirements"
    more = "are no worse than the first night, as none is approved"
    assert second.said_of_all == f"All 2 designs are built, meet their requirements and {more}"
    bare = [replace(one, result=replace(one.result, total=0)) for one in first.designs]
    words = replace(first, designs=tuple(bare)).said_of_all
    assert words == "All 2 designs are built; no requirement is stated"
    index = (nights.site / "index.html").read_text()
    assert second.counts == "2 passing"
    assert all(words in index for words in ('Passing <span class="n">2<', second.said_of_all))


def test_a_change_is_told_with_the_parameter_library_or_code_behind_it(nights) -> None:
    nights(job("a", 10.0))
    (design,) = nights(job("a", 9.0)).designs
    first, cause = design.last_night.changes[0], design.last_night.cause
    assert (first.figure, first.delta) == ("GM: distance", pytest.approx(-1.0))
    assert cause.parameters == (("control.position.gain", "10 1/s", "9 1/s"),)
    assert not cause.code
    assert "parameter control.position.gain: 10 1/s → 9 1/s" in (nights.site / "summary.md").read_text()
    nights(job("a", 10.0, limit=6.0))
    newer = replace(CODE, sources="t", libraries={"numpy": "3"})
    changed = replace(job("a", 10.0), payload={"name": "a", "margin": 9.0})
    (design,) = nights(changed, code=newer).designs
    assert ("numpy", "2", "3") in design.last_night.cause.libraries
    assert design.last_night.cause.code


def test_a_limit_that_moved_is_the_cause_and_the_figure_stays(nights, tmp_path, monkeypatch) -> None:
    """The margin stays at 10 dB, its limit goes from 6 to 4 dB: 4 dB are left, then 6 dB."""
    limit = '[study]\nname = "s"\nbase = "ilr33-amber"\n[[requirement]]\nid = "GM"\n'
    path = tmp_path / "s.toml"

    def asked(least: float) -> Job:
        path.write_text(f'{limit}quantity = "gain_margin"\nloop = "position"\nminimum = "{least:g} dB"\n')
        return replace(job("a", 10.0, limit=least), keys=read_study(str(path)).jobs[0].keys)

    nights(asked(6.0))
    night = nights(asked(4.0))
    (told,) = headlines(night.designs)
    assert told.cause == "requirement.GM.minimum 6.0 → 4.0 dB"
    assert told.effect == "gain margin, distance to its limit 4.000 → 6.000 dB"
    known = History.inputs

    def earlier(self: History, of: Result) -> dict[str, Any]:  # whose nights kept the numbers alone
        return {key: one for key, one in known(self, of).items() if of.run > 2 or key != "keys"}

    monkeypatch.setattr(History, "inputs", earlier)
    assert nights(asked(6.0)).designs[0].last_night.cause.parameters == ()


def test_moves_within_the_tolerance_are_none_and_flapping_is_told_apart(nights) -> None:
    nights(job("a", 10.0))
    assert not nights(job("a", 10.005)).designs[0].last_night.changes
    wide = read_tolerances({"*": "5 dB"}, "t")
    assert not nights(job("a", 12.0), tolerances=wide).designs[0].last_night.changes
    assert nights(job("a", 14.0), tolerances=read_tolerances({"*": 1.0}, "t")).designs[0].last_night.changes
    for k in range(6):
        night = nights(job("flaps", 10.0 + k % 2), job("moves", 10.0 if k < 5 else 12.0))
    result = {d.name: d.last_night.changes for d in night.designs}
    assert {c.flapping for c in result["flaps"]} == {True}
    assert {c.flapping for c in result["moves"]} == {False}


def test_a_regression_counts_until_it_is_approved_by_itself_however_slow_the_drift(nights) -> None:
    nights(job("a", 10.0))
    night = nights(job("a", 9.0))
    assert (night.designs[0].state, night.passed) == ("regression", False)
    assert "nobody has approved" in night.designs[0].baseline.note
    (row,) = section(night)["blocks"][0]["rows"]
    said = "figures worse than the first night, as none is approved"
    assert re.fullmatch(rf"\d+ {said}; first gain margin 10.00 → 9.000 dB", row["why"])
    assert said.partition(" ")[2] in max(nights.site.glob("nights/*/a-*.html")).read_text()
    assert said.replace("figures", "figure(s)") in (nights.site / "junit.xml").read_text()
    again = nights(job("a", 9.0))
    assert not again.passed
    assert not again.designs[0].last_night.changes
    assert nights.approve(job("a", 9.0)).passed
    night = nights(job("a", 9.0))
    assert (night.passed, night.designs[0].approval.by) == (True, "A. Engineer")
    assert not nights(job("a", 8.0)).passed
    assert nights(job("a", 9.5)).passed
    drift = [nights(job("drifts", 10.0 - 0.008 * step)) for step in range(12)]
    assert not any(night.designs[0].last_night.changes for night in drift)
    assert not drift[-1].passed
    nights(job("one", 10.0), job("two", 10.0))
    nights(job("one", 9.0), job("two", 9.0))
    night = nights.approve(job("one", 9.0), job("two", 9.0), names=["one"])
    assert {d.name: d.state for d in night.designs} == {"one": "pass", "two": "regression"}


def test_an_approval_needs_a_name_a_reason_and_a_result_and_a_site_its_own_folder(nights, tmp_path) -> None:
    refused(nights.approve, job("a"), words="no night has been built")
    nights(job("a"), job("b", mode="raise"))
    refused(nights.approve, job("a"), reason=" ", words="needs a name and a reason")
    refused(nights.approve, job("a"), names=["b"], words="'b' has no result")
    other = tmp_path / "other"
    other.mkdir()
    (other / "thesis.tex").write_text("x")
    refused(run_night, study(job("a")), other, INLINE, code=CODE, words="not empty and no site")
    assert sorted(p.name for p in other.iterdir()) == ["thesis.tex"]


def test_missing_results_and_missing_nights_are_no_changes(nights) -> None:
    nights(job("a", 10.0), job("b"))
    a, b = nights(job("a", 10.0, mode="raise", words="no such gear"), job("b")).designs
    assert (a.broken, a.last_night.changes, b.state) == (True, (), "pass")
    assert a.result.message.startswith("ValueError: no such gear")
    back = next(d for d in nights(job("a", 10.0), job("b")).designs if d.name == "a")
    assert not back.last_night.changes
    assert "1 night(s) without a result" in back.last_night.note
    night = nights(job("a", 10.0))
    assert night.gone == ("b",)
    told = "In the study last night, not tonight: b."
    assert f"{section(night)['result']}." == f"night 4: 1 passing (1 unchanged). {told}"
    assert all(told in (nights.site / file).read_text() for file in ("index.html", "summary.md"))
    left = ElementTree.parse(nights.site / "junit.xml").find("testsuite[@name='b']/testcase")
    assert (left.get("name"), left.find("skipped") is not None) == ("is in the study", True)
    for days in (4, 1):  # nights without a run are shown as such
        night = nights(job("a", 10.0), days=days)
    assert night.missing == ((3, 3),)
    assert "3 nights without a run" in (nights.site / "index.html").read_text()
    assert not night.designs[0].last_night.changes


def test_machine_files_say_what_the_page_says_also_of_what_is_not_proven_or_waived(nights) -> None:
    waiver = {"unknown": True, "waiver": "waived 2026-11-22: bench"}
    night = nights(job("doubt", unknown=True), job("waived", **waiver))
    assert (night.passed, [d.state for d in night.designs]) == (False, ["unproven", "pass"])
    summary = json.loads((nights.site / "summary.json").read_text())
    doubt, waived = sorted(summary["designs"], key=lambda one: one["name"])
    assert (doubt["state"], doubt["requirements"][0]["verdict"]) == ("unproven", "not proven")
    assert (waived["state"], waived["requirements"][0]["waiver"]) == ("pass", waiver["waiver"])
    every = ElementTree.parse(nights.site / "junit.xml").iter("testcase")
    cases = {one.get("classname"): one for one in every if one.get("name") == "GM gain margin"}
    assert cases["doubt"].find("failure").get("type") == "not proven"
    assert cases["waived"].find("skipped").get("message") == f"not determined; {waiver['waiver']}"
    assert "not proven" in (nights.site / "index.html").read_text()
    assert nights(job("waived", **waiver)).passed
    nights(job("good", 12.0), job("bad", 5.0), job("broken", mode="raise"))
    summary = json.loads((nights.site / "summary.json").read_text())
    assert (summary["schema"], summary["exit_status"]) == ("actuator-lti/nightly", 1)
    assert summary["counts"] == {"broken": 1, "fail": 1, "unproven": 0, "regression": 0, "pass": 1}
    root = ElementTree.parse(nights.site / "junit.xml").getroot()
    assert [root.get(k) for k in ("tests", "failures", "errors", "skipped")] == ["8", "1", "1", "1"]
    failed = [c.get("name") for c in root.iter("testcase") if c.find("failure") is not None]
    assert failed == ["GM gain margin"]
    assert "✗ failing" in (nights.site / "summary.md").read_text()


def test_old_reports_go_and_old_figures_stay(nights) -> None:
    settings = replace(INLINE, keep=3)
    for k in range(8):
        nights.clock.next()
        run_night(study(job("a", 10.0 + k)), nights.site, settings, code=CODE, clock=nights.clock)
    check_whole(nights.site)
    assert len(list((nights.site / "reports").glob("*/*"))) == 3
    page = next((nights.site / "nights").glob("000008-*/a-*.html")).read_text()
    assert page.count('aria-label="Report of') == 3
    assert "between 10.00 and 17.00 over 8 nights" in page


@pytest.mark.parametrize(("jobs", "words"), [
    ([Job(name=str(k)) for k in range(NIGHTLY_JOBS.most + 1)], f"at most {NIGHTLY_JOBS.most}"),
    ([job("a"), job("a")], "used twice"),
    ([job("a" * 20001)], "at most 20000 allowed"),
    *(([job(name)], "a name needs at least one sign") for name in ("", " \n", "\ud800")),
], ids=["too many", "twice", "too long", "empty", "blank", "half a sign"])  # fmt: skip
def test_a_study_that_cannot_be_is_refused_with_the_limit(tmp_path, jobs: list[Job], words: str) -> None:
    refused(run_night, study(*jobs), tmp_path / "s", INLINE, code=CODE, words=words)
    assert not (tmp_path / "s").exists()


def test_change_points_of_known_steps_are_found_to_the_night_and_noise_has_none() -> None:
    rng = np.random.default_rng(3)
    clean = np.concatenate([np.full(40, 9.4), np.full(30, 8.1), np.full(30, 8.6)])
    assert [p.index for p in change_points(clean, 0.05)] == [40, 70]
    for values, wanted in ((clean + 0.1 * rng.standard_normal(100), [40, 70]), (clean[:41], [40])):
        assert [p.index for p in change_points(values, 0.05)] == wanted
    rng = np.random.default_rng(4)
    result = [change_points(rng.standard_normal(200), 0.05) for _ in range(20)]
    assert sum(map(len, result)) <= 4
    for values in ([1.0, 1.0, 1.04, 1.04], [np.nan, 1.0]):
        assert change_points(np.array(values), 0.05) == ()
    courses = ([1.0] * 5 + [2.0] * 5, np.arange(10.0), [1.0, 2.0, 1.0, np.nan, 2.0, 1.0])
    assert [flaps(course, 0.1) for course in courses] == [False, False, True]
    assert missing_nights([f"2026-01-01T{h:02d}:0{m}:00Z" for h in range(3) for m in range(3)]) == ()


def test_figures_that_appear_or_vanish_are_changes_without_a_side() -> None:
    columns = Columns([Figure(name=name, value=None, better=1) for name in "xy"], Tolerances())
    result = columns.compare(np.array([1.0, np.nan]), np.array([np.nan, 1.0]))
    assert [(c.figure, c.worse) for c in result] == [("x", None), ("y", None)]
