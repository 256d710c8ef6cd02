"""A report's margins are certified, its page says so, and what is withheld gives its reason."""

from dataclasses import replace

import control
import numpy as np
import pytest

from actuator_lti import assemble_loops, load_design, stability_margins
from actuator_lti.loops.result import Loop
from analyses import survey_loops
from analyses.linear.loop_figures import LoopFigures, all_loop_figures, loop_figures
from reports.as_json import loop_json
from reports.sections import loop as loop_section
from reports.sections import margins


@pytest.fixture(scope="module")
def survey():
    return survey_loops(load_design("ilr33-amber-multirate"))


def test_every_margin_of_a_report_is_certified_and_the_page_says_so(survey):
    groups = [*survey.forms.values(), *(point.figures for point in survey.operating_points)]
    figures = [one for group in groups for one in group.values()]
    figures += [point.figures for point in survey.break_points.values()]
    figures.append(survey.figures["current"].locked)
    assert len(figures) > 20
    assert {f.margins.evidence for f in figures} == {"certified"}
    made = margins.of_loops(survey.figures)
    assert made["result"].startswith("All 3 loops are stable, certified; ")
    assert "exact arithmetic on the numbers of the loop" in made["intro"]
    rows = made["blocks"][0]["rows"]
    assert [row["evidence"] for row in rows] == [{"text": "certified", "status": "pass"}] * 4
    one = loop_section.section("velocity", survey.design, survey.figures["velocity"])
    assert one["result"].startswith("Stable (certified): gain margin ")


def test_a_withheld_margin_gives_its_reason(survey):
    """(z - a)^4 + k, a four times 1e-4 from 1: stable below k = 4e-16, and its 6 a^2 is held to 9e-16."""
    undetermined = control.tf([1e-16], np.poly([1.0 - 1e-4] * 4), 1e-4)
    loop = survey.figures["velocity"].loop
    result = LoopFigures(loop, None, stability_margins(undetermined, certify=True), None, None, None)
    assert result.margins.evidence == "withheld"
    figures, told = {**survey.figures, "velocity": result}, loop_json(result)
    made = margins.of_loops(figures)
    texts = [block["text"] for block in made["blocks"] if block["kind"] == "text"]
    assert any(text.startswith("Velocity loop, withheld: ") for text in texts)
    words = "current loop and position loop certified, velocity loop withheld"
    assert (made["status"], margins.evidence_words(figures)) == ("warn", words)
    assert (told["evidence"], bool(told["evidence_reason"])) == ("withheld", True)


def test_without_being_asked_a_loop_takes_the_quick_way():
    """Tuning and sampling ask for thousands of loops: they get what two ways in double precision agree on.

    Shown with poles far from the border. On the drive's own loops the two may as well end within an error
    of each other, and exact arithmetic decide: which it is depends on the kernel of linear algebra.
    """
    loops = assemble_loops(load_design("ilr33-amber"))
    far = replace(loops.velocity, plain_open=control.tf([25], [1, 10, 10, 10]))
    assert loop_figures(far).margins.evidence == "checked"
    assert loop_figures(far, certify=True).margins.evidence == "certified"
    quick, certified = loop_figures(loops.velocity), all_loop_figures(loops, certify=True)["velocity"]
    assert (certified.margins.evidence, certified.margins.verdict) == ("certified", quick.margins.verdict)


def test_the_terminal_prints_the_evidence(cli):
    told = cli.data("margins", "ilr33-amber")["loops"].values()
    assert {result["evidence"] for result in told} == {"certified"}
    line = next(line for line in cli.text("margins", "ilr33-amber").splitlines() if "Margins are" in line)
    assert line.split() == ["Margins", "are"] + ["certified"] * 4  # the current loop, rotor free and locked


def test_the_resonance_of_a_loop_of_second_order_has_its_frequency():
    """``w0^2/(s^2 + 2 D w0 s + w0^2)`` is largest at ``w0 sqrt(1 - 2 D^2)``; for D above 0.707 nowhere."""
    for damping, hertz in ((0.2, 5.0 * np.sqrt(1.0 - 2.0 * 0.2**2)), (0.8, None)):
        omega = 2.0 * np.pi * 5.0
        opened = control.tf([omega**2], [1.0, 2.0 * damping * omega, 0.0])
        loop = Loop("velocity", "w_ref", opened, control.feedback(opened), None, None, "rad/s", "rad/s")
        found = loop_json(loop_figures(loop, step=False))["resonance_hz"]
        assert found == (None if hertz is None else pytest.approx(hertz))
