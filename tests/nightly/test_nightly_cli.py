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


def test_nights_of_real_designs_their_approval_and_a_report_as_pdf(tmp_path, cli) -> None:
    """The first one on worker processes; it names the broken variant and builds the others."""
    (tmp_path / "study.toml").write_text(STUDY)
    words = [tmp_path / "study.toml", "--site", tmp_path / "site", "--no-validation"]
    command = [Path(sys.executable).with_name("actuator-lti"), "nightly", *words]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == 1, done.stderr
    assert done.stdout.startswith("FAIL  night 1: 1 no result")
    said = " ".join(done.stdout.split())  # where a cell is wrapped depends on the length of the folder's name
    assert all(words in said for words in ("no <b>motor</b>", "motor.resistance = ", "allowed: above 0"))
    summary = json.loads((tmp_path / "site" / "summary.json").read_text())
    names = {"ctms-motor-position", "slower", "no <b>motor</b>", "Comparison of all variants"}
    assert {d["name"] for d in summary["designs"]} == names
    assert summary["counts"]["broken"] == 1
    check_whole(tmp_path / "site")
    assert "(3 unchanged)" in cli.text("nightly", *words, "--workers", 1, status=1)
    cli("nightly", "approve", *words, "--by", "A. Engineer", "--reason", "review 3")
    good = [d for d in cli("nightly", *words, "--json").data["designs"] if d["state"] != "broken"]
    assert {d["approved_by"] for d in good} == {"A. Engineer"}
    # any report becomes a PDF
    report = next((tmp_path / "site" / "reports").glob("slower-*/*/report.json"))
    cli.text("pdf", report, "--out", tmp_path / "r.pdf")
    assert (tmp_path / "r.pdf").read_bytes().startswith(b"%PDF")
    (tmp_path / "no.json").write_text("{}")
    cli.refused("pdf", tmp_path / "no.json")


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
