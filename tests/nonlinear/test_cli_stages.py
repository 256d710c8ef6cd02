"""A drive without a position loop is commanded, judged and written in the unit of its outermost stage."""

import json
from math import exp, pi
from pathlib import Path

import numpy as np
import pytest

from reports.cli.main import main

VOLTAGE = """
[design]
name = "small"
[motor]
resistance = "12 ohm"
inductance = "0.3 mH"
torque_constant = "11 mN*m/A"
back_emf_constant = "11 mV*s/rad"
rotor_inertia = "1.2 g*cm^2"
[[gear]]
name = "g"
ratio = 64
[load]
inertia = "1e-4 kg*m^2"
path = "back-drivable"
[friction]
dry_torque = "0.2 mN*m"
[limits]
voltage = "12 V"
peak_current = "1 A"
[control]
period = "100 us"
computing_delay = "0 us"
"""
CURRENT = VOLTAGE + '[control.current]\ngain = "2 V/A"\nintegral_time = "0.2 ms"\n'
SPEED = CURRENT + '[control.velocity]\ngain = "10 mA*s/rad"\nintegral_time = "20 ms"\n'


def simulated(
    text: str, arguments: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> tuple[dict[str, object], np.ndarray]:
    """Summary and rows of a run of the drive that a design file holds."""
    (folder / "drive.toml").write_text(text)
    run = f"simulate {folder / 'drive.toml'} {arguments} --csv {folder / 'run.csv'} --json"
    assert main(run.split()) == 0
    rows = np.genfromtxt(folder / "run.csv", delimiter=",", names=True)
    return json.loads(capsys.readouterr().out), rows


def test_volts(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """At rest of the transient U = R i + kE w, with i from the dry friction."""
    facts, rows = simulated(VOLTAGE, "--amplitude 6 --duration 2", tmp_path, capsys)
    assert facts["commanded"] == "voltage"
    assert facts["status"] == "becomes steady"
    assert facts["largest_command_V"] == 6.0
    assert facts["largest_error_V"] == 0.0
    assert np.all(rows["voltage_reference_V"] == 6.0)
    speed = (6.0 - 12.0 * 0.2 / 11.0) / 11e-3
    assert rows["motor_speed_rad_s"][-1] == pytest.approx(speed, rel=1e-6)


def test_amperes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The back-EMF rises while the rotor speeds up: the PI lags behind its ramp by kE a Ti / Kp."""
    facts, rows = simulated(CURRENT, "--amplitude 0.1 --duration 0.01", tmp_path, capsys)
    assert facts["largest_error_A"] == pytest.approx(0.1)
    assert np.all(rows["current_reference_A"] == 0.1)
    lag = 11e-3 / (1.2e-7 + 1e-4 / 64**2) * 0.2e-3 / 2.0
    current = (0.1 + lag * 0.2e-3) / (1.0 + lag * 11e-3)
    assert rows["current_A"][-1] == pytest.approx(current, rel=1e-3)


def test_speed_settles_while_the_output_turns(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    facts, rows = simulated(SPEED, "--amplitude 90 --duration 3", tmp_path, capsys)
    assert facts["status"] == "becomes steady"
    assert np.all(rows["output_speed_reference_rad_s"] == pi / 2.0)
    assert rows["motor_speed_rad_s"][-1] == pytest.approx(64.0 * pi / 2.0, rel=1e-3)
    assert facts["largest_error_rad_s"] == pytest.approx(pi / 2.0, rel=0.2)


def test_a_speed_cut_on_its_way_is_followed_on(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """What a drive ends in is no matter of how long the run is: here less than J/(Kp kT), 1.3 ms."""
    facts, rows = simulated(SPEED, "--amplitude 90 --duration 0.001", tmp_path, capsys)
    assert 0.0 < rows["motor_speed_rad_s"][-1] < (1.0 - exp(-1.0)) * 64.0 * pi / 2.0
    assert facts["status"] == "becomes steady"


@pytest.mark.parametrize(
    ("text", "line"), [(VOLTAGE, "0.5 V"), (CURRENT, "0.5 A"), (SPEED, "0.5 deg/s")], ids=["V", "A", "deg/s"]
)
def test_words_have_the_unit(
    text: str, line: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "drive.toml").write_text(text)
    assert main(f"simulate {tmp_path / 'drive.toml'} --amplitude 0.5 --duration 0.1 --quiet".split()) == 0
    out = capsys.readouterr().out
    rows = [row.split() for row in out.splitlines()]
    assert ["largest", "command", *line.split()] in rows
    assert any(row[:2] == ["largest", "error"] and row[3:] == line.split()[1:] for row in rows)


@pytest.mark.parametrize(("text", "size"), [(VOLTAGE, 6), (CURRENT, 0.1), (SPEED, 90)])
def test_its_own_record_correlates_exactly(
    text: str, size: float, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A record of the same drive under the same command: the same run, to the last digits of the file."""
    simulated(text, f"--amplitude {size} --duration 0.3", tmp_path, capsys)
    arguments = f"correlate {tmp_path / 'drive.toml'} {tmp_path / 'run.csv'} --json"
    assert main(arguments.split()) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["passed"] is True
    assert all(one["relative_error"] < 1e-9 for one in data["records"][0]["signals"].values())
