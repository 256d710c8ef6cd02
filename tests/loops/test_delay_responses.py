"""Responses of loops with several delays against the series of all ways round the loop.

1/(1 + sum P_j exp(-tau_j s)) is the sum of all products of -P_j exp(-tau_j s). A product of rational
functions is a power series in 1/s, and c/s^(k+1) the response c t^k/k! from its delay on: entire functions,
summed here in 900 bits.
"""

from itertools import pairwise
from math import factorial

import control
import flint
import numpy as np
import pytest

from actuator_lti import DelaySystem, step_figures

Rational = tuple[np.ndarray, np.ndarray]
POINTS = 61
BENDS = (0, 10, 11, 25, 60)  # samples at which the input changes its slope


def random_loop(rng: np.random.Generator, feedthrough: bool) -> tuple[list[Rational], np.ndarray]:
    """Gains and lags of first and second order, each behind a delay of its own."""
    delays, parts = rng.uniform(0.3, 2.0, int(rng.integers(1, 4))), []
    for _ in delays:
        w, zeta = rng.uniform(0.5, 4.0), rng.uniform(0.1, 0.9)
        dens = ([1.0, 0.0], [1.0, rng.uniform(0.2, 5.0)], [1.0, 2.0 * zeta * w, w**2])
        den = np.array(dens[rng.integers(3)])
        num = rng.uniform(0.1, 0.8, den.size - 1) / delays.size
        if feedthrough:
            num = np.polyadd(num, rng.uniform(-0.8, 0.8) / delays.size * den)
        parts.append((num, den))
    return parts, delays


def in_powers(num: np.ndarray, den: np.ndarray) -> flint.arb_series:
    """num/den as a series in 1/s, of doubles taken exactly."""
    full = np.concatenate((np.zeros(len(den) - len(num)), num))
    return flint.arb_series([float(v) for v in full]) / flint.arb_series([float(v) for v in den])


def round_the_loop(parts: list[Rational], delays: np.ndarray, end: float) -> dict[float, flint.arb_series]:
    """By delay the sum of all products of -P_j that come by the end."""
    passes = [-in_powers(*part) for part in parts]
    found: dict[tuple[int, ...], flint.arb_series] = {}
    level = {(0,) * len(parts): flint.arb_series([1])}
    while level:
        found |= level
        longer: dict[tuple[int, ...], flint.arb_series] = {}
        for often, series in level.items():
            for j, once in enumerate(passes):
                key = tuple(k + (i == j) for i, k in enumerate(often))
                if np.dot(key, delays) <= end:
                    longer[key] = longer.get(key, 0) + series * once
        level = longer
    return {float(np.dot(often, delays)): series for often, series in found.items()}


def in_one_loop(parts: list[Rational], delays: np.ndarray) -> DelaySystem:
    loop = DelaySystem.from_system(0.0)
    for part, delay in zip(parts, delays, strict=True):
        loop += DelaySystem.from_system(control.tf(*part)) * DelaySystem.delay(delay)
    return loop


def truth(parts, delays, times, u, patch) -> np.ndarray:
    """Response of 1/(1 + L) to an input that jumps to its first value and is straight between its bends."""
    fastest, end = max(np.abs(np.roots(den)).max() for _, den in parts), times.max()
    patch.setattr(flint.ctx, "cap", int(4.0 * fastest * end) + 80)
    patch.setattr(flint.ctx, "prec", 900)
    y = np.zeros(times.size)
    slopes = [(u[b] - u[a]) / (times[b] - times[a]) for a, b in pairwise(BENDS)]
    changes = np.diff(slopes, prepend=0.0)
    begins = [(0.0, 0, u[0]), *((times[b], 1, k) for b, k in zip(BENDS, changes, strict=False))]
    for late, series in round_the_loop(parts, delays, end).items():
        for begin, order, size in begins:
            terms = [series[k] * size / factorial(k + order) for k in range(flint.ctx.cap)]
            response = flint.arb_poly(terms)
            for i in np.flatnonzero(times >= begin + late):
                t = flint.arb(times[i] - begin - late)
                y[i] += float(response(t) * t**order)
    return y


@pytest.mark.parametrize("feedthrough", [False, True])
@pytest.mark.parametrize("seed", range(6))
def test_loops_of_delays_without_a_common_measure(feedthrough, seed, monkeypatch):
    rng = np.random.default_rng([seed, feedthrough])
    parts, delays = random_loop(rng, feedthrough)
    times = np.linspace(0.0, rng.uniform(2.0, 6.0) * delays.max(), POINTS)
    u = np.interp(times, times[list(BENDS)], rng.uniform(-1.0, 1.0, len(BENDS)))
    closed = DelaySystem.from_system(1.0).feedback(in_one_loop(parts, delays))
    wanted = truth(parts, delays, times, u, monkeypatch)
    found = control.forced_response(closed, times, u).y
    assert np.ravel(found) == pytest.approx(wanted, abs=1e-9 * np.abs(wanted).max())
    late = control.forced_response(closed, 2.0**20 + times, u).y  # a record's own clock
    assert np.ravel(late) == pytest.approx(wanted, abs=1e-8 * np.abs(wanted).max())


@pytest.mark.parametrize("seed", range(5))
def test_step_figures_of_loops_of_delays_without_a_common_measure(seed: int, monkeypatch: pytest.MonkeyPatch):
    parts, delays = random_loop(np.random.default_rng([seed, 2]), False)
    f = step_figures(in_one_loop(parts, delays).feedback())
    early = np.flatnonzero(f.time_s < 4.0 * delays.max())
    special = [t for t in (f.peak_time_s, f.settling_time_s) if t < 4.0 * delays.max()]
    chosen = f.time_s[early[np.linspace(0, early.size - 1, POINTS).astype(int)]]
    times = np.concatenate((special, chosen))
    wanted = 1.0 - truth(parts, delays, times, np.ones(times.size), monkeypatch)  # L/(1 + L)
    found, size = np.interp(times, f.time_s, f.response), np.abs(wanted).max()
    assert found[len(special) :] == pytest.approx(wanted[len(special) :], abs=1e-7 * size)
    for t, value in zip(special, wanted, strict=False):
        if t == f.peak_time_s:
            assert f.peak_value == pytest.approx(value, rel=1e-7)
        else:
            assert abs(value / f.final_value - 1.0) == pytest.approx(0.02, abs=1e-7)
