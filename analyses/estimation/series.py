"""Series of samples: means and what they are sure to, correlation in time, lag, slow curves under noise."""

from dataclasses import dataclass

import numpy as np
from scipy.fft import dct, idct, irfft, next_fast_len, rfft
from scipy.signal import correlate

from actuator_lti.types import Floats

BATCH_TIMES = 5.0
MIN_BATCHES, MAX_BATCHES = 8, 64


@dataclass(frozen=True, kw_only=True)
class Means:
    """Means of several signals over one stretch, and the covariance of these means."""

    values: Floats  # shape (k,)
    covariance: Floats  # shape (k, k): of batches of five correlation times or more, where the record allows
    correlation_samples: Floats  # integrated autocorrelation times (1: white): samples worth one independent


def correlated_means(columns: Floats) -> Means:
    """Means and their covariance, by batch means: columns of shape (n, k), n samples of k signals.

    The length of a batch follows the longest integrated autocorrelation time of the signals.
    """
    n = len(columns)
    tau = np.array([correlation_time(columns[:, k]) for k in range(columns.shape[1])])
    batches = int(np.clip(n / (BATCH_TIMES * tau.max()), MIN_BATCHES, MAX_BATCHES))
    length = n // batches
    means = columns[: batches * length].reshape(batches, length, -1).mean(axis=1)
    covariance = np.atleast_2d(np.cov(means, rowvar=False)) / batches
    return Means(values=columns.mean(axis=0), covariance=covariance, correlation_samples=tau)


def correlation_time(values: Floats) -> float:
    """Integrated autocorrelation time 1 + 2 sum(rho_k), in samples, not below 1.

    The sum ends at the first lag beyond five times the sum so far (Sokal's window). A constant gives 1.
    """
    x = values - values.mean()
    n = len(x)
    power = float(x @ x)
    if power <= 1e-24 * n * max(1.0, float(values.mean() ** 2)):
        return 1.0
    rho = autocovariance(x, n // 2 - 1) * n / power
    tau = 2.0 * np.cumsum(rho) - 1.0
    enough = np.arange(len(tau)) >= 5.0 * tau
    last = int(np.argmax(enough)) if enough.any() else len(tau) - 1
    return max(float(tau[last]), 1.0)


def autocovariance(values: Floats, lags: int) -> Floats:
    """Autocovariance about zero at the lags 0 to ``lags``, each the sum of products over n."""
    size = next_fast_len(2 * len(values), real=True)
    spectrum = rfft(values, size)
    return np.asarray(irfft(spectrum.real**2 + spectrum.imag**2, size)[: lags + 1] / len(values))


def best_lag(a: Floats, b: Floats) -> int:
    """Steps by which b is to be moved later to fit a, by the normalised cross-correlation."""
    return int(np.argmax(correlate(a, b, method="fft"))) - (len(b) - 1)


def slow_shares(orders: int) -> Floats:
    """What a slow curve has of each order of waves (or polynomials), one row for each extent of it.

    The variances fall with the fourth power of the order, as those of a curve whose slope wanders: from the
    cut on there is more noise (G. Wahba, Spline Models for Observational Data, 1990). Shape (cuts, orders).
    """
    cuts = 0.1 * 2.0 ** np.arange(0.0, np.log2(10.0 * orders) - 2.0, 0.5)
    return np.asarray(1.0 / (1.0 + (np.arange(orders) / cuts[:, None]) ** 4))


def minus_likelihood(left: Floats, shares: Floats, rows: float) -> Floats:
    """Minus twice the log likelihood of what each row of shares leaves of some squares, shape (cuts, ...)."""
    extent = -np.sum(np.log1p(-shares[:, 1:]), axis=1)
    return np.asarray(rows * np.log(left) + extent.reshape(-1, *[1] * (left.ndim - 1)))


def without_noise(values: Floats) -> Floats:
    """Samples at a regular step as the smoothing spline has them that is the likeliest.

    >>> time, rng = np.linspace(0.0, 1.0, 2000), np.random.default_rng(1)
    >>> slow = np.tanh(20.0 * (time - 0.4))
    >>> off = without_noise(slow + 0.1 * rng.standard_normal(2000)) - slow
    >>> bool(np.std(off) < 0.02)
    True
    """
    parts, shares = dct(values, norm="ortho"), slow_shares(len(values))
    left = np.maximum((1.0 - shares) @ parts**2, 1e-300)
    best = int(np.argmin(minus_likelihood(left, shares, len(values))))
    return np.asarray(idct(shares[best] * parts, norm="ortho"))
