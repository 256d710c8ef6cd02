"""What a frequency-response analyser on the bench would see: sines injected into each loop of the simulator.

A run begins in the steady state that its sine has, by the tangent, so that nothing is waited for; the
fundamentals are correlated over whole periods.  It judges nothing: the tangent does (`small_signal`).
"""

from dataclasses import dataclass
from math import ceil

import numpy as np

from actuator_lti.errors import NumericalError
from actuator_lti.types import Complexes, Floats
from analyses.validation.in_time import agreed
from analyses.validation.places import Bench
from analyses.validation.row import WITHIN
from analyses.validation.small_signal import SURE, Place
from nonlinear.bench.loop_setup import LoopSetup

FREQUENCIES = 24
LOWEST, HIGHEST = 2e-3, 0.9  # of Nyquist
SAMPLES = 240  # of a run, about


@dataclass(frozen=True)
class BenchSweep:
    """An injected sweep of one loop at K frequencies."""

    loop: str
    frequency_hz: Floats
    open_loop: Complexes  # measured; NaN where every size met an event
    linear: Complexes


def bench_sweep(bench: Bench, place: Place) -> BenchSweep:
    """Sweep one loop of a stage."""
    setup, hold_s = bench.setup(place.name), place.tangent.hold_s
    shares = np.geomspace(LOWEST, HIGHEST, FREQUENCIES)
    turns = sorted({_turns(share) for share in shares}, key=lambda turn: turn[0] / turn[1])
    angles = np.array([2.0 * np.pi * cycles / samples for cycles, samples in turns])
    found = [_found(setup, place, angle, samples) for angle, (_, samples) in zip(angles, turns, strict=True)]
    linear = np.asarray(bench.loop(place.name).plain_open(np.exp(1j * angles)), complex)
    return BenchSweep(place.name, angles / (2.0 * np.pi * hold_s), np.array(found), linear)


def _turns(share: float) -> tuple[int, int]:
    """Whole cycles and samples of a run at about a share of Nyquist."""
    cycles = max(1, round(0.5 * share * SAMPLES))
    return cycles, ceil(2.0 * cycles / share)


def _found(setup: LoopSetup, place: Place, angle: float, samples: int) -> complex:
    """The open loop at an angle a sample, by a cosine."""
    t, rows = place.tangent, setup.rows()
    turn, updates = np.exp(1j * angle * np.arange(samples)), t.B.shape[1]
    around = np.exp(1j * angle * updates) * np.eye(len(t.A)) - t.A
    begin = np.linalg.solve(around, t.B @ np.exp(1j * angle * np.arange(updates))).real

    def course(size: float) -> Complexes | None:
        rows.sine(setup.point, size, angle / (2.0 * np.pi * t.hold_s), 0.5 * np.pi)
        drive = rows.running()
        drive.s[t.places] += size * begin
        back = drive.returned(drive.advance(samples * setup.hold_ticks, setup.hold_ticks), setup.point)
        return -2.0 / samples * (back @ turn.conj())[None] if drive.happened == (0.0, 0.0) else None

    size = abs(complex(t.closed(np.exp(1j * angle))))
    try:
        closed = complex(agreed(course, setup, WITHIN / SURE**2 * size)[0][0])
    except NumericalError:
        return complex(np.nan, np.nan)
    return closed / (1.0 - closed)
