"""Waiting that costs no work: a drive whose state changes evenly is set forward to what happens next.

Under constant inputs every period of the outermost stage applies one map to the state.  The map is affine
as long as no event happens; where it is so at two states it is so on the line between them, as every guard is
linear there.  So where two windows of `DRIFT` periods add the same to the state, as an integral that grows
while friction holds the drive does, the last state before an event is found by bisection.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from nonlinear._kernels import elastic_layout as ES
from nonlinear._kernels import layout as at
from nonlinear.runs.running import Piece, Running
from nonlinear.settling.protection import overload

Floats = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]
DRIFT, CHECKED, EVEN = 64, 16, 1e-4  # periods of a window, of a look ahead; how alike two changes are
STILL = 2.0**-30  # of the largest value: a change in a window that counts
MOST_LEAPS = int(1.0 / STILL)  # windows until what changes by `STILL` in each has changed by its own size
_ANGLES = [at.S_ANGLE, at.S_OUTPUT]
_MODES = (at.S_DIRECTION, ES.ES_SEGMENT, ES.ES_LOAD, ES.ES_CONTACT, ES.ES_BEND)  # they follow from the rest


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

    Parameters
    ----------
    step, before : ndarray
        Change of the state at ``places`` in the last window, and in the one before it; next to nothing that
        differs between them is rounding, which does not add up.
    scale : ndarray
        Largest values at ``places``.

    Returns
    -------
    int
        How far, 0 where the drive moves.
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
