"""Nyquist figure around the critical point, with the modulus circle and every crossing."""

from __future__ import annotations

import math
from typing import NotRequired, TypedDict

from reports.figures import style
from reports.figures.style import Chart, Panel, Values


class Data(TypedDict):
    """The curve (null where it leaves the frame), its distance to -1, its crossings as [re, im]."""

    real: Values
    imag: Values
    frequency_hz: NotRequired[Values]
    modulus: NotRequired[float | None]
    modulus_point: NotRequired[list[float] | None]
    gain_points: NotRequired[list[float]]
    phase_points: NotRequired[list[list[float]]]
    frame: NotRequired[float]
    loop: NotRequired[str]


def draw(data: Data) -> Chart:
    """Draw the curve, its mirror image and the circles."""
    chart = Chart(width=style.HALF, height=430.0, loop=data.get("loop", ""))
    panel = chart.panel()
    panel.equal = panel.by_point = True
    real, imag = data["real"], data["imag"]
    panel.rule_y(0.0)
    panel.rule_x(0.0)
    circle = _circle((0.0, 0.0), 1.0)
    panel.curve(*circle, colour=style.MUTED, dash=2, width=1.0, read=False)
    mirrored = [None if y is None else -y for y in imag]
    panel.curve(real, imag, "L(jω), ω > 0", parameter=data.get("frequency_hz"))
    panel.curve(real, mirrored, "ω < 0", dash=1, width=1.1, read=False)
    _modulus(data, panel)
    for x in data.get("gain_points", ()):
        panel.points([x], [0.0], marker="s", colour=style.RED, size=6.0, read=False)
    for x, y in data.get("phase_points", ()):
        panel.points([x], [y], colour=style.GREEN, size=6.5, read=False)
    panel.points([-1.0], [0.0], marker="+", colour=style.INK, size=14.0, read=False)
    panel.note("−1", (-1.0, 0.0))
    frame = data.get("frame", 1.6)
    panel.x.limits(-1.0 - frame, frame - 0.35)
    panel.y.limits(-frame, frame)
    panel.x.label, panel.y.label = "real part of L", "imaginary part of L"
    return chart


def _circle(centre: tuple[float, float], radius: float) -> tuple[list[float], list[float]]:
    angles = [2.0 * math.pi * k / 72 for k in range(73)]
    return [centre[0] + radius * math.cos(a) for a in angles], [
        centre[1] + radius * math.sin(a) for a in angles
    ]


def _modulus(data: Data, panel: Panel) -> None:
    """Draw the circle about -1 that the curve just touches."""
    distance, point = data.get("modulus"), data.get("modulus_point")
    if distance is None or distance <= 0:
        return
    x, y = _circle((-1.0, 0.0), distance)
    panel.shape([(x, y)], colour=style.ORANGE, opacity=0.1)
    panel.curve(x, y, f"modulus margin {distance:.3f}", colour=style.ORANGE, width=1.4, read=False)
    if point is not None:
        panel.curve([-1.0, point[0]], [0.0, point[1]], colour=style.ORANGE, width=1.3, read=False)
        panel.points([point[0]], [point[1]], marker="D", colour=style.ORANGE, size=6.0, read=False)
