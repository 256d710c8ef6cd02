"""Settings of other makers' controllers become the controller section of a design.

Truth: the makers' own control laws, worked out by hand for one motor: at an error of one unit, what
voltage or current the drive gives, in volts line-line and in amperes of the equivalent DC motor.
"""

from math import pi, sqrt
from pathlib import Path

import pytest

from actuator_lti.design import load_design, read_design_text, with_overrides, write_design
from actuator_lti.design.controller_files import import_controller_file
from actuator_lti.design.loader import design_from_tree
from actuator_lti.design.model import Design
from actuator_lti.design.writing import design_tree
from actuator_lti.errors import InputError
from reports.cli.main import main

BASE = with_overrides(load_design("ilr33-amber"), {"limits.continuous_current": "1 A"})

ODRIVE = """{"axis0": {
 "motor": {"config": {"phase_inductance": 5.5e-5, "phase_resistance": 0.13, "torque_constant": 0.04,
                      "current_lim": 20.0, "current_control_bandwidth": 1000.0, "pole_pairs": 7}},
 "controller": {"config": {"pos_gain": 20.0, "vel_gain": 0.16, "vel_integrator_gain": 0.32,
                           "vel_limit": 10.0, "enable_vel_limit": true}},
 "encoder": {"config": {"cpr": 8192, "bandwidth": 1000.0}}}}"""
VESC = """<?xml version="1.0"?><MCConfiguration><foc_current_kp>0.0138</foc_current_kp>
<foc_current_ki>18.1</foc_current_ki><s_pid_kp>0.004</s_pid_kp><s_pid_ki>0.008</s_pid_ki>
<l_current_max>60</l_current_max><l_max_erpm>1000000</l_max_erpm><si_motor_poles>14</si_motor_poles>
<foc_f_zv>25000</foc_f_zv></MCConfiguration>"""
SIMPLEFOC = """
  motor.torque_controller = TorqueControlType::foc_current;
  // motor.PID_velocity.P = 9;
  motor.PID_velocity.P = 0.5f;
  motor.PID_velocity.I = 10;
  motor.LPF_velocity.Tf = 0.005f;
  motor.P_angle.P = 20;
  motor.PID_current_q.P = 3;
  motor.PID_current_q.I= 300;
  motor.current_limit = 2;
  driver.voltage_power_supply = 24;
"""
EPOS = "\n".join(
    f"[{index}{f'sub{sub}' if sub else ''}]\nParameterValue={value}"
    for index, sub, value in (
        ("30A0", 1, 369404), ("30A0", 2, 466187), ("30A2", 1, "0xBD52B"), ("30A2", 2, 23963356),
        ("30A1", 1, 1500000), ("30A1", 2, 780000), ("30A1", 3, 16000), ("3001", 1, 3210),
        ("3001", 2, 6000), ("6080", 0, 6000),
    )
)  # fmt: skip
SUB = '<CANopenSubObject subIndex="01" actualValue="369404"/>'
XDC = f'<a><CANopenObject index="30A0">{SUB}</CANopenObject></a>'
PEAK = sqrt(3) / 2


def without(stage: str) -> Design:
    """The base without a stage; what feeds its place then has a gain of that place's unit."""
    tree = {key: value for key, value in design_tree(BASE).items() if key not in ("requirement", "objects")}
    del tree["control"][stage]
    if stage != "position":
        outer, unit = ("velocity", "V*s/rad") if stage == "current" else ("position", "A/rad")
        tree["control"][outer] = {"gain": f"1 {unit}"}
    return design_from_tree(tree, "base")


def imported(tmp_path: Path, text: str, base: Design = BASE) -> tuple[Design, tuple[str, ...]]:
    (tmp_path / "settings").write_text(text)
    result = import_controller_file(tmp_path / "settings", base)
    assert result is not None
    assert read_design_text(write_design(result.design), result.design.origin) == result.design
    return result.design, result.notes


def test_odrive(tmp_path: Path) -> None:
    """Turn/s per turn; N m per turn/s over N m per A peak; tracking critically damped at 8 kHz."""
    design, notes = imported(tmp_path, ODRIVE)
    control = design.controller
    assert control.position.gain == 20.0
    assert control.velocity.gain == pytest.approx(PEAK * 0.16 / 0.04 / (2 * pi), rel=1e-12)
    assert control.velocity.integral_time_s == pytest.approx(0.5, rel=1e-12)
    assert control.current.gain_V_A == pytest.approx(2 * 1000 * 5.5e-5, rel=1e-12)
    assert control.current.integral_time_s == pytest.approx(5.5e-5 / 0.13, rel=1e-12)
    assert (control.period_s, design.encoder.speed, design.encoder.bandwidth_rad_s) == (
        1.25e-4,
        "tracking",
        1e3,
    )
    assert design.limits.speed_rad_s == pytest.approx(20 * pi)
    assert "pos_gain = 20.0" in design.parameters["control.position.gain"].source
    assert notes[-1].endswith("axis0.motor.config.pole_pairs, axis0.controller.config.enable_vel_limit")
    newer = ODRIVE.replace('{"axis0": {', '{"axis0.config.encoder_bandwidth": 900.0, "axis0": {')
    assert (
        imported(tmp_path, newer.replace('"bandwidth": 1000.0', '"x": 1'))[0].encoder.bandwidth_rad_s == 900.0
    )


def test_vesc(tmp_path: Path) -> None:
    """iq = error in electrical rpm times s_pid_kp/20 times l_current_max; volts and amperes of a phase."""
    design, notes = imported(tmp_path, VESC)
    erpm_per_rad_s = 7 * 60 / (2 * pi)
    gain = PEAK * erpm_per_rad_s * 0.004 / 20 * 60
    assert design.controller.velocity.gain == pytest.approx(gain, rel=1e-12)
    assert design.controller.velocity.integral_time_s == pytest.approx(0.5)
    assert design.controller.current.gain_V_A == pytest.approx(0.0138 * sqrt(3) / PEAK, rel=1e-12)
    assert design.controller.current.integral_time_s == pytest.approx(0.0138 / 18.1)
    assert design.controller.position == BASE.controller.position
    assert any("faster than the supply" in note for note in notes)
    assert notes[-1].endswith(": foc_f_zv")


def test_simplefoc_by_current_and_by_voltage(tmp_path: Path) -> None:
    design, notes = imported(tmp_path, SIMPLEFOC)
    assert design.controller.velocity.gain == pytest.approx(PEAK * 0.5)
    assert design.controller.velocity.integral_time_s == pytest.approx(0.05)
    assert design.controller.current.gain_V_A == pytest.approx(6.0)
    assert (design.encoder.filter_time_s, design.limits.voltage_V) == (0.005, 24.0)
    assert notes[-1].endswith(": none")
    by_voltage = SIMPLEFOC.replace("foc_current", "voltage")
    with pytest.raises(InputError, match=r"by voltage; allowed: a design without \[control.current\]"):
        imported(tmp_path, by_voltage)
    design, _ = imported(tmp_path, by_voltage, without("current"))
    assert design.controller.velocity.gain == pytest.approx(sqrt(3) * 0.5)


def test_epos4(tmp_path: Path) -> None:
    """uV/A and uV/(A ms); uA s/rad and uA/rad; uA/rad, uA/(rad s) and uA s/rad: in SI."""
    with pytest.raises(InputError, match="no velocity loop inside its position loop"):
        imported(tmp_path, EPOS)
    speed, _ = imported(tmp_path, EPOS, without("position"))
    assert speed.controller.velocity.gain == pytest.approx(0.775467)
    assert speed.controller.velocity.integral_time_s == pytest.approx(775467 / 23963356)
    assert speed.controller.current.integral_time_s == pytest.approx(369404 / 466187 * 1e-3)
    assert (speed.controller.velocity.every, speed.controller.period_s) == (10, 4e-5)
    angle, notes = imported(tmp_path, EPOS, without("velocity"))
    place = angle.controller.position
    assert place.gain == pytest.approx(1.5)
    assert (place.integral_time_s, place.derivative_time_s) == pytest.approx((1.5 / 0.78, 0.016 / 1.5))
    assert notes[-1].endswith(": 0x30A2.01, 0x30A2.02")
    assert imported(tmp_path, XDC, without("position"))[0].controller.current.gain_V_A == pytest.approx(
        0.369404
    )


def test_the_command_says_what_it_took_and_what_it_left(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "vesc.xml").write_text(VESC)
    out = tmp_path / "mine.toml"
    assert main(["objects", "import", str(tmp_path / "vesc.xml"), "--out", str(out)]) == 0
    said = capsys.readouterr().err
    assert "s_pid_kp = 0.004, l_current_max = 60" in said
    assert "not understood, of 8 settings: foc_f_zv" in said
    assert load_design(out).controller.velocity.gain > 0.0
