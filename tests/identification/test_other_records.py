"""Published: Janot, Gautier, Brunot 2019 (EMPS), to the printed digits; and a gimbal of large inductance."""

import numpy as np
import pytest

from actuator_lti import load_design
from analyses.identification.inverse import fit_records
from analyses.records.open_record import open_record


def test_friction_meets_the_published_digits(emps_file) -> None:
    """Standard errors: those of white residuals, as published; `covariance` counts their correlation."""
    emps = open_record(emps_file)
    model, other = (
        fit_records(load_design("emps"), [emps], form=form) for form in ("symmetric", "per-direction")
    )
    assert [f"{v:.4f}" for v in model.values] == ["95.1089", "203.5034", "20.3935", "-3.1648"]
    assert [f"{v:.4f}" for v in model.white_errors] == ["0.1085", "1.1460", "0.1012", "0.0444"]
    assert (np.diag(model.covariance) > model.white_errors**2).all()
    assert [f"{v:.4f}" for v in other.values] == ["95.1540", "166.7061", "20.1440", "240.4236", "20.6277"]
    assert [f"{100 * one.relative_residual:.4f}" for one in (model, other)] == ["4.0834", "3.1117"]
    assert emps.counts.rows_in == emps.counts.rows_out == 24841


@pytest.mark.parametrize(
    ("delay_s", "phase_deg", "gain_db", "frequency_rad_s"),
    [(0.0, 34.84, 21.34, 988.0), (1e-3, 26.61, 14.57, 539.0)],
)
def test_the_shipped_design_is_the_published_one(delay_s, phase_deg, gain_db, frequency_rad_s) -> None:
    """The linear loop of the published values, broken at the plant input, recomputed independently."""
    from actuator_lti import assemble_loops, stability_margins
    from actuator_lti.design import with_values

    design = with_values(load_design("emps"), {"control.computing_delay": delay_s})
    assert (design.motor.rotor_inertia_kgm2, design.friction.viscous_Nms_rad) == (95.1089, 203.5034)
    loop = assemble_loops(design, operating_point="sliding").break_points["u"]
    margins = stability_margins(loop.open_loop)
    assert margins.phase_margin_deg == pytest.approx(phase_deg, abs=0.005)
    assert margins.gain_margin_db == pytest.approx(gain_db, abs=0.005)
    assert any(m.frequency_rad_s == pytest.approx(frequency_rad_s, abs=0.5) for m in margins.gain_margins)


GIMBAL = """
[design]
name = "gimbal"
[motor]
resistance = "2.6 ohm"
inductance = "2.2 mH"
torque_constant = "0.45 N*m/A"
back_emf_constant = "0.45 V*s/rad"
rotor_inertia = "1.2e-3 kg*m^2"
[load]
inertia = "0.045 kg*m^2"
path = "back-drivable"
moment_max = "1.5 N*m"
[friction]
dry_torque = "10 mN*m"
viscous = "5e-4 N*m*s/rad"
[limits]
voltage = "28 V"
speed = "20 rad/s"
peak_current = "8 A"
[control]
period = "50 us"
computing_delay = "50 us"
[control.current]
gain = "1.5 V/A"
integral_time = "0.8 ms"
[control.velocity]
gain = "8 A*s/rad"
integral_time = "60 ms"
every = 4
[control.position]
gain = "18 1/s"
every = 4
[validation]
full_deflection = "10 deg"
"""


@pytest.mark.parametrize(("resistance", "status"), [("2.6 ohm", 0), ("0.26 ohm", 1)])
def test_its_own_record_fits_and_a_factor_of_ten_does_not(tmp_path, cli, resistance, status) -> None:
    """The record is the simulator's; u = R i + L di/dt + kE w holds in it."""
    design, record = tmp_path / "gimbal.toml", tmp_path / "run.csv"
    design.write_text(GIMBAL)
    words = ("--command", "chirp", "--to", 20, "--duration", 2, "--amplitude", 3, "--csv", record)
    assert cli("simulate", design, *words, "--every", 4, "--quiet").status == 0
    design.write_text(GIMBAL.replace('"2.6 ohm"', f'"{resistance}"'))
    ran = cli("correlate", design, record, "--quiet")
    assert ran.status == status
    assert ("R i counts" in ran.out) == bool(status)
