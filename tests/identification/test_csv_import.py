"""Records from CSV: layouts, units, accounts of rows, and refusals that name line, column and reason."""

import hashlib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from actuator_lti.errors import InputError
from analyses.records import csv_stream as module
from analyses.records.csv_stream import BoundedRows, read_csv_record, stream_csv
from analyses.records.open_record import open_record
from analyses.records.spec import CsvFormat, RecordSpec, SignalColumn, TimeColumn

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
    blocks = list(stream_csv(path, _spec()))
    assert len(blocks) > 10
    assert sum(len(block) for block in blocks) == n
    record = read_csv_record(path, _spec(), max_rows=1000)
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
