"""The first screen answers: figures with their distance, the weakest point of all, what to watch."""

import json
from dataclasses import replace
from math import inf, log10, radians, sin
from typing import Any

import numpy as np
import pytest
from built_report import Built
from hypothesis import given
from hypothesis import strategies as st

from actuator_lti import assemble_loops, load_design, stability_margins
from actuator_lti.asked.quantities import CUSTOMARY, distance_from_minus_one, reserve
from actuator_lti.design import with_values
from actuator_lti.design.model import Design
from analyses.corners import corners
from analyses.large_signal.by_amplitude import AmplitudeMargin
from analyses.linear.loop_survey import LoopSurvey, operating_points, survey_loops
from analyses.specification.mending import mending
from analyses.specification.weakest import spread, views, weakest
from reports import document as doc
from reports.build import design_report
from reports.cli.main import main
from reports.findings import Finding, gathered
from reports.sections.answer import weakest as words_of
from reports.sections.by_amplitude import remark


def glance(document: dict[str, Any]) -> dict[str, Any]:
    """Give the block of the first screen."""
    return next(block for block in document["sections"][0]["blocks"] if block["kind"] == "glance")


def test_every_loop_shows_five_figures_and_the_distance_to_its_own_requirement(built: Built) -> None:
    result = glance(built.document)
    assert [row["loop"] for row in result["loops"]] == [
        "Current loop, rotor free",
        "Velocity loop",
        "Position loop",
    ]
    items = {
        item["id"]: item for part in built.document["sections"][1:2] for item in part["blocks"][0]["items"]
    }
    for name, row in zip(("current", "velocity", "position"), result["loops"], strict=True):
        cells = {cell["label"]: cell for cell in row["figures"]}
        assert len(cells) == 5
        wanted = items[f"phase-margin/{name}"]
        assert cells["Phase margin"]["value"] == wanted["value"]
        assert cells["Phase margin"]["distance"] == wanted["distance"]
    bandwidths = [row["figures"][-1]["distance"] for row in result["loops"]]
    assert bandwidths[:2] == [None, None]  # required of the position loop only
    assert bandwidths[2] == pytest.approx(items["position-bandwidth"]["value"] - 15.0)


def test_the_first_screen_says_how_far_it_is_believed_and_where_it_is_linear(built: Built) -> None:
    result = glance(built.document)
    assert result["believed"].startswith("Linear equals simulated to 10⁻⁹; ")
    assert result["believed"].endswith("checks by simulation met; nothing unproven.")
    assert (
        result["linear"]
        == "A sine of full deflection (10 deg) stays linear up to 0.362 Hz; above, the speed limit acts."
    )
    assert len(result["findings"]) == 3
    assert result["linear"] not in [item["text"] for item in result["findings"]]


def test_a_bar_has_the_band_of_the_corners(built: Built) -> None:
    result = {bar["id"]: bar for bar in glance(built.document)["bars"]}
    values = [
        one.value
        for corner in corners(load_design("ilr33-amber")).corners
        for one in corner.verdicts
        if one.id == "gain-margin/current"
    ]
    assert result["gain-margin/current"]["band"] == pytest.approx([min(values), max(values)], rel=1e-6)
    assert result["gain-margin/current"]["limit"] == 6.0


def test_the_pictures_are_of_the_weakest_view(built: Built) -> None:
    _, bode, step = built.document["sections"][0]["blocks"]
    assert bode["caption"].startswith(glance(built.document)["weakest"]["label"])
    assert step["caption"].startswith("Position loop")


def test_findings_come_from_the_sections_gravest_first_and_once() -> None:
    mild = Finding(severity="info", text="b", where="two")
    grave = Finding(severity="fail", text="a", where="one")
    sections = [
        doc.section("one", "One", [], findings=[mild, grave]),
        doc.section("two", "Two", [], findings=[mild]),
        {"id": "of-an-older-file"},
    ]
    assert gathered(sections) == [grave, mild]


def test_a_large_motion_that_keeps_oscillating_is_told_in_the_words_of_the_field() -> None:
    item = AmplitudeMargin(
        loop="position", kind="gain", size="large", part=0.5, friction_on=True, linear=10.0, value=2.0,
        furthest=40.0, period_s=1e-4, limiter="current",
    )  # fmt: skip
    assert remark(item) == (
        "The position loop sustains an oscillation if its gain is raised by 6.02 dB or more after release "
        "from 50 % of full range; the linear gain margin on the validation's operating motion is 20 dB. The "
        "current limit acts."
    )


@pytest.mark.parametrize(("kind", "value", "words"), [("gain", 1.0, "20 dB"), ("delay", 1e-5, "1 ms")])
def test_a_drive_that_oscillates_as_it_is_is_said_so(kind: str, value: float, words: str) -> None:
    item = AmplitudeMargin(
        loop="position", kind=kind, size="small", part=0.02, friction_on=False, linear=10.0, value=value,
        furthest=40.0, period_s=1e-4, limiter="",
    )  # fmt: skip
    assert remark(item) == (
        "The position loop, without dry friction, sustains an oscillation as designed after release from 2 % "
        f"of full range; the linear {kind} margin on the validation's operating motion is {words}."
    )


def test_what_to_watch_leads_to_a_section(built: Built) -> None:
    assert glance(built.document)["findings"]
    ids = {part["id"] for part in built.document["sections"]}
    assert {item["where"] for item in glance(built.document)["findings"]} <= ids


def test_a_report_without_simulation_says_so() -> None:
    result = glance(design_report(load_design("emps")))["findings"]
    assert any("No simulation stands behind this report" in item["text"] for item in result)


def test_an_unmet_requirement_is_the_weakest_point_and_fails_the_screen() -> None:
    design = load_design("ilr33-amber")
    strict = [
        replace(item, minimum=90.0) if item.quantity == "phase_margin" else item
        for item in design.requirements
    ]
    document = design_report(replace(design, requirements=tuple(strict)))
    assert document["sections"][0]["status"] == "fail"
    result = glance(document)["weakest"]
    assert result["status"] == "fail"
    assert result["label"] == "Velocity loop"
    assert result["words"] == "phase margin 73.7 deg, required 90 deg: 16.3 deg beyond"


def test_every_section_opens_with_one_sentence_that_says_its_result(built: Built) -> None:
    for part in built.document["sections"][1:]:
        assert part["result"].endswith("."), part["id"]
        assert len(part["result"]) < 220, part["id"]


@pytest.fixture(scope="module")
def fin() -> Design:
    return replace(load_design("fin"), requirements=())


@pytest.fixture(scope="module")
def survey(fin: Design) -> LoopSurvey:
    return survey_loops(fin)


@given(db=st.floats(0.01, 60.0), deg=st.floats(0.01, 180.0))
def test_a_margin_is_the_distance_of_a_point_from_minus_one(db: float, deg: float) -> None:
    """At a gain margin g the loop is at -1/g, at a phase margin phi at exp(j (phi - pi))."""
    assert distance_from_minus_one("gain_margin", db) == pytest.approx(abs(-(10 ** (-db / 20)) + 1.0))
    point = np.exp(1j * (radians(deg) - np.pi))
    assert distance_from_minus_one("phase_margin", deg) == pytest.approx(abs(point + 1.0), abs=1e-12)
    peak_db = 20.0 * log10(1.0 / 0.5)  # |S| = 1/|1 + L|
    assert distance_from_minus_one("sensitivity_peak", peak_db) == pytest.approx(0.5)


def test_margins_are_not_ranked_by_shares_of_decibels() -> None:
    """9 dB of 6 has half as much again in decibels; as a distance 29 %, less than 45 deg of 30 with 48 %."""
    gain, phase = reserve("gain_margin", 9.0, 6.0, 3.0), reserve("phase_margin", 45.0, 30.0, 15.0)
    assert gain == pytest.approx((1 - 10 ** (-9 / 20)) / (1 - 10 ** (-6 / 20)) - 1)
    assert phase == pytest.approx(sin(radians(22.5)) / sin(radians(15.0)) - 1)
    assert gain < phase


def test_every_view_is_looked_at(fin: Design, survey: LoopSurvey) -> None:
    seen = {(view.place, view.loop, view.cut) for view in views(survey, corners(fin))}
    for place in ("", "load driven by the motor", "motor driven by the load", "in the gap of the play"):
        assert (place, "position", "") in seen
    assert any(place.startswith("at rest, load ") for place, _, _ in seen)
    assert {cut for place, _, cut in seen if place == "all loops closed"} == set(survey.break_points)
    assert ("tolerances of the worst phase margin", "velocity", "") in seen
    assert not any("speed amplitude" in place for place, _, _ in seen)


def test_the_weakest_point_of_the_fin_is_where_it_is_not_stable(fin: Design, survey: LoopSurvey) -> None:
    """Its position loop is unstable at the worst tolerances; without them the driven point is nearest."""
    point = weakest(survey, corners(fin))
    assert (point.reserve, point.view.stable) == (-inf, False)
    assert words_of(point)["status"] == "warn"
    nominal = weakest(survey)
    loop = assemble_loops(fin, operating_point="driven").position
    margins = stability_margins(loop.open_loop)
    wanted = {
        "gain_margin": (1 - 10 ** (-abs(margins.gain_margin_db) / 20)) / (1 - 10 ** (-6 / 20)),
        "phase_margin": sin(radians(abs(margins.phase_margin_deg) / 2)) / sin(radians(15)),
        "modulus_margin": margins.modulus_margin / 0.5,
    }
    assert (nominal.view.place, nominal.view.loop) == ("motor driven by the load", "position")
    assert nominal.quantity == min(wanted, key=lambda name: wanted[name])
    assert nominal.reserve == pytest.approx(min(wanted.values()) - 1.0, rel=1e-9)
    assert nominal.limit == CUSTOMARY[nominal.quantity]
    said = words_of(nominal)
    assert said["label"] == "Position loop, motor driven by the load"
    assert said["words"] == "modulus margin 0.481, customary 0.5: 0.0186 beyond"


def test_a_required_limit_stands_for_the_customary_one(survey: LoopSurvey, fin: Design) -> None:
    from actuator_lti.design.model import Requirement

    asked = Requirement(id="m", quantity="modulus_margin", unit="1", loop="every", minimum=0.7)
    point = weakest(replace(survey, design=replace(fin, requirements=(asked,))))
    assert (point.view.place, point.view.loop, point.limit, point.required) == ("", "position", 0.7, True)
    assert words_of(point)["status"] == "fail"


def test_the_spread_is_that_of_the_operating_points(fin: Design) -> None:
    found = spread(operating_points(fin, [], described=False, certify=False))["position"]["gain_margin"]
    loads = fin.validation.loads_Nm
    every = {"driving": 0.0, "driven": 0.0, "gap": 0.0, "sliding": 0.0}
    margins = []
    for point, load in [*every.items(), *(("rest", load) for load in loads)]:
        loop = assemble_loops(fin, operating_point=point, load_Nm=load).position
        margins.append(abs(stability_margins(loop.open_loop).gain_margin_db))
    assert (found.least, found.most) == (pytest.approx(min(margins)), pytest.approx(max(margins)))
    assert found.where == "motor driven by the load"


def test_margins_shows_the_spread_and_names_the_points(capsys) -> None:
    assert main(["margins", "fin", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["spread"]["position"]["gain_margin"]["where"] == "motor driven by the load"
    assert main(["margins", "--help"]) == 0
    said = capsys.readouterr().out
    for name in ("sliding", "rest", "describing-function", "driving", "driven", "gap"):
        assert name in said


def test_the_move_that_mends_brings_the_weakest_margin_just_within_its_limit() -> None:
    """Judged by the exact loops: with the move it is within, with a fifth of it less it is not."""
    design = load_design("ilr33-amber")
    seen = survey_loops(design)
    point = weakest(seen)
    assert point is not None
    assert (point.view.kind, point.view.load_Nm, point.quantity) == ("rest", 8.0, "phase_margin")
    move = mending(point, seen)
    assert move is not None
    for part, inside in ((1.0, True), (0.8, False)):
        value = move.was + part * (move.value - move.was)
        loops = assemble_loops(with_values(design, {move.path: value}), operating_point="rest", load_Nm=8.0)
        assert loops.position is not None
        margins = stability_margins(loops.position.open_loop)
        found = {
            "phase_margin": abs(margins.phase_margin_deg), "gain_margin": abs(margins.gain_margin_db),
            "modulus_margin": margins.modulus_margin,
        }  # fmt: skip
        assert all(found[name] >= limit for name, limit in CUSTOMARY.items()) is inside
    mended = weakest(survey_loops(with_values(design, {move.path: move.value})))
    assert mended is not None
    assert mended.reserve >= 0.0


def test_no_move_that_costs_a_requirement(fin: Design, survey: LoopSurvey) -> None:
    """Less position gain mends the fin at its worst tolerances; with the bandwidth required, nothing does."""
    bounds = corners(fin)
    point = weakest(survey, bounds)
    assert point is not None
    free = mending(point, survey, bounds)
    assert free is not None
    assert free.path == "control.position.gain"
    whole = load_design("fin")
    assert mending(point, replace(survey, design=whole), bounds) is None
