"""A position loop behind a spring, ideal form: its integrator is known, whatever eigenvalue rounding leaves.

The equations of the cascade in s, evaluated point by point, are the truth.
"""

import control
import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from actuator_lti import assemble_loops, stability_margins
from actuator_lti.bandwidth import peaks
from actuator_lti.design.model import Design
from actuator_lti.margins.loop import rational_loop
from actuator_lti.margins.poles import sorted_poles
from tests.loops.loop_designs import sprung

SLOPES = (-6000.0, -40.0, -1.0, -1e-3, 1e-3, 1.0)


def position_loop(design: Design, s: np.ndarray) -> np.ndarray:
    """Kv W(s)/s, W the closed velocity loop: (L i)' = u - R i - kE w, J w' = kM i - Cv w - k th, th' = w."""
    motor, law = design.effective_motor, design.controller
    k = -design.load.moment_slope_Nm_rad / design.total_ratio**2
    J, Cv, kM = design.inertia_kgm2, design.friction.viscous(1), motor.torque_constant_Nm_A
    kE = motor.back_emf_constant_Vs_rad
    Z = motor.inductance_H * s + motor.resistance_ohm
    w_per_i = kM * s / (J * s**2 + Cv * s + k)
    C_i = law.current.gain_V_A * (1 + 1 / (law.current.integral_time_s * s))
    i_per_u = 1 / (Z + kE * w_per_i)
    current = C_i * i_per_u / (1 + C_i * i_per_u)
    C_v = law.velocity.gain * (1 + 1 / (law.velocity.integral_time_s * s))
    velocity = C_v * current * w_per_i / (1 + C_v * current * w_per_i)
    return law.position.gain * velocity / s


def largest(values: object, low: float, high: float) -> float:
    """Largest value of a function of w, by a grid and a search between its neighbours."""
    grid = np.geomspace(low, high, 20_001)
    k = int(np.argmax(values(grid)))
    ends = np.log(grid[[max(k - 1, 0), min(k + 1, grid.size - 1)]])
    best = minimize_scalar(lambda x: -float(values(np.exp([x]))[0]), bounds=tuple(ends), method="bounded")
    return max(-float(best.fun), float(values(grid)[k]))


@pytest.mark.parametrize("slope", SLOPES)
def test_peaks_and_margins_of_the_ideal_position_loop(slope: float) -> None:
    design = sprung("ilr33-amber", slope)
    system = assemble_loops(design, form="ideal").position.open_loop
    assert sorted_poles(rational_loop(system).A, False).at_dc == 1
    found = peaks(system)
    S = largest(lambda w: np.abs(1 / (1 + position_loop(design, 1j * w))), 1e-3, 1e6)
    assert found.sensitivity_db == pytest.approx(20 * np.log10(S), abs=1e-6)
    T = largest(lambda w: np.abs(1 / (1 + 1 / position_loop(design, 1j * w))), 1e-6, 1e6)
    assert found.complementary_db == pytest.approx(max(20 * np.log10(T), 0.0), abs=1e-6)  # T(0) = 1
    m = stability_margins(system)
    assert m.stable is True
    crossover = m.phase_margin.frequency_rad_s
    L = complex(position_loop(design, np.array([1j * crossover]))[0])
    assert abs(L) == pytest.approx(1.0, rel=1e-7)
    assert m.phase_margin_deg == pytest.approx(np.degrees(np.angle(-L)), abs=1e-5)


def test_peaks_of_a_double_integrator_that_rounding_parts() -> None:
    """(s + 1)/s^2, from a matrix whose zeros rounding parts; v = w^2 of the peaks by hand."""
    system = control.StateSpace([[2.0, 2.0], [-2.0, -2.0]], [[1.0], [0.0]], [[1.0, 0.5]], 0.0)
    found = peaks(system)
    v = 3.0**0.5 - 1.0  # |T|^2 = (1 + v)/(1 - v + v^2)
    assert found.complementary_db == pytest.approx(10 * np.log10((1 + v) / (1 - v + v * v)), abs=1e-9)
    assert found.complementary_rad_s == pytest.approx(v**0.5, rel=1e-6)
    assert found.sensitivity_db == pytest.approx(10 * np.log10(4 / 3), abs=1e-9)  # v^2/(1 - v + v^2), v = 2
    assert found.sensitivity_rad_s == pytest.approx(2.0**0.5, rel=1e-6)
