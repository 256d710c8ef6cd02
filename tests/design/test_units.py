"""Quantities: every spelling of a unit, what is refused, and a screw between motor and axis."""

import random
from fractions import Fraction
from math import pi

import pytest

from actuator_lti.design import read_design_text
from actuator_lti.design.units import parse_quantity, parse_unit
from tests.refusals import mistakes, refused

OZ, LB, INCH, G = 0.45359237 / 16, 0.45359237, 0.0254, 9.80665
NO_BREAK = "12\u202f345\u202f678 s"
READ: list[tuple[str, float, tuple[object, ...]]] = [  # unit asked for, value in it, and how it is written
    ("H", 6e-6, ("6 uH", "6 µH")),
    ("H", 2e-4, ("0.2 milliHenries",)),
    ("kg*m^2", 9.2e-7, ("9.2 g*cm^2", "9.2 gcm²", "9.2gcm2", "9.2 g.cm2")),
    ("kg*m^2", 3.0, ("3 kg m2",)),
    ("kg*m^2", 1e-4, ("1 kg-cm2",)),
    ("kg*m^2", 2.4e-5, ("2.4e-5 Kg-m^2",)),
    ("kg*m^2", 1e-9, ("1 gmm²",)),
    ("kg*m^2", 0.0, ("0",)),
    # powers of ten as the heads of columns have them
    ("kg*m^2", 1.18e-4, ("1.18 10^-4 kg·m²", "1.18 10⁻⁴ kg m2", "1.18 (10^-4 kg·m²)", "1.18 (x10^-4 kg·m²)")),
    ("kg*m^2", 1.18e-4, ("1.18 kg-m² ×10⁻⁴", "1.18 kgm2 10-4")),
    ("kg*m^2", 3e-5, ("3×10^-5 kg m²", "3 x 10⁻⁵ kg m2", "300 kgm2*1e-7")),
    ("kg*m^2", 5e-6, ("5.0 E-6 kg.m2",)),
    ("kg*m^2", 9e-7, ("9 gm-cm^2", "9 gm·cm²", "9 gm cm2")),
    ("kg", 0.42, ("420 gm",)),
    ("N*m", 5e-5 * G, ("5 gm-cm", "5 g-cm", "5 gf-cm")),
    ("N", 4e-4, ("40 dyne", "40 dyn")),
    ("N*m", 5e-3, ("5e4 dyne-cm",)),
    ("kg", 3.0, ("3 kilograms",)),
    ("kg", 150 * LB, ("150 lbm",)),
    ("m", 4 * 25.4e-6, ("4 mils",)),
    ("m", 5.08e-3, ("0.2 inches", "5080 microns")),
    ("rad/s", 300 * pi, ("9000 rpm", "150 Hz")),
    # a minute without an angle is that of revolutions
    ("rad/s", 100 * pi, ("3000 min-1", "3000 min^-1", "3000 1/min", "3000 r/min", "3000 RPM", "3000 U/min")),
    ("rad/s", 100 * pi, ("3000 min⁻¹", "3000 min-¹")),
    ("rad/s", 1000 * pi / 30, ("1 kmin-1", "1 kmin^-1", "1 kmin⁻¹")),
    ("rad/s", 10600 * pi / 30, ("10 600 rpm",)),
    ("rad/s", 200 * pi, ("6000 r.p.m.",)),
    ("rad/s^2", 60000 * pi, ("30000 rev/s^2", "30000 rev/s2")),
    ("rad/s^2", 6e4, ("60 .10³ rad/s²",)),
    ("rad/s^2", 2000 * pi, ("1000 rps^2",)),
    ("rad", pi / 18, ("10 °", "10º", "10 ˚")),
    ("rad", 48 / 60 * pi / 180, ("48'",)),
    ("rad", 30 / 3600 * pi / 180, ('30"',)),
    ("rad", pi / 3600, ("3 arc-min", "3 arc min", "3 arcmin")),
    ("rad", pi / 324000, ("2 arc-sec",)),
    ("rad", pi / 180 / 60, ("60 arcsec",)),
    ("N*m/A", 5.9e-3, ("5.9 mN*m/A", "5.9 mNm/A")),
    ("N*m/A", OZ * G * INCH, ("1 oz-in/Amp",)),
    ("V*s/rad", 5.9e-3, ("5.9 mV*s/rad", "5.9 mN*m/A")),
    ("V*s/rad", 10.7e-3, ("10.7 mVs/rad",)),
    ("V*s/rad", 0.03 / pi, ("1 V/krpm",)),
    ("V*s/rad", 0.09 / pi, ("3 V/KRPM",)),
    ("V*s/rad", 0.3 / pi, ("10 V/1000rpm", "10 V/1000 min-1", "10 V/(1000 rpm)", "10 mV/(1/min)")),
    ("V*s/rad", 0.3 / pi, ("10 mV/min-1", "10 mV/rpm")),
    ("V*s/rad", 0.3 / pi, ("10 V/kmin-1", "10 V/(kmin-1)", "10 mVmin")),
    ("V*s/rad", 2.6 * 0.03 / pi, ("2.6 V per krpm",)),
    # a speed without its brackets, where nothing else can be meant
    ("V*s/rad", 0.125 / pi, ("0.25 V/rps", "0.25 V/rev/s")),
    ("V*s/rad", 0.1, ("0.1 V/rad/s", "0.1 V/rad/sec")),
    ("V*s/m", 0.99 / 0.0254, ("0.99 V/in/s",)),
    ("rad/(V*s)", 140 * pi / 30, ("140 KV", "140 Kv", "KV 140 rpm/V", "Kv = 140 rpm/V")),
    ("N/V", 35.15, ("35.15 N/V",)),
    ("N", -3.1648, ("-3.1648 N",)),
    ("V", 12.0, ("12 V",)),
    ("V", 48.0, ("48 VDC",)),
    ("V", 24.0, ("24 V DC",)),
    ("V", 5e-3, ("5 millivolts",)),
    ("A", 5.0, ("5 A dc",)),
    ("A*s/rad", 0.12, ("0.12 A*s/rad", "0.12 A s")),
    ("A*s/rad", 0.01, ("0.01 As/rad",)),
    ("A*s/rad", 0.1, ("0.1 A/rad/s",)),
    ("ohm", 0.02, ("20 mohm",)),
    ("ohm", 0.36, ("R = 0.36 ohm",)),
    ("ohm", 2.0, ("2 ohms",)),
    ("V/A", 0.02, ("20 mΩ",)),
    ("s", 1e-4, ("100 us",)),
    ("s", 120.0, ("2 min",)),
    ("s", 0.0, (0,)),
    ("s", 12345678.0, (NO_BREAK,)),
    ("1/s", 120.0, ("120 s^-1",)),
    ("1/s", 1 / 60, ("1 1/min",)),
    ("1/s", 25.0, ("25/s",)),
    # forces as data sheets write them; one pound is 0.45359237 kg, g_n is 9.80665 m/s2, an inch 0.0254 m
    ("N*m", OZ * G * INCH, ("1 ozf*in", "1 oz-in", "1 ozin")),
    ("N*m", LB * G * INCH, ("1 in-lb", "1 in-lbs")),
    ("N*m", LB * G * 0.3048, ("1 lb-ft",)),
    ("N*m", 0.0980665, ("1 kgf cm", "1 kg-cm", "1 kgcm")),
    ("N*m", 0.05, ("5 Ncm",)),
    ("N*m", 5.0, ("5 N-m",)),
    ("kg*m^2", OZ * G * INCH, ("1 oz-in-s2",)),
    ("kg*m^2", LB * G * INCH, ("1 lb-in-s2",)),
    ("kg*m^2", LB * INCH**2, ("1 lb-in^2",)),
    ("kg*m^2", OZ * INCH**2, ("1 oz-in^2",)),
    ("kg*m^2", LB * G * 0.3048, ("1 slug*ft^2",)),  # slug = lbf s2/ft
    ("N*m*s/rad", 2e-3, ("2 mN.m.s/rad", "2 mNms/rad")),
    ("N*m*s/rad", 0.1, ("0.1 Nms",)),
    ("N*m*s/rad", 2.0, ("2 N*m/rad/s",)),
    ("N*m/rad", 3 * 60 * 180 / pi, ("3 N*m/arcmin",)),
    ("N*m/rad", 1.2 * 9.80665 * 10800 / pi, ("1.2 kgf·m/arc-min", "1.2 kgfm/arcmin")),
    ("N*m/rad", 16e3, ("16 x10³ Nm/rad", "16x10³ Nm/rad", "16 ×10^3 Nm/rad")),
    ("N*m*s/rad", 5e-3 / (1000 * pi / 30), ("5 mNm/kmin-1", "5 mNm/krpm")),
    ("N*m/(N*m)", 1.34e-3, ("1.34 mN*m/(N*m)",)),
    ("1", 1.34e-3, ("1.34e-3 N*m/(N*m)",)),
    ("1", 0.5, ("50 %",)),
    ("1", 0.85, ("85 %", "85 pct")),
    ("1", 131072.0, ("17 bit", "2^17")),
    ("1", 262144.0, ("18 Bit", "18 Bits", "18-Bit")),
    ("1", 2048.0, ("512 lines",)),
    ("1", 4000.0, ("4000 inc",)),
    ("1", 42.875, ("343/8",)),
    ("1", 43.0, ("43:1", "i=43:1")),
    ("1", 8.0, ("i = 8",)),
    ("1", 59.0, ("59 to 1",)),
    ("degC", 80.0, ("80 C", "80 deg C", "80 degrees C", "80 ℃", "80 °C")),
    ("degC", -40.0, ("−40 °C",)),
    ("K/W", 5.0, ("5 K/W", "5 degC/W", "5 °C/W", "5 ℃/W", "5 C/W", "5 deg C/W", "5 °K/W", "5 celsius/W")),
    ("1/K", 0.0039, ("0.39 %/K", "0.39 %/degC", "0.39 %/°C", "0.39 %/C", "3900 ppm/°C", "0.0039 1/K")),
    ("1/K", 0.0039, ("0.0039 1/°C", "0.0039 /°C", "0.0039 K^-1", "0.0039 °C^-1")),
]
WRITTEN = [(text, unit, value) for unit, value, texts in READ for text in texts]
EXACT = ("100 us", "9.2 g*cm^2", "5.9 mN*m/A", "6 uH", "20 mohm")  # a decimal prefix costs no digit


@pytest.mark.parametrize(("text", "unit", "value"), WRITTEN)
def test_a_data_sheet_quantity_is_its_si_value(text: str, unit: str, value: float) -> None:
    assert parse_quantity(text, unit) == pytest.approx(value, rel=0.0 if text in EXACT else 1e-14)


def test_a_time_in_minutes_does_not_turn_the_speeds_read_after_it() -> None:
    parse_unit.cache_clear()
    assert parse_quantity("2 min", "s") == 120.0
    assert parse_quantity("3000 1/min", "rad/s") == pytest.approx(100 * pi, rel=1e-14)


NO_QUANTITY = [  # unit asked for, what is said, and how it is written
    ("1/s", "wrong dimension", ("120 rad/s", "120 Hz")),
    ("rad/s", "wrong dimension", ("942 1/s",)),
    ("A", "of the motor's rated current it is 3 times", ("300 %",)),
    ("kg*m^2", "wrong dimension", ("3 kg",)),
    ("V*s/m", "wrong dimension", ("5.9 mN*m/A",)),
    ("ohm", "no unit", ("55", 55)),
    ("degC", "no unit", ("0",)),
    ("rad/s", "not a unit", ("10 60 rpm",)),
    ("K/W", "a number in it", ("1.9 / 8.9 K/W",)),
    ("rad/s", "a number in it", ("0.17 s/60°",)),
    ("V", 'write "24 VDC"; "±5%" is one for tolerance', ("24 VDC ±5%",)),
    ("rad", 'write "3 arcmin"', ("≤ 3 arcmin",)),
    ("V", 'write "24 V"', ("24 V max.",)),
    ("N*m", "not a unit", ("5 N*m 100",)),
    ("N", "unknown unit", ("3 x 1000 N",)),
    ("ohm", "motor.constants", ("1.2 Ω/phase",)),
    ("s", 'nearest known: "ms"', ("3 mS", "3 Ms")),
    ("ohm", 'nearest known: "Ohm"', ("4 OHM",)),
    ("V*s/rad", "wrong dimension", ("0.1 V rad/s",)),
    ("K/W", "wrong dimension", ("2 degC",)),
    ("1", 'a reduction is written "43:1"', ("1:43",)),
    ("s", "a period 6.25e-05 s", ("16 kHz",)),
    ("s", "of it is 0.006366 s, 1/(2 pi f), a period 0.04 s", ("25 Hz",)),
    ("ohm", "is no unit; leave it out: R and L are so", ("0.32 ohm (L-L)",)),
    ("V*s/rad", "back_emf_constant is p psi in V*s/rad", ("4.1 mWb",)),
    ("m/s^2", "here 19.6133 m/s^2", ("2 g",)),
    ("N", "a weight is written kgf", ("5 kg",)),
    # GD2 of a weight is 4 g J, of a mass 4 J: 0.068 kgf m2 as 0.068 kg m2 are 0.017 kg m2
    ("kg*m^2", "J = 0.017 kg*m^2", ("0.068 kgf m2", "680 kgf cm2", "0.6668522 N m2", "GD2 0.068 kgf m2")),
    ("kg*m^2", "J = 0.017 kg*m^2", ("GD² = 0.068 kgm²", "gd2: 0.068 kg m2", "PD2 = 0.068 kg m2")),
    ("kg*m^2", "a GD2; allowed", ("0.068 kg m2 (GD2)",)),
    ("kg*m^2", "WR2 and WK2 are the inertia J", ("0.01 WR2",)),
    ("V", "a range; write one number", ("24..28 V", "24 … 28 V", "24 to 28 V", "100-120 V")),
    ("rad", '"%" is the unit of a ratio', ("5 %",)),
    ("rad/s", 'write "1000 rpm" or "1.000 rpm"', ("1,000 rpm",)),
    ("1", 'write "2621440 counts"', ("2,621,440 counts",)),
    ("s", "a time is so many of that period", ("1.5 Ts",)),
    ("1", 'written "counts"', ("4096 steps",)),
    ("degC", "(F - 32)/1.8 degC", ("311 °F",)),
    ("m", 'nearest known: "mm"', ("3 Mm",)),
    ("rad/s", 'write "1234.5 rpm";', ("1,234.5 rpm",)),
    ("s", "of control.period", ("2 ticks", "1 period")),
    ("kg*m^2", 'write "20 kgcm²"; "± 1 kgcm²" is one for tolerance = "5 %"', ("(20 ± 1) kgcm²",)),
    ("A", "unknown unit", ("5 Arms",)),
    ("rad/s", 'nearest known: "rpm"', ("3 rpn",)),
    ("m", "unknown unit", ("3 mfoo",)),
    ("V", "a number", ("nan V", "", "V", "3 " + "V*" * 100 + "V")),
    ("V", "finite", ("1e999 V",)),
    ("1", "finite", (float("nan"),)),
    ("1", "allowed", (10**400,)),
    ("V", "not a unit", ("3 V //", "3 ((V", "3 V^99", "3 V^2^2", "3 V" + "*V" * 40)),
    ("V", "unknown unit", ("3 __import__('os')",)),
    ("V", "wrong dimension", ("3 " + "(V)" * 30,)),  # at once, not in 2^30 steps
    ("V*s/rad", "unit", ("1 mkg", "1 kkg", "3 ^2", "3 )V", "3 (V", "3 *V", "3 ()")),
    ("m", "range of floats", ("1 TV^6" + 4 * "*TV^6", "1 pm^6" + 4 * "*pm^6")),
]


WRONG = [(text, unit, says) for unit, says, texts in NO_QUANTITY for text in texts]


@pytest.mark.parametrize(("text", "unit", "says"), WRONG)
def test_what_is_no_quantity_is_refused_with_the_unit_wanted(text: object, unit: str, says: str) -> None:
    refused(parse_quantity, text, unit, words=("allowed: ", says))


@pytest.mark.parametrize("seed", range(40))
def test_a_unit_is_the_product_of_its_parts_rounded_once(seed: int) -> None:
    """Against exact arithmetic: random products of powers, in any spelling of the signs."""
    draw = random.Random(seed)
    known = {
        "mN": ("1e-3", (1, 1, -2)), "km": ("1e3", (0, 1, 0)), "min": ("60", (0, 0, 1)),
        "g": ("1e-3", (1, 0, 0)),
        "ft": ("0.3048", (0, 1, 0)), "uJ": ("1e-6", (1, 2, -2)), "lb": ("0.45359237", (1, 0, 0)),
    }  # fmt: skip
    text, exact, powers = "1", Fraction(1), [0, 0, 0]
    for _ in range(draw.randrange(1, 7)):
        name, power, sign = draw.choice(list(known)), draw.choice((-3, -1, 1, 2, 5)), draw.choice("*/ ")
        factor, own = known[name]
        text += f"{sign}{name}^{power}"
        way = -power if sign == "/" else power
        exact *= Fraction(factor) ** way
        powers = [a + way * b for a, b in zip(powers, own, strict=True)]
    found = parse_unit(text)
    assert found.factor == float(exact)
    there = dict(found.dimension)
    assert [there.get(key, 0) for key in ("[mass]", "[length]", "[time]")] == powers


TEXT = """
[design]
name = "screw"
axis = "linear"
[screw]
lead = "10 mm"
[motor]
resistance = "0.5 ohm"
inductance = "1 mH"
torque_constant = "0.2 N*m/A"
back_emf_constant = "0.2 V*s/rad"
rotor_inertia = { value = "3 kg*cm^2", tolerance = "0.1 kg*cm^2" }
[[gear]]
name = "belt"
ratio = 2
output_inertia = "1 kg*cm^2"
[load]
inertia = "40 kg"
[friction]
dry_torque = "0.05 N*m"
viscous = "2 N*s/m"
[encoder]
counts_per_rev = 4000
[limits]
voltage = "48 V"
speed = "2000 rpm"
[control]
period = "100 us"
computing_delay = "100 us"
[control.velocity]
gain = "0.4 V*s/rad"
[control.position]
gain = "50 1/s"
"""


def test_energy_is_the_same_in_both_units() -> None:
    """With p = lead/2 pi and v = p w: J w^2 = m v^2, T w = F v, u = kE w = k v."""
    design = read_design_text(TEXT)
    p, w = 0.01 / (2 * pi), 37.0
    v = p * w
    motor = design.motor
    assert motor.rotor_inertia_kgm2 * v**2 == pytest.approx(3e-4 * w**2, rel=1e-14)
    assert motor.torque_constant_Nm_A * v == pytest.approx(0.2 * w, rel=1e-14)
    assert motor.back_emf_constant_Vs_rad * v == pytest.approx(0.2 * w, rel=1e-14)
    assert design.friction.dry_torque_Nm * v == pytest.approx(0.05 * w, rel=1e-14)
    assert design.friction.viscous_Nms_rad == 2.0  # written in the axis's own unit
    assert design.limits.speed_rad_s == pytest.approx(2000 * 2 * pi / 60 * p, rel=1e-14)
    assert design.controller.velocity.gain * v == pytest.approx(0.4 * w, rel=1e-14)
    assert design.controller.position.gain == 50.0  # 1/s, the same on either axis
    # 40 kg behind a 2:1 belt, and the pulley at its own shaft
    assert design.inertia_kgm2 == pytest.approx((3e-4 + 1e-4 / 4) / p**2 + 40 / 4, rel=1e-14)
    # a revolution of the motor is a lead on its side, half of it at the output
    assert design.angle_quantum_rad == pytest.approx(0.01 / 4000, rel=1e-15)
    tolerance = design.parameters["motor.rotor_inertia"].tolerance
    assert tolerance.half_width == pytest.approx(1e-5 / p**2, rel=1e-14)


def test_behind_a_screw_a_speed_constant_is_that_of_the_rotary_motor() -> None:
    """p = 10 mm/2 pi: kE of the axis is kE of the motor over p."""
    design = read_design_text(TEXT.replace('"0.2 V*s/rad"', '"48 rpm/V"'))
    kE = 60.0 / (2 * pi * 48)
    assert design.motor.back_emf_constant_Vs_rad == pytest.approx(kE / (10e-3 / (2 * pi)), rel=1e-12)


def test_a_lead_may_be_per_revolution_and_a_wrong_one_is_one_mistake() -> None:
    lead = 'lead = "10 mm"'
    per_turn = read_design_text(TEXT.replace(lead, 'lead = "10 mm/rev"'))
    assert per_turn.inertia_kgm2 == read_design_text(TEXT).inertia_kgm2
    for wrong in ('lead = "10 rad"', 'lead = "0 mm"', "pitch = 3"):
        said = mistakes(TEXT.replace(lead, wrong))
        assert "screw." in said
        assert "wrong dimension" not in said.replace('screw.lead = "10 rad": wrong dim', "")


@pytest.mark.parametrize(("old", "new", "words"), [
    ('axis = "linear"', 'axis = "rotary"', "axis"),
    ('"3 kg*cm^2"', '"3 N"', "rotor_inertia"),
    ('[screw]\nlead = "10 mm"', "", "J as the mass"),
])  # fmt: skip
def test_refused(old: str, new: str, words: str) -> None:
    assert words in mistakes(TEXT.replace(old, new, 1))
