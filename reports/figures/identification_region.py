"""Confidence regions of pairs of coefficients, in percent of their values."""

from __future__ import annotations

from typing import TypedDict

from reports.figures import style
from reports.figures.style import Chart


class Outline(TypedDict):
    """A closed curve."""

    x: list[float]
    y: list[float]


class Pair(TypedDict):
    """Two coefficients; ``interval``: half widths."""

    x_label: str
    y_label: str
    whole: Outline
    random: Outline
    interval: list[float]


class Data(TypedDict):
    """In percent of the values."""

    pairs: list[Pair]


def draw(data: Data) -> Chart:
    """Draw the pairs side by side."""
    chart = Chart(width=style.WIDE, height=300.0)
    for pair in data["pairs"]:
        panel = chart.panel()
        panel.by_point = True
        whole, random = pair["whole"], pair["random"]
        panel.shape([(whole["x"], whole["y"])], colour=style.BLUE, opacity=0.15)
        panel.curve(whole["x"], whole["y"], "95 % region, all errors", colour=style.BLUE)
        panel.curve(random["x"], random["y"], "scatter of the runs only", colour=style.ORANGE, dash=1)
        for sign in (-1.0, 1.0):
            panel.rule_x(sign * pair["interval"][0], dash=2)
            panel.rule_y(sign * pair["interval"][1], dash=2)
        panel.points([0.0], [0.0], marker="+", size=10.0, colour=style.INK, read=False)
        panel.x.label, panel.y.label = pair["x_label"], pair["y_label"]
    return chart
