"""Figures of many designs, compiled, against one design's own margins, surveys of them in time."""

import math

import control
import numpy as np
import pytest

from actuator_lti import assemble_loops, closed_loop_bandwidth, load_design, stability_margins, step_figures
from actuator_lti.batch import Population, linear_figures, variable_paths
from actuator_lti.design import Design, parameter_value, with_overrides, with_values
from actuator_lti.design.loader import as_design
from analyses.linear.loop_survey import MOST_STATES, survey_loops
from tests.refusals import refused
from tests.validation.random_drives import drives

NAMES = ("ilr33-amber", "ilr33-amber-multirate", "ctms-motor-position", "emps")
COMMAND = {"rate": "20 deg/s", "acceleration": "2000 deg/s^2", "jerk": "2e5 deg/s^3", "filter_time": "2 ms"}
BEHIND = with_overrides(load_design("ilr33-amber"), {f"command.{key}": at for key, at in COMMAND.items()})


def scattered(name: Design | str, count: int, seed: int) -> Population:
    """Designs around a shipped one: plant by 30 %, gains by a factor of 5, any delay up to 2.7 ticks."""
    rng = np.random.default_rng(seed)
    design = as_design(name)
    values = {}
    for path in variable_paths(design):
        if path not in design.parameters or path.startswith(("gear", "limits", "encoder", "control.period")):
            continue
        value = parameter_value(design, path)
        if path == "control.computing_delay":
            values[path] = design.controller.period_s * rng.choice([0, 0.25, 0.5, 1, 1.5, 2.7], count)
        elif path.startswith("control"):
            values[path] = value * 10 ** rng.uniform(-0.7, 0.7, count)
        else:
            values[path] = value * rng.uniform(0.7, 1.3, count)
    if "motor.back_emf_constant" in values:
        values["motor.back_emf_constant"] = values["motor.torque_constant"]
    return Population(design, values, count)


def each(population: Population, figures):
    """Number and loops of every design, made one by one."""
    for k in range(population.count):
        changed = {path: float(array[k]) for path, array in population.values.items()}
        present = assemble_loops(with_values(population.design, changed)).present
        for loop in figures.loops:
            yield k, loop, present[loop]


LOUD = with_values(load_design("ilr33-amber"), {"control.position.gain": 4800.0})  # its S has no peak
SLOW = {"control.velocity.every": 20, "control.velocity.gain": "3 mA/(rad/s)", "control.position.every": 20,
    "control.current.back_emf_feedforward": 1}  # fmt: skip
LONG = with_overrides(load_design("ilr33-amber-multirate"), SLOW)  # 20 ticks of 5 states
SURE = (*(scattered(name, 12, seed=5) for name in NAMES), Population(LOUD, {}, 1), Population(LONG, {}, 1))
# of the random ones rounding decides some; 90010 dips beside a mode that hardly shows, 90107 beside Nyquist
SEEDS = (90_010, 90_107, *range(90_209, 90_217))
RANDOM = tuple(Population(one, {}, 1) for seed in SEEDS for one in drives(seed, 1))


@pytest.mark.parametrize("population", [*SURE, *RANDOM], ids=lambda each: each.design.name)
def test_every_crossover_is_that_of_the_margin_engine(population):
    figures = linear_figures(population, time_figures=False)
    assert set(figures.loops) == set(assemble_loops(population.design).present)
    for k, loop, own in each(population, figures):
        truth = stability_margins(own.open_loop)
        if population.design.name.startswith("random") and (truth.withheld or figures.withheld(loop)[k]):
            continue
        assert figures.stable(loop)[k] == truth.stable
        peak = truth.sensitivity_peak_db if truth.stable else np.nan  # S of an unstable loop has none
        assert figures.quantity("sensitivity_peak", loop)[k] == pytest.approx(peak, rel=1e-6, nan_ok=True)
        for seen, wanted, size in (
            (figures.gain_crossovers(loop), truth.phase_margins, "deg"),
            (figures.phase_crossovers(loop), truth.gain_margins, "ratio"),
        ):
            assert seen.crossings[k] == len(wanted)
            for j, margin in enumerate(wanted):
                assert seen.frequency_rad_s[k, j] == pytest.approx(margin.frequency_rad_s, rel=1e-6)
                close = pytest.approx(getattr(margin, size), rel=1e-6, abs=1e-6 if size == "deg" else None)
                assert seen.margin[k, j] == close
        for name in ("gain_margin_db", "phase_margin_deg", "delay_margin_s", "modulus_margin"):
            quantity = "_".join(name.split("_")[:2])
            assert figures.quantity(quantity, loop)[k] == pytest.approx(getattr(truth, name), rel=1e-6)


@pytest.mark.parametrize("name", [*NAMES, pytest.param(BEHIND, id="behind mean and filter")])
def test_bandwidths_peaks_and_steps_are_those_of_the_loops(name):
    population = scattered(name, 5, seed=8)
    figures = linear_figures(population)
    for k, loop, own in each(population, figures):
        if not figures.stable(loop)[k] or (name, loop) == ("emps", "velocity"):
            continue  # emps: its speed measurement has a zero at Nyquist, where phase has no meaning
        width, step = closed_loop_bandwidth(own.closed_loop), step_figures(own.closed_loop)
        truths = {
            "bandwidth": width.minus3db_hz,
            "bandwidth_90deg": width.minus90deg_hz,
            "resonance_peak": width.resonance_peak_db,
            "overshoot": step.overshoot_percent,
            "rise_time": step.rise_time_s,
            "settling_time": step.settling_time_s,
        }
        for quantity, truth in truths.items():
            mine = figures.quantity(quantity, loop)[k]
            expected = np.nan if truth is None else truth
            assert mine == pytest.approx(expected, rel=1e-6, abs=1e-6, nan_ok=True), (loop, quantity, k)


def test_an_unstable_loop_is_called_so_and_what_cannot_vary_refused():
    design = load_design("ilr33-amber")
    population = Population(design, {"control.current.gain": np.array([0.02, 0.2])}, 2)
    figures = linear_figures(population)
    assert figures.stable("current").tolist() == [True, False]
    assert figures.quantity("delay_margin", "current")[1] == 0.0
    assert figures.quantity("gain_margin", "current")[1] < 0.0
    assert np.isnan(figures.quantity("bandwidth", "current")[1])
    refused(Population, design, {"motor.color": np.ones(2)}, 2, words="motor.color")
    refused(Population, design, {"motor.resistance": np.array([np.nan])}, 1, words="finite")
    longer = {"control.velocity.every": 50, "control.position.every": 50}
    refused(linear_figures, Population(with_overrides(LONG, longer), {}, 1), words="control.velocity.every, ")


@pytest.mark.parametrize("name", ["ilr33-amber", "ilr33-amber-compliant", "ballscrew"])
@pytest.mark.parametrize("slope", [-1e-2, -1e-3, -1e-4])
def test_a_current_loop_with_an_integrator_has_a_gain_of_one_at_rest_behind_the_softest_spring(name, slope):
    """For one design and for many: the spring's mode is slow, but seen, and takes T(0) back to 1."""
    changes = {"load.path": "back-drivable", "load.moment_slope": f"{slope} N*m/rad"}
    design = with_overrides(load_design(name), changes)
    width = closed_loop_bandwidth(assemble_loops(design).current.closed_loop)
    assert width.dc_gain == pytest.approx(1.0, abs=1e-9)
    figures = linear_figures(Population(design, {}, 1), time_figures=False)
    assert figures.quantity("bandwidth", "current")[0] == pytest.approx(width.minus3db_hz, rel=1e-9)


def test_bits_do_not_depend_on_threads_neighbours_or_order():
    population = scattered("ilr33-amber-multirate", 600, seed=1)
    whole = linear_figures(population, threads=2).raw
    order = np.random.default_rng(2).permutation(population.count)
    shuffled = Population(population.design, {p: v[order] for p, v in population.values.items()}, 600)
    assert np.array_equal(linear_figures(shuffled).raw, whole[order], equal_nan=True)
    alone = Population(population.design, {p: v[7:8] for p, v in population.values.items()}, 1)
    assert np.array_equal(linear_figures(alone).raw[0], whole[7], equal_nan=True)


@pytest.mark.parametrize(
    ("point", "extra"), [("rest", {}), ("describing-function", {"speed_amplitude_rad_s": 30.0})]
)
def test_rest_and_describing_function_change_the_slope_as_the_loops_do(point, extra):
    design, at = load_design("ilr33-amber"), {"operating_point": point, "load_Nm": 8.0, **extra}
    mine = linear_figures(Population(design, {}, 1), **at).quantity("phase_margin", "velocity")[0]
    truth = stability_margins(assemble_loops(design, **at).velocity.open_loop)
    assert mine == pytest.approx(truth.phase_margin_deg, rel=1e-6)


S = control.tf("s")


def ringing(above: float) -> control.StateSpace:
    """A resonance of 1 % damping, up to 140 dB above the gain at zero frequency."""
    return control.c2d(control.ss(50 * above * S / (S**2 + S + 2500) + 1 / (S + 1)), 1e-3)


def held_twice(part: control.TransferFunction) -> control.StateSpace:
    """In z^2, as of a drive with two updates: both roots of every pole."""
    return control.ss(
        control.tf(*(np.kron(each[0][0], [1.0, 0.0])[:-1] for each in (part.num, part.den)), part.dt)
    )


def slow_mode(slow: float) -> control.TransferFunction:
    return control.tf([0.5], [1.0, -0.5], 1e-3) * (1.0 - slow) + control.tf(
        [slow * 1e-3], [1.0, -0.999], 1e-3
    )


def slow_pair(w: float) -> control.TransferFunction:
    """One that passes zero about when it is alone, at some w."""
    return control.tf(control.c2d(control.ss(1 / (0.05 * S + 1) + 0.3 * S / (S**2 + 0.4 * S + w**2)), 1e-2))


@pytest.mark.parametrize(("system", "longest", "known"), [
    *((ringing(above), None, True) for above in (1e-2, 1.0, 1e3, 1e5)), (ringing(1.0), 2000, False),
    (control.ss(slow_pair(2.0)), 1500, True),
    *((held_twice(slow_mode(slow)), 4000, True) for slow in (0.05, -0.05)),
    *((held_twice(slow_pair(w)), None, True) for w in (2.3, 2.5, 2.6)),
])  # fmt: skip
def test_a_step_is_followed_for_as_long_as_it_may_leave_its_band(system, longest, known, monkeypatch):
    """As a resonance rings, for the longest time, or until the slowest poles are too small."""
    from actuator_lti.batch import _figures, _linalg, _step

    A, B, C = (np.asarray(part) for part in (system.A, system.B, system.C))
    n, p = len(A), np.linalg.eigvals(system.A)
    row = np.full(_figures.COLUMNS, np.nan)
    row[_figures.RADIUS], row[_figures.FINAL] = np.abs(p).max(), (C @ np.linalg.solve(np.eye(n) - A, B))[0, 0]
    poles = np.concatenate((np.zeros(2 * n), p.real, p.imag))
    spaces, loop = (np.zeros(2 * n), np.zeros(2 * n * n + 2 * n)), [part.ravel().copy() for part in (A, B, C)]
    _linalg.hessenberg(n, *loop, np.zeros(n))
    monkeypatch.setattr(_step, "LONGEST", longest or _step.LONGEST)
    _step.step_figures(n, *loop, np.nan, poles, row, *spaces)
    truth, known = step_figures(system), 1.0 if known else math.nan
    settling, overshoot = known * truth.settling_time_s / system.dt, known * truth.overshoot_percent
    assert row[_figures.SETTLING] == pytest.approx(settling, abs=1e-6, nan_ok=True)
    assert row[_figures.RISE] == pytest.approx(truth.rise_time_s / system.dt, abs=1e-6)
    assert row[_figures.OVERSHOOT] == pytest.approx(overshoot, rel=1e-7, nan_ok=True)


def test_a_fundamental_of_very_many_states_has_exact_borders_and_a_reason() -> None:
    changed = {"control.position.every": 40, "control.position.gain": 5.0}
    design = with_values(load_design("ballscrew"), changed)
    states = {name: len(loop.plain_open.A) for name, loop in assemble_loops(design).break_points.items()}
    points = survey_loops(design).break_points
    large = {name: count for name, count in states.items() if count > MOST_STATES}
    assert large
    for name, count in large.items():
        assert (points[name].figures is None, points[name].exact is None) == (True, False)
        assert f"{count} states" in points[name].reason
    assert points["output"].figures is not None
