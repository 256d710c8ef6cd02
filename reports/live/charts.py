"""The empty figures of the live page: axes and curves that the page's script fills."""

from collections.abc import Callable
from functools import partial

from actuator_lti.design.model import Axis
from actuator_lti.drive.signals import LIMITERS, SIGNALS
from nonlinear.export.page import line_of
from reports.charts import style
from reports.charts.style import Chart, Panel
from reports.charts.svg import page_svg
from reports.sections.limits import COLOURS

EMPTY = (), ()  # what the script fills
NOW: style.Style = {"colour": style.BLUE, "width": 2.0}
BEFORE: style.Style = {"colour": style.MUTED, "width": 1.6, "dash": 1}
PINNED = tuple(zip("ABC", style.SERIES[1:], strict=False))
HERTZ = (1.0, 1000.0)
FOLLOWED: style.Style = {"width": style.HALF, "loop": "live"}  # the loop whose figures share a cursor
ONSETS = {one.words: COLOURS[name] for name, one in LIMITERS.items() if line_of(one) is not None}


def live_charts(unit: str, axis: Axis = "rotary", ampere: str = "A") -> dict[str, str]:
    """Give each figure's SVG by its name; ``unit`` of the command, ``ampere`` of the current, if any."""
    both = "as designed and as changed"
    bode = _over_frequency(
        370.0, (1.15, 1.0), partial(_both, measured=True), (-60.0, 40.0, 0.0), (-360.0, 0.0, -180.0)
    )
    measured: style.Style = {"colour": style.ORANGE, "width": 1.6}
    apart = partial(Panel.curve, x=(), y=(), label="measured over model", **measured)
    difference = _over_frequency(250.0, (1.0, 1.0), apart, *2 * [(-10.0, 10.0, 0.0)])
    drawn = {
        "bode": (bode, f"Open loop: magnitude and phase, {both}."),
        "nyquist": (_nyquist(), f"Nyquist curve near -1, {both}."),
        "sensitivity": (_sensitivity(), f"Sensitivity S and closed loop T, {both}."),
        "step": (_step(), f"Step response of the linear loop, {both}."),
        "difference": (difference, "Measured frequency response over the model as changed."),
        "run": (_run(unit, axis, ampere), f"Run with limits and friction, {both}, and a record."),
        "linear-limit": (_linear_limit(unit), f"Command amplitude at which a limit is reached, {both}."),
    }
    return {name: page_svg(made, f"live-{name}", words) for name, (made, words) in drawn.items()}


def _both(panel: Panel, *, pinned: bool = True, measured: bool = False) -> None:
    """Put in a curve as designed and one as changed, with pinned variants and a measured response."""
    if measured:
        panel.curve(*EMPTY, "measured", colour=style.ORANGE, width=2.6, opacity=0.6)
    for letter, colour in PINNED if pinned else ():
        panel.curve(*EMPTY, letter, colour=colour, width=1.5)
    panel.curve(*EMPTY, "as designed", **BEFORE)
    panel.curve(*EMPTY, "as changed", **NOW)


def _over_frequency(
    height: float,
    heights: tuple[float, float],
    draw: Callable[[Panel], object],
    *limits: tuple[float, float, float],
) -> Chart:
    """Magnitude over phase, each with its ends and the level that a line marks."""
    chart, panels = style.stack(height, *heights, **FOLLOWED)
    for panel, label, (low, high, level) in zip(panels, ("magnitude, dB", "phase, deg"), limits, strict=True):
        draw(panel)
        panel.y.label = label
        panel.y.limits(low, high)
        panel.rule_y(level, colour=style.INK)
    style.frequency(panels[-1], HERTZ)
    return chart


def _nyquist() -> Chart:
    chart = Chart(height=370.0, **FOLLOWED)
    panel = style.nyquist_plane(chart)
    _both(panel, measured=True)
    style.critical_point(panel)
    return chart


def _sensitivity() -> Chart:
    chart, panel = style.plot(250.0, y="magnitude, dB", **FOLLOWED)
    for name, colour, dash in (("S", style.ORANGE, 0), ("T", style.GREEN, 4)):
        for letter, pinned in PINNED:
            panel.curve(*EMPTY, f"{name} {letter}", colour=pinned, width=1.5, dash=dash)
        panel.curve(*EMPTY, f"{name} as designed", **{**BEFORE, "colour": colour, "opacity": 0.6})
        panel.curve(*EMPTY, f"{name} as changed", colour=colour, width=2.0)
    style.frequency(panel, HERTZ)
    panel.y.limits(-40.0, 15.0)
    return chart


def _step() -> Chart:
    chart, panel = style.plot(250.0, "time, ms", "linear response to a unit step", **FOLLOWED)
    panel.curve(*EMPTY, "command", colour=style.INK, width=1.0)
    _both(panel)
    panel.x.limits(0.0, 1.0)
    panel.y.limits(-0.1, 1.5)
    return chart


def _run(unit: str, axis: Axis, ampere: str) -> Chart:
    labels = [f"output, {unit}", f"speed, {SIGNALS['w'].unit_for(axis)}"]
    labels += [f"current, {ampere}"] * bool(ampere) + ["voltage, V"]
    more = len(labels) - 1
    chart, panels = style.stack(170.0 + 105.0 * more, *([1.5] + [1.0] * more), width=style.HALF)
    panels[0].curve(*EMPTY, "command", colour=style.INK, width=1.0)
    panels[0].curve(*EMPTY, "measured record", colour=style.ORANGE, width=2.6, opacity=0.6)
    panels[0].curve(*EMPTY, "residual", colour=style.RED, width=1.2)
    for panel, label in zip(panels, labels, strict=True):
        _both(panel, pinned=False)
        panel.y.label = label
        panel.y.limits(-0.01, 0.13)  # room for ticks of as many digits
    panels[-1].x.label = "time, ms"
    panels[-1].x.limits(0.0, 1.0)
    return chart


def _linear_limit(unit: str) -> Chart:
    chart, panel = style.plot(265.0, y=f"command amplitude, {unit}", log="y", width=style.HALF)
    panel.curve(*EMPTY, "lowest, as designed", **BEFORE)
    panel.curve(*EMPTY, "lowest, as changed", **{**NOW, "width": 2.6})
    for name, colour in ONSETS.items():
        panel.curve(*EMPTY, name, colour=colour, width=1.1)
    style.frequency(panel, HERTZ)
    panel.y.limits(1e-3, 1e3)
    return chart
