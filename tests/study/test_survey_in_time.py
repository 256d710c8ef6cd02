"""A report of a drive with many ticks in a period comes to its end."""

from actuator_lti import assemble_loops
from actuator_lti.design import load_design, with_values
from analyses.linear.loop_survey import MOST_STATES, survey_loops


def test_a_fundamental_of_very_many_states_has_exact_borders_and_a_reason() -> None:
    changed = {"control.position.every": 40, "control.position.gain": 5.0}
    design = with_values(load_design("ballscrew"), changed)
    states = {name: len(loop.plain_open.A) for name, loop in assemble_loops(design).break_points.items()}
    points = survey_loops(design).break_points
    large = [name for name, count in states.items() if count > MOST_STATES]
    assert large
    for name in large:
        assert points[name].figures is None
        assert points[name].exact is not None
        assert f"{states[name]} states" in points[name].reason
    assert points["output"].figures is not None
