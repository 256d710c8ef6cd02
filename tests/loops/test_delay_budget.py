"""The delay budget sums to the loop's phase, and each item is what it says."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from loop_designs import amber, ctms_position, designs, emps

from actuator_lti import InputError, assemble_loops
from actuator_lti.design.model import Design
from actuator_lti.loops.delay_budget import delay_budget


@settings(max_examples=6)
@given(designs(), st.floats(0.01, 0.8))
def test_items_sum_to_the_phase_of_the_exact_loop(design: Design, fraction: float) -> None:
    loops = assemble_loops(design)
    for name, loop in loops.present.items():
        omega = fraction * np.pi / loop.period_s
        budget = delay_budget(design, name, omega)
        assert sum(budget.items.values()) == pytest.approx(budget.total_deg, abs=1e-9)
        exact = np.angle(loop.open_loop(np.exp(1j * omega * loop.period_s)), deg=True)
        assert (budget.total_deg - exact + 180) % 360 - 180 == pytest.approx(0, abs=1e-6)


def test_baseline_current_loop() -> None:
    """Of the current loop exactly: computing delay w d, hold w Ts/2, one more sample w Ts."""
    omega = 2737.0
    budget = delay_budget(amber(), "current", omega)
    assert budget.computing_delay_deg == pytest.approx(-np.degrees(omega * 1e-4), abs=1e-9)
    assert budget.hold_deg == pytest.approx(-np.degrees(omega * 0.5e-4), abs=1e-9)
    assert budget.one_more_sample_deg == pytest.approx(-np.degrees(omega * 1e-4), abs=1e-9)
    assert budget.controller_deg == pytest.approx(-np.degrees(np.arctan(1 / (omega * 150e-6))), abs=1e-9)
    assert budget.measurement_deg == 0
    assert budget.total_deg == pytest.approx(89.66 - 180, abs=0.02)


def test_measurement_of_the_emps() -> None:
    """A difference over two samples is one sample old."""
    budget = delay_budget(emps(), "velocity", 100.0)
    assert budget.measurement_deg == pytest.approx(-np.degrees(0.1), abs=1e-9)
    assert budget.controller_deg == 0
    assert budget.computing_delay_deg == pytest.approx(0, abs=1e-9)
    assert budget.one_more_sample_deg == pytest.approx(-np.degrees(0.1), abs=1e-6)


def test_a_long_delay_is_not_wrapped() -> None:
    omega = 0.9 * np.pi / 1e-3
    budget = delay_budget(ctms_position(delay_s=0.02), "position", omega)
    assert budget.computing_delay_deg == pytest.approx(-np.degrees(omega * 0.02), abs=1e-6)
    assert budget.total_deg < -3000


def test_refusals() -> None:
    with pytest.raises(InputError, match="one of position"):
        delay_budget(ctms_position(), "velocity", 10.0)
    with pytest.raises(InputError, match="Nyquist"):
        delay_budget(ctms_position(), "position", 1e4)
