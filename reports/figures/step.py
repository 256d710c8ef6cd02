"""Step response with rise time, overshoot and settling time."""

from __future__ import annotations

from typing import NotRequired, TypedDict

from reports.figures import style
from reports.figures.style import Chart, Panel, Values
from reports.numbers import seconds


class Series(TypedDict):
    """A response, on a time axis of its own where it has one."""

    label: str
    response: Values
    time_s: NotRequired[list[float]]


class Data(TypedDict):
    """Responses with the figures of the first; ``held``: drawn as stairs."""

    time_s: list[float]
    series: list[Series]
    final: NotRequired[float | None]
    rise: NotRequired[list[float] | None]
    settling_s: NotRequired[float | None]
    overshoot_percent: NotRequired[float | None]
    peak_time_s: NotRequired[float | None]
    held: NotRequired[bool]
    loop: NotRequired[str]
    small: NotRequired[bool]


def draw(data: Data) -> Chart:
    """Draw the responses and the figures read from the first."""
    small = bool(data.get("small"))
    chart = Chart(
        width=style.SMALL if small else style.HALF,
        height=280.0 if small else 225.0,
        loop=data.get("loop", ""),
    )
    panel = chart.panel()
    scale = style.time_axis(panel, data["time_s"][-1])
    for k, series in enumerate(data["series"]):
        time = [t * scale for t in series.get("time_s") or data["time_s"]]
        held = bool(data.get("held")) and len(time) < 80
        panel.curve(time, series["response"], series["label"], stairs=held, **style.series(k))
    panel.y.label = "response to a unit step"
    panel.x.limits(0.0, data["time_s"][-1] * scale)
    values = style.known(y for s in data["series"] for y in s["response"])
    panel.y.limits(low=min(0.0, 1.05 * min(values, default=0.0)))
    final = data.get("final")
    if final is not None:
        _band(data, final, panel, scale)
    return chart


def _band(data: Data, final: float, panel: Panel, scale: float) -> None:
    """Draw the 2 % band, the 10-90 % rise and the settling time."""
    last, rise, settling = data["time_s"][-1], data.get("rise"), data.get("settling_s")
    panel.band_y(0.98 * final, 1.02 * final, colour=style.GREEN)
    panel.rule_y(final)
    words = []
    if rise:
        for t, level in zip(rise, (0.1 * final, 0.9 * final), strict=True):
            if t <= last:
                panel.points([t * scale], [level], colour=style.GREEN, size=6.0, read=False)
        words.append(f"rise 10–90 %: {seconds(rise[1] - rise[0])}")
    overshoot = data.get("overshoot_percent")
    if overshoot is not None:
        words.append(f"overshoot: {overshoot:.1f} %")
    if settling is not None:
        if settling <= last:
            panel.rule_x(settling * scale, colour=style.PURPLE, width=1.3, dash=1)
        words.append(f"settled to 2 %: {seconds(settling)}")
    if words:
        panel.note("\n".join(words), corner="bottom right")
