"""A design of healthy margins that diverges behind a limit is found; the limit that clamps an integral."""

from math import degrees, inf, pi, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from actuator_lti import assemble_loops, load_design, stability_margins
from actuator_lti.asked.verdict import Verdict
from actuator_lti.design import model
from analyses.large_signal import conditional as behind_limits
from analyses.large_signal.conditional import Conditional, conditional_stability, step_threshold
from analyses.motion.settling import settle
from analyses.validation import QUICK, validate
from analyses.validation.places import Bench
from analyses.validation.small_signal import small_signal
from nonlinear import Rows, commands, simulate
from reports.sections.beyond import large_commands as section
from tests.changed import changed
from tests.loops.loop_designs import source_drive
from tests.validation.random_drives import full_drive

DESIGN = load_design(Path(__file__).with_name("conditional.toml"))


def looked(design: model.Design) -> Conditional:
    return conditional_stability(design, assemble_loops(design))


@pytest.fixture(scope="module")
def conditional() -> Conditional:
    return looked(DESIGN)


def test_the_margins_are_healthy_and_it_is_found(conditional: Conditional) -> None:
    for loop in assemble_loops(DESIGN).present.values():
        margins = stability_margins(loop.open_loop)
        assert margins.stable
        assert margins.gain_margin_db > 6.0
        assert margins.phase_margin_deg > 45.0
    assert conditional.diverges
    assert conditional.hidden
    assert conditional.limiter == "voltage"
    assert conditional.threshold_rad < conditional.full_deflection_rad


def test_the_threshold_is_where_steps_stop_settling(conditional: Conditional) -> None:
    """By the simulator itself, outside the validator: below it settles, above it runs away."""
    for factor, settles in ((0.99, True), (1.01, False)):
        size = factor * conditional.threshold_rad
        run = simulate(DESIGN, commands.step(size), 20.0)
        left = np.abs(run.output_angle_rad[-2000:] - size).max() / size
        assert bool(left < 0.05) is settles
        assert bool(left > 1.0) is not settles


def test_lower_gain_margin_by_hand(conditional: Conditional) -> None:
    """Stable above g = 1/(w_v (Tn + 1/Kv)), w_v = Kp kM/J, by Routh: the delay-free cubic, within 3 %."""
    by_hand = 1.0 / (2.5 * 0.02 / 1e-3 * (0.041 + 1.0 / 24.0))
    assert conditional.margins["i_ref"].gain_lower == pytest.approx(by_hand, rel=0.05)


def test_the_describing_function_predicts_the_limit_cycle(conditional: Conditional) -> None:
    """First harmonic only: amplitude and frequency of the limit cycle within a fifth."""
    (one,) = conditional.predictions
    assert one.point == "i_ref"
    assert one.limit == pytest.approx(12.0)
    assert not one.antiwindup
    assert behind_limits.saturation_gain(one.amplitude / one.limit) == pytest.approx(one.gain_lower, rel=1e-9)
    assert conditional.oscillation_hz == pytest.approx(one.frequency_hz, rel=0.2)
    assert conditional.oscillation_rad == pytest.approx(one.output_rad, rel=0.2)


def test_it_goes_away_with_the_limit_or_with_knowledge_of_it() -> None:
    """More voltage: the border moves away. The current limited where the velocity controller knows: none."""
    assert not looked(changed(DESIGN, limits={"voltage_V": 48.0})).diverges
    kept = looked(changed(DESIGN, limits={"peak_current_A": 12.0, "voltage_V": 200.0}))
    assert not kept.diverges
    assert all(one.antiwindup for one in kept.predictions)
    free = changed(DESIGN, limits={"voltage_V": 1e9, "peak_current_A": inf})
    assert step_threshold(free) == (None, None)


def test_a_current_loop_without_an_integral_is_asked_for_more_than_flows() -> None:
    """P loop of R/2: i = i_ref/3. U/R = 12 A takes i_ref = 36 A, so a limit of 20 A acts first."""
    current = {"gain_V_A": 0.5, "integral_time_s": None}
    loops = {"current": current, "velocity": {"gain": 3.0 * DESIGN.controller.velocity.gain}}
    for most, limit, name in ((inf, 36.0, "voltage limit as a current, U/R"), (20.0, 20.0, "current limit")):
        design = changed(DESIGN, controller=loops, limits={"peak_current_A": most})
        (found,) = [one for one in looked(design).predictions if one.point == "i_ref"]
        assert (found.limit, found.limiter) == (pytest.approx(limit), name)
        assert found.antiwindup is (name == "current limit")
        s, back_emf = 2j * pi * found.frequency_hz, 0.02**2 / 1.5  # kM kE/(R + Kp), N m s/rad
        behind = found.gain_lower * found.amplitude * 0.02 / 3.0  # N m, the fundamental
        drag = DESIGN.friction.viscous_Nms_rad + back_emf
        assert found.output_rad == pytest.approx(behind / abs(1e-3 * s**2 + drag * s), rel=1e-9)


@pytest.mark.parametrize("name", ["ilr33-amber", "ilr33-amber-multirate", "ctms-motor-position", "emps"])
def test_shipped_designs_settle_from_every_step(name: str) -> None:
    result = looked(load_design(name))
    assert not result.diverges
    assert result.next_rad is None


def test_the_validator_says_so() -> None:
    result = validate(DESIGN, QUICK)
    assert not result.not_met  # every small-signal prediction holds
    assert not result.passed  # and yet
    assert "makes the drive diverge" in str(result)
    assert result.verdict == "not met"
    made = section(result.conditional)
    assert made["status"] == "fail"
    words = made["result"]
    assert f"{degrees(result.conditional.threshold_rad):.4g} deg" in words
    assert "although every loop is stable by its linear margins" in words


def test_limits_are_named_as_everywhere() -> None:
    """It said "the voltage limit limit" and "the overload limit"."""
    seen = behind_limits.Prediction("u", 12.0, "voltage limit", 0.5, 20.0, 8.0, 0.01, antiwindup=False)
    found = behind_limits.Conditional(
        margins={}, predictions=(seen,), threshold_rad=0.1, next_rad=0.11, full_deflection_rad=0.2,
        oscillation_hz=8.0, oscillation_rad=0.01, limiter="overload", ending="diverges",
    )  # fmt: skip
    made = section(found)
    assert "the overload protection acts" in made["result"]
    assert "The describing function of the voltage limit predicts" in made["blocks"][1]["text"]


def test_saturation_gain() -> None:
    """Analytic: 1 up to the limit, 1/3 + sqrt(3)/(2 pi) at twice the limit, 4/(pi a) far beyond."""
    assert behind_limits.saturation_gain(0.5) == 1.0
    assert behind_limits.saturation_gain(2.0) == pytest.approx(1.0 / 3.0 + 3.0**0.5 / (2.0 * pi), rel=1e-12)
    assert behind_limits.saturation_gain(1e4) == pytest.approx(4.0 / (pi * 1e4), rel=1e-8)
    for gain in (0.9, 0.3, 0.01):
        ratio = behind_limits.saturation_ratio(gain)
        assert behind_limits.saturation_gain(ratio) == pytest.approx(gain, rel=1e-10)


@pytest.mark.parametrize(("seed", "ending", "limiter"), [
    (91, "keeps oscillating", "overload"),
    (333, "diverges", "torque-command"),
    (3108, "", "voltage"),  # 45 times as large a step was named: an irregular swing, by either word
])  # fmt: skip
def test_a_finding_on_a_random_drive_is_that_of_plain_runs(seed: int, ending: str, limiter: str):
    """2 % below the threshold the error dies out, 2 % above it grows beyond the step itself."""
    design = changed(full_drive(seed), encoder={"counts_per_rev": None}, supply=None)
    found = looked(design)
    assert found.limiter == limiter
    assert found.ending == ending or (not ending and found.ending in ("keeps oscillating", "diverges"))
    assert found.limiter_share > 0.9
    for factor, settles in ((0.98, True), (1.02, False)):
        size = factor * found.threshold_rad
        seconds = min(settle(design, 0.0, size).rest.after_s, 400_000 * design.controller.period_s)
        output = simulate(design, commands.step(size), seconds).output_angle_rad
        left = np.abs(output / size - 1.0)[-len(output) // 8 :].max()
        assert left < 1e-3 if settles else left > 2.0


def unstable(slope_Nm_rad: float, volts: float = 10.0, full_rad: float = 3.0) -> model.Design:
    """A torque source with P controllers on a load that pushes away from the middle."""
    velocity = model.VelocityLoop(gain=1.6, integral_time_s=None)
    loops = {"position": model.PositionLoop(gain=30.0), "velocity": velocity}
    load = {"inertia_kgm2": 0.1, "path": "back-drivable", "moment_slope_Nm_rad": slope_Nm_rad}
    more = {"command": {"rate_rad_s": 0.2}, "validation": {"full_deflection_rad": full_rad}}
    gears = (model.Gear(name="g", ratio=10.0),)
    return source_drive(1e-3, 0.5, 2e-4, volts, gears=gears, load=load, controller=loops, **more)


@pytest.mark.parametrize("slope", [20.0, 40.0])
def test_largest_deflection_that_an_unstable_load_lets_come_back(slope: float) -> None:
    """J th'' = c th + tau: th + th'/l, l = sqrt(c/J), within tau_max/c; P controllers end at r K/(K - c)."""
    found = looked(unstable(slope))
    N, k, J = 10.0, 0.5, 2e-3
    largest = k * 10.0 * N / slope * (1.0 - slope / (k * 1.6 * 30.0 * N**2))
    creeping = 0.2 / sqrt(slope / N**2 / J)
    assert (found.ending, found.limiter) == ("diverges", "voltage")
    assert largest - creeping < found.threshold_rad < largest * (1.0 + 1e-3)


def test_a_load_that_pushes_back_holds_the_drive_and_nothing_diverges() -> None:
    """A spring: P controllers end at r K/(K + c), no divergence; the limit holds beyond tau_max/c."""
    damped = model.Friction(viscous_Nms_rad=0.02)
    assert not looked(changed(unstable(-40.0, full_rad=1.2), friction=damped)).diverges
    found = looked(changed(unstable(-40.0), friction=damped))
    stiffness = 0.5 * 1.6 * 30.0 * 10.0**2
    assert (found.ending, found.limiter) == ("is held by a limit", "voltage")
    assert found.threshold_rad == pytest.approx(0.5 * 10.0 * 10.0 / 40.0 * (1.0 + 40.0 / stiffness), rel=2e-3)


@pytest.mark.parametrize("seed", [361, 372])
def test_standing_beside_the_target_is_no_divergence(seed: int) -> None:
    """A spring against P controllers (361); a step below one count of the output's encoder (372)."""
    assert not looked(full_drive(seed)).diverges


def test_hunting_is_no_conditional_stability() -> None:
    """A PI position controller against dry friction never rests; no limit does it, and no limit stops it."""
    design = full_drive(1020)
    assert design.controller.position_loop.integral_time_s is not None
    assert step_threshold(design) == (None, None)
    assert settle(design, 0.0, design.validation.full_deflection_rad).hunting


T, k, J, Kp, Tn, Kv, LIMIT = 5e-4, 0.5, 0.02, 6.0, 0.05, 12.0, 30.0


def drive(law: str, feedforward: float = 3.0) -> model.Design:
    velocity = model.VelocityLoop(gain=Kp, integral_time_s=Tn, anti_windup=law)
    place = model.PositionLoop(gain=Kv, acceleration_feedforward=feedforward)
    stages = {"position": place, "velocity": velocity}
    return source_drive(J, k, T, LIMIT, load={"path": "back-drivable"}, controller=stages)


def sizes(hertz: Any, feedforward: float = 3.0) -> tuple[np.ndarray, np.ndarray]:
    """|U/R| and |I'/R| on the unit circle."""
    z, b = np.exp(2j * np.pi * np.asarray(hertz) * T), T * k / J
    per_u = Kv * T * b * (z + 1.0) / (2.0 * (z - 1.0) ** 2) + b / (z - 1.0)
    integral = Kp * T / Tn * z / (z - 1.0)
    F = feedforward * J / k * (1.0 - 1.0 / z) ** 2 / T**2
    u = ((Kp + integral) * Kv + F) / (1.0 + (Kp + integral) * per_u)
    return np.abs(u), np.abs(integral * (Kv - per_u * u))


@pytest.mark.parametrize("law", ["clamped", "conditional"])
def test_the_clamp_is_judged(law: str) -> None:
    """By what stands in front of it, the output and the integral."""
    design = drive(law)
    rows = [row for place in Bench(design, design).onsets() for row in small_signal(place)]
    assert [row.name for row in rows] == ["voltage_onset", "voltage_onset_integral"][: 1 + (law == "clamped")]
    assert {row.verdict for row in rows} == {Verdict.MET}


@pytest.mark.parametrize("law", ["clamped", "conditional"])
def test_a_run_says_that_the_integral_is_clamped(law: str) -> None:
    """Between both borders nothing limits the output; the clamp alone acts, and is told of."""
    hertz = 2.0
    output, integral = (float(x) for x in sizes(hertz))
    assert integral > 1.2 * output
    amplitude, design = 0.5 * (LIMIT / output + LIMIT / integral), drive(law)
    run = simulate(design, commands.sine(amplitude, hertz), 3.0, limits_on=True)
    late = run.limit_active("voltage")[run.time_s > 2.0]
    assert bool(late.any()) == (law == "clamped")
    assert np.abs(run.voltage_V[run.time_s > 2.0]).max() < LIMIT
    assert Rows.of(design)["velocity_windup"][0] == (1.0 if law == "clamped" else 0.0)
