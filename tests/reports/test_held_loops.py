"""A load that pushes away: an inner loop alone is unstable, the drive is not, and is judged so everywhere."""

import re
from dataclasses import replace
from math import exp
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from actuator_lti import assemble_loops, load_design, stability_margins
from actuator_lti.batch import Population, linear_figures
from actuator_lti.design.model import Design, FrictionPoint, Requirement
from actuator_lti.drive.operating import level
from analyses.linear.loop_figures import all_loop_figures
from analyses.linear.loop_survey import survey_loops
from analyses.margins import margins
from analyses.specification.requirements import evaluate_requirements, tally
from analyses.tuning.problem import problem_of
from analyses.validation import QUICK, validate
from tests.changed import changed

SET = ["--set", "load.path=back-drivable", "--set"]
PUSHED = [*SET, "load.moment_slope=1 N*m/rad"]


def pushed(slope_Nm_rad: float = 1.0, **more: Any) -> Design:
    load = {"path": "back-drivable", "moment_slope_Nm_rad": slope_Nm_rad}
    return changed(load_design("ilr33-amber"), load=load, **more)


def p_velocity(slope_Nm_rad: float) -> Design:
    """Without the integral of the speed, which is the angle: the position loop alone holds the load."""
    return pushed(slope_Nm_rad, controller={"velocity": {"integral_time_s": None}})


def falling_friction(slope_Nm_rad: float = 0.0) -> Design:
    """J s + b with b < 0: s ((L s + R)(J s + b) + k^2) + Kp (s + 1/Ti)(J s + b) is below 0 at s = 0."""
    dry = load_design("ilr33-amber").friction.dry_torque_Nm
    points = tuple(FrictionPoint(speed_rad_s=w, torque_Nm=dry * x) for w, x in ((0, 1), (20, 0.7), (300, 2)))
    friction = {"dry_torque_Nm": 0.0, "viscous_Nms_rad": 0.0, "points": points}
    return pushed(slope_Nm_rad, friction=friction, requirements=())


def overfed(slope_Nm_rad: float = -1.0) -> Design:
    """1.3 times the back-EMF fed forward, J s (R + Kp) < 0.3 kM kE at s = 0: the rotor runs away."""
    law = {"integral_time_s": None, "back_emf_feedforward": 1.3}
    return pushed(slope_Nm_rad, controller={"current": law}, requirements=())


def on_a_spring(slope_Nm_rad: float = -1000.0) -> Design:
    """Without friction, its back-EMF fed forward: the pole of a held spring grows by K Ts^2/(4 J N^2)."""
    friction = {"viscous_Nms_rad": 0.0}
    control, small = {"current": {"back_emf_feedforward": 0.5}}, {"full_deflection_rad": 0.005}
    return pushed(slope_Nm_rad, friction=friction, controller=control, requirements=(), validation=small)


def held_phase_margin_deg(design: Design) -> float:
    """PI(z) (1 - a)/(R (z - a)) behind the delay, a = exp(-R T/L): the winding alone, its voltage held."""
    motor, law, T = design.effective_motor, design.controller.current, design.controller.period_s
    R, a = motor.resistance_ohm, exp(-motor.resistance_ohm * T / motor.inductance_H)
    assert design.controller.computing_delay_s == 0.0

    def L(angle: float) -> complex:
        z = np.exp(1j * angle)
        pi = law.gain_V_A * (1 + T / law.integral_time_s * z / (z - 1))
        return complex(pi * (1 - a) / (R * (z - a)))

    crossover = brentq(lambda angle: abs(L(angle)) - 1.0, 1e-4, 3.1)
    return float(np.degrees(np.angle(-L(crossover))))


def test_the_current_loop_is_judged_with_the_rotor_held() -> None:
    design = pushed(controller={"computing_delay_s": 0.0})
    figures = all_loop_figures(assemble_loops(design))
    current, expected = figures["current"], held_phase_margin_deg(design)
    # J s^2 + Cv s - k: a root on the right
    assert (current.margins.stable, current.is_stable) == (False, True)
    assert figures["position"].stable
    # without a load that pushes, an unstable current loop inside a stable drive stays what it is
    own = all_loop_figures(assemble_loops(overfed()))
    assert [(one.stable, one.held) for one in own.values()] == [(False, None), (True, None), (True, None)]
    assert current.judged.margins.phase_margin_deg == pytest.approx(expected, abs=1e-6)
    asked = Requirement(id="pm", quantity="phase_margin", unit="deg", loop="every", minimum=10.0)
    verdicts = evaluate_requirements(replace(design, requirements=(asked,)), figures)
    assert tally(verdicts).passes
    found = {verdict.loop: verdict for verdict in verdicts}
    assert found["current"].value == pytest.approx(expected, abs=1e-6)
    assert "with the rotor locked" in found["current"].reason
    assert "held" not in found["velocity"].reason
    budget = survey_loops(replace(design, requirements=())).budgets["current"]
    assert (budget.rotor, 180.0 + budget.total_deg) == ("locked", pytest.approx(expected, abs=1e-6))


def test_a_p_velocity_loop_is_judged_under_a_constant_load() -> None:
    """J s + Cv + kM Kp - k/s: unstable for every k > 0; with the position loop stable while kM Kp Kv > k."""
    design = p_velocity(1.0)
    figures = all_loop_figures(assemble_loops(design))
    assert [figures[name].margins.stable for name in ("velocity", "position")] == [False, True]
    free = changed(design, load={"moment_slope_Nm_rad": 0.0})
    alone = stability_margins(assemble_loops(free).velocity.open_loop)
    assert figures["velocity"].judged.margins == alone
    assert level(design) == free


def test_a_drive_that_its_load_drives_away_is_judged_as_it_is() -> None:
    """A slope beyond what the position loop holds, kM Kp Kv N^2 (P velocity): nothing is held."""
    law, motor = p_velocity(1.0).controller, load_design("ilr33-amber").effective_motor
    stiffness = motor.torque_constant_Nm_A * law.velocity.gain * law.position.gain
    limit = stiffness * load_design("ilr33-amber").total_ratio ** 2
    for share, stable in ((0.98, True), (1.02, False)):
        figures = all_loop_figures(assemble_loops(p_velocity(share * limit)))
        assert figures["position"].margins.stable is stable
        assert {figures[name].is_stable for name in ("current", "velocity")} == {stable}


@pytest.mark.parametrize(("design", "held", "verdict"), [
    (falling_friction(), ["current"], "met"),
    (on_a_spring(), ["current"], "met"),
    (replace(p_velocity(1.0), requirements=()), ["current", "velocity"], "met"),
    # nothing around the current loop stops the load that pushes away
    (pushed(requirements=(), controller={"position": None, "velocity": None}), [], "not met"),
])  # fmt: skip
def test_margins_and_validate_judge_the_same_loops(design: Design, held: list[str], verdict: str) -> None:
    found, checked = margins(design), validate(design, QUICK)
    assert [name for name, one in found.loops.items() if one.held is not None] == held
    assert list(checked.held) == held
    assert found.loops["current"].margins.stable is False
    assert (found.verdict, checked.verdict) == (verdict, verdict)
    assert ("the current loop is unstable, rotor free" in checked.words) is (verdict == "not met")
    assert bool(checked.settlings) is bool(held)


def test_many_designs_at_once_are_judged_alike() -> None:
    slopes = np.array([-1000.0, -1.0, 0.0, 1.0, 100.0])
    for make in (pushed, p_velocity, falling_friction, on_a_spring, overfed):
        many = linear_figures(Population(make(1.0), {"load.moment_slope": slopes}, len(slopes)), held=True)
        for k, slope in enumerate(slopes):
            single = all_loop_figures(assemble_loops(make(float(slope))))
            for name, one in single.items():
                assert many.stable(name)[k] == one.is_stable
                for quantity in ("phase_margin_deg", "gain_margin_db"):
                    value = getattr(one.judged.margins, quantity)
                    found = many.quantity(quantity.rpartition("_")[0], name)[k]
                    assert found == pytest.approx(np.inf if value is None else value, abs=1e-6)


def test_tuning_starts_from_met_requirements() -> None:
    design = pushed()
    limits = (("phase_margin", "deg", 10.0), ("gain_margin", "dB", 3.0))
    asked = [Requirement(id=q, quantity=q, unit=unit, loop="every", minimum=low) for q, unit, low in limits]
    problem = problem_of(design, tuple(asked), {})
    assert (problem.distances(problem.start[None, :], problem.all_corners[:1]) > 0.0).all()


def test_the_command_line_says_which_case_it_is(cli) -> None:
    first = " ".join(cli.text("margins", "ilr33-amber", *PUSHED).split())
    for words in ("PASS", "all loops closed", "with the rotor locked", "outer loops open and rotor free"):
        assert words in first
    current = cli.data("margins", "ilr33-amber", *PUSHED)["loops"]["current"]
    assert current["stable"] is False
    assert (current["judged"]["how"], current["judged"]["stable"]) == ("rotor locked", True)
    assert "FAIL" in cli.text("margins", "ilr33-amber", *SET, "load.moment_slope=1e9 N*m/rad", status=1)


@pytest.mark.parametrize("held", [[], PUSHED], ids=["as it is", "held"])
def test_a_range_stands_under_the_loop_whose_margins_it_begins_or_ends_with(held, cli, monkeypatch) -> None:
    """Sliding is one of the operating points, so one end of each range is the margin of its column."""
    monkeypatch.setenv("COLUMNS", "250")

    lines = cli.text("margins", "ilr33-amber", *held).splitlines()

    def row(*words: str) -> dict[int, str]:
        line = next(line for line in lines if all(word in line for word in words))
        return {one.end(): one[0] for one in re.finditer(r"\S+(?: \S+)*", line)}

    for name, unit in (("Gain margin", "dB"), ("Phase margin", "deg")):
        own, over = row(f"{name}, {unit}"), row(f"{name}, operating points, {unit}")
        ranges = {end: text for end, text in over.items() if end in own and end > min(own)}
        assert len(ranges) == 3
        for end, text in ranges.items():
            words = text.split()
            assert f"{float(own[end]):.3g}" in (words[0], words[-1])
        assert row("Velocity", "Position")[min(ranges)].endswith("locked" if held else "free")


@pytest.mark.parametrize("design", [pushed(), p_velocity(1.0), on_a_spring(), load_design("joint")], ids=str)
def test_one_loop_alone_has_the_bits_that_it_has_among_all(design: Design) -> None:
    """Also where it is held, which asks whether the drive as a whole is stable."""
    gain = design.controller.velocity.gain * np.array([0.5, 1.0, 100.0])
    population = Population(design, {"control.velocity.gain": gain}, 3)
    every = linear_figures(population, held=True)
    for loop in every.loops:
        one = linear_figures(population, held=True, loops=(loop,))
        assert one.loops == (loop,)
        np.testing.assert_array_equal(one.raw[:, one._index(loop)], every.raw[:, every._index(loop)])
