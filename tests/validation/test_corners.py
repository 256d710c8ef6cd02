"""Corners: each is the design that its words say, and the worst ends are the worst corner of the box."""

from collections import Counter
from dataclasses import replace
from itertools import product
from unittest.mock import Mock

import numpy as np
import pytest

from actuator_lti.batch import Population
from actuator_lti.design import design_tree, load_design, read_design_text, with_overrides, write_design
from actuator_lti.design.access import with_values
from actuator_lti.design.loader import design_from_tree
from actuator_lti.design.model import Friction, Requirement
from analyses.corners import Asked, corners
from analyses.corners.run import worst_ends
from analyses.monte_carlo import MonteCarloSettings, monte_carlo
from analyses.specification import asked_figures
from analyses.specification.capability import drive_figures
from analyses.specification.requirements import evaluate_requirements
from analyses.specification.sensitivity import population_figures
from reports.build import further_sections
from reports.sections.corners import chart, section
from tests.nonlinear.elastic_drive import stribeck
from tests.refusals import refused

FIN, EMPS = load_design("fin"), load_design("emps")


def test_a_hot_motor_has_more_resistance_and_less_torque() -> None:
    """R (1 + 0.00393 * 95), k (1 - 0.0011 * 95) at 120 degC, of copper and NdFeB from 25 degC."""
    hot = next(one for one in corners(FIN, Asked.of(FIN, hot_degC=120.0)).corners if one.name == "hot")
    motor, k = hot.design.effective_motor, 0.03 * (1 - 0.0011 * 95)
    assert motor.resistance_ohm == pytest.approx(1.0 * (1 + 0.00393 * 95), rel=1e-12)
    found = [motor.torque_constant_Nm_A, motor.back_emf_constant_Vs_rad]
    assert found == pytest.approx([k, k], rel=1e-12)


def test_a_low_supply_lowers_the_rate_and_no_margin() -> None:
    """Steady: U = R i + kE w, kM i = Tc + Cv w, without a speed limit in the way."""
    design = load_design("ilr33-amber")
    rate = Requirement(id="rate", quantity="output_rate", unit="deg/s", minimum=1.0, load_Nm=0.0)
    design = replace(design, requirements=(rate,))
    nominal, _, _, low, *_ = corners(design, Asked.of(design, supply_V=4.0)).corners
    assert drive_figures(low.design, 0.0).rate_limit == "voltage"
    w = np.radians(low.verdicts[0].value) * design.total_ratio
    i = (2.25e-3 + 5.25e-6 * w) / 5.9e-3
    assert 0.055 * i + 5.9e-3 * w == pytest.approx(4.0, rel=1e-9)
    for name, one in low.figures.items():
        assert one.margins.gain_margin_db == nominal.figures[name].margins.gain_margin_db


@pytest.mark.parametrize("quantity", ["gain_margin", "phase_margin"])
def test_the_worst_ends_are_the_worst_of_all_corners_of_the_box(quantity: str) -> None:
    """Four toleranced numbers of the fin: all sixteen corners looked at (the figures are monotone there)."""
    kept = ("motor.rotor_inertia", "motor.resistance", "load.inertia", "friction.viscous")
    parameters = {path: replace(one, tolerance=None) for path, one in FIN.parameters.items()}
    parameters |= {path: FIN.parameters[path] for path in kept}
    design = replace(FIN, parameters=type(FIN.parameters)(parameters))
    chosen = worst_ends(design, quantity)
    nominal = {path: design.parameters[path].value for path in kept}
    width = {path: design.parameters[path].tolerance.half_width for path in kept}
    every = np.array(list(product((-1.0, 1.0), repeat=4))).T
    values = {path: nominal[path] + width[path] * every[k] for k, path in enumerate(kept)}
    at_chosen = {path: np.append(values[path], chosen.get(path, nominal[path])) for path in kept}
    result = population_figures(Population(design, at_chosen, 17), design)
    margin = np.min([v for name, v in result.items() if name.endswith(f".{quantity}")], axis=0)
    assert margin[16] == pytest.approx(margin[:16].min(), rel=1e-9)


def test_torque_and_back_emf_constant_go_together() -> None:
    chosen = worst_ends(load_design("joint"), "gain_margin")
    pair = [chosen["motor.torque_constant"], chosen["motor.back_emf_constant"]]
    assert pair == pytest.approx([0.126, 0.126], rel=1e-12)


def test_command_and_section(cli) -> None:
    told = {one["name"]: one for one in cli.data("corners", "fin", status=1)["corners"]}
    assert told["nominal"]["passed"]
    assert not told["cold"]["passed"]
    assert section(corners(EMPS))["result"].startswith("Every loop is stable")
    unasked = section(corners(replace(EMPS, requirements=())))["result"]
    assert unasked.endswith(" corners. No requirement is judged there.")
    fin = corners(FIN)
    words = section(fin)["result"]
    fails = "The drive fails at 3 of 7 corners (cold; worst gain margin; worst phase margin): "
    assert words.startswith(fails)
    failed = Counter(v["id"] for c in told.values() for v in c["verdicts"] if not v["passes"])
    failed["position loop not stable"] = sum(not c.figures["position"].is_stable for c in fin.corners)
    named = words.rstrip(".").partition("): ")[2].split(", ")
    assert {*named} == {f"{name} at {count}" for name, count in failed.items()}
    panels = [column.panels[0] for column in chart(fin).columns]
    limits = [[item.at for item in panel.items if item.kind == "rule" and item.label] for panel in panels]
    assert limits == [[6.0], [45.0]]
    seen = [item.words for panel in panels for item in panel.items if item.kind == "note"]
    assert seen == ["not stable"] * 2 * sum(
        not one.is_stable for c in fin.corners for one in c.figures.values()
    )
    between = "allowed: above -273.15 and below 1000 degC"
    for asked, allowed in (
        (("--hot", "-60"), "hot -60 degC: must be above cold, -40 degC"),
        (("--cold", "-300"), f"cold -300 degC: {between}"),
        (("--hot", "1500"), f"hot 1500 degC: {between}"),
    ):
        assert allowed in cli.refused("corners", "fin", *asked)


def test_a_corner_that_contradicts_itself_fails_by_name_and_ends_nothing(cli) -> None:
    """A damping held over a tick of 62.5 us is at most J/Ts: 9600 N m s/rad, 6720 with J 30 % lower."""
    joint = with_overrides(load_design("joint"), {"load.moment_damping": "8000 N*m*s/rad"})
    found = {one.name: one for one in corners(joint).corners}
    assert [name for name, one in found.items() if one.refused] == ["worst gain margin"]
    words = found["worst gain margin"].refused["load.moment_damping"]
    assert "allowed: at most 6720 N*m*s/rad" in words
    stiff = replace(joint, requirements=())
    assert [one.name for one in corners(stiff).corners if not one.passed] == ["worst gain margin"]
    said = cli.text("corners", "joint", "--set", "load.moment_damping=8000 N*m*s/rad", status=1)
    assert "load.moment_damping not allowed there" in " ".join(said.split())


def test_a_source_has_no_temperature() -> None:
    names = [one.name for one in corners(EMPS).corners]
    assert names == ["nominal", "low supply", "worst gain margin", "worst phase margin"]
    refused(Asked.of, EMPS, supply_V=-1.0, words="must be positive")
    above = Asked.of(EMPS, supply_V=2.0 * EMPS.limits.voltage_V)
    assert corners(EMPS, above).corners[1].name == "high supply"


def test_grease_that_thickens_is_never_left_out_without_a_word() -> None:
    """A force source has no temperature, its grease has; of a map nobody knows what is grease."""
    thick = 3.0
    (cold,) = (one for one in corners(EMPS, Asked.of(EMPS, cold_viscous=thick)).corners if one.name == "cold")
    assert cold.words == "viscous friction times 3"
    assert cold.design.friction.viscous_Nms_rad == thick * EMPS.friction.viscous_Nms_rad
    mapped = replace(EMPS, friction=Friction(points=stribeck((0.0, 20.0), (0.1, 30.0))))
    refused(corners, mapped, Asked.of(mapped, cold_viscous=thick), words="a friction map has no viscous part")


def test_a_value_set_to_zero_loses_its_relative_tolerance() -> None:
    changed = with_overrides(load_design("ballscrew"), {"coupling.damping": "0 N*s/m"})
    assert changed.coupling.damping_Nms_rad == 0.0
    assert changed.parameters["coupling.damping"].tolerance is None


@pytest.mark.parametrize(("value", "stays"), [(9.0, True), (10.0, True), (20.0, False)])
def test_a_value_beyond_the_limits_of_its_tolerance_loses_it(value: float, stays: bool) -> None:
    """A file that says both is refused, so what is written would not be read again."""
    key, cut = "control.position.gain", {"kind": "truncated-normal", "std": "1 1/s"}
    cut |= {"lower": "6 1/s", "upper": "10 1/s"}
    tree = design_tree(load_design("joint"))
    tree["control"]["position"]["gain"]["tolerance"] = cut
    moved = with_values(design_from_tree(tree, "cut"), {key: value})
    assert (moved.parameters[key].tolerance is not None) == stays
    assert read_design_text(write_design(moved)).controller.position_loop.gain == value


def test_corners_and_samples_say_the_same_of_what_takes_an_analysis(tmp_path, monkeypatch) -> None:
    """Between 10 mA and 1 kA, computed once: one limit fails, the other is known of one design alone."""
    duty = Mock(wraps=asked_figures.duty)
    monkeypatch.setitem(asked_figures._ANSWERS, "duty", duty)
    limits = {"less": 1e-3, "more": 1e3}
    asked = tuple(Requirement(id=id, quantity="duty_current", unit="A", maximum=limit)
                  for id, limit in limits.items())  # fmt: skip
    design = replace(load_design("ilr33-amber"), requirements=asked)
    told: list[tuple[int, int]] = []
    at_corners = corners(design, progress=lambda done, total: told.append((done, total)))
    sampled = monte_carlo(design, tmp_path, MonteCarloSettings(samples=2, worst_cases=False), progress=(
        lambda done, total: told.append((done, total))
    ))  # fmt: skip
    assert told[:2] == told[-2:] == [(0, 2), (1, 2)]
    for found in (at_corners, sampled):
        assert [one.verdict for one in found.left_out] == ["not met", "not proven"]
        assert found.verdict == "not met"
    assert at_corners.left_out[0].reason == sampled.left_out[0].reason
    assert [one.verdict for one in evaluate_requirements(design)] == ["not met", "met"]
    (shown,) = further_sections(design, ["duty"])
    assert shown["verdict"] == "not met"
    assert duty.call_count == 1
    assert "Not met: less, fails in the nominal design: " in section(at_corners)["result"]


@pytest.mark.parametrize(("least", "verdict"), [(0.0, "met"), (1e3, "not met")])
def test_a_margin_at_the_corners_is_judged_by_the_corners(least: float, verdict: str) -> None:
    asked = Requirement(id="worst", quantity="corner_phase_margin", unit="deg", minimum=least)
    design = replace(EMPS, requirements=(asked,))
    found = corners(design)
    assert found.verdict == found.over_all[0].verdict == verdict
    (margins,) = evaluate_requirements(design)
    assert (margins.verdict, margins.value) == (verdict, found.over_all[0].value)


def test_a_figure_that_the_drive_does_not_have_is_not_proven_by_all(tmp_path) -> None:
    """An ideal torque source has no current: margins and corners said so, samples were refused."""
    asked = Requirement(id="amperes", quantity="motor_current", unit="A", maximum=1.0)
    design = replace(EMPS, requirements=(asked,))
    sampled = monte_carlo(design, tmp_path, MonteCarloSettings(samples=2, worst_cases=False))
    found = (*evaluate_requirements(design), *corners(design).corners[0].verdicts, *sampled.left_out)
    assert [one.verdict for one in found] == ["not proven"] * 3
