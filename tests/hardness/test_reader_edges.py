"""Readers of records at their edges, and records that would fill the memory."""

import os
import re
import struct
import zlib
from collections.abc import Callable
from pathlib import Path

import pytest
from targets import CAMPAIGN, SPEC

from actuator_lti import bounds
from actuator_lti.bounds import JSON_DEPTH, KEY_PARTS, TEXT_CHARACTERS, TOML_BYTES, TOML_DEPTH, TOML_VALUES
from actuator_lti.files import reading
from actuator_lti.files.reading import parse_json, parse_toml, read_bytes, read_json
from analyses.records.campaign_file import load_campaign
from analyses.records.csv_stream import read_csv_record
from analyses.records.open_record import open_record
from analyses.records.readers import read_mat_record, read_record
from nonlinear import commands
from tests import refusals


def refused(read, text: str) -> str:
    return refusals.refused(read, text, "f")


def tables(levels: int) -> str:
    """A value within so many tables."""
    return "a = " + "{ a = " * (levels - 1) + "1" + " }" * (levels - 1)


def lists(levels: int) -> str:
    return "[" * levels + "]" * levels


def test_depth_values_texts_keys_and_size() -> None:
    assert parse_toml(tables(TOML_DEPTH.most), "f")
    assert "nested too deeply" in refused(parse_toml, tables(TOML_DEPTH.most + 1))
    assert parse_json(lists(JSON_DEPTH.most + 1), "f")  # the innermost holds nothing
    assert "nested too deeply" in refused(parse_json, lists(JSON_DEPTH.most + 2))
    for read, text in ((parse_toml, "a = " + "[" * 10_000), (parse_json, "[" * 10_000)):
        assert "nested too deeply" in refused(read, text)

    def text(count: int) -> str:  # with the file and the list there are two more
        return f"a = [{'1,' * (count - 2)}]"

    assert parse_toml(text(TOML_VALUES.most), "f")
    assert f"at most {TOML_VALUES.most}" in refused(parse_toml, text(TOML_VALUES.most + 1))
    assert "more values" in refused(parse_toml, "\n".join(f"k{k} = 1" for k in range(TOML_VALUES.most + 1)))
    most = TEXT_CHARACTERS.most
    assert parse_toml(f'a = "{"x" * most}"', "f")
    assert f"{most + 1} characters" in refused(parse_toml, f'a = "{"x" * (most + 1)}"')
    assert "characters" in refused(parse_toml, f'"{"x" * (most + 1)}" = 1')
    assert "nested too deeply" in refused(parse_toml, "a" + ".a" * KEY_PARTS.most + " = 1")
    room = TOML_BYTES.most - len("a = 1\n#")
    assert parse_toml("a = 1\n#" + "x" * room, "f") == {"a": 1}
    assert "larger" in refused(parse_toml, "a = 1\n#" + "x" * (room + 1))


def test_integers_control_characters_and_keys_twice() -> None:
    for number in (2**63, -(2**63) - 1, 10**4000):
        for read, text in ((parse_toml, "a = {}"), (parse_json, '{{"a": {}}}')):
            edge = 2**63 - 1 if number > 0 else -(2**63)
            assert read(text.format(edge), "f") == {"a": edge}
            assert "whole numbers of 64 bits" in refused(read, text.format(f"{number:d}"))
    for code in (0x00, 0x07, 0x1B, 0x7F, 0x85, 0x9B):
        for text in (f'a = "x\\u{code:04x}"', f'"x\\u{code:04x}" = 1'):
            assert f"U+{code:04X}" in refused(parse_toml, text)
        assert f"U+{code:04X}" in refused(parse_json, f'{{"a": "x\\u{code:04x}"}}')
    assert parse_toml('a = "x\\n\\t"', "f") == {"a": "x\n\t"}
    for text in ("a = 1\na = 2", "[a]\n[a]"):
        refused(parse_toml, text)
    refused(parse_json, '{"a": 1, "a": 2}')


KINDS: dict[str, Callable[[Path], object]] = {
    ".csv": lambda path: read_csv_record(path, SPEC),
    ".mat": lambda path: read_mat_record(path, SPEC),
    ".parquet": lambda path: read_record(path, SPEC),
    ".toml": load_campaign,
    ".rec": open_record,
    ".cmd": lambda path: commands.recorded(path),
}


@pytest.mark.parametrize("suffix", KINDS)
def test_a_pipe_or_a_device_is_refused_without_waiting(suffix, tmp_path) -> None:
    pipe = tmp_path / f"pipe{suffix}"
    os.mkfifo(pipe)
    other = {pipe: "is no regular file", Path("/dev/zero"): "is no regular file", tmp_path: "is a directory"}
    for path, words in {**other, tmp_path / "a\0b": "null|is no file"}.items():
        assert re.search(words, refusals.refused(KINDS[suffix], path))


def test_a_file_of_any_kind_has_a_largest_size(tmp_path, monkeypatch) -> None:
    path, most = tmp_path / "f", bounds.Bound("of a file", 9, "small", unit="bytes")
    monkeypatch.setattr(reading, "REPORT_BYTES", most)
    for read, whole in ((lambda file: read_bytes(file, most=most), b'"1234567"'), (read_json, "1234567")):
        path.write_bytes(b'"1234567"')
        assert read(path) == whole
        path.write_bytes(b'"12345678"')
        refusals.refused(read, path, words=("is larger than allowed: at most 9 bytes",))


def packed_zeros(count: int) -> bytes:
    """A .mat file of so many bytes of zeros in one compressed array, written piece by piece."""
    head = struct.pack("<IIIIIIiiII", 6, 8, 6, 0, 5, 8, 1, count, 1, 1) + b"t" * 8
    body = struct.pack("<II", 14, len(head) + 8 + count) + head + struct.pack("<II", 2, count)
    pack = zlib.compressobj(1)
    data = pack.compress(body)
    for _ in range(0, count, 1 << 20):
        data += pack.compress(bytes(1 << 20))
    data += pack.flush()
    return b"MATLAB 5.0".ljust(124) + struct.pack("<H2sII", 0x0100, b"IM", 15, len(data)) + data


def test_a_small_file_that_unpacks_to_gigabytes(tmp_path) -> None:
    path, most = tmp_path / "b.mat", bounds.MAT_VALUES.most
    path.write_bytes(packed_zeros(9 * most))
    assert path.stat().st_size < 4_000_000
    refusals.refused(read_mat_record, path, SPEC, words=("b.mat", "more than allowed: at most 50000000"))
    path.write_bytes(packed_zeros(most + (1 << 20)))
    refusals.refused(read_mat_record, path, SPEC, words=("numbers of a .mat or Parquet file",))


def test_twenty_thousand_runs_are_read_and_one_more_is_not(tmp_path) -> None:
    head, run = CAMPAIGN.split(b"[[run]]")
    path = tmp_path / "c.toml"
    runs = b"".join(b"[[run]]" + run.replace(b'"01"', b'"%d"' % k) for k in range(bounds.CAMPAIGN_RUNS.most))
    path.write_bytes(head + runs)
    assert len(load_campaign(path).runs) == bounds.CAMPAIGN_RUNS.most
    path.write_bytes(head + runs + b"[[run]]" + run)
    words = "[[run]]: 20001 runs of a campaign; allowed: at most 20000"
    refusals.refused(load_campaign, path, words=(words,))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (b'name = "Bench, March"', b'name = "a\\u001b[31mb"', "U+001B"),
        (b'"run01_drive.csv"', b'"a\\u0000b"', "U+0000"),
        (b'"2 mA"', b"9" * 5000, "not TOML"),
        (b'"2 mA"', b"9" * 30, "64 bits"),
        (b'separator = ";"', b"separator = { a = 1 }", "separator"),
        (b"[campaign]", b"[campaign]\n" + b"a." * 100 + b"b = 1", "nested too deeply"),
        (b'name = "Bench, March"', b'name = "' + b"x" * 20_000 + b'"', "20000 characters"),
        (b'"correlation"', b'"guess"', "join.method = 'guess': one of correlation, event, given"),
        (b'signals.current = { column = "I", unit = "mA" }', b"", "drive.signals.current: is needed"),
        (b'unit = "rpm"', b'unit = "kg"', "must be a unit like rad/s"),
        (b"torque_accuracy =", b"torque_acuracy =", 'did you mean "torque_accuracy"'),
        (b'speed = "104.7 rad/s"', b'speed = "105 N"', "run[1].speed"),
        (b"[[run]]", b"[[run]]" + CAMPAIGN.partition(b"[[run]]")[2] + b"[[run]]", "given twice"),
        (b"[campaign]", b"[campaign", "not TOML"),
    ],
)
def test_a_campaign_is_read_as_strictly_as_a_design(tmp_path, old, new, words) -> None:
    assert old in CAMPAIGN
    path = tmp_path / "c.toml"
    path.write_bytes(b"\xef\xbb\xbf" + CAMPAIGN)
    assert load_campaign(path).runs
    path.write_bytes(CAMPAIGN.replace(old, new, 1))
    refusals.refused(load_campaign, path, words=("c.toml", words))
