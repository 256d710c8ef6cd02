"""The event-driven plant against an independent event-driven integration."""

import numpy as np
import pytest

from nonlinear._kernels import layout
from tests.nonlinear.elastic_drive import random_drive, run_plant, stribeck, two_mass
from tests.nonlinear.elastic_reference import reference

TICKS = np.arange(24)
SQUARE = 4.0 * np.sign(np.sin(2 * np.pi * TICKS / 13 + 0.3))
WAVE = 0.5 * np.sin(TICKS / 5)
FRICTION = {
    "dry_torque_Nm": 0.05,
    "dry_torque_reverse_Nm": 0.03,
    "viscous_Nms_rad": 1e-4,
    "load_coefficient": 0.02,
    "breakaway_ratio": 1.3,
    "offset_torque_Nm": 0.01,
}
LOAD = {
    "dry_torque_Nm": 0.3,
    "viscous_Nms_rad": 1e-3,
    "breakaway_ratio": 1.2,
    "offset_torque_Nm": 0.02,
}
CURVE = stribeck((0, 0.06), (5, 0.02), (40, 0.03), (80, 0.05))
ONE_SIDED = stribeck((0, 0.03), (30, 0.01), direction="reverse") + stribeck(
    (0, 0.06), (5, 0.02), direction="forward"
)
HARD = {
    "play and damping": ({}, 0.0),
    "play without damping": ({"coupling": {"damping_Nms_rad": 0.0}}, 0.0),
    "play, damped beyond its critical value": ({"coupling": {"damping_Nms_rad": 0.6}}, 0.0),
    "bilateral": ({"coupling": {"play_rad": 0.0}}, 0.0),
    "stick of both sides": ({"friction": FRICTION, "load_friction": LOAD}, 0.0),
    "friction follows the sign of T_s": (
        {"coupling": {"play_rad": 0.0}, "friction": {"load_coefficient": 0.03, "dry_torque_Nm": 0.01}},
        WAVE,
    ),
    "self-locking stage": (
        {
            "path": "self-locking",
            "friction": {"load_coefficient": 0.13, "dry_torque_Nm": 0.01},
            "load_friction": LOAD,
        },
        WAVE,
    ),
    "self-locking, bilateral": (
        {"path": "self-locking", "friction": {"load_coefficient": 0.13}, "coupling": {"play_rad": 0.0}},
        WAVE,
    ),
    "Stribeck map": ({"friction": {"points": CURVE}, "load_friction": LOAD}, WAVE),
    "map of each side": ({"friction": {"points": ONE_SIDED, "load_coefficient": 0.01}}, WAVE),
    "rigid drive with a map": (
        {"coupling": None, "friction": {"points": CURVE, "load_coefficient": 0.01}},
        WAVE,
    ),
    "rigid and self-locking with a map": (
        {"coupling": None, "path": "self-locking", "friction": {"points": CURVE, "load_coefficient": 0.2}},
        WAVE,
    ),
}
SEVERAL = two_mass(2e-2, coupling={"play_rad": 0.002})


@pytest.mark.parametrize(
    ("source", "fraction"), [(False, 0.37), (True, 0.0)], ids=["R-L, split tick", "source"]
)
@pytest.mark.parametrize("name", HARD)
def test_hard_case(name: str, source: bool, fraction: float) -> None:
    parts, moment = HARD[name]
    design = two_mass(1e-3, source=source, **parts)
    voltages = 0.1 * SQUARE if source else SQUARE
    run = run_plant(design, voltages, moment, fraction_s=fraction * 1e-3)
    expected = reference(design, voltages, moment, fraction_s=fraction * 1e-3)
    assert run.status == layout.OK
    assert sum(run.events) > 0 or name == "bilateral"
    assert_close(run.states, expected)


def test_play_crossed_several_times_in_a_tick() -> None:
    run = run_plant(SEVERAL, SQUARE[:10])
    assert max(run.events) >= 6
    assert_close(run.states, reference(SEVERAL, SQUARE[:10]))


@pytest.mark.parametrize("seed", range(8))
def test_random_drive(seed: int) -> None:
    design, voltages, moments, fraction = random_drive(seed)
    run = run_plant(design, voltages, moments, fraction_s=fraction)
    assert run.status == layout.OK
    assert_close(run.states, reference(design, voltages, moments, fraction_s=fraction))


def assert_close(states: np.ndarray, expected: np.ndarray) -> None:
    """To 1e-9 of the largest value of each state."""
    scale = np.abs(expected).max(axis=0)
    assert np.all(np.abs(states - expected) <= 1e-9 * scale)
