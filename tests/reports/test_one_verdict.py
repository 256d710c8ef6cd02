"""The headline of a report, its page, its JSON and the exit status say the same."""

import json
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

import analyses.linear.loop_survey
from analyses.isolation import drain
from reports import document as doc
from reports.cli.app import build
from reports.verdict_summary import verdict_words


def made(*sections: doc.Section, kind: str = "report") -> Any:
    return doc.document(title="T", subtitle="", design={}, provenance={}, sections=sections, kind=kind)


def test_a_failed_section_fails_the_report() -> None:
    met = doc.verdict("a", "A", value=3.0, limit=2.0, unit="dB", distance=1.0, passed=True)
    good = doc.section("one", "One", [doc.verdicts([met])], status="pass")
    bad = doc.section("missing-linear", "Missing parts", [], status="fail")
    assert made(good)["verdict"]["passed"] is True
    whole = made(good, bad)
    assert whole["verdict"]["passed"] is False
    assert verdict_words(whole["verdict"]) == ["failed: Missing parts", "1 of 1 requirements met"]
    assert doc.loads(doc.dumps(whole))["verdict"] == whole["verdict"]
    assert made(good, bad, kind="validation")["verdict"]["passed"] is True  # its own verdicts decide


def test_a_section_with_a_failed_verdict_is_not_said_twice() -> None:
    missed = doc.verdict("a", "A", value=1.0, limit=2.0, unit="dB", distance=-1.0, passed=False)
    verdict = made(doc.section("one", "One", [doc.verdicts([missed])], status="fail"))["verdict"]
    assert verdict_words(verdict) == ["0 of 1 requirements met, 1 not met"]


def run(folder: Path, *changes: str) -> tuple[int, str, Any]:
    call = ["report", "ilr33-amber", "--no-validation", "--quiet", "--out", str(folder), *changes]
    done = CliRunner().invoke(build(), call)
    return done.exit_code, done.output, json.loads((folder / "report.json").read_text())


@pytest.mark.parametrize(
    ("slope", "status", "word"), [("-1", 0, "PASS"), ("1", 0, "PASS"), ("1e9", 1, "FAIL")]
)
def test_the_report_of_a_drive_under_a_slope(slope: str, status: int, word: str, tmp_path) -> None:
    """Held by the load, pushed by it, driven away by it."""
    changes = ("--set", "load.path=back-drivable", "--set", f"load.moment_slope={slope} N*m/rad")
    code, output, document = run(tmp_path, *changes)
    assert (code, document["verdict"]["passed"]) == (status, status == 0)
    assert output.lstrip().startswith(word)
    assert "could not be computed" not in json.dumps(document)
    if slope == "1":
        assert "unstable by itself, outer loops open and rotor free" in json.dumps(document)
        live = document["live"]  # the page has the loop by itself: what is asked of it is named apart
        assert {item["loop"] for item in live["requirements"] if item["loop"]} == {"velocity", "position"}
        assert "phase margin, current loop held" in [item["words"] for item in live["apart"]]


def test_a_missing_part_is_in_headline_and_json(tmp_path, monkeypatch) -> None:
    def fails(*_: Any) -> None:
        raise ZeroDivisionError("made up")

    monkeypatch.setattr(analyses.linear.loop_survey, "_other_form", fails)
    code, output, document = run(tmp_path)
    drain()
    assert code != 0
    assert document["verdict"]["passed"] is False
    assert document["verdict"]["failed_sections"] == ["Missing parts"]
    assert "FAIL" in output
    assert "failed: Missing parts" in output
    assert "failed: Missing parts" in (tmp_path / "report.html").read_text()
    titles = [part["title"] for part in document["sections"]]
    assert "Sampled, continuous, ideal" in titles  # of the sampled form alone
