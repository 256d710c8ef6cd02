"""The compliance by periodic response, and the figures of stiffness that a requirement names."""

from dataclasses import replace

import numpy as np
import pytest

from actuator_lti.asked.drive_figure import drive_figure
from actuator_lti.batch import Population
from actuator_lti.batch import drive_figures as many
from actuator_lti.design import load_design
from actuator_lti.design.model import Requirement
from actuator_lti.loops import assemble_loops
from actuator_lti.loops.compliance import compliance
from actuator_lti.loops.stiffness import stiffness_figures
from analyses.specification.requirements import evaluate_requirements
from tests.loops.two_mass import drive_e


@pytest.mark.parametrize("name", ["joint", "ballscrew", "fin", "ilr33-amber-compliant", "emps"])
def test_the_periodic_response_is_that_of_the_time_invariant_system(name: str) -> None:
    """Two derivations: M ticks followed one after the other, and one system of M n states."""
    loops, result = assemble_loops(load_design(name)), compliance(load_design(name))
    z = np.exp(2j * np.pi * np.geomspace(0.1, 1000.0, 30) * result.period_s)
    lifted = loops.moment_to_output
    assert np.abs(result(z) / lifted(z) - 1.0).max() < 1e-9
    assert result.slowest == pytest.approx(np.abs(lifted.poles()).max(), rel=1e-9)


def test_stacked_designs_have_the_figures_of_each_alone() -> None:
    design = load_design("ballscrew")
    values = {
        "coupling.stiffness": np.array([4e7, 1e8, 3e8]),
        "control.position.gain": np.array([20.0, 60.0, 90.0]),
    }
    population = Population(design, values, 3)
    for quantity in ("static_stiffness", "least_stiffness", "lost_motion"):
        together = many(population, quantity)
        for k in range(3):
            alone = Population(design, {path: array[k : k + 1] for path, array in values.items()}, 1)
            assert together[k] == pytest.approx(many(alone, quantity)[0], rel=1e-9)


def test_designs_of_other_structure_are_taken_group_by_group() -> None:
    """Computing delays of whole and of broken ticks, damping of zero: other states, other zeros."""
    design = load_design("fin")
    values = {
        "control.computing_delay": np.array([0.0, 1e-4, 2e-4, 5e-4]),
        "coupling.damping": np.array([0.0, 0.05, 0.05, 0.0]),
    }
    result = many(Population(design, values, 4), "least_stiffness")
    for k in range(4):
        alone = Population(design, {path: array[k : k + 1] for path, array in values.items()}, 1)
        assert result[k] == pytest.approx(many(alone, "least_stiffness")[0], rel=1e-9)


def test_static_stiffness_by_hand() -> None:
    """P on the motor's sensor with an integral in the velocity loop: the spring alone, 400 N m/rad; a rigid
    one comes back."""
    assert drive_figure(drive_e(), "static_stiffness") == pytest.approx(400.0, rel=1e-6)
    assert stiffness_figures(replace(drive_e(), coupling=None)).static_stiffness_Nm_rad == np.inf


def test_requirements_on_stiffness_and_lost_motion() -> None:
    """K of drive E is 400 N m/rad; the fin has 1.5 mrad of play and 2 * 0.36/800 rad of twist."""
    stiff = [
        Requirement(id="soft", quantity="static_stiffness", unit="N*m/rad", minimum=399.0),
        Requirement(id="stiff", quantity="static_stiffness", unit="N*m/rad", minimum=401.0),
    ]
    verdicts = evaluate_requirements(replace(drive_e(), requirements=tuple(stiff)))
    assert [one.verdict for one in verdicts] == ["met", "not met"]
    lost = Requirement(id="lost", quantity="lost_motion", unit="deg", maximum=0.2, load_Nm=8.0)
    (result,) = evaluate_requirements(replace(load_design("fin"), requirements=(lost,)))
    assert result.value == pytest.approx(np.degrees(1.5e-3 + 2 * 0.36 / 800.0), rel=1e-12)
    assert result.verdict == "met"
