"""Dry friction at small signals: threshold, lost motion, standing error, limit cycles."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from actuator_lti import assemble_loops, load_design
from actuator_lti.design import model, with_values
from actuator_lti.design.loader import as_design
from analyses.friction_effects import friction_effects
from analyses.friction_effects.breakaway import static_threshold, threshold
from analyses.friction_effects.orbit import Orbit
from analyses.friction_effects.result import limit_cycles
from analyses.friction_effects.reversal import Hysteresis, _width, hysteresis
from analyses.large_signal.tones import linear_steady_state
from analyses.limit_cycles.stick_slip import _runs, stick_slip_cycle
from analyses.motion.settling import SMALL, settle, settlings_of
from nonlinear import Rows
from nonlinear.bench.operating_motion import quiet
from nonlinear.settling.rest import first_motion_s
from reports.sections.friction_effects import section
from tests.changed import changed
from tests.loops.loop_designs import MOTOR
from tests.loops.own_laws import as_law
from tests.nonlinear.elastic_drive import stribeck

AMBER, EMPS, JOINT = (load_design(name) for name in ("ilr33-amber", "emps", "joint"))
STIFFNESS = 5.9e-3 * 0.12 * 120.0 * 2376.0  # motor torque per error of the output of the first
FIN = 1.0 / 60.0 + 1.7e-3  # motor torque per torque on the fin: what passes, and 10 % of it lost
P_LOOPS = {"current": {"gain_V_A": 0.05, "integral_time_s": None}, "velocity": {"integral_time_s": None}}
KICKS = {
    "feedforward": 1.0, "acceleration_feedforward": 1.0, "derivative_time": 1e-3, "friction_feedforward": 2.0,
}  # fmt: skip


def extruder(position_s: float | None = None, velocity_s: float | None = None) -> model.Design:
    """A voltage drive whose friction is a map, with integral times of its loops."""
    loops = {
        "velocity": model.VelocityLoop(gain=0.25, integral_time_s=velocity_s),
        "position": model.PositionLoop(gain=25.0, integral_time_s=position_s),
    }
    return model.Design(
        name="map",
        motor=changed(MOTOR, resistance_ohm=2.0, inductance_H=3e-4),
        gears=(model.Gear(name="g", ratio=20.0),),
        load=model.Load(inertia_kgm2=0.002, path="self-locking"),
        friction=model.Friction(points=stribeck((0.0, 30e-3), (8.0, 36e-3), (300.0, 60e-3))),
        limits=model.Limits(voltage_V=36.0),
        controller=model.Controller(period_s=2e-4, computing_delay_s=1e-4, **loops),
        validation=model.Validation(full_deflection_rad=math.pi / 4.0, loads_Nm=(0.0,)),
    )


COGGING = {"motor.cogging": 1e-3, "motor.cogging_periods": 4.0, "motor.cogging_phase": math.pi / 6.0}
FORCE, SLOPE = 35.15065 * 243.45 * 160.18, 0.05 / 2.0 * 0.25 * 25.0 * 20.0  # of the force source and the map
PUSHING = {"path": "back-drivable", "moment_slope_Nm_rad": 0.9 * FORCE}  # nine tenths of the stiffness
PUSHED = changed(EMPS, load=PUSHING, limits=model.Limits(voltage_V=1e9))
THRESHOLDS: dict[str, tuple[model.Design, float, float, float, str]] = {
    # torque to overcome over stiffness, and the integral times of speed and position
    "a force source": (EMPS, (20.3935 - 3.1648) / FORCE, math.inf, math.inf, ""),
    "a speed integral": (AMBER, 2.25e-3 / STIFFNESS, 15e-3, math.inf, "speed"),
    "behind a spring": (load_design("ilr33-amber-compliant"), 2.25e-3 / STIFFNESS, 15e-3, math.inf, "speed"),
    # cogging of 1 mN m turns forward, half of it where the drive stands
    "cogging": (with_values(AMBER, COGGING), (2.25e-3 - 0.5e-3) / STIFFNESS, 15e-3, math.inf, "speed"),
    "a friction map": (extruder(), 30e-3 / SLOPE, math.inf, math.inf, ""),
    "a position integral": (extruder(0.4), 30e-3 / SLOPE, math.inf, 0.4, "position"),
    "one behind the other": (extruder(0.4, 0.08), 30e-3 / SLOPE, 0.08, 0.4, "speed"),
}


@pytest.mark.parametrize("name", THRESHOLDS)
def test_a_small_step_waits_until_the_integrals_overcome_friction(name: str) -> None:
    """A constant error A of the threshold A0: the torque grows as 1 + t/T + t/U + t^2/(2 T U) up to A0/A."""
    design, unloaded_rad, T, U, integrator = THRESHOLDS[name]
    found, rate, bend = friction_effects(design), 1.0 / T + 1.0 / U, 0.5 / T / U
    assert found.integrator == integrator
    assert ("No controller integrates" in section(found)["result"]) == (not integrator)
    for point in found.points:
        result = point.threshold
        forward_rad = unloaded_rad + (point.dry_torque_Nm - found.points[0].dry_torque_Nm) / STIFFNESS
        assert result.static.forward_rad == pytest.approx(forward_rad, rel=1e-12)
        assert integrator or result.simulated_rad == pytest.approx(forward_rad, rel=1.1 * result.resolution)
        assert len(result.waiting) == (5 if integrator else 0)
        for wait in result.waiting:
            more = forward_rad / wait.amplitude_rad - 1.0
            expected = (math.sqrt(rate**2 + 4.0 * bend * more) - rate) / (2.0 * bend) if bend else more / rate
            assert wait.predicted_s == pytest.approx(expected, rel=1e-9)
            assert wait.simulated_s == pytest.approx(expected, rel=1e-2 if bend else 0.0, abs=6e-4)


def _joint_rate(loop: Hysteresis) -> float:
    """0.6 s of integral time behind 15 % of the torque of gravity, which grows at that rate."""
    rate = 4.0 * loop.amplitude_rad * loop.frequency_hz
    return 2.0 * 0.6 / 14.4 * 1.5e-3 * 6.0 * 9.80665 * 0.3 * rate


@pytest.mark.parametrize(("name", "load_Nm", "expected", "within"), [
    ("ilr33-amber", 0.0, lambda loop: 0.0, 0.0),
    ("emps", 0.0, lambda loop: 2.0 * 20.3935 / FORCE, 1e-9),
    (PUSHED, 0.0, lambda loop: 20.0 * 20.3935 / FORCE, 1e-6),
    ("ilr33-amber-compliant", 0.0, lambda loop: 2.0 * 0.05 / 1500.0 + 1e-3, 1e-9),  # at rest in the play
    ("ilr33-amber-compliant", 8.0, lambda loop: 2.0 * 0.05 / 1500.0, 1e-9),  # which the load takes out
    ("ballscrew", 0.0, lambda loop: 2.0 * 30.0 / 1e8, 1e-9),
    ("joint", 0.0, _joint_rate, 1e-4),
    # (T0 + C0_l f)/(gain + 30 f), f the motor's torque per torque on the fin, which the moment relieves
    ("fin", 0.0, lambda loop: 2.0 * (0.008 + 0.05 * FIN) / (60 * 0.03 * 0.12 * 110 + 30 * FIN), 2e-3),
])  # fmt: skip
def test_what_a_reversal_loses_is_predicted(name, load_Nm, expected, within):
    """Behind a motor's sensor 2 C0_l/k and the play; in front of it the error that friction asks for."""
    design = quiet(as_design(name))
    static = threshold(design, load_Nm).static
    loop = hysteresis(design, load_Nm, static, 150_000 if name == "joint" else 3000)
    rounding = 1e-12 * loop.amplitude_rad
    assert loop.predicted_rad == pytest.approx(expected(loop), rel=1e-6 + within, abs=rounding)
    assert loop.lost_motion_rad == pytest.approx(loop.predicted_rad, rel=within, abs=rounding)


def test_a_drive_that_is_not_stable_without_friction_has_nothing_to_compare_with():
    """A heavy load on an output sensor, damped by friction by load; a swing of 38 deg was said to be lost."""
    design = load_design("ilr33-amber-compliant")
    heavy = {"load.inertia": 300.0 * design.load.inertia_kgm2, "control.position.gain": 60.0}
    rough = {
        "coupling.stiffness": 3000.0,
        "friction.load_coefficient": 100.0 * design.friction.load_coefficient,
    }
    design = with_values(design, {**heavy, **rough}, check=False)
    position = replace(design.controller.position, sensor="output")
    found = friction_effects(replace(design, controller=replace(design.controller, position=position)))
    assert any(point.threshold for point in found.points)
    assert all(point.hysteresis is None for point in found.points)
    (table,) = (
        block for block in section(found)["blocks"] if block.get("caption", "").startswith("Threshold")
    )
    assert "as that is not stable" in table["note"]


@pytest.mark.parametrize(("design", "T", "U"), [
    *((with_values(AMBER, {"control.velocity.integral_time": T}), T, math.inf) for T in (0.5, 4.0, 1e3)),
    *((extruder(U, T), T, U) for T, U in ((10.0, 100.0), (10.0, 0.4))),
    (with_values(JOINT, {"control.position.integral_time": 30.0}), math.inf, 30.0),
])  # fmt: skip
def test_what_a_slow_integral_leaves_of_a_reversal(design: model.Design, T: float, U: float) -> None:
    """Of one or two, however slow beside the triangle; the loop's own lag moves the passage by about 1/Kv."""
    static, slow = threshold(design := quiet(design), 0.0).static, assemble_loops(design)
    loop = hysteresis(design, 0.0, static, linear_steady_state(slow, np.array([1.0])).settling_ticks)
    within = 3.0 / design.controller.position.gain / min(T, U)
    assert loop.lost_motion_rad == pytest.approx(loop.predicted_rad, rel=within)


@pytest.mark.parametrize("T", [1.0, 10.0, 100.0, 1e4])
def test_an_orbit_of_short_stands_has_a_closed_form(T: float) -> None:
    """e + z/T = F + g t turns over at once: F/cosh(P/4T) + g T (1 - 1/cosh(P/4T))."""
    F, g, P = 2.0, 3e-3, 40.0
    fast = Orbit(F, F, g, 1e8, 0.5 * P, np.array([1.0 / T, 0.0]))
    left = 1.0 / math.cosh(0.25 * P / T)
    assert fast.at_zero_rad == pytest.approx(F * left + g * T * (1.0 - left), rel=1e-6)
    alone = replace(fast, gains=np.zeros(2), rate_rad_s=1.0, breakaway_rad=2.5, growth_rad_s=0.0)
    assert alone._stand_s() == pytest.approx(F + 2.5, rel=1e-12)
    assert alone.at_zero_rad == pytest.approx(F, rel=1e-12)
    assert replace(alone, rate_rad_s=0.1).at_zero_rad == 0.0  # the command turns before it breaks away


def test_a_width_is_that_of_the_periodic_state() -> None:
    passing = np.array([(-1.0) ** k * 0.35 + 0.2 * 0.8**k for k in range(3)])
    assert _width(passing) == pytest.approx(0.7, rel=1e-12)
    assert _width(np.array([1.5, 0.5, 1.5])) == 1.0  # about a middle


def test_the_error_that_stays_of_a_force_source_is_less_than_its_threshold() -> None:
    """And the largest one is what the section says, though a smaller step leaves a larger share of itself."""
    static, result = static_threshold(EMPS), friction_effects(EMPS)
    errors = [abs(one.rest.error) for one in result.points[0].cycles.settlings]
    assert {one.rest.verdict for one in result.points[0].cycles.settlings} == {"at rest"}
    assert all(0.0 < error <= max(static.forward_rad, static.backward_rad) for error in errors)
    assert f"an error of up to {1e6 * max(errors):.3g} µm is left" in section(result)["result"]


def test_the_threshold_is_that_of_breakaway_and_none_of_a_drive_too_weak_to_move() -> None:
    higher = with_values(AMBER, {"friction.breakaway_ratio": 1.5})
    assert static_threshold(higher).forward_rad == pytest.approx(1.5 * static_threshold(AMBER).forward_rad)
    assert static_threshold(EMPS).backward_rad == pytest.approx((20.3935 + 3.1648) / FORCE, rel=1e-12)
    weak = changed(AMBER, limits={"peak_current_A": 0.3})
    assert static_threshold(weak).forward_rad == math.inf
    assert friction_effects(weak).points[0].threshold is None


def test_the_integral_takes_lost_motion_and_error_away() -> None:
    for point in friction_effects(AMBER).points:
        loop = point.hysteresis
        assert abs(loop.lost_motion_rad) < 1e-9 * loop.amplitude_rad
        assert loop.largest_rad > 0.5 * static_threshold(AMBER, point.load_Nm).forward_rad
        for one in point.cycles.settlings:
            assert abs(one.rest.error) < 1e-6 * one.amplitude_rad


@pytest.mark.parametrize(("breakaway", "hunts"), [(1.0, False), (1.5, True)])
def test_hunting_needs_breakaway_above_sliding_friction(breakaway: float, hunts: bool) -> None:
    """Fast integral, high Kv: a describing function foresees no cycle; breakaway above sliding makes one."""
    values = {"friction.breakaway_ratio": breakaway, "control.velocity.integral_time": 3e-3}
    design = with_values(AMBER, {**values, "control.position.gain": 250.0})
    cycles = limit_cycles(design, 0.0)
    assert cycles.cycles == ()
    assert (cycles.hunting is not None) == hunts
    assert cycles.described == (not hunts)
    if cycles.hunting is not None:
        assert not cycles.hunting.rest.limited
        # the same from any start: it is a cycle, not a slow decay
        again = settle(design, 0.0, 3.0 * static_threshold(design).forward_rad)
        assert again.swing_rad == pytest.approx(cycles.hunting.swing_rad, rel=0.01)


@pytest.mark.parametrize("load", [0.0, 8.0])
def test_friction_keeps_an_unstable_loop_quiet_up_to_the_predicted_amplitude(load: float) -> None:
    """Speed gain beyond its margin: small motion dies out, large grows; border to 15 %, frequency to 8 %."""
    (item,) = limit_cycles(with_values(AMBER, {"control.velocity.gain": 3.0}), load).cycles
    assert not item.cycle.stable
    assert item.verdict == "confirmed"
    assert item.ratio == pytest.approx(1.0, rel=0.15)
    assert item.frequency_hz == pytest.approx(item.cycle.frequency_hz, rel=0.08)


STICKY = changed(AMBER, friction={"breakaway_ratio": 1.5})
OF_POSITION = changed(STICKY, controller={"velocity": {"integral_time_s": None},
                                          "position": {"integral_time_s": 0.05}})  # fmt: skip
LOW_PASS = model.Filter(on="torque", kind="lowpass", frequency_rad_s=2000.0)
TRACKING = model.Encoder(speed="tracking", bandwidth_rad_s=800.0)
HUNTING = {
    f"Tn {t}, Kv {k}": with_values(STICKY, {"control.velocity.integral_time": t, "control.position.gain": k})
    for t in (15e-3, 3e-3) for k in (60.0, 120.0, 250.0)
} | {
    "slower stages": changed(load_design("ilr33-amber-multirate"), friction={"breakaway_ratio": 1.5}),
    "torque filter": changed(STICKY, controller={"velocity": {"filters": (LOW_PASS,)}}),
    "tracking": changed(STICKY, encoder=TRACKING),
    "law": as_law(STICKY, "velocity"),
    "position integral": OF_POSITION,
    "law of the position": as_law(OF_POSITION, "position"),
    "driven by its load": changed(STICKY, load={"path": "back-drivable"}, friction={"load_coefficient": 0.0},
                                  validation={"loads_Nm": (50.0,)}),
    "offset": changed(STICKY, friction={"offset_torque_Nm": 1e-3}),
}  # fmt: skip


@pytest.mark.parametrize("name", HUNTING)
def test_stick_slip_is_predicted(name: str) -> None:
    """Breakaway 1.5, whatever winds up, by up to 6e-3 in a tick; also where larger steps slide to rest."""
    design = quiet(HUNTING[name])
    cycles = friction_effects(design).points[-1].cycles
    assert cycles.stick_slip.stable
    assert cycles.as_predicted
    swing = cycles.hunting
    assert swing.swing_rad == pytest.approx(cycles.stick_slip.output_amplitude_rad, rel=3e-3)
    assert swing.rest.frequency_hz == pytest.approx(cycles.stick_slip.frequency_hz, rel=3e-3)


def test_a_slip_of_a_multirate_drive_is_the_one_of_its_ticks() -> None:
    """A map of so many periods holds from their first tick on, not from another."""
    system, torques = assemble_loops("ilr33-amber-multirate").tick_system, np.array([-2e-3, 0.0])
    x = np.random.default_rng(1).standard_normal((2, len(system.states)))
    for k, seen in enumerate(_runs(system, x, torques, 7 * system.ticks).swapaxes(0, 1)):
        assert seen == pytest.approx(x, rel=1e-9, abs=1e-9 * np.abs(x).max())
        A, B, _, _ = system.matrices(k % system.ticks)
        x = x @ A.T + np.outer(torques, B[:, 1])


def test_stick_slip_needs_breakaway_above_friction_and_an_integral() -> None:
    for point in friction_effects(AMBER).points:
        assert point.cycles.stick_slip is None
        assert point.cycles.as_predicted
    emps = with_values(EMPS, {"friction.breakaway_ratio": 2.0})
    assert friction_effects(emps).points[0].cycles.stick_slip is None
    unseen = ([[1.0, 0.0], [0.0, 0.5]], [[1.0], [1.0]], [[0.0, 1.0]], [[1.0]], 1e-4)  # drives nothing
    assert stick_slip_cycle(STICKY.with_law("velocity", unseen, ["error"]), 0.0) is None


def test_a_p_current_loop_gives_a_part_of_its_command_and_overshoots_it() -> None:
    """i ends at Kp/(Kp + R) of the command, after Kp/R (1 - exp(-2 R T/L)): it is seen two ticks later."""
    slow = changed(AMBER, controller={"current": P_LOOPS["current"]})
    sticky = quiet(
        changed(slow, controller={"velocity": {"integral_time_s": 0.05}}, friction={"breakaway_ratio": 1.6})
    )
    cycle = stick_slip_cycle(sticky, 5.0)
    swing = settle(sticky, 5.0, cycle.output_amplitude_rad)
    assert swing.rest.frequency_hz == pytest.approx(cycle.frequency_hz, rel=2e-3)
    assert swing.swing_rad == pytest.approx(cycle.output_amplitude_rad, rel=2e-3)
    stiff = quiet(changed(AMBER, controller=P_LOOPS))
    R, L, T = 0.055, 6e-6, stiff.controller.period_s
    first = 0.05 / R * -math.expm1(-2.0 * R * T / L)
    result = threshold(stiff, 5.0)
    assert result.static.forward_rad == pytest.approx(8.95e-3 / STIFFNESS * (0.05 + R) / 0.05)
    assert result.simulated_rad == pytest.approx(8.95e-3 / STIFFNESS / first, rel=2.0 * result.resolution)


@pytest.mark.parametrize("design", [EMPS, changed(AMBER, controller=P_LOOPS)])
def test_a_feed_forward_of_friction_takes_its_part_of_what_a_reversal_loses(design: model.Design) -> None:
    """Found, against the drive without either, as predicted: of a P current loop the part that it gives."""
    fed = changed(design, controller={"position": {"friction_feedforward": 0.3}})
    for point, plain in zip(friction_effects(fed).points, friction_effects(design).points, strict=True):
        lost, without = point.hysteresis, plain.hysteresis
        assert lost.lost_motion_rad == pytest.approx(lost.predicted_rad, rel=1e-6)
        assert lost.predicted_rad < 0.95 * without.predicted_rad
        assert lost.linear_width_rad == pytest.approx(without.linear_width_rad, rel=1e-9)


def test_a_smoothed_law_is_not_said_to_have_a_threshold() -> None:
    result = friction_effects(load_design("ilr33-amber-tanh"))
    (threshold,) = [b for b in section(result)["blocks"] if b.get("caption", "").startswith("Threshold")]
    assert all(row["threshold"] is None and row["width"] is None for row in threshold["rows"])
    assert "no threshold" in threshold["note"]
    assert "below the threshold" not in threshold["note"]


def test_not_applicable_without_dry_friction() -> None:
    result = friction_effects(load_design("ctms-motor-position"))
    assert result.points == ()
    assert "no dry friction" in result.reason


@pytest.mark.parametrize("kick", KICKS)
def test_a_step_that_kicks_does_not_wait_for_the_integral(kick: str) -> None:
    """Of half the threshold the integral alone takes Tn = 15 ms; each kick takes less than 1 ms."""
    design = quiet(with_values(AMBER, {f"control.position.{kick}": KICKS[kick]}))
    assert design.controller.position_loop.kicks
    rows = Rows.of(design)
    rows.step("command", 0.5 * 2.25e-3 / STIFFNESS)
    assert first_motion_s(rows.running()) < 1e-3
    result = friction_effects(changed(design, validation={"loads_Nm": (0.0,)}))
    assert result.points[0].threshold.waiting == ()
    words = json.dumps(section(result), default=str)
    assert "at once by its own kick" in words
    assert "Tn (A0/A" not in words


def test_friction_alone_is_asked_at_every_size_where_counts_hunt() -> None:
    """The joint hunts by its counts after a full step; without them that one rests, a small one does not."""
    known, asked = settlings_of(JOINT, loads_Nm=(0.0,)), JOINT.validation
    assert [one.rest.verdict for one in known] == ["limit cycle"]
    found = limit_cycles(JOINT, 0.0, (), settlings=known)
    sizes, full = sorted({SMALL, *asked.amplitude_fractions}), asked.full_deflection_rad
    assert [one.amplitude_rad for one in found.settlings] == [full * x for x in sizes]
    assert found.settlings[-1].rest.comes_to_rest
    assert found.hunting == found.settlings[0]
