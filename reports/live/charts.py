"""The empty figures of the live page: axes and curves that the page's script fills."""

from __future__ import annotations

import math

from actuator_lti.design.model import Axis
from actuator_lti.drive.signals import LIMITERS, SIGNALS
from nonlinear.export.page import line_of
from reports.charts import style
from reports.charts.style import Chart, Panel
from reports.charts.svg import page_svg

NOW = {"colour": style.BLUE, "width": 2.0}
BEFORE = {"colour": style.MUTED, "width": 1.6, "dash": 1}
PINNED = tuple(zip("ABC", style.SERIES[1:], strict=False))
FOLLOWED = "live"  # what the figures say of the loop that they share a cursor for
FRAME = 1.6
BORDERS = tuple(limiter.words for limiter in LIMITERS.values() if line_of(limiter) is not None)


def live_charts(unit: str, axis: Axis = "rotary", *, electrical: bool = True) -> dict[str, str]:
    """Give each figure's SVG by its name; ``unit`` is that of the command, ``electrical``: with a current."""
    drawn = {
        "bode": _bode(),
        "nyquist": _nyquist(),
        "sensitivity": _sensitivity(),
        "step": _step(),
        "run": _run(unit, axis, electrical),
        "border": _border(unit),
    }
    words = {
        "bode": "Open loop: magnitude and phase, as designed and as changed.",
        "nyquist": "Nyquist curve near -1, as designed and as changed.",
        "sensitivity": "Sensitivity S and closed loop T, as designed and as changed.",
        "step": "Step response of the linear loop, as designed and as changed.",
        "border": "Command amplitude at which a limit is reached, as designed and as changed.",
        "run": "Run with limits and friction, as designed and as changed, and a measured record.",
    }
    return {name: page_svg(chart, f"live{k}", words[name]) for k, (name, chart) in enumerate(drawn.items())}


def _both(panel: Panel, ends: tuple[float, float] = (0.0, 1.0)) -> None:
    """Put in a curve as designed and one as changed."""
    panel.curve(ends, (0.0, 0.0), "as designed", **BEFORE)
    panel.curve(ends, (0.0, 0.0), "as changed", **NOW)


def _pinned(panel: Panel, of: str = "", **look: float) -> None:
    """Put in a curve of each pinned variant, which the script fills."""
    for letter, colour in PINNED:
        panel.curve((), (), of + letter, colour=colour, **{"width": 1.5, **look})


def _bode() -> Chart:
    chart = Chart(width=style.HALF, height=370.0, loop=FOLLOWED)
    top, bottom = chart.column(1.15, 1.0)
    for panel in (top, bottom):
        _pinned(panel)
        _both(panel, (1.0, 1000.0))
    style.frequency(bottom, (1.0, 1000.0))
    top.y.label, bottom.y.label = "magnitude, dB", "phase, deg"
    top.y.limits(-60.0, 40.0)
    bottom.y.limits(-360.0, 0.0)
    top.rule_y(0.0, colour=style.INK)
    bottom.rule_y(-180.0, colour=style.INK)
    return chart


def _nyquist() -> Chart:
    chart = Chart(width=style.HALF, height=370.0, loop=FOLLOWED)
    panel = chart.panel()
    panel.equal = panel.by_point = True
    panel.rule_y(0.0)
    panel.rule_x(0.0)
    angles = [2.0 * math.pi * k / 72 for k in range(73)]
    panel.curve(
        [math.cos(a) for a in angles],
        [math.sin(a) for a in angles],
        colour=style.MUTED,
        dash=2,
        width=1.0,
        read=False,
    )
    _pinned(panel)
    _both(panel)
    panel.points([-1.0], [0.0], marker="+", colour=style.INK, size=14.0, read=False)
    panel.note("−1", (-1.0, 0.0))
    panel.x.limits(-1.0 - FRAME, FRAME - 0.35)
    panel.y.limits(-FRAME, FRAME)
    panel.x.label, panel.y.label = "real part of L", "imaginary part of L"
    return chart


def _sensitivity() -> Chart:
    chart = Chart(width=style.HALF, height=250.0, loop=FOLLOWED)
    panel = chart.panel()
    ends = (1.0, 1000.0)
    for name, colour in (("S", style.ORANGE), ("T", style.GREEN)):
        _pinned(panel, f"{name} ", dash=4 if name == "T" else 0)
        panel.curve(ends, (0.0, 0.0), f"{name} as designed", **{**BEFORE, "colour": colour, "opacity": 0.6})
        panel.curve(ends, (0.0, 0.0), f"{name} as changed", colour=colour, width=2.0)
    style.frequency(panel, ends)
    panel.y.label = "magnitude, dB"
    panel.y.limits(-40.0, 15.0)
    return chart


def _step() -> Chart:
    chart = Chart(width=style.HALF, height=250.0, loop=FOLLOWED)
    panel = chart.panel()
    panel.curve((0.0, 1.0), (1.0, 1.0), "command", colour=style.INK, width=1.0)
    _pinned(panel)
    _both(panel)
    panel.x.label, panel.y.label = "time, ms", "linear response to a unit step"
    panel.x.limits(0.0, 1.0)
    panel.y.limits(-0.1, 1.5)
    return chart


def _run(unit: str, axis: Axis, electrical: bool) -> Chart:
    traces = {"w": "speed", "i": "current", "u": "voltage"}
    if not electrical:
        del traces["i"]
    labels = [
        f"output, {unit}",
        *(f"{words}, {SIGNALS[name].unit_for(axis)}" for name, words in traces.items()),
    ]
    chart = Chart(width=style.HALF, height=170.0 + 105.0 * len(traces))
    panels = chart.column(*([1.5] + [1.0] * len(traces)))
    panels[0].curve((0.0, 1.0), (0.0, 0.0), "command", colour=style.INK, width=1.0)
    panels[0].curve((0.0, 1.0), (0.0, 0.0), "measured record", colour=style.ORANGE, width=2.6, opacity=0.6)
    for panel, label in zip(panels, labels, strict=True):
        _both(panel)
        panel.y.label = label
        panel.y.limits(-0.1, 1.3)
    panels[-1].x.label = "time, ms"
    panels[-1].x.limits(0.0, 1.0)
    return chart


def _border(unit: str) -> Chart:
    chart = Chart(width=style.HALF, height=290.0)
    panel = chart.panel()
    ends = (1.0, 1000.0)
    panel.curve(ends, (1.0, 1.0), "lowest, as designed", **BEFORE)
    panel.curve(ends, (1.0, 1.0), "lowest, as changed", **{**NOW, "width": 2.6})
    for k, name in enumerate(BORDERS):
        panel.curve(ends, (1.0, 1.0), name, colour=style.SERIES[k + 1], width=1.1)
    style.frequency(panel, ends)
    panel.y.log, panel.y.label = True, f"command amplitude, {unit}"
    panel.y.limits(1e-3, 1e3)
    return chart
