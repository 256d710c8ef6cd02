"""Energy: what goes in comes out, to 1e-9, whatever sticks, slips or saturates."""

from dataclasses import replace

import numpy as np
import pytest

from actuator_lti import load_design
from nonlinear import commands, loads, simulate

FRICTION = {
    "breakaway_ratio": 1.3,
    "dry_torque_reverse_Nm": 4e-3,
    "viscous_reverse_Nms_rad": 1e-5,
    "offset_torque_Nm": 5e-4,
}


@pytest.mark.parametrize(
    ("amplitude", "frequency", "load", "what"),
    [(0.0002, 3.0, 8.0, "stick"), (0.0873, 1.0, 4.0, "speed"), (0.1, 20.0, 0.0, "current")],
)
def test_baseline(amplitude: float, frequency: float, load: float, what: str) -> None:
    run = simulate(load_design("ilr33-amber"), commands.sine(amplitude, frequency), 1.0, load, energy=True)
    assert run.energy.relative_error < 1e-9
    assert run.energy.electrical_input_J > 0.0
    assert run.stick_fraction > 0.1 if what == "stick" else run.limits[what].fraction > 0.1


def test_asymmetric_back_drivable_with_fractional_delay() -> None:
    design = load_design("ilr33-amber")
    design = replace(
        design,
        motor=replace(design.motor, back_emf_constant_Vs_rad=6.5e-3),
        load=replace(design.load, path="back-drivable"),
        friction=replace(design.friction, **FRICTION),
        controller=replace(design.controller, computing_delay_s=1.3e-4),
    )
    run = simulate(design, commands.sine(0.01, 2.0), 1.0, loads.proportional(-40.0, 5.0), energy=True)
    energy = run.energy
    assert energy.relative_error < 1e-9
    assert abs(energy.conversion_J) > 1e-3
    assert abs(energy.output_work_J) > 1e-6
    assert run.events > 5


@pytest.mark.parametrize("name", ["emps", "ctms-motor-position", "ilr33-amber-multirate"])
def test_other_drives(name: str) -> None:
    design = load_design(name)
    amplitude = design.validation.full_deflection_rad / 4
    run = simulate(design, commands.sine(amplitude, 1.0), 1.5, energy=True)
    assert run.energy.relative_error < 1e-9


def test_every_loss_of_a_steady_speed() -> None:
    design = load_design("ilr33-amber")
    run = simulate(design, commands.ramp(600.0 / design.total_ratio), 2.0, 8.0, energy=True)
    energy, turned = run.energy, run.final.motor_angle_rad
    assert energy.dry_friction_J == pytest.approx((2.25e-3 + 8 * 1.34e-3) * turned, rel=1e-9)
    assert energy.kinetic_J == pytest.approx(0.5 * design.inertia_kgm2 * run.final.motor_speed_rad_s**2)


def test_tanh_law_balances_to_its_steps() -> None:
    design = load_design("ilr33-amber")
    design = replace(design, friction=replace(design.friction, law="tanh"))
    run = simulate(design, commands.sine(0.01, 2.0), 0.5, 8.0, energy=True)
    assert run.energy.relative_error < 1e-6


def test_energies_do_not_change_the_motion() -> None:
    design = load_design("ilr33-amber")
    with_energy = simulate(design, commands.sine(0.0005, 3.0), 0.6, 8.0, energy=True)
    without = simulate(design, commands.sine(0.0005, 3.0), 0.6, 8.0)
    assert without.energy is None
    assert np.array_equal(with_energy.motor_angle_rad, without.motor_angle_rad)
    assert np.array_equal(with_energy.current_A, without.current_A)
