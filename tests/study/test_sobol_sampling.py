"""Samples and what is counted of them: Sobol' points, intervals of odds, steps of a sweep."""

from functools import reduce

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_equal
from scipy.stats import binom
from toleranced import normal, uniform

from actuator_lti import load_design, read_design_text, write_design
from actuator_lti.batch import Population
from actuator_lti.design import parameter_value, paths_of, with_values
from actuator_lti.design.model import Tolerance
from analyses.monte_carlo import task
from analyses.monte_carlo.result import MOST, SHARES, Sketch, clopper_pearson, column_statistics
from analyses.monte_carlo.task import StepCheck, step_columns, step_rows
from analyses.studies.sampling import Factor, Sampler, read_table, sampler_of
from nonlinear import Reducers, Run, commands, simulate_many
from tests.refusals import refused

R, L = "motor.resistance", "motor.inductance"
BOX, BELL = uniform(R, 10.0, 2.0), normal(L, 5.0)


def sampler(*factors, correlation=None, seed=0):
    size = len(factors)
    matrix = np.eye(size) if correlation is None else np.array([[1.0, correlation], [correlation, 1.0]])
    return Sampler(tuple(factors), matrix, seed=seed)


def test_a_sample_is_the_same_alone_and_in_any_chunk_and_seed_zero_is_a_seed():
    study = sampler(BOX, BELL, correlation=0.5, seed=7)
    whole = study.draw(0, 1000)
    assert np.array_equal(np.vstack([study.draw(0, 1), study.draw(1, 332), study.draw(333, 667)]), whole)
    assert np.array_equal(study.draw(777, 1)[0], whole[777])
    zero, again, one = (sampler(BOX, seed=s).draw(0, 8) for s in (0, 0, 1))
    assert np.array_equal(zero, again)
    assert not np.array_equal(zero, one)
    refused(sampler, BOX, seed=-1, words="seed")


def test_uniform_is_even_and_normals_have_their_moments_and_coefficient():
    values = sampler(BOX).draw(0, 4096)[:, 0]
    assert 8.0 <= values.min() < values.max() <= 12.0
    counts, _ = np.histogram(values, bins=64, range=(8, 12))
    assert np.all(counts == 64)  # what a Sobol sequence promises and random numbers do not
    values = sampler(BELL).draw(0, 8192)[:, 0]
    assert values.mean() == pytest.approx(5.0, abs=1e-3)
    assert values.std() == pytest.approx(1.0, abs=2e-3)
    cut = Factor(L, 5.0, Tolerance(kind="truncated-normal", std=1.0, lower=4.0, upper=6.0))
    kept = sampler(cut).draw(0, 8192)[:, 0]
    assert 4.0 <= kept.min() < kept.max() <= 6.0
    # variance of a standard normal cut at +-1: 1 - 2 phi(1)/(2 Phi(1) - 1)
    phi, mass = np.exp(-0.5) / np.sqrt(2 * np.pi), 0.6826894921370859
    assert kept.var() == pytest.approx(1 - 2 * phi / mass, rel=2e-3)
    pair = sampler(normal(R, 5.0), normal(L, 5.0), correlation=-0.8).draw(0, 8192)
    assert np.corrcoef(pair.T)[0, 1] == pytest.approx(-0.8, abs=2e-3)


def test_identified_samples_keep_their_rows_and_impossible_tolerances_are_refused(tmp_path):
    path = tmp_path / "friction.csv"
    path.write_text("friction.viscous,friction.dry_torque\n1e-6,1e-3\n2e-6,2e-3\n4e-6,4e-3\n8e-6,8e-3\n")
    design = load_design("ilr33-amber")
    table = read_table(path, list(design.parameters))
    study = sampler_of(design, table=table)
    drawn = study.draw(0, 4096)
    viscous, dry = (drawn[:, study.paths.index(p)] for p in table.paths)
    assert np.array_equal(dry, viscous * 1000)
    assert np.unique(viscous, return_counts=True)[1].tolist() == [1024] * 4
    bad = {"motor.colour\n1\n": "motor.colour", "motor.resistance\nnan\n": "finite"}
    for text, words in (bad | {"motor.resistance\nred\n": "number"}).items():
        path.write_text(text)
        refused(read_table, path, ["motor.resistance"], words=words)
    refused(sampler_of, load_design("ctms-motor-position"), words="tolerance")
    wide = 'tolerance = { kind = "normal", std = "50 %" }'
    text = write_design(load_design("ilr33-amber")).replace('tolerance = "50 %"', wide)
    refused(sampler_of, read_design_text(text), words="truncated-normal")


def merged(parts):
    return reduce(Sketch.merged, parts, Sketch())


def statistics_of(values, size):
    parts = [Sketch.of(values[k : k + size]) for k in range(0, len(values), size)]
    return column_statistics("x", "dB", merged(parts))


@pytest.mark.parametrize("values", [
    np.random.default_rng(0).normal(size=MOST),
    np.random.default_rng(1).lognormal(sigma=3, size=5000),
    -np.random.default_rng(2).lognormal(sigma=3, size=5000),
    np.round(np.random.default_rng(3).normal(size=200_000), 3),
    np.ones(100),
    np.array([3.0]),
    np.array([0.0, -0.0, 5e-324, -5e-324, 1e307, -1e307]),
])  # fmt: skip
def test_up_to_so_many_different_values_quantiles_are_the_order_statistics(values):
    result = statistics_of(values, 4096)
    ranks = np.clip(np.ceil(np.array(SHARES) * len(values)).astype(int) - 1, 0, None)
    assert result.quantiles == tuple(np.sort(values)[ranks])
    assert result.count == sum(result.counts) == len(values)
    assert result.mean == pytest.approx(values.mean(), rel=1e-12, abs=1e-15)
    if len(values) > 1 and np.abs(values).max() < 1e100:
        assert result.std == pytest.approx(values.std(ddof=1), rel=1e-9, abs=1e-300)


@pytest.mark.parametrize("values", [
    9.4 + 0.001 * np.random.default_rng(0).normal(size=300_000),
    np.random.default_rng(1).normal(size=300_000),
    np.random.default_rng(2).lognormal(sigma=3, size=300_000),
])  # fmt: skip
def test_of_more_values_a_quantile_is_that_of_a_narrow_bin(values):
    """Within a thousandth of the spread or of the value; counts and ends stay exact, the memory bounded."""
    sketch = merged(Sketch.of(part) for part in np.array_split(values, 50))
    assert MOST // 4 < len(sketch.keys) <= MOST
    result = column_statistics("x", "1", sketch)
    exact = np.quantile(values, SHARES, method="inverted_cdf")
    np.testing.assert_allclose(result.quantiles, exact, rtol=1e-3, atol=1e-3 * min(1.0, values.std()))
    assert (result.minimum, result.maximum, result.count) == (values.min(), values.max(), 300_000)
    assert result.mean == pytest.approx(values.mean(), rel=1e-4, abs=1e-4 * values.std())
    assert result.std == pytest.approx(values.std(ddof=1), rel=1e-3)


@given(
    values=st.lists(
        st.floats(-1e307, 1e307) | st.sampled_from([np.nan, np.inf, -np.inf]), min_size=1, max_size=60
    ),
    cuts=st.lists(st.integers(1, 59), max_size=6),
    seed=st.integers(0, 99),
)
@settings(max_examples=60)
def test_sketches_of_parts_are_that_of_the_whole_in_any_order(values, cuts, seed):
    """Also where bits are dropped: at most 16 bins here."""
    column = np.array(values)
    parts = np.split(column, sorted({cut for cut in cuts if cut < len(column)}))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("analyses.monte_carlo.result.MOST", 16)
        whole = Sketch.of(column)
        shuffled = [Sketch.of(parts[k]) for k in np.random.default_rng(seed).permutation(len(parts))]
        made = merged(shuffled)
    assert len(whole.keys) <= 16
    assert_equal(vars(made), vars(whole))
    assert_equal(made.moments(), whole.moments())


def test_infinite_and_missing_figures_are_counted_apart():
    values = np.concatenate([np.arange(90.0), np.full(10, np.inf), np.full(100, np.nan)])
    result = statistics_of(values, 7)
    assert (result.count, result.missing, result.infinite) == (200, 100, 10)
    assert result.quantiles[SHARES.index(0.5)] == 49.0  # of the 100 that are defined
    assert result.quantiles[SHARES.index(0.95)] == np.inf
    assert result.maximum == 89.0


@pytest.mark.parametrize("probability", [0.003, 0.05, 0.5, 0.97])
def test_each_exact_bound_holds_at_least_as_claimed(probability):
    low, high = np.array([clopper_pearson(k, 200) for k in range(201)]).T
    for holds in (low <= probability, probability <= high):
        assert 0.95 <= binom.pmf(np.arange(201), 200, probability)[holds].sum() <= 1.0


def test_each_bound_holds_for_sobol_points_too():
    """400 studies of 128 points of a known probability: P(x + y < 0.3) = 0.045 in the unit square."""
    covered = np.zeros(2)
    for seed in range(400):
        points = Sampler((uniform("x", 0.5, 0.5), uniform("y", 0.5, 0.5)), np.eye(2), seed=seed).draw(0, 128)
        low, high = clopper_pearson(int((points.sum(axis=1) < 0.3).sum()), 128)
        covered += low <= 0.045, high >= 0.045
    assert covered.min() >= 0.95 * 400


FIXED = ("control.period", "limits.continuous_current", "load.moment_max", "load.moment_slope", "every")
VARIED = ("motor", "gear", "friction", "control", "limits", "load")
STEP = StepCheck(0.01, 0.1, load_Nm=2.0)


@pytest.mark.parametrize("name", ["ilr33-amber", "ilr33-amber-multirate", "emps", "ctms-motor-position"])
def test_rows_are_those_of_the_designs(name):
    design = load_design(name)
    rng = np.random.default_rng(4)
    known = [p for p in paths_of(design) if p in design.parameters and not p.endswith(FIXED)]
    changing = [p for p in known if p.startswith(VARIED)]
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
    assert columns.keys() == {f"nonlinear.{name}" for name in task.STEP}
    assert columns["nonlinear.rise_time"][0] > 0.01
    assert columns["nonlinear.peak_current"][0] <= 12.5
