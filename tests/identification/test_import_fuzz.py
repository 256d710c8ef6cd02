"""Fuzz: whatever a file holds, there is a record with every row accounted for, or one InputError."""

import io
import tempfile
from pathlib import Path

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.io import savemat

from actuator_lti.errors import InputError
from actuator_lti.files.mat5 import read_mat5
from analyses.records.campaign_file import load_campaign
from analyses.records.csv_stream import read_csv_record
from analyses.records.readers import read_mat_record
from analyses.records.spec import CsvFormat, RecordSpec, SignalColumn, TimeColumn

CELLS = st.one_of(
    st.integers(-3, 9).map(str),
    st.floats(allow_nan=True, width=32).map(str),
    st.sampled_from(["", "nan", "abc", "1,5", "1_0", '"2"', "#", "1e999", "\u00b5", "-"]),
)
ROWS = st.lists(st.lists(CELLS, min_size=0, max_size=4), max_size=12)
FORMATS = st.sampled_from(
    [
        CsvFormat(),
        CsvFormat(separator=";", decimal=","),
        CsvFormat(separator="whitespace"),
        CsvFormat(names=("t", "x")),
    ]
)


def _spec(layout: CsvFormat, policy: str) -> RecordSpec:
    return RecordSpec(
        format=layout,
        time=TimeColumn(column="t"),
        signals=(SignalColumn(name="x", column="x"),),
        bad_rows=policy,
        disorder=policy,
    )


def _read(content: bytes, spec: RecordSpec) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "f.csv"
        path.write_bytes(content)
        try:
            record = read_csv_record(path, spec)
        except InputError as error:
            _check_one_line(error)
            return
    counts = record.counts
    assert counts.rows_in == counts.rows_out + sum(counts.dropped.values())
    assert counts.rows_out == len(record)
    lines = content.removesuffix(b"\n").count(b"\n") + 1
    assert counts.lines == lines == counts.comments + counts.blanks + counts.header + counts.rows_in


@settings(max_examples=120)
@given(
    rows=ROWS, layout=FORMATS, policy=st.sampled_from(["error", "drop"]), end=st.sampled_from(["\n", "\r\n"])
)
def test_tables_of_odd_cells(rows: list[list[str]], layout: CsvFormat, policy: str, end: str) -> None:
    separator = " " if layout.separator == "whitespace" else layout.separator
    head = [] if layout.names else [f"t{separator}x"]
    text = end.join([*head, *(separator.join(row) for row in rows), ""])
    _read(text.encode(), _spec(layout, policy))


@settings(max_examples=120)
@given(content=st.binary(max_size=300), head=st.sampled_from([b"", b"t,x\n", b"t,x\n0,1\n1,2\n"]))
def test_any_bytes_as_csv(content: bytes, head: bytes) -> None:
    _read(head + content, _spec(CsvFormat(), "drop"))


@settings(max_examples=200)
@given(content=st.binary(max_size=400), place=st.integers(0, 600), head=st.booleans())
def test_any_bytes_as_mat(content: bytes, place: int, head: bool) -> None:
    spec = RecordSpec(time=TimeColumn(column="t"), signals=(SignalColumn(name="x", column="x"),))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "f.mat"
        whole = _mat_bytes()
        path.write_bytes(whole[:place] + content + whole[place + len(content) :] if head else content)
        try:
            record = read_mat_record(path, spec)
        except InputError as error:
            _check_one_line(error)
            return
    assert record.counts.rows_in == record.counts.rows_out + sum(record.counts.dropped.values())


@settings(max_examples=120)
@given(text=st.one_of(st.text(max_size=200), st.binary(max_size=100).map(lambda b: b.decode("latin-1"))))
def test_any_text_as_campaign(text: str) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "c.toml"
        path.write_text(text, encoding="utf-8", errors="surrogatepass")
        try:
            load_campaign(path)
        except InputError as error:
            _check_one_line(error)


def test_a_compressed_and_a_plain_file_read_alike() -> None:
    values = {"t": np.arange(5.0), "n": np.array([[1, 2], [3, 4]], dtype=np.int16), "k": 3.5, "text": "abc"}
    for packed in (False, True):
        stream = io.BytesIO()
        savemat(stream, values, do_compression=packed)
        content = read_mat5(stream.getvalue())
        assert content.arrays["t"].ravel().tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]
        assert content.arrays["n"].tolist() == [[1.0, 2.0], [3.0, 4.0]]
        assert content.arrays["k"].item() == 3.5
        assert content.passed_over == []
        assert content.texts == {"text": ("abc",)}


def _check_one_line(error: InputError) -> None:
    assert str(error)
    assert "\n" not in str(error)


def _mat_bytes() -> bytes:
    stream = io.BytesIO()
    savemat(stream, {"t": np.arange(20.0), "x": np.arange(20.0) ** 2})
    return stream.getvalue()
