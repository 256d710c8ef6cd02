"""Published and independently computed figures: the baseline, EMPS, G5, G6; G4 is in tests/margins."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from loop_designs import amber, controlled, ctms_position, emps, without
from scipy.optimize import brentq

from actuator_lti import assemble_loops
from actuator_lti.design.model import Design, Friction, Gear, Motor


def at(system: Any, omega: float) -> complex:
    s = np.exp(1j * omega * system.dt) if system.isdtime(strict=True) else 1j * omega
    return complex(system(s))


def crossover(system: Any, low: float, high: float) -> tuple[float, float]:
    """Frequency of unit gain and phase margin in degrees."""
    omega = float(brentq(lambda w: abs(at(system, w)) - 1, low, high, xtol=1e-9))
    return omega, 180 + float(np.degrees(np.angle(at(system, omega))))


def gain_margin(system: Any, low: float, high: float) -> tuple[float, float]:
    """Frequency of -180 degrees and gain margin in dB."""
    omega = float(brentq(lambda w: at(system, w).imag, low, high, xtol=1e-9))
    assert at(system, omega).real < 0
    return omega, -20 * float(np.log10(abs(at(system, omega))))


def minus_3db_hz(system: Any, high: float) -> float:
    return float(brentq(lambda w: abs(at(system, w)) - 0.5**0.5, 1.0, high)) / (2 * np.pi)


def test_baseline_of_hardware_md() -> None:
    loops = assemble_loops(amber())
    assert crossover(loops.current.open_loop, 2000, 4000) == pytest.approx((2737, 89.7), abs=0.5, rel=1e-3)
    assert gain_margin(loops.current.open_loop, 8e3, 2e4)[1] == pytest.approx(9.4, abs=0.05)
    omega, margin = crossover(loops.velocity.open_loop, 200, 2000)
    assert (omega, margin) == (pytest.approx(543, abs=0.5), pytest.approx(73.7, abs=0.05))
    assert gain_margin(loops.velocity.open_loop, 3e3, 1e4)[1] == pytest.approx(23.3, abs=0.05)
    assert minus_3db_hz(loops.velocity.closed_loop, 3000) == pytest.approx(116, abs=0.5)
    omega, margin = crossover(loops.position.open_loop, 50, 500)
    assert (omega, margin) == (pytest.approx(130, abs=0.5), pytest.approx(78.1, abs=0.05))
    assert gain_margin(loops.position.open_loop, 500, 3e3)[1] == pytest.approx(27.1, abs=0.05)
    assert minus_3db_hz(loops.position.closed_loop, 1000) == pytest.approx(27.6, abs=0.05)
    assert minus_3db_hz(loops.reference_to_output, 1000) == pytest.approx(27.6, abs=0.05)


@pytest.mark.parametrize(
    ("delay_s", "phase_margin", "gain_db", "omega"), [(0.0, 34.84, 21.34, 988), (1e-3, 26.61, 14.57, 539)]
)
def test_emps_at_the_plant_input(delay_s: float, phase_margin: float, gain_db: float, omega: float) -> None:
    loop = assemble_loops(emps(delay_s)).break_points["u"].open_loop
    assert crossover(loop, 50, 400)[1] == pytest.approx(phase_margin, abs=0.005)
    assert gain_margin(loop, 0.9 * omega, 1.1 * omega) == (
        pytest.approx(omega, abs=0.5),
        pytest.approx(gain_db, abs=0.005),
    )


def motor_speed(gain: float) -> Design:
    """G5: CTMS motor speed; J .01, b .1, K .01, R 1, L .5."""
    k = {"torque_constant_Nm_A": 0.01, "back_emf_constant_Vs_rad": 0.01}
    motor = Motor(rotor_inertia_kgm2=0.01, resistance_ohm=1.0, inductance_H=0.5, **k)
    bare = replace(amber(), motor=motor, gears=(), friction=Friction(viscous_Nms_rad=0.1))
    return controlled(without(bare, "current", gain=gain), velocity={"integral_time_s": None})


def test_g5_ctms_motor_speed() -> None:
    """CTMS, Frequency Domain Methods: 0.0139 (-37.1 dB) at 10 rad/s, so 72 puts the crossover there."""
    plant = assemble_loops(motor_speed(1.0), "ideal").velocity
    loop = assemble_loops(motor_speed(72.0), "ideal").velocity
    assert plant.open_loop.dcgain() == pytest.approx(0.01 / (0.1 + 0.01**2), rel=1e-12)
    gain = abs(at(plant.open_loop, 10.0))
    assert gain == pytest.approx(0.0139, abs=5e-5)
    assert 20 * np.log10(gain) == pytest.approx(-37.1, abs=0.06)
    assert crossover(loop.open_loop, 1, 100) == (pytest.approx(10, abs=0.05), pytest.approx(56.3, abs=0.1))


def test_g6_ctms_motor_position() -> None:
    """K/(s ((J s + b)(L s + R) + K^2)), whose electrical pole is 1.45e6 rad/s."""
    J, b, K, R, L = 3.2284e-6, 3.5077e-6, 0.0274, 4.0, 2.75e-6
    loops = assemble_loops(ctms_position(), "ideal")
    assert loops.velocity is None
    s = 1j * np.geomspace(0.1, 1e7, 50)
    expected = K / (s * ((J * s + b) * (L * s + R) + K**2))
    np.testing.assert_allclose(loops.position.open_loop(s), expected, rtol=1e-10)


def test_g6_sampled_with_a_stiff_electrical_pole() -> None:
    """CTMS, Digital Controller Design: ZOH at 1 ms; partial fractions of P(s)/s give the same P(z)."""
    J, b, K, R, L = 3.2284e-6, 3.5077e-6, 0.0274, 4.0, 2.75e-6
    loop, T = assemble_loops(ctms_position()).position, 1e-3
    poles = np.roots([J * L, J * R + b * L, b * R + K**2])
    z, gain = np.exp(1j * np.array([1.0, 10, 100, 1000, 3000]) * T), K / (J * L)
    # P(s)/s = gain / (s^2 (s - p1)(s - p2)): residues at p1, p2 and the double pole at 0
    c0 = gain / (poles[0] * poles[1])
    c1 = c0 * (1 / poles[0] + 1 / poles[1])
    total = c0 * T * z / (z - 1) ** 2 + c1 * z / (z - 1)
    for p, other in (poles, poles[::-1]):
        total = total + gain / (p**2 * (p - other)) * z / (z - np.exp(p * T))
    np.testing.assert_allclose(loop.open_loop(z), (z - 1) / z * total, rtol=1e-9)


def test_a_gear_ratio_drops_out_of_the_position_loop() -> None:
    one, other = amber(), amber(gears=(Gear(name="direct", ratio=1.0),))
    z = np.exp(1j * np.geomspace(1, 3e4, 20) * 1e-4)
    theirs, ours = (assemble_loops(design).reference_to_output for design in (one, other))
    np.testing.assert_allclose(theirs(z), ours(z), rtol=1e-9)
