"""Met, not met, not proven: the same words, counts and exit status wherever a requirement is judged."""

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

import analyses.linear.loop_survey
from actuator_lti import assemble_loops, stability_margins
from actuator_lti.asked.verdict import Verdict
from actuator_lti.design import design_hash, load_design, read_design_text, write_design
from actuator_lti.design.model import Design, Requirement, Waiver
from actuator_lti.errors import InputError
from analyses.corners import corners
from analyses.isolation import drain
from analyses.linear import loop_figures
from analyses.margins import run
from analyses.validation import CHECKS, validate
from reports.cli.app import build
from reports.cli.main import main
from reports.sections.corners import summary as corners_summary
from reports.sections.validation import section
from reports.verdict_summary import verdict_of

HOT = Requirement(id="hot", quantity="winding_temperature", unit="degC", maximum=100.0)
WAIVED = Waiver(requirement="hot", reason="the motor is outside", date="2026-11-22")


def asking(*waivers: Waiver, requirements: tuple[Requirement, ...] = (HOT,)) -> Design:
    """A drive that states no thermal resistance: the temperature of its winding cannot be judged."""
    return replace(load_design("ilr33-amber"), requirements=requirements, waivers=waivers)


def status(path: Path, design: Design, capsys, *call: str) -> tuple[int, str]:
    path.write_text(write_design(design), encoding="utf-8")
    code = main([call[0], str(path), *call[1:]])
    return code, capsys.readouterr().out


@pytest.mark.parametrize("waivers", [(), (WAIVED,)])
def test_margins_and_report_say_the_same(waivers: tuple[Waiver, ...], tmp_path, capsys) -> None:
    code, head, word = (0, "PASS", "met") if waivers else (1, "NOT PROVEN", "not proven")
    design, path = asking(*waivers), tmp_path / "d.toml"
    made = status(path, design, capsys, "margins")
    assert (made[0], made[1].startswith(f"{head}  ")) == (code, True)
    assert f"0 of 1 requirements met, 1 {'waived' if waivers else 'not proven'}" in made[1]
    made = status(path, design, capsys, "margins", "--json")
    data = json.loads(made[1])
    assert (made[0], data["verdict"], data["passed"]) == (code, word, code == 0)
    (item,) = data["requirements"]
    assert item["verdict"] == "not proven"
    assert (item["waiver"] or {}).get("reason") == ("the motor is outside" if waivers else None)
    folder = tmp_path / "out"
    call = ("report", "--no-validation", "--quiet", "--out", str(folder))
    made = status(path, design, capsys, *call)
    assert (made[0], made[1].startswith(f"{head}  ")) == (code, True)
    document = json.loads((folder / "report.json").read_text())
    counts = {"met": 0, "not_met": 0, "not_proven": 0 if waivers else 1, "waived": len(waivers)}
    assert document["verdict"]["parts"]["requirements"] == counts
    page = (folder / "report.html").read_text()
    assert f'<p class="overall {"info" if waivers else "warn"}">' in page
    assert ("the motor is outside" in page) is bool(waivers)


@pytest.mark.parametrize("waivers", [(), (WAIVED,)])
def test_what_corners_and_samples_leave_out_is_not_proven(
    waivers: tuple[Waiver, ...], tmp_path, capsys
) -> None:
    design, out = asking(*waivers), str(tmp_path / "out")
    drawn = ("montecarlo", "--samples", "4", "--no-worst", "--quiet", "--out", out)
    for call in (("corners", "--quiet"), drawn):
        code, said = status(tmp_path / "d.toml", design, capsys, *call)
        assert (code, said.startswith("PASS")) == ((0, True) if waivers else (1, False))
        assert said.startswith("NOT PROVEN") is not bool(waivers)
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


def test_a_waiver_is_read_written_and_hashed_where_there_is_one() -> None:
    bare, waived = asking(), asking(WAIVED)
    assert read_design_text(write_design(waived), "again").waivers == (WAIVED,)
    assert design_hash(waived) != design_hash(bare)
    day = write_design(waived).replace('date = "2026-11-22"', "date = 2026-11-22")
    assert read_design_text(day, "again").waivers == (WAIVED,)


def test_a_waiver_that_waives_nothing_is_refused() -> None:
    for change, words in (
        ({"requirement": "cold"}, "cold.requirement = .*cold.*: allowed: each once: a requirement's id"),
        ({"reason": " "}, "hot.reason"),
        ({"date": "yesterday"}, "hot.date = .*yesterday.*: allowed: a day, YYYY-MM-DD"),
    ):
        text = write_design(asking(replace(WAIVED, **change)))
        with pytest.raises(InputError, match=f"waiver.{words}"):
            read_design_text(text, "d.toml")


def test_one_waiver_holds_for_a_requirement_on_every_loop_and_for_a_check() -> None:
    check = replace(WAIVED, requirement="validation-border")
    design = read_design_text(write_design(asking(WAIVED, check)), "d.toml")
    assert design.waiver_of("hot/velocity") == WAIVED
    assert design.waiver_of("validation-border") == check
    assert design.waiver_of("validation-sawtooth-gain") is None


@pytest.mark.parametrize(
    ("waived", "passes"), [("", False), ("velocity", True), ("velocity/NAME", True), ("position", False)]
)
def test_a_row_of_a_validation_not_proven_can_be_waived(waived: str, passes: bool) -> None:
    result = validate(load_design("emps"), CHECKS)
    k = next(k for k, row in enumerate(result.rows) if row.loop == "velocity")
    rows = list(result.rows)
    rows[k] = replace(rows[k], verdict=Verdict.NOT_PROVEN)
    check = f"validation-{waived.replace('NAME', rows[k].name)}"
    waivers = (replace(WAIVED, requirement=check),) if waived else ()
    design = read_design_text(write_design(replace(result.design, waivers=waivers)), "d.toml")
    judged = replace(result, design=design, rows=tuple(rows))
    assert judged.verdict == ("met" if passes else "not proven")
    made = section(judged)
    assert verdict_of(made, "validation")["passed"] is passes
    assert made[0]["status"] == ("pass" if passes else "warn")
    wrong = replace(judged, rows=tuple(replace(row, verdict=Verdict.NOT_MET) for row in rows))
    assert wrong.verdict == "not met"  # a waiver lets go what is not proven, never what is contradicted


def reported(folder: Path, *changes: str) -> tuple[int, str, Any]:
    call = ["report", "ilr33-amber", "--no-validation", "--quiet", "--out", str(folder), *changes]
    done = CliRunner().invoke(build(), call)
    return done.exit_code, done.output, json.loads((folder / "report.json").read_text())


@pytest.mark.parametrize(
    ("slope", "status", "word"), [("-1", 0, "PASS"), ("1", 0, "PASS"), ("1e9", 1, "FAIL")]
)
def test_the_report_of_a_drive_under_a_slope(slope: str, status: int, word: str, tmp_path) -> None:
    """Held by the load, pushed by it, driven away by it."""
    changes = ("--set", "load.path=back-drivable", "--set", f"load.moment_slope={slope} N*m/rad")
    code, output, document = reported(tmp_path, *changes)
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
    code, output, document = reported(tmp_path)
    drain()
    assert code != 0
    assert document["verdict"]["passed"] is False
    assert document["verdict"]["failed_sections"] == ["Missing parts"]
    assert "FAIL" in output
    assert "failed: Missing parts" in output
    assert "failed: Missing parts" in (tmp_path / "report.html").read_text()
    titles = [part["title"] for part in document["sections"]]
    assert "Sampled, continuous, ideal" in titles  # of the sampled form alone


def test_without_requirements_margins_below_custom_are_named(tmp_path, capsys) -> None:
    """Times 10^((m - 3)/20) of its gain, a loop keeps 3 dB of its gain margin m."""
    design = asking(requirements=())
    text = status(tmp_path / "d.toml", design, capsys, "margins")[1]
    assert "The design states no requirements." in text
    assert "customary" not in text
    position = design.controller.position_loop
    room_db = stability_margins(assemble_loops(design)["position"].open_loop).gain_margin_db
    assert room_db is not None
    nearer = replace(position, gain=position.gain * 10.0 ** ((room_db - 3.0) / 20.0))
    design = replace(design, controller=replace(design.controller, position=nearer))
    code, text = status(tmp_path / "d.toml", design, capsys, "margins")
    assert code == 0
    assert "position loop, gain margin 3 dB (of 6 dB)" in " ".join(text.split())
