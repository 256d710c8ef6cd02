"""Waiting that costs no work: a drive whose state changes evenly is set forward to what happens next.

Under constant inputs every period of the outermost stage applies one map to the state.  The map is affine
as long as no event happens; where it is so at two states it is so on the line between them, as every guard is
linear there.  So where two windows of `DRIFT` periods add the same to the state, as an integral that grows
while friction holds the drive does, the last state before an event is found by bisection.  The memory of the
overload protection, ``x += a ((i/i_cont)^2 - x)`` a tick, is followed in closed form.
"""

from math import log, log1p

import numpy as np
import numpy.typing as npt

from actuator_lti.types import Floats
from nonlinear._kernels import elastic_layout as ES
from nonlinear._kernels import layout as at
from nonlinear.runs.running import Piece, Running

Places = npt.NDArray[np.intp]
DRIFT, CHECKED, EVEN = 64, 16, 1e-4  # periods of a window, of a look ahead; how alike two changes are
STILL = 2.0**-30  # of the largest value: a change in a window that counts
MOST_LEAPS = int(1.0 / STILL)  # windows until what changes by `STILL` in each has changed by its own size
_ANGLES = [at.S_ANGLE, at.S_OUTPUT]
_MODES = (at.S_DIRECTION, ES.ES_SEGMENT, ES.ES_LOAD, ES.ES_CONTACT, ES.ES_BEND)  # they follow from the rest
_SPEED, _CURRENT, _VOLTAGE, _CURRENT_COMMAND, _SPEED_COMMAND = 2, 3, 4, 5, 6
_AS_LARGE = (  # states that are as large as a signal, or rounded as coarsely
    ([at.S_SPEED, at.S_MEASURED_SPEED, at.S_FILTERED_SPEED, at.S_TRACKED_SPEED], _SPEED),
    ([*range(at.S_SPEED_CHAIN, at.S_TORQUE_CHAIN)], _SPEED),
    ([at.S_CURRENT], _CURRENT),
    ([at.S_HELD, at.S_VOLTAGE, at.S_VOLTAGE_BEFORE, at.S_CURRENT_INTEGRATOR], _VOLTAGE),
    ([at.S_CURRENT_REFERENCE, at.S_CURRENT_BEFORE, at.S_VELOCITY_INTEGRATOR], _CURRENT_COMMAND),
    ([*range(at.S_TORQUE_CHAIN, at.S_PROBE_PLACES)], _CURRENT_COMMAND),
    ([at.S_SPEED_COMMAND, at.S_SPEED_REFERENCE, at.S_POSITION_INTEGRATOR], _SPEED_COMMAND),
)
_STATES = np.array([state for states, _ in _AS_LARGE for state in states])
_SIGNALS = np.array([signal for states, signal in _AS_LARGE for _ in states])


def stays_overloaded(drive: Running) -> bool:
    """Whether the overload memory, on its way to what the current makes of it, stays where it limits."""
    p, s = drive.p, drive.s
    if s[at.S_OVERLOADED] == 0.0:
        return False
    reached = (s[at.S_CURRENT] / p[at.CONTINUOUS_CURRENT]) ** 2
    return bool(min(reached, s[at.S_OVERLOAD]) >= p[at.OVERLOAD_RELEASE])


def ticks_until_it_acts(p: Floats, s: Floats) -> int:
    """Ticks after which the memory under this current trips or lets go; 0 where it does not get there."""
    # the distance to (i/i_cont)^2 falls by 1 - a a tick
    level = p[at.OVERLOAD_RELEASE] if s[at.S_OVERLOADED] > 0.0 else 1.0
    reached = (s[at.S_CURRENT] / p[at.CONTINUOUS_CURRENT]) ** 2
    way, left = reached - s[at.S_OVERLOAD], reached - level
    if way * left <= 0.0 or abs(left) >= abs(way):
        return 0
    return int(log(left / way) / log1p(-p[at.OVERLOAD_RATE]))


def overload(p: Floats, s: Floats, current_A: float, ticks: int) -> float:
    """The memory after ticks in which the current grows evenly from that of ``s``."""
    if ticks == 0:
        return float(s[at.S_OVERLOAD])
    a, size = p[at.OVERLOAD_RATE], p[at.CONTINUOUS_CURRENT]
    start, slope = s[at.S_CURRENT] / size, (current_A - s[at.S_CURRENT]) / (ticks * size)
    C, B = slope**2, 2.0 * slope * (start - slope / a)
    A = start**2 - (B + C) / a
    return float(A + B * ticks + C * ticks**2 + (1.0 - a) ** ticks * (s[at.S_OVERLOAD] - A))


class Scales:
    """Largest values so far: ``signals`` of each column of a piece, ``states`` of each of the state."""

    def __init__(self, drive: Running, window_s: float) -> None:
        self.signals, self.states = np.zeros(at.HISTORY_PROBES), np.abs(drive.s)
        self._p, self._window_s = drive.p, window_s

    def take(self, drive: Running, piece: Piece) -> None:
        signals, states = self.signals, self.states
        np.maximum(states, np.abs(drive.s), out=states)
        np.maximum(signals, np.abs(piece.columns[: at.HISTORY_PROBES]).max(axis=1), out=signals)
        if self._p[at.HAS_POSITION] > 0.0:
            self._by_angle()
        states[at.S_TRACKED_ERROR] = states[at.S_ANGLE]  # a difference of angles
        states[at.S_OVERLOAD_REST] = states[at.S_OVERLOAD]
        states[_STATES] = np.maximum(states[_STATES], signals[_SIGNALS])
        queue = slice(at.S_QUEUE, at.S_QUEUE + int(self._p[at.DELAY_LINE]))
        states[queue] = np.maximum(states[queue], signals[_VOLTAGE])

    def _by_angle(self) -> None:
        """All angles are as large as the largest; a speed counts by how far it goes in the window."""
        p, signals, states = self._p, self.signals, self.states
        N, N_c = p[at.RATIO], p[at.RATIO_TO_COUPLING]
        y = max(signals[0], signals[1], signals[at.HISTORY_ANGLE] / N)
        signals[[1, at.HISTORY_ANGLE]] = y, y * N
        both = [_SPEED, _SPEED_COMMAND]
        signals[both] = np.maximum(signals[both], y * N / self._window_s)
        w = signals[_SPEED]
        states[[at.S_OUTPUT, at.S_ANGLE, at.S_ERROR, at.S_OUTPUT_SPEED]] = y, y * N, y * N, w / N
        states[at.S_ERROR_RATE] = w * self._window_s / p[at.POSITION_PERIOD]
        states[at.S_TORQUE_FEEDFORWARD] = p[at.ACCELERATION_FEEDFORWARD] * y * N
        if p[at.ELASTIC_DRIVE] > 0.0:
            states[[ES.ES_TWIST, ES.ES_LOAD_ANGLE, ES.ES_LOAD_SPEED]] = y * N / N_c, y * N / N_c, w / N_c


def matter(drive: Running) -> Places:
    """Places of the state that what comes depends on; overload and bus only near the level where they act."""
    p, s, left = drive.p, drive.s, list(_MODES)
    if abs(s[at.S_CURRENT]) < p[at.CONTINUOUS_CURRENT] and not s[at.S_OVERLOADED]:
        left.append(at.S_OVERLOAD)
    if abs(s[at.S_VOLTAGE]) < 0.5 * s[at.S_VOLTAGE_LIMIT]:
        left.append(at.S_VOLTAGE_LIMIT)
    kept = np.ones(s.size, dtype=bool)
    kept[left] = False
    return drive.matter[kept[drive.matter]]


def eventless(piece: Piece) -> bool:
    """Whether nothing happened that moves anything."""
    columns = piece.columns[[1, at.HISTORY_ANGLE]]
    return piece.status == "ok" and (piece.events == 0 or bool((np.ptp(columns, axis=1) == 0.0).all()))


def change(state: Floats, before: Floats) -> Floats:
    """The difference of two states; limits that are infinite in both have none."""
    return np.subtract(state, before, out=np.zeros_like(state), where=state != before)


def small(step: Floats, scale: Floats) -> npt.NDArray[np.bool_]:
    """Numbers that change by next to nothing in a window."""
    return np.abs(step) <= STILL * np.where(np.isfinite(scale), scale, 0.0)


def even(step: Floats, other: Floats, scale: Floats) -> bool:
    """Whether two changes of a state are one, number by number, or both next to nothing."""
    same = np.abs(step - other) <= EVEN * np.abs(step)
    return bool((same | (small(step, scale) & small(other, scale))).all())


def leap(drive: Running, places: Places, step: Floats, before: Floats, scale: Floats) -> int:
    """Set a drive forward by windows of one change each, as many as have no event.

    Rounding of the change adds up until numbers no longer fit each other.  So behind each leap a window is
    run, in which they find each other again, and the change is taken anew over the whole way.

    ``step``, ``before``: change at ``places`` in the last window and in the one before it; next to nothing
    that differs between them is rounding, which does not add up.  ``scale``: largest values at ``places``.
    Returns how far, 0 where the drive moves.
    """
    angles = (places == at.S_ANGLE) | (places == at.S_OUTPUT)
    if (angles & ~small(step, scale)).any():
        return 0
    start, gone = drive.s[places], 0
    step = np.where(small(step, scale) & (np.abs(step - before) > EVEN * np.abs(step)), 0.0, step)
    while gone < MOST_LEAPS:
        windows = _furthest(drive, places, step, scale)
        stay, gone = drive.s.copy(), gone + windows
        if windows == 0 or not _undisturbed(drive, DRIFT * drive.base_ticks):
            drive.s[:] = stay
            break
        drive.s[at.S_TICK], gone = 0.0, gone + 1
        step = change(drive.s[places], start) / gone
    return gone


def _furthest(drive: Running, places: Places, step: Floats, scale: Floats) -> int:
    """Set a drive forward by as many windows of one change as have no event and end evenly; how many."""
    stay, start = drive.s.copy(), drive.s[places]

    def holds(windows: int) -> bool:
        drive.s[:] = stay
        drive.s[places] = ahead = start + windows * step
        if not _undisturbed(drive, CHECKED * drive.base_ticks):
            return False
        after = change(drive.s[places], ahead)
        return even(after, CHECKED / DRIFT * step, np.maximum(scale, np.abs(ahead)))

    low, high = 0, 1
    while high <= MOST_LEAPS and holds(high):
        low, high = high, 2 * high
    while 0 < low < MOST_LEAPS and high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if holds(middle) else (low, middle)
    drive.s[:] = stay
    drive.s[places] = start + low * step
    if drive.p[at.OVERLOAD] > 0.0:
        ticks = low * DRIFT * drive.base_ticks
        drive.s[at.S_OVERLOAD] = overload(drive.p, stay, drive.s[at.S_CURRENT], ticks)
    return low


def _undisturbed(drive: Running, ticks: int) -> bool:
    """Go on from tick 0; whether nothing happens that moves anything. Looked at in full only where it may."""
    before = drive.s.copy()
    drive.run(ticks)
    drive.work += ticks + int(drive.s[at.S_STEPS] - before[at.S_STEPS])
    if drive.s[at.S_EVENTS] == before[at.S_EVENTS] or drive.s[at.S_STATUS] > 0.0:
        return bool(drive.s[at.S_STATUS] == 0.0)
    if (drive.s[_ANGLES] != before[_ANGLES]).any():
        return False
    drive.s[:] = before
    return eventless(drive.advance(ticks))
