"""The clock of a load that comes on by itself: in steady motion the current follows it, not the speed."""

from dataclasses import replace

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft
from scipy.stats import chi2

from actuator_lti.errors import InputError
from actuator_lti.types import Floats
from analyses.estimation.series import correlation_time, minus_likelihood, slow_shares, without_noise
from analyses.records.clocks import ClockJoin
from analyses.records.finding import NO_CHANCE, SURE
from analyses.records.record import Record
from analyses.records.steady_window import CRITERION, find_steady_window

GRID = 40_000  # points over the longer record, at most
ROUNDING = 1e-9
ORDERS = 64  # polynomials over the steady time: what bends faster than a quarter of them is noise
PER_ROOT = 2.0  # times the square root of the rows: as many orders as equally spaced rows tell apart


def by_current(drive: Record, sensor: Record, join: ClockJoin, signal: str) -> ClockJoin:
    """The join, by current and load where these contradict it; else as it is.

    Speed and load tell the clock only where the load comes with the motion. While the speed is steady the
    current is a share of the load, which is against the motion, and a slow drift: of all offsets at which the
    sensor covers half of that time, the one that leaves the least is taken where the likelihood ratio
    (chi-square, as many tries as offsets, the residual's correlation in time counted) rejects all that the
    join's own standard deviation allows, whose rate does not hold then either. The standard deviation is the
    half width where that ratio is 1.
    """
    try:
        window = find_steady_window(drive.time_s, drive["speed"], replace(CRITERION, trim_s=0.0))
    except InputError:
        return join
    own, sensor_s = drive.slice(window.start, window.stop), join.rate * sensor.time_s
    period = max(drive.period_s, float(max(np.ptp(drive.time_s), np.ptp(sensor_s))) / GRID)
    half = 0.5 * np.ptp(own.time_s)
    time = np.arange(own.time_s[0], own.time_s[-1], period)
    grid = np.arange(sensor_s[0] - half, sensor_s[-1] + half, period)
    current = np.interp(time, own.time_s, own["current"])
    even = np.linspace(sensor_s[0], sensor_s[-1], len(sensor_s))
    load = without_noise(np.interp(even, sensor_s, np.abs(sensor[signal])))
    load = np.interp(grid, even, load)  # outside its record as at its ends
    if not np.ptp(current) * np.ptp(load):
        return join
    offsets = time[0] - grid[: len(load) - len(current) + 1]
    apart = np.abs(offsets - join.offset_s)
    current = float(np.sign(current.mean())) * current
    ratio, quality = _against_the_best(current, load)
    claimed = apart <= max(SURE * join.offset_std_s, float(np.min(apart)))
    if not len(ratio) * chi2.sf(np.min(ratio[claimed]), 1) < NO_CHANCE:
        return join
    if join.rate != 1.0:
        offset = join.offset_s + (join.rate - 1.0) * float(np.mean(sensor.time_s))
        return by_current(drive, sensor, replace(join, offset_s=offset, rate=1.0, rate_std=None), signal)
    width = 0.5 * period * np.count_nonzero(ratio <= 1.0)
    offset, by = float(offsets[np.argmin(ratio)]), replace(join, method="correlation", first_signal="current")
    return replace(by, offset_s=offset, offset_std_s=float(width), quality=quality)


def _against_the_best(current: Floats, load: Floats) -> tuple[Floats, float]:
    """Minus twice the log likelihood of the current at each place of the load, less the least; correlation.

    A share of the load below zero is none. Beside it stand a constant and a slow drift, each polynomial with
    its share (`slow_shares`); rows count by the correlation in time of what is left by the likeliest.
    Shapes (n,) and (m,), m > n; the ratios have shape (m - n + 1,).
    """
    n, load, total = len(current), load - load.mean(), float(current @ current)
    waves = _polynomials(n, min(ORDERS, int(PER_ROOT * np.sqrt(n))))
    drift, squares, own = slow_shares(len(waves)), np.append(0.0, np.cumsum(load**2)), waves @ current
    size = next_fast_len(len(load), real=True)  # what wraps around is not among the places
    spectra = np.conj(spectra := rfft(np.vstack([waves, current]), size), out=spectra)
    spectra *= rfft(load, size)
    placed = irfft(spectra, size, overwrite_x=True)[:, : len(load) - n + 1]
    power = squares[n:] - squares[:-n] - drift @ placed[:-1] ** 2
    beside = np.maximum(placed[-1] - (drift * own) @ placed[:-1], 0.0)
    seen = power > ROUNDING * squares[-1]
    slope = np.divide(beside, power, out=np.zeros_like(power), where=seen)
    alone = total - drift @ own**2
    left, worth = np.maximum(alone[:, None] - slope * beside, ROUNDING * total), float(n)
    for _ in range(2):
        minus = minus_likelihood(left, drift, worth)
        cut, best = np.unravel_index(np.argmin(minus), minus.shape)
        rest = current - slope[cut, best] * load[best : best + n]
        worth = n / correlation_time(rest - (drift[cut] * (waves @ rest)) @ waves)
    ratio = np.min(minus, axis=0) - minus[cut, best]
    return ratio, float(np.sqrt(1.0 - left[cut, best] / alone[cut]))


def _polynomials(rows: int, orders: int) -> Floats:
    """The first orthonormal polynomials over equally spaced rows (Gram's), shape (orders, rows).

    By their recurrence, a tenth of the time of an orthogonal factor; it loses digits beyond twice the square
    root of the rows.
    """
    k, x, waves = np.arange(orders), np.linspace(1.0 - rows, rows - 1.0, rows), np.zeros((orders, rows))
    steps = np.sqrt(k * k * (rows * rows - k * k) / (4.0 * k * k - 1.0))
    waves[0] = 1.0 / np.sqrt(rows)
    for n in k[1:]:
        waves[n] = (x * waves[n - 1] - steps[n - 1] * waves[n - 2]) / steps[n]
    return waves
