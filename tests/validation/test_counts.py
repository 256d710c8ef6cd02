"""What counts do: describing function by quadrature, cycles by loop poles and by simulation from rest."""

from dataclasses import replace
from functools import cache
from itertools import pairwise
from math import pi

import numpy as np
import pytest
from scipy.integrate import quad

from actuator_lti import assemble_loops, load_design
from actuator_lti.design.model import Design, Filter
from analyses.large_signal.tones import settling_ticks_of
from analyses.limit_cycles.counts import Counts, counted_gain, counts_of, linear_ratio
from analyses.limit_cycles.describing import cycles_of_quantisation, without_nonlinearities
from nonlinear import commands, simulate
from reports.sections.beyond import counts as section
from tests.validation.random_drives import full_drive

AMBER = load_design("ilr33-amber")


def counting(per_rev: int, **encoder: object) -> Design:
    return replace(AMBER, encoder=replace(AMBER.encoder, counts_per_rev=per_rev, **encoder))


FILTERED = {"speed": "difference", "difference_samples": 4, "filter_time_s": 1e-3}
TRACKING = {"speed": "tracking", "bandwidth_rad_s": 1500.0}


@cache
def of_difference(per_rev: int) -> Counts:
    design = counting(per_rev, speed="difference")
    loops = assemble_loops(design)
    settle = settling_ticks_of(loops.position.closed_loop, design.controller.position.every, design.name)
    (found,) = counts_of(design, loops, settle)
    return found


@pytest.mark.parametrize("ratio", [0.3, 0.9, 1.7, 4.2])
@pytest.mark.parametrize("offset", [0.0, 0.3, 0.5])
def test_gain_of_counts_by_quadrature(ratio: float, offset: float) -> None:
    """First harmonic of floor(A sin x - d) over A, edges at whole numbers plus d."""
    edges = [k + offset for k in range(-6, 7) if abs(k + offset) < ratio]
    breaks = sorted(x for e in edges for x in (np.arcsin(e / ratio), pi - np.arcsin(e / ratio)))
    breaks = [-pi / 2, *breaks, 3 * pi / 2]
    total = sum(
        quad(lambda x: np.floor(ratio * np.sin(x) - offset) * np.sin(x), a, b)[0]
        for a, b in pairwise(breaks)
        if b - a > 1e-9
    )
    assert counted_gain(ratio, offset) == pytest.approx(total / pi / ratio, abs=1e-7)


def test_beyond_the_linear_amplitude_the_gain_is_one_within_5_percent() -> None:
    ratios = np.linspace(linear_ratio(), 12.0, 150)
    offsets = np.linspace(0.0, 1.0, 11)
    assert max(abs(counted_gain(r, d) - 1.0) for r in ratios for d in offsets) <= 0.055
    below = np.linspace(0.85, 1.0, 60) * linear_ratio()
    assert max(abs(counted_gain(r, d) - 1.0) for r in below for d in offsets) > 0.045


@pytest.mark.parametrize("encoder", [FILTERED, TRACKING], ids=["difference", "tracking"])
def test_a_counted_speed_has_its_cycle_at_the_border(encoder: dict[str, object]) -> None:
    """The gain 2 q/(pi A) on the speed alone brings a pole of the closed loop to the unit circle."""
    design = counting(4000, **encoder)
    (cycle,) = cycles_of_quantisation(design)
    gain = 2.0 * design.angle_quantum_rad / (pi * cycle.inner_rad)
    free = without_nonlinearities(design)
    louder = Filter(kind="biquad", on="speed", b=(gain,), a=(0.0,))
    velocity = replace(free.controller.velocity, filters=(louder,))
    loop = assemble_loops(replace(free, controller=replace(free.controller, velocity=velocity))).position
    poles = loop.closed_loop.poles()
    pole = poles[np.argmin(np.abs(poles - np.exp(2j * pi * cycle.frequency_hz * loop.period_s)))]
    assert abs(pole) == pytest.approx(1.0, abs=1e-6)
    assert np.abs(poles).max() < 1.0 + 1e-6


@pytest.mark.parametrize("encoder", [FILTERED, TRACKING], ids=["difference", "tracking"])
def test_the_cycle_of_a_counted_speed_is_there_from_rest(encoder: dict[str, object]) -> None:
    """Without friction, pushed off the edge a little; size and frequency within a fifth (first harmonic)."""
    design = counting(4000, **encoder)
    (cycle,) = cycles_of_quantisation(design)
    q = design.angle_quantum_rad
    free = without_nonlinearities(design)
    run = simulate(free, commands.hold(-1e-3 * q / design.total_ratio), 2.0, limits_on=False)
    tail = run.motor_angle_rad[-6000:]
    tail = tail - tail.mean()
    crossings = np.flatnonzero((tail[:-1] < 0.0) & (tail[1:] >= 0.0))
    hertz = (crossings.size - 1) / ((crossings[-1] - crossings[0]) * design.controller.period_s)
    assert 0.5 * np.ptp(tail) == pytest.approx(cycle.inner_rad, rel=0.2)
    assert hertz == pytest.approx(cycle.frequency_hz, rel=0.2)


def test_an_angle_that_is_not_made_into_a_speed_has_no_cycle() -> None:
    """The motor's counts are seen in the speed alone (model.md section 2)."""
    assert cycles_of_quantisation(counting(4000, speed="ideal")) == ()


def test_steps_of_the_speed_and_scale() -> None:
    """q/(m T); with half the count everything in a drive without friction is half, the threshold too."""
    one, two = of_difference(1024), of_difference(2048)
    control = AMBER.controller
    step = 2.0 * pi / 1024 / (control.velocity.every * control.period_s)
    assert one.speed_step_rad_s == pytest.approx(step, rel=1e-12)
    assert two.speed_step_rad_s == pytest.approx(0.5 * step, rel=1e-12)
    assert two.linear_rad == pytest.approx(0.5 * one.linear_rad, rel=1e-12)
    np.testing.assert_allclose(two.off[1:4], one.off[1:4], rtol=0.05, atol=1e-3)
    assert two.cycles[0].cycle.inner_rad == pytest.approx(0.5 * one.cycles[0].cycle.inner_rad, rel=1e-9)


def test_below_the_linear_amplitude_the_simulator_is_off_and_beyond_it_is_not() -> None:
    found = of_difference(1024)
    assert found.off[0] > 0.3
    assert (found.off[2:] < 0.05).all()
    assert found.linear_seen_rad == pytest.approx(found.linear_rad)


def test_the_report_says_it_in_a_sentence() -> None:
    made = section([of_difference(1024)])
    assert "steps of 61.4 rad/s in the speed estimate" in made["result"]
    assert made["status"] == "info"


def test_a_drive_that_only_friction_holds_has_no_linear_amplitude() -> None:
    """Seed 40018: without friction its response grows without bound; NaN was compared with NaN."""
    design = full_drive(40018)
    found = counts_of(design, assemble_loops(design), 9020)
    assert all(np.isinf(one.off).all() and one.linear_seen_rad is None for one in found)
