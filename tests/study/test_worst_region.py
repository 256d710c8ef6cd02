"""The worst case in a region of tolerances, of tied parameters too."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2, norm
from toleranced import asked_twice, need, normal, toleranced, uniform

from actuator_lti.batch import Population, linear_figures
from actuator_lti.design import load_design, read_design_text, write_design
from actuator_lti.design.model import Correlation, Design, Tolerance
from actuator_lti.errors import InputError
from analyses.estimation.fit import Fit
from analyses.identification.to_design import design_with_fit
from analyses.monte_carlo import MonteCarloSettings, monte_carlo, task
from analyses.monte_carlo.task import replay
from analyses.monte_carlo.worst import Region
from analyses.studies.sampling import Sampler, Table, correlation_of, sampler_of, semidefinite_root
from analyses.tuning.problem import gain_requirements, problem_of


def _cube(region: Region, count: int = 4000) -> np.ndarray:
    return np.random.default_rng(1).uniform(size=(count, region.dimensions))


def test_without_correlations_it_is_the_box_and_samples_of_a_table_are_taken_whole() -> None:
    sampler = Sampler((normal("a", 1.0, 0.1), uniform("b", 5.0, 2.0)), np.eye(2))
    region = Region(sampler)
    assert region.dimensions == 2
    assert region.values(np.array([[0.0, 1.0]]))[0].tolist() == pytest.approx([0.7, 7.0])
    drawn = sampler.draw(0, 50)
    inside = np.clip(drawn, *sampler.box)
    np.testing.assert_allclose(region.values(region.cube(inside)), inside, rtol=1e-12)
    # a table whose columns sum to one: no point of the region breaks that
    first = np.random.default_rng(3).uniform(size=40)
    table = Table(("x", "y"), np.column_stack([first, 1.0 - first]))
    region = Region(Sampler((normal("a"),), np.eye(1), table))
    assert region.dimensions == 2
    values = region.values(_cube(region, 500))
    np.testing.assert_allclose(values[:, 1] + values[:, 2], 1.0, atol=1e-12)
    rows = np.column_stack([np.zeros(40), table.rows])
    np.testing.assert_allclose(region.values(region.cube(rows)), rows, atol=1e-12)


@pytest.mark.parametrize("r", [-0.97, -0.4, 0.2, 0.8, 0.999])
def test_two_normal_parameters_stay_in_their_ellipse_and_reach_its_ends(r: float) -> None:
    """s' R^-1 s = (s1^2 - 2 r s1 s2 + s2^2) / (1 - r^2), of the probability that two boxes have."""
    sampler = Sampler((normal("a", 0.0, 2.0), normal("b", 10.0, 0.5)), np.array([[1.0, r], [r, 1.0]]))
    region = Region(sampler)
    squared = chi2.ppf((1.0 - 2.0 * norm.sf(3.0)) ** 2, 2)
    values = region.values(_cube(region))
    s1, s2 = values[:, 0] / 2.0, (values[:, 1] - 10.0) / 0.5
    inside = (s1**2 - 2.0 * r * s1 * s2 + s2**2) / (1.0 - r**2)
    free = (np.abs(s1) < 3.0) & (np.abs(s2) < 3.0)  # the box cuts the ends off
    assert np.max(inside[free]) <= squared * (1.0 + 1e-9)
    assert np.max(np.abs([s1, s2])) <= 3.0 + 1e-12
    # the largest difference s1 - s2 of the ellipse is radius * sqrt(2 (1 - r))
    edge = np.linspace(0.0, 1.0, 2001)
    faces = np.vstack(
        [np.column_stack([edge, 0.0 * edge]), np.column_stack([edge, 0.0 * edge + 1.0]),
         np.column_stack([0.0 * edge, edge]), np.column_stack([0.0 * edge + 1.0, edge])]
    )  # fmt: skip
    result = region.values(faces)
    widest = np.max(result[:, 0] / 2.0 - (result[:, 1] - 10.0) / 0.5)
    assert widest == pytest.approx(np.sqrt(squared * 2.0 * (1.0 - r)), rel=1e-4 if r > 0.0 else 0.1)
    drawn = values[free][:200]
    np.testing.assert_allclose(region.values(region.cube(drawn)), drawn, rtol=1e-7, atol=1e-9)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_tied_parameters_move_as_one_and_reach_the_edges(sign: float) -> None:
    """kM = kE: one coordinate; a uniform one reaches its edge, a normal one three deviations."""
    tie = np.array([[1.0, sign], [sign, 1.0]])
    boxes, bells = (uniform("kM", 2.0, 0.2), uniform("kE", 4.0, 0.4)), (normal("kM", 2.0), normal("kE", 4.0))
    for pair in (boxes, bells):
        region = Region(Sampler(pair, tie))
        assert region.dimensions == 1
        values = region.values(_cube(region, 300))
        width = [factor.box[1] - factor.nominal for factor in pair]
        shares = (values - [2.0, 4.0]) / width
        np.testing.assert_allclose(shares[:, 0], sign * shares[:, 1], atol=1e-9)
        ends = region.values(np.array([[0.0], [1.0]]))[:, 0]
        assert sorted(ends) == pytest.approx([2.0 - width[0], 2.0 + width[0]], rel=1e-9)


def test_a_worst_case_of_correlated_parameters_is_one_that_occurs(tmp_path) -> None:
    """The friction and inertia of a drive, correlated at -0.95: the search does not leave their ellipse."""
    base = asked_twice(load_design("ilr33-amber"))
    names = sampler_of(base).paths[:2]
    tied = replace(base, correlations=(Correlation(first=names[0], second=names[1], coefficient=-0.95),))
    study = monte_carlo(tied, tmp_path, MonteCarloSettings(samples=64, seed=2))
    region = Region(sampler_of(tied, seed=2))
    assert study.worst
    for case in study.worst:
        point = np.array([[case.parameters[path] for path in region.sampler.paths]])
        np.testing.assert_allclose(region.values(region.cube(point)), point, rtol=1e-6)


KM, KE = "motor.torque_constant", "motor.back_emf_constant"


def _tied(coefficient: float = 1.0) -> Design:
    design = read_design_text(write_design(load_design("ilr33-amber")))
    parameters, tolerance = dict(design.parameters), Tolerance(kind="normal", std=1e-4)
    parameters |= {path: replace(parameters[path], tolerance=tolerance) for path in (KM, KE)}
    pair = Correlation(first=KM, second=KE, coefficient=coefficient)
    tied = replace(design, parameters=parameters, correlations=(pair,))
    return read_design_text(write_design(tied))


@pytest.mark.parametrize("toleranced", [(KM,), (KE,), (KM, KE)])
def test_torque_and_back_emf_constant_move_by_one_factor(tmp_path, toleranced) -> None:
    """Without a word on how they go together: samples, worst cases and corners of the tuning."""
    base = read_design_text(write_design(load_design("ilr33-amber"))).with_values({KE: 6.1e-3})
    wide = {path: Tolerance(kind="uniform", text="20 %", half_width=0.2 * base.parameters[path].value)
            for path in toleranced}  # fmt: skip
    kept = {path: replace(one, tolerance=wide.get(path)) for path, one in base.parameters.items()}
    design = read_design_text(write_design(asked_twice(replace(base, parameters=kept))))
    study = monte_carlo(design, tmp_path, MonteCarloSettings(samples=64))
    made = [replay(design, sampler_of(design), k) for k in range(8)]
    made += [load_design(case.file) for case in study.worst]
    ratios = [one.motor.torque_constant_Nm_A / one.motor.back_emf_constant_Vs_rad for one in made]
    assert ratios == pytest.approx(len(made) * [5.9 / 6.1], rel=1e-9)
    assert np.ptp([one.motor.torque_constant_Nm_A for one in made]) > 1e-3
    problem = problem_of(design, gain_requirements(design), {"control.position.gain": 100.0})
    assert len(problem.all_corners) == 3
    factor = np.array([1.0, 0.8, 1.2])
    gains = {path: np.full(3, value) for path, value in zip(problem.paths, problem.start, strict=True)}
    values = {**gains, KM: 5.9e-3 * factor, KE: 6.1e-3 * factor}
    moved = linear_figures(Population(design, values, 3), held=True)
    found = problem.figure("bandwidth", "position", problem.start[None], problem.all_corners)[0]
    assert found == pytest.approx(moved.quantity("bandwidth", "position"), rel=1e-9)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_one_constant_is_drawn_as_one_and_opposite_ones_opposite(sign: float) -> None:
    sampler = sampler_of(_tied(sign))
    draws = dict(zip(sampler.paths, sampler.draw(0, 512).T, strict=True))
    assert draws[KM] - 5.9e-3 == pytest.approx(sign * (draws[KE] - 5.9e-3), rel=1e-9, abs=1e-15)
    assert np.std(draws[KM]) == pytest.approx(1e-4, rel=0.05)


def test_three_that_are_one_what_contradicts_and_no_corner_where_one_constant_is_two() -> None:
    design = _tied()
    problem = problem_of(design, gain_requirements(design), {"control.position.gain": 100.0})
    names = [factor.path for factor in problem.factors]
    corners = problem.all_corners
    i, j = names.index(KM), names.index(KE)
    assert corners[:, i] == pytest.approx(corners[:, j], rel=1e-12)
    assert len(corners) == 1 + 2 ** (len(names) - 1)
    assert {float(v) for v in np.round(corners[:, i], 8)} == {5.6e-3, 5.9e-3, 6.2e-3}
    # L L' gives the matrix back for singular ones; an indefinite one is refused
    for matrix in (np.ones((3, 3)), np.array([[1.0, 1.0, 0.5], [1.0, 1.0, 0.5], [0.5, 0.5, 1.0]])):
        root = semidefinite_root(matrix)
        assert root @ root.T == pytest.approx(matrix, abs=1e-12)
    with pytest.raises(InputError, match="contradict"):
        semidefinite_root(np.array([[1.0, 1.0, 0.5], [1.0, 1.0, -0.5], [0.5, -0.5, 1.0]]))


def test_an_identified_covariance_comes_out_of_the_samples_cut_off_where_no_drive_is() -> None:
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
    # a friction of 2 +- 1.5 would be negative in one draw of eleven: its distribution ends at zero
    fit = Fit(names=("friction.viscous",), values=np.array([2e-6]), covariance=np.array([[2.25e-12]]))
    design = read_design_text(write_design(design_with_fit(load_design("ilr33-amber"), fit, "test")))
    tolerance = design.parameters["friction.viscous"].tolerance
    assert tolerance.kind == "truncated-normal"
    sampler = sampler_of(design)
    drawn = sampler.draw(0, 2000)[:, sampler.paths.index("friction.viscous")]
    assert drawn.min() > 0.0


def test_the_search_for_the_figure_of_a_step_follows_no_other_loop(monkeypatch, tmp_path) -> None:
    """The current loop of ilr33-amber settles in 9 000 samples, which is most of the time."""
    followed = []

    def noted(*asked, time_figures, **more):
        followed.append(time_figures)
        return linear_figures(*asked, time_figures=time_figures, **more)

    monkeypatch.setattr(task, "linear_figures", noted)
    design = read_design_text(toleranced(motor={"resistance": 5.0}))
    asked = replace(need("overshoot", None, loop="position", unit="%"), maximum=50.0)
    made = monte_carlo(replace(design, requirements=(asked,)), tmp_path, MonteCarloSettings(samples=4))
    assert made.worst[0].passed
    assert {one for one in followed if one is not True} == {("position",)}
