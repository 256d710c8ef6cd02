"""Records of one drive at several settings: one fit, each record with its own gain and load."""

from pathlib import Path

import numpy as np
import pytest

from actuator_lti.design import load_design, parameter_value, write_design
from analyses.records.open_record import open_records
from nonlinear import commands, simulate
from reports.document import load as load_document
from tests.identification.bench_records import columns_of, motion, write

SHARED = """
time = { column = "time_s" }
signals.reference = { column = "reference_deg", unit = "deg" }
signals.angle = { column = "motor_angle_rad", unit = "rad" }
signals.current = { column = "current_A", unit = "A" }
"""
GAINS, INERTIAS = (60.0, 80.0, 100.0, 120.0), (2e-4, 0.9)


@pytest.fixture(scope="module")
def sixteen(tmp_path_factory) -> Path:
    """Four gains, two known inertias at the output (of up to 70 % of the whole), two motions of each."""
    folder, text = tmp_path_factory.mktemp("sixteen"), SHARED
    for gain in GAINS:
        for inertia in INERTIAS:
            set_to = {"control.position.gain": gain, "load.inertia": inertia}
            drive = load_design("ilr33-amber").with_values(set_to)
            files = [f"{gain:g}_{inertia:g}_{seed}.csv" for seed in (1, 2)]
            for seed, file in enumerate(files):
                write(folder / file, columns_of(motion(seed, design=drive), seed))
            text += f'\n[[record]]\nfile = ["{files[0]}", "{files[1]}"]\n'
            text += f'settings.control.position.gain = "{gain} 1/s"\nsettings."load.inertia" = {inertia}\n'
    (folder / "runs.toml").write_text(text)
    return folder / "runs.toml"


def test_sixteen_records_of_four_gains_are_one_fit(sixteen, cli, tmp_path) -> None:
    """The inertia at the output is known of each: what is found is the motor's own, from all sixteen."""
    design = load_design("ilr33-amber")
    model = cli.data("identify", sixteen, "--design", "ilr33-amber")["model"]
    assert len(model["records"]) == 16
    truth = {"inertia": design.inertia_kgm2, "viscous": design.friction.viscous(1)}
    for name, value in truth.items():
        found = model["parameters"][name]
        assert abs(found["value"] - value) < 4.0 * found["standard_error"] + 1e-3 * value, name
    records = open_records(sixteen)
    assert [record.settings["load.inertia"] for record in records] == [*np.repeat(INERTIAS, 2)] * 4
    records = cli.data("correlate", "ilr33-amber", sixteen, "--error-limit", "3")["records"]
    told = [note for record in records for note in record["notes"]]
    assert [told.count(f"set: control.position.gain = {gain} 1/s") for gain in GAINS] == [4] * 4
    plain = sixteen.with_name("plain.toml")
    plain.write_text(SHARED + f'file = "{GAINS[0]:g}_{INERTIAS[0]:g}_1.csv"\n')
    assert cli("correlate", "ilr33-amber", plain, "--error-limit", "3").status == 1


def test_a_drive_on_a_voltage_is_refined_over_its_gains(tmp_path, cli) -> None:
    """A P position loop sets the voltage, which no column holds: it is the gain times a difference of two."""
    drive = load_design("ctms-motor-position")
    text = 'time = { column = "time_s" }\nsignals.reference = { column = "reference_rad", unit = "rad" }\n'
    text += 'signals.angle = { column = "angle_rad", unit = "rad" }\n'
    for k, gain in enumerate((0.6, 1.0, 1.6, 2.4)):
        command_to = commands.multisine(1.0, [0.7, 1.9, 4.3], 4.0, 1e-3, seed=k)
        run = simulate(drive.with_values({"control.position.gain": gain}), command_to, 4.0)
        noise = 1e-4 * np.random.default_rng(k).standard_normal(len(run.time_s))
        angle = run.motor_angle_rad + noise
        columns = {"time_s": run.time_s, "reference_rad": run.reference_rad, "angle_rad": angle}
        write(tmp_path / f"{k}.csv", columns)
        text += f'[[record]]\nfile = "{k}.csv"\nsettings."control.position.gain" = {gain}\n'
        text += f'signals.voltage = {{ column = "reference_rad - angle_rad", unit = "V", scale = {gain} }}\n'
    (tmp_path / "runs.toml").write_text(text)
    words = ("identify", tmp_path / "runs.toml", "--design", "ctms-motor-position", "--refine")
    result = cli.data(*words, "--out", tmp_path / "o")
    first = load_document(tmp_path / "o" / "identification.json")["sections"][0]["result"]
    assert first.startswith("Refined by simulation: motor.rotor_inertia 3.228")
    found = result["refined"]["parameters"]
    made = load_design(tmp_path / "o" / "ctms-motor-position-identified.toml")
    for key in ("motor.rotor_inertia", "friction.viscous"):
        value, error = found[key]["value"], found[key]["standard_error"]
        assert abs(value - parameter_value(drive, key)) < 4.0 * error < 0.01 * value
        assert parameter_value(made, key) == pytest.approx(value)


@pytest.mark.parametrize(
    ("settings", "reason"),
    [
        ('"control.position.gain" = "90 kg"', "settings: control.position.gain"),
        ('"control.position.gian" = "90 1/s"', "settings: control.position.gian"),
        (
            '"friction.viscous" = "1e-6 N*m*s/rad"',
            "is found from all records; allowed: any other key, or --fix",
        ),
        ('"control.position.gain" = [1]', "a key of the design with its value is wanted"),
    ],
)
def test_a_setting_that_cannot_be_is_refused(settings: str, reason: str, sixteen: Path, cli) -> None:
    file = sixteen.with_name("wrong.toml")
    file.write_text(f'{SHARED}\nfile = "{GAINS[0]:g}_{INERTIAS[0]:g}_1.csv"\n[settings]\n{settings}\n')
    err = cli.refused("identify", file, "--design", "ilr33-amber")
    assert reason in err
    assert "wrong.toml" in err or ".csv" in err


def test_a_design_in_the_place_of_a_record_is_named(sixteen, cli) -> None:
    file = sixteen.with_name("my.toml")
    file.write_text(write_design(load_design("ilr33-amber")))
    for words in (("correlate", "ilr33-amber", file), ("identify", sixteen, file)):
        status, _, err = cli(*words)
        assert status == 2
        assert "my.toml: a design, and no record; allowed: CSV" in err
        assert "correlate takes the design first, identify behind --design" in err
    status, _, err = cli("correlate", sixteen.with_name("60_0.0002_1.csv"), file)
    assert status == 2
    assert "a table of numbers, TOML is wanted: a record, and no design?" in err
