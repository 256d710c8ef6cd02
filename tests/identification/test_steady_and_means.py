"""The steady part of a run, and means of correlated series."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from actuator_lti.errors import InputError
from analyses.estimation.means import correlated_means, correlation_time
from analyses.identification.steady import SteadyCriterion, find_steady_window


def _run(noise: float) -> tuple[np.ndarray, np.ndarray]:
    time = np.arange(0.0, 10.0, 1e-3)
    speed = 400.0 * np.clip(np.minimum(time - 1.0, 9.0 - time), 0.0, 1.0)
    return time, speed + noise * np.random.default_rng(0).standard_normal(len(time))


@pytest.mark.parametrize("noise", [0.0, 3.0])
def test_the_window_lies_on_the_plateau(noise: float) -> None:
    time, speed = _run(noise)
    window = find_steady_window(time, speed)
    assert 2.0 < window.start_s < 2.5
    assert 7.5 < window.stop_s < 8.0
    assert window.largest_acceleration_rad_s2 <= window.limit_rad_s2


def test_the_limit_is_the_stated_one() -> None:
    time, speed = _run(0.0)
    window = find_steady_window(time, speed, SteadyCriterion(relative_per_s=0.01))
    assert window.limit_rad_s2 == pytest.approx(4.0, rel=1e-3)


def test_a_run_that_never_settles_is_refused_with_its_acceleration() -> None:
    time = np.arange(0.0, 10.0, 1e-3)
    with pytest.raises(InputError, match=r"no steady part .* the limit"):
        find_steady_window(time, 300.0 + 40.0 * time)


def test_reverse_motion_is_steady_too() -> None:
    time, speed = _run(1.0)
    assert find_steady_window(time, -speed).stop_s > 7.0


def test_correlation_time_of_an_autoregressive_series() -> None:
    rng = np.random.default_rng(2)
    a = 0.9
    x = lfilter([1.0], [1.0, -a], rng.standard_normal(200_000))
    assert correlation_time(x) == pytest.approx((1.0 + a) / (1.0 - a), rel=0.1)
    assert correlation_time(rng.standard_normal(50_000)) == pytest.approx(1.0, abs=0.1)


def test_the_standard_error_of_a_correlated_mean_is_that_of_many_repetitions() -> None:
    rng = np.random.default_rng(4)
    a, n, repeats = 0.95, 5000, 300
    series = lfilter([np.sqrt(1.0 - a**2)], [1.0, -a], rng.standard_normal((repeats, n)), axis=1)
    stated = np.array([correlated_means(x[:, None]).standard_errors[0] for x in series])
    true = np.std(series.mean(axis=1))
    naive = 1.0 / np.sqrt(n)
    assert np.sqrt(np.mean(stated**2)) == pytest.approx(true, rel=0.15)
    assert true > 4.0 * naive
