"""Published: Janot, Gautier, Brunot 2019 (EMPS), to the printed digits; and a gimbal of large inductance."""

from pathlib import Path

import numpy as np
import pytest

from actuator_lti import load_design
from analyses.identification.inverse import fit_records
from analyses.records.open_record import open_record

GIMBAL = Path(__file__).parents[1] / "nonlinear" / "gimbal.toml"


def test_friction_meets_the_published_digits(emps_file) -> None:
    """Standard errors: those of white residuals, as published; `covariance` counts their correlation."""
    design, records = load_design("emps"), [open_record(emps_file)]
    model, other = (fit_records(design, records, form=form) for form in ("symmetric", "per-direction"))
    assert [f"{v:.4f}" for v in model.values] == ["95.1089", "203.5034", "20.3935", "-3.1648"]
    assert [f"{v:.4f}" for v in model.white_errors] == ["0.1085", "1.1460", "0.1012", "0.0444"]
    assert (np.diag(model.covariance) > model.white_errors**2).all()
    assert [f"{v:.4f}" for v in other.values] == ["95.1540", "166.7061", "20.1440", "240.4236", "20.6277"]
    assert [f"{100 * one.relative_residual:.4f}" for one in (model, other)] == ["4.0834", "3.1117"]
    assert (design.motor.rotor_inertia_kgm2, design.friction.viscous_Nms_rad) == (95.1089, 203.5034)
    assert records[0].counts.rows_in == records[0].counts.rows_out == 24841


@pytest.mark.parametrize(("changes", "status"), [((), 0), (("--set", "motor.resistance=0.3 ohm"), 1)])
def test_its_own_record_fits_and_a_factor_of_ten_does_not(tmp_path, cli, changes, status) -> None:
    """The record is the simulator's; u = R i + L di/dt + kE w holds in it."""
    words = ("--command", "chirp", "--to", 20, "--duration", 2, "--amplitude", 3, "--every", 4, "--quiet")
    cli.text("simulate", GIMBAL, *words, "--csv", tmp_path / "run.csv")
    said = cli.text("correlate", GIMBAL, tmp_path / "run.csv", *changes, "--quiet", status=status)
    assert ("R i counts" in said) == bool(status)
