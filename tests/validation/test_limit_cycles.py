"""Limit cycles of play and counts: describing functions by quadrature, cycles by poles and by simulation."""

from functools import cache
from itertools import pairwise
from math import asin, degrees, pi
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad

from actuator_lti import InputError, assemble_loops
from actuator_lti.design import load_design, with_overrides, with_values
from actuator_lti.design.model import Design, Filter
from actuator_lti.drive.operating import dead_zone
from analyses.limit_cycles import LimitCycles, describing, limit_cycles
from analyses.limit_cycles.counts import Counts, counted_gain, counts_of, linear_ratio
from analyses.limit_cycles.describing import Cycle, cycles_of_play, cycles_of_quantisation
from analyses.limit_cycles.run import CycleResult, confirm
from nonlinear import Rows, commands, simulate
from reports.certain import certain
from reports.sections.beyond import counts as counts_section
from reports.sections.cycles import section
from tests.changed import changed
from tests.validation.random_drives import full_drive

AMBER, FIN = load_design("ilr33-amber"), load_design("fin")
FILTERED = {"speed": "difference", "difference_samples": 4, "filter_time_s": 1e-3}
TRACKING = {"speed": "tracking", "bandwidth_rad_s": 1500.0}


def counting(per_rev: int, **encoder: object) -> Design:
    return changed(AMBER, encoder={"counts_per_rev": per_rev, **encoder})


@cache
def of_difference(per_rev: int) -> Counts:
    design = counting(per_rev, speed="difference")
    loops = assemble_loops(design)
    (found,) = counts_of(design, loops)
    return found


@pytest.mark.parametrize("ratio", [0.3, 0.9, 1.7, 4.2])
@pytest.mark.parametrize("offset", [0.0, 0.3, 0.5])
def test_gain_of_counts_by_quadrature(ratio: float, offset: float) -> None:
    """First harmonic of floor(A sin x - d) over A, edges at whole numbers plus d."""
    edges = [k + offset for k in range(-6, 7) if abs(k + offset) < ratio]
    breaks = sorted(x for e in edges for x in (np.arcsin(e / ratio), pi - np.arcsin(e / ratio)))
    breaks = [-pi / 2, *breaks, 3 * pi / 2]
    parts = [(a, b) for a, b in pairwise(breaks) if b - a > 1e-9]
    total = sum(quad(lambda x: np.floor(ratio * np.sin(x) - offset) * np.sin(x), a, b)[0] for a, b in parts)
    assert counted_gain(ratio, offset) == pytest.approx(total / pi / ratio, abs=1e-7)


def test_beyond_the_linear_amplitude_the_gain_is_one_within_5_percent() -> None:
    ratios, offsets = np.linspace(linear_ratio(), 12.0, 150), np.linspace(0.0, 1.0, 11)
    assert max(abs(counted_gain(r, d) - 1.0) for r in ratios for d in offsets) <= 0.055
    below = np.linspace(0.85, 1.0, 60) * linear_ratio()
    assert max(abs(counted_gain(r, d) - 1.0) for r in below for d in offsets) > 0.045


SOFT = {"control.velocity.gain": 0.012, "control.position.gain": 24.0}  # back at the edge after many periods


@pytest.mark.parametrize(("encoder", "gains"), [(FILTERED, {}), (TRACKING, {}), (TRACKING, SOFT)])
def test_a_counted_speed_has_its_cycle_at_the_border_and_from_rest(encoder, gains) -> None:
    """The gain 2 q/(pi A) of the speed brings a pole to the circle; pushed off the edge it swings so."""
    design = with_values(counting(4000, **encoder), gains)
    (cycle,) = cycles_of_quantisation(design)
    q, free = design.angle_quantum_rad, describing.without_nonlinearities(design)
    louder = Filter(kind="biquad", on="speed", b=(2.0 * q / (pi * cycle.inner_rad),), a=(0.0,))
    loop = assemble_loops(changed(free, controller={"velocity": {"filters": (louder,)}})).position
    poles = loop.closed_loop.poles()
    pole = poles[np.argmin(np.abs(poles - np.exp(2j * pi * cycle.frequency_hz * loop.period_s)))]
    assert abs(pole) == pytest.approx(1.0, abs=1e-6)
    assert np.abs(poles).max() < 1.0 + 1e-6
    run = simulate(free, commands.hold(-1e-3 * q / design.total_ratio), 2.0, limits_on=False)
    tail = run.motor_angle_rad[-6000:] - run.motor_angle_rad[-6000:].mean()
    crossings = np.flatnonzero((tail[:-1] < 0.0) & (tail[1:] >= 0.0))
    hertz = (crossings.size - 1) / ((crossings[-1] - crossings[0]) * design.controller.period_s)
    assert 0.5 * np.ptp(tail) == pytest.approx(cycle.inner_rad, rel=0.2)
    assert hertz == pytest.approx(cycle.frequency_hz, rel=0.2)
    assert confirm(design, cycle).verdict == "confirmed"


def test_steps_of_the_speed_and_scale() -> None:
    """q/(m T); with half the count everything in a drive without friction is half, the threshold too."""
    one, two = of_difference(1024), of_difference(2048)
    control = AMBER.controller
    step = 2.0 * pi / 1024 / (control.velocity.every * control.period_s)
    assert one.speed_step_rad_s == pytest.approx(step, rel=1e-12)
    made = counts_section([one])
    assert f"steps of {step:.3g} rad/s in the speed estimate" in made["result"]
    assert made["status"] == "info"
    assert two.speed_step_rad_s == pytest.approx(0.5 * step, rel=1e-12)
    assert two.linear_rad == pytest.approx(0.5 * one.linear_rad, rel=1e-12)
    np.testing.assert_allclose(two.off[1:4], one.off[1:4], rtol=0.05, atol=1e-3)
    assert two.cycles[0].cycle.inner_rad == pytest.approx(0.5 * one.cycles[0].cycle.inner_rad, rel=1e-9)


def test_below_the_linear_amplitude_the_simulator_is_off_and_beyond_it_is_not() -> None:
    found = of_difference(1024)
    assert found.off[0] > 0.3
    assert (found.off[2:] < 0.05).all()
    assert found.linear_simulated_rad == pytest.approx(found.linear_rad)


def test_a_small_cycle_keeps_its_digits_in_a_document() -> None:
    """The joint's motor counts move its output by 5.1e-9 deg."""
    joint = load_design("joint")
    found = counts_of(joint, assemble_loops(joint))
    table = certain(counts_section(found))["blocks"][-1]
    shown = [f"{row['output']:.3g} {table['columns'][2]['unit']}" for row in table["rows"]]
    sizes = [degrees(one.cycle.output_rad) for each in found for one in each.cycles]
    assert shown == [f"{1e3 * size:.3g} mdeg" for size in sizes]


def test_a_drive_that_only_friction_holds_has_no_linear_amplitude() -> None:
    """Seed 40018: without friction its response grows without bound; NaN was compared with NaN."""
    design = full_drive(40018)
    found = counts_of(design, assemble_loops(design))
    assert all(np.isinf(one.off).all() and one.linear_simulated_rad is None for one in found)


@pytest.mark.parametrize("x", [0.01, 0.3, 0.7, 0.99])
def test_spring_and_damper_in_contact_lose_the_same_share(x: float) -> None:
    """Fundamentals of the torque over a sinusoidal twist of 1, k = c w = 1, by quadrature."""
    start = asin(x)
    spring = 4 / pi * quad(lambda p: (np.sin(p) - x) * np.sin(p), start, pi / 2)[0]
    damper = 4 / pi * quad(lambda p: np.cos(p) ** 2, start, pi / 2)[0]
    assert dead_zone(x) == pytest.approx(spring, abs=1e-12)
    assert dead_zone(x) == pytest.approx(damper, abs=1e-12)


def test_cycles_of_the_fin_s_play_are_found_by_the_simulator() -> None:
    """Without friction: a border, and outside it a cycle that attracts; within 10 % in size and frequency."""
    border, attracting = cycles_of_play(FIN, friction=False)
    assert (border.stable, attracting.stable) == (False, True)
    for cycle in (border, attracting):
        seen = confirm(FIN, cycle)
        assert seen.ratio == pytest.approx(1.0, abs=0.1)
    assert seen.frequency_hz == pytest.approx(attracting.frequency_hz, rel=0.1)


@pytest.mark.parametrize(("name", "twist_rad", "hertz"), [
    ("rotor_hunts", 2.4725e-3, 17.70), ("load_swings", 3.346e-3, 1.365),
])  # fmt: skip
def test_a_cycle_in_which_friction_holds_one_end(name: str, twist_rad: float, hertz: float) -> None:
    """Twist and frequency as another simulator, written from the model in small steps, ends in them."""
    design = load_design(Path(__file__).parent / f"{name}.toml")
    (cycle,) = cycles_of_play(design, friction=True)
    assert (cycle.inner_rad, cycle.frequency_hz) == pytest.approx((twist_rad, hertz), rel=0.03)
    assert confirm(design, cycle).verdict == "confirmed"


@pytest.mark.parametrize("slope", ["40 N*m/rad", "150 N*m/rad"])
def test_a_load_that_tips_over_within_the_play_makes_no_cycle_there(slope: str) -> None:
    """It goes away and does not turn back: that was a cycle of twenty minutes, and simulated for as long."""
    pushed = with_overrides(FIN, {"load.moment_slope": slope})
    (cycle,) = cycles_of_play(pushed, friction=False)
    assert cycle.stable
    assert confirm(pushed, cycle).ratio == pytest.approx(1.0, abs=0.1)


def test_no_cycle_is_found_where_there_is_none() -> None:
    """Friction quiets the fin; no play; the motor's counts are in the speed alone (model.md section 2)."""
    assert cycles_of_play(FIN, friction=True) == ()
    assert cycles_of_play(changed(FIN, coupling={"play_rad": 0.0}), friction=False) == ()
    assert cycles_of_quantisation(counting(4000, speed="ideal")) == ()


def test_a_count_makes_a_cycle_at_the_gain_border_of_the_loop() -> None:
    """A relay of one count has the gain 2 q/(pi A); in a clean drive without friction the cycle is there."""
    (cycle,), free = cycles_of_quantisation(FIN), describing.without_nonlinearities(FIN)
    margins = assemble_loops(free).break_points["output"]
    omega = 2 * pi * cycle.frequency_hz
    L = margins.open_loop(np.exp(1j * omega * margins.period_s))
    assert L.imag == pytest.approx(0.0, abs=1e-6)
    q = 2 * pi / 65536
    assert cycle.output_rad == pytest.approx(2 * q / pi * abs(L), rel=1e-6)  # 1/g = |L| there
    run = simulate(free, commands.hold(-0.5 * q), 4.0, limits_on=False)
    assert 0.5 * float(np.ptp(run.output_angle_rad[-5000:])) == pytest.approx(cycle.output_rad, rel=0.15)


def test_a_drive_with_too_much_gain_hunts_and_says_so(cli) -> None:
    changes = ["--set", "control.position.gain=300 1/s"]
    told = cli.data("cycles", "fin", *changes, status=1)
    assert any(one["hunting"] for one in told["settlings"])
    border = next(one for one in told["cycles"] if one["cycle"]["with_friction"])
    assert not border["cycle"]["stable"]
    assert border["ratio"] == pytest.approx(1.0, rel=0.15)


def test_section_and_refusal() -> None:
    made = section(limit_cycles(load_design("ballscrew")))
    words = (
        "The drive as it is comes to rest after every step; 0 of 1 predicted cycles confirmed, the simulation"
    )
    assert made["result"] == f"{words} decides."
    with pytest.raises(InputError, match="position loop"):
        limit_cycles(changed(FIN, controller={"position": None}))


@pytest.mark.parametrize(("ratio", "hertz", "verdict"), [
    (1.0, 10.0, "confirmed"),
    (1.2, 8.5, "confirmed"),
    (1.0, 20.0, "refuted"),
    (1.0, None, "refuted"),
    (1.8, 10.0, "refuted"),
    (None, None, "refuted"),
])  # fmt: skip
def test_confirmed_is_a_cycle_of_about_the_predicted_size_and_frequency(ratio, hertz, verdict) -> None:
    cycle = Cycle("play", False, 1e-3, 1e-3, 10.0, True, {})
    assert CycleResult(cycle, ratio, hertz).verdict == verdict


def test_a_cycle_of_an_hour_is_told_and_not_tried() -> None:
    """24 periods of 0.000433 Hz at 62.5 us from 41 sizes are 3.6e10 ticks."""
    joint = load_design("joint")
    checked = confirm(joint, Cycle("play", False, 1e-3, 1e-3, 4.33e-4, False, {}))
    assert checked.verdict == "not tried"
    made = str(section(LimitCycles(joint, (checked,), (), ("play",))))
    assert "'not tried'" in made
    assert "Not tried: 24 periods take more ticks" in made


@pytest.fixture
def watched(monkeypatch) -> list[float]:
    """Ticks that every batch of runs simulates, one after the other."""
    ticks, run = [0.0], Rows.run

    def counted(rows, *, drives, **more):
        before = sum(drive.value("TICK") for drive in drives)
        result = run(rows, drives=drives, **more)
        ticks.append(sum(drive.value("TICK") for drive in drives) - before)
        return result

    monkeypatch.setattr(Rows, "run", counted)
    return ticks


@pytest.mark.parametrize(("rubs", "hertz", "seconds"), [(False, 0.05, 41 * 2 * 20.0), (True, 0.025, 0.0)])
def test_a_cycle_that_is_nowhere_is_not_watched_for_24_periods(watched, rubs, hertz, seconds) -> None:
    """Nothing is set in motion: two periods at 41 sizes; held by friction the judge sees it at once."""
    still = Cycle("play", rubs, 1e-6, 1e-3, hertz, False, {"th": 0j, "twist": 0j})
    assert confirm(FIN, still).verdict == "refuted"
    assert sum(watched) == seconds / FIN.controller.period_s


def test_sizes_near_the_predicted_are_watched_first_and_nothing_twice(watched) -> None:
    """The fin's cycle is between the five sizes about it: two periods of all 41, 22 more of these."""
    _, attracting = cycles_of_play(FIN, friction=False)
    assert confirm(FIN, attracting).verdict == "confirmed"
    period = 1.0 / (attracting.frequency_hz * FIN.controller.period_s)
    assert sum(watched) <= (41 * 2 + 9 * 22) * period * 1.01


@pytest.mark.parametrize("inertia", [0.3, 0.6, 1.8])
def test_the_frequency_of_a_cycle_is_that_of_where_the_motion_ends(inertia: float) -> None:
    """A relay in the sensor: at first the joint still follows its start, of 0.3 and 1.8 kg m^2 2.5 times."""
    joint = load_design("joint").with_values({"load.inertia": inertia})
    (cycle, *_) = cycles_of_quantisation(joint)
    seen = confirm(joint, cycle)
    assert seen.frequency_hz == pytest.approx(cycle.frequency_hz, rel=0.02)
    assert seen.verdict == "confirmed"
