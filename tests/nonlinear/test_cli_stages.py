"""A drive without a position loop is commanded, judged and written in the unit of its outermost stage."""

from math import exp, pi
from pathlib import Path

import numpy as np
import pytest

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


def written(text: str, folder: Path) -> Path:
    (folder / "drive.toml").write_text(text)
    return folder / "drive.toml"


def test_volts(run, tmp_path) -> None:
    """At rest of the transient U = R i + kE w, with i from the dry friction."""
    made = run(f"{written(VOLTAGE, tmp_path)} --amplitude 6 --duration 2")
    told = {
        "commanded": "voltage",
        "status": "becomes steady",
        "largest_command_V": 6.0,
        "largest_error_V": 0.0,
    }
    assert made.facts | told == made.facts
    assert np.all(made.rows["voltage_reference_V"] == 6.0)
    speed = (6.0 - 12.0 * 0.2 / 11.0) / 11e-3
    assert made.rows["motor_speed_rad_s"][-1] == pytest.approx(speed, rel=1e-6)


def test_amperes(run, tmp_path) -> None:
    """The back-EMF rises while the rotor speeds up: the PI lags behind its ramp by kE a Ti / Kp."""
    made = run(f"{written(CURRENT, tmp_path)} --amplitude 0.1 --duration 0.01")
    assert made.facts["largest_error_A"] == pytest.approx(0.1)
    assert np.all(made.rows["current_reference_A"] == 0.1)
    lag = 11e-3 / (1.2e-7 + 1e-4 / 64**2) * 0.2e-3 / 2.0
    current = (0.1 + lag * 0.2e-3) / (1.0 + lag * 11e-3)
    assert made.rows["current_A"][-1] == pytest.approx(current, rel=1e-3)


def test_speed_settles_while_the_output_turns_however_short_the_run_is(run, tmp_path) -> None:
    """What a drive ends in is no matter of how long the run is: cut at less than J/(Kp kT), 1.3 ms."""
    drive, wanted = written(SPEED, tmp_path), 64.0 * pi / 2.0
    made = run(f"{drive} --amplitude 90 --duration 3")
    assert made.facts["status"] == "becomes steady"
    assert np.all(made.rows["output_speed_reference_rad_s"] == pi / 2.0)
    assert made.rows["motor_speed_rad_s"][-1] == pytest.approx(wanted, rel=1e-3)
    assert made.facts["largest_error_rad_s"] == pytest.approx(pi / 2.0, rel=0.2)
    cut = run(f"{drive} --amplitude 90 --duration 0.001")
    assert 0.0 < cut.rows["motor_speed_rad_s"][-1] < (1.0 - exp(-1.0)) * wanted
    assert cut.facts["status"] == "becomes steady"


@pytest.mark.parametrize(("text", "unit"), [(VOLTAGE, "V"), (CURRENT, "A"), (SPEED, "deg/s")])
def test_words_have_the_unit(text: str, unit: str, tmp_path, cli) -> None:
    said = cli.text("simulate", written(text, tmp_path), "--amplitude", 0.5, "--duration", 0.1, "--quiet")
    rows = [row.split() for row in said.splitlines()]
    assert ["largest", "command", "0.5", unit] in rows
    assert any(row[:2] == ["largest", "error"] and row[3:] == [unit] for row in rows)


@pytest.mark.parametrize(
    ("text", "words", "most"),
    [
        (VOLTAGE, "--amplitude 6 --duration 0.3", 1e-9),
        (CURRENT, "--amplitude 0.1 --duration 0.3", 1e-9),
        (SPEED, "--amplitude 90 --duration 0.3", 1e-9),
        # a drive with friction that a load makes: without its load the record would not be met
        (
            "",
            "--command multisine --amplitude 0.5 --frequency 2 --to 6 --count 3 --duration 0.5 --load 1",
            1e-6,
        ),
    ],
)
def test_its_own_record_correlates(text: str, words: str, most: float, run, tmp_path, cli) -> None:
    """A record of the same drive under the same command: the same run, to the last digits of the file."""
    drive = written(text, tmp_path) if text else "ilr33-amber"
    if not text:
        rows = "".join(f"{0.01 * k},{np.sin(0.3 * k)}\n" for k in range(31))
        (tmp_path / "load.csv").write_text("t,M\n" + rows)
        words += f" --load-slope -5 --load-file {tmp_path / 'load.csv'}"
    assert run(f"{drive} {words}").status == 0
    data = cli.data("correlate", drive, tmp_path / "run.csv")
    assert data["passed"] is True
    errors = [one["relative_error"] for one in data["records"][0]["signals"].values()]
    assert len(errors) >= (1 if text else 3)
    assert max(errors) < most
