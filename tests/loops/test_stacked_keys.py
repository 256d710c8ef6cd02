"""Every number of a rich design varied by itself in a stack: the figures are those of the design alone."""

import numpy as np
import pytest

from actuator_lti.batch import Population, linear_figures, variable_paths
from actuator_lti.batch.static import drive_figures
from actuator_lti.design import load_design, parameter_value, with_overrides, with_values
from actuator_lti.design.model import Design
from actuator_lti.errors import InputError

STATIC = ("output_rate", "motor_current", "acceleration")


def rich() -> Design:
    """The joint, with everything that a joint may have besides."""
    return with_overrides(load_design("joint"), {
        "temperature.winding": "80 degC", "temperature.magnet": "60 degC", "supply.resistance": "0.05 ohm",
        "load.moment_slope": "-20 N*m/rad", "load.friction.offset_torque": "0.1 N*m",
        "coupling.play": "0.2 mrad", "load.moment_damping": "0.5 N*m*s/rad",
        "load.gear_error": "0.3 N*m", "load.gear_error_periods": 3, "load.gear_error_phase": "40 deg",
        "motor.cogging": "4 mN*m", "motor.cogging_periods": 12, "motor.cogging_phase": "70 deg",
        "control.position.derivative_time": "2 ms", "control.position.derivative_filter": "1 ms",
        "control.position.acceleration_feedforward": 0.5, "control.current.back_emf_feedforward": 0.5,
        "control.current.resistance_feedforward": 0.3, "command.filter_time": "3 ms",
        "friction.offset_torque": "1 mN*m",
    })  # fmt: skip


@pytest.mark.parametrize("path", variable_paths(rich()))
def test_a_stack_is_its_designs(path: str) -> None:
    design = rich()
    value = parameter_value(design, path)
    other = 1.02 * value if value else 0.01
    try:
        alone = with_values(design, {path: other}, check=False)
    except InputError:
        pytest.skip("no other value is allowed")
    stack = Population(design, {path: np.array([value, other])}, 2)
    many = linear_figures(stack, time_figures=False)
    single = linear_figures(Population(alone, {}, 1), time_figures=False)
    for loop in many.loops:
        for quantity in ("gain_margin", "phase_margin", "bandwidth"):
            found = many.quantity(quantity, loop)[1]
            assert found == pytest.approx(single.quantity(quantity, loop)[0], rel=1e-7, nan_ok=True), quantity
    for quantity in STATIC:
        expected = drive_figures(Population(alone, {}, 1), quantity, 5.0)[0]
        assert drive_figures(stack, quantity, 5.0)[1] == pytest.approx(expected, rel=1e-9, nan_ok=True)
