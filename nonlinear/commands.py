"""What the drive is asked to do: angles of the output shaft against time.

Every command begins at zero before its start time, takes amplitudes in rad at the output shaft (m on a
linear axis) and is sampled at the ticks.  The same objects serve as bias motion and, with the unit of the
break point, as the injected signal of a `Probe`.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from math import pi
from operator import length_hint
from os import PathLike

import numpy as np
import numpy.typing as npt

from actuator_lti.bounds import SIGNAL_ROWS, TONE_TICKS, TONES, Bound
from actuator_lti.errors import InputError, finite_number, positive_number, shown, whole_number
from actuator_lti.start.public_arguments import guard
from actuator_lti.systems.root import root
from actuator_lti.types import Floats, number_array
from nonlinear._kernels import layout as at
from nonlinear.native import fill

__all__ = [
    "Command",
    "chirp",
    "hold",
    "multisine",
    "ramp",
    "recorded",
    "sampled",
    "sine",
    "step",
    "stepped_sine",
    "triangle",
]

LEAST_SPECTRUM = 16  # samples from which on a spectrum is looked at
_ROWS = 1 << 16  # samples that are summed at a time
UNEVEN = 1.5  # times the usual interval: a longer one is a hole


@dataclass(frozen=True)
class Command:
    """A signal of time; built by the functions of this module."""

    kind: str  # name of that function
    code: int  # kind as the kernel knows it
    numbers: tuple[float, ...]  # amplitude, start time and what the kind needs (see ``_kernels.signals``)
    highest_hz: float = 0.0  # highest frequency asked for, 0 where that has no meaning
    end_s: float = float("inf")  # when it is over, inf where it goes on
    # Times (s) and values of a tabulated command, shape (2, m), zero before the first of them
    samples: Floats | None = None
    held: bool = False  # whether each tabulated value holds until the next; else linear between them

    def later(self, start_s: float) -> Command:
        """A tabulated command that begins at ``start_s``, and is zero before.

        Raises `InputError`: for a start before zero or not finite, or a command that has a start of its own.

        >>> sampled([0.0, 0.001, 0.002], [1.0, 2.0, 3.0]).later(0.001).values(1e-3, 4).tolist()
        [0.0, 1.0, 2.0, 3.0]
        """
        _finite(self.kind, start_s=start_s)
        if start_s < 0.0:
            raise InputError(f"command {self.kind}: start_s = {start_s:g}: must be 0 or later")
        if self.samples is None:
            raise InputError(f"command {self.kind}: its start is an argument of its own")
        samples = self.samples + np.array([[start_s], [0.0]])
        return replace(self, samples=samples, end_s=self.end_s + start_s)

    def highest_content(self, nyquist_hz: float) -> float:
        """Largest line of a tabulated command above a frequency, as a part of its range."""
        # of the samples put on an even grid, without their straight line, under a Hann window
        if self.samples is None or self.samples.shape[1] < LEAST_SPECTRUM:
            return 0.0
        times, values = self.samples
        even = np.linspace(times[0], times[-1], times.size)
        above = np.fft.rfftfreq(even.size, even[1] - even[0]) > nyquist_hz
        if not above.any():  # of samples at the ticks no line is
            return 0.0
        y = np.interp(even, times, values / (np.abs(values).max() or 1.0))
        y = y - np.linspace(y[0], y[-1], y.size)
        if (size := float(np.ptp(y))) == 0.0:
            return 0.0
        lines = 4.0 * np.abs(np.fft.rfft(y * np.hanning(y.size))) / y.size
        return float(lines[above].max()) / (0.5 * size)

    def table(self, period_s: float, ticks: int) -> Floats | None:
        """Values at the ticks of a tabulated command, linear between its points; ``None`` for the others."""
        if self.samples is None:
            return None
        times, values = self.samples
        count = min(ticks, int(np.ceil(min(times[-1] / period_s, 1e18) - 1e-9)) + 1)
        SIGNAL_ROWS.check(count)
        at_ticks = np.arange(max(count, 1)) * period_s
        if not self.held:
            return np.interp(at_ticks, times, values, left=0.0)
        which = np.searchsorted(times, at_ticks * (1.0 + 1e-12) + 1e-9 * period_s, side="right") - 1
        return np.where(which < 0, 0.0, values[which])

    def values(self, period_s: float, ticks: int) -> Floats:
        """Value at each of the first ``ticks`` ticks, as the simulator sees it."""
        _positive("values", period_s=period_s)
        SIGNAL_ROWS.check(whole_number("ticks", ticks, 0))
        row, table = np.zeros(at.SIGNAL_SIZE), self.table(period_s, ticks)
        write(self, row, 0, 0, 0 if table is None else table.size)
        out = np.empty(ticks)
        fill(row, np.zeros(1) if table is None else np.ascontiguousarray(table), period_s, out)
        return out


def write(command: Command, row: Floats, place: int, offset: int, length: int) -> None:
    """Write a command into a parameter row; ``offset`` and ``length`` locate its table, if it has one."""
    numbers = (1.0, 0.0, offset, length) if command.code == at.TABLE else command.numbers
    row[place] = command.code
    row[place + 1 : place + 1 + len(numbers)] = numbers


def _finite(kind: str, **values: float) -> None:
    for name, value in values.items():
        finite_number(f"command {kind}: {name}", value)


def _positive(kind: str, **values: float) -> None:
    for name, value in values.items():
        positive_number(f"command {kind}: {name}", value)


def numbers_of(name: str, given: npt.ArrayLike) -> Floats:
    """An argument that is a number or a series of them, as one row; counted before it is laid out."""
    _count(given, SIGNAL_ROWS, name)
    try:
        if isinstance(given, Sequence) and len(given) and isinstance(given[0], range):
            raise TypeError
        return number_array(given).ravel()
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"{name} = {shown(given)}: must be numbers, in SI") from None


def _count(given: object, bound: Bound, name: str = "") -> None:
    """Refuse what says that it is longer than a bound."""
    count = float("inf")
    with suppress(OverflowError):
        count = length_hint(given)
    bound.check(count, name=name)


def _frequencies(kind: str, given: Sequence[float], period_s: float) -> Floats:
    """Positive frequencies that samples can hold, at least one and not too many."""
    _count(given, TONES)
    f = numbers_of(f"command {kind}: frequencies_hz", given)
    TONES.check(f.size)
    for one in f:
        _positive(kind, frequencies_hz=float(one))
    if not f.size:
        raise InputError(f"command {kind}: at least one frequency needed")
    if f.max() * period_s >= 0.5:
        message = f"command {kind}: {f.max():g} Hz: must be below the Nyquist frequency"
        raise InputError(f"{message} of its table, {0.5 / period_s:g} Hz")
    return f


def hold(angle_rad: float = 0.0) -> Command:
    """Hold an angle from the first tick on (zero: stand still)."""
    _finite("hold", angle_rad=angle_rad)
    return Command("hold", at.STEP, (angle_rad, -1.0))


def step(amplitude_rad: float, start_s: float = 0.0) -> Command:
    """Step of the output angle at ``start_s``.

    Examples
    --------
    >>> step(0.1, start_s=0.002).values(1e-3, 4).tolist()
    [0.0, 0.0, 0.1, 0.1]
    """
    _finite("step", amplitude_rad=amplitude_rad, start_s=start_s)
    return Command("step", at.STEP, (amplitude_rad, start_s))


def ramp(rate_rad_s: float, start_s: float = 0.0, stop_s: float = float("inf")) -> Command:
    """Constant speed of the output from ``start_s`` to ``stop_s``, held afterwards."""
    _finite("ramp", rate_rad_s=rate_rad_s, start_s=start_s)
    if stop_s != float("inf"):
        _finite("ramp", stop_s=stop_s)
    if not stop_s > start_s:
        raise InputError(f"command ramp: stop_s = {stop_s}: must be later than start_s = {start_s}")
    return Command("ramp", at.RAMP, (rate_rad_s, start_s, stop_s - start_s))


def sine(amplitude_rad: float, frequency_hz: float, phase_rad: float = 0.0, start_s: float = 0.0) -> Command:
    """``amplitude sin(2 pi f (t - start) + phase)``, peak amplitude at the output shaft."""
    _finite("sine", amplitude_rad=amplitude_rad, phase_rad=phase_rad, start_s=start_s)
    _positive("sine", frequency_hz=frequency_hz)
    return Command("sine", at.SINE, (amplitude_rad, start_s, frequency_hz, phase_rad), frequency_hz)


def triangle(amplitude_rad: float, frequency_hz: float, start_s: float = 0.0) -> Command:
    """Triangle of peak ``amplitude_rad`` that starts at zero, rising."""
    _finite("triangle", amplitude_rad=amplitude_rad, start_s=start_s)
    _positive("triangle", frequency_hz=frequency_hz)
    return Command("triangle", at.TRIANGLE, (amplitude_rad, start_s, frequency_hz, 0.0), frequency_hz)


def chirp(
    amplitude_rad: float,
    from_hz: float,
    to_hz: float,
    span_s: float,
    *,
    logarithmic: bool = True,
    start_s: float = 0.0,
) -> Command:
    """Sine whose frequency runs over ``span_s``, exponentially where ``logarithmic``; it stays there then."""
    _finite("chirp", amplitude_rad=amplitude_rad, start_s=start_s)
    _positive("chirp", from_hz=from_hz, to_hz=to_hz, span_s=span_s)
    code = at.LOG_CHIRP if logarithmic else at.CHIRP
    numbers = (amplitude_rad, start_s, from_hz, to_hz, span_s)
    return Command("chirp", code, numbers, max(from_hz, to_hz), start_s + span_s)


def stepped_sine(
    amplitude_rad: float,
    frequencies_hz: Sequence[float],
    cycles: int,
    period_s: float,
    *,
    settle_cycles: int = 2,
) -> Command:
    """Sines one after another, ``settle_cycles + cycles`` whole periods each, joined without a jump.

    ``period_s`` is the tick of the drive; the table is exact at the ticks.
    """
    _finite("stepped_sine", amplitude_rad=amplitude_rad)
    _positive("stepped_sine", period_s=period_s)
    f = _frequencies("stepped_sine", frequencies_hz, period_s)
    whole_number("command stepped_sine: cycles", cycles)
    whole_number("command stepped_sine: settle_cycles", settle_cycles, 0)
    SIGNAL_ROWS.check(cycles + settle_cycles)
    slowest = float(f.min()) * period_s
    SIGNAL_ROWS.check((cycles + settle_cycles) / slowest if slowest else np.inf)
    ends = np.cumsum((cycles + settle_cycles) / f)
    SIGNAL_ROWS.check(float(ends[-1]) / period_s)
    t = np.arange(int(np.ceil(ends[-1] / period_s)) + 1) * period_s
    which = np.minimum(np.searchsorted(ends, t, side="right"), f.size - 1)
    begins = np.concatenate(([0.0], ends[:-1]))[which]
    values = amplitude_rad * np.sin(2.0 * pi * f[which] * (t - begins))
    values[t >= ends[-1]] = 0.0
    return Command("stepped_sine", at.TABLE, (), float(f.max()), float(ends[-1]), np.vstack([t, values]))


def multisine(
    amplitude_rad: float,
    frequencies_hz: Sequence[float],
    duration_s: float,
    period_s: float,
    *,
    seed: int = 0,
) -> Command:
    """Sum of equal sines with random phases from ``seed``, scaled to the peak ``amplitude_rad``.

    Every frequency is moved to the next whole number of periods in ``duration_s``, so that the signal is
    periodic in it; all are turned together so that it begins at zero, rising. It is sent once: after
    ``duration_s`` the command is 0.

    Raises `InputError`: for a frequency of less than one period in the duration, or two that fall together.
    """
    _finite("multisine", amplitude_rad=amplitude_rad)
    _positive("multisine", duration_s=duration_s, period_s=period_s)
    wanted = _frequencies("multisine", frequencies_hz, period_s)
    SIGNAL_ROWS.check(duration_s / period_s)
    TONE_TICKS.check(wanted.size * duration_s / period_s)
    whole_number("command multisine: seed", seed, 0)
    periods = np.rint(wanted * duration_s)
    if periods.min() < 1.0:
        message = f"command multisine: {wanted.min():g} Hz: less than one period in {duration_s:g} s"
        raise InputError(f"{message}; a longer duration or a higher frequency is needed")
    if np.unique(periods).size < periods.size:
        message = f"command multisine: two frequencies of {periods.size} have the same number of periods"
        raise InputError(f"{message} in {duration_s:g} s; fewer of them or a longer duration is needed")
    f = periods / duration_s
    phases = np.random.default_rng(seed).uniform(0.0, 2.0 * pi, f.size)
    phases += 2.0 * pi * f * _first_rise(f, phases, duration_s)
    t: Floats = np.arange(round(duration_s / period_s) + 1, dtype=np.float64) * period_s
    values = np.concatenate([_summed(f, phases, part) for part in np.array_split(t, t.size // _ROWS + 1)])
    values *= amplitude_rad / np.abs(values).max()
    return _table("multisine", t, values, float(f.max()))


def _summed(frequency_hz: Floats, phases: Floats, t: Floats) -> Floats:
    total = np.zeros(t.size)
    for frequency, phase in zip(frequency_hz, phases, strict=True):
        total += np.sin(2.0 * pi * frequency * t + phase)
    return total


def _first_rise(frequency_hz: Floats, phases: Floats, duration_s: float) -> float:
    """A time at which a sum of sines passes zero, rising: looked for block by block."""
    count = 8 * int(np.ceil(frequency_hz.max() * duration_s))
    for first in range(0, count, _ROWS):
        t = np.arange(first, min(first + _ROWS, count) + 1, dtype=np.float64) * (duration_s / count)
        seen = _summed(frequency_hz, phases, t)
        rises = np.flatnonzero((seen[:-1] < 0.0) & (seen[1:] >= 0.0))
        if rises.size:
            low, high = t[rises[0] : rises[0] + 2]
            return root(
                lambda x: _summed(frequency_hz, phases, np.array([x]))[0], low, high, 1e-15 * duration_s
            )
    raise AssertionError("a sum of sines without a mean rises somewhere in its period")


def events(time_s: npt.ArrayLike, angle_rad: npt.ArrayLike, where: str = "event log") -> Command:
    """A log of changes: each value holds from its time until the next; times may be uneven.

    Raises `InputError`: as `sampled`, but for holes.

    >>> events([0.0, 0.002, 0.0021], [1.0, 2.0, 3.0]).values(1e-3, 4).tolist()
    [1.0, 1.0, 2.0, 3.0]
    """
    times, values = _checked(time_s, angle_rad, where)
    return _table("recorded", times - times[0], values, held=True)


def sampled(time_s: npt.ArrayLike, angle_rad: npt.ArrayLike, where: str = "record") -> Command:
    """Recorded command: angles at times, linear between them, the last held.

    Raises `InputError`: if times or angles are not finite, do not rise, or have a hole: a gap longer than 1.5
    times the median interval.
    """
    times, values = _checked(time_s, angle_rad, where)
    _without_holes(times, where)
    return _table("recorded", times - times[0], values)


def on_its_clock(time_s: npt.ArrayLike, values: npt.ArrayLike, where: str = "series") -> Command:
    """A series whose times count from the beginning of the run; zero before its first row.

    >>> on_its_clock([0.002, 0.003], [5.0, 7.0]).values(1e-3, 5).tolist()
    [0.0, 0.0, 5.0, 7.0, 7.0]
    """
    times, array = _checked(time_s, values, where, "value")
    _without_holes(times, where)
    if times[-1] < 0.0:
        raise InputError(f"its last row is at {times[-1]:g} s: must be 0 or later", where)
    return _table("series", times, array)


def _table(
    kind: str, times: Floats, values: Floats, highest_hz: float = 0.0, *, held: bool = False
) -> Command:
    """A tabulated command that is over with its last row."""
    return Command(kind, at.TABLE, (), highest_hz, float(times[-1]), np.vstack([times, values]), held)


def _checked(
    time_s: npt.ArrayLike, given: npt.ArrayLike, where: str, what: str = "angle"
) -> tuple[Floats, Floats]:
    """Rising finite times and as many finite values."""
    times, values = numbers_of("times", time_s), numbers_of(f"{what}s", given)
    if times.size != values.size or times.size < 2:
        message = f"{times.size} times and {values.size} {what}s: equal numbers, at least 2, needed"
        raise InputError(message, where)
    for name, array in (("time", times), (what, values)):
        bad = np.flatnonzero(~np.isfinite(array))
        if bad.size:
            raise InputError(f"{name} in row {bad[0] + 1} = {array[bad[0]]}: must be finite", where)
    gaps = np.diff(times)
    if (gaps <= 0.0).any():
        k = int(np.argmax(gaps <= 0.0))
        message = f"time in row {k + 2} = {times[k + 1]:g} s: must be later than {times[k]:g} s"
        raise InputError(message, where)
    return times, values


def _without_holes(times: Floats, where: str) -> None:
    gaps = np.diff(times)
    usual = float(np.median(gaps))
    if gaps.max() > UNEVEN * usual:
        k = int(np.argmax(gaps))
        hole = f"hole in time from {times[k]:g} s to {times[k + 1]:g} s (rows {k + 1}, {k + 2})"
        allowed = f"intervals up to {UNEVEN:g} times the usual {usual:g} s are allowed"
        raise InputError(f"{hole}: {allowed}, or a log of changes that are held (--held)", where)


def recorded(
    path: str | PathLike[str], *, time_column: str | int = 0, angle_column: str | int = 1, unit: str = "deg",
    delimiter: str = ",", held: bool = False,
) -> Command:  # fmt: skip
    """Recorded command from a CSV file with a header line: times in s, values in deg, rad, mm or m,
    one of these per second, A or V: what the drive's outermost stage takes.

    ``held``: a log of changes, each value held until the next (`events`).
    """
    from nonlinear.runs.records import read_columns

    angle = {"deg": pi / 180.0, "rad": 1.0, "mm": 1e-3, "m": 1.0}.get(unit.removesuffix("/s"))
    scale = 1.0 if unit in ("A", "V") else angle
    if scale is None:
        message = f"unit = {unit!r}: must be deg, rad, mm, m, these per second, A or V"
        raise InputError(message, where=str(path))
    times, angles = read_columns(path, (time_column, angle_column), delimiter)
    return (events if held else sampled)(times, angles * scale, where=str(path))


guard(__name__)
