"""A stage that locks itself before the coupling, with gears behind it (model.md section 6)."""

from math import radians

import numpy as np
import pytest

from actuator_lti import InputError, load_design, plant
from actuator_lti.design import Design, design_hash, read_design_text, with_overrides, write_design
from nonlinear import commands, simulate

AMBER = load_design("ilr33-amber")
CHAIN = {
    "gear": [
        {"name": "planetary", "ratio": 66},
        {"name": "worm", "ratio": 36},
        {"name": "chain", "ratio": 2},
    ],
    "coupling": {"stiffness": "50 N*m/rad", "damping": "0.3 N*m*s/rad", "after": "worm"},
    "load.inertia": "4e-3 kg*m^2",
}


def steering(**changes: str) -> Design:
    return with_overrides(AMBER, {**CHAIN, "load.locking_gear": "worm", **changes})


def test_a_worm_before_a_chain_is_accepted_and_the_last_gear_is_meant_where_nothing_is_said() -> None:
    design = steering()
    assert (design.ratio_to_coupling, design.ratio_behind_coupling) == (2376.0, 2.0)
    again = read_design_text(write_design(design), design.origin)
    assert again == design
    assert design_hash(again) == design_hash(design)
    for wrong, words in (
        ({}, "coupling.after.*before the self-locking stage; allowed: chain"),
        ({"load.locking_gear": "chain"}, "before the self-locking stage"),
        ({"load.locking_gear": "bevel"}, "load.locking_gear.*is no gear; allowed: planetary, worm, chain"),
        ({"load.locking_gear": "worm", "friction.load_coefficient": 0.9 / 4752}, "gives energy"),
        ({"load.locking_gear": "worm", "load.path": "back-drivable"}, "load.locking_gear = .*self-locking"),
    ):
        with pytest.raises(InputError, match=words):
            with_overrides(AMBER, {**CHAIN, **wrong})


@pytest.mark.parametrize("load_Nm", [4.0, -4.0])
def test_the_motor_feels_the_load_as_friction_only(load_Nm: float) -> None:
    """At a constant speed T_s = -M/N_r, and kM i = C0 + CM N_r |T_s| + Cv w = C0 + CM |M| + Cv w."""
    design = steering()
    rate = radians(5.0)
    run = simulate(design, commands.ramp(rate_rad_s=rate), 1.0, load_Nm=load_Nm)
    friction, kM = design.friction, design.motor.torque_constant_Nm_A
    w = rate * design.total_ratio
    wanted = (friction.dry_torque_Nm + friction.load_coefficient * 4.0 + friction.viscous_Nms_rad * w) / kM
    last = slice(int(0.8 * len(run.time_s)), None)
    assert np.mean(run.current_A[last]) == pytest.approx(wanted, rel=1e-6)
    twist = run.motor_angle_rad[-1] / 2376.0 - 2.0 * run.output_angle_rad[-1]
    assert twist == pytest.approx(-load_Nm / 2.0 / 50.0, rel=1e-6)


@pytest.mark.parametrize(("point", "sign"), [("driving", 1.0), ("driven", -1.0)])
def test_the_linear_motor_feels_the_spring_through_its_friction_only(point: str, sign: float) -> None:
    """dw/dt = ... -+ CM N_r k twist/J_m, by the side on which the coupling is pressed."""
    design = steering()
    system = plant(design, "ideal", operating_point=point)
    entry = system.A[system.state_labels.index("w"), system.state_labels.index("twist")]
    J_m, CM = design.motor_side_inertia_kgm2, design.friction.load_coefficient
    assert entry == pytest.approx(-sign * CM * 2.0 * 50.0 / J_m, rel=1e-12)
