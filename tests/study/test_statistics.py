"""Statistics block by block, and probability intervals that cover as they claim."""

import numpy as np
import pytest
from scipy.stats import binom

from actuator_lti.design.model import Tolerance
from analyses.monte_carlo.statistics import SHARES, clopper_pearson, column_statistics
from analyses.sampling import Factor, Sampler


def blocks_of(values, size):
    return lambda: ({"x": values[k : k + size]} for k in range(0, len(values), size))


@pytest.mark.parametrize("values", [
    np.random.default_rng(0).normal(size=20_001),
    np.random.default_rng(1).lognormal(sigma=3, size=5000),
    np.ones(100),
    np.array([3.0]),
])  # fmt: skip
def test_quantiles_are_the_order_statistics(values):
    result = column_statistics(blocks_of(values, 4096), {"x": "1"})["x"]
    ranks = np.clip(np.ceil(np.array(SHARES) * len(values)).astype(int) - 1, 0, None)
    assert result.quantiles == tuple(np.sort(values)[ranks])
    assert result.mean == pytest.approx(values.mean(), rel=1e-12)
    assert result.count == sum(result.counts) == len(values)
    if len(values) > 1:
        assert result.std == pytest.approx(values.std(ddof=1), rel=1e-9, abs=1e-300)


def test_infinite_and_missing_figures_are_counted_apart():
    values = np.concatenate([np.arange(90.0), np.full(10, np.inf), np.full(100, np.nan)])
    result = column_statistics(blocks_of(values, 7), {"x": "dB"})["x"]
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
