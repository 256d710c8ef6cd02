"""The map of amplitude over frequency: which limit acts, what the output looks like, where each sets in."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from actuator_lti.drive.signals import LIMITERS
from analyses.large_signal import LargeSignals
from analyses.large_signal.classify import CAUSES, WAVEFORMS
from reports.charts import style
from reports.charts.style import Chart, Panel

PALETTE = (style.BLUE, style.ORANGE, style.GREEN, style.RED, style.SKY, style.INK, style.MUTED)
LINES = {name: k for k, name in enumerate(LIMITERS)}
COLOURS = {"friction": style.BROWN, "stiction": style.PURPLE, "other": style.MUTED} | {
    name: PALETTE[k % len(PALETTE)] for name, k in LINES.items()
}
WORDS = {
    "friction": "dry friction",
    "stiction": "stiction",
    "none": "linear",
    "other": "play, gravity or counts",
} | {name: limiter.words for name, limiter in LIMITERS.items()}
GLYPHS: dict[str, style.Style] = {
    "triangle": {"marker": "^", "size": 5.0},
    "parabola": {"marker": "o", "size": 4.8, "hollow": True},
    "distorted": {"marker": ".", "size": 4.2},
    "stick-slip": {"marker": "s", "size": 4.6, "hollow": True},
    "no motion": {"marker": "x", "size": 4.8},
    "not steady": {"marker": "2", "size": 6.0},
}
EVERY = 2  # a glyph in every second column


def chart(result: LargeSignals, scale: float, unit: str) -> Chart:
    """Draw regions, glyphs and lines."""
    made = Chart(
        width=style.WIDE, height=500.0, legend=True, legend_title="waveform; first reached, linear loop"
    )
    panel, shown = made.panel("command frequency, Hz", f"command amplitude, {unit}", "xy"), result.map
    x, y = shown.frequency_hz, scale * shown.amplitude_rad
    xe, ye = _edges(x), _edges(y)
    panel.x.limits(xe[0], xe[-1])
    panel.y.limits(ye[0], ye[-1])
    panel.x.grid = panel.y.grid = False
    _regions(panel, CAUSES, shown.cause, xe, ye)
    _glyphs(panel, WAVEFORMS, shown.waveform, x, y)
    _lines(panel, result, scale)
    full = scale * result.design.validation.full_deflection_rad
    panel.rule_y(full, "full\ndeflection", dash=4, width=0.8)
    _names(panel, CAUSES, shown.cause, x, y)
    return made


def _edges(centres: np.ndarray) -> np.ndarray:
    """Give the borders between points on a logarithmic scale."""
    inner = np.sqrt(centres[1:] * centres[:-1])
    first, last = centres[0] ** 2 / inner[0], centres[-1] ** 2 / inner[-1]
    return np.concatenate([[first], inner, [last]])


def _runs(row: np.ndarray) -> Iterator[tuple[int, int, int]]:
    """Give stretches of equal values: value, first, one after the last."""
    ends = [0, *(np.flatnonzero(np.diff(row)) + 1).tolist(), len(row)]
    for a, b in pairwise(ends):
        yield int(row[a]), a, b


def _regions(panel: Panel, names: Sequence[str], cause: np.ndarray, xe: np.ndarray, ye: np.ndarray) -> None:
    """Fill the points of each cause."""
    boxes: dict[str, list[Any]] = {}
    for k, row in enumerate(cause):
        for value, a, b in _runs(row):
            ring = ([xe[a], xe[b], xe[b], xe[a]], [ye[k], ye[k], ye[k + 1], ye[k + 1]])
            boxes.setdefault(names[value], []).append(ring)
    for name, rings in boxes.items():
        if name in COLOURS:
            panel.shape(rings, colour=COLOURS[name], opacity=0.28)


def _glyphs(panel: Panel, names: Sequence[str], waveform: np.ndarray, x: np.ndarray, y: np.ndarray) -> None:
    """Mark the waveform in every second column; a sine has no mark."""
    shown = np.zeros_like(waveform, dtype=bool)
    shown[:, ::EVERY] = True
    for name, look in GLYPHS.items():
        if name not in names:
            continue
        rows, columns = np.nonzero((waveform == names.index(name)) & shown)
        if len(rows):
            panel.points(x[columns], y[rows], name, colour=style.INK, read=False, **look)


def _lines(panel: Panel, result: LargeSignals, scale: float) -> None:
    """Draw A_k(w) of every limiter, and the amplitudes at which the simulator first limits."""
    for name, values in result.map.onset_rad.items():
        values = scale * np.asarray(values)
        if np.isfinite(values).any():
            look: style.Style = {"colour": COLOURS[name], "dash": LINES[name], "width": 2.3}
            limited = np.where(np.isfinite(values), values, np.nan)
            panel.curve(result.map.frequency_hz, limited, LIMITERS[name].words, **look)
    shift = result.shift
    if shift is not None and np.isfinite(shift.simulated_rad).any():
        sizes = scale * shift.simulated_rad / shift.command_gain
        look = {"colour": style.INK, "marker": "D", "size": 7.0, "hollow": True}
        panel.points(shift.frequency_hz, sizes, "simulated, with friction", **look)


def _names(panel: Panel, names: Sequence[str], cause: np.ndarray, x: np.ndarray, y: np.ndarray) -> None:
    """Write the name of each region into its middle."""
    for k, name in enumerate(names):
        mask = cause == k
        if mask.sum() < 8:
            continue
        row, column = _deepest(mask)
        panel.note(WORDS.get(name, name), (x[column], y[row]), bold=True, over=True)


def _deepest(mask: np.ndarray) -> tuple[int, int]:
    """Give the point furthest inside a region, weighing rows as two columns."""
    outside = np.argwhere(~np.pad(mask, 1)) - 1
    inside = np.argwhere(mask)
    gaps = inside[:, None, :] - outside[None, :, :]
    depth = np.hypot(1.6 * gaps[..., 0], 0.6 * gaps[..., 1]).min(axis=1)
    row, column = inside[int(np.argmax(depth))]
    return int(row), int(column)
