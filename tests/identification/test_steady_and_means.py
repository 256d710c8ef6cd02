"""Steady parts, means of correlated series, currents between samples, recorders on one clock, residuals."""

from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from actuator_lti.design import load_design
from analyses.estimation.series import correlated_means, correlation_time
from analyses.identification.inverse import fit_records
from analyses.identification.points import steady_point
from analyses.identification.residuals import LEVEL, ResidualTest, residual_tests
from analyses.identification.sampled_current import HeldVoltage
from analyses.records.campaign_file import Campaign, Instruments, Join, RunEntry
from analyses.records.campaign_import import ImportedRun, assemble_run
from analyses.records.clocks import ClockJoin, clock_join, joined_by
from analyses.records.record import Record
from analyses.records.steady_window import SteadyCriterion, find_steady_window
from examples.virtual_bench.files import DRIVE_SPEC, SENSOR_SPEC
from tests.identification.bench_records import record_of
from tests.refusals import refused


def _run(noise: float) -> tuple[np.ndarray, np.ndarray]:
    time = np.arange(0.0, 10.0, 1e-3)
    speed = 400.0 * np.clip(np.minimum(time - 1.0, 9.0 - time), 0.0, 1.0)
    return time, speed + noise * np.random.default_rng(0).standard_normal(len(time))


def test_the_window_lies_on_the_plateau_within_the_stated_limit() -> None:
    for noise, side in ((0.0, 1.0), (3.0, 1.0), (1.0, -1.0)):
        time, speed = _run(noise)
        window = find_steady_window(time, side * speed)
        assert 2.0 < window.start_s < 2.5
        assert 7.5 < window.stop_s < 8.0
        assert window.largest_acceleration_rad_s2 <= window.limit_rad_s2
    window = find_steady_window(*_run(0.0), SteadyCriterion(relative_per_s=0.01))
    assert window.limit_rad_s2 == pytest.approx(4.0, rel=1e-3)
    refused(find_steady_window, time, 300.0 + 40.0 * time, words=("no steady part", "the limit"))


def test_correlation_time_of_an_autoregressive_series_and_error_of_its_mean() -> None:
    rng = np.random.default_rng(2)
    a = 0.9
    x = lfilter([1.0], [1.0, -a], rng.standard_normal(200_000))
    assert correlation_time(x) == pytest.approx((1.0 + a) / (1.0 - a), rel=0.1)
    assert correlation_time(rng.standard_normal(50_000)) == pytest.approx(1.0, abs=0.1)
    # that of many repetitions
    rng = np.random.default_rng(4)
    a, n, repeats = 0.95, 5000, 300
    series = lfilter([np.sqrt(1.0 - a**2)], [1.0, -a], rng.standard_normal((repeats, n)), axis=1)
    stated = np.array([correlated_means(x[:, None]).covariance[0, 0] for x in series])
    true = np.std(series.mean(axis=1))
    naive = 1.0 / np.sqrt(n)
    assert np.sqrt(np.mean(stated)) == pytest.approx(true, rel=0.15)
    assert true > 4.0 * naive


FINE = 4000


def _current(a: float, T: float, d: float, w: float, t: np.ndarray) -> np.ndarray:
    """i(t) of 1/(1 + s/a) within one tick under exp(j w k T), switched d after each tick.

    Settled; the sum over every earlier step of the voltage, (u_k - u_(k-1)) (1 - exp(-a (t - t_k))).
    """
    back = np.arange(-round(60.0 / (a * T)) - 20, 1)
    u = np.exp(1j * w * np.arange(back[0] - 1, 1) * T)
    since = np.maximum(t[:, None] - (back * T + d), 0.0)
    return u[0] + (np.diff(u) * -np.expm1(-a * since)).sum(axis=1)


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("a", [500.0, 9e3, 4e4])
def test_the_mean_current_over_its_samples(a: float, share: float) -> None:
    T, w = 1e-4, 2.0 * np.pi * 180.0
    t = (np.arange(FINE) + 0.5) * T / FINE
    # every tick repeats the one before, turned by exp(j w T)
    line = np.mean(_current(a, T, share * T, w, t) * np.exp(-1j * w * t))
    sample = _current(a, T, share * T, w, np.zeros(1))[0]
    held = HeldVoltage(rate_1_s=a, period_s=T, delay_s=share * T, back_emf_A_per_rad_s=0.0)
    assert held.mean_over_sample(np.array([w]))[0] == pytest.approx(line / sample, rel=1e-6)


def test_the_lead_in_the_limits() -> None:
    """A slow winding goes straight from sample to sample; a quick one stands still between switches."""
    T = 1e-4
    for d in (0.0, 0.4 * T, T, 1.4 * T):
        slow = HeldVoltage(rate_1_s=1.0, period_s=T, delay_s=d, back_emf_A_per_rad_s=0.0)
        assert slow.lead_s == pytest.approx(0.0, abs=1e-4 * T)
    for d in (0.1 * T, 0.4 * T, 0.9 * T):
        quick = HeldVoltage(rate_1_s=1e7, period_s=T, delay_s=d, back_emf_A_per_rad_s=0.0)
        assert quick.lead_s == pytest.approx(d - 0.5 * T, abs=2e-3 * T)


def _happening(t: np.ndarray) -> np.ndarray:
    """A motion from 2 s to 16 s with soft edges."""
    return 1.0 / (1.0 + np.exp(-(t - 2.0) / 0.03)) - 1.0 / (1.0 + np.exp(-(t - 16.0) / 0.05))


def _pair(offset: float, rate: float, noise: float = 0.01) -> tuple[Record, Record]:
    """``t_first = offset + rate t_second``."""
    rng = np.random.default_rng(5)
    first = np.arange(0.0, 20.0, 1e-3)
    second = np.arange(0.0, (19.0 - offset) / rate, 2.3e-3)
    speed = 500.0 * _happening(first) + 500.0 * noise * rng.standard_normal(len(first))
    torque = -7.0 * _happening(offset + rate * second) + 7.0 * noise * rng.standard_normal(len(second))
    return record_of(first, "drive", speed=speed), record_of(second, "sensor", torque=torque)


def _join(
    first: Record, second: Record, method: str = "correlation", offset_s: float | None = None
) -> tuple[Record, ClockJoin]:
    join = clock_join(first, second, Join(method=method), offset_s)
    return joined_by(first, second, join), join


@pytest.mark.parametrize("method", ["correlation", "event"])
@pytest.mark.parametrize(("offset", "rate"), [(0.7312, 1.0), (-0.4, 1.0002), (0.25, 0.9995)])
def test_offset_and_rate_are_found(method: str, offset: float, rate: float) -> None:
    first, second = _pair(offset, rate, 0.003)
    joined, join = _join(first, second, method=method)
    assert abs(join.rate - rate) < max(5.0 * join.rate_std, 1e-4)
    assert join.offset_s + join.rate * 9.0 == pytest.approx(offset + rate * 9.0, abs=2e-3)
    assert np.corrcoef(joined["speed"], -joined["torque"])[0, 1] > 0.999


def _joined(
    later: float,
    method: str = "correlation",
    drift: float = 0.0,
    *,
    seed: int = 3,
    warm_s: float = 1.5,
    noise: float = 0.02,
    row_s: float = 1e-3,
) -> ImportedRun:
    """A load that comes on so much after the motion, the sensor's clock 0.35 s late, a current that warms."""
    rng, time, offset = np.random.default_rng(seed), np.arange(0.0, 8.0, row_s), 0.35
    sensor_s = np.arange(0.0, 7.5, 2.3 * row_s)

    def load(at: np.ndarray) -> np.ndarray:
        return -3.0 * np.clip((at - 1.0 - later) / 0.2, 0.0, 1.0)

    speed = 200.0 * np.clip((time - 1.0) / 0.2, 0.0, 1.0) + 0.1 * rng.standard_normal(len(time))
    current = 0.2 * np.sign(speed) - 0.05 * load(time) + noise * rng.standard_normal(len(time))
    current += drift * (1.0 - np.exp(-np.maximum(time - 1.0, 0.0) / warm_s))
    torque = load(offset + sensor_s) + 0.01 * rng.standard_normal(len(sensor_s))
    drive = record_of(time, "d", speed=speed, current=current)
    sensor = record_of(sensor_s, "s", torque=torque)
    entry = RunEntry(id="1", drive=Path(), load_Nm=3.0)
    join = Join(method=method)
    campaign = Campaign(
        drive=DRIVE_SPEC, sensor=SENSOR_SPEC, join=join, instruments=Instruments(), runs=(), origin=""
    )
    return assemble_run(campaign, entry, drive, sensor)


@pytest.mark.parametrize("method", ["correlation", "event"])
@pytest.mark.parametrize("later", [0.0, 0.4, 1.5])
def test_a_load_that_comes_after_the_motion_tells_its_clock_by_the_current(method: str, later: float) -> None:
    """By speed and torque the clock was off by what the load comes later, at some ms of standard error."""
    run, offset = _joined(later, method), 0.35
    assert run.join.offset_s == pytest.approx(offset, abs=max(4.0 * run.join.offset_std_s, 2e-3))
    assert run.join.offset_std_s < 0.01
    assert np.interp(1.1 + later, run.record.time_s, run.record["torque"]) == pytest.approx(-1.5, abs=0.15)
    assert run.join.first_signal == ("current" if later else "speed")


@pytest.mark.parametrize("later", [0.0, 0.4, 1.5])
def test_a_load_that_comes_in_steady_motion_is_averaged_where_it_acts(later: float) -> None:
    """3 N m and 0.35 A; 1.5 s late it was 2.4 N m, the time before it counted in, and the run set aside."""
    point = steady_point(_joined(later), 1.0)
    assert point.load_Nm == pytest.approx(3.0, rel=0.01)
    assert point.torque_Nm == pytest.approx(0.2 + 0.05 * 3.0, abs=3e-3)


def test_a_load_that_is_only_noise_shortens_no_steady_part() -> None:
    time, speed = np.arange(0.0, 8.0, 1e-3), np.full(8000, 200.0)
    noise = np.random.default_rng(2).standard_normal(8000)
    both = (find_steady_window(time, speed, load=load) for load in (noise, np.zeros(8000)))
    assert all(window == find_steady_window(time, speed) for window in both)


@pytest.mark.parametrize("drift", [-0.05, 0.05])
@pytest.mark.parametrize("later", [0.0, 0.4, 1.0])
def test_a_current_that_drifts_is_no_load(later: float, drift: float) -> None:
    """Up to 4 s off: a warming of a seventh of the current was the load's edge, or hid it."""
    join = _joined(later, drift=drift).join
    assert join.offset_s == pytest.approx(0.35, abs=0.01)
    assert join.first_signal == ("current" if later else "speed")


@pytest.mark.parametrize("later", [0.0, 1.0])
def test_the_stated_error_of_a_clock_is_its_error(later: float) -> None:
    """0.5 ms beside errors of 10 ms: noise of the load was an edge of it, and told rates of the clock too."""
    rng, off = np.random.default_rng(7), []
    for seed in range(24):
        drawn = {"drift": rng.uniform(-0.08, 0.08), "warm_s": rng.uniform(0.3, 3.0)}
        run = _joined(later, seed=seed, noise=10.0 ** rng.uniform(-2.5, -1.3), **drawn)
        join, middle = run.join, 3.75
        off.append((join.offset_s + (join.rate - 1.0) * middle - 0.35) / join.offset_std_s)
        assert join.first_signal == ("current" if later else "speed")
    assert np.max(np.abs(off)) < 3.0
    spread = np.sqrt(np.mean(np.square(off)))
    assert (0.6 if later else 0.1) < spread < 1.4  # with the speed, edges of two instruments are in it


@pytest.mark.parametrize("later", [0.0, 1.0])
def test_a_slow_recorder_tells_the_clock_too(later: float) -> None:
    """Of 64 rows: polynomials of as many orders were no longer orthogonal, and took the edge away."""
    for seed in range(12):
        join = _joined(later, seed=seed, noise=0.01, row_s=0.1).join
        assert join.offset_s == pytest.approx(0.35, abs=0.23)  # a row of the sensor
        assert join.first_signal == ("current" if later else "speed")


@pytest.mark.parametrize(("ramp", "load_ramp"), [(0.01, 0.05), (0.01, 0.2), (0.03, 0.05), (0.03, 0.2)])
def test_edges_of_two_shapes_are_centred_on_each_other(ramp: float, load_ramp: float) -> None:
    """The same edge up and down: by symmetry the middles coincide. Was up to 1.2 ms beside it."""

    def edges(time: np.ndarray, over: float) -> np.ndarray:
        return np.clip((time - 2.0) / over, 0.0, 1.0) - np.clip((time - 16.0) / over, 0.0, 1.0)

    time, sensor_s = np.arange(0.0, 20.0, 1e-3), np.arange(0.0, 18.5, 2.3e-3)
    first = record_of(time, "drive", speed=500.0 * edges(time, ramp))
    _, join = _join(first, record_of(sensor_s, "sensor", torque=-7.0 * edges(0.5 + sensor_s, load_ramp)))
    assert join.rate == pytest.approx(1.0, abs=2e-6)
    assert join.offset_s == pytest.approx(0.5 + 0.5 * (ramp - load_ramp), abs=5e-5)


def test_one_event_tells_no_rate_a_given_offset_is_kept_and_strangers_are_refused() -> None:
    first, second = _pair(0.5, 1.0)
    early = second.slice(0, 3000)
    _, join = _join(first, early, method="event")
    assert join.rate_std is None
    assert "rate not estimable" in str(join)
    joined, join = _join(first, second, method="given", offset_s=0.5)
    assert join.offset_s == 0.5
    assert joined.time_s[0] >= 0.5
    assert "given offset" in joined.notes[-1]
    rng = np.random.default_rng(1)
    time = np.arange(0.0, 5.0, 1e-3)
    a = record_of(time, "a", speed=rng.standard_normal(5000))
    b = record_of(time, "b", torque=rng.standard_normal(5000))
    refused(_join, a, b, words="not alike")
    flat = record_of(time, "c", torque=np.ones(5000))
    for method in ("correlation", "event"):
        refused(_join, a, flat, method=method, words="flat")


TIME = np.arange(0.0, 12.0, 1e-3)
SPEED = 0.3 * np.cos(3.0 * TIME) + 0.21 * np.cos(7.0 * TIME)
PLACE = 0.1 * np.sin(3.0 * TIME) + 0.03 * np.sin(7.0 * TIME)
RATE = -0.9 * np.sin(3.0 * TIME) - 1.47 * np.sin(7.0 * TIME)


def _tests(rest: np.ndarray) -> dict[str, ResidualTest]:
    """Of a mass of 5 kg with friction, whose force has something more."""
    force = 5.0 * RATE + 2.0 * SPEED + 3.0 * np.sign(SPEED) + rest
    model = fit_records(load_design("emps"), [record_of(TIME, position=PLACE, force=force)])
    part = model.records[0]
    about_mean = np.linalg.norm(part.y - part.y.mean())
    assert part.fit_percent == pytest.approx(100.0 * (1.0 - np.linalg.norm(part.residual) / about_mean))
    return {test.input or test.name: test for test in residual_tests(model)}


def test_noise_alone_keeps_the_level() -> None:
    """Coloured noise, 60 records of three tests: 1 % beyond the bound, at most 7 of 180 (binomial, 1e-3)."""
    rng = np.random.default_rng(4)
    beyond = 0
    for _ in range(60):
        noise = lfilter([1.0], [1.0, -0.98], rng.standard_normal(len(TIME)))
        beyond += sum(not test.within for test in _tests(0.1 * noise).values())
    assert LEVEL == 0.01
    assert beyond <= 7


MISSING = {
    "a spring": (40.0 * PLACE, "speed"),
    "a late force": (5.0 * (np.interp(TIME - 0.02, TIME, RATE) - RATE), "acceleration"),
    "a square wave of 0.9 s": (0.6 * np.sign(np.sin(2.0 * np.pi * TIME / 0.9)), "whiteness"),
}


@pytest.mark.parametrize("what", MISSING)
def test_what_the_model_lacks_is_found(what: str) -> None:
    missing, name = MISSING[what]
    noise = 0.5 * np.random.default_rng(1).standard_normal(len(TIME))
    test = _tests(missing + noise)[name]
    assert not test.within
