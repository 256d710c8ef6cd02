"""The weakest point is the worst of all views, by how near L comes to -1; the spread names its points."""

import re
from dataclasses import replace
from functools import cache
from math import inf, log10, radians, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from actuator_lti import assemble_loops, load_design, stability_margins
from actuator_lti.asked.quantities import CUSTOMARY, distance_from_minus_one, reserve
from actuator_lti.design import with_overrides, with_values
from actuator_lti.design.model import Requirement
from analyses.corners import corners
from analyses.linear.loop_survey import LoopSurvey, operating_points, survey_loops
from analyses.linear.responses import curve, frequency_grid
from analyses.margins import margins
from analyses.specification.mending import mending
from analyses.specification.weakest import figures_of, spread, views, weakest
from reports.build import report
from reports.document import verdict
from reports.sections.answer import section as first_screen
from reports.sections.answer import weakest as words_of
from reports.sections.loop_charts import open_bode
from reports.sections.margins import section as margins_section
from tests.changed import changed

FIN = replace(load_design("fin"), requirements=())


surveyed = cache(lambda name: survey_loops(load_design(name)))
cornered = cache(lambda: corners(FIN))


@pytest.fixture
def survey() -> LoopSurvey:
    return replace(surveyed("fin"), design=FIN)


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


def test_every_view_is_looked_at(survey: LoopSurvey) -> None:
    seen = {(view.place, view.loop, view.cut) for view in views(survey, cornered())}
    for place in ("", "load driven by the motor", "motor driven by the load", "in the gap of the play"):
        assert (place, "position", "") in seen
    assert any(place.startswith("at rest, dry friction over 1 rad/s, load ") for place, _, _ in seen)
    assert {cut for place, _, cut in seen if place == "all loops closed"} == set(survey.break_points)
    assert ("tolerances of the worst phase margin", "velocity", "") in seen
    assert not any("speed amplitude" in place for place, _, _ in seen)


def test_the_weakest_point_of_the_fin_is_where_it_is_not_stable(survey: LoopSurvey) -> None:
    """Its position loop is unstable at the worst tolerances; without them the driven point is nearest."""
    point = weakest(survey, cornered())
    assert (point.reserve, point.view.stable) == (-inf, False)
    assert words_of(point)["status"] == "warn"
    nominal = weakest(survey)
    loop = assemble_loops(FIN, operating_point="driven").position
    margins = stability_margins(loop.open_loop)
    wanted = {
        "gain_margin": (1 - 10 ** (-abs(margins.gain_margin_db) / 20)) / (1 - 10 ** (-6 / 20)),
        "phase_margin": sin(radians(abs(margins.phase_margin_deg) / 2)) / sin(radians(15)),
        "modulus_margin": margins.modulus_margin / 0.5,
    }
    least = min(wanted, key=wanted.__getitem__)
    assert (nominal.view.place, nominal.view.loop) == ("motor driven by the load", "position")
    assert (nominal.quantity, nominal.limit) == (least, CUSTOMARY[least])
    assert nominal.reserve == pytest.approx(wanted[least] - 1.0, rel=1e-9)
    words = "modulus margin 0.481, customary 0.5: 0.0186 below"
    said = {"label": "Position loop, motor driven by the load", "words": words}
    assert words_of(nominal).items() >= said.items()


def test_a_load_that_is_driven_away_in_the_gap_is_said_and_the_loop_itself_is_drawn() -> None:
    """In the play the position loop is open: its response is zero, and no factors make it up."""
    driven_away = with_overrides(FIN, {"load.moment_slope": "5 N*m/rad"})
    gap = assemble_loops(driven_away, operating_point="gap").position
    assert np.abs(curve(gap.plain_open, np.array([1.0, 10.0])).values).max() < 1e-12
    first, *others = report(driven_away, validation=False)["sections"]
    assert first["id"] == "answer"
    assert not [part["id"] for part in others if part["id"].startswith("missing")]
    glance, bode, _ = first["blocks"]
    assert glance["weakest"]["words"] == "not stable"
    assert "in the gap of the play" in glance["weakest"]["label"]
    assert "phase margin none" not in bode["alt"]


def test_a_required_limit_stands_for_the_customary_one(survey: LoopSurvey) -> None:
    asked = Requirement(id="m", quantity="modulus_margin", unit="1", loop="every", minimum=0.7)
    point = weakest(replace(survey, design=replace(FIN, requirements=(asked,))))
    assert (point.view.place, point.view.loop, point.limit, point.required) == ("", "position", 0.7, True)
    told = words_of(point)
    assert (told["status"], told["label"]) == ("fail", "Position loop")
    assert re.fullmatch(r"modulus margin 0\.\d+, required 0\.7: 0\.\d+ below", told["words"])


def test_the_spread_is_that_of_the_operating_points_which_margins_names(cli) -> None:
    found = spread(operating_points(FIN, [], described=False, certify=False))["position"]["gain_margin"]
    loads = FIN.validation.loads_Nm
    every, margins = {"driving": 0.0, "driven": 0.0, "gap": 0.0, "sliding": 0.0}, []
    for point, load in [*every.items(), *(("rest", load) for load in loads)]:
        loop = assemble_loops(FIN, operating_point=point, load_Nm=load).position
        margins.append(abs(stability_margins(loop.open_loop).gain_margin_db))
    assert (found.least, found.most) == (pytest.approx(min(margins)), pytest.approx(max(margins)))
    told = cli.data("margins", "fin")["spread"]["position"]["gain_margin"]["where"]
    assert found.where == told == "motor driven by the load"
    said = cli.text("margins", "--help")
    assert all(name in said for name in (*every, "rest", "describing-function"))


def test_the_move_that_mends_brings_the_weakest_margin_just_within_its_limit() -> None:
    """Judged by the exact loops: with the move it is within, with a fifth of it less it is not."""
    design, seen = load_design("ilr33-amber"), surveyed("ilr33-amber")
    point = weakest(seen)
    assert (point.view.kind, point.view.load_Nm, point.quantity) == ("rest", 8.0, "phase_margin")
    move = mending(point, seen)
    for part, inside in ((1.0, True), (0.8, False)):
        value = move.was + part * (move.value - move.was)
        loops = assemble_loops(with_values(design, {move.path: value}), operating_point="rest", load_Nm=8.0)
        found = stability_margins(loops.position.open_loop)
        sizes = {"phase_margin": found.phase_margin_deg, "gain_margin": found.gain_margin_db}
        sizes["modulus_margin"] = found.modulus_margin
        assert all(abs(sizes[name]) >= limit for name, limit in CUSTOMARY.items()) is inside
    assert weakest(survey_loops(with_values(design, {move.path: move.value}))).reserve >= 0.0


def test_a_gain_that_is_far_from_stable_is_mended_as_well() -> None:
    """The joint's position loop has 25.90 dB at 8 1/s: 6 dB are left at 79.1, half of -1 a little below."""
    design = with_overrides(load_design("joint"), {"control.position.gain": "400 1/s"})
    seen = survey_loops(design)
    move = mending(weakest(seen), seen)
    assert move.path == "control.position.gain"
    assert 60.0 < move.value < 8.0 * 10.0 ** ((25.90 - 6.0) / 20.0)
    mended = assemble_loops(with_values(design, {move.path: move.value})).position
    assert stability_margins(mended.open_loop).modulus_margin >= CUSTOMARY["modulus_margin"]


def test_no_view_is_left_at_its_border_by_what_mends_another() -> None:
    """On a crest of the cogging every loop of the joint is unstable: one gain brings all within custom."""
    cogging = {"cogging_Nm": 6e-3, "cogging_periods": 24.0, "cogging_phase_rad": np.pi}
    design = changed(load_design("joint"), motor=cogging, requirements=())
    seen = survey_loops(design)
    lost = {(view.place, view.loop) for view in views(seen) if view.stable is False}
    assert lost >= {("on a crest of the cogging", loop) for loop in ("velocity", "position")}
    assert weakest(seen).view.loop == "position"  # the loops inside it are lost with it
    move = mending(weakest(seen), seen)
    points = operating_points(with_values(design, {move.path: move.value}), [], described=False)
    crest = next(one for one in points if one.label == "on a crest of the cogging")
    for one in crest.figures.values():
        found = figures_of(one.judged.margins)
        assert all(found[name] >= limit for name, limit in CUSTOMARY.items() if name in found)


def test_a_requirement_that_is_not_met_without_a_figure_has_the_first_bar() -> None:
    about = {"limit": 6.0, "comparison": ">=", "unit": "dB"}
    given = (("a", False, 5.0), ("b", False, None), ("c", None, None))
    items = [verdict(id, id, passed=passed, value=value, **about) for id, passed, value in given]
    screen = first_screen({}, items, [])
    assert screen["status"] == "fail"
    (glance,) = screen["blocks"]
    assert [bar["id"] for bar in glance["bars"]] == ["b", "a"]


def test_no_move_that_costs_a_requirement(survey: LoopSurvey) -> None:
    """Less position gain mends the fin at its worst tolerances; with the bandwidth required, nothing does."""
    bounds = cornered()
    point = weakest(survey, bounds)
    assert mending(point, survey, bounds).path == "control.position.gain"
    assert mending(point, replace(survey, design=load_design("fin")), bounds) is None


@pytest.mark.parametrize("name", ["fin", "ilr33-amber"])
def test_a_bode_plot_names_the_margins_nearest_to_minus_one_and_shows_them_and_0_db(name: str) -> None:
    """The fin's velocity loop has its nearest phase margin last, ilr33-amber cut at u its gain margin."""
    found = surveyed(name)
    cut = [point.figures for point in found.break_points.values() if point.figures]
    for one in (*found.figures.values(), *cut):
        top, bottom = open_bode("x", one, frequency_grid(one), small=True)["chart"]["columns"][0]["panels"]
        said = [item["words"] for panel in (top, bottom) for item in panel["items"] if item["kind"] == "note"]
        gain = min((m.db for m in one.margins.gain_margins), key=abs)
        phase = min((m.deg for m in one.margins.phase_margins), key=abs)
        words = [f"GM {'down to ' * (gain < 0)}{gain:.1f} dB", f"PM {phase:.1f}°"]
        assert [text.partition("\n")[0].replace("−", "-") for text in said] == words
        assert all(top["y"]["low"] < level < top["y"]["high"] for level in (0.0, -gain))
        assert top["y"]["high"] < 70.0 + max(0.0, -gain)


def test_an_operating_point_at_which_a_loop_is_not_stable_is_told_in_a_sentence() -> None:
    found = margins(FIN)
    away = next(one for one in found.operating_points if one.place == "motor driven by the load")
    figures = {n: replace(f, margins=replace(f.margins, stable=False)) for n, f in away.figures.items()}
    made = margins_section(replace(found, operating_points=(replace(away, figures=figures),)))[0]["result"]
    assert "; with the motor driven by the load these loops are not stable: velocity, position." in made
