"""Nichols chart: gain over phase of an open loop, with the regions that keep the peaks of S and T."""

from __future__ import annotations

import cmath
import math
from typing import NotRequired, TypedDict

from reports.figures import style
from reports.figures.style import Chart, Panel, Values

LIMIT_DB = 6.0  # peak of S that most standards allow, and a usual one of T
SPAN_DB = 60.0


class Data(TypedDict):
    """The open loop over frequency; its phase is unwrapped."""

    frequency_hz: list[float]
    magnitude_db: Values
    phase_deg: Values
    loop: NotRequired[str]


def draw(data: Data) -> Chart:
    """Draw the locus, and about each critical point that it may pass where S or T exceeds 6 dB."""
    chart = Chart(width=style.WIDE, height=360.0, loop=data.get("loop", ""), legend=True)
    panel = chart.panel()
    panel.by_point = True
    both = zip(data["phase_deg"], data["magnitude_db"], strict=True)
    shown = [(p, g) for p, g in both if p is not None and g is not None and abs(g) <= SPAN_DB]
    low, high = min((p for p, _ in shown), default=-360.0), max((p for p, _ in shown), default=0.0)
    gain = [g for _, g in shown]
    first, last = math.floor(low / 360.0), math.ceil(high / 360.0)
    for turn in range(first, last):
        _regions(panel, 360.0 * turn + 180.0, named=turn == first)
    panel.curve(data["phase_deg"], data["magnitude_db"], "open loop", parameter=data["frequency_hz"])
    panel.rule_y(0.0, colour=style.INK)
    panel.x.limits(low - 10.0, high + 10.0)
    panel.x.ticks = [
        (45.0 * k, style.to_minus(f"{45 * k}")) for k in range(int(low // 45), int(high // 45) + 2)
    ]
    panel.y.limits(min([*gain, -2.0 * LIMIT_DB]), max([*gain, 2.0 * LIMIT_DB]))
    panel.x.label, panel.y.label = "phase, deg", "magnitude, dB"
    return chart


def _regions(panel: Panel, centre_deg: float, *, named: bool) -> None:
    """The outlines |1 + L| = 1/M and |L/(1 + L)| = M about one critical point."""
    panel.points([centre_deg], [0.0], marker="+", colour=style.INK, size=12.0, read=False)
    M = 10.0 ** (LIMIT_DB / 20.0)
    square = M * M - 1.0
    outlines = (("S", -1.0, 1.0 / M, style.ORANGE, 0), ("T", -M * M / square, M / square, style.PURPLE, 1))
    for name, middle, radius, colour, dash in outlines:
        points = [middle + cmath.rect(radius, math.radians(5 * k)) for k in range(73)]
        x = [centre_deg + math.degrees(cmath.phase(-p)) for p in points]
        y = [20.0 * math.log10(abs(p)) for p in points]
        words = f"|{name}| = {LIMIT_DB:g} dB" if named else ""
        panel.curve(x, y, words, colour=colour, dash=dash, width=1.3, read=False)
