"""The shipped designs hold the published figures, each with its grade and source."""

from math import pi

import pytest

from actuator_lti.design import load_design, parameter_value, shipped_designs, warnings_of
from actuator_lti.errors import InputError

# Facts about the drive: value in SI, grade.
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
    "gear.planetary.input_inertia": (1e-7, "X"),
    "gear.planetary.output_inertia": (5e-7, "X"),
    "gear.worm.input_inertia": (5e-7, "X"),
    "load.inertia": (2e-4, "X"),
    "limits.voltage": (12.0, "D"),
    "limits.peak_current": (12.0, "A"),
    "limits.continuous_current": (4.0, "A"),
    "limits.acceleration": (30000 * 2 * pi, "A"),
    "control.period": (1e-4, "X"),
    "control.computing_delay": (1e-4, "X"),
    "control.current.gain": (0.02, "X"),
    "control.current.integral_time": (150e-6, "X"),
    "control.velocity.gain": (0.12, "X"),
    "control.velocity.integral_time": (15e-3, "X"),
    "control.position.gain": (120.0, "X"),
    "encoder.counts_per_rev": (1024, "A/D"),
    "validation.full_deflection": (pi / 18, "X"),
}


@pytest.mark.parametrize("path", AMBER)
def test_the_baseline_holds_the_facts_with_their_grade(path: str) -> None:
    design = load_design("ilr33-amber")
    value, grade = AMBER[path]
    assert parameter_value(design, path) == pytest.approx(value, rel=1e-15)
    assert design.parameters[path].grade == grade
    assert design.parameters[path].source


def test_the_baseline_has_no_value_beside_the_listed_ones() -> None:
    assert set(load_design("ilr33-amber").parameters) == set(AMBER)


def test_the_equivalent_inertia_is_equation_12() -> None:
    design = load_design("ilr33-amber")
    expected = 9.2e-7 + 1e-7 + (5e-7 + 5e-7) / 66**2 + 2e-4 / 2376**2
    assert design.total_ratio == 2376
    assert design.inertia_kgm2 == pytest.approx(expected, rel=1e-14)


def test_the_assumed_inertias_carry_half_their_value_as_tolerance() -> None:
    design = load_design("ilr33-amber")
    widths = {p.path: p.tolerance.half_width for p in design.parameters.values() if p.tolerance}
    assert widths == pytest.approx(
        {
            "gear.planetary.input_inertia": 0.5e-7,
            "gear.planetary.output_inertia": 2.5e-7,
            "gear.worm.input_inertia": 2.5e-7,
            "load.inertia": 1e-4,
        }
    )


def test_the_baseline_ships_the_example_requirements() -> None:
    limits = {
        (r.quantity, r.loop): (r.minimum, r.maximum, r.unit, r.load_Nm)
        for r in load_design("ilr33-amber").requirements
    }
    assert limits == {
        ("gain_margin", "every"): (6.0, None, "dB", None),
        ("phase_margin", "every"): (45.0, None, "deg", None),
        ("sensitivity_peak", "every"): (None, 6.0, "dB", None),
        ("bandwidth", "position"): (15.0, None, "Hz", None),
        ("output_rate", None): (20.0, None, "deg/s", 8.0),
        ("motor_current", None): (None, 4.0, "A", 8.0),
    }
    assert all("example" in r.note for r in load_design("ilr33-amber").requirements)


def test_the_multirate_design_has_slower_outer_loops() -> None:
    control = load_design("ilr33-amber-multirate").controller
    assert control.velocity is not None
    assert (control.velocity.every, control.position.every) == (2, 10)


def test_the_textbook_motor_has_only_a_position_loop() -> None:
    design = load_design("ctms-motor-position")
    motor, control = design.motor, design.controller
    assert (motor.rotor_inertia_kgm2, motor.torque_constant_Nm_A) == (3.2284e-6, 0.0274)
    assert (motor.resistance_ohm, motor.inductance_H) == (4.0, 2.75e-6)
    assert design.friction.viscous_Nms_rad == 3.5077e-6
    assert control.velocity is None
    assert control.current is None


def test_emps_holds_the_published_figures() -> None:
    design = load_design("emps")  # Janot, Gautier, Brunot 2019
    assert design.axis == "linear"
    assert not design.motor.has_electrical_dynamics
    published = {
        "motor.rotor_inertia": (95.1089, 0.1085),
        "friction.viscous": (203.5034, 1.1460),
        "friction.dry_torque": (20.3935, 0.1012),
        "friction.offset_torque": (-3.1648, 0.0444),
    }
    for path, (value, std) in published.items():
        parameter = design.parameters[path]
        assert parameter.tolerance is not None
        assert (parameter.value, parameter.tolerance.std) == (value, std)
    assert parameter_value(design, "control.position.gain") == 160.18
    assert parameter_value(design, "control.velocity.gain") == 243.45
    assert parameter_value(design, "motor.source_gain") == 35.15065
    assert design.parameters["friction.viscous"].unit == "N*s/m"
    assert design.encoder.difference_samples == 2


def test_every_shipped_design_is_named_like_its_file_and_the_baseline_comes_first() -> None:
    assert shipped_designs()[0] == "ilr33-amber"
    assert [load_design(name).name for name in shipped_designs()] == list(shipped_designs())


def test_the_baseline_gives_no_cause_for_suspicion() -> None:
    assert warnings_of(load_design("ilr33-amber")) == ()


def test_an_unknown_name_is_answered_with_the_nearest() -> None:
    with pytest.raises(InputError, match='nearest known: "ilr33-amber"'):
        load_design("ilr33-ambre")
