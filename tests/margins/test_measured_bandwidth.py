"""Measured data in every function that takes a response: at 1 % noise the ranges hold the truth."""

import math
from collections.abc import Callable

import control
import numpy as np
import pytest

from actuator_lti import closed_loop_bandwidth, stability_margins, step_figures, unwrapped_phase_deg
from actuator_lti.bandwidth import peaks
from actuator_lti.drawing.plotting import plot_bode, plot_nyquist, plot_step
from actuator_lti.errors import InputError
from actuator_lti.margins import MeasuredResponse

s = control.tf("s")
W = 2 * math.pi * 30
CLOSED = {
    "F3": W**2 / (s**2 + W * s + W**2),
    "F5": 1 / (s + 1),
    "F7": 5 / (s**2 + s + 5),
    "negative": -(W**2) / (s**2 + W * s + W**2),
    "light": 100 * (s**2 / 64 + 0.02 * s + 1) / ((s + 1) * (s**2 + 0.02 * s + 100)),
    "fourth": 1 / (s + 1) ** 4,
    "resonant": W**2 / (s**2 + 0.1 * W * s + W**2),
}
B2 = control.tf([20e6], [1, 1, 1e6, 0])


def measured(
    system: control.LTI, omega: np.ndarray, rng: np.random.Generator, noise: float = 0.01
) -> control.FRD:
    error = noise * (rng.normal(size=omega.size) + 1j * rng.normal(size=omega.size)) / math.sqrt(2.0)
    return control.frd(system(1j * omega) * (1.0 + error), omega)


def holds(known: tuple[float, float] | None, value: float) -> bool:
    return known is not None and known[0] * (1 - 1e-9) <= value <= known[1] * (1 + 1e-9)


@pytest.mark.parametrize("count", [40, 300])
def test_bandwidth_ranges_hold_the_truth_at_one_percent_noise_nobody_stated(count: int) -> None:
    wrong = total = 0
    for name, system in CLOSED.items():
        exact = closed_loop_bandwidth(system)
        omega = np.geomspace(exact.minus3db_rad_s / 30.0, exact.minus3db_rad_s * 6.0, count)
        for seed in range(15):
            b = closed_loop_bandwidth(measured(system, omega, np.random.default_rng(seed)))
            assert b.minus3db_rad_s is not None, name
            wrong += not holds(b.minus3db_range_rad_s, exact.minus3db_rad_s)
            if exact.minus90deg_rad_s is not None and exact.minus90deg_rad_s < omega[-1]:
                wrong += not holds(b.minus90deg_range_rad_s, exact.minus90deg_rad_s)
            assert b.minus3db_range_rad_s[1] < 1.6 * b.minus3db_range_rad_s[0]
            total += 1
    assert wrong <= 0.01 * total


def test_points_too_coarse_for_the_damping_are_called_so() -> None:
    """B2 at 60 points: the resonance at 1000 rad/s, which makes the loop unstable, lies between two."""
    m = stability_margins(measured(B2, np.geomspace(1, 8e3, 60), np.random.default_rng(0)))
    assert (
        "too coarse for the damping between 948.272 and 1104.3 rad/s (150.922 to 175.755 Hz)"
        in m.evidence_reason
    )
    closed = CLOSED["light"]
    fine = closed_loop_bandwidth(control.frd(closed, np.geomspace(0.03, 30, 20)))
    assert any("too coarse for the damping" in note for note in fine.notes)


def test_a_point_at_zero_frequency_is_what_the_fall_is_measured_from() -> None:
    omega = np.concatenate(([0.0], np.geomspace(0.5, 10, 200)))
    b = closed_loop_bandwidth(control.frd(CLOSED["F5"](1j * omega), omega))
    assert b.dc_gain == pytest.approx(1.0)
    assert b.minus3db_rad_s == pytest.approx(1.0, rel=1e-3)
    assert b.notes[0] == "T(0) is measured"
    without = closed_loop_bandwidth(control.frd(CLOSED["F5"](1j * omega[1:]), omega[1:]))
    assert without.minus3db_range_rad_s[0] <= 1.0 <= without.minus3db_range_rad_s[1]
    assert "in" in str(without)


def test_sampled_data_as_the_sampled_system() -> None:
    period = 0.001
    system = control.tf([0.5], [1, -0.5], period)
    omega = np.geomspace(5.0, math.pi / period, 400)
    data = control.FrequencyResponseData(system(np.exp(1j * omega * period)), omega, period)
    b = closed_loop_bandwidth(data)
    assert b.minus3db_hz == pytest.approx(115.026728081, rel=1e-4)  # F6
    assert holds(b.minus3db_range_rad_s, 2 * math.pi * 115.026728081)
    asked = np.array([10.0, 300.0, 2000.0])
    assert unwrapped_phase_deg(data, asked) == pytest.approx(unwrapped_phase_deg(system, asked), abs=1e-2)
    assert plot_bode(data)[1].lines
    assert plot_nyquist(data).lines
    for dt, beyond in ((period, 4000.0), (1.0, 4.0), (True, 4.0)):
        with pytest.raises(InputError, match="Nyquist"):
            stability_margins(control.FrequencyResponseData(np.ones(3), [1.0, 2.0, beyond], dt))


def test_phase_of_data_is_followed_over_whole_turns() -> None:
    omega = np.geomspace(1.0, 1000.0, 2000)
    values = np.exp(-0.02j * omega) / (1j * omega / 100 + 1)  # F1
    assert unwrapped_phase_deg(control.frd(values, omega), 1000.0) == pytest.approx(
        -np.degrees(20.0 + math.atan(10.0)), abs=1e-6
    )


@pytest.mark.parametrize(("call", "message"), [
    (step_figures, "step response"),
    (plot_step, "step response"),
    (peaks, "modulus_margin"),
    (lambda d: unwrapped_phase_deg(d, 0.1), "outside of the measured band"),
    (lambda d: unwrapped_phase_deg(d, 1e4), "outside of the measured band"),
    (lambda _: unwrapped_phase_deg(control.frd(B2, np.geomspace(1, 8e3, 60)), 2e3), "do not tell"),
    (lambda d: closed_loop_bandwidth(control.frd(1 / s, np.geomspace(1, 10, 50))), "measure lower"),
    (lambda d: closed_loop_bandwidth(d, level="3"), "level"),
])  # fmt: skip
def test_what_data_do_not_hold_is_refused_with_the_reason(call: Callable[..., object], message: str) -> None:
    data = control.frd(CLOSED["F5"], np.geomspace(1.0, 10.0, 50))
    for kind in (data, MeasuredResponse.with_noise(data, 0.0)):
        with pytest.raises(InputError, match=message):
            call(kind)
