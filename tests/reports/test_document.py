"""The document: plain JSON, versioned, complete."""

import json
from functools import reduce
from operator import getitem
from typing import Any

import numpy as np
import pytest

from actuator_lti.asked.verdict import Verdict
from reports import document as doc
from reports.charts.chart import Chart
from reports.numbers import fixed, show, significant
from reports.verdict_summary import verdict_lines, verdict_of, verdict_words
from tests.refusals import refused

ALL_MET = {"met": 2, "not_met": 0, "not_proven": 1, "waived": 0}
CURVE = ("columns", 0, "panels", 0, "items", 0)


def judged(id: str, passed: bool | None, value: float | None = None) -> doc.VerdictItem:
    return doc.verdict(id, id.upper(), value=value, limit=2.0, unit="dB", comparison=">=", passed=passed)


def made(**changes: Any) -> dict[str, Any]:
    met = doc.details("More", [doc.verdicts([judged("c", True, 3.0)])])
    blocks = [doc.verdicts([judged("a", False, 1.0), judged("b", None)]), met]
    parts = [doc.section("one", "One", blocks, status="fail")]
    base = doc.document(title="t", subtitle="", design={}, provenance={}, sections=parts)
    return {**base, **changes}


def holding(blocks: list[Any], **section: Any) -> str:
    return json.dumps(made(sections=[doc.section("x", "X", blocks, **section)]))


@pytest.mark.parametrize(("passed", "waiver", "word", "lines"), [
    ((True, None), "", "not proven", [("1 of 2 requirements met, 1 not proven", "warn")]),
    ((True, None), "waived", "met", [("1 of 2 requirements met, 1 waived", "pass")]),
    ((None,), "waived", "met", [("0 of 1 requirements met, 1 waived", "info")]),
    ((None, False), "waived", "not met", [("0 of 2 requirements met, 1 not met, 1 waived", "fail")]),
    ((), "", "met", [("the design states no requirements", "info")]),
])  # fmt: skip
def test_not_proven_is_neither_good_nor_passed_unless_it_is_waived(passed, waiver, word, lines):
    items = [judged(f"v{k}", one) | {"waiver": waiver * (one is None)} for k, one in enumerate(passed)]
    result = verdict_of([doc.section("one", "One", [doc.verdicts(items)])], "report")
    assert (result["verdict"], result["passed"]) == (word, word == "met")
    assert verdict_lines(result) == lines


BARE = doc.section("missing", "Missing parts", [], status="fail")
OPEN = doc.section("margins", "Margins", [], status="warn", verdict=Verdict.NOT_PROVEN)
CHECKED = doc.section("two", "Two", [doc.verdicts([judged("d", True)], what="checks")])
REFUTED = doc.section("two", "Two", [doc.verdicts([judged("d", False)], what="checks")])
GOOD = doc.section("one", "One", [doc.verdicts([judged("a", True)])])


@pytest.mark.parametrize(("parts", "kind", "word", "said"), [
    ([*made()["sections"], CHECKED], "report", "not met",  # wherever they stand
     ["1 of 3 requirements met, 1 not met, 1 not proven", "1 of 1 checks by simulation met"]),
    ([OPEN], "report", "not proven", ["not proven: Margins", "the design states no requirements"]),
    ([REFUTED], "report", "not met",  # what decides it first
     ["0 of 1 checks by simulation met, 1 not met", "the design states no requirements"]),
    ([OPEN], "compare", "not proven", ["not proven: Margins"]),
    ([GOOD, BARE], "report", "not met", ["failed: Missing parts", "1 of 1 requirements met"]),
    ([GOOD, BARE], "validation", "met", ["1 of 1 requirements met"]),  # its own verdicts decide
    (made()["sections"], "report", "not met", ["1 of 3 requirements met, 1 not met, 1 not proven"]),
])  # fmt: skip
def test_a_document_is_as_good_as_its_worst_part(parts: list[Any], kind: str, word: str, said: list[str]):
    """A section that has failed or is open by itself counts; one whose verdict fails is not said twice."""
    whole = doc.document(title="T", subtitle="", design={}, provenance={}, sections=parts, kind=kind)
    assert (whole["verdict"]["verdict"], whole["verdict"]["passed"]) == (word, word == "met")
    assert verdict_words(whole["verdict"]) == said
    assert doc.loads(doc.dumps(whole))["verdict"] == whole["verdict"]


def test_what_json_cannot_hold_becomes_null_or_is_refused() -> None:
    held = {"a": np.array([1.0, np.nan, np.inf]), 2: np.int64(3), "b": np.bool_(True)}
    assert doc.plain(held) == {"a": [1.0, None, None], "2": 3, "b": True}
    with pytest.raises(TypeError, match="complex"):
        doc.plain([1j])


@pytest.mark.parametrize(("content", "words"), [
    ("{", "not JSON"),
    ("[" * 100_000, "nested too deeply"),
    ('{"schema": "actuator-lti/report", "version": NaN}', "NaN is not allowed"),
    ("[]", "schema must be"),
    (json.dumps({"schema": doc.SCHEMA, "version": 1, "sections": []}), "version = 1"),
    (holding([{"kind": "magic"}]), r"sections\[1\].blocks\[1\].*'magic' found using 'kind'"),
    (holding([{"kind": "text"}]), r"sections\[1\].blocks\[1\].text: field required"),
    (holding([], status="good"), r"sections\[1\].status = \"good\": .*'pass', 'fail'"),
    (json.dumps(made(sections=[doc.section("x", "X", [])] * 2)), 'section "x" occurs twice'),
])  # fmt: skip
def test_a_page_is_not_made_of_a_broken_document(content: str, words: str) -> None:
    refused(doc.loads, content, "some.json", match=f"^some.json: .*{words}")


@pytest.mark.parametrize(
    "change", [{"passed": True}, {"verdict": "not proven"}, {"parts": {"requirements": ALL_MET}}]
)
def test_a_verdict_that_is_not_that_of_its_sections_is_refused(change: dict[str, Any], tmp_path) -> None:
    path = tmp_path / "report.json"
    path.write_text(doc.dumps(made()), encoding="utf-8")
    assert doc.load(path) == made()
    path.write_text(doc.dumps({**made(), "verdict": made()["verdict"] | change}), encoding="utf-8")
    refused(doc.load, path, words="report.json: verdict")


@pytest.mark.parametrize(("place", "value", "words"), [
    (("columns",), [], "columns: a chart has at least one"),
    (("columns", 0, "heights"), [0], r"columns\.0\.heights\.0: input should be greater than 0"),
    (("columns", 0, "panels", 0, "x", "seen"), [-1e308, 1e308], "OverflowError"),
    ((*CURVE, "x"), [], "ValueError"),
    ((*CURVE, "y"), [1.0], "ValueError"),
    ((*CURVE, "x"), ["a", 1, 2], r"columns\.0\.panels\.0\.items\.0\.curve\.x: .*'a'"),
    ((*CURVE, "look"), {"marker": "?"}, "KeyError"),
    ((*CURVE, "look"), {"colour": 'red"/><b>'}, r"columns\..*\.look\.colour: .*allowed: ink"),
])  # fmt: skip
def test_a_figure_that_cannot_be_drawn_is_refused_where_it_is_read(place, value, words, tmp_path):
    chart = Chart()
    chart.panel().curve([0.0, 1.0, 2.0], [3.0, None, 4.0], "k")
    first, second = (doc.figure(name, chart, caption="c", alt="a") for name in ("bode", "distribution"))
    path, parts = tmp_path / "report.json", [doc.section("one", "One", [first, second])]
    written = json.dumps(made(sections=parts, verdict=verdict_of(parts, "report")))
    path.write_text(written)
    assert len(doc.figures(doc.load(path))) == 2
    damaged = json.loads(written)
    *way, last = place
    reduce(getitem, way, damaged["sections"][0]["blocks"][1]["chart"])[last] = value
    path.write_text(json.dumps(damaged))
    where = r"report\.json: figure 2 \(distribution\): its data cannot be drawn"
    refused(doc.load, path, match=rf"{where} \({words}")


@pytest.mark.parametrize("format", ["sig:0", "short:0", "ms:0", "sig", "fix:99", "sig:3x", ""])
def test_a_column_that_no_number_can_be_written_by_is_refused(format: str) -> None:
    table = doc.table("T", [doc.column("a", "A", format=format)], [{"a": 1.5}])
    refused(doc.loads, holding([table]), "some.json", words="columns[1].format")


def test_numbers_carry_their_digits_and_a_true_minus() -> None:
    assert (significant(0.00099996, 3), significant(999_999.6, 3)) == ("0.00100", "1.00×10⁶")
    assert (significant(-2.5e-7, 2), fixed(-0.001, 2)) == ("−2.5×10⁻⁷", "0.00")
    assert [show(value) for value in (True, 9.40, "<b>")] == ["yes", "9.4", "<b>"]
