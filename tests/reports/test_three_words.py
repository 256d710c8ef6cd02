"""Met, not met, not proven: the same words, counts and exit status wherever a requirement is judged."""

import json
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import pytest

import analyses.linear.loop_survey
from actuator_lti import assemble_loops, stability_margins
from actuator_lti.asked.verdict import Verdict
from actuator_lti.design import design_hash, load_design, read_design_text, write_design
from actuator_lti.design.model import Design, Requirement, Waiver
from analyses.corners import corners
from analyses.isolation import drain
from analyses.linear import loop_figures
from analyses.margins import run
from analyses.validation import CHECKS, validate
from reports.analyses import FURTHER
from reports.build import further_sections
from reports.document import load
from reports.pdf import printable
from reports.sections.corners import summary as corners_summary
from reports.sections.validation import section
from reports.terminal import HEADS
from reports.verdict_summary import verdict_of
from tests.changed import changed
from tests.command_line import Command, Ran
from tests.refusals import refused

HOT = Requirement(id="hot", quantity="winding_temperature", unit="degC", maximum=100.0)
WAIVED = Waiver(requirement="hot", reason="the motor is outside", date="2026-11-22")
checked = cache(lambda: validate(load_design("emps"), CHECKS))
CASES = pytest.mark.parametrize(
    ("waivers", "status", "head"), [((), 1, "NOT PROVEN"), ((WAIVED,), 0, "PASS")], ids=["bare", "waived"]
)


def asking(*waivers: Waiver, of: str = "ilr33-amber", requirements: Any = (HOT,)) -> Design:
    """A drive that states no thermal resistance: the temperature of its winding cannot be judged."""
    return replace(load_design(of), requirements=requirements, waivers=waivers)


@pytest.fixture
def written(tmp_path) -> Callable[[Design], Path]:
    def call(design: Design) -> Path:
        (tmp_path / "d.toml").write_text(write_design(design), encoding="utf-8")
        return tmp_path / "d.toml"

    return call


@CASES
def test_margins_and_report_say_the_same(waivers, status, head, written, tmp_path, cli):
    path = written(asking(*waivers, of="ctms-motor-position"))
    said = cli.text("margins", path, status=status)
    assert said.startswith(f"{head}  ")
    assert f"0 of 1 requirements met, 1 {'waived' if waivers else 'not proven'}" in said
    data = cli.data("margins", path, status=status)
    assert (data["verdict"], data["passed"]) == ("met" if waivers else "not proven", status == 0)
    (item,) = data["requirements"]
    reason = "the motor is outside" if waivers else None
    assert (item["verdict"], (item["waiver"] or {}).get("reason")) == ("not proven", reason)
    call = ("report", path, "--no-validation", "--quiet", "--out", tmp_path)
    assert cli.text(*call, status=status).startswith(f"{head}  ")
    document = json.loads((tmp_path / "report.json").read_text())
    counts = {"met": 0, "not_met": 0, "not_proven": 0 if waivers else 1, "waived": len(waivers)}
    assert document["verdict"]["parts"]["requirements"] == counts
    page = (tmp_path / "report.html").read_text()
    assert f'<p class="overall {"info" if waivers else "warn"}">' in page
    assert ("the motor is outside" in page) is bool(waivers)


@CASES
def test_what_corners_and_samples_leave_out_is_not_proven(waivers, status, head, written, tmp_path, cli):
    design = asking(*waivers)
    drawn = ("--samples", "4", "--no-worst", "--quiet", "--out", tmp_path)
    for name, *more in (("corners", "--quiet"), ("montecarlo", *drawn)):
        assert cli.text(name, written(design), *more, status=status).startswith(head)
    made = corners(design)
    assert made.verdict == ("met" if waivers else "not proven")
    assert ("Not judged at corners: hot." in corners_summary(made)) is not bool(waivers)


def test_a_loop_whose_stability_is_not_known_is_no_pass(monkeypatch, cli) -> None:
    known = loop_figures.all_loop_figures

    def undecided(*args: Any, **options: Any) -> Mapping[str, loop_figures.LoopFigures]:
        figures = known(*args, **options)
        current = figures["current"]
        return {**figures, "current": replace(current, margins=replace(current.margins, stable=None))}

    monkeypatch.setattr(run, "all_loop_figures", undecided)
    first = cli.text("margins", "ilr33-amber", status=1).splitlines()[0]
    assert first.startswith("NOT PROVEN  ilr33-amber: stability not known: Current loop.")


def test_a_waiver_is_read_written_and_hashed_where_there_is_one_and_holds_for_every_loop_and_check() -> None:
    check = replace(WAIVED, requirement="validation-border")
    bare, waived = asking(), asking(WAIVED, check)
    design = read_design_text(write_design(waived), "again")
    assert design.waivers == (WAIVED, check)
    assert design_hash(waived) != design_hash(bare)
    day = write_design(waived).replace('date = "2026-11-22"', "date = 2026-11-22")
    assert read_design_text(day, "again").waivers == design.waivers
    names = ("hot/velocity", "validation-border", "validation-sawtooth-gain")
    assert [design.waiver_of(name) for name in names] == [WAIVED, check, None]


def test_a_waiver_that_waives_nothing_is_refused() -> None:
    for change, words in (
        ({"requirement": "cold"}, "cold.requirement = .*cold.*: allowed: each once: a requirement's id"),
        ({"reason": " "}, "hot.reason"),
        ({"date": "yesterday"}, "hot.date = .*yesterday.*: allowed: a day, YYYY-MM-DD"),
    ):
        text = write_design(asking(replace(WAIVED, **change)))
        refused(read_design_text, text, "d.toml", match=f"waiver.{words}")


@pytest.mark.parametrize(
    ("waived", "passes"), [("", False), ("velocity", True), ("velocity/NAME", True), ("position", False)]
)
def test_a_row_of_a_validation_not_proven_can_be_waived(waived: str, passes: bool) -> None:
    result = checked()
    one = next(row for row in result.rows if row.loop == "velocity")
    rows = (replace(one, verdict=Verdict.NOT_PROVEN), *(row for row in result.rows if row is not one))
    check = f"validation-{waived.replace('NAME', one.name)}"
    waivers = (replace(WAIVED, requirement=check),) if waived else ()
    design = read_design_text(write_design(replace(result.design, waivers=waivers)), "d.toml")
    judged = replace(result, design=design, rows=rows)
    assert judged.verdict == ("met" if passes else "not proven")
    made = section(judged)
    assert verdict_of(made, "validation")["passed"] is passes
    assert made[0]["status"] == ("pass" if passes else "warn")
    wrong = replace(judged, rows=tuple(replace(row, verdict=Verdict.NOT_MET) for row in rows))
    assert wrong.verdict == "not met"  # a waiver lets go what is not proven, never what is contradicted


def reported(folder: Path, cli: Command, *words: str) -> tuple[Ran, Any]:
    call = ["report", *words, "--no-validation", "--quiet", "--out", folder]
    return cli(*call), json.loads((folder / "report.json").read_text())


@pytest.mark.parametrize(("slope", "status", "word"), [("1", 0, "PASS"), ("1e9", 1, "FAIL")])
def test_the_report_of_a_drive_under_a_slope(slope: str, status: int, word: str, tmp_path, cli) -> None:
    """Pushed by the load, driven away by it."""
    changes = ("--set", "load.path=back-drivable", "--set", f"load.moment_slope={slope} N*m/rad")
    ran, document = reported(tmp_path, cli, "ilr33-amber", *changes)
    assert (ran.status, document["verdict"]["passed"]) == (status, status == 0)
    assert ran.out.startswith(word)
    assert "could not be computed" not in json.dumps(document)
    if slope == "1":
        assert "unstable by itself, outer loops open and rotor free" in json.dumps(document)


def test_a_missing_part_is_in_headline_and_json(tmp_path, monkeypatch, cli) -> None:
    monkeypatch.setattr(analyses.linear.loop_survey, "_other_form", lambda *_: 1 / 0)
    ran, document = reported(tmp_path, cli, "ctms-motor-position")
    drain()
    assert (ran.status != 0, ran.out[:4], document["verdict"]["passed"]) == (True, "FAIL", False)
    assert document["verdict"]["failed_sections"] == ["Missing parts"]
    for said in (ran.out, (tmp_path / "report.html").read_text()):
        assert "failed: Missing parts" in said
    titles = [part["title"] for part in document["sections"]]
    assert "Sampled, continuous, ideal" in titles  # of the sampled form alone


def test_without_requirements_margins_below_custom_are_named(written, cli) -> None:
    """Times 10^((m - 3)/20) of its gain, a loop keeps 3 dB of its gain margin m."""
    design = asking(requirements=())
    text = cli.text("margins", written(design))
    assert ("The design states no requirements." in text, "customary" in text) == (True, False)
    room_db = stability_margins(assemble_loops(design)["position"].open_loop).gain_margin_db
    gain = design.controller.position_loop.gain * 10.0 ** ((room_db - 3.0) / 20.0)
    text = cli.text("margins", written(changed(design, controller={"position": {"gain": gain}})))
    assert "position loop, gain margin 3 dB (of 6 dB)" in " ".join(text.split())


@pytest.mark.parametrize(("call", "word"), [
    (("duty", "joint"), "met"),
    (("duty", "joint", "--load", "200 N*m"), "not met"),
    (("duty", "fin"), "not proven"),
    (("stiffness", "emps"), "met"),
    (("cycles", "joint"), "not met"),
    (("corners", "ilr33-amber", "--hot", "400"), "not met"),
])  # fmt: skip
def test_terminal_json_page_pdf_and_section_have_one_verdict(
    call, word: str, tmp_path, cli, monkeypatch
) -> None:
    """The first line of the terminal is verdict and result; its tables are the section's, none is wider."""
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.chdir(tmp_path)
    said, *rest = cli.text(*call, "--out", "out", status=int(word != "met")).splitlines()
    tables = [line for line in rest if not line.startswith(("note:", "  ", "out/"))]
    assert max(map(len, tables)) <= 80
    document = load(next(tmp_path.glob("out/*.json")))
    first = document["sections"][0]
    assert said == f"{HEADS[word]}  {document['design']['name']}: {first['result']}"
    told = " ".join(" ".join(rest).split())
    captions = [block["caption"] for block in first["blocks"] if block["kind"] == "table"]
    assert call[0] == "duty" or all(one in told for one in captions)  # whose rows are its facts there
    assert (document["verdict"]["verdict"], document["verdict"]["passed"]) == (word, word == "met")
    (overall,) = printable(document)["overall"]
    assert overall[1] == Verdict(word).role()
    page = next(tmp_path.glob("out/*.html"))
    assert f'<p class="overall {overall[1]}">' in page.read_text()
    assert f"The same figures stand in {page.stem}.json beside this page." in page.read_text()
    assert cli.data(*call, status=int(word != "met"))["verdict"] == word
    if len(call) == 2 and call[0] in FURTHER:  # a report that has the section, too
        assert verdict_of(further_sections(load_design(call[1]), [call[0]]), "report")["verdict"] == word
