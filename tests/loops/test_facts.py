"""What a drive can do: against the simulator, against first principles, and many against one."""

from dataclasses import replace

import numpy as np
import pytest
from loop_designs import amber, controlled, source_drive, without
from test_stacked import DRIVES, scattered
from two_mass import drive_d, drive_e

from actuator_lti.design import load_design, model
from actuator_lti.design.access import stacked
from actuator_lti.drive.facts import RATE_LIMITS, Capability, breakaway_torque_Nm, capability, stall_torque_Nm
from actuator_lti.drive.steady import torque_gain_Nm_rad
from analyses.specification.capability import drive_figures
from nonlinear import commands, simulate


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


def test_the_speed_limit_belongs_to_the_position_stage() -> None:
    """The speed command is clamped where a position loop gives it; without a velocity loop there is none."""
    assert drive_figures(amber()).rate_limit == "speed limit"
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
