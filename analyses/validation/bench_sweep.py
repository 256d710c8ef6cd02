"""What a frequency-response analyser on the bench would see: sines injected into each loop of the simulator.

A run begins in the steady state that its sine has, by the tangent, so that nothing is waited for; the
fundamentals are correlated over whole periods.  It judges nothing: the tangent does (`small_signal`).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil

import numpy as np
import numpy.typing as npt

from analyses.validation.places import Bench
from analyses.validation.small_signal import Place
from nonlinear.bench.loop_setup import LoopSetup

Floats = npt.NDArray[np.float64]
Complexes = npt.NDArray[np.complex128]
FREQUENCIES = 24
LOWEST, HIGHEST = 2e-3, 0.9  # of Nyquist
SAMPLES = 240  # of a run, about
SIZES = (1.0, 0.1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8)  # of a large signal: the first without an event


@dataclass(frozen=True)
class BenchSweep:
    """An injected sweep of one loop.

    Attributes
    ----------
    loop : str
    frequency_hz : ndarray, shape (K,)
    open_loop : ndarray of complex, shape (K,)
        Measured; NaN where every size met an event.
    linear : ndarray of complex, shape (K,)
    """

    loop: str
    frequency_hz: Floats
    open_loop: Complexes
    linear: Complexes


def bench_sweep(bench: Bench, place: Place) -> BenchSweep:
    """Sweep one loop of a stage."""
    setup, hold_s = bench.setup(place.name), place.tangent.hold_s
    turns = sorted({_turns(share) for share in np.geomspace(LOWEST, HIGHEST, FREQUENCIES)})
    angles = np.array([2.0 * np.pi * cycles / samples for cycles, samples in turns])
    found = np.full(angles.size, complex(np.nan, np.nan))
    for k, (_, samples) in enumerate(turns):
        for size in SIZES:
            back = _sine(setup, place, size, angles[k], samples)
            if back is not None:
                turn = np.exp(-1j * angles[k] * np.arange(samples))
                closed = 2.0 / samples * np.sum(back * turn)
                found[k] = closed / (1.0 - closed)
                break
    linear = bench.loop(place.name).plain_open(np.exp(1j * angles))
    return BenchSweep(place.name, angles / (2.0 * np.pi * hold_s), found, np.asarray(linear, complex))


def _turns(share: float) -> tuple[int, int]:
    """Whole cycles and samples of a run at about a share of Nyquist."""
    cycles = max(1, round(0.5 * share * SAMPLES))
    return cycles, ceil(2.0 * cycles / share)


def _sine(setup: LoopSetup, place: Place, part: float, angle: float, samples: int) -> Floats | None:
    """What comes back from a cosine of a part of a large signal, over its size; None after an event."""
    size = part * (setup.range if np.isfinite(setup.range) else 1.0)
    rows = setup.row()
    rows.sine(setup.point, size, angle / (2.0 * np.pi * place.tangent.hold_s), 0.5 * np.pi)
    drive, calm = rows.running(), setup.row().running()
    t = place.tangent
    updates = t.B.shape[1]
    turned = np.exp(1j * angle * updates) * np.eye(len(t.A)) - t.A
    held = np.exp(1j * angle * np.arange(updates))
    drive.s[t.places] += size * np.linalg.solve(turned, t.B @ held).real
    back, steady = (
        one.returned(one.advance(samples * setup.hold_ticks, setup.hold_ticks), setup.point)
        for one in (drive, calm)
    )
    return (steady - back) / size if drive.happened == calm.happened else None
