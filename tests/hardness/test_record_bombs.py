"""Records and campaigns of any size end in one line before the memory is full."""

from __future__ import annotations

import os
import struct
import zlib
from collections.abc import Callable
from pathlib import Path

import pytest
from targets import CAMPAIGN, SPEC

from actuator_lti import bounds
from actuator_lti.errors import InputError
from analyses.records import load_campaign, open_record, read_csv_record, read_mat_record
from analyses.records.parquet_reader import read_parquet_record
from nonlinear import commands

KINDS: dict[str, Callable[[Path], object]] = {
    ".csv": lambda path: read_csv_record(path, SPEC),
    ".mat": lambda path: read_mat_record(path, SPEC),
    ".parquet": lambda path: read_parquet_record(path, SPEC),
    ".toml": load_campaign,
    ".rec": open_record,
    ".cmd": lambda path: commands.recorded(path),
}


@pytest.mark.parametrize("suffix", KINDS)
def test_a_pipe_or_a_device_is_refused_without_waiting(suffix, tmp_path) -> None:
    pipe = tmp_path / f"pipe{suffix}"
    os.mkfifo(pipe)
    for path in (pipe, Path("/dev/zero"), tmp_path, tmp_path / "a\0b"):
        with pytest.raises(InputError) as caught:
            KINDS[suffix](path)
        assert str(caught.value).isprintable()


def packed_zeros(count: int) -> bytes:
    """A .mat file of so many bytes of zeros in one compressed array, written piece by piece."""
    head = (
        struct.pack("<IIII", 6, 8, 6, 0)
        + struct.pack("<IIii", 5, 8, 1, count)
        + struct.pack("<II", 1, 1)
        + b"t" * 8
    )
    body = struct.pack("<II", 14, len(head) + 8 + count) + head + struct.pack("<II", 2, count)
    pack = zlib.compressobj(1)
    data = pack.compress(body)
    for _ in range(0, count, 1 << 20):
        data += pack.compress(bytes(1 << 20))
    data += pack.flush()
    return (
        b"MATLAB 5.0".ljust(124)
        + struct.pack("<H", 0x0100)
        + b"IM"
        + struct.pack("<II", 15, len(data))
        + data
    )


def test_a_small_file_that_unpacks_to_gigabytes(tmp_path) -> None:
    path = tmp_path / "b.mat"
    path.write_bytes(packed_zeros(9 * bounds.MAT_VALUES.most))
    assert path.stat().st_size < 4_000_000
    with pytest.raises(InputError, match=r"b\.mat.*more than allowed: at most 50000000"):
        read_mat_record(path, SPEC)
    path.write_bytes(packed_zeros(bounds.MAT_VALUES.most + (1 << 20)))
    with pytest.raises(InputError, match=r"numbers of a \.mat or Parquet file"):
        read_mat_record(path, SPEC)


def test_twenty_thousand_runs_are_read_and_one_more_is_not(tmp_path) -> None:
    head, run = CAMPAIGN.split(b"[[run]]")
    path = tmp_path / "c.toml"
    runs = b"".join(b"[[run]]" + run.replace(b'"01"', b'"%d"' % k) for k in range(bounds.CAMPAIGN_RUNS.most))
    path.write_bytes(head + runs)
    assert len(load_campaign(path).runs) == bounds.CAMPAIGN_RUNS.most
    path.write_bytes(head + runs + b"[[run]]" + run)
    with pytest.raises(InputError, match=r"\[\[run\]\]: 20001 runs of a campaign; allowed: at most 20000"):
        load_campaign(path)


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
    ],
)
def test_a_campaign_is_read_as_strictly_as_a_design(tmp_path, old, new, words) -> None:
    assert old in CAMPAIGN
    path = tmp_path / "c.toml"
    path.write_bytes(b"\xef\xbb\xbf" + CAMPAIGN)
    assert load_campaign(path).runs
    path.write_bytes(CAMPAIGN.replace(old, new, 1))
    with pytest.raises(InputError, match=r"c\.toml") as caught:
        load_campaign(path)
    assert words in str(caught.value)
    assert str(caught.value).isprintable()
