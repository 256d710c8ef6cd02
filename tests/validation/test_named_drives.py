"""The drives that the validator once failed on: a heavy linear axis, ticks of 1 us, a load with a slope."""

from __future__ import annotations

from dataclasses import replace

from small_settings import SMALL

from actuator_lti import load_design
from actuator_lti.design.model import Design
from actuator_lti.loops import assemble_loops
from analyses.isolation import isolated
from analyses.validation import validate
from analyses.validation.response import linear_response
from analyses.validation.result import Validation
from analyses.validation.sweep import settling_ticks_of, stepped_sine
from nonlinear.loop_setup import loop_setup

FEW = replace(SMALL, frequencies=8, rest_frequencies=4)


def checked(design: Design) -> Validation:
    with isolated() as missing:
        found = validate(design, FEW)
    assert not missing
    assert found.failed == ()
    return found


def judged(found: Validation) -> set[tuple[str, str]]:
    return {(row.loop, row.quantity) for row in found.ledger if row.passed}


def test_an_axis_of_119_kg() -> None:
    """The gain margin was predicted as 32 dB and found as 1.2 dB: a slow mode was taken for growth."""
    design = load_design("ballscrew")
    found = checked(replace(design, load=replace(design.load, inertia_kgm2=119.0)))
    assert {("velocity", "gain_margin_up"), ("position", "gain_margin_up")} <= judged(found)


def test_a_load_with_a_slope() -> None:
    """It took 520 s."""
    design = load_design("ilr33-amber")
    load = replace(design.load, path="back-drivable", moment_slope_Nm_rad=-0.5)
    found = checked(replace(design, load=load))
    wanted = {("position", "gain_margin_up"), ("position", "bandwidth"), ("velocity", "bandwidth")}
    assert wanted <= judged(found)


def test_ticks_of_a_microsecond() -> None:
    """The loop whose ticks are the finest for its speed: margins and response, not the whole validation."""
    design = load_design("ilr33-amber")
    control = replace(design.controller, period_s=1e-6, computing_delay_s=1e-6)
    design = replace(design, controller=control)
    loops = assemble_loops(design)
    loop = loops.present["velocity"]
    settle = settling_ticks_of(loop.closed_loop, 1, design.name)
    assert settle > 10_000
    sweep = stepped_sine(loop_setup(design, "velocity"), [100.0, 1000.0, 10_000.0], settle)
    assert sweep.reason == ("", "", "")
    off = abs(sweep.open_loop / linear_response(loop.open_loop, sweep.frequency_hz) - 1.0)
    assert off.max() < 1e-4
