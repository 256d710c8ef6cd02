"""Parameters that are one (kM and kE of one motor), and identified ones with their covariance."""

import numpy as np
import pytest

from actuator_lti.design import load_design, read_design_text, write_design
from actuator_lti.design.model import Correlation, Design, Tolerance
from actuator_lti.errors import InputError
from analyses.estimation.fit import Fit
from analyses.identification.to_design import design_with_fit
from analyses.studies.sampling import correlation_of, sampler_of, semidefinite_root
from analyses.tuning.problem import loop_requirements, problem_of

KM, KE = "motor.torque_constant", "motor.back_emf_constant"


def _tied(coefficient: float = 1.0) -> Design:
    text = write_design(load_design("ilr33-amber"))
    design = read_design_text(text)
    from dataclasses import replace

    tolerance = Tolerance(kind="normal", std=1e-4)
    parameters = {
        path: replace(one, tolerance=tolerance) if path in (KM, KE) else one
        for path, one in design.parameters.items()
    }
    pair = Correlation(first=KM, second=KE, coefficient=coefficient)
    tied = replace(design, parameters=parameters, correlations=(pair,))
    return read_design_text(write_design(tied))


def test_one_constant_is_drawn_as_one() -> None:
    sampler = sampler_of(_tied())
    draws = dict(zip(sampler.paths, sampler.draw(0, 512).T, strict=True))
    assert draws[KM] == pytest.approx(draws[KE], rel=1e-12)
    assert np.std(draws[KM]) == pytest.approx(1e-4, rel=0.05)


def test_opposite_parameters_are_drawn_opposite() -> None:
    sampler = sampler_of(_tied(-1.0))
    draws = dict(zip(sampler.paths, sampler.draw(0, 64).T, strict=True))
    assert draws[KM] - 5.9e-3 == pytest.approx(5.9e-3 - draws[KE], rel=1e-9)


def test_three_that_are_one_and_what_contradicts() -> None:
    """L L' gives the matrix back for singular ones; an indefinite one is refused."""
    for matrix in (np.ones((3, 3)), np.array([[1.0, 1.0, 0.5], [1.0, 1.0, 0.5], [0.5, 0.5, 1.0]])):
        root = semidefinite_root(matrix)
        assert root @ root.T == pytest.approx(matrix, abs=1e-12)
    with pytest.raises(InputError, match="contradict"):
        semidefinite_root(np.array([[1.0, 1.0, 0.5], [1.0, 1.0, -0.5], [0.5, -0.5, 1.0]]))


def test_tuning_looks_at_no_corner_where_one_constant_is_two() -> None:
    design = _tied()
    problem = problem_of(design, loop_requirements(design), {"control.position.gain": 100.0})
    names = [factor.path for factor in problem.factors]
    corners = problem.all_corners
    i, j = names.index(KM), names.index(KE)
    assert corners[:, i] == pytest.approx(corners[:, j], rel=1e-12)
    assert len(corners) == 1 + 2 ** (len(names) - 1)
    assert {float(v) for v in np.round(corners[:, i], 8)} == {5.6e-3, 5.9e-3, 6.2e-3}


def test_an_identified_covariance_comes_out_of_the_samples() -> None:
    """Three values with a nearly singular covariance: written, read, drawn, and found again."""
    paths = ("friction.dry_torque", "friction.viscous", "friction.load_coefficient")
    values = np.array([2.25e-3, 5.25e-6, 1.34e-3])
    std = 0.01 * values
    correlation = np.array([[1.0, -0.999, 0.3], [-0.999, 1.0, -0.3], [0.3, -0.3, 1.0]])
    covariance = correlation * np.outer(std, std)
    fit = Fit(names=paths, values=values, covariance=covariance)
    design = read_design_text(write_design(design_with_fit(load_design("ilr33-amber"), fit, "test")))
    assert correlation_of(design, list(paths)) == pytest.approx(correlation, abs=2e-6)
    sampler = sampler_of(design)
    draws = sampler.draw(0, 4096)[:, [sampler.paths.index(path) for path in paths]]
    assert np.cov(draws.T) == pytest.approx(covariance, rel=0.03)


def test_a_value_poorly_known_is_cut_off_where_no_drive_is() -> None:
    """A friction of 2 +- 1.5 would be negative in one draw of eleven: its distribution ends at zero."""
    fit = Fit(names=("friction.viscous",), values=np.array([2e-6]), covariance=np.array([[2.25e-12]]))
    design = read_design_text(write_design(design_with_fit(load_design("ilr33-amber"), fit, "test")))
    tolerance = design.parameters["friction.viscous"].tolerance
    assert tolerance.kind == "truncated-normal"
    sampler = sampler_of(design)
    drawn = sampler.draw(0, 2000)[:, sampler.paths.index("friction.viscous")]
    assert drawn.min() > 0.0
