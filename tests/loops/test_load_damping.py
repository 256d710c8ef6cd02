"""A load moment against the motion, per speed of the output: closed forms of both writings."""

from dataclasses import replace
from math import exp

import numpy as np
import pytest

from actuator_lti import InputError, load_design
from actuator_lti.design.model import Controller, Design, Friction, Gear, Limits, Load, Motor, Validation
from actuator_lti.drive.facts import capability
from actuator_lti.drive.wiring import wire
from actuator_lti.loops.tick import TickProgram
from nonlinear import State, commands, simulate

J, N, Ts, D = 2e-5, 40.0, 1e-3, 3.0


def coasting(path: str, viscous: float, load_coefficient: float = 0.0) -> Design:
    """A torque source without a controller, so that the rotor coasts."""
    return Design(
        name="coasting",
        motor=Motor(rotor_inertia_kgm2=J, source_gain_Nm_V=1.0),
        gears=(Gear(name="one", ratio=N),),
        controller=Controller(period_s=Ts, computing_delay_s=0.0),
        limits=Limits(voltage_V=10.0),
        validation=Validation(full_deflection_rad=1.0),
        load=Load(path=path, moment_damping_Nms_rad=D),
        friction=Friction(viscous_Nms_rad=viscous, load_coefficient=load_coefficient),
    )


def ratio(viscous: float, slope: float) -> float:
    """w_(k+1)/w_k under the torque -slope w_k, held over a tick, and viscous friction."""
    if viscous == 0.0:
        return 1.0 - slope * Ts / J
    kept = exp(-viscous * Ts / J)
    return kept - (1.0 - kept) * slope / viscous


@pytest.mark.parametrize("viscous", [0.0, 1e-3])
def test_a_rotor_coasts_to_the_held_recursion(viscous: float) -> None:
    design = coasting("back-drivable", viscous)
    expected = ratio(viscous, D / N**2)
    run = simulate(design, commands.hold(), 50 * Ts, initial=State(motor_speed_rad_s=-80.0))
    w = run.motor_speed_rad_s
    assert w == pytest.approx(-80.0 * expected ** np.arange(w.size), rel=1e-12)
    assert run.load_Nm == pytest.approx(-D * w / N, rel=1e-12)
    tick = TickProgram(wire(design), "voltage").tick(0)
    assert np.sort(np.linalg.eigvals(tick.A).real) == pytest.approx(sorted([expected, 1.0]), rel=1e-12)


def test_a_self_locking_path_feels_it_as_friction_alone() -> None:
    """T_f = CM |M_ext| = CM D w/N while the load is that moment only."""
    design = coasting("self-locking", 0.0, load_coefficient=2.0 / N)
    run = simulate(design, commands.hold(), 50 * Ts, initial=State(motor_speed_rad_s=80.0))
    w = run.motor_speed_rad_s
    assert w == pytest.approx(80.0 * ratio(0.0, 2.0 * D / N**2) ** np.arange(w.size), rel=1e-12)
    assert wire(design).plant.moment == {}


def test_energy_of_the_moment_is_work_on_the_load() -> None:
    design = coasting("back-drivable", 0.0)
    run = simulate(design, commands.hold(), 50 * Ts, initial=State(motor_speed_rad_s=80.0), energy=True)
    w, energy = run.motor_speed_rad_s, run.energy
    after = np.append(w, run.final.motor_speed_rad_s)
    assert energy.output_work_J == pytest.approx(0.5 * J * (80.0**2 - after[-1] ** 2), rel=1e-12)
    travel = 0.5 * (after[1:] + after[:-1]) * Ts  # under a constant torque
    assert energy.output_work_J == pytest.approx(float(np.sum(D * w / N**2 * travel)), rel=1e-9)


def test_the_plant_holds_the_sum() -> None:
    """Cv + D/N^2 over J, of which the second part comes through the moment."""
    base = load_design("ilr33-amber")
    load = replace(base.load, path="back-drivable", moment_damping_Nms_rad=30.0)
    design = replace(base, load=load)
    plant = wire(design).plant
    own = plant.A[1, 1] + plant.B_M[1] * plant.moment["load_speed"] * plant.rows["load_speed"]["w"]
    assert -own * design.inertia_kgm2 == pytest.approx(
        design.friction.viscous_Nms_rad + 30.0 / design.total_ratio**2, rel=1e-12
    )


@pytest.mark.parametrize("path", ["back-drivable", "self-locking"])
def test_top_speed_is_that_of_the_run(path: str) -> None:
    """(kM U/R - C0) over kM kE/R + Cv + (1/N + CM) D/N, or CM D/N where the path locks itself."""
    base = load_design("ilr33-amber")
    load = replace(base.load, path=path, moment_damping_Nms_rad=20.0)
    open_loop = replace(base.controller, position=None, velocity=None, current=None)
    design = replace(base, load=load, controller=open_loop)
    motor, friction, N = design.effective_motor, design.friction, design.total_ratio
    per_volt = motor.torque_constant_Nm_A / motor.resistance_ohm
    passed = friction.load_coefficient + (1.0 / N if path == "back-drivable" else 0.0)
    slope = per_volt * motor.back_emf_constant_Vs_rad + friction.viscous_Nms_rad + passed * 20.0 / N
    expected = (per_volt * design.limits.voltage_V - friction.dry_torque_Nm) / slope / N
    assert capability(design).output_rate_rad_s == pytest.approx(expected, rel=1e-12)
    run = simulate(design, commands.step(design.limits.voltage_V), 0.5)
    assert run.motor_speed_rad_s[-1] / N == pytest.approx(expected, rel=1e-9)


def test_key_and_its_bound() -> None:
    fin = load_design("fin")
    damped = fin.with_values({"load.moment_damping": "0.01 N*m*s/rad"})
    assert "load.moment_damping" in damped.load.acting()
    assert not damped.load.bare().acting()
    with pytest.raises(InputError, match=r"load\.moment_damping = .*: held over a tick .*; allowed: at most"):
        fin.with_values({"load.moment_damping": "1e6 N*m*s/rad"})
