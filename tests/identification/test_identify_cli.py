"""`identify` and `correlate` from the command line: what they print, what they write, how they refuse."""

import json
import re
import shutil
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from actuator_lti.design import design_hash, load_design, write_design
from actuator_lti.design.model import FrictionPoint
from examples.virtual_bench import BenchPlan
from examples.virtual_bench.__main__ import main as simulate
from reports.document import load as load_document
from reports.verdict_summary import judged, walk
from tests.changed import changed
from tests.identification.bench_records import bare, columns_of, motion, write


@pytest.fixture(scope="module")
def campaign(bench: Path, tmp_path_factory) -> Path:
    """The small campaign with one file missing."""
    folder = shutil.copytree(bench, tmp_path_factory.mktemp("campaign"), dirs_exist_ok=True)
    (folder / "run05_torque.csv").unlink()
    return folder / "campaign.toml"


def test_a_campaign_as_json_and_the_example_of_one(campaign: Path, cli, tmp_path) -> None:
    result = cli.data("identify", campaign, "--suggest", "2")
    found = result["result"]
    assert found["runs_listed"] == len(found["fit"]["points"]) + len(found["set_aside"]) == 9
    assert found["set_aside"][0]["id"] == "05"
    assert found["rows_in"] >= found["rows_out"] > 0
    low, high = found["fit"]["parameters"]["CM"]["interval_95"]
    assert low < 1.34e-3 < high
    assert [term["name"] for term in result["shares"]] == ["C0", "Cv", "CM"]
    assert len(result["suggestion"]["runs"]) == 2
    from analyses.records.campaign_file import load_campaign

    (tmp_path / "c.toml").write_text(cli.text("identify", "--example"))
    assert load_campaign(tmp_path / "c.toml").runs[0].load_Nm == 2.0


def test_a_campaign_that_takes_the_torque_constant_as_known_says_so(campaign: Path, cli) -> None:
    """An error of kM that the campaign states is in the intervals; of none all three hang on the design's."""
    stated = campaign.with_name("stated.toml")
    told = campaign.read_text().replace("torque_constant = 0", "torque_constant = 0.01")
    stated.write_text(told)
    known, open_ = (
        {one["id"]: one for one in cli.data("identify", file, "--suggest", "0")["items"]}
        for file in (stated, campaign)
    )
    item = open_["kept-torque_constant"]
    assert item["passed"] is None
    assert "+10 % of every value" in item["reason"]
    assert "kept-torque_constant" not in known


def test_a_campaign_on_paper_as_a_design_and_in_the_report(campaign: Path, tmp_path, cli) -> None:
    out = cli.text("identify", campaign, "--out", tmp_path, "--suggest", "0")
    assert "8 of 9 runs" in out
    assert "run05_torque.csv: cannot be read: no such file" in " ".join(out.split())
    document = load_document(tmp_path / "identification.json")
    figures = {b["figure"] for part in document["sections"] for b in part["blocks"] if b["kind"] == "figure"}
    wanted = {"surface", "residuals", "region", "window"}
    assert {f"identification_{name}" for name in wanted} <= figures
    page = (tmp_path / "identification.html").read_text()
    assert page.count("<svg") >= 4
    identified = load_design(tmp_path / "ilr33-amber-identified.toml")
    tolerance = identified.parameters["friction.load_coefficient"].tolerance
    assert tolerance.kind == "normal"
    assert len(identified.correlations) >= 1
    assert cli.data("margins", tmp_path / "ilr33-amber-identified.toml")["loops"]
    words = ("report", "ilr33-amber", "--no-validation", "--include", tmp_path / "identification.json")
    cli(*words, "--out", tmp_path / "r")
    ids = [part["id"] for part in load_document(tmp_path / "r" / "report.json")["sections"]]
    assert "identification" in ids
    assert ids.count("provenance") == 1


def test_emps_on_the_command_line(emps_file: Path, tmp_path, cli) -> None:
    result = cli.data("identify", emps_file)
    assert round(result["model"]["parameters"]["inertia"]["value"], 4) == 95.1089
    assert cli("correlate", "emps", emps_file, "--out", tmp_path).status == 0
    assert (tmp_path / "correlation.html").stat().st_size > 10_000


def test_the_virtual_bench_writes_54_runs(tmp_path, capsys, monkeypatch) -> None:
    short = BenchPlan(duration_s=2.2)
    monkeypatch.setattr("examples.virtual_bench.campaign.BenchPlan", lambda: short)
    simulate([str(tmp_path), "--seed", "3"])
    assert "54 runs written" in capsys.readouterr().out
    assert len(list(tmp_path.glob("run*_drive.csv"))) == len(list(tmp_path.glob("run*_torque.csv"))) == 54
    assert "seed 3" in (tmp_path / "campaign.toml").read_text()


@pytest.mark.parametrize(("arguments", "reason"), [
    ((), "--force"),
    (("--force", "--design", "emps"), "rotary drive"),
    (("--sweep", "--design", "fin"), "current loop and a coupling"),
    (("--sweep", "--design", "ilr33-amber"), "current loop and a coupling"),
])  # fmt: skip
def test_a_bench_that_is_there_or_a_drive_that_it_cannot_take(arguments, reason, tmp_path, capsys) -> None:
    (tmp_path / "campaign.toml").touch()
    with pytest.raises(SystemExit, match="2"):
        simulate([str(tmp_path), *arguments])
    assert reason in capsys.readouterr().err


def test_a_cutoff_of_nothing_is_one_line_and_status_2(tmp_path, cli) -> None:
    time = np.arange(99) / 100
    record = write(tmp_path / "r.csv", {"time_s": time, "position_m": time % 0.07, "force_N": time % 0.05})
    said = cli.refused("identify", record, "--design", "emps", "--cutoff", "0")
    assert "0 Hz: must be between 0 and 50 Hz" in said


def test_terminal_page_json_and_status_say_not_proven_alike(tmp_path, cli) -> None:
    """Of a current alone kM is not proven: nothing fails, so 0; the hash is that of the file written."""
    write(tmp_path / "r.csv", columns_of(motion(2)))
    words = ("identify", tmp_path / "r.csv", "--design", "ilr33-amber", "--out", tmp_path)
    told, shown = cli.data(*words), " ".join(cli.text(*words).split())
    page = json.loads((tmp_path / "identification.json").read_text())
    of_page = {item["id"]: item["verdict"] for item in judged(walk(page["sections"][0]))}
    assert of_page == {item["id"]: item["verdict"] for item in told["items"]}
    assert Counter(of_page.values())["not proven"] == 2
    assert (told["verdict"], told["passed"]) == (page["verdict"]["verdict"], page["verdict"]["passed"])
    assert (told["verdict"], told["passed"]) == ("not proven", True)
    assert shown.startswith("PASS, 2 not proven ilr33-amber: ")
    assert "Not proven, which alone does not fail: Load friction; Torque constant kM." in shown
    (against,) = (one for one in page["sections"][0]["blocks"] if "numbers" in one.get("caption", ""))
    kept = {row["name"]: row["design"] for row in against["rows"] if row["agrees"] == "kept"}
    assert kept == {"Load friction": 1.34e-3, "Torque constant kM": 5.9e-3}
    written = design_hash(load_design(tmp_path / "ilr33-amber-identified.toml"))
    assert told["design"]["hash"] == written
    assert f"Design found, SHA-256 {written}" in shown
    points = tuple(FrictionPoint(speed_rad_s=v, torque_Nm=4e-3) for v in (0.0, 900.0))
    with_map = {"points": points, "dry_torque_Nm": 0.0, "viscous_Nms_rad": 0.0}
    text = write_design(changed(bare("ilr33-amber"), friction=with_map))
    (tmp_path / "map.toml").write_text(text)
    for form in ((), ("--friction", "per-direction")):  # the design's map is neither found nor kept
        told = cli.text("identify", tmp_path / "r.csv", "--design", tmp_path / "map.toml", *form)
        assert "Friction map of the design" in told
        assert not re.search(r"(Viscous|Dry) friction.* kept", told)


@pytest.mark.parametrize("accept", [(), ("--accept",)])
def test_a_record_that_no_design_can_come_of_fails_with_its_tables(accept, cli, tmp_path) -> None:
    """A current a thousandth of what it is: less inertia in all than the gears have alone."""
    columns = columns_of(motion(2))
    write(tmp_path / "r.csv", {**columns, "current_A": 1e-3 * columns["current_A"]})
    words = ("identify", tmp_path / "r.csv", "--design", "ilr33-amber", "--out", tmp_path, *accept)
    told = " ".join(cli.text(*words, status=1).split())
    assert "No design comes of it." in told
    assert "SHA-256" not in told
    assert "factor 1000" in told
    assert not [*tmp_path.glob("*.toml")]
    page = json.loads((tmp_path / "identification.json").read_text())
    assert {item["id"]: item["verdict"] for item in judged(walk(page["sections"][0]))}["made"] == "not met"
