"""A minute of the attack, the same inputs every time; inputs by which it once found something."""

import json
import re

import numpy as np
import pytest
from fuzz import attack, written
from targets import Target, parquet_file, small_report, targets

from actuator_lti.design.loader import design_text
from analyses.estimation.least_squares import solve
from analyses.records.differentiation import filtered_motion
from tests import refusals

SEED = 18
INPUTS = {"command": 12, "history": 100, "study": 100}  # by the first word of a target's name
LINES = 100  # of the target "command line"
USUAL = 400


@pytest.mark.parametrize("target", targets(), ids=lambda target: target.name.replace(" ", "-"))
def test_the_inputs_that_are_damaged_are_good(target: Target, tmp_path) -> None:
    for k, seed in enumerate(target.seeds):
        path = tmp_path / f"{k}{target.suffix}"
        path.write_bytes(seed)
        target.attack(path)


@pytest.mark.parametrize("target", targets(), ids=lambda target: target.name.replace(" ", "-"))
def test_whatever_a_file_holds_it_is_taken_or_refused_in_one_line(target: Target) -> None:
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
        text = design_text(design)
        changed = re.sub(r"(?m)^\[coupling\]\n(?:after = .*\n)?", '[coupling]\nafter = "wor[["\n', text)
        assert changed != text
        line = refused("design", changed.encode())
        assert 'coupling.after = "wor[["' in line
        assert known in line
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


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda made: first("table", made)["columns"][0].update(format="sig:0"), "format"),
        (lambda made: first("glance", made)["loops"][0]["figures"][0].update(format="sig:x"), "format"),
        (lambda made: first("table", made)["rows"][0].update(_status="f{{7*7}}"), "_status"),
        (lambda made: first("table", made)["rows"][0].update(b={"text": "x"}), "status"),
        (lambda made: first("glance", made)["loops"][0].update(stable="yes"), "stable"),
        (lambda made: first("glance", made)["loops"][0]["stable"].pop("status"), "status"),
        (lambda made: first("glance", made)["weakest"].pop("words"), "words"),
        (lambda made: made["provenance"].update(time=3), "time"),
        (lambda made: made["provenance"].update(commit=[1]), "commit"),
    ],
)
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
