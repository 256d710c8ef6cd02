"""What figures share: limits of an axis, ticks of phase."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from reports.charts.chart import Chart, Panel
from reports.charts.paint import (
    BLUE,
    BROWN,
    GREEN,
    INK,
    MUTED,
    ORANGE,
    PURPLE,
    RED,
    SERIES,
    SKY,
    Style,
    series,
)  # fmt: skip
from reports.numbers import hertz, time_unit, to_minus

SMALL, HALF, WIDE = 340.0, 430.0, 900.0
__all__ = [
    "BLUE", "BROWN", "GREEN", "HALF", "INK", "MUTED", "ORANGE", "PURPLE", "RED", "SERIES", "SKY", "SMALL",
    "WIDE", "Chart", "Panel", "Style", "bound", "frequency", "hertz", "known", "phase_axis", "series",
    "time_axis", "time_unit", "to_minus",
]  # fmt: skip


def known(values: Iterable[float | None]) -> list[float]:
    """Give the values that are there."""
    return [value for value in values if value is not None and math.isfinite(value)]


def frequency(
    panel: Panel, ends: Sequence[float] | np.ndarray | None = None, label: str = "frequency, Hz"
) -> None:
    """Make x a logarithmic frequency."""
    panel.x.log, panel.x.label = True, label
    if ends is not None:
        panel.x.limits(ends[0], ends[-1])


def bound(panel: Panel, values: Iterable[float | None], *, span: float, top_room: float) -> None:
    """Set the y limits to the values, at most so much below the highest, with some room above."""
    there = known(values)
    high, low = max(there, default=1.0), min(there, default=0.0)
    low = max(low, high - span)
    height = max(high - low, 1.0)
    panel.y.limits(low - 0.04 * height, high + top_room * height)


def phase_axis(
    panel: Panel, values: Iterable[float | None], *, span: float = 900.0, room: float = 0.08
) -> None:
    """Set limits and ticks of a phase: multiples of 15, 45, 90, ... degrees."""
    bound(panel, values, span=span, top_room=room)
    low, high = panel.y.span()
    step = next((s for s in (15.0, 45.0, 90.0, 180.0, 360.0, 720.0) if (high - low) / s <= 7), 1440.0)
    first = math.ceil(low / step)
    levels = [step * k for k in range(first, math.floor(high / step) + 1)]
    panel.y.ticks = [(level, to_minus(f"{level:.0f}")) for level in levels]


def time_axis(panel: Panel, last_s: float) -> float:
    """Label x with the unit that suits the span and give the factor from seconds."""
    scale, unit = time_unit(last_s)
    panel.x.label = f"time, {unit}"
    return scale
