"""What figures share: colours of series, each with a dash of its own; limits of an axis, ticks of phase."""

import math
from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from reports.charts.chart import Chart, Panel
from reports.numbers import hertz, time_unit, to_minus

SMALL, HALF, WIDE = 340.0, 430.0, 900.0
BLUE, ORANGE, GREEN, PURPLE, RED, SKY, BROWN = SERIES = ("c1", "c2", "c3", "c4", "c5", "c6", "c7")
INK, MUTED = "ink", "muted"
FRAME = 1.6  # of a Nyquist figure, about -1
TURN = np.exp(2j * np.pi * np.arange(73) / 72)  # the unit circle
__all__ = ["Chart", "Panel", "hertz", "time_unit", "to_minus"]  # besides what stands here
Style = dict[str, Any]  # how an item is drawn: fields of `reports.charts.chart.Look` and of a curve, by name


def plot(
    height: float, x: str = "", y: str = "", log: str = "", *, width: float = WIDE, by_point: bool = False,
    **more: Any,
) -> tuple[Chart, Panel]:  # fmt: skip
    """A chart of one panel; see `Chart.panel`, and `Chart` for what else it takes."""
    chart = Chart(width=width, height=height, **more)
    return chart, chart.panel(x, y, log, by_point=by_point)


def stack(height: float, *heights: float, width: float = WIDE, **more: Any) -> tuple[Chart, list[Panel]]:
    """A chart of panels one below the other; see `Chart.column`."""
    chart = Chart(width=width, height=height, **more)
    return chart, chart.column(*heights)


def series(k: int) -> Style:
    return {"colour": SERIES[k % 7], "dash": k % 7}


def marked(k: int, size: float = 6.0) -> Style:
    return {"colour": SERIES[k % 7], "marker": "os^Dv<>"[k % 7], "size": size}


def known(values: Iterable[float | None]) -> list[float]:
    return [value for value in values if value is not None and math.isfinite(value)]


def frequency(panel: Panel, ends: Sequence[float] | np.ndarray | None = None) -> None:
    panel.x.log, panel.x.label = True, "frequency, Hz"
    if ends is not None:
        panel.x.limits(ends[0], ends[-1])


def bound(
    panel: Panel, values: Iterable[float | None], *, span: float, top_room: float, marks: Sequence[float] = ()
) -> None:
    """Set the y limits to the values, at most so much below the highest, with some room above.

    With ``marks``, which are always shown, the span lies about them: 0.6 of it above, 0.4 below.
    """
    there = [*known(values), *marks]
    high, low = max(there, default=1.0), min(there, default=0.0)
    first, last = (min(marks) - 0.4 * span, max(marks) + 0.6 * span) if marks else (high - span, high)
    low, high = max(low, first), min(high, last)
    height = max(high - low, 1.0)
    panel.y.limits(low - 0.04 * height, high + top_room * height)


def decibels(values: np.ndarray) -> np.ndarray:
    """Magnitude in dB; nothing is -inf, which a chart leaves out."""
    with np.errstate(divide="ignore"):
        return np.asarray(20.0 * np.log10(np.abs(values)))


def phases(values: np.ndarray) -> np.ndarray:
    """Unwrapped phase in deg; nothing has none, which a chart leaves out."""
    out, there = np.full(np.shape(values), np.nan), np.abs(values) > 0.0
    out[there] = np.degrees(np.unwrap(np.angle(values[there])))
    return out


def bode_axes(top: Panel, bottom: Panel, phase: Iterable[float | None]) -> None:
    top.y.label, bottom.y.label = "magnitude, dB", "phase, deg"
    frequency(bottom)
    phase_axis(bottom, phase)


def phase_axis(
    panel: Panel, values: Iterable[float | None], *, span: float = 900.0, marks: Sequence[float] = ()
) -> None:
    """Set limits and ticks of a phase: multiples of 15, 45, 90, ... degrees."""
    bound(panel, values, span=span, top_room=0.08, marks=marks)
    low, high = panel.y.span()
    step = next((s for s in (15.0, 45.0, 90.0, 180.0, 360.0, 720.0) if (high - low) / s <= 7), 1440.0)
    panel.y.ticks = multiples(step, low, high)


def multiples(step: float, low: float, high: float) -> list[tuple[float, str]]:
    levels = [step * k for k in range(math.ceil(low / step), math.floor(high / step) + 1)]
    return [(level, to_minus(f"{level:.0f}")) for level in levels]


def nyquist_plane(chart: Chart) -> Panel:
    panel = chart.panel("real part of L", "imaginary part of L", by_point=True)
    panel.equal = True
    panel.rule_y(0.0)
    panel.rule_x(0.0)
    panel.curve(TURN.real, TURN.imag, colour=MUTED, dash=2, width=1.0, read=False)
    return panel


def critical_point(panel: Panel) -> None:
    panel.points([-1.0], [0.0], marker="+", colour=INK, size=14.0, read=False)
    panel.note("−1", (-1.0, 0.0))
    panel.x.limits(-1.0 - FRAME, FRAME - 0.35)
    panel.y.limits(-FRAME, FRAME)


def rows(panel: Panel, names: Sequence[str]) -> None:
    """Make y a list of names, the first on top."""
    panel.y.ticks = [(float(k), name) for k, name in enumerate(names)]
    panel.y.limits(-0.6, max(len(names), 1) - 0.4)
    panel.y.reversed, panel.y.grid = True, False


def time_axis(panel: Panel, last_s: float) -> float:
    """Label x with the unit that suits the span and give the factor from seconds."""
    scale, unit = time_unit(last_s)
    panel.x.label = f"time, {unit}"
    return scale


def kept_rows(series: Sequence[np.ndarray], buckets: int = 300) -> np.ndarray:
    """Rows of a long series to draw: of each bucket the first, and the smallest and largest of every series.

    >>> y = np.zeros(1000)
    >>> y[503] = 1.0
    >>> bool(503 in kept_rows([y], 10))
    True
    """
    rows = len(series[0])
    if rows <= 2 * buckets:
        return np.arange(rows)
    parts = [*pairwise(np.linspace(0, rows, buckets + 1).astype(np.int64))]
    ends = [a + of(one[a:b]) for one in series for a, b in parts for of in (np.argmin, np.argmax)]
    return np.unique([0, *ends, rows - 1])
