"""Rows that are bad, missing, filled in, frozen or of another run."""

from math import inf, isfinite

import numpy as np

from actuator_lti.design.model import Design
from actuator_lti.design.plant import reachable_speed
from actuator_lti.types import Floats
from analyses.records.compared import LEAST_ROWS, place_of
from analyses.records.finding import BAD_ROW, FEW_ROWS, NO_CHANCE, OVER, ROWS, SURE, Finding
from analyses.records.naming import KNOWN_UNITS, RATES
from analyses.records.record import DISORDER, Record, stretches
from analyses.records.single_rows import (
    NORMAL,
    count_of,
    impossible_steps,
    named_rows,
    noise_bound,
    place_in_file,
)

STEADY = 0.1  # relative difference of steps of the position beside a row that is missing or filled in


def disorder(record: Record) -> Finding | None:
    """Rows left out as their time does not increase: more than single ones may be a run of their own."""
    lost, rows = record.counts.dropped.get(DISORDER, 0), record.counts.rows_in
    if lost <= FEW_ROWS * rows:
        return None
    why = f"{lost} of {rows} rows are left out, as their time does not increase"
    why += f" ({record.counts.first_dropped[DISORDER]}): another run? It needs a file of its own"
    return Finding(ROWS, None, why, unproven=True)


def steps_finding(design: Design, record: Record, as_read: Record) -> Finding | None:
    """Steps of the position: a row that is lost at full speed looks like a jump, so that comes first."""
    lost = _lost_rows(design, record)
    return lost if lost and lost.passed is False else _jumps(design, as_read) or lost


def _jumps(design: Design, record: Record) -> Finding | None:
    """Steps of the position that no speed within the limit makes in their time."""
    place, rate = place_of(design, record), OVER * reachable_speed(design)
    if place is None or not isfinite(rate) or record.averaged > 1:
        return None
    rows = impossible_steps(record, place[1], rate, SURE)
    if not len(rows):
        return None
    unit = KNOWN_UNITS[place[0]]
    jumps, few = named_rows(record, rows, place[0], unit, jumps=True), len(rows) <= FEW_ROWS * len(record)
    most = f"more than the speed limit, {reachable_speed(design):.4g} {unit}/s at the motor, allows"
    why = BAD_ROW if few else "is the unit of the position or of the time right?"
    turn = 2.0 * np.pi * (design.total_ratio if place[0] == "output_angle" else 1.0)
    off = np.abs(np.abs(np.diff(place[1])) - turn)[rows - 1]
    if design.axis == "rotary" and np.all(off <= rate * np.diff(record.time_s)[rows - 1]):
        why = "it begins anew with each turn: count the turns on (numpy.unwrap)"
    why = f"the {place[0]} jumps {jumps}: {most} in that time: {why}"
    return Finding(f"steps of the {place[0]} from row to row", False, why)


def _lost_rows(design: Design, record: Record) -> Finding | None:
    """Rows that are missing though the time goes on, or filled in with the row before.

    Between steps of the position that are alike, two on either side, one is that of two rows or more; or one
    is nothing and the next that of two. Steps of less than ten counts of an encoder, or within noise, tell
    nothing. Of a number with so many digits the counts are coarser the larger it is: a count is the least
    step from there on outward.
    """
    place = place_of(design, record)
    if place is None or record.averaged > 1 or len(record) < LEAST_ROWS:
        return None
    step = np.diff(place[1]) / np.diff(record.time_s)
    rows = np.lib.stride_tricks.sliding_window_view(step, 6)
    inward = np.argsort(-np.maximum(np.abs(place[1][1:]), np.abs(place[1][:-1])), kind="stable")
    count = np.empty_like(step)
    count[inward] = np.minimum.accumulate(np.where(step == 0.0, inf, np.abs(step))[inward])

    def times_its_neighbours(at: int, beside: list[int]) -> tuple[Floats, int]:
        """A step of each row over those beside it, 0 where these are not alike; how many are."""
        mean, size = rows[:, beside].mean(axis=1), np.abs(rows[:, beside].mean(axis=1))
        cosine = np.all(np.abs(rows[:, beside] - mean[:, None]) < STEADY * size[:, None], axis=1)
        noise = NORMAL * float(np.median(np.abs(rows[:, at] - mean)))  # of a normal deviation
        cosine &= (STEADY * size > count[at : at + len(rows)]) & (0.5 * size > SURE * noise)
        share = np.divide(rows[:, at], mean, out=np.zeros(len(mean)), where=cosine)
        return share, int(np.count_nonzero(cosine))

    missing, places = times_its_neighbours(2, [0, 1, 3, 4])
    filled, _ = times_its_neighbours(3, [0, 1, 4, 5])
    lost = float(np.sum(np.round(missing[missing > 1.5]) - 1.0))
    copied = int(np.count_nonzero((rows[:, 2] == 0.0) & (filled > 1.5)))
    if not places:
        return None
    kinds = [f"{lost:.0f} rows are missing where the time goes on, or time stamps jitter"] if lost else []
    kinds += [f"{copied} rows repeat the one before"] if copied else []
    words = f"{' and '.join(kinds) or 'none is of two rows'}, of {places} places where the motion tells"
    words += ": take the record again, or give the times at which rows were taken" if kinds else ""
    return Finding(f"steps of the {place[0]} from row to row", not kinds, words)


def frozen(design: Design, record: Record) -> Finding | None:
    """A current that keeps a value longer than chance makes it, while the motion turns back.

    Not 0, as of a power stage that is off, nor at either end of its range, where a limit holds it.
    """
    at = record.signals.get("current")
    runs = [] if at is None or record.averaged > 1 else list(stretches(np.diff(at) == 0.0))
    if at is None or not runs:
        return None
    start, stop = max(runs, key=lambda run: run[1] - run[0])
    length, count = stop - start, len(at) - 1
    repeats = sum(end - begin for begin, end in runs) - length
    chance = count * ((repeats + 1.0) / (count - length + 2.0)) ** length  # Laplace's rule of succession
    held = np.ptp(at) > 0.0 and at[start] in (at.min(), at.max())
    if chance >= NO_CHANCE or at[start] == 0.0 or held or not _turns_back(design, record, start, stop + 1):
        return None
    why = f"the current is {at[start]:.4g} A in {length + 1} rows, from {place_in_file(record, start)} on"
    return Finding("current from row to row", False, f"{why}, while the motion turns back: frozen?")


def _turns_back(design: Design, record: Record, start: int, stop: int) -> bool:
    """Whether a record moves to and fro within some rows, by more than its noise and counts."""
    place, speed = place_of(design, record), record.signals.get(RATES[design.axis])
    if place is not None:
        part, bound = place[1][start:stop], 2.0 * noise_bound(place[1], SURE) + count_of(place[1])
        ends = part[[0, -1]]
        return bool(max(part.max() - ends.max(), ends.min() - part.min()) > bound)
    if speed is None:
        return False
    bound = noise_bound(speed, SURE)
    return bool(speed[start:stop].min() < -bound and speed[start:stop].max() > bound)
