"""The wider drive in all three forms: limits of the sampled one, hand-made transfer functions, budgets."""

from dataclasses import replace

import numpy as np
import pytest
from loop_designs import amber, controlled, faster, response
from scipy.integrate import solve_ivp
from test_stacked import FILTERS, everything
from two_mass import drive_d, drive_e

from actuator_lti import InputError, assemble_loops, delay_budget
from actuator_lti.design.model import Filter, Limits, PositionLoop
from actuator_lti.drive.blocks import biquad
from actuator_lti.drive.signals import LIMITERS
from analyses import survey_loops
from reports.sections.delays import section


@pytest.mark.parametrize(
    ("drive", "final", "order"), [(amber(2, 10), 5e-3, (1.9, 2.1)), (everything(), 0.02, (1.8, np.inf))]
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


@pytest.mark.parametrize(("Ti", "TD"), [(0.2, 1e-3), (None, 0.0)])
def test_pid_by_hand(Ti: float | None, TD: float) -> None:
    """Ideal form: Kv (1 + 1/(Ti s) + Td s/(TD s + 1)) in front of the closed velocity loop.

    A bare D is proper there, as the angle's derivative is a state.
    """
    pid = PositionLoop(gain=20.0, integral_time_s=Ti, derivative_time_s=2e-3, derivative_filter_s=TD)
    laws = (PositionLoop(gain=20.0), pid)
    one, two = (assemble_loops(controlled(drive_e(), position=law), "ideal").position for law in laws)
    s = 1j * np.geomspace(1, 1000, 10)
    law = 1 + (1 / (Ti * s) if Ti else 0.0) + 2e-3 * s / (TD * s + 1)
    np.testing.assert_allclose(two.open_loop(s), law * one.open_loop(s), rtol=1e-9)


def test_torque_filters_multiply_the_velocity_loop() -> None:
    plain, filtered = (assemble_loops(drive_d(*f), "ideal").velocity for f in ((), FILTERS[:3]))
    s = 1j * np.geomspace(1, 5000, 10)
    w2, w1 = 2000.0, 900.0
    shape = w2**2 / (s**2 + np.sqrt(2) * w2 * s + w2**2)
    shape = shape * (s**2 + 30 * s + w1**2) / (s**2 + 300 * s + w1**2)
    shape = shape * (s / 500 + 1) / (s / 1500 + 1)
    np.testing.assert_allclose(filtered.open_loop(s), shape * plain.open_loop(s), rtol=1e-9)


def test_resistance_and_back_emf_feedforward_make_the_current_loop_ideal() -> None:
    """With k = 1 and w itself measured, the current loop is that of a locked rotor: back-EMF is gone."""
    base = drive_d()
    fed = controlled(base, current={"back_emf_feedforward": 1.0})
    free = assemble_loops(fed, "ideal").current
    locked = assemble_loops(base, "ideal", rotor="locked").current
    s = 1j * np.geomspace(1, 1e4, 10)
    np.testing.assert_allclose(free.open_loop(s), locked.open_loop(s), rtol=1e-9)
    sampled = assemble_loops(fed).current
    assert sampled.periodic  # the speed is measured every other tick


def test_the_given_biquad_goes_to_continuous_time_and_back() -> None:
    item = Filter(kind="biquad", b=(0.2, 0.1, 0.05), a=(-0.9, 0.25))
    block, T = biquad(item, 1e-3), 1e-3
    omega = np.array([1.0, 300.0, 2000.0])
    warped = 2 / T * np.tan(omega * T / 2)
    np.testing.assert_allclose(block.at_z(omega), block.continuous.response(1j * warped), rtol=1e-12)
    z = np.exp(1j * omega * T)
    by_hand = (0.2 * z**2 + 0.1 * z + 0.05) / (z**2 - 0.9 * z + 0.25)
    np.testing.assert_allclose(block.at_z(omega), by_hand, rtol=1e-12)
    with pytest.raises(InputError, match="below pi/T"):
        biquad(Filter(kind="lowpass", frequency_rad_s=2e4), 2e-4)


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
    rows = section(survey.budgets)["blocks"][1]["rows"]
    assert all(row["torque notch 2 900 rad/s"] <= 0.0 for row in rows)
    assert rows[0]["torque notch 2 900 rad/s"] == 0.0  # the current loop has none
