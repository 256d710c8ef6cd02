"""Drives written as their data sheets have them."""

from math import pi, sqrt

import control
import pytest

from actuator_lti.design import (
    Design,
    design_tree,
    load_design,
    parameter_value,
    read_design_text,
    tolerances,
    warnings_of,
    with_overrides,
    with_values,
    write_design,
)
from actuator_lti.design.field import Structure
from actuator_lti.design.fields import FIELDS
from actuator_lti.design.key_reference import explained
from actuator_lti.design.loader import design_from_tree
from actuator_lti.design.model import Gear
from actuator_lti.design.stated import Frame
from actuator_lti.design.writing import read_value, value_as_stated
from actuator_lti.drive.facts import capability, steady_torque_Nm
from actuator_lti.drive.sheet_figures import sheet_figures
from actuator_lti.errors import InputError, Mistakes
from analyses.linear.loop_survey import survey_loops
from analyses.studies.sampling import sampler_of
from nonlinear import commands, simulate
from reports.live.keys import named
from reports.sections import forms
from tests.changed import changed
from tests.refusals import refused

AMBER = load_design("ilr33-amber")
SERVO_TEXT = """
[design]
name = "servo"
[motor]
constants = "rms-line"
resistance = "4.6 ohm"
inductance = "13 mH"
torque_constant = "0.93 N*m/A"
back_emf_constant = "59.9 V/krpm"
rotor_inertia = "0.59 kg*cm^2"
[friction]
dry_torque = "0.02 N*m"
viscous = "1e-5 N*m*s/rad"
[limits]
voltage = "320 V"
[control]
period = "62.5 us"
computing_delay = "31.25 us"
[control.current]
gain = "25 V/A dc"
integral_time = "3 ms"
[control.velocity]
gain = "0.04 A dc*s/rad"
[validation]
full_deflection = "90 deg"
"""
SERVO = read_design_text(SERVO_TEXT, "servo")
# a 24 V motor with a planetary gear: no-load current and efficiency (model.md section 11)
SHEET = """
[design]
name = "sheet"
[motor]
resistance = "0.299 ohm"
inductance = "0.082 mH"
torque_constant = "30.2 mN*m/A"
back_emf_constant = "317 rpm/V"
rotor_inertia = "142 g*cm^2"
no_load_current = "137 mA"
no_load_speed = "7580 rpm"
[[gear]]
name = "first"
ratio = "43:1"
efficiency = "80 %"
[[gear]]
name = "second"
ratio = 2
efficiency = 0.9
[load]
inertia = "1e-3 kg*m^2"
path = "back-drivable"
[limits]
voltage = "48 V"
[control]
period = "100 us"
computing_delay = "0 s"
"""
SPEED = 7580 * pi / 30


def sheet(*changed: str) -> Design:
    """The drive of the sheet with one text for another."""
    return read_design_text(SHEET.replace(*changed) if changed else SHEET, "sheet")


def test_a_speed_constant_is_a_back_emf_constant_upside_down() -> None:
    design = sheet()
    assert design.motor.back_emf_constant_Vs_rad == pytest.approx(60.0 / (2 * pi * 317), rel=1e-12)
    assert design.parameters["motor.back_emf_constant"].text == "317 rpm/V"
    for wrong in ("270 rpm/V", "-317 rpm/V", "3 rpm/A", "0 rpm/V"):
        with pytest.raises(InputError, match=r"motor\.back_emf_constant = .*allowed: "):
            with_overrides(design, {"motor.back_emf_constant": wrong})


def test_a_width_or_bound_upside_down_is_refused_with_what_it_is() -> None:
    """10 of 317 rpm/V are 3.155 %; as a back-EMF constant of 10 rpm/V they were 32 times the value.

    At least 300 rpm/V is at most 60/(2 pi 300) = 0.031831 V s/rad.
    """
    speed = {"value": "317 rpm/V", "tolerance": {"kind": "normal", "std": "10 rpm/V"}}
    motor = {"motor.torque_constant": "30.2 mN*m/A", "motor.back_emf_constant": speed}
    with pytest.raises(InputError, match=r'upside down; allowed: a share, here "3.155 %", or V\*s/rad'):
        with_overrides(AMBER, motor)
    bounds = {"kind": "truncated-normal", "std": "3 %", "lower": "300 rpm/V", "upper": "330 rpm/V"}
    with pytest.raises(InputError, match=r'lower = .* upside down; allowed: upper = "0\.031831 V\*s/rad"'):
        with_overrides(AMBER, {**motor, "motor.back_emf_constant": {**speed, "tolerance": bounds}})
    for width, std in (("1 mV*s/rad", 1e-3), ("3 %", 0.03 * 60.0 / (2 * pi * 317))):
        speed["tolerance"]["std"] = width
        held = with_overrides(AMBER, motor).parameters["motor.back_emf_constant"].tolerance
        assert held.std == pytest.approx(std, rel=1e-14)


def test_an_ac_servo_runs_as_fast_as_its_bus_allows() -> None:
    """U = R i + sqrt(2) k_rms w with i = sqrt(3/2) I_rms, and the torque of friction at that speed."""
    w = capability(SERVO).output_rate_rad_s
    kE = sqrt(2.0) * 59.9 / (1000 * 2 * pi / 60)
    torque = 0.02 + 1e-5 * w
    assert 4.6 * torque / (0.93 / sqrt(1.5)) + kE * w == pytest.approx(320.0, rel=1e-9)


def test_an_undamped_spring_is_said_and_has_its_forms() -> None:
    """Without damping the antiresonance is a zero on the axis, whose phase no following can cross."""
    tree, said = design_tree(load_design("joint")), "coupling.damping: 0, and no load.friction"
    assert said not in str(warnings_of(design_from_tree(tree, "joint")))
    del tree["load"]["friction"], tree["coupling"]["damping"]
    design = design_from_tree(tree, "joint")
    assert said in str(warnings_of(design))
    survey = survey_loops(design)
    assert forms.section(survey.forms, survey.refused)["blocks"][0]["kind"] == "figure"


@pytest.mark.parametrize(("path", "text", "value"), [
    ("limits.peak_current", "12 A rms", 12 * sqrt(1.5)),
    ("limits.peak_current", "12 Arms", 12 * sqrt(1.5)),
    ("limits.peak_current", "12 A peak", 12 * sqrt(3) / 2),
    ("limits.peak_current", "12 Apk", 12 * sqrt(3) / 2),
    ("limits.peak_current", "12 Ap", 12 * sqrt(3) / 2),
    ("limits.peak_current", "12 A dc", 12.0),
    ("control.position.gain", "20 Hz", 40 * pi),
    ("control.velocity.gain", "0.04 A rms*s/rad", 0.04 * sqrt(1.5)),
    ("control.current.gain", "25 V/Arms", 25 / sqrt(1.5)),
    ("control.current.gain", "12.5 V/A phase", 25.0),  # L w of a phase is half of L w line-line
    ("motor.torque_constant", "0.93 Nm/Arms", 0.93),
    ("motor.back_emf_constant", "59.9 Vrms/1000rpm", 59.9 * 60 / (2000 * pi)),
    ("motor.torque_constant", f"{0.93 / sqrt(2)} Nm/Apk", 0.93),
    ("motor.torque_constant", f"{0.93 / sqrt(1.5)} Nm/A dc", 0.93),
    ("motor.back_emf_constant", f"{59.9 * sqrt(2)} Vp/1000rpm", 59.9 * 60 / (2000 * pi)),
    ("motor.back_emf_constant", f"{59.9 * sqrt(2)} Vpeak/1000rpm", 59.9 * 60 / (2000 * pi)),
    ("control.period", "16 kHz", 62.5e-6),
])  # fmt: skip
def test_amperes_rms_and_peak_are_those_of_the_model(path: str, text: str, value: float) -> None:
    """i = sqrt(3/2) I_rms = sqrt(3)/2 I_peak (model.md section 1); the motor as its sheet says."""
    design = with_overrides(SERVO, {path: text})
    assert parameter_value(design, path) == pytest.approx(value, rel=1e-14)
    assert not any(line.startswith(path) for line in warnings_of(design))


@pytest.mark.parametrize(("design", "path", "bad"), [
    (AMBER, "motor.torque_constant", "0.1 Nm/Apk"),
    (AMBER, "limits.voltage", "230 V AC"),
    (AMBER, "limits.peak_current", "5 A rms"),
    (SERVO, "limits.voltage", "230 Vrms"),
    (SERVO, "limits.peak_current", "5 A phase"),
])  # fmt: skip
def test_a_convention_that_the_motor_has_not_is_refused(design: Design, path: str, bad: str) -> None:
    refused(with_overrides, design, {path: bad}, words=(f"{path} = ", "allowed: "))


@pytest.mark.parametrize(("path", "text", "allowed"), [
    ("limits.peak_current", "12 A", r"A rms \(its data sheet's\) or A dc"),
    ("control.velocity.gain", "0.04 A*s/rad", r"A rms\*s/rad .* or A dc\*s/rad"),
    ("control.current.gain", "25 V/A", "V/A rms .* or V/A dc .*: V/A phase"),
])  # fmt: skip
def test_amperes_of_an_ac_motor_that_say_nothing_are_refused(path: str, text: str, allowed: str) -> None:
    """Read as another's they are sqrt(3/2) off; a plain number is SI, of the model, and is written so."""
    with pytest.raises(InputError, match=f"{path} = .*allowed: {allowed}"):
        with_overrides(SERVO, {path: text})
    again = read_design_text(write_design(with_values(SERVO, {path: 30.5})), "again")
    assert parameter_value(again, path) == 30.5


@pytest.mark.parametrize(("text", "amperes"), [
    ("2.74 Arms", 2.74 * sqrt(1.5)),
    ("9.5 A pk", 9.5 * sqrt(3) / 2),
    ("6.72 A rms", 6.72 * sqrt(1.5)),
    ("5.4 A dc", 5.4),
    ("8.2 A", None),
])  # fmt: skip
@pytest.mark.parametrize("quantity", ["motor_current", "duty_current"])
def test_a_required_current_is_read_as_limits_read_theirs(text, amperes, quantity) -> None:
    asked = f'{SERVO_TEXT}[[requirement]]\nid = "i"\nquantity = "{quantity}"\nmaximum = "{text}"\n'
    if amperes is None:
        refused(read_design_text, asked, words=("requirement.i.maximum = ", "A rms ", " or A dc "))
        return
    design = read_design_text(asked)
    assert design.requirements[0].maximum == pytest.approx(amperes, rel=1e-14)
    assert read_design_text(write_design(design)) == design


def test_a_design_is_explained_as_written_as_read_and_as_the_model_has_it(cli) -> None:
    items = {item.path: item for item in explained(SERVO)}
    assert items["motor.torque_constant"].written == "0.93 N*m/A"
    assert items["motor.torque_constant"].model == f"kM = {0.93 / sqrt(1.5):.9g} N*m/A dc"
    axis = {item.path: item for item in explained(load_design("ballscrew"))}
    assert axis["limits.peak_current"].read == "14.7 A dc"
    assert items["motor.rotor_inertia"].read == "5.9e-05 kg*m^2"
    told = {"written": "5.9 mN*m/A", "read": "0.0059 N*m/A", "model": "kM = 0.0059 N*m/A"}
    asked = cli.data("keys", "torque_constant", "--explain", "ilr33-amber")["keys"]
    assert asked == [{"path": "motor.torque_constant", **told}]
    assert "In the model as" in cli.text("keys", "--explain", "ilr33-amber")
    gains = control.ss([], [], [], [[2.0, -0.5]], 6.25e-5)
    own = SERVO.with_law("velocity", gains, inputs=["error", "current"])
    law = {item.path: item for item in explained(own)}["control.velocity.law"]
    assert law.read == "error in rad/s, current in A dc"
    assert law.model == "gives the current in A dc"
    # what the friction was read from: 137 mA, 7580 rpm
    sheet_s = {item.path: item.read for item in explained(sheet("[[gear]]", "[[gear]]", 1))}
    assert (sheet_s["motor.no_load_current"], sheet_s["motor.no_load_speed"]) == (
        "0.137 A",
        "793.775744 rad/s",
    )


def test_a_filter_is_added_behind_those_that_there_are() -> None:
    one = AMBER.add_filter("velocity", kind="notch", frequency="120 Hz", width="60 Hz", depth=0.1)
    two = one.add_filter("velocity", kind="lowpass", frequency=500.0, on="speed")
    assert [item.kind for item in two.controller.velocity.filters] == ["notch", "lowpass"]
    assert two.controller.velocity.filters[0].width_rad_s == pytest.approx(120 * pi, rel=1e-15)
    assert two.controller.velocity.filters[1].frequency_rad_s == 500.0
    deeper = with_overrides(two, {"control.velocity.filter.1.depth": 0.2})
    assert [item.depth for item in deeper.controller.velocity.filters[:1]] == [0.2]
    assert read_design_text(write_design(deeper), deeper.origin) == deeper
    for bad, words in (
        ({"stage": "current"}, 'stage = "current": has no filters; allowed: "velocity"'),
        ({"stage": "velocity", "kind": "notch", "frequency": "1 V"}, "filter.1.frequency"),
        ({"stage": "velocity", "kind": "comb"}, '"lowpass" or "notch"'),
        ({"stage": "velocity", "kind": "lowpass", "corner": "1 Hz"}, "corner.*unknown key"),
    ):
        with pytest.raises(InputError, match=words):
            AMBER.add_filter(**bad)


def test_periods_of_cogging_are_those_of_a_revolution_or_of_a_magnet_pitch() -> None:
    """24 mm a period are 2 pi/0.024 rad per metre; counts of a linear encoder are of a metre or a lead."""
    screw, emps = load_design("ballscrew"), load_design("emps")
    for design, path, counts in (
        (emps, "encoder.counts_per_rev", 1e7),
        (screw, "encoder.counts_per_rev", 1e4 * 10),  # lead 10 mm
        (screw, "output_encoder.counts_per_rev", 1e7),
    ):
        assert parameter_value(with_overrides(design, {path: "10000 counts/mm"}), path) == counts
    for text, says in (
        ("4096 counts/rev", "those of a metre"),
        ("0.5 um/count", "a metre over it is 2000000 c"),
    ):
        with pytest.raises(InputError, match=says):
            with_overrides(screw, {"output_encoder.counts_per_rev": text})
    counts = {"encoder.counts_per_rev": "0.5 um"}
    refused(with_overrides, screw, counts, words="a revolution over it is 20000 counts")
    counted = with_overrides(screw, {"encoder.counts_per_rev": "1024 lines per turn"})
    assert counted.encoder.counts_per_rev == 4096
    # a bare number is per revolution of a rotary motor behind a screw, as its sheet has it
    motor = with_overrides(screw, {"motor.cogging_periods": 20, "motor.cogging": "1 mN*m"}).motor
    assert motor.cogging_periods == pytest.approx(20 / screw.screw.travel_m_rad, rel=1e-14)
    for constants in ("dc", "rms-line", "peak-phase"):  # a pitch has no convention
        frame = Frame(Structure.of(emps), constants)
        periods = frame.quantity("24 mm", FIELDS["motor.cogging_periods"])
        assert periods == pytest.approx(2 * pi / 0.024, rel=1e-14)
    with pytest.raises(InputError, match=r"cogging_periods.*wrong dimension"):
        with_overrides(AMBER, {"motor.cogging_periods": "24 mm"})


@pytest.mark.parametrize("share", [0.0, 0.3, None, 1.0])
def test_a_motor_without_a_load_takes_its_no_load_current(share: float | None) -> None:
    """At u = R i0 + kE w0, whatever part of it is dry."""
    given = "" if share is None else f"no_load_dry_share = {share}\n"
    motor = sheet("[[gear]]", f"{given}[[gear]]", 1)
    u = 0.299 * 0.137 + SPEED * 30 / (pi * 317)
    run = simulate(motor, commands.step(u), 1.0)
    assert run.motor_speed_rad_s[-1] == pytest.approx(SPEED, rel=1e-9)
    assert run.current_A[-1] == pytest.approx(0.137, rel=1e-9)
    assert steady_torque_Nm(motor, 0.0, SPEED) == pytest.approx(0.137 * 30.2e-3, rel=1e-12)


@pytest.mark.parametrize("path", ["back-drivable", "self-locking"])
def test_a_load_costs_what_the_efficiencies_leave(path: str) -> None:
    """M/(N eta) at the motor, of both stages; a load that drives gives back M/N less the same loss."""
    drive = sheet("back-drivable", path)
    load, N, eta, kM = 10.0, 86.0, 0.72, 30.2e-3

    def torque(load_Nm: float) -> float:
        run = simulate(drive, commands.step(24.0), 2.0, load_Nm=load_Nm)
        free = kM * 0.137 * (0.5 + 0.5 * run.motor_speed_rad_s[-1] / SPEED)
        return float(kM * run.current_A[-1] - free)

    assert torque(-load) == pytest.approx(load / (N * eta), rel=1e-9)
    driven = load / N * (1 / eta - 2) if path == "back-drivable" else load / (N * eta)
    assert torque(load) == pytest.approx(driven, rel=1e-9)
    lost = steady_torque_Nm(drive, -load, 0.0) - steady_torque_Nm(drive, 0.0, 0.0)
    assert lost == pytest.approx(load / (N * eta), rel=1e-12)


def test_an_unknown_share_is_a_tolerance_from_none_to_all() -> None:
    """Dry and viscous part sum up to kM i0 at w0 in every sample."""
    drive = sheet()
    wide = {path: (value - t.half_width, value + t.half_width) for path, value, t in tolerances(drive)}
    assert wide == {
        "friction.dry_torque": pytest.approx((0.0, 0.137 * 30.2e-3)),
        "friction.viscous": pytest.approx((0.0, 0.137 * 30.2e-3 / SPEED)),
    }
    dry, viscous = sampler_of(drive).draw(0, 64).T
    assert dry + viscous * SPEED == pytest.approx(64 * [0.137 * 30.2e-3], rel=1e-9)
    assert max(dry) > 3 * min(dry)
    assert read_design_text(write_design(drive), "sheet") == drive
    without = with_values(drive, {"friction.dry_torque": 0.0})
    assert without.parameters["friction.dry_torque"].tolerance is None


@pytest.mark.parametrize(("old", "new", "key"), [
    ("137 mA", "1 A", "motor.no_load_current"),
    ("30.2 mN*m/A", "29 mN*m/A", "motor.torque_constant"),
    ("80 %", "60 %", "gear.first.efficiency"),
    ("43:1", "12", "gear.first.ratio"),
    ("back-drivable", "self-locking", "load.path"),
    ("100 us", "90 us", "control.period"),
])  # fmt: skip
def test_what_a_sheet_states_is_read_again_with_what_is_changed(old: str, new: str, key: str) -> None:
    drive, other = with_overrides(sheet(), {key: new}), sheet(old, new)
    assert (drive.friction, drive.correlations) == (other.friction, other.correlations)
    again = with_overrides(drive, {"friction.dry_torque": "5 mN*m", "load.path": "back-drivable"})
    assert again.friction.dry_torque_Nm == 0.005
    assert again.friction.viscous_Nms_rad == other.friction.viscous_Nms_rad


def test_a_phase_margin_that_no_operating_point_bounds_is_infinite(tmp_path, cli, monkeypatch) -> None:
    """A current loop by a gain below R never crosses 0 dB, at no operating point."""
    monkeypatch.setenv("COLUMNS", "250")
    file = tmp_path / "mine.toml"
    velocity = '[control.velocity]\ngain = "0.02 As/rad"\nintegral_time = "20 ms"\n'
    position = '[control.position]\ngain = "40/s"\n'
    file.write_text(f'{SHEET}[control.current]\ngain = "0.1 V/A"\n{velocity}{position}')
    said = " ".join(cli.text("margins", file).split())
    assert "Phase margin, operating points, deg ∞" in said


def test_a_source_that_only_begins_as_those_of_a_sheet_stays() -> None:
    own = {"value": "1 N", "source": "from data sheet: maker, 2017"}
    drive = with_overrides(load_design("emps"), {"friction.dry_torque": own})
    again = with_overrides(drive, {"limits.voltage": "9 V"})
    assert again.parameters["friction.dry_torque"] == drive.parameters["friction.dry_torque"]


VELOCITY = "[control.velocity]\n"
CURRENT = f'[control.current]\ngain = "1 V/A"\n{VELOCITY}'
SPEED_LOOP = f'{VELOCITY}gain = "9 Hz"'
NOTCH = '[[control.velocity.filter]]\nkind = "notch"\nfrequency = "90 Hz"\n'
BANDWIDTH = "a bandwidth is written in Hz or rad/s"
PERIOD = '(it is period, which takes "16 kHz" too)'
KM = [(key, root) for key in ("km", "motor_constant") for root in ("√W", "sqrt(W)", "W^0.5", "W½", "W^(1/2)")]
PLACES = {  # where a line is written into the sheet
    "motor": ("[motor]", "[motor]\n{}"),
    "gear": ("efficiency = 0.9", "{}"),
    "load": ("[load]", "[load]\n{}"),
    "limits": ("[limits]", "[limits]\n{}"),
    "table": ("[limits]", "{}\n[limits]"),
    "period": ("period = ", "{} #"),
    "encoder": ("[control]", "[encoder]\n{}\n[control]"),
    "current": ("[control]", "[control.current]\n{}\n[control]"),
    "velocity": ("[control]", CURRENT + "{}\n[control]"),
    "position": ("[control]", "[control.position]\n{}\n[control]"),
}
GEARS = SHEET[SHEET.index("[[gear") : SHEET.index("[load]")]
ONE_GEAR = '[gear]\nname = "first"\nratio = 2\nbacklash = "1 deg"\n'
BRAKE = '[supply]\ncapacitance = "1 mF"\nregenerative = false\nbrake_voltage = "5 V"\n'
COUNTS = '"1024 lines" (4096 counts) or "1024 counts"'
BEHIND = "dry_torque of [load.friction]"
WORDS: dict[str, list[tuple[str, ...]]] = {  # by place: a line, and what each line of the answer has
    "motor": [
        *((f'{key} = "32 mNm/{root}"', "it is the motor constant Km") for key, root in KM),
        ('motor_constant = "1 V"', "(not needed: it follows from R and kM)"),
        ('rated_torque = "1 Nm"', "(it is continuous_current of [limits], the torque over"),
        ('brake_inertia = "1 gcm2"', "(it is added to rotor_inertia)"),
        ('resistance_per_phase = "1 ohm"', "of a stepper, else twice it)"),
        ('torque_ripple = "2 %"', "motor.cogging is a torque in N*m"),
        ('detent_torque = "1 Nm"', 'cogging_phase = "180 deg"'),
        ('step_angle = "1.8 deg"', "of [encoder], one revolution over it; here 200 counts"),
        ('"Resistance (L-L)" = "1 V"', "(it is resistance)"),
        ('type = "stepper"', "(it is constants, of an AC motor rms-line"),
        # 7 pole pairs of 4.1 mV s: kE of a phase, kM 1.5 times that
        ('flux_linkage = "4.1 mWb"\npoles = 14', "0.0287 V*s/rad and 0.04305 N*m/A", "not needed"),
    ],
    "limits": [
        ('continuous_stall_current = "2 A"', "(it is continuous_current)"),
        ('peak_stall_current = "2 A"', "(it is peak_current)"),
        # only near to current_rate, whose unit says nothing of it
        ('current_slope = "15 A"', 'current_slope = "15 A": unknown key (nearest'),
        ("i2t = 3", "(it is peak_time, for"),
        ('max_rate = "400 deg/s"', "(it is speed, at the motor: that of"),
        ('speed = "2 m/s"', 'm/s with design.axis = "linear"'),
    ],
    "load": [
        ('friction = "6 N"', "allowed: a table, [load.friction]; a number of that name is dry_torque of"),
        ('coulomb_friction = "6 mNm"', BEHIND),
        ('mass = "6 kg"', "(it is inertia, in kg on a linear axis"),
        ('hinge_moment = "2 Nms"', "(it is moment_max)", "load.moment_max = "),
    ],
    "gear": [
        ("rated_torque = 1", "not needed"),
        ("back_driving_torque = 1", "[friction], at the motor: what is stated at the output over ratio"),
        ("transmission_error = 1", "gear_error of [load]"),
        ('backlash = "0.8 deg"', "it is play of [coupling]"),
        ("self_locking = true", 'it is path = "self-locking" of [load]'),
        ('efficiency = "9000 %"', "1e-18 to 1\n"),
        ("efficiency = 86", '; or is it "86 %"\n'),
        ('efficiency = "86"', 'or is it "86 %"'),
        ("efficiency = 1.1", "gear.second.efficiency = 1.1: allowed"),
        ('efficiency = { value = 0.9, tolerance = "2 %" }', "efficiency.tolerance: allowed"),
    ],
    "table": [
        ('[instruments]\njitter = "2 s"', "at most 1 s\n"),
        ("[belt]\nratio = 3", "it is a [[gear]]"),
        ('[friction]\ndry_torque = "1 N*m"', "no_load_current", "7580 rpm: not allowed beside friction.dry"),
        ("[friction]\nload_coefficient = 0.1", "gear.first", "y = 0.9: not allowed beside friction.load_c"),
    ],
    "encoder": [
        # by hand: 360 deg over 1.8 deg, over 20 arcsec
        ('step_angle = "1.8 deg"', "here 200 counts"),
        ('resolution = "20 arcsec"', "here 64800 counts"),
        ('counts_per_rev = "20 arcsec"', "a revolution over it is 64800 counts"),
        ('resolution = "5 um"', "one metre over a step"),
        ("ppr = 1024", COUNTS),
        ('counts_per_rev = "500 ppr"', 'allowed: counts, as 4096, "1024 lines" or "12 bit"; write "500 l'),
        ('counts_per_rev = "2,621,440 counts"', 'write "2621440 counts"'),
        ("counts_per_turn = 4096", 'four of each line, which takes "1024 lines" too)'),
        ('cpt = "4096 counts"', 'four of each line, which takes "4096 counts" too)'),
        ('lines = "512 lines"', 'four of each line, which takes "512 lines" too)'),
        ('interface = "SSI"', "not needed"),
    ],
    "velocity": [
        ('vel_gain = "40 Hz"', "(it is gain)"),
        ("kd = 3", "control.velocity.gain: missing", "kd = 3"),
        ('observer = true\ngain = "1 As/rad"', 'encoder.speed = "tracking"'),
        ('integral = "25 Hz"', "velocity.gain: missing", "here 0.006366 s"),
        ('bandwidth = "300 rpm"', 'takes "40 Hz" too)', '"300 rpm": w'),
        ('bandwidth = "1 ms"', 'takes "40 Hz" too)', '"1 ms": w'),
        (f'gain = "180 1/s"\n{NOTCH}bandwidth = "9 Hz"', BANDWIDTH, '"9 Hz": unknown key (it is width'),
        # 250 us and 300 us of 100 us, half of that
        ('gain = "9 Hz"\nevery = "250 us"', "write the ticks of control.period\n"),
        ('gain = "9 Hz"\nevery = "300 us"', "control.period, here 3\n"),
        ('gain = "9 Hz"\nevery = "10 kHz"', "control.period, here 1\n"),
        # periods of 1.67, 2, 2.0001, 0.5 and 1 ticks of 100 us
        ('gain = "9 Hz"\nfrequency = "6 kHz"', "of control.period)"),
        ('gain = "9 Hz"\nfrequency = "5 kHz"', "of control.period; here 2)"),
        ('gain = "9 Hz"\nperiod = "200.01 us"', "of control.period)"),
        ('gain = "9 Hz"\ncycle = "20 kHz"', "of control.period)"),
        ('gain = "9 Hz"\nts = "100 us"', "of control.period; here 1)"),
    ],
    "current": [
        # 0.082 mH/0.299 ohm; 2 ms in ticks of 0.1 ms
        (
            'bandwidth = "9 Hz"\n[control.velocity]\ngain = "1 Hz"\nperiod = "2 ms"',
            "integral_time = L/R, here 0.0002742 s",
            "so many ticks of control.period; here 20)",
        ),
        (f'gain = "1e308 Hz"\n{SPEED_LOOP}', "must be finite"),
        (f'gain = "1 V/A"\nperiod = "100 us"\n{SPEED_LOOP}', "(not needed: it runs every tick of control.p"),
        (
            f'Vp = "1 V/A"\nI_gain = "9 V/As"\n{VELOCITY}P_gain = "2 A"\nintegral_action_time = "9 ms"',
            'Vp = "1 V/A": unknown key (it is gain)',
            "it is integral_time = gain/integral gain; of one in Hz 1/(2 pi f); here 0.1111 s",
            "velocity.P_gain",
            'velocity.gain = "2 A": wrong',
            "(it is integral_time)",
        ),
    ],
    "position": [('bandwidth = "9 Hz"', "(it is gain)", "like V/rad"), ('Kv = "40 V/rad"', "position.Kv = ")],
    "period": [
        ('period = "-5 Hz"', '"-5 Hz": allowed: above 0'),
        ('period = "1e308 Hz"', '"1e308 Hz": must be f'),
        # the file's own value is an example only where the key takes it as it stands
        ("frequency = 8000", PERIOD, "control.period = 8000: has no unit"),
        ("frequency = true", PERIOD, "control.period = True: "),
        ("frequency = inf", PERIOD, "must be finite"),
        ('frequency = "1e4"', PERIOD, "has no unit"),
        ('frequency = "-8 kHz"', PERIOD, "control.period = "),
        ('frequency = "0.1 mWb"', PERIOD, "is of a flux linkage"),
        ('frequency = "8 kHz"', '(it is period, which takes "8 kHz" too)'),
    ],
}
CHANGED: list[tuple[str, ...]] = [  # a text, another in its place, and the same
    ('no_load_speed = "7580 rpm"\n', "", "motor.no_load_speed: missing"),
    ('no_load_current = "137 mA"\n', "", "no_load_speed = 7580 rpm: needs motor.no_load_current"),
    ('torque_constant = "30.2 mN*m/A"\n', "", "torque_constant: m", "137 mA: needs motor.torque_constant"),
    ('inductance = "0.082 mH"\n', "", "R times the electrical time constant"),
    ('back_emf_constant = "317 rpm/V"\n', "", "number of motor.torque_constant in SI, 0.0302"),
    ('"48 V"', '"230 Vac"', "sqrt(2) times the mains behind a rectifier, 325.3 V"),
    ('"48 V"', '"100-120 VAC"', "behind a rectifier, 141.4 V to 169.7 V"),
    ('"48 V"', '"48 V', "a quote that is opened in this line is not closed"),
    ("back_emf_constant =", "speed_constant =", 'which takes "317 rpm/V" too'),
    ('back_emf_constant = "317', 'speed_constant = "107', 'which takes "107 rpm/V" too', "within 10 %"),
    ("[control]", '[control]\npwm-frequency = "8 kHz"', "part of computing_delay"),
    ("computing_delay", "pwm_frequency", "control.computing_delay: missing", "not needed, part of "),
    ('name = "first"', 'name = "spur 272.5"', 'no dot, as "spur 272-5"'),
    ('name = "first"', 'name = "i=43"', 'no =, as "i-43"'),
    ('name = "first"', "", 'name: missing; example: name = "planetary"'),
    ('name = "first"', 'model = "GPLE 60"', "gear[1].name: missing", "(it is name)"),
    ("ratio = ", "reduction_ratio = ", 'reduction_ratio = "43:1": unknown key (it is ratio)'),
    ('ratio = "43:1"', 'reduction = "43:1"', "(it is ratio, which takes"),
    ("ratio = ", 'i = "66:1" #', 'takes "60/20" too)'),
    ("rotor_inertia", "GD2", "(it is rotor_inertia, GD2 over 4)"),
    ("resistance", "resistance_line_to_line", "(it is resistance)"),
    ("resistance", "resistence", '(nearest known: "resistance")'),
    ('resistance = "0.299', 'resistence = "3 k', 'known: "resistance")', "motor.resistance = "),
    ('"0.299 ohm"', '"0.3 ohm/phase"\nholding_torque = "2 Nm"', '"phase" is no unit', "it is torque_c"),
    ('inductance = "0.082', 'rotor_L = "0.082 V', "(it is inductance)", "line 6: motor.inductance = "),
    # by hand: 32 mN m/sqrt(W) sqrt(0.299 ohm)
    ('torque_constant = "30.2 mN*m/A"', 'motor_constant = "32 mNm/√W"', "sqrt(R): 0.0175 N*m/A)"),
    ('inertia = "1e-3 kg*m^2', 'mass = "150 V', "(it is inertia, in kg on", "load.inertia = "),
    ('"142 g*cm^2"', '"142 ± 7.1 gcm²"', 'write "142 gcm²"; "± 7.1 gcm²" is one for tolerance = "5 %"'),
    ('"0.299 ohm"', '"0.299 Ω @25°C"', 'write "0.299 Ω"; "@25°C" is one for temperature.reference'),
    ("voltage = ", "dc_bus = ", "(it is voltage)"),
    ("[limits]", '[load.gravity]\nm = "1 kg"\nradius = "1 m"\n[limits]', "(it is mass)", "(it is arm)"),
    ("[limits]\n", f"{BRAKE}[limits]\nrated_", "at least limits.voltage = 48 V", "(it is voltage)"),
    ('computing_delay = "0 s"', 'computing_delay = "0.5 samples"', "; here 5e-05 s"),
    (
        'computing_delay = "0 s"\n',
        f'computing_delay = "0 s"\n{CURRENT[:-10]}speed]\nKVP = 1\n[control.position]\nKPP = "35/s"\n',
        "control.speed = a table: unknown key (it is velocity)",
        "control.position.KPP",
    ),
    (GEARS, ONE_GEAR, "gear = a table: allowed: [[gear]]", "first.backlash"),
]
WRITTEN = [(PLACES[place], *words) for place, lines in WORDS.items() for words in lines]
ANSWERED = [(old, new.replace("{}", line), *told) for (old, new), line, *told in WRITTEN] + CHANGED


@pytest.mark.parametrize("case", ANSWERED, ids=lambda case: case[1].replace("\n", " ")[:60])
def test_what_stands_under_a_sheets_own_word_is_read_too(case: tuple[str, ...]) -> None:
    """So that a wrong unit behind it is told in the same run, and nothing that follows from it is missing."""
    old, new, *words = case
    with pytest.raises((InputError, Mistakes)) as caught:
        sheet(old, new, 1)
    told = f"{caught.value}\n".splitlines(keepends=True)
    assert len(told) == len(words)
    assert all(word in line for word, line in zip(words, told, strict=True))


@pytest.mark.parametrize(  # kM over kE of the sheet, kM and L of the model over the sheet's (model.md)
    ("constants", "over", "to_dc", "coil"),
    [("dc", 1.0, 1.0, 1.0), ("rms-line", sqrt(3), 1 / sqrt(1.5), 1.0), ("peak-phase", 1.5, 2 / sqrt(3), 2.0)],
)
def test_a_gain_may_be_stated_by_what_it_does(constants: str, over: float, to_dc: float, coil: float) -> None:
    """By hand: a P velocity loop alone crosses over at gain kM/J, a P current loop at gain/L."""
    kM, J = 0.0302 * to_dc, 142e-7 + 1e-3 / 86**2
    text = SHEET.replace("317 rpm/V", f"{0.0302 / over} V*s/rad")
    text = text.replace("[motor]", f'[motor]\nconstants = "{constants}"')
    text += '[control.current]\ngain = "500 Hz"\n[control.velocity]\n'
    for stated, gain in (
        ("40 Hz", 80 * pi * J / kM),
        ("251.32741228718345 rad/s", 80 * pi * J / kM),
        ("0.1 Nm/(rev/s)", 0.1 / (2 * pi) / kM),
    ):
        drive = read_design_text(
            f'{text}gain = {{ value = "{stated}", source = "tuned", tolerance = "10 %" }}'
        )
        kept = drive.parameters["control.velocity.gain"]
        assert drive.controller.velocity.gain == pytest.approx(gain, rel=1e-12) == kept.value
        assert kept.source == f"from {stated}; tuned"
        assert read_value(drive, "control.velocity.gain", stated) == pytest.approx(gain, rel=1e-12)
        assert kept.tolerance.half_width == pytest.approx(0.1 * gain)
        assert drive.controller.current.gain_V_A == pytest.approx(1000 * pi * 0.082e-3 * coil, rel=1e-12)
        # in amperes from there on: the controller does not follow another load
        other = with_overrides(drive, {"load.inertia": "0 kg*m^2"})
        assert other.controller.velocity.gain == drive.controller.velocity.gain
        lost = 80 * pi * 142e-7 / kM if "Nm" not in stated else gain
        said = [line for line in warnings_of(other) if line.startswith("control.velocity.gain: keeps")]
        now = f"; {stated} would now be {lost:.4g} A"
        assert [now in line for line in said] == [True] * (lost != gain)
        assert not any(": keeps" in line for line in warnings_of(drive))


def test_variants_say_once_of_a_gain_that_it_keeps_its_number(tmp_path, cli) -> None:
    file, ways = tmp_path / "mine.toml", ("load.inertia=0 kg*m^2", "load.inertia=1e-4 kg*m^2")
    file.write_text(f'{SHEET}{CURRENT}gain = "40 Hz"\n')
    asked = [word for way in ways for word in ("--set", way)]
    ran = cli("compare", f"{file}", *asked, "--no-validate", "--quiet", "--out", f"{tmp_path / 'out'}")
    said = [line for line in ran.err.splitlines() if ": keeps " in line]
    assert [line.startswith(f"warning: {ways[0]}: control.velocity.gain: keeps") for line in said] == [True]


def test_a_velocity_gain_without_a_current_loop_is_in_volts() -> None:
    drive = read_design_text(f'{SHEET}[control.velocity]\ngain = "0.01 N*m*s/rad"\n')
    assert drive.controller.velocity.gain == pytest.approx(0.01 * 0.299 / 0.0302, rel=1e-12)


COUPLED = 'efficiency = "80 %"\n[coupling]\nstiffness = "9 N*m/rad"\nafter = "x"'


@pytest.mark.parametrize(("old", "new", "gain", "only"), [
    ('efficiency = "80 %"', COUPLED, "40 Hz", "coupling.after"),
    ('ratio = "43:1"', 'ratio = "43 kg"', "40 Hz", "gear.first.ratio"),
    ("resistance = ", "# resistance = ", "40 Hz", "motor.resistance: missing"),
    ("", "", "0 Hz", 'control.velocity.gain = "0 Hz": allowed: above 0'),
])  # fmt: skip
def test_a_stated_gain_that_cannot_be_taken_over_hides_nothing(old, new, gain, only) -> None:
    text = f'{SHEET.replace(old, new, 1)}{CURRENT}gain = "{gain}"\n'
    refused(read_design_text, text, "sheet", words=only)


@pytest.mark.parametrize("name", ["GP 42 C 43:1", "32/3R", "PLE+80 (i8)"])
def test_a_gear_is_named_as_its_maker_names_it(name: str) -> None:
    """A sheet's efficiency, too, is read again from what is changed besides."""
    drive, plain = sheet('"first"', f'"{name}"'), sheet()
    changed, same = (
        with_overrides(one, {f"gear.{gear}.ratio": 50}) for one, gear in ((drive, name), (plain, "first"))
    )
    assert changed.total_ratio == 100.0
    assert changed.friction == same.friction != plain.friction


def test_speed_and_force_of_a_linear_axis_behind_gears_are_those_of_the_output() -> None:
    """16:1 and a screw: U/(k N) and k N U/R, of k in N/A behind the screw; of a direct screw without N."""
    screw = load_design("ballscrew")
    geared = changed(screw, gears=(Gear(name="spur", ratio=16.0),))
    motor, U = screw.effective_motor, screw.limits.voltage_V
    for design, of, by, over, N in ((screw, "", "", "", 1.0), (geared, " of the output", " N", "/N", 16.0)):
        told = {one.name: one.value for one in sheet_figures(design)}
        speed, force = (f"no-load speed{of} without friction U/kE{over}", f"stall force{of} kM U/R{by}")
        assert told[speed] == pytest.approx(U / motor.back_emf_constant_Vs_rad / N, rel=1e-12)
        assert told[force] == pytest.approx(
            motor.torque_constant_Nm_A * N * U / motor.resistance_ohm, rel=1e-12
        )


@pytest.mark.parametrize(("key", "stated", "half", "words"), [
    ("motor.rotor_inertia", "9.2 g*cm^2", 4.6e-7, "4.6 g cm²"),
    ("friction.breakaway_ratio", "2", 1.0, "1"),
    ("motor.back_emf_constant", "1618.5 rpm/V", 0.00295, "0.00295 V s/rad"),  # half of it is twice the rpm/V
])  # fmt: skip
def test_a_value_is_told_in_the_unit_of_its_sheet(key: str, stated: str, half: float, words: str) -> None:
    """A worst corner, a slider can be held against the file; what is turned over is not to be scaled."""
    drive = with_overrides(AMBER, {key: stated})
    value = 0.5 * parameter_value(drive, key)
    assert value == pytest.approx(half, rel=1e-4)
    assert value_as_stated(drive, key, value) == words
    assert value / named(drive, key)["factor"] == pytest.approx(float(words.split()[0]), rel=1e-4)
