"""The commands around design files, as a user calls them; the catalogue of parts, each against its sheet."""

import math
from itertools import cycle

import pytest

from actuator_lti.design import load_design, shipped_designs, warnings_of
from analyses.margins import margins
from reports.cli.main import main
from reports.design_files.parts import part, parts


def drive(path, *parts_: str):
    assert main(["init", str(path / "mine.toml"), *parts_]) == 0
    return load_design(path / "mine.toml")


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
    copy = drive(tmp_path, "--from", name)
    assert (copy.name, copy.motor) == ("mine", load_design(name).motor)
    assert (tmp_path / "mine.toml").read_text().startswith("# ")


@pytest.mark.parametrize("kind", ["joint", "ballscrew", "fin", "servo-axis"])
def test_init_writes_a_typical_drive_of_a_kind(tmp_path, kind: str) -> None:
    design = drive(tmp_path, "--kind", kind)
    assert design.name == "mine"
    assert (design.coupling is None) == (kind == "servo-axis")
    assert (design.axis == "linear") == (kind == "ballscrew")


def test_init_does_not_overwrite_without_being_told_and_a_bad_source_writes_nothing(tmp_path, cli) -> None:
    path, bad = tmp_path / "mine.toml", tmp_path / "bad.toml"
    path.write_text("precious")
    assert "--force" in cli.refused("init", path)
    assert path.read_text() == "precious"
    for words in (["init"], ["objects", "export", "--out"]):  # wrote TOML there
        said = cli.refused(*words, tmp_path / "new.json")
        assert "new.json: would hold TOML, no JSON; allowed: another name" in said
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


MOTORS, GEARS = list(parts()["motor"]), list(parts()["gear"])
RPM = math.pi / 30.0


def test_the_catalogue_has_twenty_of_each_with_a_source() -> None:
    assert min(len(MOTORS), len(GEARS)) >= 20
    for kind, names in (("motor", MOTORS), ("gear", GEARS)):
        for entry in (part(kind, name) for name in names):
            assert all(entry[key] for key in ("title", "source"))
            assert entry["grade"] in {"A", "B", "C"}


@pytest.mark.parametrize("name", MOTORS)
def test_a_motor_turns_as_fast_as_its_sheet_says(name: str, tmp_path) -> None:
    """U = R i0 + kE w0, w0 being the sheet's own figure; and kM = kE in SI, of the equivalent DC motor."""
    design = drive(tmp_path, "--motor", name)
    motor, entry = design.effective_motor, part("motor", name)
    i0 = float(entry.get("no_load_current", "0 mA").removesuffix(" mA")) * 1e-3
    stated = float(entry["no_load_speed"].removesuffix(" rpm")) * RPM
    assert motor.torque_constant_Nm_A == pytest.approx(motor.back_emf_constant_Vs_rad, rel=0.01)
    reached = (design.limits.voltage_V - motor.resistance_ohm * i0) / motor.back_emf_constant_Vs_rad
    assert reached == pytest.approx(stated, rel=0.03)
    friction = design.friction.dry_torque_Nm + design.friction.viscous_Nms_rad * stated
    if "no_load_current" in entry:
        assert friction == pytest.approx(motor.torque_constant_Nm_A * i0)
    else:
        assert design.parameters["friction.dry_torque"].grade == "X"
    assert design.limits.speed_rad_s < stated
    assert design.limits.continuous_current_A < design.limits.voltage_V / motor.resistance_ohm


@pytest.mark.parametrize(("motor", "gear"), list(zip(MOTORS, cycle(GEARS), strict=False)))
def test_a_motor_with_a_gear_has_margins(motor: str, gear: str, tmp_path) -> None:
    design = drive(tmp_path, "--motor", motor, "--gear", gear)
    assert warnings_of(design) == ()
    found = margins(design)
    assert found.passed
    assert {"current", "velocity", "position"} <= set(found.loops)
    entry = part("gear", gear)
    assert (design.coupling is not None) == ("stiffness" in entry)
    if design.coupling is not None:
        lines = (tmp_path / "mine.toml").read_text().splitlines()
        assert next(line for line in lines if line.startswith("torque_2 = ")).count(entry["torque_2"]) == 1
        assert design.coupling.stiffness_Nm_rad < design.coupling.stiffness_3_Nm_rad


def test_a_gear_alone_keeps_the_motor(tmp_path) -> None:
    design = drive(tmp_path, "--gear", "harmonic-drive-hfuc-32-100")
    plain = drive(tmp_path, "--force")
    assert (design.motor, design.friction.dry_torque_Nm) == (plain.motor, plain.friction.dry_torque_Nm)
    assert (design.coupling.torque_1_Nm, design.coupling.torque_2_Nm) == (29.0, 108.0)
    assert margins(design).passed
