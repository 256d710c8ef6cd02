"""Open-loop Bode figure: magnitude and phase of one or several curves, every margin drawn where it is."""

from __future__ import annotations

import math
from typing import NotRequired, TypedDict

from reports.figures import style
from reports.figures.style import Chart, Panel, Values

LABELLED = 3
RED, GREEN = style.RED, style.GREEN


class Series(TypedDict):
    """One curve."""

    label: str
    magnitude_db: Values
    phase_deg: Values


class GainMargin(TypedDict):
    """At its phase crossover."""

    frequency_hz: float
    db: float


class PhaseMargin(TypedDict):
    """At its gain crossover."""

    frequency_hz: float
    deg: float


class Curves(TypedDict):
    """Magnitude and phase over frequency."""

    frequency_hz: list[float]
    series: list[Series]
    nyquist_hz: NotRequired[float | None]


class Data(Curves):
    """Curves with their margins; ``small`` on the first screen."""

    gain_margins: NotRequired[list[GainMargin]]
    phase_margins: NotRequired[list[PhaseMargin]]
    loop: NotRequired[str]
    small: NotRequired[bool]


def draw(data: Data) -> Chart:
    """Draw the two panels and the margins."""
    small = bool(data.get("small"))
    chart = Chart(
        width=style.SMALL if small else style.HALF,
        height=280.0 if small else 410.0,
        loop=data.get("loop", ""),
    )
    top, bottom = chart.column(1.15, 1.0)
    curves(data, top, bottom)
    top.rule_y(0.0, colour=style.INK)
    style.bound(top, [y for s in data["series"] for y in s["magnitude_db"]], span=100.0, top_room=0.06)
    shown = 1 if small else LABELLED
    _gain_margins(data, top, shown)
    _phase_margins(data, top, bottom, shown)
    return chart


def curves(data: Curves, top: Panel, bottom: Panel) -> None:
    """Draw magnitude and phase of every series, with axes and the Nyquist line."""
    f = data["frequency_hz"]
    for k, series in enumerate(data["series"]):
        top.curve(f, series["magnitude_db"], series["label"], **style.series(k))
        bottom.curve(f, series["phase_deg"], series["label"], **style.series(k))
    top.y.label, bottom.y.label = "magnitude, dB", "phase, deg"
    style.frequency(bottom, f)
    style.phase_axis(bottom, [y for s in data["series"] for y in s["phase_deg"]])
    nyquist_hz = data.get("nyquist_hz")
    if nyquist_hz:
        for panel in (top, bottom):
            panel.rule_x(nyquist_hz, dash=2)


def _gain_margins(data: Data, top: Panel, shown: int) -> None:
    """Draw each gain margin as the distance to 0 dB at its phase crossover."""
    low, high = top.y.span()
    for k, margin in enumerate(data.get("gain_margins", ())):
        f, db = margin["frequency_hz"], margin["db"]
        if not _inside(f, data):
            continue
        seen = min(max(-db, low), high)
        top.curve([f, f], [0.0, seen], colour=RED, width=2.6, read=False)
        top.points([f], [seen], marker="s", colour=RED, size=6.0, read=False)
        if k < shown and (k == 0 or low < -db < high):
            off = "" if low < -db < high else " (off scale)"
            top.note(f"GM {_signed(db)} dB{off}\n{style.hertz(f)}", (f, seen))


def _phase_margins(data: Data, top: Panel, bottom: Panel, shown: int) -> None:
    """Draw each phase margin as the distance to the odd multiple of 180 deg at its gain crossover."""
    (top_low, _), (low, high) = top.y.span(), bottom.y.span()
    for level in range(math.ceil((low / 180.0 - 1) / 2), math.floor((high / 180.0 - 1) / 2) + 1):
        bottom.rule_y(180.0 * (2 * level + 1), colour=style.INK)
    for k, margin in enumerate(data.get("phase_margins", ())):
        f, deg = margin["frequency_hz"], margin["deg"]
        if not _inside(f, data):
            continue
        phase = _at(f, data["frequency_hz"], data["series"][0]["phase_deg"])
        border = 180.0 * (2 * round(((phase - deg) / 180.0 - 1) / 2) + 1)
        thin: style.Style = {"colour": GREEN, "width": 0.9, "dash": 4, "read": False}
        top.points([f], [0.0], colour=GREEN, size=6.5, read=False)
        top.curve([f, f], [0.0, top_low], **thin)
        bottom.curve([f, f], [high, phase], **thin)
        bottom.curve([f, f], [border, border + deg], colour=GREEN, width=2.6, read=False)
        bottom.points([f], [border + deg], colour=GREEN, size=6.5, read=False)
        if k < shown:
            bottom.note(f"PM {_signed(deg)}°\n{style.hertz(f)}", (f, border + deg / 2))


def _inside(frequency_hz: float, data: Data) -> bool:
    return bool(data["frequency_hz"][0] <= frequency_hz <= data["frequency_hz"][-1] * 1.001)


def _at(x: float, xs: list[float], ys: Values) -> float:
    """Read a curve at a frequency, linear in its logarithm."""
    for k in range(1, len(xs)):
        a, b = ys[k - 1], ys[k]
        if xs[k] >= x and a is not None and b is not None:
            part = math.log(x / xs[k - 1]) / math.log(xs[k] / xs[k - 1])
            return a + (b - a) * min(max(part, 0.0), 1.0)
    return next((y for y in reversed(ys) if y is not None), 0.0)


def _signed(value: float) -> str:
    return style.to_minus(f"{value:.1f}")
