"""Limit cycles of play and quantisation: describing functions by quadrature, cycles by simulation."""

from dataclasses import replace
from math import asin, pi

import numpy as np
import pytest
from scipy.integrate import quad

from actuator_lti.design import load_design, with_overrides
from actuator_lti.design.model import Design
from actuator_lti.drive.operating import dead_zone
from actuator_lti.errors import InputError
from actuator_lti.loops import assemble_loops
from analyses.limit_cycles import limit_cycles
from analyses.limit_cycles.describing import cycles_of_play, cycles_of_quantisation, without_nonlinearities
from analyses.limit_cycles.run import confirm
from nonlinear import commands, simulate
from reports.sections.cycles import section


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
    border, attracting = cycles_of_play(load_design("fin"), friction=False)
    assert (border.stable, attracting.stable) == (False, True)
    for cycle in (border, attracting):
        seen = confirm(load_design("fin"), cycle)
        assert seen.ratio == pytest.approx(1.0, abs=0.1)
    assert seen.frequency_hz == pytest.approx(attracting.frequency_hz, rel=0.1)


def test_friction_quiets_the_fin() -> None:
    assert cycles_of_play(load_design("fin"), friction=True) == ()


def test_without_play_there_is_no_cycle_of_it() -> None:
    design = load_design("fin")
    assert (
        cycles_of_play(replace(design, coupling=replace(design.coupling, play_rad=0.0)), friction=False) == ()
    )


def test_amplitudes_go_with_the_play() -> None:
    """Without friction a drive with twice the play has twice the cycle, at the same frequency."""
    wide = with_overrides(load_design("fin"), {"coupling.play": "3 mrad"})
    pairs = zip(
        cycles_of_play(load_design("fin"), friction=False), cycles_of_play(wide, friction=False), strict=True
    )
    for one, two in pairs:
        assert two.output_rad == pytest.approx(2.0 * one.output_rad, rel=1e-6)
        assert two.frequency_hz == pytest.approx(one.frequency_hz, rel=1e-6)


def test_a_count_makes_a_cycle_at_the_gain_border_of_the_loop() -> None:
    """A relay of one count has the gain 2 q/(pi A); in a clean drive without friction the cycle is there."""
    design = load_design("fin")
    (cycle,) = cycles_of_quantisation(design)
    margins = assemble_loops(without_nonlinearities(design)).break_points["output"]
    omega = 2 * pi * cycle.frequency_hz
    L = margins.open_loop(np.exp(1j * omega * margins.period_s))
    assert L.imag == pytest.approx(0.0, abs=1e-6)
    q = 2 * pi / 65536
    assert cycle.output_rad == pytest.approx(2 * q / pi * abs(L), rel=1e-6)  # 1/g = |L| there
    free = without_nonlinearities(design)
    run = simulate(free, commands.hold(-0.5 * q), 4.0, limits_on=False)
    tail = run.output_angle_rad[-5000:]
    seen = 0.5 * float(np.ptp(tail))
    assert seen == pytest.approx(cycle.output_rad, rel=0.15)


def test_a_drive_with_too_much_gain_hunts_and_says_so(cli) -> None:
    changes = ["--set", "control.position.gain=300 1/s"]
    told = cli.data("cycles", "fin", *changes, status=1)
    assert any(one["hunting"] for one in told["rests"])
    border = next(one for one in told["confirmations"] if one["cycle"]["with_friction"])
    assert not border["cycle"]["stable"]
    assert border["ratio"] == pytest.approx(1.0, rel=0.15)


def test_section_and_refusal() -> None:
    made = section(limit_cycles(load_design("ballscrew")))
    assert (
        made["result"]
        == "The drive as it is comes to rest after every step; 0 of 1 predicted cycles confirmed."
    )
    design: Design = load_design("fin")
    with pytest.raises(InputError, match="position loop"):
        limit_cycles(replace(design, controller=replace(design.controller, position=None)))
