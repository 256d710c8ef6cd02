"""The event-driven plant against solve_ivp with event functions, closed forms and published numbers."""

from dataclasses import replace
from math import exp, radians
from typing import Any

import numpy as np
import pytest

from actuator_lti import InputError, load_design, plant
from actuator_lti.design import design_hash, read_design_text, with_overrides, write_design
from actuator_lti.design.model import Controller, Design, Friction, Limits, Motor, PositionLoop
from nonlinear import Rows, commands, simulate
from nonlinear._kernels import layout
from nonlinear.runs.running import Running
from tests.changed import changed
from tests.nonlinear.elastic_drive import Run, drive_f, random_drive, run_plant, stribeck, two_mass
from tests.nonlinear.elastic_reference import reference
from tests.refusals import refused

AMBER = load_design("ilr33-amber")
DRY = Friction(dry_torque_Nm=0.02, viscous_Nms_rad=5e-6)
UNEVEN = replace(
    DRY, dry_torque_reverse_Nm=0.03, viscous_reverse_Nms_rad=2e-5, breakaway_ratio=1.5, offset_torque_Nm=0.004
)
LONG = 2e-3  # a tick longer than every time constant: much happens in it


def bare_drive(friction: Friction, period_s: float, **motor: float) -> Design:
    """The baseline's plant with other friction, tick and motor values, voltage unlimited."""
    limits, control = Limits(voltage_V=1e9), {"period_s": period_s, "computing_delay_s": 0.0}
    return changed(AMBER, motor=motor, friction=friction, limits=limits, controller=control)


def double_inductance(design: Design) -> float:
    """Inductance at which the eigenvalues of (i, w) coincide."""
    m, J, Cv = design.motor, design.inertia_kgm2, design.friction.viscous_Nms_rad
    # (R/L - Cv/J)^2 = 4 kE kM/(L J), solved for 1/L
    R, k = m.resistance_ohm, m.torque_constant_Nm_A * m.back_emf_constant_Vs_rad
    b, c = Cv / J, 4.0 * k / J
    return 1.0 / float(max(np.roots([R * R, -(2.0 * R * b + c), b * b]).real))


def agreeing(design: Design, voltages: np.ndarray, moments: Any = 0.0, w: float = 0.0, part: float = 0.0):
    """A run that agrees to 1e-9 of the largest value of each state, the voltage late by a part of a tick."""
    asked = (design, voltages, moments, (0.0, w, 0.0, 0.0, 0.0), part * design.controller.period_s)
    run, expected = run_plant(*asked), reference(*asked)
    own = [0, 1, 3] if design.coupling is None else [0, 1, 2, 3, 4]  # a rigid load is where its motor is
    assert run.status == layout.OK
    assert np.all(np.abs(run.states - expected)[:, own] <= 1e-9 * np.abs(expected).max(axis=0)[own])
    return run


@pytest.mark.parametrize("friction", [DRY, UNEVEN], ids=["plain", "asymmetric"])
@pytest.mark.parametrize("inductance", ["real", "complex", "double"])
@pytest.mark.parametrize("delay", [0.0, 0.3])
def test_several_events_in_a_tick(friction: Friction, inductance: str, delay: float) -> None:
    design = bare_drive(friction, LONG)
    value = {"real": 6e-6, "complex": 4e-5, "double": double_inductance(design)}[inductance]
    design = changed(design, motor={"inductance_H": value})
    rng = np.random.default_rng(3)
    voltages = rng.uniform(0.15, 0.9, 30) * (-1.0) ** np.arange(30)
    voltages[10:14] = 0.0
    assert max(agreeing(design, voltages, w=40.0, part=delay).events) >= 2


def test_events_of_other_drives() -> None:
    """Electromechanical resonance above Nyquist: the speed crosses zero several times in a tick."""
    design = bare_drive(replace(DRY, dry_torque_Nm=5e-4), 0.2, inductance_H=6e-3, resistance_ohm=0.005)
    assert max(agreeing(design, np.array([0.5, 0.0, -0.3, 0.2, 0.0, 0.0])).events) >= 4
    # a load that drives back; a torque source; a start from rest without friction
    design = changed(bare_drive(UNEVEN, LONG), load={"path": "back-drivable"})
    assert sum(agreeing(design, 0.6 * np.sin(np.arange(24.0)), 60.0).events) >= 1
    motor = Motor(rotor_inertia_kgm2=AMBER.motor.rotor_inertia_kgm2, source_gain_Nm_V=0.1)
    design = changed(bare_drive(UNEVEN, LONG), motor=motor, controller={"current": None})
    assert max(agreeing(design, 0.5 * np.sin(0.9 * np.arange(60.0)), w=5.0, part=0.3).events) >= 2
    agreeing(bare_drive(Friction(), 1e-4), np.sin(0.3 * np.arange(100.0)))


def test_breakaway_at_the_edge_of_a_tick() -> None:
    design = bare_drive(DRY, 1e-4)
    m, Ts = design.motor, 1e-4
    reached = 1.0 - exp(-Ts * m.resistance_ohm / m.inductance_H)
    edge = DRY.dry_torque_Nm * m.resistance_ohm / (m.torque_constant_Nm_A * reached)
    for u in np.nextafter(edge, [0.0, edge, 1.0]):
        assert sum(agreeing(design, np.full(30, u)).events) >= 1


def test_friction_above_the_stall_torque_never_moves_and_a_coasting_drive_comes_to_rest() -> None:
    run = run_plant(bare_drive(Friction(dry_torque_Nm=2.0), 1e-4), np.full(2000, 12.0))
    assert run.states[-1, 0] == pytest.approx(12.0 / 0.055, rel=1e-12)  # stall current, 1.29 N m
    assert not run.states[:, 1:].any()
    assert sum(run.events) == 0
    run = run_plant(bare_drive(DRY, 1e-4), np.zeros(3000), start=(0.0, 300.0, 0.0, 0.0, 0.0))
    assert run.states[-1, 1] == 0.0
    assert np.ptp(run.states[-100:, 3]) == 0.0
    assert sum(run.events) == 1


TICKS = np.arange(24)
SQUARE = 4.0 * np.sign(np.sin(2 * np.pi * TICKS / 13 + 0.3))
WAVE = 0.5 * np.sin(TICKS / 5)
LOAD = {"dry_torque_Nm": 0.3, "viscous_Nms_rad": 1e-3, "breakaway_ratio": 1.2, "offset_torque_Nm": 0.02}
CURVE = stribeck((0, 0.06), (5, 0.02), (40, 0.03), (80, 0.05))
BACKWARD = stribeck((0, 0.03), (30, 0.01), direction="reverse")
ONE_SIDED = BACKWARD + stribeck((0, 0.06), (5, 0.02), direction="forward")
TIGHT, BY_LOAD = {"play_rad": 0.0}, {"load_coefficient": 0.13}
MAPPED = {"points": CURVE, "load_coefficient": 0.01}
HARD = {  # what `random_drive` draws seldom or never
    "play, damped beyond its critical value": ({"coupling": {"damping_Nms_rad": 0.6}}, 0.0),
    "bilateral": ({"coupling": TIGHT}, 0.0),
    "friction follows the sign of T_s": (
        {"coupling": TIGHT, "friction": {"load_coefficient": 0.03, "dry_torque_Nm": 0.01}},
        WAVE,
    ),
    "self-locking, bilateral": ({"path": "self-locking", "friction": BY_LOAD, "coupling": TIGHT}, WAVE),
    "Stribeck map": ({"friction": {"points": CURVE}, "load_friction": LOAD}, WAVE),
    "map of each side": ({"friction": {"points": ONE_SIDED, "load_coefficient": 0.01}}, WAVE),
    "rigid drive with a map": ({"coupling": None, "friction": MAPPED}, WAVE),
    "rigid and self-locking with a map": (
        {"coupling": None, "path": "self-locking", "friction": {**MAPPED, "load_coefficient": 0.2}},
        WAVE,
    ),
}


@pytest.mark.parametrize(
    ("source", "fraction"), [(False, 0.37), (True, 0.0)], ids=["R-L, split tick", "source"]
)
@pytest.mark.parametrize("name", HARD)
def test_hard_case(name: str, source: bool, fraction: float) -> None:
    parts, moment = HARD[name]
    voltages = 0.1 * SQUARE if source else SQUARE
    run = agreeing(two_mass(1e-3, source=source, **parts), voltages, moment, part=fraction)
    assert sum(run.events) > 0 or name == "bilateral"


@pytest.mark.parametrize("seed", range(8))
def test_random_drive(seed: int) -> None:
    design, voltages, moments, fraction_s = random_drive(seed)
    assert sum(agreeing(design, voltages, moments, part=fraction_s / design.controller.period_s).events) > 0


SINES = ((0.3, 2.0), (0.02, 15.0), (1e-3, 70.0))  # rad, Hz
PIECE_TICKS, PIECES = 100, 10


def drive_of(design: Design, size_rad: float, frequency_Hz: float) -> Running:
    rows = Rows.of(design)
    rows.sine("command", size_rad, frequency_Hz)
    return rows.running()


def events_of_agreeing(design: Design) -> float:
    """Events of runs in one go, after they had the bits of runs tick by tick, which look at every guard."""
    events = 0.0
    for sine in SINES:
        at_once, by_ticks = drive_of(design, *sine), drive_of(design, *sine)
        for _ in range(PIECES):
            at_once.run(PIECE_TICKS)
            for _ in range(PIECE_TICKS):
                by_ticks.run(1)
            assert at_once.s[at_once.matter].tolist() == by_ticks.s[by_ticks.matter].tolist()
            assert at_once.happened == by_ticks.happened
        events += at_once.happened[0]
    return events


def test_guards_of_shipped_and_random_drives() -> None:
    for name in ("ilr33-amber-compliant", "joint", "ballscrew", "fin"):
        assert events_of_agreeing(load_design(name)) > 0, name
    assert sum(events_of_agreeing(random_drive(seed)[0]) for seed in range(40)) > 10_000


K, J_M, J_L, N, B = 200.0, 2e-5, 1e-3, 10.0, 0.01
REDUCED = 1.0 / (1.0 / J_L + 1.0 / (J_M * N * N))  # inertia of the relative motion
RESONANCE = np.sqrt(K / REDUCED)
IDEAL = {"damping_Nms_rad": 0.0}


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
    assert not run.states[:5, 4].any()  # a free load in the play does not turn, not even by rounding
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
    assert run.balances[90, layout.ENERGY_DAMPING :][:2] == pytest.approx([damped, parting], rel=1e-10)
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
    """The short way and the balance's way walk the same segments differently."""
    design, voltages, moments, fraction = random_drive(seed)
    run = run_plant(design, voltages, moments, fraction_s=fraction, WITH_ENERGY=1.0)
    assert run.status == layout.OK
    e = run.balances
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


RATIOS = {"planetary": 66, "worm": 36, "chain": 2}
CHAIN = {
    "gear": [{"name": name, "ratio": ratio} for name, ratio in RATIOS.items()],
    "coupling": {"stiffness": "50 N*m/rad", "damping": "0.3 N*m*s/rad", "after": "worm"},
    "load.inertia": "4e-3 kg*m^2",
}


def steering(**changes: str) -> Design:
    return with_overrides(AMBER, {**CHAIN, "load.locking_gear": "worm", **changes})


def test_a_worm_before_a_chain_is_accepted_and_the_last_gear_is_meant_where_nothing_is_said() -> None:
    design = steering()
    assert (design.ratio_to_coupling, design.ratio_behind_coupling) == (2376.0, 2.0)
    again = read_design_text(write_design(design), design.origin)
    assert again == design
    assert design_hash(again) == design_hash(design)
    for wrong, words in (
        ({}, "coupling.after.*before the self-locking stage; allowed: chain"),
        ({"load.locking_gear": "chain"}, "before the self-locking stage"),
        ({"load.locking_gear": "bevel"}, "load.locking_gear.*is no gear; allowed: planetary, worm, chain"),
        ({"load.locking_gear": "worm", "friction.load_coefficient": 0.9 / 4752}, "gives energy"),
        ({"load.locking_gear": "worm", "load.path": "back-drivable"}, "load.locking_gear = .*self-locking"),
    ):
        refused(with_overrides, AMBER, {**CHAIN, **wrong}, match=words)


@pytest.mark.parametrize(("load_Nm", "point"), [(4.0, "driving"), (-4.0, "driven")])
def test_the_motor_feels_the_load_as_friction_only(load_Nm: float, point: str) -> None:
    """At a constant speed T_s = -M/N_r, and kM i = C0 + CM N_r |T_s| + Cv w = C0 + CM |M| + Cv w."""
    # the linear one has dw/dt = ... -+ CM N_r k twist/J_m, by the side on which the coupling is pressed
    design, rate = steering(), radians(5.0)
    run = simulate(design, commands.ramp(rate_rad_s=rate), 1.0, load_Nm=load_Nm)
    friction, kM = design.friction, design.motor.torque_constant_Nm_A
    w, CM = rate * design.total_ratio, friction.load_coefficient
    wanted = (friction.dry_torque_Nm + CM * 4.0 + friction.viscous_Nms_rad * w) / kM
    assert np.mean(run.current_A[int(0.8 * len(run.time_s)) :]) == pytest.approx(wanted, rel=1e-6)
    twist = run.motor_angle_rad[-1] / 2376.0 - 2.0 * run.output_angle_rad[-1]
    assert twist == pytest.approx(-load_Nm / 2.0 / 50.0, rel=1e-6)
    system = plant(design, "ideal", operating_point=point)
    entry = system.A[system.state_labels.index("w"), system.state_labels.index("twist")]
    felt = np.sign(load_Nm) * CM * 2.0 * 50.0 / design.motor_side_inertia_kgm2
    assert entry == pytest.approx(-felt, rel=1e-12)


TICK = 1e-3
TIME = np.arange(0.0, 1.0, TICK)
BUS = 10.0 - 4.0 * TIME + 2.0 * np.sin(9.0 * TIME)


def _integrator(position: PositionLoop | None) -> Design:
    """An ideal torque source on an inertia without friction: w' = gain u / J."""
    return replace(
        AMBER, motor=Motor(rotor_inertia_kgm2=1e-4, source_gain_Nm_V=0.002), friction=Friction(),
        controller=Controller(period_s=TICK, computing_delay_s=0.0, position=position),
        limits=Limits(voltage_V=10.0), requirements=(),
    )  # fmt: skip


def test_the_bus_limits_the_voltage_at_each_tick_and_a_constant_one_changes_nothing() -> None:
    design = _integrator(None)
    wanted = 9.0 * np.sin(6.0 * TIME)
    run = simulate(design, commands.sampled(TIME, wanted), 1.0, supply=commands.sampled(TIME, BUS))
    applied = np.clip(wanted, -BUS, BUS)
    assert np.any(applied != wanted)
    np.testing.assert_allclose(run.voltage_V, applied, rtol=0, atol=1e-12)
    step = design.effective_motor.source_gain_Nm_V * TICK / design.inertia_kgm2  # of a volt over a tick
    speed = np.concatenate([[0.0], step * np.cumsum(applied)[:-1]])
    np.testing.assert_allclose(run.motor_speed_rad_s, speed, atol=1e-9)
    assert run.limits["voltage"].fraction == pytest.approx(np.mean(applied != wanted))
    command, nominal = commands.step(0.05), commands.sampled([0.0, 0.1], [AMBER.limits.voltage_V] * 2)
    plain, supplied = simulate(AMBER, command, 0.1), simulate(AMBER, command, 0.1, supply=nominal)
    np.testing.assert_array_equal(plain.output_angle_rad, supplied.output_angle_rad)
    np.testing.assert_array_equal(plain.limit_flags, supplied.limit_flags)


def test_a_duty_ratio_is_scaled_by_the_bus_between_the_loop_s_updates_too() -> None:
    """u = gain e held over four ticks, limited by the nominal 10 V; the motor has u U(t)/10 V each tick."""
    design = _integrator(PositionLoop(gain=0.5, every=4))
    command = commands.step(30.0 / design.total_ratio)
    run = simulate(design, command, 1.0, supply=commands.sampled(TIME, BUS), supply_scales=True)
    angle = speed = held = 0.0
    a = design.effective_motor.source_gain_Nm_V / design.inertia_kgm2
    expected = np.empty(len(TIME))
    for k, bus in enumerate(BUS):
        if k % 4 == 0:
            held = float(np.clip(0.5 * (30.0 - angle), -10.0, 10.0))
        u = expected[k] = held * bus / 10.0
        angle += TICK * speed + 0.5 * TICK**2 * a * u
        speed += TICK * a * u
    assert run.limits["voltage"].fraction > 0.0
    np.testing.assert_allclose(run.voltage_V, expected, rtol=0, atol=1e-9)
    assert run.final.motor_angle_rad == pytest.approx(angle, rel=1e-9)
    series = commands.sampled([0.0, 0.1], [12.0, 11.0])
    with pytest.raises(InputError, match="without a current loop"):
        simulate(AMBER, commands.hold(0.0), 0.1, supply=series, supply_scales=True)
    for negative in (commands.sampled([0.0, 0.1], [12.0, -1.0]), commands.sine(12.0, 1.0)):
        refused(simulate, AMBER, commands.hold(0.0), 0.1, supply=negative, words="voltages of 0 or more")
