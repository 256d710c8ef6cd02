"""Measured data: every margin with a range that holds it; what the points do not show is said."""

import math
import re
from collections.abc import Callable

import control
import numpy as np
import pytest

from actuator_lti.margins import MeasuredResponse, StabilityMargins, stability_margins
from actuator_lti.measured.local_fit import averaged
from actuator_lti.measured.response import GAUSSIAN
from tests.refusals import refused

A1 = control.tf([25], [1, 10, 10, 10])


def test_ranges_shrink_with_the_square_of_the_grid() -> None:
    def width(count: int) -> float:
        (phase,) = stability_margins(control.frd(A1, np.geomspace(0.2, 8, count))).phase_margins
        assert phase.deg_range[0] <= 29.1103691304 <= phase.deg_range[1]
        return phase.deg_range[1] - phase.deg_range[0]

    ratio = width(600) / width(60)  # 0.01, but for where the crossing lies between its points
    assert 0.005 < ratio < 0.02


def test_a_resonance_that_the_phase_betrays_is_mentioned() -> None:
    loop = control.tf([20e6], [1, 1, 1e6, 0])  # B2: at 1000 rad/s
    m = stability_margins(control.frd(loop, np.geomspace(1, 1e4, 50)))
    (note,) = (text for text in m.notes if "resonance" in text)
    low, high = (float(x) for x in re.findall(r"between ([\d.e+-]+) and ([\d.e+-]+) rad/s", note)[0])
    assert low < 1000.0 < high
    (gain,) = m.gain_margins  # -180 deg lies inside the resonance: how far the gain rises there is not known
    assert gain.ratio_range[0] == 0.0
    assert gain.ratio_range[1] >= stability_margins(loop).gain_margins[0].ratio


def test_no_crossing_in_the_band_is_not_called_an_infinite_margin() -> None:
    m = stability_margins(control.frd(A1, np.geomspace(0.01, 1, 50)))
    assert (m.stable, m.verdict, m.gain_margins) == (None, "undecided", ())
    assert (m.gain_margin_db, m.phase_margin_deg, m.delay_margin_s) == (None, None, None)
    assert "measured points" in m.evidence_reason


def test_delay_is_applied_exactly_to_data() -> None:
    m = stability_margins(control.frd(control.tf([100], [1, 0]), np.geomspace(20, 500, 2000)), delay_s=0.005)
    assert m.gain_margins[0].db == pytest.approx(9.9430, abs=1e-3)
    assert m.phase_margins[0].deg == pytest.approx(61.3521, abs=1e-3)


@pytest.mark.parametrize(("omega", "values", "message"), [
    ([1.0], [1.0], "two points"),
    ([1.0, 2.0, 3.0], [1.0, np.nan, 0.5], "finite"),
    ([1.0, 2.0, 3.0], [1.0, 0.0, 0.5], "not zero"),
    ([1.0, 2.0, 3.0], [1.0, -1.0, 0.5], "too coarse: 2 of 2"),
    ([1.0, 2.0, 2.0], [1.0, 0.8, 0.8], "2 rad/s is given twice; allowed: each once, repeats as Measured"),
])  # fmt: skip
def test_unusable_data(omega: list[float], values: list[float], message: str) -> None:
    refused(stability_margins, control.frd(np.array(values, dtype=complex), omega), match=message)


Response = Callable[[np.ndarray], np.ndarray]
BAND = (0.1, 3000.0)
OMEGA, FINE = np.geomspace(*BAND, 400), np.geomspace(*BAND, 300_001)


def light_plant(rng: np.random.Generator) -> Response:
    """Integrators, lags, resonances of 0.1 to 30 % damping with or without antiresonances, a delay."""
    resonances = [
        (10.0 ** rng.uniform(0, 3), 10.0 ** rng.uniform(-3, -0.5)) for _ in range(rng.integers(1, 4))
    ]
    beside = [(w * 10.0 ** rng.uniform(-0.3, 0.3), 10.0 ** rng.uniform(-3, -0.5)) for w, _ in resonances]
    kept = [pair for pair in beside if rng.random() < 0.7]
    lags = 10.0 ** rng.uniform(-1, 3, rng.integers(0, 3))
    integrators, gain, lead = int(rng.integers(0, 3)), 10.0 ** rng.uniform(-1, 3), 10.0 ** rng.uniform(-1, 2)
    delay = 10.0 ** rng.uniform(-5, -3) if rng.random() < 0.5 else 0.0

    def L(omega: np.ndarray) -> np.ndarray:
        s = 1j * omega
        y = gain * np.exp(-s * delay) / s**integrators
        y *= 1 + s / lead if integrators == 2 else 1.0
        for pole in lags:
            y /= 1 + s / pole
        for w, zeta in resonances:
            y /= 1 + 2 * zeta * s / w + (s / w) ** 2
        for w, zeta in kept:
            y *= 1 + 2 * zeta * s / w + (s / w) ** 2
        return y

    return L


def crossings(y: np.ndarray) -> tuple[list[tuple[float, float]], list[tuple[float, float]]]:
    """(frequency, margin) of every crossing of the exact response: phase in deg, then gain."""
    unity = np.flatnonzero((np.abs(y[1:]) > 1) != (np.abs(y[:-1]) > 1))
    real = np.flatnonzero(((y.imag[1:] > 0) != (y.imag[:-1] > 0)) & (y.real[:-1] < 0))
    phase = [(float(FINE[k]), math.degrees(np.angle(-y[k]))) for k in unity]
    return phase, [(float(FINE[k]), float(1 / abs(y[k]))) for k in real]


def coverage(m: StabilityMargins, y: np.ndarray) -> tuple[int, int, int]:
    """Listed margins, those that do not hold the truth, and true crossings neither listed nor noted.

    The dense grid of the truth leaves 1e-4 in frequency, 0.05 deg and 1e-3 in gain.
    """
    phase, gain = crossings(y)
    said = (re.findall(r"between (\S+) and (\S+) rad/s", text) for text in m.notes)
    spans = [(float(a), float(b)) for found in said for a, b in found]
    wrong = missed = 0
    for listed, true in ((m.phase_margins, phase), (m.gain_margins, gain)):
        brackets = [margin.bracket_rad_s or (0.0, 0.0) for margin in listed]
        for margin, (low, high) in zip(listed, brackets, strict=True):
            inside = [v for w, v in true if low * (1 - 1e-4) <= w <= high * (1 + 1e-4)]
            wrong += not inside or not all(_holds(margin, v) for v in inside)
        for w, _ in true:
            missed += not any(low * (1 - 1e-4) <= w <= high * (1 + 1e-4) for low, high in brackets + spans)
    return len(m.phase_margins) + len(m.gain_margins), wrong, missed


def _holds(margin: object, value: float) -> bool:
    deg = getattr(margin, "deg_range", None)
    if deg is not None:
        return any(deg[0] - 0.05 <= value + turn <= deg[1] + 0.05 for turn in (-360.0, 0.0, 360.0))
    low, high = margin.ratio_range
    return bool(low * (1 - 1e-3) <= value <= high * (1 + 1e-3))


def circular(rng: np.random.Generator, shape: tuple[int, ...]) -> np.ndarray:
    return (rng.normal(size=shape) + 1j * rng.normal(size=shape)) / math.sqrt(2.0)


def quiet(rng: np.random.Generator, L: Response) -> MeasuredResponse | control.FrequencyResponseData:
    return control.frd(L(OMEGA), OMEGA)


def unstated(rng: np.random.Generator, L: Response) -> MeasuredResponse | control.FrequencyResponseData:
    """One percent of noise that nobody tells of."""
    return control.frd(L(OMEGA) * (1 + 0.01 * circular(rng, OMEGA.shape)), OMEGA)


def noisy(rng: np.random.Generator, L: Response) -> MeasuredResponse:
    y, sigma = L(OMEGA), 10.0 ** rng.uniform(-3, -1)
    data = control.frd(y * (1 + sigma * circular(rng, y.shape)), OMEGA)
    return MeasuredResponse.with_noise(data, sigma * np.abs(y))


def repeated(rng: np.random.Generator, L: Response) -> MeasuredResponse:
    y, n, sigma = L(OMEGA), int(rng.integers(3, 9)), 10.0 ** rng.uniform(-3, -1)
    values = y * (1 + sigma * circular(rng, (n, y.size)))
    return MeasuredResponse.from_repeats([control.frd(each, OMEGA) for each in values])


def coherent(rng: np.random.Generator, L: Response) -> MeasuredResponse:
    """H1 from averaged spectra of a random input and an output with noise."""
    y, n, noise = L(OMEGA), int(rng.integers(8, 33)), 10.0 ** rng.uniform(-3, -1)
    x = circular(rng, (n, y.size))
    out = y * (x + noise * circular(rng, (n, y.size)))
    sxx, sxy = (np.abs(x) ** 2).sum(axis=0), (x.conj() * out).sum(axis=0)
    coherence = np.abs(sxy) ** 2 / sxx / (np.abs(out) ** 2).sum(axis=0)
    return MeasuredResponse.from_coherence(control.frd(sxy / sxx, OMEGA), coherence, n)


def nearest(y: np.ndarray) -> tuple[float, float]:
    """Smallest |1 + L| and |2 (1 + L)/(1 - L)| of the exact response over the band."""
    return float(np.abs(1 + y).min()), float((2 * np.abs((1 + y) / (1 - y))).min())


@pytest.mark.parametrize("measured", [quiet, unstated, noisy, repeated, coherent])
def test_ranges_hold_the_truth_on_lightly_damped_plants(measured: Callable[..., MeasuredResponse]) -> None:
    rng = np.random.default_rng(6)
    listed = wrong = missed = told = 0
    far = []
    for k in range(40):
        L = light_plant(rng)
        m, y = stability_margins(measured(rng, L)), L(FINE)  # never refused
        counts = coverage(m, y)
        listed, wrong, missed = listed + counts[0], wrong + counts[1], missed + counts[2]
        for true, (low, high) in zip(nearest(y), (m.modulus_range, m.disk_margin.alpha_range), strict=True):
            told += low > 0.0
            if not low * (1 - 1e-3) <= true <= high * (1 + 1e-3):
                far.append((k, true, low, high))
    assert len(far) <= 1, far
    assert told >= 19
    assert listed >= 60
    assert wrong <= 0.01 * listed
    assert missed <= 0.02 * listed


@pytest.mark.parametrize("n", [3, 5, 20])
def test_circles_of_repeats_hold_the_truth_as_often_as_they_say(n: int) -> None:
    rng = np.random.default_rng(n)
    omega = np.arange(1.0, 4001.0)
    values = 2.0 + 0.1 * circular(rng, (n, omega.size))
    result = MeasuredResponse.from_repeats([control.frd(each, omega) for each in values], confidence=0.95)
    share = np.mean(np.abs(result.frdata - 2.0) <= result.radius)
    assert abs(share - 0.95) < 4 * math.sqrt(0.95 * 0.05 / omega.size)


@pytest.mark.parametrize("n", [2, 3, 10])
@pytest.mark.parametrize("equal", [False, True])
def test_circles_of_few_repeats_hold_the_truth_in_an_antiresonance(n: int, equal: bool) -> None:
    """Noise as large everywhere, or over L; two repeats judged alone make circles of 8.3 deviations."""
    rng, omega = np.random.default_rng(n), np.geomspace(1.0, 300.0, 60)
    L = 50.0 / (1j * omega) * (1.0 + 0.04 * 1j * omega / 20.0 - (omega / 20.0) ** 2)
    deviation = 0.3 * np.ones(60) if equal else 0.02 * np.abs(L)
    held, low = [], np.argsort(np.abs(L))[:6]
    for _ in range(100):
        values = L + deviation * circular(rng, (n, 60))
        result = MeasuredResponse.from_repeats([control.frd(each, omega) for each in values])
        held.append(np.abs(result.frdata - L) <= result.radius)
        assert np.median(result.radius / deviation) * n**0.5 < 3.0
    assert np.mean(held) > 0.975
    assert np.mean(np.array(held)[:, low]) > 0.95


def test_values_lost_in_noise_give_no_gain_margin() -> None:
    omega = np.geomspace(0.2, 1000, 400)
    data = control.frd(A1, omega)
    m = stability_margins(MeasuredResponse.with_noise(data, 1e-4))
    assert [g.frequency_rad_s for g in m.gain_margins] == [pytest.approx(math.sqrt(10), rel=0.02)]
    assert any("smaller than their noise" in text for text in m.notes)


@pytest.mark.parametrize(("call", "message"), [
    (lambda d: MeasuredResponse.with_noise(d, -1.0), "standard_deviation"),
    (lambda d: MeasuredResponse.with_noise(d, [1.0, 2.0, 3.0]), "one for each of the 2"),
    (lambda d: MeasuredResponse.with_noise(d, 0.1, confidence=1.0), "confidence"),
    (lambda d: MeasuredResponse.from_coherence(d, 0.0, 8), "coherence"),
    (lambda d: MeasuredResponse.from_coherence(d, 0.9, 1), "averages"),
    (lambda d: MeasuredResponse.from_repeats([d]), "at least two"),
    (lambda d: MeasuredResponse.from_repeats([d, control.frd([1, 0.5], [1.0, 3.0])]), "same frequencies"),
])  # fmt: skip
def test_unusable_noise(call: Callable[..., MeasuredResponse], message: str) -> None:
    refused(call, control.frd([1.0, 0.5], [1.0, 2.0]), match=message)


def test_crossings_that_a_coarse_measurement_tells_apart_are_listed_apart() -> None:
    """Twelve points of a two-mass drive: the gain passes one three times, surely, between known points."""

    def L(w: np.ndarray) -> np.ndarray:
        s, wr, wa = 1j * w, 632.0, 447.0
        mode = (1 + 0.01 * s / wa + (s / wa) ** 2) / (1 + 0.01 * s / wr + (s / wr) ** 2)
        return 300 / s * mode * np.exp(-3e-4 * s) / (1 + s / 3000)

    omega = np.geomspace(20.0, 3000.0, 12)
    m = stability_margins(MeasuredResponse.with_noise(control.frd(L(omega), omega), 0.0))
    plain = stability_margins(control.frd(L(omega), omega))  # its bends may be noise: figures, no ranges
    assert [p.deg for p in plain.phase_margins] == [p.deg for p in m.phase_margins]
    assert {p.deg_range for p in plain.phase_margins} == {None}
    side = np.abs(L(omega)) > 1.0
    passed = np.flatnonzero(side[1:] != side[:-1])
    assert len(m.phase_margins) == len(passed) == 3
    for margin, k in zip(m.phase_margins, passed, strict=True):
        assert margin.bracket_rad_s[0] <= omega[k] < omega[k + 1] <= margin.bracket_rad_s[1]
        assert f"between {margin.bracket_rad_s[0]:.6g} and" in str(margin)
    fine = np.geomspace(20.0, 3000.0, 300_001)
    y = L(fine)
    for k in np.flatnonzero((np.abs(y[1:]) > 1) != (np.abs(y[:-1]) > 1)):
        (margin,) = (p for p in m.phase_margins if p.bracket_rad_s[0] <= fine[k] <= p.bracket_rad_s[1])
        assert _holds(margin, math.degrees(np.angle(-y[k])))


def lagging(wc: float, lag: float, delay: float) -> Response:
    return lambda w: (wc / (1j * w)) * np.exp(-1j * w * delay) / (1 + 1j * w / lag)


def crossover(wc: float, lag: float, delay: float) -> tuple[float, float]:
    """Where (w/wc)^2 (1 + (w/lag)^2) = 1, and the phase margin there in deg."""
    w = lag * math.sqrt(0.5 * (math.sqrt(1.0 + 4.0 * (wc / lag) ** 2) - 1.0))
    return w, 90.0 - math.degrees(math.atan(w / lag) + w * delay)


@pytest.mark.parametrize("count", [6, 8, 12, 16, 24])
def test_few_noisy_points_hold_the_truth_in_99_of_100(count: int) -> None:
    """A crossover in closed form; margin and delay margin at it."""
    rng = np.random.default_rng(count)
    held = listed = 0
    for _ in range(200):
        wc, lag, delay = 10.0 ** rng.uniform((1.0, 1.0, -4.0), (1.5, 3.0, -2.3))
        w, deg = crossover(wc, lag, delay)
        omega = np.geomspace(w / 3.0, 3.0 * w, count)
        noisy = lagging(wc, lag, delay)(omega) * (1.0 + 0.02 * circular(rng, omega.shape))
        m = stability_margins(control.frd(noisy, omega))
        for phase, late in zip(m.phase_margins, m.delay_margins, strict=True):
            listed += 1
            inside = phase.deg_range[0] <= deg <= phase.deg_range[1]
            held += inside and late.seconds_range[0] <= math.radians(deg) / w <= late.seconds_range[1]
    assert listed >= 190
    assert held >= 0.99 * listed


@pytest.mark.parametrize("count", [2, 3, 5])
def test_noise_that_so_few_points_do_not_show_is_said_and_no_range_stated(count: int) -> None:
    omega = np.geomspace(8.0, 12.0, count)
    data = control.frd(lagging(10.0, 100.0, 1e-3)(omega), omega)
    m = stability_margins(data)
    (phase,), (late,) = m.phase_margins, m.delay_margins
    assert (phase.deg_range, late.seconds_range, m.modulus_range, m.disk_margin.alpha_range) == (None,) * 4
    assert any("noise: not known, as so few points" in note for note in m.notes)
    known = stability_margins(MeasuredResponse.with_noise(data, 0.01))
    assert known.phase_margins[0].deg_range[0] < known.phase_margins[0].deg


WC, LAG, DELAY = 30.0, 200.0, 2e-3
CIRCLE = 0.03 * GAUSSIAN


def widths(omega: np.ndarray, noise: float, known: bool, draws: int, seed: int) -> tuple[float, float, float]:
    """Median width of the phase margin's range, share of ranges that hold it, rms error of the figure."""
    rng, true = np.random.default_rng(seed), crossover(WC, LAG, DELAY)[1]
    exact = lagging(WC, LAG, DELAY)(omega)
    found = []
    for _ in range(draws):
        data = control.frd(exact * (1.0 + noise * circular(rng, omega.shape)), omega)
        given = MeasuredResponse.with_noise(data, noise * np.abs(exact)) if known else data
        (phase,) = stability_margins(given).phase_margins
        low, high = phase.deg_range
        found.append((high - low, low <= true <= high, (phase.deg - true) ** 2))
    width, held, squared = np.array(found, dtype=float).T
    return float(np.median(width)), float(held.mean()), math.sqrt(squared.mean())


@pytest.mark.parametrize("known", [True, False])
def test_more_points_narrow_the_range_and_better_the_figure(known: bool) -> None:
    few, many, most = (widths(np.geomspace(3, 1000, n), 0.05, known, 30, n) for n in (60, 600, 6000))
    assert {few[1], many[1], most[1]} == {1.0}
    for one, ten in ((few, many), (many, most)):  # n^(-2/5) is 0.40
        assert ten[0] < 0.55 * one[0]
        assert ten[2] < 0.7 * one[2]


@pytest.mark.parametrize("apart", [1e-5, 0.003, 0.01, 0.06])
def test_a_second_record_beside_the_first_makes_no_range_wider(apart: float) -> None:
    omega = np.geomspace(3, 1000, 60)
    both = np.sort(np.concatenate((omega, omega * (1.0 + apart))))
    for known in (True, False):
        one, two = (widths(each, 0.02, known, 40, 1) for each in (omega, both))
        assert one[1] == two[1] == 1.0
        assert two[0] < one[0]


def test_a_hidden_bend_is_not_averaged_away() -> None:
    """A narrow dip of 20 % among 2000 points of 1 %: the distance from -1 there is kept."""
    rng, omega = np.random.default_rng(0), np.geomspace(3, 1000, 2000)
    dip = 1.0 + 0.25 / (1.0 + (np.log(omega / 120.0) / 0.008) ** 2)
    L = lagging(WC, LAG, DELAY)(omega) * dip
    data = control.frd(L * (1.0 + 0.01 * circular(rng, omega.shape)), omega)
    for given in (data, MeasuredResponse.with_noise(data, 0.01 * np.abs(L))):
        m = stability_margins(given)
        low, high = m.modulus_range
        assert low <= np.abs(1.0 + L).min() <= high
        assert f"in [{low:.4g}, {high:.4g}]" in str(m)


def test_doubtful_crossings_are_counted_in_one_line() -> None:
    """A gain that lies within its noise of one over the whole band, but for every tenth point."""
    omega = np.geomspace(1.0, 100.0, 200)
    L = np.where(np.arange(200) % 10, 1.001, 1.5) * np.exp(-1j * omega / 100.0)
    m = stability_margins(MeasuredResponse.with_noise(control.frd(L, omega), 0.01))
    (line,) = (note for note in m.notes if "neither sure nor excluded" in note)
    assert line.startswith("at 20 places between ")


@pytest.mark.parametrize("bend", [0.0, 3.0])
def test_circles_of_averaged_values_hold_the_truth_in_99_of_100(bend: float) -> None:
    """A power law, and one that bends: log L is a parabola over log frequency."""
    rng, omega = np.random.default_rng(0), np.geomspace(1.0, 30.0, 600)
    u = np.log(omega)
    exact = np.exp(-u - 0.5 * bend * (1.0 + 0.5j) * u**2)
    inside, narrower = [], []
    for _ in range(60):
        L, radius = averaged(omega, exact * (1.0 + 0.03 * circular(rng, u.shape)), CIRCLE * np.abs(exact))
        inside.append(np.abs(L - exact) <= radius)
        narrower.append(radius / np.abs(exact) / CIRCLE)
    assert np.mean(inside) >= 0.99
    assert np.median(narrower) < 0.5
