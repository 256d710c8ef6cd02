"""Loops hard to follow: unstable inside, entries to 1e15; an integrator in states; one answer in any form.

Truth is mpmath on the exact values of the doubles of the single loop, what 8 ulp of them change left out, or
the equations of the cascade in s, evaluated point by point.
"""

from typing import Any

import control
import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar

from actuator_lti import assemble_loops, load_design, stability_margins
from actuator_lti.bandwidth import peaks
from actuator_lti.batch import Population, linear_figures
from actuator_lti.design.model import Design
from actuator_lti.drive.wiring import wire
from actuator_lti.loops import sampled
from actuator_lti.margins.loop import rational_loop
from actuator_lti.margins.poles import sorted_poles
from actuator_lti.systems.delay_system import DelaySystem
from tests.changed import changed
from tests.loops.loop_designs import sprung
from tests.margins.margin_truth import determined, difference, truth_of

BASE = load_design("ilr33-amber-multirate")
SEEDS = range(30)


def unstable_inside(seed: int) -> Any:
    """Current gain times 4 to 100; 4 to 8 ticks a velocity period, 8 to 24 a position period."""
    rng = np.random.default_rng([seed, 11])
    control = BASE.controller
    factors = 10.0 ** rng.uniform((0.6, -3.0, -3.0), (2.0, 1.0, 1.0))
    every = int(rng.choice([4, 6, 8]))
    position = {"every": every * int(rng.choice([2, 3])), "gain": control.position.gain * factors[2]}
    velocity = {"every": every, "gain": control.velocity.gain * factors[1]}
    current = {"gain_V_A": control.current.gain_V_A * factors[0]}
    return changed(BASE, controller={"current": current, "velocity": velocity, "position": position})


def opened(design: Design) -> dict[str, Any]:
    """The open loops of the stages alone; those at the break points have hundreds of states."""
    wired = wire(design)
    return {stage: sampled.loop(wired, stage).open_loop for stage in wired.stages}


@pytest.mark.parametrize("seed", SEEDS)
def test_the_figures_are_the_truth_or_withheld(seed: int, capfd: pytest.CaptureFixture[str]) -> None:
    design = unstable_inside(seed)
    many = linear_figures(Population(design, {}, 1))
    for name, system in opened(design).items():
        m = stability_margins(system)
        try:
            truth = truth_of(system)
        except AssertionError:  # a root that is not told from the axis
            continue
        result = difference(m, truth)
        if result is not None:
            assert not determined(system, truth, np.random.default_rng(seed)), (name, result)
            assert many.withheld(name)[0]
            continue
        assert not many.stable(name)[0] or truth.unstable == 0
        if many.withheld(name)[0]:
            assert np.abs(system.A).max() > 1e5
            assert all(np.isnan(many.quantity(q, name)[0]) for q in ("gain_margin", "phase_margin"))
            continue
        assert many.stable(name)[0] == (truth.unstable == 0)
        for figure in ("gain_margin_db", "phase_margin_deg", "modulus_margin"):
            quantity, value = figure.removesuffix("_db").removesuffix("_deg"), getattr(m, figure)
            assert many.quantity(quantity, name)[0] == pytest.approx(value, rel=1e-6), (name, quantity)
    assert capfd.readouterr() == ("", "")


def test_the_seeds_reach_what_they_are_for() -> None:
    sizes = [np.abs(opened(unstable_inside(seed))["position"].A).max() for seed in SEEDS]
    assert max(sizes) > 1e11
    assert min(sizes) < 1e5


def test_entries_of_5e14_are_withheld_among_others_that_are_not() -> None:
    """One design of a population cannot be followed; its neighbours keep the bits they have alone."""
    gain = BASE.controller.current.gain_V_A
    gains = np.array([gain, 60.0 * gain, 0.7 * gain])
    base = changed(BASE, controller={"position": {"every": 20}})
    figures = linear_figures(Population(base, {"control.current.gain": gains}, 3))
    assert figures.withheld("position").tolist() == [False, True, False]
    assert figures.stable("position").tolist() == [True, False, True]
    assert figures.gain_crossovers("position").crossings[1] == 0
    for k in (0, 2):
        alone = linear_figures(Population(base, {"control.current.gain": gains[[k]]}, 1))
        assert (alone.raw[0] == figures.raw[k])[~np.isnan(alone.raw[0])].all()


SLOPES = (-6000.0, -40.0, -1.0, -1e-3, 1e-3, 1.0)


def position_loop(design: Design, s: np.ndarray) -> np.ndarray:
    """Kv W(s)/s, W the closed velocity loop: (L i)' = u - R i - kE w, J w' = kM i - Cv w - k th, th' = w."""
    motor, law = design.effective_motor, design.controller
    k = -design.load.moment_slope_Nm_rad / design.total_ratio**2
    J, Cv, kM = design.inertia_kgm2, design.friction.viscous(1), motor.torque_constant_Nm_A
    kE = motor.back_emf_constant_Vs_rad
    Z = motor.inductance_H * s + motor.resistance_ohm
    w_per_i = kM * s / (J * s**2 + Cv * s + k)
    C_i = law.current.gain_V_A * (1 + 1 / (law.current.integral_time_s * s))
    i_per_u = 1 / (Z + kE * w_per_i)
    current = C_i * i_per_u / (1 + C_i * i_per_u)
    C_v = law.velocity.gain * (1 + 1 / (law.velocity.integral_time_s * s))
    velocity = C_v * current * w_per_i / (1 + C_v * current * w_per_i)
    return law.position.gain * velocity / s


def largest(values: object, low: float, high: float) -> float:
    """Largest value of a function of w, by a grid and a search between its neighbours."""
    grid = np.geomspace(low, high, 20_001)
    k = int(np.argmax(values(grid)))
    ends = np.log(grid[[max(k - 1, 0), min(k + 1, grid.size - 1)]])
    best = minimize_scalar(lambda x: -float(values(np.exp([x]))[0]), bounds=tuple(ends), method="bounded")
    return max(-float(best.fun), float(values(grid)[k]))


@pytest.mark.parametrize("slope", SLOPES)
def test_peaks_and_margins_of_the_ideal_position_loop(slope: float) -> None:
    design = sprung("ilr33-amber", slope)
    system = assemble_loops(design, form="ideal").position.open_loop
    assert sorted_poles(rational_loop(system).A, False).at_dc == 1
    found = peaks(system)
    S = largest(lambda w: np.abs(1 / (1 + position_loop(design, 1j * w))), 1e-3, 1e6)
    assert found.sensitivity_db == pytest.approx(20 * np.log10(S), abs=1e-6)
    T = largest(lambda w: np.abs(1 / (1 + 1 / position_loop(design, 1j * w))), 1e-6, 1e6)
    assert found.complementary_db == pytest.approx(max(20 * np.log10(T), 0.0), abs=1e-6)  # T(0) = 1
    m = stability_margins(system)
    assert m.stable is True
    crossover = m.phase_margin.frequency_rad_s
    L = complex(position_loop(design, np.array([1j * crossover]))[0])
    assert abs(L) == pytest.approx(1.0, rel=1e-7)
    assert m.phase_margin_deg == pytest.approx(np.degrees(np.angle(-L)), abs=1e-5)


def test_peaks_of_a_double_integrator_that_rounding_parts() -> None:
    """(s + 1)/s^2, from a matrix whose zeros rounding parts; v = w^2 of the peaks by hand."""
    system = control.StateSpace([[2.0, 2.0], [-2.0, -2.0]], [[1.0], [0.0]], [[1.0, 0.5]], 0.0)
    found = peaks(system)
    v = 3.0**0.5 - 1.0  # |T|^2 = (1 + v)/(1 - v + v^2)
    assert found.complementary_db == pytest.approx(10 * np.log10((1 + v) / (1 - v + v * v)), abs=1e-9)
    assert found.complementary_rad_s == pytest.approx(v**0.5, rel=1e-6)
    assert found.sensitivity_db == pytest.approx(10 * np.log10(4 / 3), abs=1e-9)  # v^2/(1 - v + v^2), v = 2
    assert found.sensitivity_rad_s == pytest.approx(2.0**0.5, rel=1e-6)


@pytest.mark.parametrize("certify", [False, True], ids=["", "certified"])
@pytest.mark.parametrize("part", [1e-8, 1e-6, 1e-4, 0.005, 0.0087, 0.02])
def test_L6_a_small_part_of_a_sample(part: float, certify: bool) -> None:
    """0.4/(z + 0.5): a gain margin of 1.25 at Nyquist, and next to it as soon as there is a delay."""
    loop = control.tf([0.4], [1, 0.5], 1.0)
    for form in (loop, control.ss(loop)):
        m = stability_margins(form, delay_s=part, certify=certify)
        assert (m.stable, m.phase_margins) == (True, ())
        assert [g.ratio for g in m.gain_margins if g.ratio < 1e3] == pytest.approx([1.25], rel=1e-3)


@pytest.mark.parametrize("certify", [False, True], ids=["", "certified"])
def test_L12_a_gain_behind_a_delay(certify: bool) -> None:
    m = stability_margins(control.tf([0.5], [1]), delay_s=1.0, certify=certify)
    assert (m.stable, m.phase_margins) == (True, ())
    assert [g.ratio for g in m.gain_margins] == pytest.approx([2.0] * 6)


@pytest.mark.parametrize("below", [1e-10, 5e-10])
def test_a_gain_that_all_but_reaches_one_is_a_touch_in_those_words(below: float) -> None:
    m = stability_margins(control.tf([0.2 * (1.0 - below), 0], [1, 0.2, 1]))
    assert m.stable
    assert not m.phase_margins or ("touch within 1e-9" in str(m) and m.phase_margins[0].tangent)


def test_no_gain_margin_at_rest_where_the_loop_is_zero_there() -> None:
    """s/(s + 1)^2 seen in states that a rotation mixes: c A^-1 b is rounding, of either sign."""
    rng = np.random.default_rng(5)
    for _ in range(20):
        loop = control.ss(control.tf([-1.0, 0.0], [1.0, 2.5, 1.0]) * control.tf([1.0], [0.1, 1.0]))
        T = np.linalg.qr(rng.standard_normal((3, 3)))[0]
        mixed = control.StateSpace(T @ loop.A @ T.T, T @ loop.B, loop.C @ T.T, loop.D)
        for delay_s in (0.0, 0.1):
            m = stability_margins(mixed, delay_s=delay_s)
            assert all(g.frequency_rad_s > 1e-3 for g in m.gain_margins)


@pytest.mark.parametrize("gain", [-0.4, 0.3, 0.9])
@pytest.mark.parametrize("den", [[1, 0.5], [1, -0.3, 0.1], [1, -0.9]])
def test_a_fraction_of_a_sample_goes_to_whole_samples(gain: float, den: list[float]) -> None:
    loop = control.tf([gain], den, 1.0)
    for whole in (0, 1):
        limit = stability_margins(loop, delay_s=float(whole)) if whole else stability_margins(loop)
        for q in [2e-8, 1e-6] if not whole else [1.0 - 2e-8, 1.0 + 2e-8, 1.0 - 1e-6]:
            m = stability_margins(loop, delay_s=q)
            assert m.stable is limit.stable
            assert m.agreement.unstable_poles is None  # the Nyquist curve alone tells
            assert [g.ratio for g in m.gain_margins] == pytest.approx(
                [g.ratio for g in limit.gain_margins], rel=1e-4
            )
            assert [p.deg for p in m.phase_margins] == pytest.approx(
                [p.deg for p in limit.phase_margins], abs=1e-3
            )


def test_small_coefficients_of_a_numerator_stay_where_a_delay_is_joined() -> None:
    """(1e-17 s + 1e-17)/(s^2 + 1e-9 s + 1e-16): python-control drops the numerator."""
    loop = control.tf([1e-17, 1e-17], [1.0, 1e-9, 1e-16])
    joined = DelaySystem.from_system(loop)
    w = 1j * np.geomspace(1e-9, 1e3, 25)
    exact = (1e-17 * w + 1e-17) / (w * w + 1e-9 * w + 1e-16)
    assert np.array([joined(s) for s in w]) == pytest.approx(exact, rel=1e-12)


@pytest.mark.parametrize(("gain", "poles", "delay_s"), [
    (3.0, (1.0, 3.0), 0.3212380417677561), (5.0, (1.0, 5.0), 0.02), (8.0, (2.0, 4.0), 0.9),
    (60.0, (2.0, 5.0), 0.05), (60.0, (2.0, 5.0), 0.01),
])  # fmt: skip
def test_two_integrators_that_cancel_behind_a_series_delay(gain, poles, delay_s) -> None:
    """K s^2/(s^3 (s + a)(s + b)) exp(-s T): seen is K/(s (s + a)(s + b)), whose phase only falls."""
    a, b = poles
    loop = control.tf([gain, 0.0, 0.0], np.polymul([1.0, a + b, a * b], [1.0, 0.0, 0.0, 0.0]))
    w = brentq(lambda w: np.arctan(w / a) + np.arctan(w / b) + w * delay_s - 0.5 * np.pi, 1e-6, 100.0)
    ratio = w * np.hypot(w, a) * np.hypot(w, b) / gain
    for m in (
        stability_margins(loop, delay_s=delay_s),
        stability_margins(DelaySystem.from_system(loop) * DelaySystem.delay(delay_s)),
    ):
        assert m.stable is bool(ratio > 1.0)
        assert m.gain_margins[0].ratio == pytest.approx(ratio, rel=1e-9)
