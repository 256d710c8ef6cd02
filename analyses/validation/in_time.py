"""Linear predictions shown in time: one small step, and runs beside each margin that grow or die out.

The step is injected at the place on the operating motion; the simulated answer is held against the linear one
at every sample.  Beside a gain margin K the drive is started on the critical mode of its own tangent, at
K (1 - BESIDE) and K (1 + BESIDE): with v the mode and w its left eigenvector, ``w^H (s - s_calm)`` is
multiplied by the predicted eigenvalue in every period, exactly.  No window is searched, nothing waited for.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import ceil, log
from typing import Any

import numpy as np
import numpy.typing as npt

from actuator_lti.errors import NumericalError
from actuator_lti.plain_system import PlainSystem
from actuator_lti.resolvent import balanced
from analyses.validation.places import Bench
from analyses.validation.row import Row, judged
from analyses.validation.small_signal import RESOLVED, SURE, WITHIN
from nonlinear import Tangent, tangent
from nonlinear.differences import RETURNED
from nonlinear.loop_setup import LoopSetup
from nonlinear.stepper import Stepper

Floats = npt.NDArray[np.float64]
Complexes = npt.NDArray[np.complex128]
Numbers = npt.NDArray[Any]
MOST_SAMPLES = 4000  # of a step
SETTLINGS = 1.2  # of the settling time that a step is shown for
BESIDE = 0.01  # of a margin
CHANGE = 3.0  # times which a run beside a margin grows or shrinks
LONGEST, SHORTEST = 5000, 50  # periods of such a run
SIZES = 10.0 ** -np.arange(0.0, 13.0)  # of a large signal
LOST = 100.0  # times the best agreement


@dataclass(frozen=True)
class StepShown:
    """A small step at a place, simulated and linear, of height 1.

    Attributes
    ----------
    place : str
    time_s, simulated, linear : ndarray, shape (m,)
    row : Row
    """

    place: str
    time_s: Floats
    simulated: Floats
    linear: Floats
    row: Row


@dataclass(frozen=True)
class MarginShown:
    """Two runs beside a gain margin: amplitude of the critical mode over time, from 1.

    Attributes
    ----------
    place : str
    ratio, frequency_hz : float
        The margin.
    inside, outside : tuple of (time_s, amplitude)
    rows : tuple of Row
    """

    place: str
    ratio: float
    frequency_hz: float
    inside: tuple[Floats, Floats]
    outside: tuple[Floats, Floats]
    rows: tuple[Row, Row]


def step_shown(bench: Bench, name: str) -> StepShown | None:
    """One small step of a stable loop; None where its figures have no step, or no run begins steady."""
    figures = bench.figures[name]
    if figures.step is None or not bench.setup(name).steady_start:
        return None
    setup, closed = bench.setup(name), figures.loop.plain_closed
    samples = int(min(max(SETTLINGS * figures.step.settling_time_s / closed.dt, 20.0), MOST_SAMPLES))
    linear = _linear_step(closed, samples)
    simulated, own = _agreed(lambda size: _run_step(setup, size, samples))
    largest = float(np.max(np.abs(linear)))
    off = np.abs(simulated - linear) / largest
    k = int(np.argmax(off))
    allowed = max(WITHIN, SURE * own / largest)
    row = judged(
        "step", name, 0.0, float(off[k]), allowed, unit="1", condition=setup.condition,
        because=f"largest difference at {1e3 * k * closed.dt:.3g} ms, of {samples} samples",
        resolved=allowed <= RESOLVED,
    )  # fmt: skip
    time_s = closed.dt * np.arange(samples)
    return StepShown(name, time_s, simulated, linear, replace(row, predicted=None, found=None))


def _linear_step(closed: PlainSystem, samples: int) -> Floats:
    """Unit step response at its samples."""
    x, out = np.zeros(len(closed.A)), np.empty(samples)
    for k in range(samples):
        out[k] = float(closed.C[0] @ x + closed.D[0, 0])
        x = closed.A @ x + closed.B[:, 0]
    return out


def _agreed(run: Callable[[float], Numbers | None]) -> tuple[Numbers, float]:
    """The run by the size where two successive ones agree best, and what they differ in, largest size first.

    Once rounding has taken a hundred times that, sizes are too small to be felt.
    """
    last: Numbers | None = None
    best: tuple[Numbers, float] | None = None
    for size in SIZES:
        now = run(float(size))
        if now is not None and last is not None:
            off = float(np.max(np.abs(now - last)))
            if best is None or off < best[1]:
                best = (last, off)
            elif off > LOST * best[1]:
                break
        last = now
    if best is None:
        raise NumericalError("every step ends in an event: no operating motion without one")
    return best


def _run_step(setup: LoopSetup, part: float, samples: int) -> Floats | None:
    """What comes back from a step of a part of a large signal, over its size; None after an event."""
    size = part * (setup.range if np.isfinite(setup.range) else 1.0)
    runs, flags = [], []
    for height in (size, 0.0):
        rows = setup.row()
        rows.step(setup.point, height, -1.0)
        drive = Stepper(rows)
        back = np.empty(samples)
        for k in range(samples):
            drive.run(setup.hold_ticks)
            back[k] = drive.s[RETURNED[setup.point]]
        runs.append(back)
        flags.append(drive.happened)
    return None if flags != [(0.0, 0.0)] * 2 else np.asarray((runs[1] - runs[0]) / size, float)


def margin_shown(bench: Bench, name: str) -> MarginShown | None:
    """Runs on either side of the quoted gain margin of a stable loop; None as for a step."""
    figures = bench.figures[name]
    margin = figures.margins.gain_margin
    if margin is None or not 0.0 < margin.ratio < np.inf or not bench.setup(name).steady_start:
        return None
    outward = 1.0 + BESIDE if margin.ratio > 1.0 else 1.0 / (1.0 + BESIDE)
    runs = [_beside(bench, name, margin.ratio * x, margin.frequency_rad_s) for x in (1.0 / outward, outward)]
    rows = [
        judged(
            f"{side}_the_margin", name, 1.0, found, max(WITHIN, own), unit="1",
            because=f"{20.0 * log(gain, 10):.4g} dB: predicted to {'die out' if rate < 1.0 else 'grow'} "
            f"{abs(size[-1]):.4g} times in {time_s[-1]:.3g} s; found over predicted",
            condition=bench.setup(name).condition, resolved=own <= RESOLVED,
        )
        for side, (gain, rate, found, own, time_s, size) in zip(("inside", "outside"), runs, strict=True)
    ]  # fmt: skip
    (inside, outside) = [(run[4], run[5]) for run in runs]
    hertz = margin.frequency_rad_s / (2.0 * np.pi)
    return MarginShown(name, margin.ratio, hertz, inside, outside, (rows[0], rows[1]))


def _beside(
    bench: Bench, name: str, gain: float, w: float
) -> tuple[float, float, float, float, Floats, Floats]:
    """A run at a gain: gain, predicted factor a period, found over predicted, its own error, course."""
    setup = replace(bench.setup(name), gain=gain)
    found = tangent(bench.drive, name, setup=setup)
    predicted = _closed_pole(bench.loop(name).plain_open, gain, np.exp(1j * w * found.hold_s))
    left, right, _ = _mode(found.A, predicted)
    rate = abs(predicted)
    periods = int(np.clip(ceil(log(CHANGE) / max(abs(log(rate)), 1e-9)), SHORTEST, LONGEST))
    wanted = predicted ** np.arange(periods + 1)

    def course(size: float) -> Complexes | None:
        return _course(setup, found, left, right, size, periods)

    seen, own = _agreed(course)
    course_off = float(np.abs(seen[-1]) / np.abs(wanted[-1]))
    time_s: Floats = found.period_s * np.arange(periods + 1.0)
    blur = SURE * (own / float(np.abs(wanted[-1])) + found.stated_error)
    return gain, rate, course_off, blur, time_s, seen.real


def _closed_pole(system: PlainSystem, gain: float, z: complex) -> complex:
    """The closed-loop pole of a linear loop at a gain, nearest to z, by Newton's method."""
    for _ in range(50):
        step = 1e-7 * abs(z)
        value, beside = (1.0 + gain * complex(system(each)) for each in (z, z + step))
        move = value * step / (beside - value)
        z -= move
        if abs(move) < 1e-15 * abs(z):
            break
    return complex(z)


def _mode(A: Floats, pole: complex) -> tuple[Complexes, Complexes, complex]:
    """Left and right eigenvector of the eigenvalue nearest to a pole, their product 1."""
    from scipy.linalg import eig

    even, scale = balanced(A)
    values, left, right = eig(even, left=True)
    k = int(np.argmin(np.abs(values - pole)))
    w, v = left[:, k].conj() / scale, right[:, k] * scale
    return w / (w @ v), v, complex(values[k])


def _course(
    setup: LoopSetup, found: Tangent, left: Complexes, right: Complexes, part: float, periods: int
) -> Complexes | None:
    """Amplitude of a mode over a run that starts on it, over the first; None after an event.

    The signal at the place begins with a part of what would be a large one.
    """
    rows = setup.row()
    drive, calm = Stepper(rows), Stepper(rows)
    shown = float(np.max(np.abs(found.C @ right)))
    if shown == 0.0:
        raise NumericalError("the critical mode does not show at the place")
    size = part * (setup.range if np.isfinite(setup.range) else 1.0) / shown
    drive.s[found.places] += size * right.real
    seen = np.empty(periods + 1, complex)
    for k in range(periods + 1):
        seen[k] = left @ (drive.s[found.places] - calm.s[found.places])
        drive.run(setup.base_ticks)
        calm.run(setup.base_ticks)
    calm_still = drive.happened == calm.happened == (0.0, 0.0)
    return np.asarray(seen / seen[0], complex) if calm_still and seen[0] != 0.0 else None
