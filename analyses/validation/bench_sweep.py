"""What a frequency-response analyser on the bench would see: sines injected into each loop of the simulator.

A run begins in the steady state that its sine has, by the tangent, so that nothing is waited for; the
fundamentals are correlated over whole periods.  It judges nothing: the tangent does (`small_signal`).
"""

from dataclasses import dataclass
from math import ceil

import numpy as np

from actuator_lti.types import Complexes, Floats
from analyses.validation.places import Bench
from analyses.validation.small_signal import Place
from nonlinear.bench.loop_setup import LoopSetup
from nonlinear.runs.running import Running

FREQUENCIES = 24
LOWEST, HIGHEST = 2e-3, 0.9  # of Nyquist
SAMPLES = 240  # of a run, about
SIZES = (1.0, 0.1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8)  # of a large signal


@dataclass(frozen=True)
class BenchSweep:
    """An injected sweep of one loop.

    ``frequency_hz``, shape (K,).
    ``open_loop``, shape (K,): measured; NaN where every size met an event.
    ``linear``, shape (K,).
    """

    loop: str
    frequency_hz: Floats
    open_loop: Complexes
    linear: Complexes


def bench_sweep(bench: Bench, place: Place) -> BenchSweep:
    """Sweep one loop of a stage."""
    setup, hold_s = bench.setup(place.name), place.tangent.hold_s
    shares = np.geomspace(LOWEST, HIGHEST, FREQUENCIES)
    turns = sorted({_turns(share) for share in shares}, key=lambda turn: turn[0] / turn[1])
    angles = np.array([2.0 * np.pi * cycles / samples for cycles, samples in turns])
    found = [_found(setup, place, angle, samples) for angle, (_, samples) in zip(angles, turns, strict=True)]
    linear = bench.loop(place.name).plain_open(np.exp(1j * angles))
    return BenchSweep(
        place.name, angles / (2.0 * np.pi * hold_s), np.array(found), np.asarray(linear, complex)
    )


def _found(setup: LoopSetup, place: Place, angle: float, samples: int) -> complex:
    """The open loop, from the size of sine that the next smaller one confirms best.

    What bends smoothly (a smoothed friction, a torque over the angle) shows in a large sine without any
    event, rounding in a small one: from size to size the answer changes least where neither does.
    """
    best, change, last = complex(np.nan, np.nan), np.inf, None
    run = _Sines(setup, place, angle, samples)
    turn = np.exp(-1j * angle * np.arange(samples))
    for size in SIZES:
        back = run.returned(size)
        if back is None:
            continue
        closed = 2.0 / samples * np.sum(back * turn)
        now = closed / (1.0 - closed)
        if last is None:
            best = now
        elif abs(now - last) >= change:
            break
        else:
            best, change = last, abs(now - last)
        last = now
    return best


def _turns(share: float) -> tuple[int, int]:
    """Whole cycles and samples of a run at about a share of Nyquist."""
    cycles = max(1, round(0.5 * share * SAMPLES))
    return cycles, ceil(2.0 * cycles / share)


class _Sines:
    """Cosines of one frequency and several sizes, and the run without one that they are told from."""

    def __init__(self, setup: LoopSetup, place: Place, angle: float, samples: int) -> None:
        self.setup, self.tangent, self.samples, self.rows = setup, place.tangent, samples, setup.rows()
        self.frequency_hz = angle / (2.0 * np.pi * place.tangent.hold_s)
        self.calm = self.rows.running()
        self.steady = self._advanced(self.calm)
        t = place.tangent
        updates = t.B.shape[1]
        turned = np.exp(1j * angle * updates) * np.eye(len(t.A)) - t.A
        held = np.exp(1j * angle * np.arange(updates))
        self.begin = np.linalg.solve(turned, t.B @ held).real  # of a cosine of size 1

    def _advanced(self, drive: Running) -> Floats:
        hold = self.setup.hold_ticks
        return drive.returned(drive.advance(self.samples * hold, hold), self.setup.point)

    def returned(self, part: float) -> Floats | None:
        """What comes back from a cosine of a part of a large signal, over its size; None after an event."""
        size = part * (self.setup.range if np.isfinite(self.setup.range) else 1.0)
        rows = self.rows.copy()
        rows.sine(self.setup.point, size, self.frequency_hz, 0.5 * np.pi)
        drive = rows.running()
        drive.s[self.tangent.places] += size * self.begin
        back = self._advanced(drive)
        return (self.steady - back) / size if drive.happened == self.calm.happened else None
