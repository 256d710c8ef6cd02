"""The three forms against each other and by hand, operating and break points, budgets of delay, traps."""

from dataclasses import replace
from fractions import Fraction
from typing import Any

import control
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from loop_designs import amber, controlled, ctms_position, drive_d, drive_e, emps, faster, response, without
from scipy.integrate import solve_ivp
from test_stacked import FILTERS, everything

from actuator_lti import DelaySystem, InputError, assemble_loops, delay_budget, load_design, stability_margins
from actuator_lti.design.model import Design, Encoder, Filter, Friction, Limits, Load, PositionLoop
from actuator_lti.drive.blocks import biquad
from actuator_lti.drive.operating import Operating, slope_at
from actuator_lti.drive.signals import LIMITERS
from actuator_lti.loops import exact_margins
from actuator_lti.systems.sampling import delayed_hold, held_step, split_delay
from analyses import survey_loops
from reports.sections.forms import delay_budget as delay_section
from tests.margins.margin_truth import truth_of
from tests.refusals import refused
from tests.validation.random_drives import full_drive

FORMS = ("sampled", "continuous", "ideal")
R, L, K, J, Cv = 0.055, 6e-6, 5.9e-3, 1.05e-6, 5.25e-6  # of `amber`


@pytest.mark.parametrize("difference", [{}, {"difference_samples": 3}, {"filter_time_s": 5e-4}])
def test_delays_are_placed_right(difference: dict[str, Any]) -> None:
    """With P controllers the phases of sampled and continuous differ only to second order in Ts.

    A hold counted twice, or missing, would leave a first-order difference: halving, not quartering.
    """
    encoder = Encoder(speed="difference", **difference) if difference else Encoder()
    proportional = {stage: {"integral_time_s": None} for stage in ("velocity", "current")}
    design = controlled(amber(2, 10, delay_s=1.5e-4, encoder=encoder), **proportional)
    omega, gaps = np.array([30.0, 100.0]), []
    for k in (8, 16, 32):
        quick = replace(encoder, filter_time_s=encoder.filter_time_s / k)
        forms = (assemble_loops(replace(faster(design, k), encoder=quick), form) for form in FORMS[:2])
        pairs = zip(*(loops.present.values() for loops in forms), strict=True)
        apart = [response(a.open_loop, omega) / response(b.open_loop, omega) for a, b in pairs]
        gaps.append(np.abs(np.angle(apart)).max(axis=1))
    order = np.log2(gaps[1] / gaps[2])
    assert np.all(order > 1.9)
    # and in size: far less than half a tick
    assert np.all(gaps[2] < 0.02 * 100.0 * 0.5e-4 / 32)


def by_hand(s: np.ndarray, k: float = 0.0, late_i: Any = 1.0, late_w: Any = 1.0) -> tuple[Any, Any]:
    """Current and velocity loop of `amber`, a spring k on the motor; each behind its delay."""
    mechanics = s / (J * s**2 + Cv * s + k)
    Li = 0.02 * (1 + 1 / (150e-6 * s)) * late_i / (L * s + R + K**2 * mechanics)
    return Li, 0.12 * (1 + 1 / (15e-3 * s)) * late_w * Li / (1 + Li) * K * mechanics


@pytest.mark.parametrize(("form", "design", "late"), [
    ("ideal", amber(), (0.0, 0.0, 0.0)),
    ("continuous", amber(2, 10, delay_s=1.3e-4), (1.8e-4, 0.5e-4, 4e-4)),
])  # fmt: skip
def test_loops_are_the_hand_transfer_functions(form: Any, design: Design, late: tuple[float, ...]) -> None:
    """Each behind the delays nested in it."""
    loops, s = assemble_loops(design, form), 1j * np.geomspace(0.1, 1e5, 60)
    late_i, late_w, late_p = np.exp(-np.outer(late, s))
    Li, Lw = by_hand(s, 0.0, late_i, late_w)
    Lp = 120.0 / s * late_p * Lw / (1 + Lw)
    for loop, wanted in zip(loops.present.values(), (Li, Lw, Lp), strict=True):
        assert isinstance(loop.open_loop, DelaySystem) == (form == "continuous")
        np.testing.assert_allclose(loop.open_loop(s), wanted, rtol=1e-8)
        np.testing.assert_allclose(loop.closed_loop(s), wanted / (1 + wanted), rtol=1e-8)
        np.testing.assert_allclose(loop.sensitivity(s), 1 / (1 + wanted), rtol=1e-8)
    np.testing.assert_allclose(loops.reference_to_output(s), Lp / (1 + Lp), rtol=1e-8)
    # at i_ref with the position loop closed as well: Cw (1 + Kv/s) T_i K/(J s + Cv)
    at_i = Lw * (1 + 120.0 / s * late_p)
    np.testing.assert_allclose(loops.break_points["i_ref"].open_loop(s), at_i, rtol=1e-8)


@pytest.mark.parametrize("form", FORMS)
def test_feedforward_is_the_derivative_of_the_command(form: Any) -> None:
    """T_ff = T (1 + k_ff s/Kv); in the controller s is the backward difference over the position period."""
    plain = assemble_loops(amber(2, 10), form).reference_to_output
    fed = assemble_loops(amber(2, 10, feedforward=0.9), form).reference_to_output
    omega = np.geomspace(1, 1000, 20)
    rate = 1j * omega
    if form != "ideal":
        rate = (1 - np.exp(-1j * omega * 1e-3)) / 1e-3
    np.testing.assert_allclose(
        response(fed, omega), response(plain, omega) * (1 + 0.9 * rate / 120), rtol=1e-8
    )


@pytest.mark.parametrize("form", FORMS)
def test_inner_loops_opened(form: Any) -> None:
    """Closing the opened inner loop by hand gives the closed assembly; at u all three add up."""
    design = amber(encoder=Encoder(speed="difference", difference_samples=2))
    opened, closed = assemble_loops(design, form, inner_loops="open"), assemble_loops(design, form)
    omega = np.geomspace(1, 2e4, 20)
    inner = response(opened.current.open_loop, omega)
    by_hand = response(opened.velocity.open_loop, omega) / (1 + inner)
    np.testing.assert_allclose(by_hand, response(closed.velocity.open_loop, omega), rtol=1e-7)
    at_u = response(closed.break_points["u"].open_loop, omega)
    whole = inner + response(opened.velocity.open_loop, omega) + response(opened.position.open_loop, omega)
    np.testing.assert_allclose(at_u, whole, rtol=1e-7)


def test_every_break_point_of_a_series_cascade() -> None:
    loops = assemble_loops(amber())
    assert list(loops.break_points) == ["u", "i_ref", "w_ref", "output"]
    z = np.exp(1j * np.geomspace(1, 3e4, 30) * 1e-4)
    for name in ("w_ref", "output"):
        np.testing.assert_allclose(
            loops.break_points[name].open_loop(z), loops.position.open_loop(z), rtol=1e-9
        )
    assert list(assemble_loops(ctms_position()).break_points) == ["u", "output"]
    bare = assemble_loops(without(amber(), "velocity", gain=1.0))
    assert list(bare.break_points) == ["u", "i_ref", "output"]


@pytest.mark.parametrize("rates", [(1, 1), (2, 10), (2, 2), (1, 5)])
def test_closed_loops_of_all_break_points_have_the_poles_of_the_one_drive(rates: tuple[int, int]) -> None:
    loops = assemble_loops(amber(*rates))
    whole = np.abs(np.linalg.eigvals(loops.tick_system.lifted().A))
    largest = np.max(whole)
    for point, loop in loops.break_points.items():
        poles = np.abs(np.linalg.eigvals(loop.closed_loop.A))
        updates = loop.period_s / (rates[1] * 1e-4)
        assert np.max(poles) == pytest.approx(largest**updates, rel=1e-6), point


def exactly_stable(loop: control.StateSpace, gain: float, samples: int) -> bool:
    """Whether gain z^-samples L closes stably, by certified roots; its doubles are taken as rationals."""
    scaled = control.StateSpace(loop.A, gain * loop.B, loop.C, gain * loop.D, loop.dt)
    return truth_of(scaled, Fraction(samples)).unstable == 0


def test_exact_margins_are_those_of_the_exact_polynomial_where_the_loop_is_time_invariant() -> None:
    loops = assemble_loops(amber())
    exact, loop = exact_margins(loops, "u"), loops.break_points["u"].open_loop
    assert exact.stable
    assert exactly_stable(loop, exact.gain_upper * (1 - 1e-6), 0)
    assert not exactly_stable(loop, exact.gain_upper * (1 + 1e-6), 0)
    whole = int(exact.delay_s / loop.dt)  # a delay of the hold and of the samples are the same in whole ticks
    assert exactly_stable(loop, 1.0, whole)
    assert not exactly_stable(loop, 1.0, whole + 1)
    without_search = exact_margins(loops, "u", 0.0)
    assert (without_search.gain_upper, without_search.delay_s) == (exact.gain_upper, float("inf"))


def test_exact_margins_of_the_multirate_drive_bring_it_to_its_border() -> None:
    design = amber(2, 10)
    exact = exact_margins(assemble_loops(design), "u")
    for change, stable in ((0.999, True), (1.001, False)):
        delay_s = design.controller.computing_delay_s + change * exact.delay_s
        system = assemble_loops(controlled(design, computing_delay_s=delay_s)).tick_system
        assert bool(np.max(np.abs(np.linalg.eigvals(system.lifted().A))) < 1) is stable


@pytest.mark.parametrize(("gain", "stable"), [(100.0, True), (1000.0, False)])
def test_a_fundamental_of_many_states_has_the_verdict_of_the_whole_period(gain: float, stable: bool) -> None:
    """20 updates a period: 139 states, with a double pole at z = 1 that double precision does not place."""
    loops = assemble_loops(controlled(amber(1, 20), position={"gain": gain}))
    loop = loops.break_points["u"].open_loop
    assert loop.nstates > 120
    assert stability_margins(loop).stable is exact_margins(loops, "u").stable is stable


def test_trap_the_inner_loops_do_not_see_the_angle() -> None:
    loops = assemble_loops(amber(encoder=Encoder(speed="difference", difference_samples=2)))
    # the PI's own integrator is the only eigenvalue at 1 of the current and the velocity loop
    for loop in (loops.current, loops.velocity):
        assert np.sum(np.abs(loop.open_loop.poles() - 1) < 1e-9) == 1
        assert np.all(np.abs(loop.closed_loop.poles()) < 1 - 1e-4)
    assert np.sum(np.abs(loops.position.open_loop.poles() - 1) < 1e-9) == 1


def test_trap_back_emf_and_the_locked_rotor() -> None:
    free = assemble_loops(amber(), "ideal").current
    locked = assemble_loops(amber(), "ideal", rotor="locked")
    assert abs(locked.current.closed_loop(1e-6j)) == pytest.approx(1, abs=1e-8)
    assert abs(free.closed_loop(30j)) < 0.9
    assert locked.velocity is None
    assert locked.position is None
    assert list(locked.break_points) == ["u"]


def test_operating_points_of_the_friction() -> None:
    design = amber()
    assert slope_at(design, Operating()) == 5.25e-6
    still = Operating(point="rest", load_Nm=-8.0)
    assert slope_at(design, still) == pytest.approx(5.25e-6 + 2.25e-3 + 1.34e-3 * 8)
    swings = Operating(point="describing-function", load_Nm=8.0, speed_amplitude_rad_s=100.0)
    assert slope_at(design, swings) == pytest.approx(5.25e-6 + 4 * (2.25e-3 + 1.34e-3 * 8) / (np.pi * 100))
    friction = {"dry_torque_Nm": 2e-3, "dry_torque_reverse_Nm": 4e-3}
    viscous = {"viscous_Nms_rad": 1e-6, "viscous_reverse_Nms_rad": 3e-6}
    uneven = replace(design, friction=Friction(**friction, **viscous))
    assert slope_at(uneven, Operating(direction=-1)) == 3e-6
    slow = replace(swings, load_Nm=0.0, speed_amplitude_rad_s=10.0)
    assert slope_at(uneven, slow) == pytest.approx(2e-6 + 4 * 3e-3 / (np.pi * 10))
    rest = assemble_loops(design, operating_point="rest", load_Nm=8.0).velocity
    sliding, z = assemble_loops(design).velocity, np.exp(1j * 50 * 1e-4)
    assert abs(rest.open_loop(z)) < 0.5 * abs(sliding.open_loop(z))


@pytest.mark.parametrize(("wrong", "words"), [
    ({"design": emps(), "rotor": "locked"}, "locked"),
    ({"design": amber(encoder=Encoder(speed="tracking"))}, "bandwidth"),
    ({"operating_point": "driving"}, "no coupling"),
    ({"design": load_design("ilr33-amber-compliant").with_values({"coupling.play": 0.0}),
      "operating_point": "gap"}, "no play"),
    ({"inner_loops": "half"}, "inner_loops"),
    ({"form": "discrete"}, "^form = 'discrete': must be one of sampled, continuous, ideal$"),
    ({"operating_point": "moving"}, "operating_point = 'moving'"),
    ({"operating_point": "describing-function"}, "speed_amplitude_rad_s"),
    ({"operating_point": "rest", "speed_amplitude_rad_s": 3.0}, "rad_s = 3.0: .*'rest' has none"),
    ({"load_Nm": float("nan")}, "load_Nm"),
    ({"direction": 0}, "direction"),
    ({"rotor": "stuck"}, "rotor"),
])  # fmt: skip
def test_refusals_name_the_argument(wrong: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        assemble_loops(**{"design": amber(), **wrong})


def test_stiffness_of_a_back_drivable_load() -> None:
    design = amber(load=Load(path="back-drivable", moment_slope_Nm_rad=-40.0))
    s, loop = 1j * np.geomspace(0.01, 1e4, 20), assemble_loops(design, "ideal").velocity
    np.testing.assert_allclose(loop.open_loop(s), by_hand(s, 40.0 / 2376**2)[1], rtol=1e-7)
    held = assemble_loops(replace(design, load=Load(moment_slope_Nm_rad=-40.0)), "ideal").velocity
    plain = assemble_loops(amber(), "ideal").velocity
    np.testing.assert_array_equal(held.open_loop.A, plain.open_loop.A)


@pytest.mark.parametrize("seed", range(90_120, 90_130))
def test_sensitivities_sum_to_one_in_every_form(seed: int) -> None:
    design = full_drive(seed)
    slowest = max(loop.period_s for loop in assemble_loops(design).present.values())
    omega = np.geomspace(1e-3, 0.9, 12) * np.pi / slowest
    for form in FORMS:
        loops = assemble_loops(design, form)
        for loop in (*loops.present.values(), *loops.break_points.values()):
            L, T, S = (response(x, omega) for x in (loop.open_loop, loop.closed_loop, loop.sensitivity))
            np.testing.assert_allclose(S + T, 1, atol=1e-7 * np.max(np.abs(T)))
            np.testing.assert_allclose(S * (1 + L), 1, rtol=1e-5)
            assert loop.open_loop.ninputs == 1
            assert loop.unit_in == loop.unit_out


def test_signals_are_named_and_printing_says_what_it_is() -> None:
    loops = assemble_loops(amber())
    assert loops.velocity.open_loop.input_labels == ["e_w"]
    assert loops.velocity.open_loop.output_labels == ["w_meas"]
    assert loops.reference_to_output.output_labels == ["output_angle"]
    assert assemble_loops(amber(), "continuous").position.open_loop.input_labels == ["e_th"]
    loops = assemble_loops(amber(2, 10))
    assert repr(loops) == "Loops(amber: current, velocity, position; sampled, sliding, 0 N m, rotor free)"
    assert "0 N, rotor" in repr(assemble_loops("ballscrew"))
    expected = "Loop(at u, broken at u, in V, every 0.1 ms, fundamental of a periodic loop)"
    assert repr(loops.break_points["u"]) == expected
    assert repr(assemble_loops(amber(), "ideal").velocity).endswith("in rad/s, continuous)")


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
        paths = (
            ("reference_to_output", "load_torque_to_output") if drive.coupling else ("reference_to_output",)
        )
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


def test_a_budget_of_what_there_is_not_is_refused() -> None:
    refused(delay_budget, ctms_position(), "velocity", 10.0, words="one of position")
    refused(delay_budget, ctms_position(), "position", 1e4, words="Nyquist")
