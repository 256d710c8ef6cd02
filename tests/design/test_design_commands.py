"""The commands around design files, as a user calls them."""

import pytest

from actuator_lti.design import load_design, shipped_designs, warnings_of
from reports.cli.main import main


def test_designs_lists_all_for_people_and_machines(cli) -> None:
    shown = cli.text("designs")
    listed = cli.data("designs")["designs"]
    assert [row["name"] for row in listed] == list(shipped_designs())
    assert all(name in shown for name in shipped_designs())
    assert listed[0]["loops"] == ["current PI", "velocity PI", "position P"]


def test_init_writes_a_design_that_reads_without_a_warning_but_its_examples(tmp_path) -> None:
    path = tmp_path / "fin-1.toml"
    assert main(["init", str(path)]) == 0
    design = load_design(path)
    assert design.name == "fin-1"
    assert warnings_of(design) == ()
    assert path.read_text().count("#") > 30
    assert [item.name for item in tmp_path.iterdir()] == ["fin-1.toml"]


@pytest.mark.parametrize("name", shipped_designs())
def test_init_starts_from_a_shipped_design_with_its_comments(tmp_path, name: str) -> None:
    path = tmp_path / "copy.toml"
    assert main(["init", str(path), "--from", name]) == 0
    copy = load_design(path)
    assert copy.name == "copy"
    assert copy.motor == load_design(name).motor
    assert path.read_text().startswith("# ")


@pytest.mark.parametrize("kind", ["joint", "ballscrew", "fin", "servo-axis"])
def test_init_writes_a_typical_drive_of_a_kind(tmp_path, kind: str) -> None:
    path = tmp_path / "mine.toml"
    assert main(["init", str(path), "--kind", kind]) == 0
    design = load_design(path)
    assert design.name == "mine"
    assert (design.coupling is None) == (kind == "servo-axis")
    assert (design.axis == "linear") == (kind == "ballscrew")


def test_init_does_not_overwrite_without_being_told_and_a_bad_source_writes_nothing(tmp_path, cli) -> None:
    path, bad = tmp_path / "mine.toml", tmp_path / "bad.toml"
    path.write_text("precious")
    assert "--force" in cli.refused("init", path)
    assert path.read_text() == "precious"
    bad.write_text("[design]\nname = 3\n")
    for source in ("nope", str(bad)):
        status, _, error = cli("init", tmp_path / "new.toml", "--from", source)
        assert status == 2
        assert all(line.startswith("actuator-lti: ") for line in error.splitlines())
    assert {*tmp_path.iterdir()} == {path, bad}
    assert main(["init", str(path), "--force"]) == 0
    assert load_design(path).name == "mine"


def test_settings_go_out_and_come_in(tmp_path, cli) -> None:
    xdc, toml = tmp_path / "s.xdc", tmp_path / "d.toml"
    ran = cli("objects", "export", "--out", xdc)
    assert (ran.status, "rounded: 0x6080.00 (limits.speed)" in ran.err) == (0, True)
    assert main(["objects", "import", str(xdc), "--out", str(toml)]) == 0
    assert load_design(toml).controller == load_design("ilr33-amber").controller
    report = cli.data("objects", "import", xdc, "--velocity-gain-per", "rpm")
    assert list(report["changed"]) == ["control.velocity.gain"]
    assert any("9.549" in note for note in report["notes"])
    ran = cli("objects", "export", "--velocity-gain-per", "rpm", "--out", xdc, "--force")
    assert "has no place for that factor: import it with --velocity-gain-per rpm" in ran.err
