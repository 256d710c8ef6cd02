"""Statistics block by block, and probability intervals that cover as they claim."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_equal
from scipy.stats import binom

from actuator_lti.design.model import Tolerance
from analyses.monte_carlo.sketch import MOST, Sketch, merged
from analyses.monte_carlo.statistics import SHARES, clopper_pearson, column_statistics
from analyses.studies.sampling import Factor, Sampler


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
        patch.setattr("analyses.monte_carlo.sketch.MOST", 16)
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
def test_the_exact_interval_covers_at_least_as_claimed(probability):
    count = 200
    outcomes = np.arange(count + 1)
    ends = [clopper_pearson(int(k), count) for k in outcomes]
    covers = np.array([low <= probability <= high for low, high in ends])
    coverage = binom.pmf(outcomes, count, probability)[covers].sum()
    assert 0.95 <= coverage <= 1.0


def test_the_interval_covers_for_sobol_points_too():
    """400 studies of 128 points of a known probability: P(x + y < 0.3) = 0.045 in the unit square."""
    covered = 0
    for seed in range(400):
        factors = tuple(Factor(p, 0.5, Tolerance(kind="uniform", half_width=0.5)) for p in "xy")
        points = Sampler(factors, np.eye(2), seed=seed).draw(0, 128)
        low, high = clopper_pearson(int((points.sum(axis=1) < 0.3).sum()), 128)
        covered += low <= 0.045 <= high
    assert covered >= 0.95 * 400
