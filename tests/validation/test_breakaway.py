"""Breaking away: the static friction in the simulator is that of the design, and a wrong ratio is seen."""

from __future__ import annotations

from dataclasses import replace

import pytest

from actuator_lti import load_design
from actuator_lti.design.model import Friction, Gravity
from analyses.validation.breakaway import breakaway_entry

AMBER = load_design("ilr33-amber")


def with_friction(**values: float) -> Friction:
    return replace(AMBER.friction, **values)


@pytest.mark.parametrize("ratio", [1.0, 1.4])
@pytest.mark.parametrize("offset", [0.0, 0.5e-3])
def test_it_starts_at_the_ratio_times_dry_friction_and_the_offset(ratio: float, offset: float) -> None:
    """T = r Tc + T_offset, by hand."""
    friction = with_friction(dry_torque_Nm=2e-3, breakaway_ratio=ratio, offset_torque_Nm=offset)
    design = replace(AMBER, friction=friction)
    row = breakaway_entry(design, design)
    assert row.passed
    assert row.measured == pytest.approx(ratio * 2e-3 + offset, rel=3e-5)


@pytest.mark.parametrize("wrong", [1e-4, -1e-4, 0.3])
def test_a_wrong_ratio_is_seen(wrong: float) -> None:
    design = replace(AMBER, friction=with_friction(breakaway_ratio=1.2))
    model = replace(AMBER, friction=with_friction(breakaway_ratio=1.2 * (1.0 + wrong)))
    assert breakaway_entry(design, model).passed is False


def test_without_dry_friction_there_is_nothing_to_see() -> None:
    design = replace(AMBER, friction=with_friction(dry_torque_Nm=0.0))
    assert breakaway_entry(design, design) is None


def test_what_is_not_judged_says_why() -> None:
    design = load_design("ilr33-amber-tanh")
    row = breakaway_entry(design, design)
    assert row.passed is None
    assert "tanh law has no friction at rest" in row.reason


def test_the_load_s_weight_is_left_out_and_said() -> None:
    """A rigid drive that lifts a mass: the ramp shows the friction alone, and a ratio 1e-4 off."""
    design = replace(
        AMBER,
        load=replace(
            AMBER.load, gravity=Gravity(mass_kg=2.0, arm_m=0.1, offset_rad=0.3), path="back-drivable"
        ),
        friction=with_friction(breakaway_ratio=1.2),
    )
    row = breakaway_entry(design, design)
    assert row.passed
    assert "without the load's weight" in row.condition
    assert row.measured == pytest.approx(1.2 * AMBER.friction.dry_torque_Nm, rel=3e-5)
    wrong = replace(design, friction=with_friction(breakaway_ratio=1.2 * (1.0 + 1e-4)))
    assert breakaway_entry(design, wrong).passed is False


@pytest.mark.parametrize("name", ["fin", "ballscrew", "joint"])
def test_behind_a_coupling_that_is_not_wound_up_the_motor_holds_by_its_own_friction(name: str) -> None:
    """T = r Tc + T_offset of the motor alone, by hand: no torque of the spring before the motor moves."""
    design = load_design(name)
    own = design.friction
    row = breakaway_entry(design, design)
    assert row.passed
    assert row.measured == pytest.approx(
        own.breakaway_ratio * own.dry_torque_Nm + own.offset_torque_Nm, rel=3e-5
    )
    doubled = replace(design, friction=replace(own, dry_torque_Nm=2.0 * own.dry_torque_Nm))
    assert breakaway_entry(design, doubled).passed is False


def test_a_load_that_moves_by_itself_is_not_judged() -> None:
    design = load_design("fin")
    behind = replace(design.load.friction, offset_torque_Nm=2.0 * design.load.friction.dry_torque_Nm)
    row = breakaway_entry(*[replace(design, load=replace(design.load, friction=behind))] * 2)
    assert row.passed is None
    assert "moves the drive by itself" in row.reason
