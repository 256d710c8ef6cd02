"""The catalogue of motors and gears: each against its own sheet, and as a drive."""

import math
from itertools import cycle

import pytest

from actuator_lti.design import load_design, warnings_of
from analyses.margins import margins
from reports.cli.main import main
from reports.design_files.parts import part, parts

MOTORS, GEARS = list(parts()["motor"]), list(parts()["gear"])
RPM = math.pi / 30.0


def drive(path, *parts_: str):
    assert main(["init", str(path / "mine.toml"), *parts_]) == 0
    return load_design(path / "mine.toml")


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
