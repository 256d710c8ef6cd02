"""The formats that people have: one truth, written in many ways, reads the same."""

import json
from datetime import datetime, timedelta, timezone
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from scipy.io import savemat

from actuator_lti.errors import InputError
from analyses.records.open_record import open_record
from analyses.records.record import Record
from tests.identification.bench_records import record_of

TIME = np.arange(0.0, 2.0, 1e-2)
ANGLE = 3.0 * np.sin(5.0 * TIME)
CURRENT = 2.0 + np.cos(4.0 * TIME)
NAMES = ("t [ms]", "Motor angle [deg]", "I (mA)")
TABLE = np.column_stack([1e3 * TIME, np.degrees(ANGLE), 1e3 * CURRENT])


def _text(separator: str, decimal: str) -> str:
    rows = [separator.join(f"{v:.9f}" for v in row).replace(".", decimal) for row in TABLE]
    return "\n".join([separator.join(NAMES), *rows]) + "\n"


def _csv(path: Path, separator: str, decimal: str) -> Path:
    file = path / "r.csv"
    file.write_text(_text(separator, decimal))
    return file


def _parquet(path: Path) -> Path:
    file = path / "r.parquet"
    text = pa.array(["a"] * len(TIME))
    columns = [*(pa.array(TABLE[:, k]) for k in range(3)), text]
    pq.write_table(pa.table(columns, names=[*NAMES, "remark"]), file)
    return file


def _matrix(path: Path) -> Path:
    file = path / "r.mat"
    savemat(file, {"log": TABLE, "columns": np.array(NAMES, dtype=object), "Ts": 1e-2})
    return file


def _characters(path: Path) -> Path:
    file = path / "r.mat"
    savemat(file, {"log": TABLE, "names": list(NAMES)}, do_compression=True)
    return file


def _structure(path: Path) -> Path:
    savemat(path / "s.mat", {"d": {"t": TIME, "phi": np.degrees(ANGLE), "I": CURRENT}})
    (path / "r.toml").write_text(
        'file = "s.mat"\ntime = { column = "d.t" }\nsignals.angle = { column = "d.phi", unit = "deg" }\n'
        'signals.current = { column = "d.I", unit = "A" }\n'
    )
    return path / "r.toml"


def _structure_by_itself(path: Path) -> Path:
    named = {"t_ms": TABLE[:, 0], "motor_angle_deg": TABLE[:, 1], "i_mA": TABLE[:, 2]}
    savemat(path / "s.mat", {"d": named, "Ts": 1e-2})
    return path / "s.mat"


def _units_row(path: Path) -> Path:
    first, *rows = _text("\t", ",").splitlines()
    names = "\t".join(name.split(" [")[0].split(" (")[0] for name in first.split("\t"))
    (path / "r.txt").write_text("\n".join(["# made by hand", names, "[ms]\t[deg]\t[mA]", *rows]))
    return path / "r.txt"


def _stamps(path: Path) -> Path:
    """From the last second of a year in one zone on; the same instants in another zone from row 100 on."""
    made = ["Time;Motor angle [deg];I [mA];state"]
    for k, (t, angle, current) in enumerate(zip(TIME, TABLE[:, 1], TABLE[:, 2], strict=True)):
        at = datetime(2024, 12, 31, 23, 59, 59, tzinfo=timezone(timedelta(hours=1)))
        at = (at + timedelta(seconds=float(t))).astimezone(timezone(timedelta(hours=1 if k < 100 else 0)))
        made.append(f"{at.isoformat(sep='T' if k % 2 else ' ')};{angle:.9f};{current:.9f};on")
    (path / "r.csv").write_text("\n".join(made).replace(".", ","))
    return path / "r.csv"


def _parquet_stamps(path: Path) -> Path:
    stamps = pa.array(
        (1e9 * TIME).round().astype("int64") + 1_700_000_000_000_000_000, pa.timestamp("ns", "UTC")
    )
    table = pa.table([stamps, *(pa.array(TABLE[:, k]) for k in (1, 2))], names=["time", *NAMES[1:]])
    pq.write_table(table, path / "r.parquet")
    return path / "r.parquet"


def _json(path: Path, *, rows: bool) -> Path:
    tree: object = {"log": dict(zip(NAMES, TABLE.T.tolist(), strict=True)), "by": "hand"}
    if rows:
        tree = [dict(zip(NAMES, row, strict=True)) for row in TABLE.tolist()]
    (path / "r.json").write_text(json.dumps(tree))
    return path / "r.json"


def _sum(path: Path) -> Path:
    """A difference of two columns, with offset and scale; a column named like a sum is itself."""
    half = np.column_stack([TABLE[:, 0], TABLE[:, 1] + 7.0, 0.5 * TABLE[:, 2] - 3.0, np.full(len(TIME), 7.0)])
    rows = "\n".join(",".join(f"{v:.9f}" for v in row) for row in half)
    (path / "r.csv").write_text("t,a,i - 3,seven\n" + rows + "\n")
    (path / "r.toml").write_text(
        'file = "r.csv"\ntime = { column = "t", unit = "ms" }\n'
        'signals.angle = { column = "a - seven", unit = "deg" }\n'
        'signals.current = { column = "i - 3", unit = "mA", offset = 3.0, scale = 2.0 }\n'
    )
    return path / "r.toml"


def _named(path: Path) -> Path:
    savemat(path / "s.mat", {"X": TABLE})
    (path / "r.toml").write_text(
        'file = "s.mat"\nmatrix = "X"\nnames = ["a", "b", "c"]\ntime = { column = "a", unit = "ms" }\n'
        'signals.motor_angle = { column = "b", unit = "deg" }\n'
        'signals.current = { column = 3, unit = "mA" }\n'
    )
    return path / "r.toml"


FORMATS = {
    "comma": lambda path: _csv(path, ",", "."),
    "semicolon and decimal comma": lambda path: _csv(path, ";", ","),
    "semicolon and point": lambda path: _csv(path, ";", "."),
    "tab and decimal comma": lambda path: _csv(path, "\t", ","),
    "Parquet": _parquet,
    "a matrix with a cell of names": _matrix,
    "a matrix with a character array of names": _characters,
    "a structure": _structure,
    "a structure by itself": _structure_by_itself,
    "a row of units": _units_row,
    "time stamps": _stamps,
    "Parquet with time stamps": _parquet_stamps,
    "JSON by columns": lambda path: _json(path, rows=False),
    "JSON by rows": lambda path: _json(path, rows=True),
    "a difference of columns": _sum,
    "a matrix named by the record file": _named,
}


@pytest.mark.parametrize("form", FORMATS)
def test_one_record_in_many_formats(form: str, tmp_path) -> None:
    record = open_record(FORMATS[form](tmp_path))
    assert record.time_s == pytest.approx(TIME, abs=1e-9)
    assert record["angle"] == pytest.approx(ANGLE, abs=1e-9)
    assert record["current"] == pytest.approx(CURRENT, abs=1e-9)


@pytest.mark.parametrize(
    ("header", "signal", "factor"),
    [
        ("Speed [1/min]", "speed", np.pi / 30.0),
        ("n / U/min", "speed", np.pi / 30.0),
        ("omega in rad/s", "speed", 1.0),
        ("velocity [mm/s]", "velocity", 1e-3),
        ("Irms [A]", "current", np.sqrt(1.5)),
        ("motor current (Arms)", "current", np.sqrt(1.5)),
        ("Torque [N]", "load_force", 1.0),
        ("load_Nm", "torque", 1.0),
        ("U_DC [V]", "supply", 1.0),
        ("setpoint [rpm]", "speed_reference", np.pi / 30.0),
        ("cmd [A]", "current_reference", 1.0),
        ("cmd [deg]", "reference", np.pi / 180.0),
        ("cmd [mm]", "position_reference", 1e-3),
    ],
)
def test_units_in_the_header(header: str, signal: str, factor: float, tmp_path) -> None:
    (tmp_path / "r.csv").write_text(f"time_s;{header}\n" + "".join(f"{k / 10};{k}\n" for k in range(9)))
    record = open_record(tmp_path / "r.csv")
    assert set(record.signals) == {signal}
    assert record[signal] == pytest.approx(factor * np.arange(9.0))


@pytest.mark.parametrize(
    ("options", "factor"),
    [
        ("", 1.0),
        (', value = "rms"', np.sqrt(2.0)),
        (', between = "phase"', np.sqrt(3.0)),
        (', value = "rms", between = "phase"', np.sqrt(6.0)),
    ],
)
def test_rms_and_phase_voltages_become_those_of_the_equivalent_dc_motor(
    options: str, factor: float, tmp_path
) -> None:
    (tmp_path / "r.csv").write_text("t,u\n" + "".join(f"{k},{k}\n" for k in range(9)))
    (tmp_path / "r.toml").write_text(
        'file = "r.csv"\ntime = { column = "t" }\n'
        f'signals.voltage = {{ column = "u", unit = "V"{options} }}\n'
    )
    record = open_record(tmp_path / "r.toml")
    assert record["voltage"] == pytest.approx(factor * np.arange(9.0))
    assert bool(record.inputs[1].note) == bool(options)


def _uneven(keep: np.ndarray, jitter: float = 0.0) -> Record:
    time = TIME + jitter * np.random.default_rng(1).uniform(-1.0, 1.0, len(TIME))
    return record_of(time[keep], angle=3.0 * np.sin(5.0 * time[keep]))


def test_jitter_is_resampled_with_an_error_that_holds() -> None:
    """The stated error bounds that of linear interpolation: h^2/8 of the curvature, here 0.3 per mille."""
    record = _uneven(np.ones(len(TIME), dtype=bool), 2e-3).resampled()
    real = np.max(np.abs(record["angle"] - 3.0 * np.sin(5.0 * record.time_s))) / 6.0
    stated = float(record.notes[-1].split("error up to ")[1].split(" %")[0]) / 100.0
    assert 0.5 * real < stated < 5.0 * real
    assert stated < 1e-3


def test_a_gap_is_bridged_only_within_the_tolerance() -> None:
    keep = np.ones(len(TIME), dtype=bool)
    keep[80:120] = False
    with pytest.raises(InputError, match=r"longest step 0\.41 s at 0\.79 s.*allowed: 5 %"):
        _uneven(keep).resampled()
    short = np.ones(len(TIME), dtype=bool)
    short[80:84] = False
    record = _uneven(short).resampled()
    real = np.max(np.abs(record["angle"] - 3.0 * np.sin(5.0 * record.time_s))) / 6.0
    stated = float(record.notes[-1].split("error up to ")[1].split(" %")[0]) / 100.0
    assert real <= 1.3 * stated < 0.01


def test_the_tolerance_is_an_option_of_the_record_file(tmp_path) -> None:
    rows = [f"{t},{a}" for t, a in zip(TIME, ANGLE, strict=True)]
    (tmp_path / "r.csv").write_text("\n".join(["t,a", *rows[:80], *rows[120:]]) + "\n")
    text = 'file = "r.csv"\ntime = { column = "t" }\nsignals.angle = { column = "a", unit = "rad" }\n'
    (tmp_path / "r.toml").write_text(text + 'resample_tolerance = "60 %"\n')
    assert "longest step" in open_record(tmp_path / "r.toml").resampled().notes[-1]
    (tmp_path / "r.toml").write_text(text)
    with pytest.raises(InputError, match="resample_tolerance"):
        open_record(tmp_path / "r.toml").resampled()


@pytest.mark.parametrize(
    ("write", "reason"),
    [
        (lambda p: savemat(p / "r.mat", {"X": TABLE}), "layout is not known"),
        (lambda p: (p / "r.mat").write_bytes(b"MATLAB"), "too short"),
        (lambda p: (p / "r.json").write_text("[1, 2]"), "columns by name, or a list of rows"),
        (lambda p: (p / "r.parquet").write_bytes(b"PAR1PAR1"), "is no Parquet file"),
        (lambda p: (p / "r.csv").write_text("time,current\n1,2\n"), "has no unit in its name"),
        (lambda p: (p / "r.csv").write_text("time_s,banana_A\n1,2\n"), '"banana_A": no name'),
        (lambda p: (p / "r.csv").write_text("a,b\n1,2\n"), "describe it in a record file"),
        (lambda p: (p / "r.toml").write_text('file = "r.csv"\nseperator = ";"\n'), 'mean "separator"'),
    ],
)
def test_what_cannot_be_read_says_why(write: object, reason: str, tmp_path) -> None:
    write(tmp_path)
    file = next(tmp_path.iterdir())
    with pytest.raises(InputError, match=reason):
        open_record(file)


@pytest.mark.parametrize("value", ["rms", "peak"])
def test_ac_currents_carry_the_power_of_the_equivalent_dc_motor(value: str, tmp_path) -> None:
    """P = u i with u the peak line-line voltage: 3 V_phase I_phase in rms of a motor without reactance."""
    (tmp_path / "r.csv").write_text("t,i,u\n" + "".join(f"{k},{k + 1},{k + 1}\n" for k in range(9)))
    (tmp_path / "r.toml").write_text(
        'file = "r.csv"\ntime = { column = "t" }\n'
        f'signals.current = {{ column = "i", unit = "A", value = "{value}" }}\n'
        f'signals.voltage = {{ column = "u", unit = "V", value = "{value}", between = "phase" }}\n'
    )
    record = open_record(tmp_path / "r.toml")
    written = np.arange(1.0, 10.0) ** 2
    power = 3.0 * written if value == "rms" else 1.5 * written
    assert record["current"] * record["voltage"] == pytest.approx(power)
