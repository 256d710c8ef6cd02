"""Dry friction at small signals: threshold, lost motion, standing error, limit cycles."""

import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from actuator_lti import load_design
from actuator_lti.design import with_values
from actuator_lti.design.model import Design
from analyses.friction_effects import friction_effects
from analyses.friction_effects.breakaway import Hysteresis, Threshold, hysteresis, static_threshold, threshold
from analyses.friction_effects.result import limit_cycles
from analyses.motion.settling import SMALL, settle, settlings_of
from nonlinear import Rows
from nonlinear.bench.operating_motion import quiet
from nonlinear.settling.rest import first_motion_s
from reports.sections.friction_effects import section

STIFFNESS = 5.9e-3 * 0.12 * 120.0 * 2376.0  # of ilr33-amber: motor torque over error of the output
FIN = 1.0 / 60.0 + 1.7e-3  # motor torque per torque on the fin: what passes, and 10 % of it lost


@pytest.fixture(scope="module")
def amber() -> Design:
    return load_design("ilr33-amber")


def test_threshold_of_a_force_source_is_friction_over_stiffness() -> None:
    """EMPS: (Fc -+ offset)/(gtau kv kp), forward and backward; the simulator agrees to its grid of 0.2 %."""
    design = load_design("emps")
    result = friction_effects(design).points[0].threshold
    stiffness = 35.15065 * 243.45 * 160.18
    assert result.static.forward_rad == pytest.approx((20.3935 - 3.1648) / stiffness, rel=1e-12)
    assert result.static.backward_rad == pytest.approx((20.3935 + 3.1648) / stiffness, rel=1e-12)
    assert result.simulated_rad == pytest.approx(result.static.forward_rad, rel=1.1 * result.resolution)


def _joint_rate(loop: Hysteresis) -> float:
    """0.6 s of integral time behind 15 % of the torque of gravity, which grows at that rate."""
    rate = 4.0 * loop.amplitude_rad * loop.frequency_hz
    return 2.0 * 0.6 / 14.4 * 1.5e-3 * 6.0 * 9.80665 * 0.3 * rate


@pytest.mark.parametrize(
    ("name", "load_Nm", "expected", "within"),
    [
        ("ilr33-amber", 0.0, lambda loop: 0.0, 0.0),
        ("emps", 0.0, lambda loop: 2.0 * 20.3935 / (35.15065 * 243.45 * 160.18), 1e-9),
        ("ilr33-amber-compliant", 0.0, lambda loop: 2.0 * 0.05 / 1500.0 + 1e-3, 1e-9),  # at rest in the play
        ("ilr33-amber-compliant", 8.0, lambda loop: 2.0 * 0.05 / 1500.0, 1e-9),  # which the load takes out
        ("ballscrew", 0.0, lambda loop: 2.0 * 30.0 / 1e8, 1e-9),
        ("joint", 0.0, _joint_rate, 1e-4),
        # (T0 + C0_l f)/(gain + 30 f), f the motor's torque per torque on the fin, which the moment relieves
        ("fin", 0.0, lambda loop: 2.0 * (0.008 + 0.05 * FIN) / (60 * 0.03 * 0.12 * 110 + 30 * FIN), 2e-3),
    ],
)
def test_what_a_reversal_loses_is_predicted(
    name: str, load_Nm: float, expected: Callable[[Hysteresis], float], within: float
) -> None:
    """Behind a motor's sensor 2 C0_l/k and the play; in front of it the error that friction asks for."""
    design = quiet(load_design(name))
    static = threshold(design, load_Nm).static
    loop = hysteresis(design, load_Nm, static, 150_000 if name == "joint" else 3000)
    rounding = 1e-12 * loop.amplitude_rad
    assert loop.predicted_rad == pytest.approx(expected(loop), rel=1e-6 + within, abs=rounding)
    assert loop.lost_motion_rad == pytest.approx(loop.predicted_rad, rel=within, abs=rounding)


def test_the_error_that_stays_of_a_force_source_is_less_than_its_threshold() -> None:
    """And the largest one is what the section says, though a smaller step leaves a larger share of itself."""
    design = load_design("emps")
    static, result = static_threshold(design), friction_effects(design)
    errors = [abs(one.rest.error) for one in result.points[0].cycles.settlings]
    assert {one.rest.verdict for one in result.points[0].cycles.settlings} == {"at rest"}
    assert all(0.0 < error <= max(static.forward_rad, static.backward_rad) for error in errors)
    assert f"an error of up to {1e6 * max(errors):.3g} µm is left" in section(result)["result"]


@pytest.mark.parametrize("name", ["ilr33-amber", "ilr33-amber-compliant"])
def test_a_small_step_waits_for_the_integral(name: str) -> None:
    """The threshold is Tc/(kM Kp Kv N); behind a spring too: it carries the load before the step comes."""
    for point in friction_effects(load_design(name)).points:
        waits(point.threshold, point.dry_torque_Nm)


def waits(result: Threshold, torque_Nm: float) -> None:
    """Tn (A0/A - 1), and a few ticks until the current follows; A0 by the torque that holds the motor."""
    assert result.static.forward_rad == pytest.approx(torque_Nm / STIFFNESS, rel=1e-12)
    assert len(result.waiting) == 5
    for wait in result.waiting:
        assert wait.simulated_s == pytest.approx(wait.predicted_s, abs=6e-4)


def test_a_small_step_waits_at_the_angle_where_it_stands(amber: Design) -> None:
    """Cogging of 1 mN m that turns forward, half of it where the drive stands, leaves less to overcome."""
    cogging = {"motor.cogging": 1e-3, "motor.cogging_periods": 4.0, "motor.cogging_phase": math.pi / 6.0}
    waits(threshold(quiet(with_values(amber, cogging)), 0.0), 2.25e-3 - 0.5e-3)


def test_breakaway_above_friction_counts_in_the_threshold(amber: Design) -> None:
    higher = with_values(amber, {"friction.breakaway_ratio": 1.5})
    assert static_threshold(higher).forward_rad == pytest.approx(1.5 * static_threshold(amber).forward_rad)


def test_the_integral_takes_lost_motion_and_error_away(amber: Design) -> None:
    for point in friction_effects(amber).points:
        loop = point.hysteresis
        assert abs(loop.lost_motion_rad) < 1e-9 * loop.amplitude_rad
        assert loop.largest_rad > 0.5 * static_threshold(amber, point.load_Nm).forward_rad
        for one in point.cycles.settlings:
            assert abs(one.rest.error) < 1e-6 * one.amplitude_rad


@pytest.mark.parametrize(("breakaway", "hunts"), [(1.0, False), (1.5, True)])
def test_hunting_needs_breakaway_above_sliding_friction(amber: Design, breakaway: float, hunts: bool) -> None:
    """A fast speed integral and high Kv: it hunts once breakaway exceeds sliding friction, else not.

    A describing function of dry friction foresees none either way; the simulator refutes it.
    """
    values = {"friction.breakaway_ratio": breakaway, "control.velocity.integral_time": 3e-3}
    design = with_values(amber, {**values, "control.position.gain": 250.0})
    threshold = static_threshold(design).forward_rad
    cycles = limit_cycles(design, 0.0)
    assert cycles.confirmations == ()
    assert (cycles.hunting is not None) == hunts
    assert cycles.described == (not hunts)
    if cycles.hunting is not None:
        assert not cycles.hunting.rest.limited
        assert cycles.hunting.rest.frequency_hz == pytest.approx(9.59, rel=0.01)
        assert cycles.hunting.swing_rad == pytest.approx(0.0991 * threshold, rel=0.02)
        # the same from any start: it is a cycle, not a slow decay
        again = settle(design, 0.0, 3.0 * threshold)
        assert again.swing_rad == pytest.approx(cycles.hunting.swing_rad, rel=0.01)


@pytest.mark.parametrize("load", [0.0, 8.0])
def test_friction_keeps_an_unstable_loop_quiet_up_to_the_foreseen_amplitude(
    amber: Design, load: float
) -> None:
    """Speed gain beyond its margin: small motion dies out, large grows; border to 15 %, frequency to 8 %."""
    design = with_values(amber, {"control.velocity.gain": 3.0})
    cycles = limit_cycles(design, load)
    assert len(cycles.confirmations) == 1
    item = cycles.confirmations[0]
    assert not item.cycle.stable
    assert item.verdict == "confirmed"
    assert item.ratio == pytest.approx(1.0, rel=0.15)
    assert item.frequency_hz == pytest.approx(item.cycle.frequency_hz, rel=0.08)


def test_the_foreseen_amplitude_grows_with_friction(amber: Design) -> None:
    """The slope 4 Tc/(pi W) at the border is the same, so W goes with Tc."""
    design = with_values(amber, {"control.velocity.gain": 3.0})
    small, large = (limit_cycles(design, load).confirmations[0].cycle.inner_rad for load in (0.0, 8.0))
    friction = design.friction
    assert large / small == pytest.approx(friction.dry_Nm(8.0) / friction.dry_Nm(0.0), rel=1e-9)


@pytest.mark.parametrize("integral_time", [15e-3, 3e-3])
@pytest.mark.parametrize("gain", [60.0, 120.0, 250.0])
def test_stick_slip_is_foreseen(amber: Design, integral_time: float, gain: float) -> None:
    """Breakaway 1.5: amplitude within 6 %, frequency within 3 %; also where larger steps slide to rest."""
    values = {"friction.breakaway_ratio": 1.5, "control.velocity.integral_time": integral_time}
    design = with_values(amber, {**values, "control.position.gain": gain})
    cycles = friction_effects(design).points[0].cycles
    assert cycles.stick_slip.stable
    assert cycles.as_predicted
    swing = cycles.hunting
    assert swing is not None
    assert swing.swing_rad == pytest.approx(cycles.stick_slip.output_amplitude_rad, rel=0.06)
    assert swing.rest.frequency_hz == pytest.approx(cycles.stick_slip.frequency_hz, rel=0.03)


def test_stick_slip_needs_breakaway_above_friction_and_an_integral(amber: Design) -> None:
    cycles = [point.cycles for point in friction_effects(amber).points]
    assert {(one.stick_slip, one.as_predicted) for one in cycles} == {(None, True)}
    emps = with_values(load_design("emps"), {"friction.breakaway_ratio": 2.0})
    assert friction_effects(emps).points[0].cycles.stick_slip is None


def test_a_smoothed_law_is_not_said_to_have_a_threshold() -> None:
    result = friction_effects(load_design("ilr33-amber-tanh"))
    (threshold,) = [b for b in section(result)["blocks"] if b.get("caption", "").startswith("Threshold")]
    assert all(row["threshold"] is None and row["width"] is None for row in threshold["rows"])
    assert "no threshold" in threshold["note"]
    assert "below the threshold" not in threshold["note"]


def test_not_applicable_without_dry_friction_and_too_weak_to_move(amber: Design) -> None:
    result = friction_effects(load_design("ctms-motor-position"))
    assert result.points == ()
    assert "no dry friction" in result.reason
    weak = replace(amber, limits=replace(amber.limits, peak_current_A=0.3))
    assert static_threshold(weak).forward_rad == math.inf
    assert friction_effects(weak).points[0].threshold is None


EXTRUDER = """
[design]
name = "map"
[motor]
resistance = "2 ohm"
inductance = "0.3 mH"
torque_constant = "0.05 N*m/A"
back_emf_constant = "0.05 V*s/rad"
rotor_inertia = "2e-5 kg*m^2"
[[gear]]
name = "g"
ratio = 20
[load]
inertia = "0.002 kg*m^2"
path = "self-locking"
[friction]
{friction}
[limits]
voltage = "36 V"
[control]
period = "200 us"
computing_delay = "100 us"
[control.velocity]
gain = "0.25 V*s/rad"
{velocity}
[control.position]
gain = "25 1/s"
{position}
[validation]
full_deflection = "45 deg"
loads = ["0 N*m"]
"""
MAP = "".join(
    f'[[friction.point]]\nspeed = "{speed} rad/s"\ntorque = "{torque} mN*m"\n'
    for speed, torque in ((0, 30), (8, 36), (300, 60))
)


def _design(folder: Path, position: str = "", velocity: str = "", friction: str = MAP) -> Design:
    path = folder / "drive.toml"
    path.write_text(EXTRUDER.format(position=position, velocity=velocity, friction=friction))
    return load_design(path)


def test_a_friction_map_is_dry_friction(tmp_path) -> None:
    """The torque at rest over the stiffness: 30 mN m / (kM/R Kp Kv N)."""
    stiffness = 0.05 / 2.0 * 0.25 * 25.0 * 20.0
    result = friction_effects(_design(tmp_path))
    assert result.integrator == ""
    (point,) = result.points
    assert point.dry_torque_Nm == pytest.approx(0.03)
    assert point.threshold.static.forward_rad == pytest.approx(0.03 / stiffness, rel=1e-12)
    assert point.threshold.simulated_rad == pytest.approx(0.03 / stiffness, rel=3e-3)
    assert "No controller integrates" in section(result)["result"]


def test_the_position_integral_moves_a_small_step(tmp_path) -> None:
    """T (A0/A - 1) with the position's integral time; no error stays, and the words say who integrates."""
    result = friction_effects(_design(tmp_path, 'integral_time = "0.4 s"'))
    assert result.integrator == "position"
    for share, wait in zip((0.2, 0.3, 0.5, 0.7, 0.9), result.points[0].threshold.waiting, strict=True):
        assert wait.predicted_s == pytest.approx(0.4 * (1.0 / share - 1.0))
        assert wait.simulated_s == pytest.approx(wait.predicted_s, abs=2e-3)
    words = section(result)["result"]
    assert "position" in words
    assert "No controller" not in words


def test_two_integrals_one_behind_the_other(tmp_path) -> None:
    """Constant error: the torque grows as 1 + t/T + t/U + t^2/(2 T U), integrated here step by step."""
    result = friction_effects(_design(tmp_path, 'integral_time = "0.4 s"', 'integral_time = "80 ms"'))
    assert result.integrator == "speed"
    for wait in result.points[0].threshold.waiting:
        ratio = result.points[0].threshold.static.forward_rad / wait.amplitude_rad
        t, outer, inner, dt = 0.0, 0.0, 0.0, 1e-5
        while (1.0 + outer) + inner < ratio:
            inner += (1.0 + outer) * dt / 0.08
            outer += dt / 0.4
            t += dt
        assert wait.predicted_s == pytest.approx(t, rel=1e-3, abs=1e-4)
        assert wait.simulated_s == pytest.approx(t, rel=1e-2, abs=2e-3)


KICKS = {"acceleration_feedforward": 1.0, "derivative_time": 1e-3, "friction_feedforward": 2.0}
KICKS["feedforward"] = 1.0


@pytest.mark.parametrize("key", KICKS)
def test_a_step_that_kicks_does_not_wait_for_the_integral(amber: Design, key: str) -> None:
    """Of half the threshold the integral alone takes Tn = 15 ms; each kick takes less than 1 ms."""
    design = quiet(with_values(amber, {f"control.position.{key}": KICKS[key]}))
    assert design.controller.position_loop.kicks
    rows = Rows.of(design)
    rows.step("command", 0.5 * 2.25e-3 / STIFFNESS)
    assert first_motion_s(rows.running()) < 1e-3
    result = friction_effects(replace(design, validation=replace(design.validation, loads_Nm=(0.0,))))
    assert result.points[0].threshold.waiting == ()
    words = json.dumps(section(result), default=str)
    assert "at once by its own kick" in words
    assert "Tn (A0/A" not in words


def test_friction_alone_is_asked_at_every_size_where_counts_hunt() -> None:
    """The joint hunts by its counts after a full step; without them that one rests, a small one does not."""
    design = load_design("joint")
    known = settlings_of(design, loads_Nm=(0.0,))
    assert [one.rest.verdict for one in known] == ["limit cycle"]
    found = limit_cycles(design, 0.0, (), settlings=known)
    sizes = sorted({SMALL, *design.validation.amplitude_fractions})
    full = design.validation.full_deflection_rad
    assert [one.amplitude_rad for one in found.settlings] == [full * x for x in sizes]
    assert found.settlings[-1].rest.comes_to_rest
    assert found.hunting == found.settlings[0]
