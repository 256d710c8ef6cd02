"""Published figures: the baseline, EMPS, G5, G6, K1 to K4; plant, two masses, stiffness by closed forms."""

from dataclasses import replace
from itertools import pairwise
from math import exp
from typing import Any

import numpy as np
import pytest
from loop_designs import amber, controlled, ctms_position, drive_d, emps, without
from loop_designs import response as at
from scipy.optimize import brentq
from scipy.signal import cont2discrete

from actuator_lti import assemble_loops, load_design, plant, stability_margins
from actuator_lti.asked.drive_figure import drive_figure
from actuator_lti.batch import Population
from actuator_lti.batch import drive_figures as many
from actuator_lti.design import Design, model, shipped_designs, with_overrides
from actuator_lti.design.model import Friction, Motor
from actuator_lti.drive.blocks import biquad
from actuator_lti.drive.operating import Operating, slope_at
from actuator_lti.loops.stiffness import compliance
from nonlinear import commands, simulate
from tests.changed import changed
from tests.refusals import refused


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


W = np.geomspace(1.0, 2e4, 60)


def prompt(name: str, **changes: Any) -> Design:
    """A design whose voltage acts at once."""
    return with_overrides(load_design(name), {"control.computing_delay": "0 s", **changes})


def entry(system: Any, output: str, source: str) -> np.ndarray:
    at = system.output_labels.index(output), system.input_labels.index(source)
    return np.asarray(system(1j * W, squeeze=False))[at]


def ideal_motor(design: Design) -> dict[str, float]:
    motor, friction = design.effective_motor, design.friction
    return {
        "R": motor.resistance_ohm, "L": motor.inductance_H, "kM": motor.torque_constant_Nm_A,
        "kE": motor.back_emf_constant_Vs_rad, "J": design.inertia_kgm2, "C": friction.viscous(),
    }  # fmt: skip


def test_a_locked_rotor_is_a_resistance_and_an_inductance() -> None:
    design = prompt("ilr33-amber")
    p, Ts = ideal_motor(design), design.controller.period_s
    found = plant(design, "ideal", "locked")
    assert found.output_labels == ["current"]
    assert entry(found, "current", "u") == pytest.approx(1 / (1j * W * p["L"] + p["R"]), rel=1e-12)
    decay, sampled = exp(-p["R"] * Ts / p["L"]), plant(design, "sampled", "locked")
    assert sampled.dt == Ts
    assert sampled.A[0, 0] == pytest.approx(decay, rel=1e-12)
    assert sampled.B[0, 0] == pytest.approx((1 - decay) / p["R"], rel=1e-12)
    assert not np.any(sampled.B[:, 1])


def test_a_free_rotor_has_its_back_emf() -> None:
    """w/u = kM / ((L s + R)(J s + C) + kM kE); th = w/s; the output turns N times slower."""
    design = prompt("ilr33-amber")
    p, s = ideal_motor(design), 1j * W
    found = plant(design, "ideal")
    speed = p["kM"] / ((p["L"] * s + p["R"]) * (p["J"] * s + p["C"]) + p["kM"] * p["kE"])
    assert entry(found, "speed", "u") == pytest.approx(speed, rel=1e-11)
    assert entry(found, "current", "u") == pytest.approx(speed * (p["J"] * s + p["C"]) / p["kM"], rel=1e-11)
    assert entry(found, "output_angle", "u") == pytest.approx(speed / s / design.total_ratio, rel=1e-11)
    assert not np.any(entry(found, "speed", "load_torque"))  # self-locking


@pytest.mark.parametrize("name", shipped_designs())
def test_sampled_is_the_zero_order_hold_of_ideal(name: str) -> None:
    """Without own torques, which are held over a tick, and without delay: scipy's hold of the same."""
    design = prompt(name)
    design = replace(design, load=design.load.bare(), motor=design.motor.straight())
    ideal, sampled = plant(design, "ideal"), plant(design)
    order = [ideal.state_labels.index(state) for state in sampled.state_labels]
    A, B, C = ideal.A[np.ix_(order, order)], ideal.B[order], ideal.C[:, order]
    Phi, Gamma, *_ = cont2discrete((A, B, C, ideal.D), design.controller.period_s)
    np.testing.assert_allclose(sampled.A, Phi, rtol=1e-9, atol=1e-12 * np.abs(Phi).max())
    for column in (0, 1):
        size = np.abs(Gamma[:, column]).max()
        assert sampled.B[:, column] == pytest.approx(Gamma[:, column], rel=1e-9, abs=1e-12 * size)
    assert sampled.C.tolist() == C.tolist()


def test_the_continuous_form_is_late_by_the_delay_and_half_a_tick() -> None:
    design = load_design("fin")
    late = design.controller.computing_delay_s + design.controller.period_s / 2
    exact, ideal = plant(design, "continuous"), plant(design, "ideal")
    wanted = entry(ideal, "speed", "u") * np.exp(-1j * W * late)
    assert entry(exact, "speed", "u") == pytest.approx(wanted, rel=1e-10)
    assert entry(exact, "twist", "load_torque") == pytest.approx(
        entry(ideal, "twist", "load_torque"), rel=1e-10
    )


def test_a_current_command_closes_the_current_loop() -> None:
    """Locked, without delay: PI(s) G/(1 + PI(s) G), G = 1/(L s + R)."""
    design = prompt("ilr33-amber")
    p, loop, s = ideal_motor(design), design.controller.current, 1j * W
    L = loop.gain_V_A * (1 + 1 / (loop.integral_time_s * s)) / (p["L"] * s + p["R"])
    found = plant(design, "ideal", "locked", command="i_ref")
    assert entry(found, "current", "i_ref") == pytest.approx(L / (1 + L), rel=1e-10)
    assert plant(design, command="i_ref").input_labels == ["i_ref", "load_torque"]


@pytest.mark.parametrize(("name", "bad", "words"), [
    ("joint", {"form": "zoh"}, "form = 'zoh': must be one of sampled, continuous, ideal"),
    ("joint", {"rotor": "held"}, "rotor = 'held': must be one of free, locked"),
    ("joint", {"command": "w_ref"}, "command = 'w_ref': must be one of u, i_ref"),
    ("emps", {"command": "i_ref"}, "emps has no current loop"),
    ("emps", {"rotor": "locked"}, "the design has no current"),
])  # fmt: skip
def test_bad_arguments_are_named(name: str, bad: dict[str, Any], words: str) -> None:
    refused(plant, name, words=words, **bad)


NOTCH = model.Filter(kind="notch", frequency_rad_s=640.0, width_rad_s=320.0, depth=0.1)


PUBLISHED = {  # loop, filters, phase margins (deg, rad/s), gain margin (ratio, rad/s)
    "K1, current loop, rotor free": (
        "current", (),
        [(77.98855712, 610.7379071), (166.4429489, 645.4654402), (77.45285893, 1612.214119)],
        (6.503072809, 10479.30493),
    ),
    "K2, velocity loop": (
        "velocity", (),
        [(74.46418674, 245.4593817), (-129.7195634, 541.7421541), (62.39378704, 872.8623258)],
        (7.624731944, 2860.527035),
    ),
    "K3, with a notch": ("velocity", (NOTCH,), [(63.34614837, 241.6147984)], (8.849712773, 3101.308198)),
}  # fmt: skip


@pytest.mark.parametrize("case", PUBLISHED)
def test_published_margins(case: str) -> None:
    name, filters, phases, gain = PUBLISHED[case]
    margins = stability_margins(getattr(assemble_loops(drive_d(*filters)), name).open_loop)
    for have, want in (
        (sorted((m.deg, m.frequency_rad_s) for m in margins.phase_margins), sorted(phases)),
        ([(m.ratio, m.frequency_rad_s) for m in margins.gain_margins], [gain]),
    ):
        assert [each for pair in have for each in pair] == pytest.approx(
            [each for pair in want for each in pair], rel=1e-8
        )


def test_coefficients_of_the_notch_of_k3() -> None:
    found = biquad(NOTCH, 2e-4).sampled
    a1, a2 = -found.A[0][0], -found.A[1][0]
    b = [found.D, found.B[0] + found.D * a1, found.B[1] + found.D * a2]
    np.testing.assert_allclose(b, [0.9721668107471211, -1.922292822062545, 0.9659816575798147], rtol=1e-13)
    np.testing.assert_allclose([a1, a2], [-1.922292822062545, 0.9381484683269357], rtol=1e-13)


def test_slope_and_describing_function_of_a_friction_map() -> None:
    points = tuple(
        model.FrictionPoint(speed_rad_s=w, torque_Nm=T) for w, T in ((0.0, 0.02), (10.0, 0.01), (50.0, 0.03))
    )
    design = replace(drive_d(), friction=model.Friction(points=points))
    assert slope_at(design, Operating()) == pytest.approx(-1e-3)
    assert slope_at(design, Operating(speed_rad_s=-80.0)) == pytest.approx(5e-4)
    # fundamental of the torque of a sinusoidal speed, by quadrature over a quarter turn
    W = 40.0
    edges = np.arcsin(np.array([0.0, 10.0, W]) / W)
    nodes, weights = np.polynomial.legendre.leggauss(40)
    whole = 0.0
    for low, high in pairwise(edges):
        x = low + (high - low) * (nodes + 1) / 2
        speed = W * np.sin(x)
        torque = np.where(speed < 10, 0.02 - 1e-3 * speed, 0.01 + 5e-4 * (speed - 10))
        whole += float(np.sum(weights * torque * np.sin(x)) * (high - low) / 2)
    expected = 4 / np.pi * whole / W
    result = slope_at(design, Operating(point="describing-function", speed_amplitude_rad_s=W))
    assert result == pytest.approx(expected, rel=1e-12)


SLOW = {  # the textbook motor, heavy, on almost no gain
    "motor.rotor_inertia": 1e-3, "motor.resistance": 0.6, "motor.inductance": 5e-3, "load.inertia": 1e-4,
    "motor.torque_constant": 0.75, "motor.back_emf_constant": 0.75, "friction.viscous": 0.0,
    "control.position.gain": 1e-5,
}  # fmt: skip
AMBER = load_design("ilr33-amber").with_values({"friction.breakaway_ratio": 1.3})


@pytest.mark.parametrize("name", ["joint", "ballscrew", "fin", "ilr33-amber-compliant", "emps"])
def test_the_periodic_response_is_that_of_the_time_invariant_system(name: str) -> None:
    """Two derivations: M ticks followed one after the other, and one system of M n states."""
    loops, result = assemble_loops(load_design(name)), compliance(load_design(name))
    z = np.exp(2j * np.pi * np.geomspace(0.1, 1000.0, 30) * result.period_s)
    lifted = loops.load_torque_to_output
    assert np.abs(result(z) / lifted(z) - 1.0).max() < 1e-9
    assert result.slowest == pytest.approx(np.abs(lifted.poles()).max(), rel=1e-9)


@pytest.mark.parametrize(("name", "values", "quantities"), [
    ("ballscrew", {"coupling.stiffness": [4e7, 1e8, 3e8], "control.position.gain": [20.0, 60.0, 90.0]},
     ("static_stiffness", "least_stiffness", "lost_motion")),
    # delays of whole and broken ticks, damping of zero: other states, other zeros, taken group by group
    ("fin",
     {"control.computing_delay": [0.0, 1e-4, 2e-4, 5e-4], "coupling.damping": [0.0, 0.05, 0.05, 0.0]},
     ("least_stiffness",)),
])  # fmt: skip
def test_stacked_designs_have_the_figures_of_each_alone(name, values, quantities):
    design, count = load_design(name), len(next(iter(values.values())))
    stacked = {path: np.array(each) for path, each in values.items()}
    for quantity in quantities:
        together = many(Population(design, stacked, count), quantity)
        for k in range(count):
            alone = Population(design, {path: each[k : k + 1] for path, each in stacked.items()}, 1)
            assert together[k] == pytest.approx(many(alone, quantity)[0], rel=1e-9)


def test_a_drive_that_creeps_for_hours_has_a_stiffness_and_one_without_position_loop_none() -> None:
    """P on voltage: Kp kM N^2/R, here with a time constant kE kM/R over that of a day."""
    slow = load_design("ctms-motor-position").with_values(SLOW)
    assert drive_figure(slow, "static_stiffness") == pytest.approx(1e-5 * 0.75 / 0.6, rel=1e-6)
    free = controlled(slow, position=None, velocity=model.VelocityLoop(gain=1e-2))
    assert drive_figure(free, "static_stiffness") == 0.0


@pytest.mark.parametrize("load_Nm", [0.0, 1.0, 6.0])
@pytest.mark.parametrize(("margin", "moves"), [(0.98, False), (1.02, True)])
def test_the_simulator_starts_above_one(load_Nm: float, margin: float, moves: bool) -> None:
    """A current limit gives the margin; a large step either way, within a voltage that is no limit."""
    peak_A = margin / drive_figure(changed(AMBER, limits={"peak_current_A": 1.0}), "torque_margin", load_Nm)
    design = changed(AMBER, limits={"peak_current_A": float(peak_A)})
    assert drive_figure(design, "torque_margin", load_Nm) == pytest.approx(margin, rel=1e-9)
    runs = [
        simulate(design, commands.step(sign * 0.2), duration_s=0.3, load_Nm=-sign * load_Nm)
        for sign in (1.0, -1.0)
    ]
    assert all(np.abs(run.motor_speed_rad_s).max() > 1e-6 for run in runs) is moves


@pytest.mark.parametrize("command", ["u", "i_ref"])
@pytest.mark.parametrize("form", ["sampled", "continuous", "ideal"])
def test_the_filter_of_the_command_is_no_part_of_the_plant(command: Any, form: Any) -> None:
    """It filters the command of the position, not the volts or amperes of the law that is being made."""
    drive = load_design("ilr33-amber")
    filtered = with_overrides(drive, {"command.filter_time": "5 ms"})
    plain, made = (plant(each, form=form, command=command) for each in (drive, filtered))
    points = (
        np.exp(1j * np.array([0.01, 0.3, 2.0])) if form == "sampled" else 1j * np.array([10.0, 200.0, 5e3])
    )
    assert np.array_equal(made(points), plain(points))
