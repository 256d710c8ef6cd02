"""Cross-check: the assembled sampled loops are section 2 of model.md run tick by tick."""

from __future__ import annotations

from dataclasses import replace

import control
import numpy as np
import pytest
from hypothesis import given, settings
from loop_designs import amber, designs, emps
from loop_recursion import run

from actuator_lti import assemble_loops
from actuator_lti.design.model import Design, Encoder


def worst(ours: np.ndarray, theirs: np.ndarray) -> float:
    return float(np.max(np.abs(ours - theirs)) / np.max(np.abs(theirs)))


def agree(design: Design, ticks: int, tolerance: float, torque: float = -2.25e-3) -> None:
    t = np.arange(ticks) * design.controller.period_s
    command = 0.3 * t + 0.002 * np.sin(2 * np.pi * 4 * t)
    start = (0.5, 40.0, 3.0) if design.motor.has_electrical_dynamics else (0.0, 0.02, 0.001)
    theirs = run(design, command, torque, start)
    system = assemble_loops(design).tick_system
    assert system is not None
    named = {name: v for name, v in zip(("i", "w", "th"), start, strict=True) if name in system.states}
    ours = system.respond(command, torque, system.initial_state(named))
    for name in ("th", "w", "u"):
        assert worst(ours[name], theirs[name]) < tolerance, name


@pytest.mark.parametrize("delay_ticks", [0.0, 0.5, 1.0, 1.5])
@pytest.mark.parametrize("rates", [(1, 1), (2, 10)])
def test_20000_ticks_for_every_delay_and_rate(delay_ticks: float, rates: tuple[int, int]) -> None:
    agree(amber(*rates, delay_s=delay_ticks * 1e-4), 20_000, 1e-10)


@pytest.mark.parametrize(
    "encoder",
    [
        Encoder(speed="difference"),
        Encoder(speed="difference", difference_samples=3),
        Encoder(speed="difference", difference_samples=2, filter_time_s=8e-4),
    ],
)
@pytest.mark.parametrize("rates", [(1, 1), (2, 10)])
def test_speed_estimates_and_feedforward(encoder: Encoder, rates: tuple[int, int]) -> None:
    agree(amber(*rates, delay_s=1.5e-4, feedforward=0.8, encoder=encoder), 4000, 1e-10)


def test_force_source_on_a_linear_axis() -> None:
    agree(emps(delay_s=5e-4), 4000, 1e-10, torque=-20.0)


@settings(max_examples=40)
@given(designs())
def test_any_design(design: Design) -> None:
    agree(design, 120, 1e-9)


@pytest.mark.parametrize("rates", [(1, 1), (2, 10)])
def test_lifted_system_in_forced_response(rates: tuple[int, int]) -> None:
    design = amber(*rates, delay_s=1.5e-4)
    system = assemble_loops(design).tick_system
    assert system is not None
    steps = 2000 // rates[1]
    command = np.repeat(0.01 * np.sin(np.arange(steps) / 20), rates[1])
    torque = -1e-3
    direct = system.respond(command, torque)
    lifted = system.lifted()
    inputs = np.vstack([command[:: rates[1]], np.full(steps, torque), np.zeros(steps)])
    answer = control.forced_response(lifted, np.arange(steps) * lifted.dt, inputs)
    stacked = answer.outputs.reshape(rates[1], len(system.outputs), steps).transpose(2, 0, 1)
    for r, name in enumerate(system.outputs):
        assert worst(stacked[:, :, r].reshape(-1), direct[name]) < 1e-11


def test_a_wrong_delay_is_noticed() -> None:
    """The gate has teeth: 1 % of a tick of delay more is far outside the tolerance."""
    design = amber()
    other = replace(design, controller=replace(design.controller, computing_delay_s=1.01e-4))
    command = 0.002 * np.sin(np.arange(2000) / 100)
    system = assemble_loops(other).tick_system
    assert system is not None
    assert worst(system.respond(command)["i"], run(design, command)["i"]) > 1e-6


def _fundamental(values: np.ndarray, z: complex) -> complex:
    return complex(np.sum(values * z ** -np.arange(len(values))))


@pytest.mark.parametrize(("point", "every"), [("u", 1), ("i_ref", 2), ("w_ref", 10)])
def test_a_response_analyser_on_the_multirate_drive_sees_the_break_point_loop(point: str, every: int) -> None:
    """Inject a sinusoid into the running cascade; fundamentals before and after give L = -before/after."""
    design = amber(2, 10, delay_s=1.5e-4)
    loop = assemble_loops(design).break_points[point]
    assert loop.periodic == (every < 10)
    assert loop.period_s == pytest.approx(every * 1e-4)
    window = 2000
    for cycles in (3, 17, 40) if point == "w_ref" else (3, 40, 130, 331):
        omega = 2 * np.pi * cycles / (window * 1e-4)
        d = np.cos(omega * 1e-4 * np.arange(4 * window))
        record = run(design, np.zeros(4 * window), inject={point: d})
        z = np.exp(1j * omega * every * 1e-4)
        before, after = (_fundamental(record[s][-window // every :], z) for s in ("before", "after"))
        assert loop.open_loop(z) == pytest.approx(-before / after, rel=1e-6)
        at_point = _fundamental(d[-window::every], z)
        assert loop.sensitivity(z) == pytest.approx(after / at_point, rel=1e-6)
