"""Friction at a constant speed, on drives whose load changes with the angle too."""

from __future__ import annotations

from dataclasses import replace

import pytest

from actuator_lti import load_design
from analyses.validation import validate
from analyses.validation.steady import level, steady_entry
from nonlinear.on_the_bench import on_the_bench
from nonlinear.operating_motion import operating_motion
from tests.validation.random_drives import full_drive
from tests.validation.small_settings import SMALL

SETTLE = 20_000  # ticks


def test_the_fin_s_friction_by_hand() -> None:
    """kM i = Tc + b w + k_L |T_s| + T_s/N with T_s = Tc_l + b_l w/N - M, without the slope of M."""
    design = on_the_bench(load_design("fin"))
    row = steady_entry(design, design, SETTLE)
    motion = operating_motion(level(design))
    w, M = motion.speed_rad_s, motion.load_Nm
    spring = 0.05 + 0.02 * w / 60.0 - M
    wanted = (8e-3 + 1e-5 * w + 1.7e-3 * abs(spring) + spring / 60.0) / 0.03
    assert row.passed
    assert "slope and gravity left out" in row.condition
    assert row.predicted == pytest.approx(wanted, rel=1e-12)
    assert row.measured == pytest.approx(wanted, rel=1e-9)


@pytest.mark.parametrize("name", ["fin", "joint"])
@pytest.mark.parametrize("part", ["dry_torque_Nm", "viscous_Nms_rad"])
def test_wrong_friction_is_seen_though_the_load_changes_with_the_angle(name: str, part: str) -> None:
    design = on_the_bench(load_design(name))
    wrong = replace(design.friction, **{part: getattr(design.friction, part) * 1.01})
    assert steady_entry(design, replace(design, friction=wrong), SETTLE).passed is False


def test_a_heavy_drive_with_short_ticks_is_judged_by_what_a_tick_can_add() -> None:
    """A current below ulp(w) J/(kM T) moves no speed: the figure cannot be known better."""
    amber = on_the_bench(load_design("ilr33-amber"))
    heavy = replace(
        amber, motor=replace(amber.motor, rotor_inertia_kgm2=1e6 * amber.motor.rotor_inertia_kgm2)
    )
    light, slow = (steady_entry(one, one, SETTLE) for one in (amber, heavy))
    assert slow.tolerance > light.tolerance


def test_damping_of_the_load_is_part_of_a_constant_speed() -> None:
    """kM i = Tc + b w + D w/N^2 + CM D w/N, rigid; the last by friction of the load's moment."""
    amber = on_the_bench(load_design("ilr33-amber"))
    D, CM, N = 0.05, amber.friction.load_coefficient, amber.total_ratio
    design = replace(amber, load=replace(amber.load, path="back-drivable", moment_damping_Nms_rad=D))
    row = steady_entry(design, design, SETTLE)
    w = operating_motion(design).speed_rad_s
    friction, motor = design.friction, design.motor
    torque = friction.dry_torque_Nm + friction.viscous_Nms_rad * w + D * w / N**2 + CM * D * w / N
    assert CM > 0.0
    assert row.passed
    assert row.measured == pytest.approx(torque / motor.torque_constant_Nm_A, rel=1e-9)


@pytest.mark.parametrize("name", ["ilr33-amber", "fin"])
def test_a_damped_load_fails_no_check(name: str) -> None:
    """15 rows of ilr33-amber disagreed: its motion was begun without what the damping takes."""
    design = load_design(name)
    damped = replace(design.load, path="back-drivable", moment_damping_Nms_rad=0.05)
    result = validate(replace(design, load=damped), SMALL)
    assert not result.failed
    if name == "ilr33-amber":
        assert any("by load" in note for note in result.notes)


def test_a_loop_that_only_the_friction_left_out_holds_is_not_judged() -> None:
    """Seed 80075: a pendulum behind a train whose friction grows with the load; failed as not stable."""
    result = validate(full_drive(80075), SMALL)
    assert result.held_by_friction == ("position",)
    assert not result.failed
    assert not result.unstable
    row = next(row for row in result.ledger if row.quantity == "stability")
    assert row.passed is None
    assert "friction of two slopes" in row.reason
