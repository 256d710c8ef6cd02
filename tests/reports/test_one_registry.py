"""Declared once: a figure in the registry of quantities, an analysis by its request; all else loops."""

import cmath
import json
from dataclasses import fields, is_dataclass, replace
from math import radians

import numpy as np
import pytest

from actuator_lti import assemble_loops, load_design
from actuator_lti.asked.quantities import CORNERED, LOOP_QUANTITIES, QUANTITIES
from actuator_lti.design import design_hash
from analyses.corners import corners
from analyses.linear.loop_figures import all_loop_figures
from analyses.request import flag, options
from analyses.stiffness import Stiffness, stiffness
from reports import document as doc
from reports.analyses import ANALYSES, FURTHER, Analysis
from reports.as_json import as_json
from reports.cli.app import PANELS
from reports.html import script
from reports.live.model import live_model
from reports.nightly.changes import Columns
from reports.nightly.figures import Figure, figures_of
from reports.nightly.moves import Tolerances
from reports.sections import answer, loop, margins
from tests.command_line import commands

DESIGN = load_design("ilr33-amber")
# one that no list of the reports knows
NEW = replace(QUANTITIES["modulus_margin"], title="New figure", at_a_glance="fix:3", followed=True)


def test_the_first_screen_and_the_loop_show_what_the_registry_says(monkeypatch) -> None:
    figures = all_loop_figures(assemble_loops(DESIGN))
    for place in (answer, loop):
        monkeypatch.setattr(place, "AT_A_GLANCE", (NEW,))
    value = figures["position"].margins.modulus_margin
    (cell,) = answer.section(figures, [], [])["blocks"][0]["loops"][-1]["figures"]
    shown = {"label": "New figure", "value": value, "unit": "", "format": "fix:3"}
    assert cell.items() >= shown.items()
    facts = loop.section("position", DESIGN, figures["position"])["blocks"][0]["items"]
    assert facts[0] == {**shown, "better": 1}


def test_the_live_page_knows_no_figure_by_itself(monkeypatch) -> None:
    columns = {one["name"]: one for one in live_model(DESIGN)["figures"]}
    assert set(columns) == {name for name, of in LOOP_QUANTITIES.items() if of.followed}
    assert (columns["settling_time"]["unit"], columns["settling_time"]["factor"]) == ("ms", 1e3)
    of_response = [name for name, one in columns.items() if one["response"]]
    assert of_response == ["bandwidth", "overshoot", "settling_time"]
    monkeypatch.setitem(LOOP_QUANTITIES, "modulus_margin", NEW)
    assert "New figure" in [one["label"] for one in live_model(DESIGN)["figures"]]
    words = script(live=True).lower()
    assert not [of.label for of in LOOP_QUANTITIES.values() if f'"{of.label.lower()}"' in words]


def test_a_night_ranks_figures_as_they_are_declared() -> None:
    table = margins.margin_table(all_loop_figures(assemble_loops(DESIGN)))
    table["columns"].append(doc.column("crossover_rad_s", "New margin peak", "rad/s", format="sig:3"))
    part = doc.section("margins", "Margins", [table])
    found = {one.name.rpartition(" / ")[2]: one.better for one in figures_of({"sections": [part]})}
    declared = {of.heading: of.direction for of in LOOP_QUANTITIES.values() if of.heading in found}
    assert len(declared) == 5
    assert found.items() >= {**declared, "Disk margin": 1, "New margin peak": 0}.items()  # names say nothing


def test_a_margin_downwards_that_shrinks_is_worse() -> None:
    """A gain margin of -10 dB that becomes -8 dB is smaller, as one from 10 to 8 dB is."""
    better = {"up": 2, "down": 2, "signed": 1, "peak": -2}
    columns = Columns([Figure(name=n, value=None, better=b) for n, b in better.items()], Tolerances())
    changes = columns.compare(np.array([10.0, -10.0, -10.0, -10.0]), np.array([8.0, -8.0, -8.0, -8.0]))
    worse = {one.figure: one.worse for one in changes}
    assert worse == {"up": True, "down": True, "signed": False, "peak": False}


def test_a_figure_of_the_corners_has_its_corner(monkeypatch) -> None:
    assert set(CORNERED) == {"gain_margin", "phase_margin"}
    of = QUANTITIES["sensitivity_peak"]
    new = replace(of, name="corner_sensitivity_peak", reader="", source="analysis", cornered=of.name)
    monkeypatch.setitem(CORNERED, of.name, new)
    result = {one.name: one for one in corners(DESIGN).corners}

    peak = {name: max(map(of.read, one.figures.values())) for name, one in result.items()}
    assert "raises it" in result["worst peak of S"].words
    assert peak["worst peak of S"] > peak["nominal"]
    assert peak["worst peak of S"] >= peak["worst gain margin"] - 1e-9


COMMANDS = commands()


@pytest.mark.parametrize("one", ANALYSES, ids=lambda one: one.name)
def test_every_field_of_a_request_is_an_option_of_the_command(one: Analysis) -> None:
    given = {parameter.name: parameter for parameter in COMMANDS[one.name].params}
    common = {"as_json", "quiet", *(["example"] if one.example else [])}
    common |= set() if one.alone else {"design", "changes"} | ({"out"} if one.page else set())
    if one.request is None:
        assert set(given) == common
        return
    assert is_dataclass(one.request)
    asked = options(one.request)
    assert set(asked) == {field.name for field in fields(one.request)} == set(given) - common
    for name, (_, option) in asked.items():
        own = given[name]
        assert own.help.startswith(option.words)
        if not option.argument:
            assert own.opts == [f"--{(option.flag or flag(name)).partition('/')[0]}"]


def test_a_declared_analysis_stands_in_its_group_and_in_the_report() -> None:
    for one in ANALYSES:
        assert one.name.split()[0] in PANELS[one.group]
    also = next(parameter for parameter in COMMANDS["report"].params if parameter.name == "also")
    assert all(name in also.help for name in FURTHER)


def test_the_json_of_a_result_is_its_fields_and_properties() -> None:
    design = load_design("emps")
    result = stiffness(design)
    told, derived = as_json(result), {"verdict", "passed", "checked", "lost_motion_difference"}
    assert set(told) == {field.name for field in fields(Stiffness)} | derived
    assert told["design"] == {"name": "emps", "hash": design_hash(design)}
    own, seen = told["checks"][0], result.checks[0]
    size, phase_deg = (own["predicted_Nm_rad"][key] for key in ("size", "phase_deg"))
    assert cmath.rect(size, radians(phase_deg)) == pytest.approx(seen.predicted_Nm_rad, rel=1e-12)
    assert own["difference"] == seen.difference
    json.dumps(told, allow_nan=False)
