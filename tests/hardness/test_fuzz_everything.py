"""A minute of the attack, the same inputs each time; inputs by which it found something; edges of readers."""

import json
import os
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fuzz import attack, written
from scipy.io import savemat
from targets import CAMPAIGN, SPEC, Target, parquet_file, small_report, targets

from actuator_lti import bounds
from actuator_lti.bounds import JSON_DEPTH, KEY_PARTS, TEXT_CHARACTERS, TOML_BYTES, TOML_DEPTH, TOML_VALUES
from actuator_lti.design.loader import design_text
from actuator_lti.files.reading import parse_json, parse_toml, read_bytes, read_json
from analyses.estimation.least_squares import solve
from analyses.records import campaign_file
from analyses.records.campaign_file import load_campaign
from analyses.records.csv_stream import read_csv_record
from analyses.records.differentiation import filtered_motion
from analyses.records.open_record import open_record
from analyses.records.readers import read_record
from nonlinear import commands
from tests import refusals

SEED = 18
INPUTS = {"command": 12, "history": 100, "mat": 50, "study": 100}  # by the first word of a target's name
LINES = 100  # of the target "command line"
USUAL = 400


@pytest.mark.parametrize("target", targets(), ids=lambda target: target.name.replace(" ", "-"))
def test_whatever_a_file_holds_it_is_taken_or_refused_in_one_line(target: Target) -> None:
    for seed in target.seeds:  # what is damaged is good
        target.attack(written(seed, target.suffix))
    count = LINES if target.name == "command line" else INPUTS.get(target.name.partition(" ")[0], USUAL)
    finds = [find for number in range(count) if (find := attack(target, SEED, number)) is not None]
    assert finds == []


def test_the_attack_sees_what_it_looks_for() -> None:
    def careless(path) -> None:
        if b"5" not in path.read_bytes():
            raise KeyError("five")

    find = attack(Target("careless", (b"5",), careless), SEED, 3)
    assert find is None or find.what.startswith("KeyError")
    assert any(attack(Target("careless", (b"5",), careless), SEED, k) for k in range(30))


BY_NAME = {target.name: target for target in targets()}


def refused(name: str, data: bytes) -> str:
    target = BY_NAME[name]
    return refusals.refused(target.attack, written(data, target.suffix))


def first(kind: str, made: dict) -> dict:
    return next(block for block in made["sections"][0]["blocks"] if block["kind"] == kind)


def test_a_coupling_after_a_gear_that_is_none_and_an_id_that_is_no_text() -> None:
    for design, known in (("ilr33-amber-compliant", "planetary, worm"), ("joint", "harmonic")):
        head = re.compile(r"(?m)^\[coupling\]\n(?:after = .*\n)?")
        changed = head.sub('[coupling]\nafter = "wor[["\n', design_text(design))
        assert re.search(rf'coupling.after = "wor\[\[".*{known}', refused("design", changed.encode()))
    limit = 'quantity = "bandwidth"\nloop = "position"\nminimum = "1 Hz"\n'
    for written_id in ("{}", "[1]", "3", "true"):
        study = f'[study]\nname = "s"\nbase = "ctms-motor-position"\n[[requirement]]\nid = {written_id}\n'
        assert "id" in refused("study", (study + limit).encode())


def test_numbers_beyond_floats_names_that_cannot_be_read_and_a_status_twice() -> None:
    line = refused("samples", b"motor.resistance,motor.inductance\n%b,1e-5\n" % (b"9" * 400))
    assert "no number" in line
    column, unreadable = b"\x18\x01i\x00", b"\x18\x01\xaf\x00"
    assert column in parquet_file()
    broken = parquet_file().replace(column, unreadable)
    assert "is no Parquet file" in refused("parquet", broken)
    made = json.loads(small_report())
    first("table", made)["rows"][0]["a"] = {"text": "worn", "status": "warn"}
    BY_NAME["report"].attack(written(json.dumps(made).encode(), ".json"))


@pytest.mark.parametrize(("change", "words"), [
    (lambda made: first("glance", made)["loops"][0]["figures"][0].update(format="sig:x"), "format"),
    (lambda made: first("table", made)["rows"][0].update(_status="f{{7*7}}"), "_status"),
    (lambda made: first("table", made)["rows"][0].update(b={"text": "x"}), "status"),
    (lambda made: first("glance", made)["loops"][0].update(stable="yes"), "stable"),
    (lambda made: first("glance", made)["loops"][0]["stable"].pop("status"), "status"),
    (lambda made: first("glance", made)["weakest"].pop("words"), "words"),
    (lambda made: made["provenance"].update(time=3), "time"),
    (lambda made: made["provenance"].update(commit=[1]), "commit"),
])  # fmt: skip
def test_a_report_that_no_page_can_be_made_of(change, words: str) -> None:
    made = json.loads(small_report())
    change(made)
    assert words in refused("report", json.dumps(made).encode())


def test_a_fit_of_too_few_samples_and_rows_too_close_for_the_filter() -> None:
    for rows in (1, 2):
        words = f"{rows} sample(s) are left to fit 2 parameter"
        refusals.refused(solve, np.eye(3)[:rows, :2], np.ones(rows), words=words)
    assert solve(np.eye(3)[:, :2], np.ones(3)).values == pytest.approx([1.0, 1.0])
    for period_s in (5e-324, 1e-300, 1e-9):
        asked = {"cutoff_hz": 50.0, "order": 4, "words": "too low for rows"}
        refusals.refused(filtered_motion, np.linspace(0.0, 1.0, 100), period_s, **asked)


def unread(read, text: str) -> str:
    return refusals.refused(read, text, "f")


def tables(levels: int) -> str:
    """A value within so many tables."""
    return "a = " + "{ a = " * (levels - 1) + "1" + " }" * (levels - 1)


def lists(levels: int) -> str:
    return "[" * levels + "]" * levels


def test_depth_values_texts_keys_and_size() -> None:
    assert parse_toml(tables(TOML_DEPTH.most), "f")
    assert "nested too deeply" in unread(parse_toml, tables(TOML_DEPTH.most + 1))
    assert parse_json(lists(JSON_DEPTH.most + 1), "f")  # the innermost holds nothing
    assert "nested too deeply" in unread(parse_json, lists(JSON_DEPTH.most + 2))
    for read, text in ((parse_toml, "a = " + "[" * 10_000), (parse_json, "[" * 10_000)):
        assert "nested too deeply" in unread(read, text)

    def text(count: int) -> str:  # with the file and the list there are two more
        return f"a = [{'1,' * (count - 2)}]"

    assert parse_toml(text(TOML_VALUES.most), "f")
    assert f"at most {TOML_VALUES.most}" in unread(parse_toml, text(TOML_VALUES.most + 1))
    assert "more values" in unread(parse_toml, "\n".join(f"k{k} = 1" for k in range(TOML_VALUES.most + 1)))
    most = TEXT_CHARACTERS.most
    assert parse_toml(f'a = "{"x" * most}"', "f")
    assert f"{most + 1} characters" in unread(parse_toml, f'a = "{"x" * (most + 1)}"')
    assert "characters" in unread(parse_toml, f'"{"x" * (most + 1)}" = 1')
    assert "nested too deeply" in unread(parse_toml, "a" + ".a" * KEY_PARTS.most + " = 1")
    room = TOML_BYTES.most - len("a = 1\n#")
    assert parse_toml("a = 1\n#" + "x" * room, "f") == {"a": 1}
    assert "larger" in unread(parse_toml, "a = 1\n#" + "x" * (room + 1))


def test_integers_control_characters_and_keys_twice() -> None:
    for number in (2**63, -(2**63) - 1, 10**4000):
        for read, text in ((parse_toml, "a = {}"), (parse_json, '{{"a": {}}}')):
            edge = 2**63 - 1 if number > 0 else -(2**63)
            assert read(text.format(edge), "f") == {"a": edge}
            assert "whole numbers of 64 bits" in unread(read, text.format(f"{number:d}"))
    for code in (0x00, 0x07, 0x1B, 0x7F, 0x85, 0x9B):
        for text in (f'a = "x\\u{code:04x}"', f'"x\\u{code:04x}" = 1'):
            assert f"U+{code:04X}" in unread(parse_toml, text)
        assert f"U+{code:04X}" in unread(parse_json, f'{{"a": "x\\u{code:04x}"}}')
    assert parse_toml('a = "x\\n\\t"', "f") == {"a": "x\n\t"}
    for text in ("a = 1\na = 2", "[a]\n[a]"):
        unread(parse_toml, text)
    unread(parse_json, '{"a": 1, "a": 2}')


KINDS: dict[str, Callable[[Path], object]] = {
    ".csv": lambda path: read_csv_record(path, SPEC),
    **dict.fromkeys((".mat", ".parquet"), lambda path: read_record(path, SPEC)),
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
        refusals.refused(KINDS[suffix], path, match=words)


def test_a_file_of_any_kind_has_a_largest_size(tmp_path, monkeypatch) -> None:
    path, most = tmp_path / "f", bounds.Bound("of a file", 9, "small", unit="bytes")
    monkeypatch.setattr(bounds, "REPORT_BYTES", most)
    for read, whole in ((lambda file: read_bytes(file, most=most), b'"1234567"'), (read_json, "1234567")):
        path.write_bytes(b'"1234567"')
        assert read(path) == whole
        path.write_bytes(b'"12345678"')
        refusals.refused(read, path, words=("is larger than allowed: at most 9 bytes",))


def test_a_small_file_that_unpacks_to_gigabytes(tmp_path) -> None:
    path, zeros = tmp_path / "b.mat", np.zeros(6 * bounds.MAT_VALUES.most, np.uint8)
    for held, words in (
        ({"t": zeros}, "numbers of a .mat or Parquet file"),
        ({"s": {"x": zeros}}, "more than"),
    ):
        savemat(path, held, do_compression=True)
        assert path.stat().st_size < 4_000_000
        refusals.refused(read_record, path, SPEC, words=("b.mat", words, "at most 50000000"))


def test_twenty_thousand_runs_are_read_and_one_more_than_allowed_is_not(tmp_path, monkeypatch) -> None:
    head, run = CAMPAIGN.split(b"[[run]]")
    path = tmp_path / "c.toml"
    runs = b"".join(b"[[run]]" + run.replace(b'"01"', b'"%d"' % k) for k in range(bounds.CAMPAIGN_RUNS.most))
    path.write_bytes(head + runs)
    assert len(load_campaign(path).runs) == bounds.CAMPAIGN_RUNS.most
    monkeypatch.setattr(campaign_file, "CAMPAIGN_RUNS", replace(bounds.CAMPAIGN_RUNS, most=1))
    path.write_bytes(head + b"[[run]]" + run + b"[[run]]" + run.replace(b'"01"', b'"02"'))
    words = "[[run]]: 2 runs of a campaign; allowed: at most 1"
    refusals.refused(load_campaign, path, words=(words,))


@pytest.mark.parametrize(("old", "new", "words"), [
    (b'name = "Bench, March"', b'name = "a\\u001b[31mb"', "U+001B"),
    (b'separator = ";"', b"separator = { a = 1 }", "separator"),
    (b'"correlation"', b'"guess"', "join.method = 'guess': one of correlation, event, given"),
    (b'signals.current = { column = "I", unit = "mA" }', b"", "drive.signals.current: is needed"),
    (b'unit = "rpm"', b'unit = "kg"', "must be a unit like rad/s"),
    (b"torque_accuracy =", b"torque_acuracy =", 'did you mean "torque_accuracy"'),
    (b'speed = "104.7 rad/s"', b'speed = "105 N"', "run[1].speed"),
    (b"[[run]]", b"[[run]]" + CAMPAIGN.partition(b"[[run]]")[2] + b"[[run]]", "given twice"),
])  # fmt: skip
def test_a_campaign_is_read_as_strictly_as_a_design(tmp_path, old, new, words) -> None:
    assert old in CAMPAIGN
    path = tmp_path / "c.toml"
    path.write_bytes(b"\xef\xbb\xbf" + CAMPAIGN)
    assert load_campaign(path).runs
    path.write_bytes(CAMPAIGN.replace(old, new, 1))
    refusals.refused(load_campaign, path, words=("c.toml", words))
