"""`actuator-lti simulate` from the command line."""

import json
from pathlib import Path

import numpy as np
import pyarrow.parquet
import pytest

from reports.cli.main import main


def test_json_and_files(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    files = {kind: tmp_path / f"run.{kind}" for kind in ("csv", "parquet", "svg")}
    status = main(
        f"simulate ilr33-amber --command sine --amplitude 5 --frequency 1 --duration 0.5 --load 4 --energy "
        f"--csv {files['csv']} --parquet {files['parquet']} --plot {files['svg']} --json".split()
    )
    assert status == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["limits"]["speed"]["fraction"] > 0.3
    assert facts["energy"]["relative_error"] < 1e-9
    rows = np.genfromtxt(files["csv"], delimiter=",", names=True)
    table = pyarrow.parquet.read_table(files["parquet"])
    assert rows.size == table.num_rows == facts["rows"] == 5000
    assert rows["output_angle_rad"].max() == facts["largest_output_rad"]
    assert np.array_equal(table["current_A"].to_numpy(), rows["current_A"])
    svg = files["svg"].read_text()
    assert "speed limit acts" in svg
    assert "limit acts" not in svg.replace("speed limit acts", "").replace("current limit acts", "")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("--command sine --frequency 5000", "below the Nyquist frequency"),
        ("--duration 0.00001", "at least one tick"),
        ("--duration nan", "finite"),
        ("--amplitude inf", "finite"),
        ("--command square", "must be one of"),
        ("--command recorded", "needs --record"),
        ("--every 0", "at least 1"),
        ("--duration 1e9", "ticks of one run; allowed"),
        ("--command stepped-sine --frequency 5 --to 20 --count 3 --duration 1", "takes 1.75 s"),
        ("--start 3 --duration 1", "the run ends at 1 s"),
        ("--start 1", "the run ends at 1 s"),
        ("--command sine --frequency 2 --cycles 3 --duration 1", "3 periods take 1.5 s"),
        ("--command step --cycles 3", "allowed with --command sine"),
    ],
)
def test_refusals(arguments: str, words: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate", "ilr33-amber", *arguments.split()]) == 2
    line = capsys.readouterr().err
    assert words in line
    assert line.count("\n") == 1


def test_record_with_a_hole(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "record.csv"
    times = [0.0, 0.1, 0.2, 0.5, 0.6]
    path.write_text("t,angle\n" + "".join(f"{t},{t}\n" for t in times))
    assert main(["simulate", "--record", str(path)]) == 2
    assert "hole in time from 0.2 s to 0.5 s" in capsys.readouterr().err
    path.write_text("t,angle\n" + "".join(f"{0.1 * k},{k / 10}\n" for k in range(11)))
    assert main(["simulate", "--record", str(path), "--duration", "1.5", "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert np.degrees(facts["final_output_rad"]) == pytest.approx(1.0, abs=1e-3)


def test_linear_axis_speaks_millimetres(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "run.csv"
    assert main(f"simulate emps --command ramp --amplitude 10 --csv {path} --json".split()) == 0
    assert json.loads(capsys.readouterr().out)["final_output_m"] == pytest.approx(0.01, rel=0.05)
    assert "output_angle_m,motor_angle_m,motor_speed_m_s" in path.read_text().splitlines()[0].replace('"', "")


@pytest.mark.parametrize("kind", ["hold", "triangle", "chirp", "stepped-sine", "multisine"])
def test_every_command(kind: str, capsys: pytest.CaptureFixture[str]) -> None:
    duration = 2.0 if kind == "stepped-sine" else 0.4  # 5 cycles of 5, 10 and 20 Hz: 1.75 s
    arguments = f"simulate --command {kind} --amplitude 0.2 --frequency 5 --to 20 --count 3"
    assert main(f"{arguments} --duration {duration} --bias-rate 5 --load-slope -20 --every 10".split()) == 0
    out = capsys.readouterr().out
    assert f"{1000 * duration:.0f} rows, status following" in out


def test_a_stepped_sine_runs_to_its_end(capsys: pytest.CaptureFixture[str]) -> None:
    arguments = "--command stepped-sine --frequency 5 --to 20 --count 3 --every 10"
    assert main(["simulate", *arguments.split()]) == 0
    out = capsys.readouterr().out
    assert "1750 rows, status comes to rest" in out
    assert " deg " in out


def test_a_sine_plays_the_periods_asked_for(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "run.csv"
    arguments = f"--command sine --frequency 4 --cycles 3 --start 0.1 --amplitude 1 --csv {path} --json"
    assert main(["simulate", *arguments.split()]) == 0
    assert json.loads(capsys.readouterr().out)["rows"] == round((0.1 + 3 / 4) / 1e-4)
    command = np.genfromtxt(path, delimiter=",", names=True)["reference_rad"]
    peaks = (command[1:-1] > command[:-2]) & (command[1:-1] >= command[2:])
    assert np.count_nonzero(peaks) == 3


def test_a_load_file_is_on_the_clock_of_the_record(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A record from 5 s on, held at zero, and a load from 5.5 s on, of the same clock: half a second late."""
    record, load, early = (tmp_path / name for name in ("record.csv", "load.csv", "early.csv"))
    record.write_text("t,deg\n" + "".join(f"{5.0 + 0.1 * k},0\n" for k in range(11)))
    load.write_text("t,Nm\n5.5,2\n5.6,2\n5.7,2\n")
    early.write_text("t,Nm\n0.5,2\n0.6,2\n0.7,2\n")
    path = tmp_path / "run.csv"
    assert main(f"simulate --record {record} --load-file {load} --csv {path} --json".split()) == 0
    rows = np.genfromtxt(path, delimiter=",", names=True)
    assert rows["load_Nm"][rows["time_s"] < 0.5 - 1e-6].tolist() == [0.0] * 5000
    assert np.all(rows["load_Nm"][rows["time_s"] > 0.5 + 1e-6] == 2.0)
    capsys.readouterr()
    assert main(f"simulate --record {record} --load-file {early}".split()) == 2
    assert "the run from 5 to 6 s on the record's clock: no load would act" in capsys.readouterr().err
    assert main(f"simulate --load-file {load}".split()) == 2
    assert "the run from 0 to 1 s: no load would act" in capsys.readouterr().err
