"""A law of one's own in what asks for the loops and the running drive: validator, C code, page, tuning."""

import sys
from typing import Any

import numpy as np
import pytest
from loop_designs import controlled
from own_laws import as_law, period_s

from actuator_lti import Design, load_design
from actuator_lti.batch import Population, linear_figures
from actuator_lti.compiled.compiler import system_compiler
from actuator_lti.drive.steady import torque_gain_Nm_rad
from analyses import survey_loops, validate
from analyses.linear.code_check import check_code
from analyses.tuning.start import rule_gains
from reports.live import live_model

STAGES = ("current", "velocity", "position")


def lead(stage: str) -> Design:
    """The shipped drive with a law of one state and an anti-windup on the error of a stage."""
    design = load_design("ilr33-amber")
    if stage != "position":
        return as_law(design, stage, L=[0.5])
    gain, T = design.controller.position.gain, period_s(design, stage)
    return design.with_law(stage, ([[0.5]], [[1.0]], [[-0.25 * gain]], [[1.5 * gain]], T), ["error"])


@pytest.mark.parametrize("stage", STAGES)
def test_every_prediction_is_met(stage: str) -> None:
    """By the simulator's own derivative, in time, and beyond the limits."""
    result = validate(lead(stage))
    assert result.passed, [row for row in result.rows if row.verdict != "met"]
    assert len(result.rows) > 60


@pytest.mark.skipif(system_compiler() is None or not sys.platform.startswith("linux"), reason="no C compiler")
def test_the_compiled_code_meets_the_loops() -> None:
    assert not check_code(lead("position")).failed


def test_a_survey_has_the_sampled_form_alone() -> None:
    result = survey_loops(lead("velocity"))
    assert set(result.forms) == {"sampled"}
    assert not result.budgets


@pytest.mark.parametrize("stage", STAGES)
def test_it_stays_as_it_is_while_the_rest_moves(stage: str) -> None:
    design = lead(stage)
    page: Any = live_model(design)
    free, fixed = ({key["path"] for key in page[part]} for part in ("keys", "fixed"))
    others = {f"control.{other}.gain" for other in STAGES if other != stage}
    assert others | {f"control.{stage}.law.gain"} <= free
    assert "control.period" in fixed
    assert f"control.{stage}.gain" not in free | fixed
    gains = rule_gains(design).values
    assert others <= set(gains)
    assert not any(path.startswith(f"control.{stage}.") for path in gains)


def test_many_designs_have_the_gain_of_the_law() -> None:
    design, factors = lead("velocity"), np.array([0.5, 1.0, 2.0])
    many = linear_figures(Population(design, {"control.velocity.law.gain": factors}, 3))
    for k, factor in enumerate(factors):
        one = design.with_values({"control.velocity.law.gain": float(factor)})
        alone = linear_figures(Population(one, {}, 1))
        for loop in ("current", "velocity", "position"):
            wanted = alone.quantity("gain_margin", loop)[0]
            assert many.quantity("gain_margin", loop)[k] == pytest.approx(wanted, rel=1e-12)


def test_torque_at_rest() -> None:
    """Of a static law the product of the gains; a law that integrates has no end of it."""
    base = controlled(load_design("ilr33-amber"), velocity={"integral_time_s": None})
    gain, T = base.controller.velocity.gain, period_s(base, "velocity")
    static = base.with_law("velocity", ([[0.5]], [[0.5]], [[0.4 * gain]], [[0.6 * gain]], T), ["error"])
    assert torque_gain_Nm_rad(static) == pytest.approx(torque_gain_Nm_rad(base), rel=1e-12)
    assert torque_gain_Nm_rad(lead("velocity")) == np.inf
