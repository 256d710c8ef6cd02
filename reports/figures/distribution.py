"""Distributions of figures with their limits, the nominal design and the worst case."""

from __future__ import annotations

from typing import TypedDict

from reports.figures import style
from reports.figures.style import Chart, Panel


class Histogram(TypedDict):
    """One figure of merit with its limits."""

    label: str
    unit: str
    edges: list[float]
    counts: list[int]
    nominal: float | None
    worst: float | None
    minimum: float | None
    maximum: float | None


class Data(TypedDict):
    """At most three."""

    panels: list[Histogram]


def draw(data: Data) -> Chart:
    """Draw one histogram a panel."""
    chart = Chart(width=style.WIDE * len(data["panels"]) / 3.0, height=250.0, legend=True)
    for part in data["panels"]:
        panel = chart.panel(title=part["label"])
        _histogram(panel, part)
        _marks(panel, part)
        panel.x.label = part["unit"]
        panel.y.ticks, panel.x.grid = [], False
    return chart


def _histogram(panel: Panel, data: Histogram) -> None:
    """Fill the counts under a line."""
    edges, counts = data["edges"], data["counts"]
    if counts:
        x = [edges[0], *(e for edge in edges[1:-1] for e in (edge, edge)), edges[-1]]
        y = [float(c) for count in counts for c in (count, count)]
        panel.shape([([x[0], *x, x[-1]], [0.0, *y, 0.0])], colour=style.SKY, opacity=0.45)
        panel.curve(x, y, colour=style.BLUE, width=1.3, read=False)
        panel.y.limits(0.0, 1.35 * max(counts))


def _marks(panel: Panel, data: Histogram) -> None:
    """Mark limits, the nominal design and the worst case, each with its own dash."""
    known = style.known((data["nominal"], data["worst"]))
    low, high = min([*data["edges"], *known], default=0.0), max([*data["edges"], *known], default=1.0)
    width = max(high - low, 1e-3 * max(abs(high), 1e-9))
    lines = (
        ("nominal", data["nominal"], style.INK, 0),
        ("worst", data["worst"], style.ORANGE, 1),
        ("minimum", data["minimum"], style.RED, 2),
        ("maximum", data["maximum"], style.RED, 2),
    )
    for name, value, colour, dash in lines:
        if value is None:
            continue
        if name in ("minimum", "maximum") and not low - 2 * width <= value <= high + 2 * width:
            panel.note(f"{name} {value:g} {data['unit']}: off scale", corner="top left", colour=style.RED)
            continue
        panel.x.see([value])
        label = "limit" if name in ("minimum", "maximum") else name
        panel.rule_x(value, label=label, colour=colour, dash=dash, width=1.7)
