"""A ball screw: the motor's data sheet in rotary units on a linear axis."""

from math import pi

import pytest

from actuator_lti.design import read_design_text, write_design
from actuator_lti.errors import InputError

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


def test_it_is_written_as_it_was_read() -> None:
    design = read_design_text(TEXT)
    assert read_design_text(write_design(design)) == design
    assert '"0.2 N*m/A"' in write_design(design)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('axis = "linear"', 'axis = "rotary"', "axis"),
        ('"3 kg*cm^2"', '"3 N"', "rotor_inertia"),
        ('lead = "10 mm"', 'lead = "10 rad"', "screw.lead"),
        ('[screw]\nlead = "10 mm"', "", "J as the mass"),
    ],
)
def test_refused(old: str, new: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        read_design_text(TEXT.replace(old, new, 1))
