"""Settings in the controller's own objects: there and back without loss, and what is refused."""

from collections.abc import Callable
from dataclasses import replace
from math import pi
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from actuator_lti.design import load_design, read_design_text, with_values, write_design
from actuator_lti.design.model import ControllerObject, ControllerObjects, Filter
from actuator_lti.design.objects import OBJECTS, PER_RPM, calibration, export_objects, import_objects
from actuator_lti.design.settings_file import (
    parse_label,
    parse_settings,
    update_settings_xml,
    write_settings_toml,
    write_settings_xml,
)
from tests.refusals import refused

AMBER = load_design("ilr33-amber")

# What the baseline's data sheet values are in the units of the objects.
EXPORTED = {
    "0x2329.02": 4000, "0x2329.03": 12000, "0x2329.04": 5900, "0x2329.05": 6, "0x2329.09": 9200,
    "0x232A.01": 55, "0x232A.02": 2_250_000, "0x232A.03": 549_779, "0x2342.01": 20, "0x2342.02": 150,
    "0x2344.01": 120_000, "0x2344.02": 150, "0x2348.01": 120, "0x6080.00": 9000, "0x6083.00": 30000,
}  # fmt: skip


def objects(values: dict[str, int], factor: float = 1.0) -> ControllerObjects:
    items = [(parse_label(label), value) for label, value in values.items()]
    made = tuple(ControllerObject(index=i, subindex=s, value=v) for (i, s), v in items)
    return ControllerObjects(velocity_gain_factor=factor, values=made)


def test_the_baseline_in_the_units_of_the_objects_and_what_was_rounded() -> None:
    made = export_objects(AMBER)
    written = {item.label: item.value for item in made.objects.values}
    assert {label: written[label] for label in EXPORTED} == EXPORTED
    rounded = {item.label: item for item in made.rounded}
    assert set(rounded) == {"0x2329.0A", "0x232A.03", "0x6080.00"}
    assert rounded["0x6080.00"].exact == pytest.approx(942.5 * 30 / pi)
    assert rounded["0x232A.03"].exact == pytest.approx(5.25e-6 * 2 * pi / 60 * 1e12)
    assert "rounded to 9000 rpm" in str(rounded["0x6080.00"])


@pytest.mark.parametrize(
    ("constants", "torque", "back_emf", "impedance"),
    [("rms-line", 1.5**-0.5, 2**0.5, 1), ("peak-phase", 2 * 3**-0.5, 3**0.5, 2)],
)
def test_an_ac_motor_is_that_of_the_amperes_of_its_limits(
    constants: Any, torque: float, back_emf: float, impedance: int
) -> None:
    """kM, R and L of the model's DC motor (model.md section 1), whose amperes limits and gains count."""
    motor = replace(AMBER.motor, constants=constants, back_emf_constant_Vs_rad=5.9e-3 * torque / back_emf)
    design = replace(AMBER, motor=motor)
    written = {item.label: item.value for item in export_objects(design).objects.values}
    assert written["0x2329.04"] == round(5900 * torque)
    assert (written["0x2329.05"], written["0x232A.01"]) == (6 * impedance, 55 * impedance)
    assert import_objects(objects({"0x2329.04": written["0x2329.04"]}), design).changed == ()
    other = import_objects(objects({"0x2329.04": 9000, "0x232A.01": 80}), design).design
    assert other.motor.torque_constant_Nm_A == pytest.approx(9e-3 / torque)
    assert other.motor.back_emf_constant_Vs_rad == pytest.approx(9e-3 / back_emf)
    assert other.motor.resistance_ohm == pytest.approx(0.08 / impedance)


def test_what_no_object_holds_is_named() -> None:
    notch = Filter(kind="notch", frequency_rad_s=1e3, width_rad_s=1e3)
    control = AMBER.controller
    velocity = replace(control.velocity, filters=(notch,))
    design = replace(AMBER, controller=replace(control, velocity=velocity))
    filtered = with_values(design, {"control.position.integral_time": 0.5})
    assert (
        "no object holds, so not written: control.velocity.filter.1, control.position.integral_time"
        in export_objects(filtered).notes
    )
    assert not any("no object" in note for note in export_objects(AMBER).notes)


def test_a_design_survives_export_and_import() -> None:
    for factor in (1.0, PER_RPM):
        design = replace(AMBER, objects=ControllerObjects(velocity_gain_factor=factor))
        settings_text = write_settings_xml(export_objects(design).objects)
        back = import_objects(parse_settings(settings_text, "s", factor), design)
        assert back.changed == ()
        assert replace(back.design, objects=design.objects) == design


def test_a_real_set_of_another_motor_with_either_calibration() -> None:
    # 0x2342 1028 mohm, 385 us; 0x2344 344, 371; 0x2348 2: a real export.
    real = {"0x2342.01": 1028, "0x2342.02": 385, "0x2344.01": 344, "0x2344.02": 371, "0x2348.01": 2}
    for factor, gain in ((1.0, 344e-6), (PER_RPM, 344e-6 * 30 / pi)):
        result = import_objects(objects(real, factor), AMBER)
        control = result.design.controller
        assert (control.current.gain_V_A, control.current.integral_time_s) == pytest.approx((1.028, 385e-6))
        assert (control.velocity.gain, control.velocity.integral_time_s) == pytest.approx((gain, 0.0371))
        assert control.position.gain == 2.0
        assert export_objects(result.design).objects == objects(real, factor)
        assert any("calibration factor" in note for note in result.notes)


def test_unknown_objects_are_kept_and_written_back() -> None:
    values = {"0x3000.02": -5, "0x2346.01": 7, "0x2348.01": 50, "0x6084.00": 100, "0x6083.00": 200}
    given_set = objects(values)
    result = import_objects(given_set, AMBER)
    assert [item.label for item in result.kept] == ["0x2346.01", "0x3000.02", "0x6084.00"]
    stored = read_design_text(write_design(result.design), "stored")
    assert export_objects(stored).objects == given_set
    assert any("0x6084" in note for note in result.notes)


def test_a_change_after_the_import_is_exported_and_its_followers_with_it() -> None:
    imported = import_objects(objects({"0x6083.00": 200, "0x6084.00": 200, "0x2348.01": 50}), AMBER).design
    tuned = with_values(imported, {"control.position.gain": 80.0, "limits.acceleration": 300 * 2 * pi})
    written = {item.label: item.value for item in export_objects(tuned).objects.values}
    assert written == {"0x6083.00": 300, "0x6084.00": 300, "0x2348.01": 80}
    notes = export_objects(tuned).notes
    assert any("0x2342.01" in note and "not written" in note for note in notes)
    complete = {item.label for item in export_objects(tuned, complete=True).objects.values}
    assert "0x2342.01" in complete


BOMB = '<!DOCTYPE a [<!ENTITY b "bb"><!ENTITY c "&b;&b;">]><a>&c;</a>'
OUTSIDE = '<!DOCTYPE a [<!ENTITY b SYSTEM "file:///etc/hostname">]><a>&b;</a>'
REFUSING: dict[str, Callable[[Any], object]] = {
    "import": lambda values: import_objects(objects(values), AMBER, "my.xdc"),
    "export": lambda values: export_objects(with_values(AMBER, values)),
    "export a drive": lambda name: export_objects(load_design(name)),
    "settings": lambda text: parse_settings(text, "s"),
    "calibration": calibration,
}


@pytest.mark.parametrize(("what", "given", "says"), [
    ("import", {"0x2342.02": 149}, "0x2342.02 = 149: allowed: 150 to 2600 us"),
    ("import", {"0x2342.02": 2601}, "150 to 2600"),
    ("import", {"0x2344.02": 19}, "20 to 1000"),
    ("import", {"0x2348.01": 251}, "1 to 250"),
    ("import", {"0x2348.01": 0}, "1 to 250"),
    ("import", {"0x6083.00": -1}, "allowed"),
    ("export", {"control.position.gain": 300.0}, r"gain = 300 1/s: object 0x2348.01.*1 to 250"),
    ("export", {"control.current.integral_time": 1e-4}, "150 to 2600"),
    ("export", {"control.velocity.integral_time": 1e-3}, "20 to 1000"),
    ("export", {"motor.inductance": 1e-7}, "motor.inductance = 0.1 uH"),
    ("export a drive", "emps", "current, velocity and position"),
    ("export a drive", "ctms-motor-position", "current, velocity and position"),
    ("calibration", "Hz", '"rad/s" or "rpm"'),
    ("settings", BOMB, "DTD"),
    ("settings", OUTSIDE, "DTD"),
    ("settings", "<a>", "not XML"),
    ("settings", "<a/>", "no CANopenObject"),
    ("settings", "<a>" * 50_000, "not XML"),
    ("settings", "<a>" * 500 + "</a>" * 500, "nested too deeply"),
    ("settings", "<CANopenObject index='xyz'/>", "hexadecimal"),
    ("settings", "<CANopenObject index='2348' actualValue='1.5'/>", "whole number"),
    ("settings", "<CANopenObject index='2348' actualValue='" + "9" * 30 + "'/>", "whole number"),
    ("settings", "<?xml version='1.0' encoding='utf-7'?><a/>", "not XML"),
    ("settings", "[objects]\n", "missing"),
    ("settings", "x = 1", "unknown key"),
    ("settings", '[objects]\n"2348" = 1.5', "whole number"),
    ("settings", '[objects]\n"2348" = true', "whole number"),
    ("settings", '[objects]\n"23481" = 1', "allowed: an object"),
    ("settings", '[objects]\n"2348.01" = { valu = 1 }', "value, name, data_type"),
    ("settings", 'velocity_gain_factor = 0\n[objects]\n"2348.01" = 1', "9.549"),
    ("settings", '[objects]\n"0x2348.01" = 1\n"2348.01" = 2', "each object once"),
    ("settings", '[objects]\n"0x3000.01" = 99999999999999999999', "64 bits"),
])  # fmt: skip
def test_what_cannot_be_held_or_read_is_refused(what: str, given: Any, says: str) -> None:
    refused(REFUSING[what], given, match=says)


@st.composite
def any_objects(draw: st.DrawFn) -> ControllerObjects:
    known = [item for item in OBJECTS.values() if item.index != 0x6080]
    picked = draw(st.lists(st.sampled_from(known), unique_by=lambda item: item.label))
    values = {item.label: draw(st.integers(item.low, min(item.high, 10**6))) for item in picked}
    values.pop("0x2329.04", None)
    if values.get("0x2329.02", 1) > values.get("0x2329.03", 12000) or values.get("0x2329.02", 1) > 12000:
        values["0x2329.02"] = values["0x2329.03"] = max(values["0x2329.02"], values.get("0x2329.03", 1))
    elif "0x2329.03" in values:
        values["0x2329.02"] = min(values["0x2329.03"], values.get("0x2329.02", 1))
    strange = draw(st.dictionaries(st.integers(0x3000, 0x5FFF), st.integers(-(2**31), 2**32), max_size=3))
    made = objects(values).values + tuple(
        ControllerObject(index=i, subindex=1, value=v, name="a <b> & 'c'", data_type="0007")
        for i, v in strange.items()
    )
    order = draw(st.permutations(made))
    return ControllerObjects(velocity_gain_factor=draw(st.sampled_from([1.0, PER_RPM])), values=tuple(order))


@settings(max_examples=100)
@given(any_objects())
def test_settings_survive_design_toml_and_xml(given_set: ControllerObjects) -> None:
    factor = given_set.velocity_gain_factor
    if given_set.values:
        assert parse_settings(write_settings_toml(given_set), "t") == given_set
        assert parse_settings(write_settings_xml(given_set), "x", factor) == given_set
    design = import_objects(given_set, AMBER).design
    stored = read_design_text(write_design(design), design.origin)
    assert stored == design
    if given_set.values:
        assert export_objects(stored).objects == given_set


DEVICE = """<?xml version="1.0" encoding="utf-8"?>
    <!-- a device configuration -->
    <ISO15745ProfileContainer xmlns="http://www.canopen.org/xml/1.0">
      <ISO15745Profile><ProfileHeader><ProfileName>x</ProfileName></ProfileHeader></ISO15745Profile>
      <ISO15745Profile><ProfileBody><ApplicationLayers><CANopenObjectList mandatoryObjects="2">
        <CANopenObject index="1000" name="Device Type" objectType="7" defaultValue="0x12"/>
        <CANopenObject index="2348" name="Position Control" objectType="9" subNumber="2">
          <CANopenSubObject subIndex="00" name="Number of entries" dataType="0005" actualValue="1"/>
          <CANopenSubObject subIndex="01" name="Kv" dataType="0005" actualValue="0x32"/>
        </CANopenObject>
        <CANopenObject index="6083" name="Profile acceleration" dataType="0007" actualValue="250"/>
      </CANopenObjectList></ApplicationLayers></ProfileBody></ISO15745Profile>
    </ISO15745ProfileContainer>"""


def test_a_device_configuration_with_more_in_it_is_read_and_updated_in_place() -> None:
    result = {item.label: (item.value, item.name) for item in parse_settings(DEVICE, "x").values}
    assert result == {
        "0x2348.00": (1, "Number of entries"),
        "0x2348.01": (50, "Kv"),
        "0x6083.00": (250, "Profile acceleration"),
    }
    same, _ = update_settings_xml(DEVICE, ControllerObjects())
    assert parse_settings(same, "x") == parse_settings(DEVICE, "x")
    text, left = update_settings_xml(DEVICE, objects({"0x2348.01": 60, "0x6083.00": 300, "0x2342.01": 20}))
    values = {item.label: item.value for item in parse_settings(text, "x").values}
    assert values == {"0x2348.00": 1, "0x2348.01": 60, "0x6083.00": 300}
    assert left == ("0x2342.01",)
    assert all(words in text for words in ('actualValue="0x3C"', "<ProfileName>x</", 'defaultValue="0x12"'))


def test_the_calibration_torque_feed_forward_and_a_torque_constant_that_sets_the_back_emf_too() -> None:
    """0x2349.01 = 64 is half the torque J/kM times the command's acceleration."""
    assert calibration("rad/s") == 1.0
    assert calibration("rpm") == pytest.approx(9.549, abs=5e-4)
    given_set = objects({"0x2349.01": 64})
    result = import_objects(given_set, AMBER)
    assert result.design.controller.position_loop.acceleration_feedforward == 0.5
    assert any("0x2349.01" in note for note in result.notes)
    assert export_objects(result.design).objects == given_set
    motor = import_objects(objects({"0x2329.04": 11800}), AMBER).design.motor
    assert motor.torque_constant_Nm_A == motor.back_emf_constant_Vs_rad == pytest.approx(0.0118)
