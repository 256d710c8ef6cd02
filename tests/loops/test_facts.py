"""What a drive can do, and where its limits begin: closed forms, the simulator, many against one."""

from dataclasses import replace
from math import inf

import numpy as np
import pytest
from loop_designs import amber, controlled, ctms_position, drive_d, drive_e, emps, source_drive, without
from recursion import run
from test_stacked import DRIVES, scattered

from actuator_lti import assemble_loops, load_design, onset
from actuator_lti.design import model
from actuator_lti.design.access import stacked
from actuator_lti.design.model import Design, Limits
from actuator_lti.drive.facts import RATE_LIMITS, Capability, breakaway_torque_Nm, capability, stall_torque_Nm
from actuator_lti.drive.steady import torque_gain_Nm_rad
from analyses.specification.capability import drive_figures
from nonlinear import Drive, commands, simulate
from tests.changed import changed
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


def test_a_map_of_friction_bounds_the_speed() -> None:
    """U = R i + kE w with the map's torque: on its second piece 0.02 + 1e-4 (w - 100)."""
    rows = ((0.0, 0.05), (100.0, 0.02), (900.0, 0.1))
    points = tuple(model.FrictionPoint(speed_rad_s=w, torque_Nm=T) for w, T in rows)
    design = replace(drive_e(), friction=model.Friction(points=points), coupling=None, load=model.Load())
    capacity = capability(design)
    w = capacity.output_rate_rad_s * design.total_ratio
    i = (0.02 + 1e-4 * (w - 100)) / 0.05
    assert 0.5 * i + 0.05 * w == pytest.approx(48.0, rel=1e-12)
    assert capacity.motor_current_A == pytest.approx(i, rel=1e-12)
    assert RATE_LIMITS[int(capacity.rate_limit)] == "voltage"


def test_friction_behind_the_coupling_counts() -> None:
    """Both frictions at the motor: Cv + Cv_l/N_c^2, C0_l/N_c; each dry part held by its own ratio."""
    behind = model.LoadFriction(dry_torque_Nm=3.0, viscous_Nms_rad=0.2, breakaway_ratio=1.5)
    friction = model.Friction(dry_torque_Nm=0.01, viscous_Nms_rad=1e-5, breakaway_ratio=1.2)
    design = replace(drive_d(), friction=friction, load=replace(drive_d().load, friction=behind))
    assert breakaway_torque_Nm(design, 0.0, 1) == pytest.approx(1.2 * 0.01 + 1.5 * 3.0 / 10)
    w = capability(design).output_rate_rad_s * 10
    needed = 0.01 + 0.3 + (1e-5 + 0.2 / 100) * w
    assert 0.5 * needed / 0.05 + 0.05 * w == pytest.approx(48.0, rel=1e-12)


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
    rigid = replace(design, coupling=None)  # rubs with the load's moment alone (equation 9)
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


@pytest.mark.parametrize("load", [0.0, 4.0])
def test_a_sagging_supply_slows_the_drive(load: float) -> None:
    """At the voltage limit U_s = (R + R_s) i + kE w: by hand, and where the simulator ends up."""
    base = amber()
    design = replace(
        base, supply=model.Supply(resistance_ohm=0.04), coupling=None,
        limits=replace(base.limits, speed_rad_s=1e5, acceleration_rad_s2=float("inf"), peak_current_A=1e3),
    )  # fmt: skip
    motor, friction = design.motor, design.friction
    dry = friction.dry_torque_Nm + friction.load_coefficient * load
    kM, kE = motor.torque_constant_Nm_A, motor.back_emf_constant_Vs_rad
    total = motor.resistance_ohm + 0.04
    w = (kM * design.limits.voltage_V / total - dry) / (friction.viscous() + kM * kE / total)
    assert capability(design, load).output_rate_rad_s * design.total_ratio == pytest.approx(w, rel=1e-12)
    assert stall_torque_Nm(design) == pytest.approx(kM * design.limits.voltage_V / total)
    ran = simulate(design, commands.step(1e3), load_Nm=-load, duration_s=0.5)
    assert ran.motor_speed_rad_s[-1] == pytest.approx(w, rel=1e-6)


@pytest.mark.parametrize(("load", "deg_s"), [(0.0, 454.844), (8.0, 423.775)])
def test_a_p_velocity_loop_stays_below_its_limit_by_its_droop(load: float, deg_s: float) -> None:
    """The fin: kM (Kp (w_lim - w) - kE w)/R against friction, bearing and load, solved by hand for w."""
    fin = load_design("fin")
    torque = 8e-3 + 1.7e-3 * (load + 0.05) + (load + 0.05) / 60.0  # and what grows with w:
    viscous = 1e-5 + 0.02 / 60.0 * (1.7e-3 + 1.0 / 60.0)
    w = (0.03 * 0.12 * 600.0 - torque) / (0.03 * (0.12 + 0.03) + viscous)
    assert np.degrees(w / 60.0) == pytest.approx(deg_s, abs=1e-3)
    figures = drive_figures(fin, load)
    assert figures.output_rate_rad_s * 60.0 == pytest.approx(w, rel=1e-12)
    assert figures.rate_limit == "speed limit less droop of the P velocity loop"
    level = replace(fin, load=fin.load.level())
    ran = simulate(level, commands.ramp(20.0), duration_s=1.0, load_Nm=-load)
    assert ran.motor_speed_rad_s[-1] == pytest.approx(w, rel=1e-6)


def test_an_integral_or_a_drive_without_friction_leaves_no_droop() -> None:
    """Kp (w_lim - w) is nothing where nothing holds the motor back: a current integral feeds the back-EMF."""
    free = controlled(amber(friction=model.Friction()), velocity={"integral_time_s": None})
    assert drive_figures(free) == drive_figures(replace(free, controller=amber().controller))
    held = replace(free, friction=model.Friction(dry_torque_Nm=0.01))
    below = held.limits.speed_rad_s - 0.01 / held.motor.torque_constant_Nm_A / held.controller.velocity.gain
    assert capability(held).output_rate_rad_s * held.total_ratio == pytest.approx(below, rel=1e-12)


def test_the_droop_of_many_drives_with_p_loops_is_that_of_each() -> None:
    """Voltage of a P current loop: kp (i_ref - i) = R i + kE w."""
    design = controlled(amber(), velocity={"integral_time_s": None}, current={"integral_time_s": None})
    control = design.controller
    gains = np.array([0.5, 1.0, 2.0]) * control.current.gain_V_A
    many = capability(stacked(design, {"control.current.gain": gains})).output_rate_rad_s * design.total_ratio
    motor, friction, kp = design.effective_motor, design.friction, control.velocity.gain
    for gain, found in zip(gains, many, strict=True):
        total = gain + motor.resistance_ohm
        pull, back = motor.torque_constant_Nm_A * gain * kp / total, motor.torque_constant_Nm_A / total
        slope = pull + back * motor.back_emf_constant_Vs_rad + friction.viscous()
        w = (pull * design.limits.speed_rad_s - friction.dry_torque_Nm - friction.offset_torque_Nm) / slope
        assert found == pytest.approx(w, rel=1e-12)


def peaks(design: Design, cycles: int, window: int, amplitude: float) -> dict[str, float]:
    """Steady peaks of u, i_ref and w_ref for a sinusoid at the output shaft, run tick by tick."""
    record = run(design, amplitude * np.sin(2 * np.pi * cycles / window * np.arange(2 * window)))
    steady = {
        name: record[name][-window // every :] for name, every in (("u", 1), ("i_ref", 2), ("w_ref", 10))
    }
    steady["change"] = np.diff(record["w_ref"])[-window // 10 :] / 1e-3
    steady["rate"] = np.diff(record["i_ref"])[-window // 2 :] / 2e-4
    return {name: float(np.max(np.abs(values))) for name, values in steady.items()}


@pytest.mark.parametrize("cycles", [61, 401])
@pytest.mark.parametrize("feedforward", [0.0, 0.9])
def test_onset_of_each_limiter_in_the_multirate_drive(cycles: int, feedforward: float) -> None:
    """At the onset amplitude the largest steady sample is the limit, whichever sub-tick it falls in."""
    design, window = amber(2, 10, feedforward=feedforward), 14_000
    design = changed(design, limits={"current_rate_A_s": 1e3})
    loops, omega = assemble_loops(design), 2 * np.pi * cycles / (window * 1e-4)
    seen = peaks(design, cycles, window, 1e-3)
    signals = {"speed": "w_ref", "acceleration": "change", "current": "i_ref", "voltage": "u"}
    signals["current-rate"] = "rate"
    for name, path in loops.limiters.items():
        amplitude = float(path.onset_amplitude_rad(omega)[0])
        # the recursion sees samples of the sinusoid, whose phases here lie densely enough for 0.1 %
        assert seen[signals[name]] * amplitude / 1e-3 == pytest.approx(path.limit, rel=2e-3), name


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


def test_the_integral_of_a_position_controller_waits() -> None:
    """PI of position straight on the current: behind the slope limit out is not v, so I is kept."""
    loop = {"gain": 0.1, "every": 1, "integral_time_s": 1e-3}
    design = controlled(load_design("ilr33-amber"), velocity=None, position=loop)
    drive = Drive(replace(design, limits=Limits(voltage_V=1e6, current_rate_A_s=1.0)))
    for k in range(1, 4):
        drive.control(1.0, 0.0, 0.0, 0.0)
        assert drive.value("position_integrator") == 0.0
        assert drive.value("current_reference") == pytest.approx(1e-4 * k, rel=1e-12)
