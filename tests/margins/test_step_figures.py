"""Step figures against closed forms, with delays by the method of steps; phases unwrapped by factors."""

import math
from collections.abc import Callable

import control
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq, newton

from actuator_lti import assemble_loops, load_design
from actuator_lti.errors import NumericalError
from actuator_lti.margins.exact import roots
from actuator_lti.step import step_figures
from actuator_lti.systems.delay_system import DelaySystem
from actuator_lti.systems.phase import unwrapped_phase_deg
from actuator_lti.systems.root import root
from tests.refusals import refused

s = control.tf("s")


def test_stiff_modes_and_a_slow_tail() -> None:
    f = step_figures((1.0 / (1e-6 * s + 1)) * (0.95 / (1e-3 * s + 1) + 0.05 / (5 * s + 1)))
    assert f.settling_time_s == pytest.approx(5 * math.log(0.05 / 0.02), rel=1e-4)
    assert f.rise_time_s == pytest.approx(1e-3 * (math.log(0.95 / 0.05) - math.log(0.95 / 0.85)), rel=1e-2)


@pytest.mark.parametrize("KT", [0.2, 0.5, 1.2])
def test_integrator_with_delay_by_the_method_of_steps(KT: float) -> None:
    T = 0.005
    closed = (DelaySystem.from_system((KT / T) / s) * DelaySystem.delay(T)).feedback()
    f = step_figures(closed)

    def exact(t: np.ndarray) -> np.ndarray:
        error = np.zeros_like(t)
        for k in range(26):  # those behind act later than is looked at
            past = np.maximum(t - k * T, 0.0)
            error += np.where(t >= k * T, (-KT / T) ** k * past**k / math.factorial(k), 0.0)
        return 1 - error

    early = f.time_s < 25 * T
    assert f.response[early] == pytest.approx(exact(f.time_s[early]), abs=1e-8)
    t = np.linspace(0, 25 * T, 1_000_001)
    y = exact(t)
    assert f.overshoot_percent == pytest.approx(max(100 * (y.max() - 1), 0), abs=0.01)
    assert f.rise_time_s == pytest.approx(t[np.argmax(y > 0.9)] - t[np.argmax(y > 0.1)], rel=2e-4)
    if KT < 1:
        assert f.settling_time_s == pytest.approx(t[np.flatnonzero(np.abs(y - 1) > 0.02)[-1]], rel=1e-3)


def test_a_hardly_damped_loop_of_two_delays_without_a_common_measure() -> None:
    """0.01 % below its border: what rings is one pole of T, by Newton and the residue of its closed form."""
    inner, outer, integrator = 1e-3 * math.sqrt(2.0), 1e-3 * math.e, DelaySystem.from_system(1 / s)
    loop = (300 * integrator * DelaySystem.delay(inner)).feedback() * DelaySystem.delay(outer) * integrator

    def open_loop(x: complex) -> complex:
        late = 300.0 * np.exp(-inner * x)
        return late / (x + late) * np.exp(-outer * x) / x

    border = brentq(lambda w: np.angle(-open_loop(1j * w)), 100.0, 300.0, xtol=1e-13)
    k = 0.9999 / abs(open_loop(1j * border))
    pole = newton(lambda x: 1.0 + k * open_loop(x), 1j * border, tol=1e-13)
    circle = 1e-2 * np.exp(2j * np.pi * np.arange(64) / 64)
    weight = np.mean(circle / ((1.0 + 1.0 / (k * open_loop(pole + circle))) * (pole + circle)))
    envelope = np.log(2.0 * abs(weight) / 0.02) / -pole.real
    settling = step_figures((k * loop).feedback()).settling_time_s
    assert envelope - np.pi / pole.imag <= settling <= envelope


def test_small_delays_approach_the_loop_without() -> None:
    plant = 200 * (s / 20 + 1) / (s * (s / 3 + 1) * (s / 400 + 1))
    free = step_figures(control.feedback(plant, 1))
    late = step_figures((DelaySystem.from_system(plant) * DelaySystem.delay(2e-6)).feedback())
    assert late.overshoot_percent == pytest.approx(free.overshoot_percent, rel=1e-3)
    assert late.settling_time_s == pytest.approx(free.settling_time_s, rel=1e-3)


@pytest.mark.parametrize(("system", "message"), [
    (1 / (s - 1), "not stable"),
    (1 / s, "integrates"),
    (1 / (s**2 + 1), "not stable"),
    (s / (s + 1), "zero"),
    (control.tf([1], [1, -1.1], 0.1), "not stable"),
    ((DelaySystem.from_system(400 / s) * DelaySystem.delay(0.005)).feedback(), "not stable"),
])  # fmt: skip
def test_refusals(system: control.LTI, message: str) -> None:
    refused(step_figures, system, match=message)


@pytest.mark.parametrize(("system", "settling_s"), [
    (control.tf([1, 0, 4], [1, 1, 4, 4]), math.log(50.0)),  # 1/(s + 1) beside a pair at 2 rad/s
    (control.tf([1, 1], [1, 0.5, -0.5], 0.1), 0.6),  # 1/(z - 1/2) beside z = -1: 2^-6 is the first below 2 %
])  # fmt: skip
def test_undamped_modes_that_the_response_does_not_show_are_told(
    system: control.LTI, settling_s: float
) -> None:
    figures = step_figures(system)
    assert figures.settling_time_s == pytest.approx(settling_s, rel=1e-12)
    assert any("that the response does not show" in note for note in figures.notes)


def test_what_no_time_is_enough_for_is_a_numerical_failure() -> None:
    """Ten of the longest delay are 1e7 of the shortest."""
    late = DelaySystem.from_system(control.tf([1], [1, 1])) * DelaySystem.delay(1.0)
    quick = DelaySystem.from_system(1.0) + 0.5 * DelaySystem.delay(1e-6)
    with pytest.raises(NumericalError, match="too long beside its delays"):
        step_figures((late * quick).feedback(DelaySystem.from_system(0.1)))


@pytest.mark.parametrize("grid", [[1e4], [1.0, 1e4], np.geomspace(1e-3, 1e4, 7), np.geomspace(1, 1e4, 1000)])
def test_F1_on_any_grid(grid: list[float]) -> None:
    lag = control.tf([1], [0.01, 1])
    inner = DelaySystem.from_system(lag) * DelaySystem.delay(0.02)
    assert unwrapped_phase_deg(lag, grid, delay_s=0.02)[-1] == pytest.approx(-11548.5829639, abs=1e-6)
    assert unwrapped_phase_deg(inner, grid)[-1] == pytest.approx(-11548.5829639, abs=1e-6)


@pytest.mark.parametrize("loop", [1 / s**3, control.ss(1 / s**3)])
def test_F2_three_integrators_start_at_minus_270(loop: control.LTI) -> None:
    assert unwrapped_phase_deg(loop, [1e-4, 1.0, 1e4]) == pytest.approx([-270.0] * 3, abs=1e-6)


@pytest.mark.parametrize(("loop", "start", "end"), [
    (-1 / (s + 1), -180, -270),
    (1 / (s - 2), -180, -90),
    ((1 - s) / (1 + s), 0, -180),
    ((s - 1) / (s + 1), -180, -360),
    (1 / (s**2 + 1e-9 * s + 1), 0, -180),
    (1 / (s**2 + 1), 0, -180),
    (1 / (s**2 - 0.1 * s + 1), 0, 180),
    ((s**2 + 1) / (s + 1) ** 4, 0, -180),
    (10 / (s * (s + 1) ** 4), -90, -450),
])  # fmt: skip
def test_start_and_end(loop: control.LTI, start: float, end: float) -> None:
    for form in (loop, control.ss(loop)):
        assert unwrapped_phase_deg(form, [1e-5, 1e7]) == pytest.approx([start, end], abs=0.02)


def test_sampled_delays_turn_by_their_samples() -> None:
    phase = unwrapped_phase_deg(control.tf([1], [1, 0, 0, 0, 0, 0], 0.01), [1.0, 100.0, 300.0])
    assert phase == pytest.approx(np.degrees([-0.05, -5.0, -15.0]), abs=1e-9)


def test_sampled_loop_follows_its_continuous_one_far_below_nyquist() -> None:
    loop = control.ss(20 * (s + 2) / (s * (s**2 + 0.3 * s + 9) * (s + 5)))
    held = control.c2d(loop, 1e-4)
    omega = np.geomspace(0.01, 50, 40)
    expected = unwrapped_phase_deg(loop, omega, delay_s=0.5e-4)
    assert unwrapped_phase_deg(held, omega) == pytest.approx(expected, abs=0.01)


def test_inner_delays_against_numpy_on_a_fine_grid() -> None:
    inner = (DelaySystem.from_system(300 / (s * (s / 500 + 1))) * DelaySystem.delay(0.001)).feedback()
    loop = inner * DelaySystem.delay(0.004) * DelaySystem.from_system(10 / s)
    omega = np.geomspace(0.1, 5000, 20_001)
    fine = np.degrees(np.unwrap(np.angle(loop(1j * omega))))
    fine -= 360 * np.round((fine[0] + 90) / 360)
    pick = [0, 137, 9000, 15000, 20000]
    assert unwrapped_phase_deg(loop, omega[pick]) == pytest.approx(fine[pick], abs=1e-6)


@settings(max_examples=30)
@given(st.lists(st.floats(1e-2, 1e4), min_size=1, max_size=6), st.floats(0, 0.1))
def test_grid_and_order_do_not_matter(omega: list[float], delay_s: float) -> None:
    loop = control.ss(1e5 * (s - 3) / (s * (s + 1) * (s**2 + 0.5 * s + 400)))
    together = unwrapped_phase_deg(loop, omega, delay_s)
    alone = [float(unwrapped_phase_deg(loop, w, delay_s)) for w in omega]
    assert together == pytest.approx(alone, abs=1e-8)


def test_unwrapping_refuses() -> None:
    for none in ([0.0], "a", None, 1j, [[1], [1, 2]]):
        refused(
            unwrapped_phase_deg, 1 / s, none, words="omega_rad_s: every frequency must be positive and finite"
        )
    refused(unwrapped_phase_deg, control.tf([1], [1, 0.5], 0.01), [400.0], words="Nyquist")
    refused(unwrapped_phase_deg, control.frd([1.0, 0.5], [1.0, 2.0]), [4.0], words="measured")


def test_a_loop_over_many_ticks_has_figures_of_few_digits(monkeypatch: pytest.MonkeyPatch) -> None:
    """Poles near z = -1 are large in s and cost twice the digits; 160 states never ended. By recursion."""
    monkeypatch.setattr(roots, "_MOST_BITS", 384)
    slow = {"control.velocity.every": 10, "control.position.every": 10}
    fed = {**slow, "control.current.back_emf_feedforward": 1.0}
    closed = assemble_loops(load_design("ilr33-amber").with_values(fed)).current.plain_closed
    found, x, y = step_figures(closed), np.zeros(len(closed.A)), []
    for _ in range(2000):
        y.append((closed.C @ x + closed.D[:, 0]).item())
        x = closed.A @ x + closed.B[:, 0]
    part = np.array(y) / found.final_value
    assert 100.0 * (part.max() - 1.0) == pytest.approx(found.overshoot_percent, abs=1e-6)
    assert found.settling_time_s / closed.dt == pytest.approx(np.flatnonzero(abs(part - 1.0) > 0.02)[-1] + 1)


@pytest.mark.parametrize(
    ("of", "low", "high", "exact"),
    [
        (lambda x: x * x - 2.0, 2.0, 0.0, math.sqrt(2.0)),
        (lambda x: math.exp(x) - 1e-9, -100.0, 3.0, math.log(1e-9)),
        (lambda x: (x - 0.3) ** 9, 0.0, 1.0, 0.3),
        (lambda x: -1.0 if x < 1.0 / 3.0 else 1.0, 0.0, 1.0, 1.0 / 3.0),
        (lambda x: math.inf if x > 2.0 else x - 1.0, 0.0, 9.0, 1.0),
        (lambda x: x - 5.0, 5.0, 7.0, 5.0),
    ],
)
def test_a_root_to_four_units_in_its_last_place(
    of: Callable[[float], float], low: float, high: float, exact: float
) -> None:
    asked: list[float] = []
    assert root(lambda x: of(asked.append(x) or x), low, high) == pytest.approx(exact, rel=2.0**-50)
    assert len(asked) <= 60  # as many as halving takes
    with pytest.raises(NumericalError, match="no change of sign"):
        root(of, 1e2, 2e2)
