"""What is only suspicious is warned of, and what is right is not; the shipped designs."""

from math import pi, sqrt
from typing import Any

import pytest
from test_data_sheets import SHEET
from test_first_files import DRIVE

from actuator_lti.design import load_design, parameter_value, read_design_text, shipped_designs, warnings_of
from actuator_lti.design.loader import design_text

GEAR = '[[gear]]\nname = "R22"\nratio = 19.2\n'
BASES = {
    "first": DRIVE,
    "direct": DRIVE.replace(GEAR, ""),
    "locked": DRIVE.replace(GEAR, '[load]\npath = "self-locking"\n'),
    "sheet": SHEET,
    "bare": design_text("ctms-motor-position").partition("[validation]")[0],
}
HELD = 5.9e-3 * 12.0 * 2376  # kM i_peak N, without losses
MOVED = (5.9e-3 * 12.0 - 2.25e-3) / 1.34e-3  # where C0 + CM M is kM i_peak
BACK = {"load.path": "back-drivable"}
LOW = {"friction.load_coefficient": 0.9 / 2376}
PLAY = {"coupling": {"stiffness": "100 N*m/rad", "play": "2 mrad", "damping": "0.1 N*m*s/rad"}, **BACK, **LOW}
RUBBING = PLAY | {"load.friction.dry_torque": "0.1 N*m"}
CLAMPED = {"limits.speed": "100 rad/s", "limits.peak_current": "1 A"}
COGGING = {"motor.cogging": "1 mN*m", "motor.cogging_periods": 12}
FEELS, ASSUMED = 'load.path = "back-drivable"?', "load.path: self-locking is assumed"


def peak(ampere: str) -> dict[str, Any]:
    return {"limits.peak_current": ampere, "control.current.gain": "9 V/A"}


HANGS = {"load.gravity.mass": "1 kg", "load.gravity.arm": "0.1 m"}


CASES: list[tuple[str, dict[str, Any], str, bool]] = [
    ("ilr33-amber", {"control.velocity.integral_time": 5e-5}, "\ncontrol.velocity.integral_time", True),
    ("ilr33-amber", {"control.computing_delay": 3e-4}, "\ncontrol.computing_delay", True),
    ("ilr33-amber", {"control.current.gain": 0.2}, "\ncontrol.current.gain", True),
    ("ilr33-amber", {"control.velocity.gain": 2.0}, "\ncontrol.velocity.gain", True),
    ("ilr33-amber", {"limits.peak_current": 300.0}, "\nlimits.peak_current", True),
    ("ilr33-amber", {"load.moment_max": 4.0}, "\nvalidation.loads", True),
    ("ilr33-amber", {"encoder.speed": "difference"}, "\nencoder.counts_per_rev", True),
    # counts of a sheet are a fact; who sets them wants them to act
    ("ilr33-amber", {"encoder.counts_per_rev": 4096}, "\nencoder.counts_per_rev: acts on nothing", True),
    ("ilr33-amber", {"output_encoder.counts_per_rev": 4096}, "\noutput_encoder.counts_per_rev: acts", True),
    ("joint", {"encoder.counts_per_rev": 4096, "output_encoder.counts_per_rev": 4096}, "acts on", False),
    ("joint", COGGING, "\nmotor.cogging_phase: not given, 0 assumed", True),
    ("joint", {**COGGING, "motor.cogging_phase": 0.0}, "\nmotor.cogging_phase", False),
    ("first", HANGS, "\nload.gravity.offset: not given, 0 assumed: at angle 0 the mass stands upright", True),
    ("first", {**HANGS, "load.gravity.offset": "180 deg"}, "load.gravity.offset: not", False),
    ("ilr33-amber", {"motor.resistance": {"value": "1 ohm", "grade": "Z"}}, "\nmotor.resistance: gra", True),
    ("ilr33-amber", {"gear.worm.input_inertia": {"value": "5 g*cm^2", "grade": "X"}}, "\ngear.worm", True),
    # more than the drive can hold, and than it can move
    ("ilr33-amber", {**BACK, "load.moment_max": 0.99 * HELD}, "more than the drive can hold", False),
    ("ilr33-amber", {**BACK, "load.moment_max": 1.01 * HELD}, "more than the drive can hold", True),
    ("ilr33-amber", {"load.moment_max": 0.99 * MOVED}, "holds the drive fast", False),
    ("ilr33-amber", {"load.moment_max": 1.01 * MOVED}, "holds the drive fast", True),
    # a rigid stage that cannot hold its load, and what lets play swing
    ("ilr33-amber", LOW, "\nfriction.load_coefficient: ", True),
    ("ilr33-amber", PLAY, "\ncoupling.play: ", True),
    ("ilr33-amber", PLAY, "\nfriction.load_coefficient: ", False),
    ("ilr33-amber", RUBBING, "\ncoupling.play: ", False),
    # limits that clamp nothing where there is nothing that they limit
    ("bare", CLAMPED, "\nlimits.speed: ", True),
    ("bare", CLAMPED, "\nlimits.peak_current: ", True),
    ("bare", {}, "\nvalidation.full_deflection: ", True),
    # a load drives a stage of efficiency eta with 2 - 1/eta, which is above 0 from one half on
    ("sheet", {"load.path": "self-locking"}, "\nload.path: self-locking", True),
    ("sheet", {"load.path": "self-locking", "gear.first.efficiency": "50 %"}, "\nload.path: self", False),
    ("sheet", {}, "\nload.path: self-locking", False),
    # 12 V/5.9 ohm are 2.033898 A, told with digits that differ
    ("first", peak("2.034 A"), "2.034 A, but the supply gives only 2.0339 A at", True),
    ("first", peak("3 A"), "3 A, but the supply gives only 2.03 A at", True),
    ("first", peak("2.03 A"), "at stall", False),
    # U/kE is 12 V over 5.9 mV s/rad
    ("ilr33-amber", {"limits.speed": "2033 rad/s"}, "limits.speed", False),
    ("ilr33-amber", {"limits.speed": "2034 rad/s"}, "2034 rad/s, but the supply reaches only", True),
    # a current loop short at rest by 1/(1 + gain/R), R 5.9 ohm, from a tenth on
    ("first", {"control.current.gain": "2 V/A"}, "74.7 % short at rest", True),
    ("first", {"control.current.gain": "53 V/A"}, " % short at rest", True),
    ("first", {"control.current.gain": "54 V/A"}, " % short at rest", False),
    ("first", {"gear.R22.ratio": "1/86"}, "faster than the motor", True),
    ("first", {"gear.R22.ratio": "1/86"}, 'written "86:1"', True),
    ("first", {"gear.R22.ratio": "86/1"}, "faster than the motor", False),
    ("first", {"gear.R22.ratio": 0.5}, "faster than the motor", True),
    ("first", {"gear.R22.ratio": 1}, "faster than the motor", False),
    # a load that nothing feels; where friction takes less than 1/N of it no drive locks itself
    ("first", {}, FEELS, True),
    ("first", {}, ASSUMED, False),
    ("first", BACK, FEELS, False),
    ("first", {"friction.load_coefficient": 1}, FEELS, False),
    ("direct", {}, FEELS, True),
    ("direct", {}, ASSUMED, True),
    ("direct", BACK, ASSUMED, False),
    ("direct", BACK, FEELS, False),
    ("direct", {"friction.load_coefficient": 1}, ASSUMED, False),
    ("direct", {"friction.load_coefficient": 1}, FEELS, False),
    # the drive can do 22.7 deg/s, its command asks for less than the 20 that are required
    ("ilr33-amber", {"command.rate": "19 deg/s"}, "ask for more than 19 deg/s", True),
    ("ilr33-amber", {"command.rate": "21 deg/s"}, "ask for more than", False),
    # what its file writes itself is not assumed, whatever else is changed
    ("locked", {"limits.voltage": "13 V"}, ASSUMED, False),
    ("locked", {}, FEELS, True),
]


@pytest.mark.parametrize(("name", "changes", "words", "warned"), CASES)
def test_what_is_only_suspicious_is_warned_of(name: str, changes: Any, words: str, warned: bool) -> None:
    base = load_design(name) if name in shipped_designs() else read_design_text(BASES[name], name)
    before, after = (words in "\n".join(("", *warnings_of(one))) for one in (base, base.with_values(changes)))
    assert after is warned
    assert not (warned and changes and before)


# Facts about the drive: value in SI, grade; what is assumed (X) is a fact of its file alone.
AMBER = {
    "gear.planetary.ratio": (66, "A"),
    "gear.worm.ratio": (36, "A"),
    "friction.dry_torque": (2.25e-3, "A"),
    "friction.viscous": (5.25e-6, "A"),
    "friction.load_coefficient": (1.34e-3, "A"),
    "load.moment_max": (8.0, "A"),
    "limits.speed": (942.5, "A"),
    "motor.torque_constant": (5.9e-3, "C"),
    "motor.back_emf_constant": (5.9e-3, "C"),
    "motor.resistance": (0.055, "D"),
    "motor.inductance": (6e-6, "D"),
    "motor.rotor_inertia": (9.2e-7, "C"),
    "limits.voltage": (12.0, "D"),
    "limits.peak_current": (12.0, "A"),
    "limits.continuous_current": (4.0, "A"),
    "limits.acceleration": (30000 * 2 * pi, "A"),
    "encoder.counts_per_rev": (1024, "A/D"),
}


@pytest.mark.parametrize("path", AMBER)
def test_the_baseline_holds_the_facts_with_their_grade(path: str) -> None:
    design = load_design("ilr33-amber")
    value, grade = AMBER[path]
    assert parameter_value(design, path) == pytest.approx(value, rel=1e-15)
    assert design.parameters[path].grade == grade
    assert design.parameters[path].source


PUBLISHED = {
    "ilr33-amber-multirate": {"control.velocity.every": 2, "control.position.every": 10},
    "ctms-motor-position": {
        "motor.rotor_inertia": 3.2284e-6, "motor.torque_constant": 0.0274, "motor.resistance": 4.0,
        "motor.inductance": 2.75e-6, "friction.viscous": 3.5077e-6,
    },
    "emps": {  # Janot, Gautier, Brunot 2019: value, standard deviation
        "motor.rotor_inertia": (95.1089, 0.1085), "friction.viscous": (203.5034, 1.1460),
        "friction.dry_torque": (20.3935, 0.1012), "friction.offset_torque": (-3.1648, 0.0444),
        "control.position.gain": 160.18, "control.velocity.gain": 243.45, "motor.source_gain": 35.15065,
        "encoder.difference_samples": 2,
    },
}  # fmt: skip


@pytest.mark.parametrize("name", PUBLISHED)
def test_a_design_holds_the_published_figures(name: str) -> None:
    design = load_design(name)
    for path, stated in PUBLISHED[name].items():
        value, std = stated if isinstance(stated, tuple) else (stated, None)
        assert parameter_value(design, path) == value
        assert std is None or design.parameters[path].tolerance.std == std


def test_the_variants_of_the_baseline_differ_from_it_only_in_what_they_are_for() -> None:
    base = dict(load_design("ilr33-amber").parameters)

    def changed(name: str) -> set[str]:
        result = load_design(name).parameters
        paths = base.keys() | result.keys()
        return {p for p in paths if p not in base or p not in result or base[p].value != result[p].value}

    assert changed("ilr33-amber-tanh") == {"friction.smoothing_speed"}
    assert load_design("ilr33-amber-tanh").friction.law == "tanh"
    assert {path.rpartition(".")[0] for path in changed("ilr33-amber-compliant")} == {
        "coupling", "load.friction",
    }  # fmt: skip


@pytest.mark.parametrize("name", ["joint", "ballscrew", "fin", "ilr33-amber-compliant"])
def test_an_elastic_design_has_its_derived_values_from_its_own_others(name: str) -> None:
    """Damping ratio of the load on its spring, c / (2 sqrt(k J)): between 2 % and 6 %, as the sources say."""
    design = load_design(name)
    k, c, J = design.coupling.stiffness_Nm_rad, design.coupling.damping_Nms_rad, design.load_side_inertia_kgm2
    assert 0.02 < c / (2 * sqrt(k * J)) < 0.06
    for parameter in design.parameters.values():
        assert parameter.source
        assert parameter.grade


def test_the_sources_of_the_drives_state_their_own_sums() -> None:
    """The equivalent inertia of the baseline is equation 12."""
    amber = load_design("ilr33-amber")
    assert amber.total_ratio == 2376
    sum_12 = 9.2e-7 + 1e-7 + (5e-7 + 5e-7) / 66**2 + 2e-4 / 2376**2
    assert amber.inertia_kgm2 == pytest.approx(sum_12, rel=1e-14)
    joint, screw = load_design("joint"), load_design("ballscrew")
    gravity = joint.load.gravity
    assert joint.load.inertia_kgm2 == pytest.approx(gravity.mass_kg * gravity.arm_m**2 + 0.06)
    J_m, J_l = joint.motor_side_inertia_kgm2 * 100**2, joint.load_side_inertia_kgm2
    resonance = sqrt(joint.coupling.stiffness_Nm_rad * (1 / J_l + 1 / J_m))
    notch = joint.controller.velocity.filters[0].frequency_rad_s
    assert notch == pytest.approx(resonance, rel=0.03)
    resonance = sqrt(screw.coupling.stiffness_Nm_rad * (1 / 100 + 1 / screw.motor_side_inertia_kgm2))
    assert screw.controller.velocity.filters[0].frequency_rad_s == pytest.approx(resonance, rel=0.01)
    # N m/A rms and V rms line-line of one motor differ by sqrt(3): one constant in the model
    same = screw.effective_motor
    assert same.torque_constant_Nm_A == pytest.approx(same.back_emf_constant_Vs_rad, rel=1e-3)
