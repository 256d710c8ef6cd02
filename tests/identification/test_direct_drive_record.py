"""A gimbal: its inductance takes more voltage than its back-EMF, and no record is wrong for it."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.identification.bench_records import Command

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
def test_its_own_record_fits_and_a_factor_of_ten_does_not(
    tmp_path: Path, command: Command, resistance: str, status: int
) -> None:
    """The record is the simulator's; u = R i + L di/dt + kE w holds in it."""
    design, record = tmp_path / "gimbal.toml", tmp_path / "run.csv"
    design.write_text(GIMBAL)
    words = ("--command", "chirp", "--to", 20, "--duration", 2, "--amplitude", 3, "--csv", record)
    assert command("simulate", design, *words, "--every", 4, "--quiet").status == 0
    design.write_text(GIMBAL.replace('"2.6 ohm"', f'"{resistance}"'))
    ran = command("correlate", design, record, "--quiet")
    assert ran.status == status
    assert ("R i counts" in ran.out) == bool(status)
