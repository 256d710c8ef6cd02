"""Stick, slip, breakaway, contact against solve_ivp with event functions; guards are looked at where near."""

from dataclasses import replace
from math import exp
from typing import Any

import numpy as np
import pytest

from actuator_lti import load_design
from actuator_lti.design.model import Design, Friction, Limits, Motor
from nonlinear import Rows
from nonlinear._kernels import layout
from nonlinear.runs.running import Running
from tests.changed import changed
from tests.nonlinear.elastic_drive import random_drive, run_plant, stribeck, two_mass
from tests.nonlinear.elastic_reference import reference

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
FRICTION = {
    "dry_torque_Nm": 0.05, "dry_torque_reverse_Nm": 0.03, "viscous_Nms_rad": 1e-4, "load_coefficient": 0.02,
    "breakaway_ratio": 1.3, "offset_torque_Nm": 0.01,
}  # fmt: skip
LOAD = {"dry_torque_Nm": 0.3, "viscous_Nms_rad": 1e-3, "breakaway_ratio": 1.2, "offset_torque_Nm": 0.02}
CURVE = stribeck((0, 0.06), (5, 0.02), (40, 0.03), (80, 0.05))
BACKWARD = stribeck((0, 0.03), (30, 0.01), direction="reverse")
ONE_SIDED = BACKWARD + stribeck((0, 0.06), (5, 0.02), direction="forward")
TIGHT, BY_LOAD = {"play_rad": 0.0}, {"load_coefficient": 0.13}
MAPPED = {"points": CURVE, "load_coefficient": 0.01}
HARD = {
    "play and damping": ({}, 0.0),
    "play without damping": ({"coupling": {"damping_Nms_rad": 0.0}}, 0.0),
    "play, damped beyond its critical value": ({"coupling": {"damping_Nms_rad": 0.6}}, 0.0),
    "bilateral": ({"coupling": TIGHT}, 0.0),
    "stick of both sides": ({"friction": FRICTION, "load_friction": LOAD}, 0.0),
    "friction follows the sign of T_s": (
        {"coupling": TIGHT, "friction": {"load_coefficient": 0.03, "dry_torque_Nm": 0.01}},
        WAVE,
    ),
    "self-locking stage": (
        {"path": "self-locking", "friction": {**BY_LOAD, "dry_torque_Nm": 0.01}, "load_friction": LOAD},
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
    agreeing(design, voltages, moments, part=fraction_s / design.controller.period_s)


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
