"""Charts of one loop: open and closed over frequency, Nyquist, Nichols, S and T, step."""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence

import numpy as np

from actuator_lti.bandwidth import Bandwidth
from actuator_lti.margins.results import StabilityMargins
from actuator_lti.step import StepFigures
from analyses.linear.responses import Curve
from reports.charts import style
from reports.charts.style import Chart, Panel
from reports.numbers import seconds

Curves = Sequence[tuple[str, Curve]]
LABELLED = 3  # margins with words
NICHOLS_DB, NICHOLS_SPAN_DB = 6.0, 60.0  # peak of S that most standards allow, and a usual one of T
RED, GREEN, ORANGE = style.RED, style.GREEN, style.ORANGE


def bode(
    curves: Curves, margins: StabilityMargins, nyquist_hz: float | None, loop: str, small: bool
) -> Chart:
    """Draw magnitude and phase, every margin where it is; ``small`` on the first screen."""
    chart = Chart(width=style.SMALL if small else style.HALF, height=280.0 if small else 410.0, loop=loop)
    top, bottom = chart.column(1.15, 1.0)
    both(curves, nyquist_hz, top, bottom, span=100.0)
    top.rule_y(0.0, colour=style.INK)
    shown = 1 if small else LABELLED
    first, last = curves[0][1].frequency_hz[[0, -1]]
    inside = [(m, m.frequency_rad_s / (2.0 * math.pi)) for m in margins.gain_margins]
    gains = [(-m.db, f) for m, f in inside if first <= f <= 1.001 * last]
    low, high = top.y.span()
    colour = RED if margins.stable is False else ORANGE
    for k, (level, f) in enumerate(gains):
        seen = min(max(level, low), high)
        top.curve([f, f], [0.0, seen], colour=colour, width=2.6, read=False)
        top.points([f], [seen], marker="s", colour=colour, size=6.0, read=False)
        if k < shown and (k == 0 or low < level < high):
            off = "" if low < level < high else " (off scale)"
            top.note(f"GM {_signed(-level)} dB{off}\n{style.hertz(f)}", (f, seen))
    _phase_margins(curves[0][1], margins, top, bottom, shown)
    return chart


def _phase_margins(curve: Curve, margins: StabilityMargins, top: Panel, bottom: Panel, shown: int) -> None:
    """Draw each phase margin as the distance to the odd multiple of 180 deg at its gain crossover."""
    (top_low, _), (low, high) = top.y.span(), bottom.y.span()
    for level in range(math.ceil((low / 180.0 - 1) / 2), math.floor((high / 180.0 - 1) / 2) + 1):
        bottom.rule_y(180.0 * (2 * level + 1), colour=style.INK)
    hertz = curve.frequency_hz
    for k, margin in enumerate(margins.phase_margins):
        f, deg = margin.frequency_rad_s / (2.0 * math.pi), margin.deg
        if not hertz[0] <= f <= 1.001 * hertz[-1]:
            continue
        phase = float(np.interp(math.log(f), np.log(hertz), curve.phase_deg))
        limit = 180.0 * (2 * round(((phase - deg) / 180.0 - 1) / 2) + 1)
        thin: style.Style = {"colour": GREEN, "width": 0.9, "dash": 4, "read": False}
        top.points([f], [0.0], colour=GREEN, size=6.5, read=False)
        top.curve([f, f], [0.0, top_low], **thin)
        bottom.curve([f, f], [high, phase], **thin)
        bottom.curve([f, f], [limit, limit + deg], colour=GREEN, width=2.6, read=False)
        bottom.points([f], [limit + deg], colour=GREEN, size=6.5, read=False)
        if k < shown:
            bottom.note(f"PM {_signed(deg)}°\n{style.hertz(f)}", (f, limit + deg / 2))


def both(
    curves: Curves,
    nyquist_hz: float | None,
    top: Panel,
    bottom: Panel,
    *,
    span: float,
    top_room: float = 0.06,
) -> None:
    """Draw magnitude and phase of every curve, with axes and the Nyquist line."""
    hertz = curves[0][1].frequency_hz
    for k, (label, one) in enumerate(curves):
        top.curve(hertz, one.magnitude_db, label, **style.series(k))
        bottom.curve(hertz, one.phase_deg, label, **style.series(k))
    top.y.label, bottom.y.label = "magnitude, dB", "phase, deg"
    style.frequency(bottom, hertz)
    style.phase_axis(bottom, [y for _, one in curves for y in one.phase_deg])
    style.bound(top, [y for _, one in curves for y in one.magnitude_db], span=span, top_room=top_room)
    if nyquist_hz:
        for panel in (top, bottom):
            panel.rule_x(nyquist_hz, dash=2)


def closed_bode(curves: Curves, band: Bandwidth | None, nyquist_hz: float | None, loop: str) -> Chart:
    """Draw the closed loop and mark both bandwidths and the resonance."""
    chart = Chart(width=style.HALF, height=410.0, loop=loop)
    top, bottom = chart.column(1.0, 1.0)
    both(curves, nyquist_hz, top, bottom, span=60.0, top_room=0.15)
    bottom.rule_y(-90.0, dash=1)
    if band is None:
        return chart
    dc_db = 20.0 * math.log10(abs(band.dc_gain))
    level = dc_db - 20.0 * math.log10(math.sqrt(2.0))
    top.rule_y(level, dash=1)
    corner, lag = band.minus3db_hz, band.minus90deg_hz
    if corner is not None and math.isfinite(corner):
        _mark(top, (corner, level), "−3 dB", GREEN, "o")
    if lag is not None and math.isfinite(lag):
        _mark(bottom, (lag, -90.0), "−90°", style.PURPLE, "D")
    if math.isfinite(band.resonance_peak_db) and band.resonance_hz and band.resonance_peak_db > 0.05:
        words = f"peak {band.resonance_peak_db:.2f} dB"
        _mark(top, (band.resonance_hz, band.resonance_peak_db + dc_db), words, ORANGE, "^")
    return chart


def _mark(panel: Panel, at: tuple[float, float], words: str, colour: str, marker: str) -> None:
    """Put a marked point with its label and frequency."""
    panel.points([at[0]], [at[1]], colour=colour, marker=marker, size=6.5, read=False)
    panel.note(f"{words}\n{style.hertz(at[0])}", at)


def nyquist(
    frequency_hz: np.ndarray, L: np.ndarray, margins: StabilityMargins, closest: complex | None,
    on_circle: np.ndarray, frame: float,
) -> Chart:  # fmt: skip
    """Draw the curve, its mirror image, the circle about -1 that it touches, and every crossing."""
    chart = Chart(width=style.HALF, height=430.0)
    panel = chart.panel("real part of L", "imaginary part of L", by_point=True)
    panel.equal = True
    panel.rule_y(0.0)
    panel.rule_x(0.0)
    turn = np.exp(2j * np.pi * np.arange(73) / 72)
    panel.curve(turn.real, turn.imag, colour=style.MUTED, dash=2, width=1.0, read=False)
    panel.curve(L.real, L.imag, "L(jω), ω > 0", parameter=frequency_hz)
    panel.curve(L.real, -L.imag, "ω < 0", dash=1, width=1.1, read=False)
    distance = margins.modulus_margin
    if distance is not None and distance > 0:
        circle = distance * turn - 1.0
        look: style.Style = {"colour": style.ORANGE, "read": False}
        panel.shape([(circle.real, circle.imag)], colour=style.ORANGE, opacity=0.1)
        panel.curve(circle.real, circle.imag, f"modulus margin {distance:.3f}", width=1.4, **look)
        if closest is not None:
            panel.curve([-1.0, closest.real], [0.0, closest.imag], width=1.3, **look)
            panel.points([closest.real], [closest.imag], marker="D", size=6.0, **look)
    for m in margins.gain_margins:
        if m.ratio > 0:
            panel.points([-1.0 / m.ratio], [0.0], marker="s", colour=ORANGE, size=6.0, read=False)
    for point in on_circle:
        panel.points([point.real], [point.imag], colour=GREEN, size=6.5, read=False)
    panel.points([-1.0], [0.0], marker="+", colour=style.INK, size=14.0, read=False)
    panel.note("−1", (-1.0, 0.0))
    panel.x.limits(-1.0 - frame, frame - 0.35)
    panel.y.limits(-frame, frame)
    return chart


def nichols(frequency_hz: np.ndarray, magnitude_db: np.ndarray, phase_deg: np.ndarray) -> Chart:
    """Draw gain over phase, and about each critical point in reach where S or T exceeds 6 dB."""
    chart = Chart(width=style.WIDE, height=360.0, legend=True)
    panel = chart.panel("phase, deg", "magnitude, dB", by_point=True)
    shown = np.abs(magnitude_db) <= NICHOLS_SPAN_DB
    phase, gain = (np.asarray(values)[shown].tolist() for values in (phase_deg, magnitude_db))
    low, high = min(phase, default=-360.0), max(phase, default=0.0)
    first, last = math.floor(low / 360.0), math.ceil(high / 360.0)
    for turn in range(first, last):
        _regions(panel, 360.0 * turn + 180.0, named=turn == first)
    panel.curve(phase_deg, magnitude_db, "open loop", parameter=frequency_hz)
    panel.rule_y(0.0, colour=style.INK)
    panel.x.limits(low - 10.0, high + 10.0)
    panel.x.ticks = style.multiples(45.0, low - 10.0, high + 10.0)
    panel.y.limits(min([*gain, -2.0 * NICHOLS_DB]), max([*gain, 2.0 * NICHOLS_DB]))
    return chart


def _regions(panel: Panel, centre_deg: float, *, named: bool) -> None:
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


Peak = tuple[float | None, float | None]  # frequency in Hz, dB


def sensitivity(
    hertz: np.ndarray, s_db: np.ndarray, t_db: np.ndarray, peaks: tuple[Peak, Peak], limit_db: float | None,
    loop: str,
) -> Chart:  # fmt: skip
    """Draw both magnitudes, their peaks and the limit of a requirement."""
    chart = Chart(width=style.HALF, height=225.0, loop=loop)
    panel = chart.panel(y="magnitude, dB")
    for k, (name, values, (at, db)) in enumerate(zip("ST", (s_db, t_db), peaks, strict=True)):
        colour = (style.ORANGE, style.BLUE)[k]
        words = f"|{name}|, no peak"
        if db is not None and at and db >= 0.005:
            words = f"|{name}|, peak {db:.2f} dB at {style.hertz(at)}"
        panel.curve(hertz, values, words, colour=colour, dash=k)
        if db is not None and at and hertz[0] <= at <= hertz[-1] * 1.001:
            panel.points([at], [db], marker="^", colour=colour, size=7.0, read=False)
    panel.rule_y(0.0, colour=style.INK)
    style.frequency(panel, hertz)
    style.bound(panel, [*s_db, *t_db], span=45.0, top_room=0.12)
    if limit_db is not None:
        low, high = panel.y.span()
        panel.y.limits(high=max(high, limit_db + 0.2 * (limit_db - low)))
        panel.rule_y(limit_db, f"limit of |S|: {limit_db:g} dB", colour=style.INK, width=1.2, dash=1)
    return chart


Response = tuple[str, np.ndarray, np.ndarray]  # label, time in s, response


def step(responses: Sequence[Response], figures: StepFigures, held: bool, loop: str, small: bool) -> Chart:
    """Draw the responses (``held``: as stairs) and the figures read from the first."""
    chart = Chart(width=style.SMALL if small else style.HALF, height=280.0 if small else 225.0, loop=loop)
    panel = chart.panel(y="response to a unit step")
    last = float(responses[0][1][-1])
    scale = style.time_axis(panel, last)
    for k, (label, time, response) in enumerate(responses):
        panel.curve(time * scale, response, label, stairs=held and len(time) < 80, **style.series(k))
    panel.x.limits(0.0, last * scale)
    lowest = min(style.known(y for _, _, response in responses for y in response), default=0.0)
    panel.y.limits(low=min(0.0, 1.05 * lowest))
    if math.isfinite(figures.final_value):
        _step_figures(panel, figures, responses[0], scale, held and len(responses[0][1]) < 80)
    return chart


def _step_figures(panel: Panel, figures: StepFigures, drawn: Response, scale: float, stairs: bool) -> None:
    """Draw the 2 % band, the 10-90 % rise on the curve as it is drawn, and the settling time."""
    final, words = float(figures.final_value), []
    _, time, response = drawn
    last = float(time[-1])
    panel.band_y(0.98 * final, 1.02 * final, colour=GREEN)
    panel.rule_y(final)
    part = np.asarray(figures.response) / final
    if (part >= 0.9).any():
        # both series are parts of the response, each thinned in its own way: the earlier is nearer
        found = ((figures.time_s, part), (time, np.asarray(response) / final))
        start = min(float(at[np.argmax(one >= 0.1)]) for at, one in found if (one >= 0.1).any())
        for t in (start, start + float(figures.rise_time_s)):
            if t <= last:
                there = response[np.searchsorted(time, t * (1.0 + 1e-12), side="right") - 1]
                level = there if stairs else np.interp(t, time, response)
                panel.points([t * scale], [float(level)], colour=GREEN, size=6.0, read=False)
        words.append(f"rise 10–90 %: {seconds(float(figures.rise_time_s))}")
    if math.isfinite(figures.overshoot_percent):
        words.append(f"overshoot: {figures.overshoot_percent:.1f} %")
    if math.isfinite(figures.settling_time_s):
        if figures.settling_time_s <= last:
            panel.rule_x(figures.settling_time_s * scale, colour=style.PURPLE, width=1.3, dash=1)
        words.append(f"settled to 2 %: {seconds(figures.settling_time_s)}")
    if words:
        panel.note("\n".join(words), corner="bottom right")


def _signed(value: float) -> str:
    return style.to_minus(f"{value:.1f}")
