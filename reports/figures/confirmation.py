"""How well margins are met in time, and how they move with amplitude and dry friction."""

from __future__ import annotations

from typing import TypedDict

from reports.charts import style
from reports.charts.style import Chart, Panel, Values

LEAST = 1e-9
LOWEST = 0.02  # of the linear margin: a border below is drawn here


class Margin(TypedDict):
    """How far a margin is met, relative magnitude."""

    label: str
    difference: float


class Released(TypedDict):
    """Border over linear border by size of the deviation; null: none found."""

    label: str
    sizes: list[str]
    with_friction: Values
    without: Values


class Data(TypedDict):
    """Every margin, and the borders by amplitude."""

    margins: list[Margin]
    tolerance: float
    released: list[Released]


def draw(data: Data) -> Chart:
    """Draw the differences on the left, the borders by amplitude on the right."""
    chart = Chart(width=style.WIDE, height=max(330.0, 70.0 + 19.0 * len(data["margins"])))
    _differences(chart.panel(), data)
    if data["released"]:
        _released(chart.panel(width=1.15), data)
    return chart


def _differences(panel: Panel, data: Data) -> None:
    """One dot a margin."""
    labels = [item["label"] for item in data["margins"]]
    values = [max(item["difference"], LEAST) for item in data["margins"]]
    places = [float(k) for k in range(len(labels))][::-1]
    panel.points(values, places, size=7.0)
    panel.rule_x(data["tolerance"], "allowed", colour=style.RED, dash=1, width=1.3)
    panel.x.log, panel.by_point = True, True
    panel.x.limits(LEAST / 2.0, 1e-1)
    panel.y.limits(-0.6, len(labels) + 0.1)
    panel.y.ticks = list(zip(places, labels, strict=True))
    panel.x.ticks = style.powers(range(-9, 0, 2))
    panel.x.label = "relative difference from the linear margin"
    panel.title = "At constant speed, no limit acting"


def _released(panel: Panel, data: Data) -> None:
    """Border over linear border for small, medium and large deviations."""
    for k, item in enumerate(data["released"]):
        x = [j + 0.06 * (k - len(data["released"]) / 2) for j in range(len(item["sizes"]))]
        look: style.Style = {"colour": style.SERIES[k % 7], "size": 6.5, "width": 1.4}
        panel.curve(x, _drawn(item["without"]), item["label"], marker="o", **look)
        panel.curve(x, _drawn(item["with_friction"]), item["label"], marker="s", hollow=True, dash=1, **look)
    panel.rule_y(1.0)
    sizes = data["released"][0]["sizes"]
    panel.x.ticks = [(float(k), words) for k, words in enumerate(sizes)]
    panel.x.limits(-0.4, len(sizes) - 0.6)
    both = [_drawn(item[key]) for item in data["released"] for key in ("without", "with_friction")]
    values = [x for each in both for x in each if x]
    panel.y.log, panel.by_point = True, True
    panel.y.limits(min([*values, 1.0]) / 1.3, max([*values, 1.0]) * 1.5)
    panel.y.ticks = [(t, f"{t:g}") for t in (LOWEST, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0)]
    if min([*values, 1.0]) <= LOWEST:
        panel.y.ticks[0] = (LOWEST, f"≤ {LOWEST:g}")
    panel.x.label, panel.y.label = "initial deviation", "margin over linear margin"
    panel.title = "Released from rest (dashed: with dry friction)"


def _drawn(values: Values) -> Values:
    """The borders, none below the lowest that is drawn."""
    return [None if value is None else max(value, LOWEST) for value in values]
