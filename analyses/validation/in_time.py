"""Linear predictions shown in time: one small step, runs beside each margin, sines injected into each loop.

Beside a gain margin K the drive is started on the critical mode of its own tangent, at K (1 -+ BESIDE): with
v the mode and w its left eigenvector, ``w^H (s - s_calm)`` is multiplied by the predicted eigenvalue in every
period, exactly. A sine begins in its steady state by the tangent, its fundamentals correlated over whole
periods.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import ceil, log
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.linalg import eig

from actuator_lti.errors import NumericalError
from actuator_lti.loops.commanded import sampled_step
from actuator_lti.systems.resolvent import balanced
from actuator_lti.types import Complexes, Floats
from analyses.validation.places import Bench
from analyses.validation.row import WITHIN, Row, judged
from analyses.validation.small_signal import RESOLVED, SURE, Place, nearest_pole
from nonlinear import Rows
from nonlinear.bench.injection import RETURNED
from nonlinear.bench.loop_setup import LoopSetup
from nonlinear.bench.probe import Probe

Numbers = npt.NDArray[Any]
MOST_SAMPLES = 4000  # of a step
SETTLINGS = 1.2  # of the settling time that a step is shown for
BESIDE = 0.01  # of a margin
CHANGE = 3.0  # times which a run beside a margin grows or shrinks
LONGEST, SHORTEST = 5000, 50  # periods of such a run; as many are shown
SIZES = 10.0 ** -np.arange(1.0, 14.0)  # of a large signal


@dataclass(frozen=True)
class StepShown:
    """A small step at a place, simulated and linear, of height 1; shape (m,)."""

    place: str
    time_s: Floats
    simulated: Floats
    linear: Floats
    row: Row


@dataclass(frozen=True)
class MarginRun:
    """A run beside a gain margin, started on its critical mode."""

    gain: float  # factor on the loop gain
    factor: float  # what the mode is predicted to be multiplied by over the run
    found: float  # over predicted
    error: float  # of what was found, by what two sizes of the run differ in and the tangent's stated error
    time_s: Floats
    amplitude: Floats  # of the mode, from 1


@dataclass(frozen=True)
class MarginShown:
    """Two runs beside a gain margin of ``ratio`` at ``frequency_hz``."""

    place: str
    ratio: float
    frequency_hz: float
    inside: MarginRun
    outside: MarginRun
    rows: tuple[Row, Row]


def step_shown(bench: Bench, name: str) -> StepShown | None:
    """One small step of a stable loop; None where its figures have no step, or no run begins steady."""
    figures = bench.figures[name]
    if figures.step is None or not bench.setup(name).steady_start:
        return None
    setup, closed = bench.setup(name), figures.loop.plain_closed
    samples = int(min(max(SETTLINGS * figures.step.settling_time_s / closed.dt, 20.0), MOST_SAMPLES))
    linear = np.asarray(sampled_step(closed, samples), dtype=float)
    largest = float(np.max(np.abs(linear)))

    def stepped(size: float) -> Floats | None:
        """What comes back, negated, from a step at the place; None after an event."""
        rows = setup.rows()
        rows.step(setup.point, size, -1.0)
        drive = rows.running()
        piece = drive.advance(samples * setup.hold_ticks, setup.hold_ticks)
        return -drive.returned(piece, setup.point) if drive.happened == (0.0, 0.0) else None

    simulated, own = agreed(stepped, setup, WITHIN / SURE * largest)
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


def agreed(run: Callable[[float], Numbers | None], setup: LoopSetup, enough: float) -> tuple[Numbers, float]:
    """What a run by its size comes to, over that of none, and what two successive sizes differ in.

    The largest size of which two agree well enough, else where they agree best; none ends in an event.
    """
    calm, large = run(0.0), setup.range if np.isfinite(setup.range) else 1.0
    last: Numbers | None = None
    best: tuple[Numbers, float] | None = None
    for size in large * SIZES:
        motion = run(size)
        now = None
        if motion is not None and calm is not None and (motion != calm).any():  # else lost in rounding
            now = (motion - calm) / size
        if now is not None and last is not None:
            off = float(np.max(np.abs(now - last)))
            if best is None or off < best[1]:
                best = (last, off)
            if off <= enough:
                break
        last = now
    if best is None:
        raise NumericalError("every run ends in an event: no operating motion without one")
    return best


def margin_shown(bench: Bench, place: Place) -> MarginShown | None:
    """Runs on either side of the quoted gain margin of a stable loop; None as for a step."""
    name, margin = place.name, bench.figures[place.name].margins.gain_margin
    if margin is None or not 0.0 < margin.ratio < np.inf or not bench.setup(name).steady_start:
        return None
    w, outward = margin.frequency_rad_s, 1.0 + BESIDE if margin.ratio > 1.0 else 1.0 / (1.0 + BESIDE)
    inside, outside = (_beside(bench, place, margin.ratio * x, w) for x in (1.0 / outward, outward))
    rows = [
        judged(
            f"{side}_the_margin", name, 1.0, run.found, max(WITHIN, run.error), unit="1",
            because=f"{20.0 * log(run.gain, 10):.4g} dB: predicted to become {run.factor:.4g} of what it was "
            f"in {run.time_s[-1]:.3g} s; found over predicted",
            condition=bench.setup(name).condition,
            resolved=run.error <= RESOLVED * abs(log(run.factor)) / BESIDE,  # of the margin
        )
        for side, run in (("inside", inside), ("outside", outside))
    ]  # fmt: skip
    return MarginShown(name, margin.ratio, w / (2.0 * np.pi), inside, outside, (rows[0], rows[1]))


def _beside(bench: Bench, place: Place, gain: float, w: float) -> MarginRun:
    """A run at a gain; the signal at the place begins with a part of what would be a large one."""
    setup, t, plain = bench.setup(place.name), place.tangent, bench.loop(place.name).plain_open
    closed = plain.A - gain / (1.0 + gain * plain.D[0, 0]) * plain.B @ plain.C
    predicted = nearest_pole(closed, np.exp(1j * w * t.hold_s))
    left, right = _mode(t.at_gain(gain), predicted)
    rate = float(abs(predicted))
    periods = int(np.clip(ceil(log(CHANGE) / max(abs(log(rate)), 1e-9)), SHORTEST, LONGEST))
    stride = ceil(periods / SHORTEST)
    count = periods // stride
    returned = float(np.max(np.abs(t.C @ right)))
    if returned == 0.0:
        raise NumericalError("the critical mode does not show at the place")
    begins = complex(left @ right.real) / returned
    rows = _at_gain(setup, gain)

    def motion(size: float) -> Complexes | None:
        drive = rows.running()
        drive.s[t.places] += size / returned * right.real
        seen = []
        for _ in range(count):
            drive.run(stride * setup.base_ticks)
            seen.append(left @ drive.s[t.places])
        return np.array(seen) if drive.happened == (0.0, 0.0) else None

    last = rate ** (count * stride)
    seen, own = agreed(motion, setup, WITHIN / SURE**2 * abs(begins) * last)
    amplitude = np.abs(np.concatenate([[1.0], seen / begins]))
    error = SURE * (own / abs(begins) / last + t.stated_error)
    time_s: Floats = stride * t.period_s * np.arange(count + 1.0)
    return MarginRun(gain, last, float(amplitude[-1]) / last, error, time_s, amplitude)


def _at_gain(setup: LoopSetup, gain: float) -> Rows:
    """The loop with its gain multiplied at the place, on the same operating motion."""
    rows = setup.rows()
    calm = rows.running()
    calm.run(1)
    rows.probe(Probe(point=setup.point, gain=gain))  # type: ignore[arg-type]
    rows.step(setup.point, (1.0 - gain) * calm.s[RETURNED[setup.point]], -1.0)
    return rows


def _mode(A: Floats, pole: complex) -> tuple[Complexes, Complexes]:
    """Left and right eigenvector of the eigenvalue nearest to a pole, their product 1."""
    even, scale = balanced(A)
    values, left, right = eig(even, left=True)
    k = int(np.argmin(np.abs(values - pole)))
    w, v = left[:, k].conj() / scale, right[:, k] * scale
    return w / (w @ v), v


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
    setup, hold_s = bench.setup(place.name), place.tangent.hold_s
    shares = np.geomspace(LOWEST, HIGHEST, FREQUENCIES).tolist()
    whole = [(max(1, round(0.5 * share * SAMPLES)), share) for share in shares]  # cycles of a run
    turns = sorted({(n, ceil(2.0 * n / share)) for n, share in whole}, key=lambda turn: turn[0] / turn[1])
    angles = np.array([2.0 * np.pi * cycles / samples for cycles, samples in turns])
    found = [_found(setup, place, angle, samples) for angle, (_, samples) in zip(angles, turns, strict=True)]
    linear = np.asarray(bench.loop(place.name).plain_open(np.exp(1j * angles)), complex)
    return BenchSweep(place.name, angles / (2.0 * np.pi * hold_s), np.array(found), linear)


def _found(setup: LoopSetup, place: Place, angle: float, samples: int) -> complex:
    """The open loop at an angle a sample, by a cosine."""
    t, rows = place.tangent, setup.rows()
    turn, updates = np.exp(1j * angle * np.arange(samples)), t.B.shape[1]
    around = np.exp(1j * angle * updates) * np.eye(len(t.A)) - t.A
    begin = np.linalg.solve(around, t.B @ np.exp(1j * angle * np.arange(updates))).real

    def motion(size: float) -> Complexes | None:
        rows.sine(setup.point, size, angle / (2.0 * np.pi * t.hold_s), 0.5 * np.pi)
        drive = rows.running()
        drive.s[t.places] += size * begin
        back = drive.returned(drive.advance(samples * setup.hold_ticks, setup.hold_ticks), setup.point)
        return -2.0 / samples * (back @ turn.conj())[None] if drive.happened == (0.0, 0.0) else None

    size = abs(complex(t.closed(np.exp(1j * angle))))
    try:
        closed = complex(agreed(motion, setup, WITHIN / SURE**2 * size)[0][0])
    except NumericalError:
        return complex(np.nan, np.nan)
    return closed / (1.0 - closed)
