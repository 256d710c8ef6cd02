"""Probes: what they measure is the assembled loop, and what they add is what was asked for."""

import numpy as np
import pytest

from actuator_lti import assemble_loops, load_design
from actuator_lti.errors import InputError
from nonlinear import Probe, Reducers, Run, State, commands, simulate, simulate_many
from nonlinear.bench.probe import fractional_delay
from nonlinear.runs.reduced import whole_periods

CRUISE = 300.0
INJECTION = {"u": 0.02, "i_ref": 0.3, "w_ref": 10.0, "output": 1e-4}


@pytest.mark.parametrize("name", ["ilr33-amber", "ilr33-amber-multirate"])
@pytest.mark.parametrize("point", list(INJECTION))
@pytest.mark.parametrize("frequency_hz", [20.0, 150.0])
def test_open_loop_at_every_break_point(name: str, point: str, frequency_hz: float) -> None:
    design = load_design(name)
    control = design.controller
    if name.endswith("multirate"):
        frequency_hz = frequency_hz / 4
    frequency, ticks, cycles = whole_periods(frequency_hz, control.period_s, least_ticks=2000)
    ticks, cycles = 10 * ticks, 10 * cycles  # whole position periods
    moving = point != "output"  # a ramp has no steady phasor at the output: there, at rest without friction
    run = Run(
        design=design,
        command=commands.hold(),
        bias=commands.ramp(CRUISE / design.total_ratio) if moving else None,
        initial=State(
            motor_angle_rad=-CRUISE / control.position.gain,
            motor_speed_rad_s=CRUISE,
            speed_command_rad_s=CRUISE,
        )
        if moving
        else None,
        friction_on=moving,
        probes=(Probe(point=point, injection=commands.sine(INJECTION[point], frequency)),),
        duration_s=(2 * ticks + 10_000) * control.period_s,
        reducers=Reducers(window_ticks=ticks, cycles=cycles),
    )
    result = simulate_many([run])
    before, after = (f"probe_{point}_{side}" for side in ("before", "after"))
    measured = -result.phasor(before)[0] / result.phasor(after)[0]
    assert result.unsteadiness(before)[0] < 1e-6
    loop = assemble_loops(design).break_points[point]
    # a held signal sampled at its own updates: sums over ticks carry the same hold on both sides
    linear = complex(loop.open_loop(np.exp(2j * np.pi * frequency * loop.period_s)))
    assert measured == pytest.approx(linear, rel=2e-3 if name.endswith("multirate") else 1e-6)


def test_gain_and_delay_multiply_the_loop() -> None:
    design = load_design("ilr33-amber")
    u = np.sin(0.3 * np.arange(200.0)) * 0.1
    for delay, tolerance in ((3.0, 0.0), (2.4, 2e-6), (0.5, 2e-3)):
        probe = Probe(point="w_ref", gain=1.5, delay_samples=delay, injection=u)
        run = simulate(design, commands.sine(0.001, 20.0), 0.02, probes=[probe])
        k, seen = np.arange(200), run.probes["w_ref"]
        delayed = np.interp(k - delay, k, seen.before) if tolerance else seen.before[:-3]
        expected = 1.5 * delayed + (u if tolerance else u[3:])
        got = seen.after if tolerance else seen.after[3:]
        scale = np.abs(seen.before).max()
        assert np.abs(got - expected)[10:].max() <= (tolerance + 0.01 if tolerance else 1e-14) * scale
        assert np.array_equal(run.speed_command_rad_s, seen.after)


@pytest.mark.parametrize("delay", [0.3, 1.6, 2.5, 7.25])
def test_fractional_delay_has_the_phase_of_a_delay(delay: float) -> None:
    whole, taps = fractional_delay(delay)
    for wT in (0.01, 0.1, 0.3):
        response = np.sum(taps * np.exp(-1j * wT * (whole + np.arange(taps.size))))
        error = abs(response / np.exp(-1j * wT * delay) - 1.0)
        assert error < (wT / 2.0) ** taps.size * 2.0


def test_refusals() -> None:
    design = load_design("emps")
    with pytest.raises(InputError, match="no such stage"):
        simulate(design, commands.hold(), 0.1, probes=[Probe(point="i_ref")])
    with pytest.raises(InputError, match="one a point"):
        simulate(design, commands.hold(), 0.1, probes=[Probe(point="u"), Probe(point="u")])
    with pytest.raises(InputError, match="must be one of"):
        Probe(point="v")
    with pytest.raises(InputError, match="zero or more"):
        Probe(point="u", delay_samples=-1.0)
