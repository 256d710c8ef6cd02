"""Commands that are held, of a small motor whose truth is an integration of its own, noise in its loops."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from actuator_lti.design import read_design_text, with_values
from actuator_lti.design.model import Design
from analyses.correlation.between_ticks import signals_at
from analyses.correlation.closed_loop import as_driven
from analyses.correlation.driving import command_of, readings
from analyses.identification import held_command
from analyses.identification.asked import Settings
from analyses.identification.bench import BenchResult, identify_bench
from analyses.records.holds import hold_of
from analyses.records.record import Record
from nonlinear import commands, simulate
from tests.identification.bench_records import errors_off, record_of
from tests.identification.test_voltage_equation import RATIO, STEPS, TEXT, TICK_S, Small, driven

EVERY = 10
OHM, HENRY, BACK, INERTIA, DRY, VISCOUS = 34.5, 8.6e-3, 0.018, 6.35e-8, 3.6e-4, 1.26e-7
OF_CURRENT, CURRENT_S, OF_SPEED, SPEED_S = 21.6, 2.5e-4, 8.9e-4, 0.016
LOOPS = (OF_CURRENT, CURRENT_S, OF_SPEED, SPEED_S, 50.0)
DRIVE = Small(OHM, HENRY, BACK, INERTIA, DRY, VISCOUS, LOOPS)
TRUTH = {"resistance": OHM, "back_emf": BACK, "inertia": INERTIA, "dry": DRY, "viscous": VISCOUS}
CHANGES = {
    "motor.resistance": 1.05 * OHM, "motor.inductance": 0.6 * HENRY, "motor.rotor_inertia": 0.95 * INERTIA,
    "motor.back_emf_constant": 1.09 * BACK, "motor.torque_constant": 1.09 * BACK,
    "load.inertia": 0.1 * INERTIA * RATIO**2, "friction.dry_torque": DRY / 1.2,
    "friction.viscous": VISCOUS / 1.2, "limits.speed": 800.0, "limits.peak_current": 0.4,
    "limits.voltage": 24.0, "control.current.gain": OF_CURRENT, "control.current.integral_time": CURRENT_S,
    "control.velocity.gain": OF_SPEED, "control.velocity.integral_time": SPEED_S,
}  # fmt: skip


def _design() -> Design:
    return with_values(read_design_text(TEXT), CHANGES)


def _record(
    hold: int, noise: float, seed: int, every: float = EVERY, late: int = 0, rows: int = 2000
) -> Record:
    """A row of every tenth tick; noise in the loops, in shares of 600 rad/s and 150 mA.

    ``every``: ticks from row to row, in quarters; ``late``: quarters of a tick before the first.
    """
    rng, time = np.random.default_rng(seed), np.arange(int(rows * every) + 1) * TICK_S
    waves = [(4.4, 5.1, 3.5), (8.8, 5.1, 3.5), (40.4, 0.5, 3.5), (48.4, 2.75, 3.5)]
    command = sum(size * (np.sin(rate * time + at) - np.sin(at)) for rate, at, size in waves) / RATIO
    command = (command * np.clip(time / 0.3, 0.0, 1.0))[np.arange(len(time)) // hold * hold]
    on = noise * rng.standard_normal((len(time), 2)) * [600.0, 0.15]
    at = late + int(every * STEPS) * np.arange(rows)
    speed, current, voltage, angle = driven(DRIVE, RATIO * command, on)[at].T
    motion = {"reference": command[at // STEPS], "angle": angle, "speed": speed}
    return record_of(TICK_S * every * np.arange(rows), "held", **motion, current=current, voltage=voltage)


def _is_found(result: BenchResult, near: float) -> None:
    """All within 3.5 of their standard errors, and those of R, kE and J small beside the values."""
    assert result.passed
    for fit in (result.electrical, result.model):
        assert errors_off(fit, TRUTH) < 3.5
        for name in {"resistance", "back_emf", "inertia"} & set(fit.names):
            assert fit.std(name) < near * TRUTH[name]


@pytest.mark.parametrize("noise", [0.02, 0.03])
def test_noise_in_the_loops_leaves_the_motor_within_its_intervals(noise: float) -> None:
    """The step of the command was moved by a tick within the search, against an inductance that went to zero.

    Resistance was off by 10 %, 5 standard errors, and nothing said so.
    """
    result = identify_bench(_design(), [_record(10, noise, 1)], settings=Settings(electrical=True))
    assert result.model.records[0].used["reference"] == "command of the simulated drive, held between samples"
    _is_found(result, 0.04)


@pytest.mark.parametrize(
    ("hold", "every", "late", "clock"), [(13, 10, 0, 1.0), (7, 3.25, 3, 1.0), (7, 3.25, 1, 1.0003)]
)
def test_a_hold_of_no_whole_rows_is_told_by_the_rows_that_show_its_jumps(
    hold: int, every: float, late: int, clock: float
) -> None:
    """Rows of 10 ticks under a hold of 13; of 3.25 ticks, between the ticks; and of a tick 0.03 % off."""
    record = _record(hold, 0.01, 1, every=every, late=late)
    design = with_values(_design(), {"control.period": TICK_S / clock})
    _is_found(identify_bench(design, [record], settings=Settings(electrical=True)), 0.02)


def test_rows_that_were_moved_too_far_go_back(monkeypatch: pytest.MonkeyPatch) -> None:
    """A quick winding bends what a time between the ticks does: each step went past, and back, to the end.

    What was found hung on the last of them (20 us under 500 us: inductance +120 %, 8 standard errors, met):
    a search ends where the records are likeliest of all that it has seen.
    """
    rows_at, seen = held_command._at_its_rows, list[float]()

    def too_far(design, part, sizes, *args):
        moved, told, errors = rows_at(design, part, sizes, *args)
        seen.append(float(np.sum(np.log(sizes))))
        more = np.asarray(moved.early_s) - np.asarray(part.early_s)
        return replace(moved, early_s=np.asarray(part.early_s) + 3.0 * more), told, 3.0 * errors

    monkeypatch.setattr(held_command, "_at_its_rows", too_far)
    part = as_driven(_design(), _record(7, 0.01, 1, every=3.25, late=3, rows=1000))
    search = held_command._Search(_design(), ("motor.resistance", "motor.rotor_inertia"))
    found = search.likeliest([part], np.ones(2), _design())
    assert len(seen) > 2
    assert float(np.sum(np.log(found.sizes))) <= min(seen)


@pytest.mark.parametrize("seed", range(40))
def test_jumps_tell_when_a_command_is_held(seed: int) -> None:
    """The grid that made the jumps, of clocks that are locked and are not, of jumps that some holds lack."""
    rng, tick, rows = np.random.default_rng(seed), 1e-4, 3000
    ticks, clock = int(rng.integers(3, 60)), 1.0 + (seed % 2) * rng.uniform(-5e-4, 5e-4)
    period = ticks * tick * clock
    row = tick * (rng.integers(max(ticks // 4, 1), ticks) + (seed % 4 > 1) * rng.uniform(0.1, 0.9))
    row = min(row, 0.9 * period)
    first, count = rng.uniform(0.1, 1.0) * row, int(rows * row / period) - 1
    numbers = np.flatnonzero(rng.uniform(size=count) < 0.7)
    jumps = first + numbers * period
    hold = hold_of(np.ceil(jumps / row - 1e-9).astype(int), rows, row, tick)
    assert hold is not None
    assert hold.ticks == ticks
    assert hold.ticks * hold.tick_s == pytest.approx(period, abs=2.0 * row / np.ptp(numbers))
    early = np.ceil(jumps / row - 1e-9) * row - jumps
    for end in (hold.earliest_s, hold.latest_s):
        assert hold.early_s(end) == pytest.approx(early, abs=row)


def test_jumps_at_any_time_are_on_no_grid() -> None:
    """Of 300 draws at most one is taken for a hold (chance of 1 in 1000 each)."""
    rng = np.random.default_rng(1)
    drawn = (np.flatnonzero(rng.uniform(size=2000) < 0.3) + 1 for _ in range(300))
    assert sum(hold_of(jumps, 2000, 1e-3, 1e-4) is not None for jumps in drawn) <= 1


def test_a_square_wave_tells_no_hold() -> None:
    """Its jumps are as far apart as those before: they lie on every grid that divides the distance.

    One of 101 ticks was read, of a tick 0.016 % off, and no jump at a tick of the drive: an inductance of
    20 us under 500 us was found 12.5 times itself, by 7 standard errors, and met. Where all are as far
    apart, a clock that is off explains them or a wave: each of its jumps at a tick is tried as well.
    """
    edges = np.concatenate([[201], np.ceil(909.09 * np.arange(1, 9))])
    assert hold_of(np.ceil(edges / 2.0).astype(int), 4000, 1e-3, 5e-4) is None
    wave = 0.01 * (np.floor(np.arange(0, 8000, EVERY) / 909.09) % 2)
    record = record_of(TICK_S * EVERY * np.arange(800), "square", reference=wave)
    own = command_of(_design(), record)
    assert [one.hold is None for one in readings(own, record)] == [False, True]


def test_a_run_is_known_between_its_ticks() -> None:
    """The same voltage in ticks a sixteenth as long: its ticks are between those of the other."""
    volts, coarse = np.random.default_rng(4).uniform(4.0, 12.0, 200), 16
    design = with_values(_design(), {"control.computing_delay": 0.5 * TICK_S})
    bare = replace(design, controller=replace(design.controller, position=None, velocity=None, current=None))
    fine = with_values(bare, {"control.period": TICK_S / coarse})
    ticks = np.arange(len(volts)) * TICK_S
    run = simulate(bare, commands.events(ticks, volts), ticks[-1])
    other = simulate(fine, commands.events(ticks, volts), ticks[-1])
    part = slice(coarse, -2 * coarse)
    seen = signals_at(bare, run, other.time_s[part], 0.0)
    truth = {"angle": other.motor_angle_rad, "speed": other.motor_speed_rad_s, "current": other.current_A}
    for name, values in truth.items():
        assert seen[name] == pytest.approx(values[part], abs=1e-11 * np.ptp(values)), name
    assert np.array_equal(seen["voltage"], np.repeat(volts[1:], coarse)[: len(seen["voltage"])])


SPINDLE = """design = { name = "spindle" }
limits = { voltage = "300 V", peak_current = "30 A" }
friction = { dry_torque = "0.2 N*m", viscous = "1 mN*m*s/rad" }
load = { path = "back-drivable" }
encoder = { speed = "ideal" }
[motor]
resistance = "0.8 ohm"
inductance = "2 mH"
torque_constant = "0.3 N*m/A"
back_emf_constant = "0.3 V*s/rad"
rotor_inertia = "15 kg*cm^2"
[control]
period = "0.1 ms"
computing_delay = "0.1 ms"
current = { gain = "5 V/A", integral_time = "2.5 ms" }
velocity = { gain = "1.2 A*s/rad", integral_time = "30 ms", every = 2 }
"""


@pytest.mark.parametrize("filter_s", [1e-3, 4e-3])
def test_a_speed_behind_a_filter_is_late_and_no_command_held(filter_s: float) -> None:
    """A row every 2 ms: a command held for as long would be late by 1 ms, and the current with it."""
    design, rng = read_design_text(SPINDLE), np.random.default_rng(1)
    run = simulate(design, commands.multisine(100.0, [0.5, 1.5, 4.0], 6.0, 1e-4, seed=2), 6.0)
    keep = filter_s / (1e-4 + filter_s)
    speed = lfilter([1.0 - keep], [1.0, -keep], run.motor_speed_rad_s)[::20]
    noise = {
        "speed": 0.1 * rng.standard_normal(len(speed)),
        "current": 0.02 * rng.standard_normal(len(speed)),
    }
    seen = {"speed": speed + noise["speed"], "current": run.current_A[::20] + noise["current"]}
    record = record_of(run.time_s[::20], output_speed_reference=run.reference_rad[::20], **seen)
    result = identify_bench(design, [record])
    truth = {"inertia": 15e-4, "viscous": 1e-3, "dry": 0.2}
    assert result.passed
    assert errors_off(result.model, truth) < 4.0
