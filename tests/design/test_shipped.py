"""The shipped designs hold the published figures, each with its grade and source."""

from math import pi, sqrt

import pytest

from actuator_lti.design import load_design, parameter_value, shipped_designs

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


def test_the_stages_of_the_textbook_motor_and_of_the_force_source() -> None:
    control, emps = load_design("ctms-motor-position").controller, load_design("emps")
    assert (control.velocity, control.current) == (None, None)
    assert (emps.axis, emps.motor.has_electrical_dynamics) == ("linear", False)
    assert emps.parameters["friction.viscous"].unit == "N*s/m"


def test_the_shipped_designs_are_these_each_named_like_its_file() -> None:
    assert shipped_designs()[0] == "ilr33-amber"
    assert [load_design(name).name for name in shipped_designs()] == list(shipped_designs())


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
