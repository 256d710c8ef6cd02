"""The wider drive in all three forms, and the blocks and budgets of delay that its loops are made of."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from loop_designs import amber, controlled, ctms_position, drive_d, drive_e, emps, faster, response
from scipy.integrate import solve_ivp
from test_stacked import FILTERS, everything

from actuator_lti import assemble_loops, delay_budget
from actuator_lti.design.model import Design, Filter, Limits, PositionLoop
from actuator_lti.drive.blocks import biquad
from actuator_lti.drive.signals import LIMITERS
from actuator_lti.systems.sampling import delayed_hold, held_step, split_delay
from analyses import survey_loops
from reports.sections.forms import delay_budget as delay_section
from tests.refusals import refused
from tests.validation.random_drives import full_drive

BARE_D = controlled(drive_e(), position=PositionLoop(gain=20.0, derivative_time_s=2e-3))


@pytest.mark.parametrize(
    ("drive", "final", "order"),
    [(amber(2, 10), 5e-3, (1.9, 2.1)), (everything(), 0.02, (1.8, np.inf)), (BARE_D, 0.02, (1.8, np.inf))],
)
@pytest.mark.parametrize("form", ["sampled", "continuous"])
def test_every_form_of_a_drive_tends_to_the_ideal_one(form, drive, final, order):
    """First order in Ts for every loop, break point, the command and the moment."""
    omega, ideal, worst = np.array([20.0, 100.0, 300.0]), assemble_loops(drive, "ideal"), []
    for factor in (64, 128):
        loops = assemble_loops(faster(drive, factor), form)
        pairs = [(loop.open_loop, getattr(ideal, name).open_loop) for name, loop in loops.present.items()]
        points = ("w_ref", "output")
        pairs += [(loops.break_points[p].open_loop, ideal.break_points[p].open_loop) for p in points]
        paths = ("reference_to_output", "moment_to_output") if drive.coupling else ("reference_to_output",)
        pairs += [(getattr(loops, name), getattr(ideal, name)) for name in paths]
        gaps = [np.max(np.abs(response(a, omega) / response(b, omega) - 1)) for a, b in pairs]
        worst.append(np.array(gaps))
    assert np.all(worst[1] < final)
    assert np.all(worst[0] / worst[1] > order[0])
    assert worst[0].max() / worst[1].max() < order[1]


def test_the_budget_has_a_share_for_each_filter() -> None:
    """In the velocity loop a filter's share is its own phase."""
    design, omega = everything(), 150.0
    for name in ("velocity", "position"):
        assert len(delay_budget(design, name, omega).filters_deg) == 5
    unfed = controlled(design, current={"back_emf_feedforward": 0.0})
    shares, s = delay_budget(unfed, "velocity", omega).filters_deg, 1j * omega
    own = np.angle(2000.0**2 / (s**2 + np.sqrt(2) * 2000.0 * s + 2000.0**2), deg=True)
    assert shares["torque lowpass 1 2000 rad/s"] == pytest.approx(own, abs=1e-6)
    assert shares["speed filter 5000 rad/s"] == pytest.approx(-np.degrees(np.arctan(omega * 2e-4)), abs=1e-6)


def test_limiters_of_the_torque_path_and_of_the_overload() -> None:
    base = everything()
    limits = Limits(voltage_V=24.0, speed_rad_s=300.0, acceleration_rad_s2=1e4, peak_current_A=15.0,
                    continuous_current_A=5.0, peak_time_s=1.0, current_rate_A_s=1e4)  # fmt: skip
    loops = assemble_loops(replace(base, limits=limits))
    assert list(loops.limiters) == [name for name, each in LIMITERS.items() if each.kind != "command"]
    omega = np.array([1.0, 40.0])
    # at low frequency the filters change nothing: both clamps of the torque path are reached together
    first, second = (loops.limiters[n].onset_amplitude_rad(omega) for n in ("torque-command", "current"))
    np.testing.assert_allclose(first[0], second[0], rtol=1e-3)
    assert abs(first[1] / second[1] - 1) > 1e-3
    # the mean square of the current: sqrt(2) of the continuous current, but for the ripple
    overload = loops.limiters["overload"]
    ratio = overload.onset_amplitude_rad(omega) * np.abs(overload.response(omega)) / 5.0
    tau = 1.0 / np.log(9 / 8)
    np.testing.assert_allclose(ratio, np.sqrt(2 / (1 + 1 / np.hypot(1, 2 * omega * tau))), rtol=1e-12)
    assert overload.onset_amplitude_rad(omega, bias=6.0)[0] == 0.0


def test_ripple_of_the_overload_by_integration() -> None:
    """dx/dt = (i^2 - x)/tau under i = b + I sin(w t): the bound is met where b = 0, kept where it is not."""
    limits = Limits(voltage_V=24.0, peak_current_A=15.0, continuous_current_A=5.0, peak_time_s=1.0)
    path = assemble_loops(replace(everything(), limits=limits)).limiters["overload"]
    tau, w = 1.0 / np.log(9 / 8), 0.3
    for b in (0.0, 2.0):
        a = path.onset_amplitude_rad([w], b)[0] * np.abs(path.response([w]))[0]

        def rate(t: float, x: np.ndarray, a: float = a, b: float = b) -> np.ndarray:
            return ((b + a * np.sin(w * t)) ** 2 - x) / tau

        run = solve_ivp(rate, (0, 200), [0.0], rtol=1e-9, atol=1e-9, max_step=0.2)
        assert (25.0 * 0.999 if b == 0.0 else 20.0) < np.max(run.y[0]) <= 25.0 * (1 + 1e-6)


def test_the_survey_and_its_budget_table_know_filters_and_the_gap() -> None:
    base = drive_d(*FILTERS[:2])
    coupling = replace(base.coupling, play_rad=0.01)
    design = replace(base, coupling=coupling, friction=replace(base.friction, load_coefficient=0.01))
    survey = survey_loops(design)
    labels = [point.label for point in survey.operating_points]
    assert labels[1:4] == ["load driven by the motor", "motor driven by the load", "in the gap of the play"]
    rows = delay_section(survey.budgets)["blocks"][1]["rows"]
    assert all(row["torque notch 2 900 rad/s"] <= 0.0 for row in rows)
    assert rows[0]["torque notch 2 900 rad/s"] == 0.0  # the current loop has none


@given(st.floats(0, 5), st.floats(1e-6, 10))
def test_first_order_lag_behind_any_delay(ticks: float, period: float) -> None:
    """Lag a/(s + a): the modified z-transform, in closed form."""
    a = 0.7 / period
    tick = delayed_hold(np.array([[-a]]), np.array([[a]]), np.array([[a]]), period, ticks * period)
    q, f = split_delay(ticks * period, period)
    assert tick.Phi[0, 0] == pytest.approx(np.exp(-0.7), rel=1e-13)
    new, old = 1 - np.exp(-0.7 * (1 - f)), np.exp(-0.7 * (1 - f)) - np.exp(-0.7)
    assert tick.gains[q][0] == pytest.approx(new, abs=1e-13)
    if f:
        assert tick.gains[q + 1][0] == pytest.approx(old, abs=1e-13)
    assert sum(g[0] for g in tick.gains.values()) == pytest.approx(tick.Gamma_T[0, 0], abs=1e-13)


def test_a_stiff_and_badly_scaled_plant() -> None:
    """Poles -1e8 and -1e-3, couplings of 1e9: the exponential of a triangular matrix, in closed form."""
    A, h = np.array([[-1e8, 1e9], [0.0, -1e-3]]), 1e-3
    Phi, Gamma = held_step(A, np.array([[0.0], [1.0]]), h)
    slow = np.exp(-1e-6)
    assert Phi[1, 1] == pytest.approx(slow, rel=1e-14)
    assert Phi[0, 1] == pytest.approx(1e9 * slow / (1e8 - 1e-3), rel=1e-12)
    assert Gamma[1, 0] == pytest.approx(-np.expm1(-1e-6) / 1e-3, rel=1e-12)


def test_delay_close_to_whole_ticks_is_whole() -> None:
    assert split_delay(0.1 + 0.2, 0.1) == (3, 0.0)
    assert split_delay(2.9999999999e-4, 1e-4) == (3, 0.0)
    refused(split_delay, -1e-9, 1.0)
    refused(biquad, Filter(kind="lowpass", frequency_rad_s=2e4), 2e-4, words="below pi/T")


@pytest.mark.parametrize("fraction", [0.02, 0.2, 0.7])
@pytest.mark.parametrize("design", [everything(), full_drive(90_104), full_drive(90_105)], ids=range(3))
def test_items_sum_to_the_phase_of_the_exact_loop(design: Design, fraction: float) -> None:
    for name, loop in assemble_loops(design).present.items():
        omega = fraction * np.pi / loop.period_s
        budget = delay_budget(design, name, omega)
        assert sum(budget.items.values()) == pytest.approx(budget.total_deg, abs=1e-9)
        exact = np.angle(loop.open_loop(np.exp(1j * omega * loop.period_s)), deg=True)
        assert (budget.total_deg - exact + 180) % 360 - 180 == pytest.approx(0, abs=1e-6)


@pytest.mark.parametrize(("design", "loop", "omega", "items"), [
    # computing delay w d, hold w Ts/2, one more sample w Ts, PI atan(1/(w Ti)): -89.66 deg in all
    (amber(), "current", 2737.0, {"computing delay": 0.2737, "hold": 0.13685, "one more": 0.2737,
                                  "controller": np.arctan(1 / (2737.0 * 150e-6)), "measurement": 0.0}),
    # a difference over two samples is one sample old
    (emps(), "velocity", 100.0,
     {"measurement": 0.1, "controller": 0.0, "computing delay": 0.0, "one more": 0.1}),
    # a long delay is not wrapped
    (ctms_position(delay_s=0.02), "position", 900.0 * np.pi, {"computing delay": 18.0 * np.pi}),
], ids=["current loop", "EMPS", "long delay"])  # fmt: skip
def test_items_by_hand(design: Design, loop: str, omega: float, items: dict[str, float]) -> None:
    """Lags in rad; the totals as they were computed apart from this."""
    budget = delay_budget(design, loop, omega)
    told = {**budget.items, "one more": budget.one_more_sample_deg}
    assert {name: told[name] for name in items} == pytest.approx(
        {name: -np.degrees(lag_rad) for name, lag_rad in items.items()}, abs=1e-9
    )
    assert loop != "current" or budget.total_deg == pytest.approx(89.66 - 180, abs=0.02)
    assert loop != "position" or budget.total_deg < -3000


def test_refusals() -> None:
    refused(delay_budget, ctms_position(), "velocity", 10.0, words="one of position")
    refused(delay_budget, ctms_position(), "position", 1e4, words="Nyquist")
