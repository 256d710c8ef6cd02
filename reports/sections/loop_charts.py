"""Figures of one loop over frequency: open and closed loop, Nyquist, Nichols."""

import cmath
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from actuator_lti.margins.results import StabilityMargins
from analyses.finite import finite
from analyses.linear.loop_figures import LoopFigures
from analyses.linear.responses import Curve, curve, nichols_curve, nyquist_curve, response_at, response_curve
from reports import document as doc
from reports.charts import style
from reports.numbers import gain_margin
from reports.sections.margins import margin_row, returns

Curves = Sequence[tuple[str, Curve]]
LABELLED = 3  # margins with words
NICHOLS_DB, NICHOLS_SPAN_DB = 6.0, 60.0  # peak of S that most standards allow, and a usual one of T
RED, GREEN, ORANGE = style.RED, style.GREEN, style.ORANGE


def nyquist_hz(figures: LoopFigures) -> float | None:
    return None if figures.loop.period_s is None else 0.5 / figures.loop.period_s


def open_bode(
    title: str, figures: LoopFigures, grid: np.ndarray, *, name: str = "", small: bool = False
) -> doc.Block:
    width, height = (style.SMALL, 280.0) if small else (style.HALF, 410.0)
    chart, (top, bottom) = style.stack(height, 1.15, 1.0, width=width, loop=name)
    drawn, shown = curve(figures.loop.plain_open, grid), 1 if small else LABELLED
    gains, phases = seen_margins(figures.margins, drawn)
    marks = [0.0, *(level for level, _ in gains[:1])]
    turned = [at - part * deg for deg, _, at in phases[:1] for part in (0, 1)]
    one = [("open loop", drawn)]
    both(one, nyquist_hz(figures), top, bottom, span=100.0, marks=marks, phase_marks=turned)
    top.rule_y(0.0, colour=style.INK)
    _gain_margins(gains, RED if figures.margins.stable is False else ORANGE, top, shown)
    _phase_margins(phases, top, bottom, shown)
    caption = f"{title}, open loop: gain margins at the phase crossovers (■), phase margins at the gain "
    caption += "crossovers (●)."
    return doc.figure("bode", chart, caption, alt=margin_words(title, figures), layout="half")


def margin_words(title: str, figures: LoopFigures) -> str:
    row = margin_row(figures)
    gain = "none" if row["gain_margin_db"] is None else f"{gain_margin(row['gain_margin_db'], 1)} dB"
    phase = "none" if row["phase_margin_deg"] is None else f"{row['phase_margin_deg']:.1f} deg"
    name = title[:1].lower() + title[1:]
    return f"Open-loop Bode diagram of the {name}: gain margin {gain}, phase margin {phase}."


def seen_margins(
    margins: StabilityMargins, curve: Curve
) -> tuple[list[tuple[float, float]], list[tuple[float, float, float]]]:
    """Margins in the band of a curve, those nearest to -1 first.

    At each phase crossover the level in dB and the frequency in Hz; at each gain crossover the phase margin
    in deg, the frequency, and the phase of the curve.
    """
    hertz = curve.frequency_hz

    def seen(found: Sequence[Any], size: str) -> list[tuple[float, float]]:
        every = [(getattr(m, size), m.frequency_rad_s / (2.0 * math.pi)) for m in found]
        return sorted((m for m in every if hertz[0] <= m[1] <= 1.001 * hertz[-1]), key=lambda m: abs(m[0]))

    def phase(f: float) -> float:
        return float(np.interp(math.log(f), np.log(hertz), curve.phase_deg))

    gains = [(-db, f) for db, f in seen(margins.gain_margins, "db")]
    return gains, [(deg, f, phase(f)) for deg, f in seen(margins.phase_margins, "deg")]


def _gain_margins(found: Sequence[tuple[float, float]], colour: str, top: style.Panel, shown: int) -> None:
    low, high = top.y.span()
    look: style.Style = {"colour": colour, "read": False}
    for k, (level, f) in enumerate(found):
        seen = min(max(level, low), high)
        top.curve([f, f], [0.0, seen], width=2.6, **look)
        top.points([f], [seen], marker="s", size=6.0, **look)
        if k < shown and seen == level:
            top.note(f"GM {gain_margin(-level, 1)} dB\n{style.hertz(f)}", (f, seen))


def _phase_margins(
    found: Sequence[tuple[float, float, float]], top: style.Panel, bottom: style.Panel, shown: int
) -> None:
    """Draw each phase margin as the distance to the odd multiple of 180 deg at its gain crossover."""
    (top_low, _), (low, high) = top.y.span(), bottom.y.span()
    for level in range(math.ceil((low / 180.0 - 1) / 2), math.floor((high / 180.0 - 1) / 2) + 1):
        bottom.rule_y(180.0 * (2 * level + 1), colour=style.INK)
    for k, (deg, f, phase) in enumerate(found):
        limit = 180.0 * (2 * round(((phase - deg) / 180.0 - 1) / 2) + 1)
        thin: style.Style = {"colour": GREEN, "width": 0.9, "dash": 4, "read": False}
        top.points([f], [0.0], colour=GREEN, size=6.5, read=False)
        top.curve([f, f], [0.0, top_low], **thin)
        bottom.curve([f, f], [high, phase], **thin)
        bottom.curve([f, f], [limit, limit + deg], colour=GREEN, width=2.6, read=False)
        bottom.points([f], [limit + deg], colour=GREEN, size=6.5, read=False)
        if k < shown and low < limit + deg < high:
            bottom.note(f"PM {style.to_minus(f'{deg:.1f}')}°\n{style.hertz(f)}", (f, limit + deg / 2))


def both(
    curves: Curves, nyquist_hz: float | None, top: style.Panel, bottom: style.Panel, *, span: float,
    phase_span: float = 900.0, top_room: float = 0.06, marks: Sequence[float] = (),
    phase_marks: Sequence[float] = (), look: Callable[[int], style.Style] = style.series,
) -> None:  # fmt: skip
    for k, (label, one) in enumerate(curves):
        top.curve(one.frequency_hz, one.magnitude_db, label, **look(k))
        bottom.curve(one.frequency_hz, one.phase_deg, label, **look(k))
    top.y.label, bottom.y.label = "magnitude, dB", "phase, deg"
    hertz = [one.frequency_hz for _, one in curves]
    style.frequency(bottom, (min(f[0] for f in hertz), max(f[-1] for f in hertz)))
    angles = [y for _, one in curves for y in one.phase_deg]
    style.phase_axis(bottom, angles, span=phase_span, marks=phase_marks)
    levels = [y for _, one in curves for y in one.magnitude_db]
    style.bound(top, levels, span=span, top_room=top_room, marks=marks)
    if nyquist_hz:
        for panel in (top, bottom):
            panel.rule_x(nyquist_hz, dash=2)


def closed_bode(
    title: str, figures: LoopFigures, grid: np.ndarray, locked: LoopFigures | None, *, name: str = ""
) -> doc.Block:
    other, band = figures.reference, None if returns(figures) else figures.bandwidth
    first = "rotor free" if locked else "to the command" if other else "closed loop"
    curves = [(first, response_curve(figures, grid))]
    curves += [("to the reference", response_curve(other, grid))] if other is not None else []
    curves += [("rotor locked", curve(locked.plain_response, grid))] if locked and locked.stable else []
    chart, (top, bottom) = style.stack(410.0, 1.0, 1.0, width=style.HALF, loop=name)
    both(curves, nyquist_hz(figures), top, bottom, span=60.0, top_room=0.15)
    bottom.rule_y(-90.0, dash=1)
    corner, lag = (finite(band.minus3db_hz), finite(band.minus90deg_hz)) if band else (None, None)
    if band is not None:
        dc_db = 20.0 * math.log10(abs(band.dc_gain))
        level, peak = dc_db - 20.0 * math.log10(math.sqrt(2.0)), band.resonance_peak_db
        top.rule_y(level, dash=1)
        if corner is not None:
            _mark(top, (corner, level), "−3 dB", GREEN, "o")
        if lag is not None:
            _mark(bottom, (lag, -90.0), "−90°", style.PURPLE, "D")
        if math.isfinite(peak) and band.resonance_hz and peak > 0.05:
            _mark(top, (band.resonance_hz, peak + dc_db), f"peak {peak:.2f} dB", ORANGE, "^")
    what = "response to the command" if figures.loop.name == "position" else "closed loop"
    at = ["no frequency in the band" if hz is None else f"{hz:.4g} Hz" for hz in (corner, lag)]
    words = f"{title}, {what}: −3 dB at {at[0]}, −90° at {at[1]}."
    return doc.figure("closed_bode", chart, words, alt=f"Bode diagram. {words}", layout="half")


def _mark(panel: style.Panel, at: tuple[float, float], words: str, colour: str, marker: str) -> None:
    panel.points([at[0]], [at[1]], colour=colour, marker=marker, size=6.5, read=False)
    panel.note(f"{words}\n{style.hertz(at[0])}", at)


def nyquist(title: str, figures: LoopFigures, grid: np.ndarray) -> doc.Block:
    """Draw the curve, its mirror image, the circle about -1 that it touches, and every crossing."""
    margins, system = figures.margins, figures.loop.plain_open
    omega, L = nyquist_curve(system, grid, style.FRAME)
    chart = style.Chart(width=style.HALF, height=430.0)
    panel = style.nyquist_plane(chart)
    panel.curve(L.real, L.imag, "L(jω), ω > 0", parameter=omega / (2.0 * np.pi))
    panel.curve(L.real, -L.imag, "ω < 0", dash=1, width=1.1, read=False)
    distance = margins.modulus_margin
    if distance is not None and distance > 0:
        circle = distance * style.TURN - 1.0
        look: style.Style = {"colour": style.ORANGE, "read": False}
        panel.shape([(circle.real, circle.imag)], colour=style.ORANGE, opacity=0.1)
        panel.curve(circle.real, circle.imag, f"modulus margin {distance:.3f}", width=1.4, **look)
        if finite(closest := margins.modulus_frequency_rad_s):
            (at,) = response_at(system, np.array([closest]))
            panel.curve([-1.0, at.real], [0.0, at.imag], width=1.3, **look)
            panel.points([at.real], [at.imag], marker="D", size=6.0, **look)
    for m in (one for one in margins.gain_margins if one.ratio > 0):
        panel.points([-1.0 / m.ratio], [0.0], marker="s", colour=ORANGE, size=6.0, read=False)
    phases = [m.frequency_rad_s for m in margins.phase_margins if m.frequency_rad_s > 0]
    for point in response_at(system, np.array(phases)) if phases else ():
        panel.points([point.real], [point.imag], colour=GREEN, size=6.5, read=False)
    style.critical_point(panel)
    modulus = "withheld" if distance is None else f"{distance:.3f}"
    keeps = f"it keeps a distance of {modulus} (modulus margin, 1 over the peak of S)"
    caption = f"{title}, Nyquist curve near −1: {keeps}."
    return doc.figure("nyquist", chart, caption, alt=f"Nyquist diagram. {caption}", layout="tall")


def nichols(title: str, figures: LoopFigures, grid: np.ndarray) -> doc.Block:
    """Draw gain over phase, and about each critical point in reach where S or T exceeds 6 dB."""
    one = nichols_curve(figures.loop.plain_open, grid, NICHOLS_SPAN_DB)
    chart, panel = style.plot(360.0, "phase, deg", "magnitude, dB", by_point=True, legend=True)
    shown = np.abs(one.magnitude_db) <= NICHOLS_SPAN_DB
    phase, gain = (np.asarray(values)[shown].tolist() for values in (one.phase_deg, one.magnitude_db))
    low, high = min(phase, default=-360.0), max(phase, default=0.0)
    for k, centre in enumerate(critical_points(low, high)):
        nichols_regions(panel, centre, named=k == 0)
    panel.curve(one.phase_deg, one.magnitude_db, "open loop", parameter=one.frequency_hz)
    panel.rule_y(0.0, colour=style.INK)
    panel.x.limits(low - 10.0, high + 10.0)
    panel.x.ticks = style.multiples(45.0, low - 10.0, high + 10.0)
    panel.y.limits(min([*gain, -2.0 * NICHOLS_DB]), max([*gain, 2.0 * NICHOLS_DB]))
    caption = (
        f"{title}, Nichols chart: gain over phase. Inside the outlines about the critical points (+) the "
        "peak of S or of T exceeds 6 dB."
    )
    return doc.figure("nichols", chart, caption, alt=f"{caption} {margin_words(title, figures)}")


def critical_points(low_deg: float, high_deg: float) -> list[float]:
    """Phases of -1 about a stretch of phase: odd multiples of half a turn."""
    return [360.0 * k + 180.0 for k in range(math.floor(low_deg / 360.0), math.ceil(high_deg / 360.0))]


def nichols_regions(panel: style.Panel, centre_deg: float, *, named: bool) -> None:
    """The outlines |1 + L| = 1/M and |L/(1 + L)| = M about one critical point."""
    panel.points([centre_deg], [0.0], marker="+", colour=style.INK, size=12.0, read=False)
    M = 10.0 ** (NICHOLS_DB / 20.0)
    square = M * M - 1.0
    outlines = (("S", -1.0, 1.0 / M, style.ORANGE, 0), ("T", -M * M / square, M / square, style.PURPLE, 1))
    for name, middle, radius, colour, dash in outlines:
        points = [middle + cmath.rect(radius, math.radians(5 * k)) for k in range(73)]
        x = [centre_deg + math.degrees(cmath.phase(-p)) for p in points]
        y = [20.0 * math.log10(abs(p)) for p in points]
        words = f"|{name}| = {NICHOLS_DB:g} dB" if named else ""
        panel.curve(x, y, words, colour=colour, dash=dash, width=1.3, read=False)
