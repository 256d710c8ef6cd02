"""Amplitude over frequency: which limit acts, what the output looks like, and the linear onset lines.

Data: ``frequency_hz`` (cell centres), ``amplitude`` (cell centres, in ``unit``), ``causes`` and
``waveforms`` (names), ``cause`` and ``waveform`` (rows of indices, one row an amplitude), ``onset`` of
``name``, ``label``, ``amplitude``; ``points`` of ``frequency_hz``, ``amplitude``, ``label``; ``unit``;
``marks`` of ``amplitude``, ``label``.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter

from reports.figures import style

SIZE = (10.6, 5.6)
COLOURS = {
    "friction": style.BROWN,
    "stiction": style.PURPLE,
    "speed": style.BLUE,
    "acceleration": style.ORANGE,
    "current": style.GREEN,
    "voltage": style.RED,
}
LINES = dict(zip(("speed", "acceleration", "current", "voltage"), style.DASHES, strict=False))
WORDS = {
    "friction": "friction bends it",
    "stiction": "stiction",
    "speed": "speed limit",
    "acceleration": "acceleration limit",
    "current": "current limit",
    "voltage": "voltage limit",
    "none": "linear",
}
GLYPHS: dict[str, dict[str, Any]] = {
    "triangle": {"marker": "^", "markersize": 4.6, "markerfacecolor": style.INK},
    "parabola": {"marker": "o", "markersize": 4.2, "markerfacecolor": "none"},
    "distorted": {"marker": ".", "markersize": 3.0, "markerfacecolor": style.INK},
    "stick-slip": {"marker": "s", "markersize": 4.0, "markerfacecolor": "none"},
    "no motion": {"marker": "x", "markersize": 4.2, "markerfacecolor": style.INK},
    "not steady": {"marker": "2", "markersize": 5.2, "markerfacecolor": style.INK},
}
EVERY = 2  # a glyph in every second column


def draw(data: dict[str, Any], fig: Figure) -> None:
    """Draw regions, glyphs and lines."""
    ax = fig.add_subplot()
    x, y = np.array(data["frequency_hz"]), np.array(data["amplitude"])
    ax.set_xscale("log")
    ax.set_yscale("log")
    xe, ye = _edges(x), _edges(y)
    cause, waveform = np.array(data["cause"]), np.array(data["waveform"])
    _regions(ax, data["causes"], cause, xe, ye)
    handles = _glyphs(ax, data["waveforms"], waveform, x, y)
    lines = _lines(ax, data)
    for mark in data["marks"]:
        place: dict[str, Any] = {"transform": ax.get_yaxis_transform(), "ha": "left", "va": "center"}
        ax.annotate("", (-0.008, mark["amplitude"]), (0.0, mark["amplitude"]), xycoords=place["transform"])
        ax.axhline(mark["amplitude"], color=style.MUTED, linewidth=0.6, linestyle=(0, (1, 3)))
        ax.text(1.006, mark["amplitude"], mark["label"], fontsize=8.0, color=style.MUTED, **place)
    _names(ax, data["causes"], cause, x, y)
    style.log_frequency(ax, "command frequency, Hz")
    ax.yaxis.set_major_formatter(FuncFormatter(style.plain_decade))
    ax.set_ylabel(f"command amplitude, {data['unit']}")
    ax.set_title("What limits a sine command, by amplitude and frequency")
    ax.grid(visible=False)
    ax.set_xlim(xe[0], xe[-1])
    ax.set_ylim(ye[0], ye[-1])
    words: dict[str, Any] = {"title": "first reached, linear loop", "alignment": "left"}
    fig.legend(handles=lines, loc="outside right upper", **words)
    if handles:
        ax.legend(
            handles=handles, loc="upper left", bbox_to_anchor=(0.0, -0.11), ncols=len(handles),
            columnspacing=1.3, handletextpad=0.2, borderaxespad=0.0,
        )  # fmt: skip


def _edges(centres: np.ndarray) -> np.ndarray:
    """Give the borders of cells on a logarithmic scale."""
    inner = np.sqrt(centres[1:] * centres[:-1])
    first, last = centres[0] ** 2 / inner[0], centres[-1] ** 2 / inner[-1]
    return np.concatenate([[first], inner, [last]])


def _runs(row: np.ndarray) -> Iterator[tuple[int, int, int]]:
    """Give stretches of equal values: value, first, one after the last."""
    ends = [0, *(np.flatnonzero(np.diff(row)) + 1).tolist(), len(row)]
    for a, b in pairwise(ends):
        yield int(row[a]), a, b


def _regions(ax: Axes, names: list[str], cause: np.ndarray, xe: np.ndarray, ye: np.ndarray) -> None:
    """Fill the cells of each cause."""
    boxes: dict[str, list[list[tuple[float, float]]]] = {}
    for k, row in enumerate(cause):
        for value, a, b in _runs(row):
            corners = [(xe[a], ye[k]), (xe[b], ye[k]), (xe[b], ye[k + 1]), (xe[a], ye[k + 1])]
            boxes.setdefault(names[value], []).append(corners)
    for name, polygons in boxes.items():
        if name in COLOURS:
            look: dict[str, Any] = {"facecolor": COLOURS[name], "alpha": 0.28, "linewidth": 0.0}
            ax.add_collection(PolyCollection(polygons, antialiased=False, **look))


def _glyphs(ax: Axes, names: list[str], waveform: np.ndarray, x: np.ndarray, y: np.ndarray) -> list[Line2D]:
    """Mark the waveform in every second column; a sine has no mark."""
    handles = []
    shown = np.zeros_like(waveform, dtype=bool)
    shown[:, ::EVERY] = True
    for name, look in GLYPHS.items():
        if name not in names:
            continue
        rows, columns = np.nonzero((waveform == names.index(name)) & shown)
        if len(rows):
            all_look: dict[str, Any] = {
                "linestyle": "none", "markeredgewidth": 0.7, "markeredgecolor": style.INK, "color": style.INK
            }  # fmt: skip
            ax.plot(x[columns], y[rows], alpha=0.75, **all_look, **look)
            handles.append(Line2D([], [], label=name, **all_look, **look))
    handles.append(Line2D([], [], linestyle="none", label="(no mark: sine)"))
    return handles


def _lines(ax: Axes, data: dict[str, Any]) -> list[Line2D]:
    """Draw A_k(w) of every limiter, and the amplitudes at which the simulator first limits."""
    handles = []
    for line in data["onset"]:
        look = {"color": COLOURS[line["name"]], "linestyle": LINES[line["name"]], "linewidth": 2.0}
        ax.plot(data["frequency_hz"], style.gaps(line["amplitude"]), **look)
        handles.append(Line2D([], [], label=line["label"], **look))
    for k, points in enumerate(data["points"]):
        look = {
            "linestyle": "none", "marker": "Dv"[k % 2], "markersize": 5.5, "markeredgewidth": 1.2,
            "markerfacecolor": style.PAPER, "markeredgecolor": style.INK,
        }  # fmt: skip
        ax.plot(points["frequency_hz"], style.gaps(points["amplitude"]), zorder=6, **look)
        handles.append(Line2D([], [], label=points["label"], **look))
    return handles


def _names(ax: Axes, names: list[str], cause: np.ndarray, x: np.ndarray, y: np.ndarray) -> None:
    """Write the name of each region into its middle."""
    for k, name in enumerate(names):
        rows, columns = np.nonzero(cause == k)
        if len(rows) < 8:
            continue
        depth = np.array([_depth(cause == k, int(r), int(c)) for r, c in zip(rows, columns, strict=True)])
        best = int(np.argmax(depth))
        words: dict[str, Any] = {"ha": "center", "va": "center", "zorder": 7, "fontweight": "bold"}
        ax.text(x[columns[best]], y[rows[best]], WORDS.get(name, name), bbox=style.label_box(), **words)


def _depth(mask: np.ndarray, row: int, column: int) -> float:
    """How far a cell lies inside its region, weighing rows as two columns."""
    outside = np.argwhere(~np.pad(mask, 1)) - 1
    gaps = outside - (row, column)
    return float(np.min(np.hypot(1.6 * gaps[:, 0], 0.6 * gaps[:, 1])))
