"""What a drive can do, and where its limits begin: closed forms, the simulator, many against one."""

from collections.abc import Callable
from dataclasses import replace
from math import inf

import numpy as np
import pytest
from loop_designs import amber, controlled, ctms_position, drive_d, drive_e, emps, source_drive, without
from test_stacked import DRIVES, scattered

from actuator_lti import assemble_loops, load_design, onset
from actuator_lti.design import model
from actuator_lti.design.access import stacked
from actuator_lti.design.model import Design, Limits
from actuator_lti.drive.facts import RATE_LIMITS, Capability, breakaway_torque_Nm, capability, stall_torque_Nm
from actuator_lti.drive.steady import torque_gain_Nm_rad
from analyses.linear.loop_figures import all_loop_figures
from analyses.specification.capability import drive_figures
from nonlinear import commands, simulate
from tests.changed import changed
from tests.nonlinear.elastic_drive import stribeck
from tests.refusals import refused


@pytest.mark.parametrize(("load", "starts"), [(-20.0, True), (-29.0, True), (-31.0, False)])
def test_j10_the_breakaway_ratio_acts_on_the_dry_part_only(load: float, starts: bool) -> None:
    """An ideal source of 40 N m on 2 kg m2 against 2 x 5 + load: starts up to 30 N m, held by 5 + load."""
    parts = {"load": {"path": "back-drivable", "moment_max_Nm": 30.0}}
    parts |= {"friction": model.Friction(dry_torque_Nm=5.0, breakaway_ratio=2.0)}
    stages = {"position": model.PositionLoop(gain=1e6)}
    design = source_drive(2.0, 4.0, 1e-4, 10.0, controller=stages, **parts)
    expected = (40.0 - 5.0 - abs(load)) / 2.0 if starts else 0.0
    assert drive_figures(design, load).acceleration_rad_s2 == pytest.approx(expected)
    run = simulate(design, commands.step(1.0), duration_s=0.02, load_Nm=load)
    travelled = run.output_angle_rad[-1]
    assert travelled == pytest.approx(0.5 * expected * run.time_s[-1] ** 2, rel=1e-6, abs=1e-12)


BEHIND = model.LoadFriction(dry_torque_Nm=3.0, viscous_Nms_rad=0.2, breakaway_ratio=1.5)
RUBBING = changed(
    drive_d(), load={"friction": BEHIND},
    friction={"dry_torque_Nm": 0.01, "viscous_Nms_rad": 1e-5, "breakaway_ratio": 1.2},
)  # fmt: skip
POINTS = stribeck((0.0, 0.05), (100.0, 0.02), (900.0, 0.1))
MAPPED = replace(drive_e(), friction=model.Friction(points=POINTS), coupling=None, load=model.Load())
BARE = changed(amber(), limits={"speed_rad_s": 1e5, "acceleration_rad_s2": inf, "peak_current_A": 1e3})
N, C0, CM, CV = 2376.0, 2.25e-3, 1.34e-3, 5.25e-6  # of `amber`, whose resistance is 55 mohm


def damped(path: str) -> Design:
    return changed(BARE, load={"path": path, "moment_damping_Nms_rad": 20.0})


AT_THE_BUS = {  # drive and load; resistance of the circuit, and what the motor needs at a speed, by hand
    "the second piece of a map": (MAPPED, 0.0, 0.5, lambda w: 0.02 + 1e-4 * (w - 100.0)),
    "friction on both sides": (RUBBING, 0.0, 0.5, lambda w: 0.01 + 3.0 / 10 + (1e-5 + 0.2 / 100) * w),
    "a supply that sags": (
        replace(BARE, supply=model.Supply(resistance_ohm=0.04)), 4.0, 0.095, lambda w: C0 + CM * 4.0 + CV * w
    ),
    "a damped load": (
        damped("back-drivable"), 0.0, 0.055, lambda w: C0 + (CV + (1.0 / N + CM) * 20.0 / N) * w
    ),
    "a damped load that is held": (
        damped("self-locking"), 0.0, 0.055, lambda w: C0 + (CV + CM * 20.0 / N) * w
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", AT_THE_BUS)
def test_the_top_speed_is_where_the_bus_ends(name: str) -> None:
    """U = R i + kE w with the current that friction and load need; and where a run ends up."""
    design, load, ohm, needed = AT_THE_BUS[name]
    motor, capacity = design.effective_motor, capability(design, load)
    w = capacity.output_rate_rad_s * design.total_ratio
    i = needed(w) / motor.torque_constant_Nm_A
    bus = design.limits.voltage_V
    assert ohm * i + motor.back_emf_constant_Vs_rad * w == pytest.approx(bus, rel=1e-12)
    assert capacity.motor_current_A == pytest.approx(i, rel=1e-12)
    assert RATE_LIMITS[int(capacity.rate_limit)] == "voltage"
    assert stall_torque_Nm(design) == pytest.approx(motor.torque_constant_Nm_A * bus / ohm)
    ran = simulate(design, commands.step(1e3), 0.5, -load)
    assert ran.motor_speed_rad_s[-1] == pytest.approx(w, rel=1e-6)


def test_each_dry_part_is_held_by_its_own_ratio() -> None:
    assert breakaway_torque_Nm(RUBBING, 0.0, 1) == pytest.approx(1.2 * 0.01 + 1.5 * 3.0 / 10)


def test_the_torque_that_speeds_up_the_load_brings_friction_too() -> None:
    """J_m dw/dt = T - T0 - (1/N_c + CM') T_s with T_s = J_l dW/dt + C0_l + M, by hand and simulated."""
    behind, load = model.LoadFriction(dry_torque_Nm=0.3), model.Load(inertia_kgm2=2e-3, path="back-drivable")
    design = replace(
        drive_e(),
        motor=model.Motor(rotor_inertia_kgm2=2e-5, source_gain_Nm_V=0.01),
        controller=model.Controller(
            period_s=1e-4, position=model.PositionLoop(gain=1e6), computing_delay_s=0.0
        ),
        friction=model.Friction(dry_torque_Nm=0.01, load_coefficient=0.02, law="coulomb"),
        load=replace(load, friction=behind),
        coupling=model.Coupling(stiffness_Nm_rad=400.0, damping_Nms_rad=1.0),
    )
    by_hand = (0.48 - 0.01 - 0.12 * (0.3 + 0.5)) / (2e-5 + 0.12 * 2e-3 / 10) / 10
    assert drive_figures(design, 0.5).acceleration_rad_s2 == pytest.approx(by_hand, rel=1e-12)
    run = simulate(design, commands.step(1e3), duration_s=0.08, load_Nm=-0.5)
    speed, half = run.motor_speed_rad_s / 10, len(run.time_s) // 2
    assert (speed[-1] - speed[half]) / (run.time_s[-1] - run.time_s[half]) == pytest.approx(by_hand, rel=1e-6)
    rigid = replace(design, coupling=None)  # rubs with the load's torque alone (equation 9)
    by_hand = (0.48 - 0.01 - 0.12 * 0.5) / 4e-5 / 10
    assert drive_figures(rigid, 0.5).acceleration_rad_s2 == pytest.approx(by_hand, rel=1e-12)


def test_gravity_at_angle_zero_is_part_of_the_load() -> None:
    """A level arm of 5 N m beside the stated load, whose sign counts; the gear's error averages in motion."""
    bare = changed(amber(), load={"path": "back-drivable"})
    arm = model.Gravity(mass_kg=5.0 / 9.80665, arm_m=1.0, offset_rad=np.pi / 2)
    design = changed(bare, load={"gravity": arm})
    friction, N, kM = design.friction, design.total_ratio, design.motor.torque_constant_Nm_A
    carried = friction.dry_torque_Nm + (friction.load_coefficient + 1.0 / N) * 8.0
    by_hand = carried + friction.viscous() * design.limits.speed_rad_s
    assert capability(design, 3.0).motor_current_A == pytest.approx(by_hand / kM, rel=1e-12)
    by_hand = (stall_torque_Nm(design) - carried) / design.inertia_kgm2 / N
    free = changed(design, limits={"acceleration_rad_s2": np.inf})
    assert drive_figures(free, 3.0).acceleration_rad_s2 == pytest.approx(by_hand, rel=1e-12)
    assert capability(design, -5.0).motor_current_A == pytest.approx(capability(bare).motor_current_A)
    wavy = changed(bare, load={"gear_error_Nm": 5.0, "gear_error_periods": 2, "gear_error_phase_rad": 1.0})
    assert capability(wavy).motor_current_A == capability(bare).motor_current_A


def test_torque_gain_with_a_p_current_loop_and_resistance_feedforward() -> None:
    """Rotor at rest: u = Kp (i_ref - i) + k R i_ref = R i, so i = (Kp + k R)/(Kp + R) i_ref."""
    design = controlled(drive_e(), current={"integral_time_s": None, "resistance_feedforward": 0.6})
    share = (0.8 + 0.3) / (0.8 + 0.5)
    assert torque_gain_Nm_rad(design) == pytest.approx(20.0 * 10 * 0.05 * 0.05 * share)
    notes = all_loop_figures(assemble_loops(design))["current"].notes
    assert any(f"resistance_feedforward a constant command gives {share:.4g} of it" in note for note in notes)


@pytest.mark.parametrize("name", DRIVES)
@pytest.mark.parametrize("load", [0.0, 3.0])
def test_many_drives_are_each_of_them_alone(name: str, load: float) -> None:
    design = DRIVES[name]
    values = scattered(design, 6)
    many = capability(stacked(design, values), load)
    for k in range(6):
        alone = capability(stacked(design, {path: float(v[k]) for path, v in values.items()}), load)
        for attribute in Capability.__dataclass_fields__:
            mine = np.broadcast_to(getattr(many, attribute), 6)[k]
            assert mine == pytest.approx(getattr(alone, attribute), rel=1e-12, nan_ok=True), attribute


@pytest.mark.parametrize(("inner", "key", "limit", "name"), [
    ("velocity", "acceleration_rad_s2", 3000.0, "acceleration"), ("velocity", "speed_rad_s", 90.0, "speed"),
    ("current", "current_rate_A_s", 500.0, "current-rate"), ("current", "peak_current_A", 3.0, "current"),
])  # fmt: skip
def test_a_drive_without_a_position_loop_is_linear_up_to_the_limits_of_its_command(
    inner: str, key: str, limit: float, name: str
) -> None:
    """A limit L of the command, or L T/(2 sin(w T/2)) of its change; a hair above it the simulator's acts."""
    loops = {"position": None} | ({"velocity": None} if inner == "current" else {})
    design = changed(load_design("ilr33-amber"), controller=loops, limits={key: limit}, requirements=())
    hz, Ts = 40.0, design.controller.period_s
    N = design.total_ratio if inner == "velocity" else 1.0
    level = limit / N if name in ("speed", "current") else limit / N * Ts / (2.0 * np.sin(np.pi * hz * Ts))
    border = onset(assemble_loops(design), [2.0 * np.pi * hz])
    assert border.each_rad[name][0] == pytest.approx(level, rel=1e-12)
    for share in (0.999, 1.001):
        run = simulate(design, commands.sine(share * level, hz), 0.2)
        assert (run.limits[name].fraction > 0.0) == (share > 1.0)


@pytest.mark.parametrize("stages", [(), ("position",)])
def test_the_speed_command_is_clamped_whoever_gives_it(stages: tuple[str, ...]) -> None:
    """By hand, and where the simulator ends up, a speed drive too; without a velocity loop nothing does."""
    design, load = without(amber(), *stages, gain=0.2), 4.0
    capacity, w, friction = capability(design, load), design.limits.speed_rad_s, design.friction
    torque = friction.dry_torque_Nm + friction.load_coefficient * load + friction.viscous() * w
    assert RATE_LIMITS[int(capacity.rate_limit)] == "speed limit"
    assert capacity.output_rate_rad_s == pytest.approx(w / design.total_ratio, rel=1e-12)
    assert capacity.motor_current_A == pytest.approx(torque / design.motor.torque_constant_Nm_A, rel=1e-12)
    ran = simulate(design, commands.ramp(9.0) if not stages else commands.step(9.0), 0.5, -load)
    assert ran.motor_speed_rad_s[-1] == pytest.approx(w, rel=1e-6)
    assert drive_figures(without(amber(), "velocity", gain=1.0)).rate_limit == "voltage"


def fin_needs(load_Nm: float) -> Callable[[float], float]:
    """Motor torque over its speed, of the fin's friction, bearing and load."""
    felt = 1.7e-3 + 1.0 / 60.0
    return lambda w: 8e-3 + felt * (load_Nm + 0.05) + (1e-5 + felt * 0.02 / 60.0) * w


FIN, GAIN = load_design("fin"), 0.02
PLAIN = controlled(amber(), velocity={"integral_time_s": None}, current={"integral_time_s": None})
FREE = changed(PLAIN, limits={"peak_current_A": 1e3})
DROOPING = {  # drive and load; what it pulls with per speed that is missing, resistance, need
    "a voltage drive": (FIN, 0.0, 0.12, 1.0, fin_needs(0.0)),
    "under load": (FIN, 8.0, 0.12, 1.0, fin_needs(8.0)),
    "P of speed and current": (FREE, 0.0, 0.12 * GAIN, 0.055 + GAIN, lambda w: C0 + CV * w),
}


@pytest.mark.parametrize("name", DROOPING)
def test_a_p_velocity_loop_stays_below_its_limit_by_its_droop(name: str) -> None:
    """kM (Kp (w_lim - w) - kE w)/R against what friction and load need; and where a run ends up."""
    design, load, pull, ohm, needed = DROOPING[name]
    motor, limit, figures = design.effective_motor, design.limits.speed_rad_s, drive_figures(design, load)
    w = figures.output_rate_rad_s * design.total_ratio
    volts = pull * (limit - w) - motor.back_emf_constant_Vs_rad * w
    assert motor.torque_constant_Nm_A * volts / ohm == pytest.approx(needed(w), rel=1e-11)
    assert figures.rate_limit == "speed limit less droop of the P velocity loop"
    level = replace(design, load=design.load.level())
    ran = simulate(level, commands.ramp(20.0), 1.0, -load)
    assert ran.motor_speed_rad_s[-1] == pytest.approx(w, rel=1e-6)


def test_a_p_current_loop_gives_less_than_the_peak_that_is_asked_of_it() -> None:
    """kM (K i_peak - kE w)/(R + K), the command at its limit, against friction; and where a run ends up."""
    motor, figures, peak = PLAIN.motor, drive_figures(PLAIN), PLAIN.limits.peak_current_A
    w = figures.output_rate_rad_s * PLAIN.total_ratio
    volts = GAIN * peak - motor.back_emf_constant_Vs_rad * w
    assert motor.torque_constant_Nm_A * volts / (0.055 + GAIN) == pytest.approx(C0 + CV * w, rel=1e-11)
    stall = motor.torque_constant_Nm_A * GAIN * peak / (0.055 + GAIN)
    assert stall_torque_Nm(PLAIN) == pytest.approx(stall, rel=1e-12)
    assert figures.rate_limit == "force"
    ran = simulate(PLAIN, commands.ramp(20.0), 2.0)
    assert ran.motor_speed_rad_s[-1] == pytest.approx(w, rel=1e-6)


def test_an_integral_or_a_drive_without_friction_leaves_no_droop() -> None:
    """Kp (w_lim - w) is nothing where nothing holds the motor back: a current integral feeds the back-EMF."""
    free = controlled(amber(friction=model.Friction()), velocity={"integral_time_s": None})
    assert drive_figures(free) == drive_figures(replace(free, controller=amber().controller))
    held = replace(free, friction=model.Friction(dry_torque_Nm=0.01))
    below = held.limits.speed_rad_s - 0.01 / held.motor.torque_constant_Nm_A / held.controller.velocity.gain
    assert capability(held).output_rate_rad_s * held.total_ratio == pytest.approx(below, rel=1e-12)


def test_speed_clamp_of_a_p_position_loop_with_ideal_inner_loops() -> None:
    """Onset at A = R sqrt(1 + (w/Kv)^2)/w, R the rate limit at the output (model.md section 5)."""
    # inner loops so fast that they count as ideal
    motor = replace(amber().motor, inductance_H=1e-12, back_emf_constant_Vs_rad=1e-9)
    fast = controlled(amber(motor=motor), velocity={"gain": 1e4}, current={"gain_V_A": 1e6})
    omega, R = np.array([10.0, 120.0, 500.0]), 942.5 / 2376
    found = assemble_loops(fast, "ideal").limiters["speed"].onset_amplitude_rad(omega)
    np.testing.assert_allclose(found, R * np.sqrt(1 + (omega / 120) ** 2) / omega, rtol=2e-5)


def test_the_active_limiter_and_its_bias() -> None:
    loops, omega = assemble_loops(amber()), np.array([6.0, 60.0, 600.0])
    border = onset(loops, omega)
    assert border.active == ("speed", "current", "current")
    np.testing.assert_array_equal(border.amplitude_rad, np.min(list(border.each_rad.values()), axis=0))
    half = onset(loops, omega, bias={"speed": -942.5 / 2})
    assert half.amplitude_rad[0] == pytest.approx(border.amplitude_rad[0] / 2)
    assert onset(loops, omega, bias={"speed": 2000.0}).amplitude_rad[0] == 0
    for none in ("2 rad/s", float("nan"), None):
        refused(onset, loops, omega, bias={"speed": none}, words=("bias['speed'] = ", "finite number"))


def test_the_command_of_a_speed_drive_is_that_of_the_output() -> None:
    """At low frequency the voltage is what a steady speed takes: N (k_E + R C_v/k_M) of it, in every form."""
    design = controlled(amber(), position=None)
    motor, viscous = design.effective_motor, design.friction.viscous_Nms_rad
    a_speed = motor.back_emf_constant_Vs_rad + motor.resistance_ohm * viscous / motor.torque_constant_Nm_A
    wanted = design.limits.voltage_V / (design.total_ratio * a_speed)
    for form in ("sampled", "continuous", "ideal"):
        border = onset(assemble_loops(design, form), [1e-3])
        assert border.each_rad["voltage"] == pytest.approx(wanted, rel=1e-6)


def test_limiters_follow_the_stages() -> None:
    assert list(assemble_loops(amber()).limiters) == ["speed", "acceleration", "current", "voltage"]
    assert list(assemble_loops(emps()).limiters) == ["speed", "acceleration", "voltage"]
    assert list(assemble_loops(ctms_position(), "continuous").limiters) == ["voltage"]
    assert assemble_loops(emps()).limiters["acceleration"].unit == "m/s^2"
    free = replace(ctms_position(), limits=Limits(voltage_V=inf))
    nothing = onset(assemble_loops(free), [1.0])
    assert nothing.active == ("",)
    assert nothing.amplitude_rad[0] == inf
    refused(
        load_design("ilr33-amber").with_values, {"limits.current_rate": "0 A/s"}, words="limits.current_rate"
    )


def test_results_end_at_nyquist() -> None:
    path = assemble_loops(amber(2, 10)).limiters["current"]
    assert path.responses([100.0]).shape == (5, 1)
    refused(path.response, [3200.0], words="Nyquist")
    refused(path.response, [0.0], words="positive")


def test_three_forms_agree_at_low_frequency() -> None:
    omega, design = np.array([1.0, 10.0]), amber(feedforward=0.5)
    reference = assemble_loops(design, "ideal").limiters
    for form in ("sampled", "continuous"):
        for name, path in assemble_loops(design, form).limiters.items():
            np.testing.assert_allclose(path.response(omega), reference[name].response(omega), rtol=2e-2)


def test_a_torque_drive_ramps() -> None:
    """A step of 5 A at 2 A/ms and Ts = 0.1 ms: 0.2 A a tick, 25 ticks, of which the last needs no limit."""
    torque_drive = controlled(load_design("ilr33-amber"), position=None, velocity=None)
    design = replace(torque_drive, limits=Limits(voltage_V=1e6, current_rate_A_s=2000.0))
    step_A = 2000.0 * design.controller.period_s
    run = simulate(design, commands.step(5.0), 40 * design.controller.period_s)
    expected = np.minimum(5.0, step_A * np.arange(1, run.time_s.size + 1))
    assert np.allclose(run.current_command_A, expected, rtol=0, atol=1e-12)
    acting = run.limit_active("current-rate")
    assert acting[:24].all()
    assert not acting[26:].any()
    assert (run.limits["current-rate"].limit, run.limits["current-rate"].unit) == (2000.0, "A/s")
    free = simulate(replace(design, limits=Limits(voltage_V=1e6)), commands.step(1.0), 0.01)
    assert "current-rate" not in free.limits
