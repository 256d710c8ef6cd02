"""The command itself, on real designs."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from site_checks import check_whole

from reports.nightly.source import read_study
from tests.refusals import refused

STUDY = """
[study]
name = "gears"
title = "Gears"
base = "ctms-motor-position"

[[variant]]
name = "slower"
override = { "control.position.gain" = "12 V/rad" }

[[variant]]
name = "no <b>motor</b>"
override = { "motor.resistance" = "-1 ohm" }

[nightly]
tolerance = { "*phase margin*" = "0.5 deg" }
"""


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """A first night of a small study, on real worker processes."""
    folder = tmp_path_factory.mktemp("cli")
    (folder / "study.toml").write_text(STUDY)
    command = [str(Path(sys.executable).with_name("actuator-lti")), "nightly", str(folder / "study.toml")]
    command += ["--site", str(folder / "site"), "--no-validation"]
    return folder, subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)


def test_the_first_night_names_the_broken_variant_and_builds_the_others(built) -> None:
    folder, done = built
    assert done.returncode == 1, done.stderr
    assert done.stdout.startswith("FAIL  night 1: 1 no result")
    said = " ".join(done.stdout.split())  # where a cell is wrapped depends on the length of the folder's name
    assert all(words in said for words in ("no <b>motor</b>", "motor.resistance = ", "allowed: above 0"))
    summary = json.loads((folder / "site" / "summary.json").read_text())
    names = {"ctms-motor-position", "slower", "no <b>motor</b>", "Comparison of all variants"}
    assert {d["name"] for d in summary["designs"]} == names
    assert summary["counts"]["broken"] == 1
    check_whole(folder / "site")


def test_the_second_night_is_unchanged_and_an_approval_is_kept(built, cli) -> None:
    folder, _ = built
    words = [folder / "study.toml", "--site", folder / "site", "--no-validation"]
    assert "(3 unchanged)" in cli.text("nightly", *words, "--workers", 1, status=1)
    cli("nightly", "approve", *words, "--by", "A. Engineer", "--reason", "review 3")
    good = [d for d in cli("nightly", *words, "--json").data["designs"] if d["state"] != "broken"]
    assert {d["approved_by"] for d in good} == {"A. Engineer"}


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["nightly", "no-such-study.toml", "--site", "s"], "no-such-study.toml"),
        (["nightly", "a", "b", "c", "--site", "s"], "nightly STUDY --site DIR"),
        (["nightly", "approve", "ilr33-amber", "--site", "s"], "--by and --reason"),
        (["nightly", "ilr33-amber"], "--site"),
        (["nightly", "ilr33-amber", "--site", "s", "--time-limit", "0"], "--time-limit"),
        (["nightly", "ilr33-amber", "--site", "s", "--time-limit", "inf"], "--time-limit"),
    ],
)
def test_bad_usage_is_one_line_and_writes_nothing(tmp_path, monkeypatch, cli, words, expected) -> None:
    monkeypatch.chdir(tmp_path)
    assert expected in cli.refused(*words)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("table", "expected"),
    [
        ("nightly = 1", "nightly: must be a table"),
        ("[nightly]\npdff = true", 'nightly.pdff: unknown key; did you mean "pdf"? Allowed: pdf, tolerance'),
        ("[nightly]\npdf = 1", "nightly.pdf = 1: true or false"),
        ("[nightly]\ntolerance = 3", "nightly.tolerance: must be a table"),
        ('[nightly.tolerance]\n"*" = "much"', "a number of at least 0"),
    ],
)
def test_a_wrong_nightly_table_is_told_in_one_line(tmp_path, table: str, expected: str) -> None:
    path = tmp_path / "s.toml"
    path.write_text(f'{table}\n[study]\nbase = "emps"\n')
    refused(read_study, str(path), words=("s.toml", expected))


def test_any_report_becomes_a_pdf(built, cli) -> None:
    folder, _ = built
    report = next((folder / "site" / "reports").glob("slower-*/*/report.json"))
    cli.text("pdf", report, "--out", folder / "r.pdf")
    assert (folder / "r.pdf").read_bytes().startswith(b"%PDF")
    (folder / "no.json").write_text("{}")
    cli.refused("pdf", folder / "no.json")
