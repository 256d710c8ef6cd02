"""The first screen answers: five figures a loop, the weakest point, what to watch."""

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from live_page import Built

from actuator_lti import assemble_loops, load_design, onset
from analyses.corners import corners
from analyses.large_signal.from_rest import AmplitudeMargin
from analyses.linear.loop_figures import all_loop_figures
from analyses.linear.loop_survey import with_cogging
from analyses.specification.requirements import evaluate_requirements
from reports import document as doc
from reports.sections import answer, limits
from reports.sections.in_time import remark
from reports.sections.requirements import item
from reports.verdict_summary import gathered
from tests.changed import changed

AS_IT_IS = (
    "As designed, without dry friction, the position loop keeps oscillating once let go from 2 %% of full "
    "range. Its linear %s margin, as validated, is %s."
)
SMALL = {"size": "small", "part": 0.02, "friction_on": False, "limiter": ""}
LARGE = {"size": "large", "part": 0.5, "friction_on": True, "limiter": "current", "output": 4.7e-5}


def glance(document: dict[str, Any]) -> dict[str, Any]:
    return next(block for block in document["sections"][0]["blocks"] if block["kind"] == "glance")


def test_every_loop_shows_five_figures_and_the_distance_to_its_own_requirement(built: Built) -> None:
    loops = {row["loop"]: row["figures"] for row in glance(built.document)["loops"]}
    assert list(loops) == ["Current loop, rotor free", "Velocity loop", "Position loop"]
    items = {item["id"]: item for item in built.document["sections"][1]["blocks"][0]["items"]}
    for name, figures in zip(("current", "velocity", "position"), loops.values(), strict=True):
        (cell,) = (cell for cell in figures if cell["label"] == "Phase margin")
        wanted = {key: items[f"phase-margin/{name}"][key] for key in ("value", "distance")}
        assert (len(figures), cell.items() >= wanted.items()) == (5, True)
    room = items["position-bandwidth"]["value"] - 15.0  # required of the position loop only
    distances = [figures[-1]["distance"] for figures in loops.values()]
    assert distances == [None, None, pytest.approx(room)]


@pytest.mark.parametrize("kept", ["position-bandwidth", "command-bandwidth"])
def test_a_distance_stands_beside_the_figure_that_it_belongs_to(kept: str) -> None:
    """-3 dB of the ball screw: 5.62 Hz to the command, behind its mean; 115 Hz to the reference, of 10 Hz."""
    design = load_design("ballscrew")
    design = replace(design, requirements=tuple(one for one in design.requirements if one.id == kept))
    figures = all_loop_figures(assemble_loops(design))
    items = [item(one) for one in evaluate_requirements(design, figures)]
    cell = answer.section(figures, items, [])["blocks"][0]["loops"][-1]["figures"][-1]
    assert cell["value"] == pytest.approx(5.62, abs=0.01)
    wanted = (None, None) if kept == "position-bandwidth" else (cell["value"] - 5.0, 5.0)
    assert (cell["distance"], cell["limit"]) == wanted


def test_the_first_screen_says_how_far_it_is_believed_and_where_it_is_linear(built: Built) -> None:
    result = glance(built.document)
    checks = "checks by simulation met; nothing unproven."
    assert re.fullmatch(rf"Linear equals simulated to 10⁻⁹; .*{checks}", result["believed"])
    linear = "A sine of full deflection (10 deg) stays linear up to 0.362 Hz; above, the speed limit acts."
    told = {item["text"]: item["where"] for item in result["findings"]}
    assert (result["linear"], len(told), linear in told) == (linear, 3, False)
    assert {*told.values()} <= {part["id"] for part in built.document["sections"]}  # each leads to one


def test_cogging_is_a_border_of_the_linear_model_by_name() -> None:
    """Slow sines are followed: the motor turns N A, a tenth of a period is 0.2 pi/Z. A speed drive runs."""
    motor = {"cogging_Nm": 1e-7, "cogging_periods": 24.0}
    drive = changed(load_design("ilr33-amber"), motor=motor, requirements=())
    each = (assemble_loops(one) for one in (drive, changed(drive, controller={"position": None})))
    border, of_speed = (with_cogging(loops, onset(loops, np.array([1e-3, 2e-3]))) for loops in each)
    by_hand = 0.2 * np.pi / 24.0 / drive.total_ratio
    assert border.each_rad["cogging"] == pytest.approx(by_hand, rel=2e-3)
    assert (border.active, "cogging" in of_speed.each_rad) == (("cogging", "cogging"), False)
    said = limits.section(drive, border)["result"]
    assert "cogging (the motor turned by a tenth of its period) acts" in said


def test_a_bar_has_the_band_of_the_corners(built: Built) -> None:
    result = {bar["id"]: bar for bar in glance(built.document)["bars"]}
    found = corners(load_design("ilr33-amber")).corners
    values = [v.value for corner in found for v in corner.verdicts if v.id == "gain-margin/current"]
    assert result["gain-margin/current"]["band"] == pytest.approx([min(values), max(values)], rel=1e-6)
    assert result["gain-margin/current"]["limit"] == 6.0


def test_the_pictures_are_of_the_weakest_view(built: Built) -> None:
    _, bode, step = built.document["sections"][0]["blocks"]
    assert bode["caption"].startswith(glance(built.document)["weakest"]["label"])
    assert step["caption"].startswith("Position loop")


def finding(text: str, where: str, severity: doc.Severity = "warn") -> doc.Finding:
    return doc.Finding(severity=severity, text=text, where=where)


def test_findings_come_from_the_sections_gravest_first_once_and_in_turns() -> None:
    """A section that has much to say leaves room for what the others have to say of the same weight."""
    mild, grave = finding("b", "two", "info"), finding("a", "one", "fail")
    loud = [finding(text, "loud") for text in "abcd"]
    quiet = [finding("e", "quiet"), finding("f", "quiet", "fail")]
    one, two, three, four = (
        doc.section("x", "X", [], findings=f) for f in ([mild, grave], [mild], loud, quiet)
    )
    assert gathered([one, two, {"id": "of-an-older-file"}]) == [grave, mild]
    assert "".join(item["text"] for item in gathered([three, four])) == "faebcd"


@pytest.mark.parametrize(("more", "said"), [
    ({**LARGE, "kind": "gain", "value": 2.0},
     "With its gain 6.02 dB higher, the position loop keeps oscillating by 0.0027 deg at the output once "
     "let go from 50 % of full range. The current limit acts. Its linear gain margin, as validated, is "
     "20 dB."),
    ({**SMALL, "kind": "gain", "value": 1.0}, AS_IT_IS % ("gain", "20 dB")),
    ({**SMALL, "kind": "delay", "value": 1e-5}, AS_IT_IS % ("delay", "1 ms")),
])  # fmt: skip
def test_a_motion_that_keeps_oscillating_is_told_in_the_words_of_the_field(more: Any, said: str) -> None:
    item = AmplitudeMargin(loop="position", linear=10.0, furthest=40.0, period_s=1e-4, **more)
    assert remark(item) == said


def test_every_section_opens_with_one_sentence_that_says_its_result(built: Built) -> None:
    for part in built.document["sections"][1:]:
        assert part["result"].endswith("."), part["id"]
        assert len(part["result"]) < 220, part["id"]
