"""Records from files: layouts, units, one truth written in many ways, rows accounted for, refusals."""

import gzip
import hashlib
import io
import json
from collections.abc import Callable
from datetime import datetime, timedelta, timezone
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.io import savemat

from actuator_lti.errors import InputError
from actuator_lti.files.matlab import read_mat
from actuator_lti.files.reading import read_bytes
from analyses.records import csv_stream as module
from analyses.records import readers
from analyses.records.csv_stream import BoundedRows, read_csv_record
from analyses.records.open_record import open_record
from analyses.records.record import Record
from analyses.records.spec import CsvFormat, RecordSpec, SignalColumn, TimeColumn
from tests.identification.bench_records import record_of

TIME = np.arange(0.0, 2.0, 1e-2)
ANGLE = 3.0 * np.sin(5.0 * TIME)
CURRENT = 2.0 + np.cos(4.0 * TIME)
NAMES = ("t [ms]", "Motor angle [deg]", "I (mA)")
TABLE = np.column_stack([1e3 * TIME, np.degrees(ANGLE), 1e3 * CURRENT])


def _text(separator: str, decimal: str) -> str:
    rows = [separator.join(f"{v:.9f}" for v in row).replace(".", decimal) for row in TABLE]
    return "\n".join([separator.join(NAMES), *rows]) + "\n"


def _parquet(path: Path, time: pa.Array, *names: str) -> None:
    text = pa.array(["a"] * len(TIME))
    columns = [time, *(pa.array(TABLE[:, k]) for k in (1, 2)), text]
    pq.write_table(pa.table(columns, names=[*names, *NAMES[1:], "remark"]), path / "r.parquet")


def _stamps_of_arrow() -> pa.Array:
    since = (1e9 * TIME).round().astype("int64")
    return pa.array(since + 1_700_000_000_000_000_000, pa.timestamp("ns", "UTC"))


def _units_row(path: Path) -> None:
    first, *rows = _text("\t", ",").splitlines()
    names = "\t".join(name.split(" [")[0].split(" (")[0] for name in first.split("\t"))
    (path / "r.txt").write_text("\n".join(["# made by hand", names, "[ms]\t[deg]\t[mA]", *rows]))


def _stamps(path: Path) -> None:
    """From the last second of a year in one zone on; the same instants in another zone from row 100 on."""
    made = ["Time;Motor angle [deg];I [mA];state"]
    for k, (t, angle, current) in enumerate(zip(TIME, TABLE[:, 1], TABLE[:, 2], strict=True)):
        at = datetime(2024, 12, 31, 23, 59, 59, tzinfo=timezone(timedelta(hours=1)))
        at = (at + timedelta(seconds=float(t))).astimezone(timezone(timedelta(hours=1 if k < 100 else 0)))
        made.append(f"{at.isoformat(sep='T' if k % 2 else ' ')};{angle:.9f};{current:.9f};on")
    (path / "r.csv").write_text("\n".join(made).replace(".", ","))


def _described(path: Path, *lines: str) -> None:
    (path / "r.toml").write_text("\n".join(lines))


def _structure(path: Path) -> None:
    savemat(path / "s.mat", {"d": {"t": TIME, "phi": np.degrees(ANGLE), "I": CURRENT}})
    angle = 'signals.angle = { column = "d.phi", unit = "deg" }'
    current = 'signals.current = { column = "d.I", unit = "A" }'
    _described(path, 'file = "s.mat"', 'time = { column = "d.t" }', angle, current)


def _sum(path: Path) -> None:
    """A difference of two columns, with offset and scale; a column named like a sum is itself."""
    half = np.column_stack([TABLE[:, 0], TABLE[:, 1] + 7.0, 0.5 * TABLE[:, 2] - 3.0, np.full(len(TIME), 7.0)])
    rows = "\n".join(",".join(f"{v:.9f}" for v in row) for row in half)
    (path / "s.csv").write_text("t,a,i - 3,seven\n" + rows + "\n")
    angle = 'signals.angle = { column = "a - seven", unit = "deg" }'
    current = 'signals.current = { column = "i - 3", unit = "mA", offset = 3.0, scale = 2.0 }'
    _described(path, 'file = "s.csv"', 'time = { column = "t", unit = "ms" }', angle, current)


def _named(path: Path) -> None:
    savemat(path / "s.mat", {"X": TABLE})
    time = 'matrix = "X"\nnames = ["a", "b", "c"]\ntime = { column = "a", unit = "ms" }'
    angle = 'signals.motor_angle = { column = "b", unit = "deg" }'
    _described(path, 'file = "s.mat"', time, angle, 'signals.current = { column = 3, unit = "mA" }')


BY_COLUMNS = {"log": dict(zip(NAMES, TABLE.T.tolist(), strict=True)), "by": "hand"}
BY_ROWS = [dict(zip(NAMES, row, strict=True)) for row in TABLE.tolist()]
FIELDS = dict(zip(("t_ms", "motor_angle_deg", "i_mA"), TABLE.T, strict=True))
MATRIX = {"log": TABLE, "columns": np.array(NAMES, dtype=object), "Ts": 1e-2}
FORMATS: dict[str, Callable[[Path], object]] = {
    "comma": lambda path: (path / "r.csv").write_text(_text(",", ".")),
    "semicolon and decimal comma": lambda path: (path / "r.csv").write_text(_text(";", ",")),
    "semicolon and point": lambda path: (path / "r.csv").write_text(_text(";", ".")),
    "tab and decimal comma": lambda path: (path / "r.csv").write_text(_text("\t", ",")),
    "Parquet": lambda path: _parquet(path, pa.array(TABLE[:, 0]), NAMES[0]),
    "Parquet with time stamps": lambda path: _parquet(path, _stamps_of_arrow(), "time"),
    "a matrix with a cell of names": lambda path: savemat(path / "r.mat", MATRIX),
    "a matrix with a character array of names": lambda path: savemat(
        path / "r.mat", {"log": TABLE, "names": list(NAMES)}, do_compression=True
    ),
    "a structure": _structure,
    "a structure by itself": lambda path: savemat(path / "r.mat", {"d": FIELDS, "Ts": 1e-2}),
    "a row of units": _units_row,
    "time stamps": _stamps,
    "JSON by columns": lambda path: (path / "r.json").write_text(json.dumps(BY_COLUMNS)),
    "JSON by rows": lambda path: (path / "r.json").write_text(json.dumps(BY_ROWS)),
    "a difference of columns": _sum,
    "a matrix named by the record file": _named,
}
"""Each writes ``r`` with the ending of its format."""


@pytest.mark.parametrize("form", FORMATS)
def test_one_record_in_many_formats(form: str, tmp_path, monkeypatch: pytest.MonkeyPatch) -> None:
    FORMATS[form](tmp_path)
    times = list[Path]()
    monkeypatch.setattr(
        readers, "read_bytes", lambda path, *more: times.append(path) or read_bytes(path, *more)
    )
    record = open_record(next(tmp_path.glob("r.*")))
    assert len(times) <= 1  # of each that is read whole
    assert record.time_s == pytest.approx(TIME, abs=1e-9)
    assert record["angle"] == pytest.approx(ANGLE, abs=1e-9)
    assert record["current"] == pytest.approx(CURRENT, abs=1e-9)


def test_a_compressed_and_a_plain_file_read_alike() -> None:
    values = {"t": np.arange(5.0), "n": np.array([[1, 2], [3, 4]], dtype=np.int16), "k": 3.5, "text": "abc"}
    for packed in (False, True):
        stream = io.BytesIO()
        savemat(stream, values, do_compression=packed)
        content = read_mat(stream.getvalue())
        assert content.arrays["t"].ravel().tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]
        assert content.arrays["n"].tolist() == [[1.0, 2.0], [3.0, 4.0]]
        assert content.arrays["k"].item() == 3.5
        assert content.passed_over == []
        assert content.texts == {"text": ("abc",)}


@pytest.mark.parametrize(("header", "signal", "factor"), [
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
])  # fmt: skip
def test_units_in_the_header(header: str, signal: str, factor: float, tmp_path) -> None:
    (tmp_path / "r.csv").write_text(f"time_s;{header}\n" + "".join(f"{k / 10};{k}\n" for k in range(9)))
    record = open_record(tmp_path / "r.csv")
    assert set(record.signals) == {signal}
    assert record[signal] == pytest.approx(factor * np.arange(9.0))


@pytest.mark.parametrize(("value", "between", "factor", "power"), [
    ("", "", 1.0, None),
    ("rms", "", np.sqrt(2.0), None),
    ("", "phase", np.sqrt(3.0), None),
    ("peak", "phase", np.sqrt(3.0), 1.5),
    ("rms", "phase", np.sqrt(6.0), 3.0),
])  # fmt: skip
def test_ac_values_are_those_of_the_equivalent_dc_motor(value, between, factor, power, tmp_path) -> None:
    """P = u i with u the peak line-line voltage: 3 V_phase I_phase in rms of a motor without reactance."""
    rows, value = np.arange(1.0, 10.0), f', value = "{value}"' if value else ""
    (tmp_path / "s.csv").write_text("t,i,u\n" + "".join(f"{k - 1},{k},{k}\n" for k in range(1, 10)))
    phase = f', between = "{between}"' if between else ""
    current = f'signals.current = {{ column = "i", unit = "A"{value} }}'
    voltage = f'signals.voltage = {{ column = "u", unit = "V"{value}{phase} }}'
    _described(tmp_path, 'file = "s.csv"', 'time = { column = "t" }', voltage, current)
    record = open_record(tmp_path / "r.toml")
    assert record["voltage"] == pytest.approx(factor * rows)
    assert bool(record.inputs[1].note) == bool(value + phase)
    if power is not None:
        assert record["current"] * record["voltage"] == pytest.approx(power * rows**2)


def _uneven(keep: np.ndarray, jitter: float = 0.0) -> Record:
    time = TIME + jitter * np.random.default_rng(1).uniform(-1.0, 1.0, len(TIME))
    return record_of(time[keep], angle=3.0 * np.sin(5.0 * time[keep]))


def _errors(record: Record) -> tuple[float, float]:
    """The real error of a resampled record, over its range, and the stated one."""
    stated = float(record.notes[-1].split("error up to ")[1].split(" %")[0]) / 100.0
    return float(np.max(np.abs(record["angle"] - 3.0 * np.sin(5.0 * record.time_s))) / 6.0), stated


def test_jitter_is_resampled_with_an_error_that_holds_and_a_gap_within_the_tolerance(tmp_path) -> None:
    """The stated error bounds that of linear interpolation: h^2/8 of the curvature, here 0.3 per mille."""
    record = _uneven(np.ones(len(TIME), dtype=bool), 2e-3).resampled()
    real, stated = _errors(record)
    assert 0.5 * real < stated < 5.0 * real
    assert stated < 1e-3
    keep = np.ones(len(TIME), dtype=bool)
    keep[80:120] = False
    with pytest.raises(InputError, match=r"longest step 0\.41 s at 0\.79 s.*allowed: 5 %"):
        _uneven(keep).resampled()
    short = np.ones(len(TIME), dtype=bool)
    short[80:84] = False
    record = _uneven(short).resampled()
    real, stated = _errors(record)
    assert real <= 1.3 * stated < 0.01
    rows = [f"{t},{a}" for t, a in zip(TIME, ANGLE, strict=True)]
    (tmp_path / "r.csv").write_text("\n".join(["t,a", *rows[:80], *rows[120:]]) + "\n")
    text = 'file = "r.csv"\ntime = { column = "t" }\nsignals.angle = { column = "a", unit = "rad" }\n'
    (tmp_path / "r.toml").write_text(text + 'resample_tolerance = "60 %"\n')
    assert "longest step" in open_record(tmp_path / "r.toml").resampled().notes[-1]
    (tmp_path / "r.toml").write_text(text)
    with pytest.raises(InputError, match="resample_tolerance"):
        open_record(tmp_path / "r.toml").resampled()


def _signal(text: str) -> Callable[[Path], None]:
    return lambda path: _described(path, 'file = "r.csv"', 'time = { column = "t" }', f"signals.{text}")


@pytest.mark.parametrize(("write", "reason"), [
    (lambda p: savemat(p / "r.mat", {"X": TABLE}), "layout is not known"),
    (lambda p: (p / "r.mat").write_bytes(b"MATLAB"), "no MATLAB file"),
    (lambda p: (p / "r.json").write_text("[1, 2]"), "columns by name, or a list of rows"),
    (lambda p: (p / "r.parquet").write_bytes(b"PAR1PAR1"), "is no Parquet file"),
    (lambda p: (p / "r.csv").write_text("time,current\n1,2\n"), "has no unit in its name"),
    (lambda p: (p / "r.csv").write_text("time_s,banana_A\n1,2\n"), '"banana_A": no name'),
    (lambda p: (p / "r.csv").write_text("a,b\n1,2\n"), "describe it in a record file"),
    (lambda p: (p / "r.csv").write_text("a,b,c,d,e,f\n1,2,3,4,5,6\n"), '"f": no name'),
    (lambda p: (p / "r.csv").write_text("a,b\n1,2\n"), "its number from 1"),
    (lambda p: (p / "r.csv").write_text("n,i_A\n1,2\n"), '"time": no column of the time.*"n": no name'),
    (lambda p: (p / "r.csv.gz").write_bytes(gzip.compress(b"a,b\n1,2\n")), "binary or packed"),
    (lambda p: (p / "r.csv").write_bytes(bytes(range(256))), "binary or packed"),
    (lambda p: (p / "r.csv").write_text("time_s,i_A\n1,2\n1,3\n2,3"), 'disorder = "drop" in a record'),
    (lambda p: _described(p, 'file = "r.csv"', 'seperator = ";"'), 'mean "separator"'),
    (_signal('banana = { column = "i", unit = "A" }'), "no signal that is known"),
    (_signal('curent = { column = "i", unit = "A" }'), 'did you mean "current"'),
    (_signal('current = { column = "i", unit = "V" }'), "must be a unit like A"),
    (_signal('current = { column = "i", unit = "A", value = "mean" }'), "one of dc, rms, peak"),
])  # fmt: skip
def test_what_cannot_be_read_says_why(write: object, reason: str, tmp_path) -> None:
    write(tmp_path)
    file = next(tmp_path.iterdir())
    with pytest.raises(InputError, match=reason):
        open_record(file)


SPEED = SignalColumn(name="speed", column="n", unit="rpm")


def _spec(**changes: object) -> RecordSpec:
    base = {"time": TimeColumn(column="t"), "signals": (SPEED,)}
    return RecordSpec(**{**base, **changes})


def _write(folder: Path, text: str | bytes) -> Path:
    path = folder / "log.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


@pytest.mark.parametrize(("text", "layout"), [
    ("t;n\n0;1,5\n1;2,5\n", CsvFormat(separator=";", decimal=",")),
    ("t\tn\r\n0\t1.5\r\n1\t2.5\r\n", CsvFormat(separator="\t")),
    ("  t   n\n 0   1.5\n 1\t2.5\n", CsvFormat(separator="whitespace")),
    ("% made by hand\n0,1.5;\n% between\n1,2.5;\n", CsvFormat(comment="%", row_end=";", names=("t", "n"))),
    ("junk\nmore junk\nt,n\n0,1.5\n\n1,2.5", CsvFormat(skip_lines=2)),
    ("\ufefft,n\n0,1.5\n1,2.5\n", CsvFormat()),
    ('"t","n"\n"0","1.5"\n"1","2.5"\n', CsvFormat()),
])  # fmt: skip
def test_layouts(tmp_path, text: str, layout: CsvFormat) -> None:
    record = read_csv_record(_write(tmp_path, text), _spec(format=layout))
    assert (record.time_s.tolist(), record.units["speed"]) == ([0.0, 1.0], "rad/s")
    assert record["speed"].tolist() == pytest.approx([1.5 * np.pi / 30, 2.5 * np.pi / 30])
    assert record.counts.rows_in == record.counts.rows_out == 2


def test_every_line_counts_ticks_wrap_around_and_careful_reading_is_fast_reading(tmp_path) -> None:
    text = "# log\nt,n\n0,1\n\n1,nan\n# pause\n2,3\n3,4\n"
    counts = read_csv_record(_write(tmp_path, text), _spec()).counts
    assert (counts.lines, counts.comments, counts.blanks, counts.header) == (8, 2, 1, 1)
    assert (counts.rows_in, counts.rows_out) == (4, 3)
    assert counts.dropped == {"with a missing value": 1}
    assert counts.first_dropped == {"with a missing value": "line 5"}
    # rows are dropped only on demand
    for what, text, reason in (
        ("bad_rows", "0,1\n1,abc\n2\n3,4\n4,inf\n5,6\n", "not a row of numbers"),
        ("disorder", "0,1\n2,1\n1,1\n3,1\n", "whose time does not increase"),
    ):
        spec, count = _spec(**{what: "drop"}), text.count("\n")
        counts = read_csv_record(_write(tmp_path, f"t,n\n{text}"), spec).counts
        assert (counts.rows_in, counts.rows_out, counts.dropped) == (count, 3, {reason: count - 3})
    rows = "".join(f"{(60000 + 3000 * k) % 65536},1\n" for k in range(6))
    time = TimeColumn(column="t", tick_s=1e-3, wrap=65536.0)
    record = read_csv_record(_write(tmp_path, "t,n\n" + rows), _spec(time=time))
    assert np.diff(record.time_s) == pytest.approx(3.0)
    rng = np.random.default_rng(3)
    values = rng.standard_normal(500)
    plain = "t,n\n" + "".join(f"{k},{v!r}\n" for k, v in enumerate(values.tolist()))
    with_comment = plain + "# the end\n"
    fast = read_csv_record(_write(tmp_path, plain), _spec())
    careful = read_csv_record(_write(tmp_path, with_comment), _spec())
    assert np.array_equal(fast["speed"], careful["speed"])


CELLS = st.one_of(
    st.integers(-3, 9).map(str),
    st.floats(allow_nan=True, width=32).map(str),
    st.sampled_from(["", "nan", "abc", "1,5", "1_0", '"2"', "#", "1e999", "\u00b5", "-"]),
)
TABLES = st.lists(st.lists(CELLS, min_size=0, max_size=4), max_size=12)
HEADS = st.sampled_from([b"", b"t,x\n", b"t,x\n0,1\n1,2\n"])
BYTES = st.builds(bytes.__add__, HEADS, st.binary(max_size=300))
TOLD = [{}, {"separator": ";", "decimal": ","}, {"separator": "whitespace"}, {"names": ("t", "x")}]
LAYOUTS = st.sampled_from([CsvFormat(**one) for one in TOLD])


@settings(max_examples=240)
@given(
    held=TABLES | BYTES, layout=LAYOUTS, policy=st.sampled_from(["error", "drop"]),
    end=st.sampled_from(["\n", "\r\n"]),
)  # fmt: skip
def test_every_row_and_line_is_accounted_for(held, layout, policy, end, tmp_path_factory) -> None:
    """Tables of odd cells, and any bytes; or it is refused in one line."""
    content = held
    if isinstance(held, list):
        separator = " " if layout.separator == "whitespace" else layout.separator
        head = [] if layout.names else [f"t{separator}x"]
        content = end.join([*head, *(separator.join(row) for row in held), ""]).encode()
    path = _write(tmp_path_factory.getbasetemp(), content)
    columns, said = (SignalColumn(name="x", column="x"),), ""
    try:
        spec = _spec(format=layout, signals=columns, bad_rows=policy, disorder=policy)
        record = read_csv_record(path, spec)
    except InputError as error:
        said, record = str(error), None
    assert bool(said) == (record is None)
    assert "\n" not in said
    if record is None:
        return
    counts = record.counts
    assert counts.rows_in == counts.rows_out + sum(counts.dropped.values())
    assert counts.rows_out == len(record)
    lines = content.removesuffix(b"\n").count(b"\n") + 1
    assert counts.lines == lines == counts.comments + counts.blanks + counts.header + counts.rows_in


@pytest.mark.parametrize(("content", "reason"), [
    ("x,n\n0,1\n1,2\n", 'no column "t"'),
    ("t,n\n0,1\n", "fewer than two usable rows"),
    (b"t,n\n0,1\n\x00\x00", "NUL"),
    ("t,n\n".encode("utf-16"), "UTF-16"),
    ("", "fewer than two usable rows"),
    ("t,n,n\n0,1,2\n1,2,3\n", "2 times"),
    ("t,n\n0,1\n1,abc\n2,3\n", r'log.csv:3: column "n" = "abc": not a number'),
    ("t,n\n0,1\n2,1\n1,1\n3,1\n", r"log.csv:4: time 1 s does not come after 2 s; allowed"),
    ("t,n\n1700000000.01,1\n1700000000.01,1\n", r"1700000000.01 s does not come after 1.*: a row twice"),
    ("t;n\n0;1\n1;1\n", r'no column "t"; is separator = ";" missing\? There is: "t;n"$'),
    ("u,n\n0,1\n1,1\n", r'no column "t"; there are: "u", "n"$'),
])  # fmt: skip
def test_files_that_are_no_records(tmp_path, content: str | bytes, reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        read_csv_record(_write(tmp_path, content), _spec())


def test_a_long_file_streams_in_blocks_and_is_averaged(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(module, "BLOCK_BYTES", 1 << 12)
    n = 10_007
    text = "t,n\n" + "".join(f"{k},{k % 7}\n" for k in range(n))
    path = _write(tmp_path, text)
    blocks, add = list[int](), BoundedRows.add
    monkeypatch.setattr(BoundedRows, "add", lambda own, rows: blocks.append(len(rows)) or add(own, rows))
    record = read_csv_record(path, _spec(), max_rows=1000)
    assert len(blocks) > 10
    assert sum(blocks) == n
    assert record.averaged == 16
    assert record.counts.rows_out == n
    assert len(record) <= 1001
    assert record.time_s[0] == pytest.approx(7.5)
    assert "averaged over 16 rows" in record.notes[0]


def test_the_checksum_is_that_of_what_was_read_with_a_byte_order_mark(tmp_path, monkeypatch) -> None:
    path, rows = tmp_path / "marked.csv", BoundedRows.array
    path.write_bytes(b"\xef\xbb\xbft,n\n0,1\n1,2\n")
    digest = hashlib.sha256(path.read_bytes()).hexdigest()

    def and_a_row_comes(self: BoundedRows) -> np.ndarray:
        with path.open("ab") as file:
            file.write(b"2,3\n")
        return rows(self)

    monkeypatch.setattr(BoundedRows, "array", and_a_row_comes)
    assert read_csv_record(path, _spec()).sha256 == digest


def test_odrive_rows_are_counted(odrive_files: dict[str, Path]) -> None:
    record = open_record(odrive_files["step1"])
    assert record.counts.rows_in == 1309
    assert record.counts.dropped == {"with a missing value": 8, "time below 1 s": 11}
    assert record.counts.rows_out == len(record) == 1290


def test_an_odrive_file_is_read_by_its_own_names_and_units(odrive_files: dict[str, Path], tmp_path) -> None:
    """The same rows with two columns exchanged, names and units with them, and angles in deg."""
    lines = odrive_files["step1"].read_text().replace(";", "").splitlines()
    at = next(k for k, line in enumerate(lines) if "timestep (" in line)
    rows = [cells for line in lines[at:] if len(cells := line.split(",")) == 4]
    rows[1][2] = "[deg]"
    rows[2:] = [[t, u, f"{360.0 * float(x)!r}" if x else x, w] for t, u, x, w in rows[2:]]
    text = "".join(",".join((t, u, w, x)) + ";\n" for t, u, x, w in rows)
    text = text.replace(";", "", 2)  # the comments have none
    (tmp_path / "r.csv").write_text("\n".join(lines[:at]) + "\n" + text)
    read, wanted = open_record(tmp_path / "r.csv"), open_record(odrive_files["step1"])
    for name in wanted.signals:
        assert read[name] == pytest.approx(wanted[name], rel=1e-12)
