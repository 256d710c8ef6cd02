"""A figure is declared in the registry of quantities alone: what shows it, ranks it or searches it loops."""

from dataclasses import replace

import numpy as np

from actuator_lti import assemble_loops, load_design
from actuator_lti.asked.quantities import CORNERED, LOOP_QUANTITIES, QUANTITIES
from analyses.corners import corners
from analyses.linear.loop_figures import all_loop_figures
from reports import document as doc
from reports.html import script
from reports.live import live_model
from reports.nightly.changes import Columns
from reports.nightly.figures import Figure, figures_of
from reports.nightly.moves import Tolerances
from reports.sections import answer, loop, margins

DESIGN = load_design("ilr33-amber")
# one that no list of the reports knows
NEW = replace(QUANTITIES["modulus_margin"], title="New figure", at_a_glance="fix:3", followed=True)


def test_the_first_screen_and_the_loop_show_what_the_registry_says(monkeypatch) -> None:
    figures = all_loop_figures(assemble_loops(DESIGN))
    for place in (answer, loop):
        monkeypatch.setattr(place, "AT_A_GLANCE", (NEW,))
    value = figures["position"].margins.modulus_margin
    (glance, *_) = answer.section(figures, [], [])["blocks"]
    (cell,) = glance["loops"][-1]["figures"]
    assert (cell["label"], cell["value"], cell["format"]) == ("New figure", value, "fix:3")
    facts = loop.section("position", DESIGN, figures["position"])["blocks"][0]["items"]
    shown = {"label": "New figure", "value": value, "unit": "", "format": "fix:3", "better": 1}
    assert facts[0] == shown


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
    found = {one.name.rpartition(" / ")[2]: one for one in figures_of({"sections": [part]})}
    by_heading = {of.heading: of for of in LOOP_QUANTITIES.values() if of.heading}
    known = {name: one.better for name, one in found.items() if name in by_heading}
    assert len(known) == 5
    assert known == {name: by_heading[name].direction for name in known}
    assert found["New margin peak"].better == 0  # names say nothing
    assert found["Disk margin"].better == 1


def test_a_margin_downwards_that_shrinks_is_worse() -> None:
    """A gain margin of -10 dB that becomes -8 dB is smaller, as one from 10 to 8 dB is."""
    names = ("up", "down", "signed", "peak")
    better = dict(zip(names, (2, 2, 1, -2), strict=True))
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

    def peak(name: str) -> float:
        return max(of.read(one) for one in result[name].figures.values())

    assert "raises it" in result["worst peak of S"].words
    assert peak("worst peak of S") > peak("nominal")
    assert peak("worst peak of S") >= peak("worst gain margin") - 1e-9
