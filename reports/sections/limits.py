"""The limit of linear validity, and the map of amplitude over frequency behind it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from operator import itemgetter
from typing import Any

import numpy as np

from actuator_lti.design.model import Design
from actuator_lti.drive.signals import LIMITERS
from actuator_lti.loops.limiters import Onset
from analyses.large_signal.classify import CAUSES, WAVEFORMS
from analyses.large_signal.result import LargeSignals
from reports import document as doc
from reports.charts import style
from reports.sections.names import Unit, command_unit, hertz


def section(design: Design, onset: Onset) -> doc.Section:
    scale, unit = command_unit(design)
    where = ", at the output," if design.controller.outermost in ("position", "velocity") else ""
    caption = (
        f"Peak amplitude of a sine command{where} at which each limit is just reached. Below the "
        "lowest line every linear figure of this report holds, except for dry friction."
    )
    rows = _rows(design, onset, scale)
    columns = [
        doc.column("amplitude", "Command amplitude", unit, format="short:3"),
        doc.column("fraction", "Of full deflection", "%", format="fix:0"),
        doc.column("hz", "Linear up to", "Hz", format="sig:3"),
        doc.column("limiter", "Then limited by"),
    ]
    blocks = [doc.figure("onset", _chart(design, onset, scale, unit), caption)]
    blocks += [doc.table("How far the linear model reaches", columns, rows)] if rows else []
    intro = "A linear prediction ends where a limit is reached. Which one, and when, depends on frequency."
    words = _result(rows, onset, scale, unit)
    title = "Validity of the linear model"
    return doc.section("limits", title, blocks, result=words, intro=intro, severity="info")


def _chart(design: Design, onset: Onset, scale: float, unit: str) -> style.Chart:
    title = "limit reached at this amplitude"
    chart, panel = style.plot(370.0, y=f"command amplitude, {unit}", log="y", legend=True, legend_title=title)
    hertz, lowest = onset.omega_rad_s / (2.0 * np.pi), scale * onset.amplitude_rad
    there, full = np.isfinite(lowest), _full(design) * scale
    top = 4.0 * max([full, *lowest[there][:1]]) if there.any() else 1.0
    bottom = max(0.6 * min(lowest[there], default=0.1), top / 1e6)
    panel.y.limits(bottom, top)
    style.frequency(panel, hertz)
    if there.any():
        x, y, floor = hertz[there].tolist(), lowest[there].tolist(), bottom * 1e-3
        panel.shape([([*x, x[-1], x[0]], [*y, floor, floor])], colour=style.GREEN, opacity=0.1)
    _onsets(panel, hertz, onset.each_rad, scale)
    panel.note("linear below the lowest line", corner="bottom left", colour=style.MUTED)
    if full:
        panel.rule_y(full, f"full deflection {full:g} {unit}", colour=style.INK, dash=2)
    return chart


def _full(design: Design) -> float:
    """Full deflection; 0 where the command is no position."""
    return design.validation.full_deflection_rad if design.controller.position is not None else 0.0


def _result(rows: Sequence[_Row], onset: Onset, scale: float, unit: str) -> str:
    if rows:
        amplitude, percent, hz, limiter = max(rows, key=itemgetter(0))
        part = f"{percent:.0f} % of " * (percent != 100.0) + "full deflection"
        size = f"A sine of {part} ({amplitude:.3g} {unit})"
        if hz is None:
            return f"{size} stays linear over the whole frequency range."
        reach = (
            f"stays linear up to {hz:.3g} Hz; above, the"
            if hz
            else "is linear at no frequency looked at: the"
        )
        return f"{size} {reach} {_noun(limiter)} acts."
    if not np.isfinite(onset.amplitude_rad).any():
        return "No limit is reached by a sine command over the whole frequency range."
    k = int(np.argmin(onset.amplitude_rad))
    size, limit = (f"{scale * onset.amplitude_rad[k]:.3g} {unit}", _noun(words_of(onset.active[k])))
    at = f"{hertz(onset.omega_rad_s[k]):.3g} Hz"
    return f"Sines up to {size} stay linear; above, the {limit} acts first, at {at}."


def _noun(limiter: str) -> str:
    whole = limiter in (words_of("profile"), words_of("overload"), COGGING)
    return limiter if whole or "limit" in limiter else f"{limiter} limit"


def words_of(limiter: str) -> str:
    """Say which limiter acts, by its name; ``""`` is none."""
    return COGGING if limiter == "cogging" else LIMITERS[limiter].words if limiter else "none"


_Row = tuple[float, float, float | None, str]  # amplitude, % of full deflection, linear up to (Hz), limiter


def _rows(design: Design, onset: Onset, scale: float) -> list[_Row]:
    rows: list[_Row] = []
    for fraction in design.validation.amplitude_fractions if _full(design) else ():
        amplitude, up_to, limiter = fraction * _full(design), None, "none in this range"
        reached = np.nonzero(onset.amplitude_rad < amplitude)[0]
        if len(reached):
            up_to = hertz(_crossing(onset, int(reached[0]), amplitude)) if reached[0] else 0.0
            limiter = words_of(onset.active[int(reached[0])])
        rows.append((amplitude * scale, 100.0 * fraction, up_to, limiter))
    return rows


def _crossing(onset: Onset, first: int, amplitude: float) -> float:
    """Interpolate, on logarithmic scales, where the linear_limit falls to an amplitude."""
    if first == 0 or not math.isfinite(onset.amplitude_rad[first - 1]):
        return float(onset.omega_rad_s[first])
    both = [first, first - 1]  # the amplitude falls
    known, omega = np.log(onset.amplitude_rad[both]), np.log(onset.omega_rad_s[both])
    return float(np.exp(np.interp(math.log(amplitude), known, omega)))


_LAST = (style.RED, style.SKY, style.INK, style.MUTED, style.BROWN, style.PURPLE)
PALETTE = (style.BLUE, style.ORANGE, style.GREEN, *_LAST)
LINES = {name: k for k, name in enumerate((*LIMITERS, "cogging"))}
COLOURS = {"friction": style.BROWN, "stiction": style.PURPLE, "other": style.MUTED}
COLOURS |= {name: PALETTE[k] for name, k in LINES.items()}
COGGING = "cogging (the motor turned by a tenth of its period)"
WORDS = {"friction": "dry friction", "stiction": "stiction", "none": "linear"}
WORDS |= {"other": "play, gravity, cogging or counts"} | {name: one.words for name, one in LIMITERS.items()}
GLYPHS: dict[str, style.Style] = {
    "triangle": {"marker": "^", "size": 5.0},
    "parabola": {"marker": "o", "size": 4.8, "hollow": True},
    "distorted": {"marker": ".", "size": 4.2},
    "stick-slip": {"marker": "s", "size": 4.6, "hollow": True},
    "no motion": {"marker": "x", "size": 4.8},
    "not steady": {"marker": "2", "size": 6.0},
}
NAMED = 0.015  # of the map: a region with its cause in it
EVERY = 2  # a glyph in every second column


def map_chart(result: LargeSignals, out: Unit) -> style.Chart:
    legend: style.Style = {"legend": True, "legend_title": "waveform; first reached, linear loop"}
    amplitude = f"command amplitude, {out.unit}"
    made, panel = style.plot(500.0, "command frequency, Hz", amplitude, "xy", **legend)
    shown, scale = result.map, out.scale
    x, y = shown.frequency_hz, scale * shown.amplitude_rad
    xe, ye = _edges(x), _edges(y)
    panel.x.limits(xe[0], xe[-1])
    panel.y.limits(ye[0], ye[-1])
    panel.x.grid = panel.y.grid = False
    _regions(panel, shown.cause, xe, ye)
    for name, look in GLYPHS.items():  # in every second column; a sine has none
        rows, columns = np.nonzero(shown.waveform[:, ::EVERY] == WAVEFORMS.index(name))
        if len(rows):
            panel.points(x[EVERY * columns], y[rows], name, colour=style.INK, read=False, **look)
    _onsets(panel, x, shown.onset_rad, scale)
    if (shift := result.shift) is not None and np.isfinite(shift.simulated_rad).any():
        sizes = scale * shift.simulated_rad / shift.command_gain
        look = {"colour": style.INK, "marker": "D", "size": 7.0, "hollow": True}
        panel.points(shift.frequency_hz, sizes, "simulated, with friction", **look)
    full = scale * result.design.validation.full_deflection_rad
    panel.rule_y(full, "full\ndeflection", dash=4, width=0.8)
    for k, name in enumerate(CAUSES):
        if (mask := shown.cause == k).mean() > NAMED:
            row, column = _deepest(mask)
            panel.note(WORDS.get(name, name), (x[column], y[row]), bold=True, over=True)
    return made


def _edges(centres: np.ndarray) -> np.ndarray:
    inner = np.sqrt(centres[1:] * centres[:-1])
    first, last = centres[0] ** 2 / inner[0], centres[-1] ** 2 / inner[-1]
    return np.concatenate([[first], inner, [last]])


def _regions(panel: style.Panel, cause: np.ndarray, xe: np.ndarray, ye: np.ndarray) -> None:
    boxes: dict[str, list[Any]] = {}
    for k, row in enumerate(cause):
        for a, b in pairwise([0, *(np.flatnonzero(np.diff(row)) + 1).tolist(), len(row)]):
            ring = ([xe[a], xe[b], xe[b], xe[a]], [ye[k], ye[k], ye[k + 1], ye[k + 1]])
            boxes.setdefault(CAUSES[row[a]], []).append(ring)
    for name in (name for name in boxes if name in COLOURS):
        panel.shape(boxes[name], colour=COLOURS[name], opacity=0.28)


def _onsets(panel: style.Panel, hertz: np.ndarray, each_rad: Mapping[str, np.ndarray], scale: float) -> None:
    for name, values in each_rad.items():
        if np.isfinite(values).any():
            limited = np.where(np.isfinite(values), scale * np.asarray(values), np.nan)
            look: style.Style = {"colour": COLOURS[name], "dash": LINES[name], "width": 2.3}
            panel.curve(hertz, limited, words_of(name), **look)


def _deepest(mask: np.ndarray) -> tuple[int, int]:
    """Give the point furthest inside a region, weighing rows as two columns."""
    inside, around = np.argwhere(mask), np.argwhere(~np.pad(mask, 1)) - 1
    depth = [(((around - each) * (1.6, 0.6)) ** 2).sum(axis=1).min() for each in inside]
    row, column = inside[int(np.argmax(depth))].tolist()
    return row, column
