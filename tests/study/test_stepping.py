"""The nonlinear step of every sample is the simulator's own run of that sample's design."""

import numpy as np
import pytest

from actuator_lti import load_design
from actuator_lti.batch import Population
from actuator_lti.design import parameter_value, paths_of, with_values
from analyses.monte_carlo.stepping import StepCheck, step_columns, step_rows, step_units
from nonlinear import commands
from nonlinear.runs.batch import Reducers, Run, simulate_many

FIXED = ("control.period", "limits.continuous_current", "load.moment_max", "load.moment_slope")
STEP = StepCheck(0.01, 0.1, load_Nm=2.0)


@pytest.mark.parametrize("name", ["ilr33-amber", "ilr33-amber-multirate", "emps", "ctms-motor-position"])
def test_rows_are_those_of_the_designs(name):
    design = load_design(name)
    rng = np.random.default_rng(4)
    changing = [
        p
        for p in paths_of(design)
        if p in design.parameters and p.startswith(("motor", "gear", "friction", "control", "limits", "load"))
        and p not in FIXED and not p.endswith("every")
    ]  # fmt: skip
    values = {p: parameter_value(design, p) * rng.uniform(0.95, 1.0, 3) for p in changing}
    if "motor.back_emf_constant" in values:
        values["motor.back_emf_constant"] = values["motor.torque_constant"]
    rows = step_rows(STEP, Population(design, values, 3))
    for k in range(3):
        changed = with_values(design, {p: float(v[k]) for p, v in values.items()})
        run = Run(
            design=changed, command=commands.step(STEP.amplitude_rad), duration_s=0.1, load_Nm=2.0,
            reducers=Reducers(step_target_rad=STEP.amplitude_rad, extremes=True),
        )  # fmt: skip
        truth = simulate_many([run], threads=1).rows[0]
        assert rows.values[k] == pytest.approx(truth, rel=1e-12, abs=1e-300)


def test_every_column_has_a_unit_and_a_value():
    columns = step_columns(STEP, Population(load_design("ilr33-amber"), {}, 1))
    assert columns.keys() == step_units().keys()
    assert columns["nonlinear.rise_time"][0] > 0.01
    assert columns["nonlinear.peak_current"][0] <= 12.5
