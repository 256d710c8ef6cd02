"""Published: Janot, Gautier, Brunot 2019 (EMPS), to the printed digits."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from actuator_lti.errors import InputError, NumericalError
from analyses.identification.dynamic import identify_dynamics
from analyses.identification.emps import EmpsRecord, load_emps


@pytest.fixture(scope="module")
def emps(emps_file: Path) -> EmpsRecord:
    return load_emps(emps_file)


def test_every_row_of_the_record_is_accounted_for(emps: EmpsRecord) -> None:
    assert emps.record.counts.rows_in == emps.record.counts.rows_out == 24841


def test_symmetric_friction_meets_the_published_digits(emps: EmpsRecord) -> None:
    model = identify_dynamics(emps.position_m, emps.force_N, emps.period_s)
    assert [f"{v:.4f}" for v in model.values] == ["95.1089", "203.5034", "20.3935", "-3.1648"]
    assert [f"{s:.4f}" for s in model.standard_errors] == ["0.1085", "1.1460", "0.1012", "0.0444"]
    assert f"{100 * model.relative_residual:.4f}" == "4.0834"


def test_friction_per_direction_meets_the_published_digits(emps: EmpsRecord) -> None:
    model = identify_dynamics(emps.position_m, emps.force_N, emps.period_s, form="per-direction")
    assert [f"{v:.4f}" for v in model.values] == ["95.1540", "166.7061", "20.1440", "240.4236", "20.6277"]
    assert f"{100 * model.relative_residual:.4f}" == "3.1117"


@pytest.mark.parametrize(
    ("delay_s", "phase_deg", "gain_db", "frequency_rad_s"),
    [(0.0, 34.84, 21.34, 988.0), (1e-3, 26.61, 14.57, 539.0)],
)
def test_the_shipped_design_has_the_published_values_and_their_margins(
    delay_s: float, phase_deg: float, gain_db: float, frequency_rad_s: float
) -> None:
    """The linear loop of the published values, broken at the plant input, recomputed independently."""
    from actuator_lti import assemble_loops, load_design, stability_margins
    from actuator_lti.design import with_values

    design = with_values(load_design("emps"), {"control.computing_delay": delay_s})
    assert (design.motor.rotor_inertia_kgm2, design.friction.viscous_Nms_rad) == (95.1089, 203.5034)
    loop = assemble_loops(design, operating_point="sliding").break_points["u"]
    margins = stability_margins(loop.open_loop)
    assert margins.phase_margin_deg == pytest.approx(phase_deg, abs=0.005)
    assert margins.gain_margin_db == pytest.approx(gain_db, abs=0.005)
    assert any(m.frequency_rad_s == pytest.approx(frequency_rad_s, abs=0.5) for m in margins.gain_margins)


def _motion(seconds: float = 6.0) -> tuple[np.ndarray, np.ndarray, float]:
    period = 1e-3
    time = np.arange(0.0, seconds, period)
    position = 0.1 * np.sin(3.0 * time) + 0.03 * np.sin(7.0 * time)
    velocity = 0.3 * np.cos(3.0 * time) + 0.21 * np.cos(7.0 * time)
    acceleration = -0.9 * np.sin(3.0 * time) - 1.47 * np.sin(7.0 * time)
    drive = 5.0 * acceleration + 2.0 * velocity + 0.7 * np.sign(velocity) + 0.1
    return position, drive, period


def test_a_known_system_is_found_again() -> None:
    model = identify_dynamics(*_motion())
    assert model["inertia"] == pytest.approx(5.0, rel=2e-3)
    assert model["viscous"] == pytest.approx(2.0, rel=2e-2)
    assert model["dry"] == pytest.approx(0.7, rel=2e-2)
    assert model["offset"] == pytest.approx(0.1, abs=1e-2)


def test_a_motion_that_does_not_excite_is_refused_with_advice() -> None:
    time = np.arange(0.0, 2.0, 1e-3)
    with pytest.raises(NumericalError, match="several speeds"):
        identify_dynamics(0.1 * time, np.ones_like(time), 1e-3)


def test_signals_of_different_length_are_refused() -> None:
    with pytest.raises(InputError, match="shapes"):
        identify_dynamics(np.zeros(500), np.zeros(499), 1e-3)
