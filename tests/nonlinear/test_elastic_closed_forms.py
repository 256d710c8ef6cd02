"""The event-driven plant against closed forms, published numbers, an independent integration; its energy."""

import numpy as np
import pytest

from actuator_lti.design.model import Design
from nonlinear import commands, simulate
from nonlinear._kernels import layout
from tests.nonlinear.elastic_drive import Run, drive_f, random_drive, run_plant, two_mass

K, J_M, J_L, N, B = 200.0, 2e-5, 1e-3, 10.0, 0.01
REDUCED = 1.0 / (1.0 / J_L + 1.0 / (J_M * N * N))  # inertia of the relative motion
RESONANCE = np.sqrt(K / REDUCED)
IDEAL = {"damping_Nms_rad": 0.0}
TIGHT = IDEAL | {"play_rad": 0.0}


def test_reference_number_k5() -> None:
    run = simulate(drive_f(), commands.step(0.1), 0.1, energy=True)
    assert run.motor_angle_rad[499] == pytest.approx(0.882029497378, abs=1e-12)
    assert run.motor_speed_rad_s[499] == pytest.approx(1.6424769357, abs=1e-10)
    assert run.current_A[499] == pytest.approx(-0.00270770144038, abs=1e-14)
    assert run.output_angle_rad[499] == pytest.approx(0.0969298356075, abs=1e-13)
    assert run.output_speed_rad_s[499] == pytest.approx(0.180917733342, abs=1e-12)
    assert run.coupling_torque_Nm[499] == 0.0
    assert run.coupling_torque_Nm.min() == pytest.approx(-0.445253372927, abs=1e-12)
    assert run.coupling_torque_Nm.max() == pytest.approx(0.638947611306, abs=1e-12)
    assert run.energy.relative_error < 1e-9
    assert run.energy.coupling_damping_J > 1e-5
    assert run.energy.parting_J > 1e-7
    assert run.energy.load_dry_friction_J == 0.0


def twist_of(run: Run) -> np.ndarray:
    return run.states[:, 3] / N - run.states[:, 4]


def test_free_vibrations_of_both_masses_of_the_motor_and_of_the_load() -> None:
    design, ticks = two_mass(1e-3, source=True, coupling=TIGHT), np.arange(201)
    run = run_plant(design, np.zeros(200), start=(0.0, 0.0, 0.0, 0.5, 0.0))
    np.testing.assert_allclose(twist_of(run), 0.05 * np.cos(RESONANCE * ticks * 1e-3), atol=1e-13)
    common = J_M * N * run.states[:, 3] + J_L * run.states[:, 4]
    np.testing.assert_allclose(common, common[0], rtol=1e-13)
    # the load sticks
    design = two_mass(1e-3, source=True, coupling=TIGHT, load_friction={"dry_torque_Nm": 50.0})
    run = run_plant(design, np.zeros(100), start=(0.0, 0.0, 0.0, 0.2, 0.0))
    w0 = np.sqrt(K / (J_M * N * N))
    np.testing.assert_allclose(run.states[:, 3], 0.2 * np.cos(w0 * np.arange(101) * 1e-3), atol=1e-12)
    assert not run.states[:, 4].any()
    # behind a self-locking stage
    design = two_mass(1e-3, coupling=TIGHT, path="self-locking", friction={"load_coefficient": 0.2})
    run = run_plant(design, np.zeros(100), start=(0.0, 0.0, 0.0, 0.0, 0.02))
    swing = 0.02 * np.cos(np.sqrt(K / J_L) * np.arange(101) * 1e-3)
    np.testing.assert_allclose(run.states[:, 4], swing, atol=1e-13)
    assert np.abs(run.states[:, 3]).max() < 1e-18


def bounce(t: np.ndarray, v: float) -> np.ndarray:
    """Twist of two free masses that rebound from both sides of the play, from the middle with rate v."""
    flight, contact = 2 * B / v, np.pi / RESONANCE
    phase, sign = np.mod(t + flight / 2, flight + contact), np.floor((t + flight / 2) / (flight + contact))
    free = -B + v * phase
    pressed = B + v / RESONANCE * np.sin(RESONANCE * (phase - flight))
    return np.where(sign % 2 == 0, 1.0, -1.0) * np.where(phase < flight, free, pressed)


@pytest.mark.parametrize("offset", [0.0, 1e-15, -1e-15, 1e-9, -1e-9])
def test_impact_at_the_edge_of_a_tick(offset: float) -> None:
    v = 4.0
    Ts = B / v / 5 * (1 + offset)  # contact begins at the end of the fifth tick
    design = two_mass(Ts, source=True, coupling=IDEAL)
    run = run_plant(design, np.zeros(60), start=(0.0, v * N, 0.0, 0.0, 0.0))
    np.testing.assert_allclose(twist_of(run), bounce(np.arange(61) * Ts, v), atol=1e-13)
    mass, momentum = J_L + J_M * N * N, J_M * N * N * v
    centre = (J_M * N * run.states[:, 3] + J_L * run.states[:, 4]) / mass
    np.testing.assert_allclose(centre, momentum / mass * np.arange(61) * Ts, atol=1e-13)


def test_play_crossed_many_times_in_a_tick() -> None:
    v = 20.0
    Ts = 5.3 * (2 * B / v + np.pi / RESONANCE)
    design = two_mass(Ts, source=True, coupling=IDEAL)
    run = run_plant(design, np.zeros(20), start=(0.0, v * N, 0.0, 0.0, 0.0))
    assert max(run.events) >= 10
    np.testing.assert_allclose(twist_of(run), bounce(np.arange(21) * Ts, v), atol=1e-12)


def test_damped_contact_parts_at_no_torque() -> None:
    """One rebound: T_s = 0 ends contact while the spring is still pressed, and its energy is lost."""
    c, v, Ts = 0.2, 3.0, 1e-4
    design = two_mass(Ts, source=True, coupling={"damping_Nms_rad": c})
    start = (0.0, v * N, 0.0, B * N, 0.0)  # at the edge of the play
    run = run_plant(design, np.zeros(90), start=start, WITH_ENERGY=1.0)
    a = 0.5 * c / REDUCED
    wd = np.sqrt(K / REDUCED - a * a)
    # x = v exp(-a t) sin(wd t)/wd; K x + c x' = 0 at tan(wd t) = -c wd/(K - c a)
    t = (np.pi - np.arctan2(c * wd, K - c * a)) / wd
    x = v * np.exp(-a * t) * np.sin(wd * t) / wd
    rate = -K * x / c
    parting = 0.5 * K * x * x
    damped = 0.5 * REDUCED * (v * v - rate * rate) - parting
    assert run.ledgers[90, layout.ENERGY_DAMPING :][:2] == pytest.approx([damped, parting], rel=1e-10)
    assert run.states[90, 1] / N - run.states[90, 2] == pytest.approx(rate, rel=1e-11)


SPENT = [getattr(layout, f"ENERGY_{name}") for name in (
    "COPPER", "DRY", "VISCOUS", "DAMPING", "PARTING", "LOAD_DRY", "LOAD_VISCOUS",
    "OFFSET", "LOAD", "CONVERSION", "LOAD_OFFSET")]  # fmt: skip
LOSSES = SPENT[:7]


def stored(design: Design, x: np.ndarray) -> float:
    """Energy in the inductance, both inertias and the spring, of (i, w, W, th, phi)."""
    i, w, W, th, phi = x
    coupling, L = design.coupling, design.motor.inductance_H or 0.0
    stretch = max(0.0, abs(th / design.ratio_to_coupling - phi) - coupling.play_rad / 2)
    c, (spring, T, k) = coupling, (0.0, 0.0, coupling.stiffness_Nm_rad)
    for bend, beyond in ((c.torque_1_Nm, c.stiffness_2_Nm_rad), (c.torque_2_Nm, c.stiffness_3_Nm_rad)):
        if bend is not None and T + k * stretch > bend:
            spring += 0.5 * (bend * bend - T * T) / k
            stretch, T, k = stretch - (bend - T) / k, bend, beyond
    spring += T * stretch + 0.5 * k * stretch * stretch
    kinetic = design.motor_side_inertia_kgm2 * w * w + design.load_side_inertia_kgm2 * W * W
    return 0.5 * (L * i * i + kinetic) + spring


@pytest.mark.parametrize("seed", range(60))
def test_balance_passivity_and_the_same_motion_without(seed: int) -> None:
    """The short way and the ledger's way walk the same segments differently."""
    design, voltages, moments, fraction = random_drive(seed)
    run = run_plant(design, voltages, moments, fraction_s=fraction, WITH_ENERGY=1.0)
    assert run.status == layout.OK
    e = run.ledgers
    change = np.array([stored(design, x) for x in run.states])
    largest = max(np.abs(e).max(), change.max())
    error = e[:, layout.ENERGY_INPUT] - change - e[:, SPENT].sum(axis=1)
    assert np.abs(error).max() < 1e-11 * largest
    assert np.diff(e[:, LOSSES], axis=0).min() >= -1e-15 * largest
    if seed < 20:
        without = run_plant(design, voltages, moments, fraction_s=fraction)
        scale = np.abs(without.states).max(axis=0)
        assert np.all(np.abs(run.states - without.states) <= 1e-10 * scale)
        assert run.events == without.events
