"""Open-loop Bode figure: magnitude and phase of one or several curves, every margin drawn where it is.

Data: ``frequency_hz``; ``series`` of ``label``, ``magnitude_db``, ``phase_deg``; optional ``gain_margins``
(``frequency_hz``, ``db``), ``phase_margins`` (``frequency_hz``, ``deg``), ``nyquist_hz``.
"""

from __future__ import annotations

import math
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reports.figures import style

SIZE = (5.2, 4.9)
LABELLED = 3


def draw(data: dict[str, Any], fig: Figure) -> None:
    """Draw the two panels and the margins."""
    top, bottom = fig.subplots(2, 1, sharex=True, height_ratios=(1.15, 1.0))
    curves(data, top, bottom)
    top.axhline(0.0, color=style.INK, linewidth=0.9)
    style.bound(top, [y for s in data["series"] for y in s["magnitude_db"]], span=100.0, top_room=0.06)
    _gain_margins(data, top)
    _phase_margins(data, top, bottom)
    if len(data["series"]) > 1:
        top.legend(loc="lower left")


def curves(data: dict[str, Any], top: Axes, bottom: Axes) -> None:
    """Draw magnitude and phase of every series, with axes and the Nyquist line."""
    for k, series in enumerate(data["series"]):
        look = {"color": style.SERIES[k % 7], "linestyle": style.DASHES[k % 7], "label": series["label"]}
        top.plot(data["frequency_hz"], style.gaps(series["magnitude_db"]), **look)
        bottom.plot(data["frequency_hz"], style.gaps(series["phase_deg"]), **look)
    top.set_ylabel("magnitude, dB")
    bottom.set_ylabel("phase, deg")
    style.log_frequency(top, "")
    style.log_frequency(bottom)
    top.tick_params(labelbottom=False)
    style.bound(bottom, [y for s in data["series"] for y in s["phase_deg"]], span=900.0, top_room=0.08)
    style.phase_ticks(bottom, *bottom.get_ylim())
    top.set_xlim(data["frequency_hz"][0], data["frequency_hz"][-1])
    if data.get("nyquist_hz"):
        for ax in (top, bottom):
            ax.axvline(data["nyquist_hz"], color=style.MUTED, linewidth=0.9, linestyle=(0, (2, 2)))


def _gain_margins(data: dict[str, Any], top: Axes) -> None:
    """Draw each gain margin as the distance to 0 dB at its phase crossover."""
    low, high = top.get_ylim()
    for k, margin in enumerate(data.get("gain_margins", ())):
        f, db = margin["frequency_hz"], margin["db"]
        if not _inside(f, data):
            continue
        seen = min(max(-db, low), high)
        top.plot([f, f], [0.0, seen], color=style.RED, linewidth=2.2, solid_capstyle="butt")
        top.plot([f], [seen], marker="s", markersize=4.5, color=style.RED, linestyle="none")
        if k < LABELLED:
            beyond = "" if low < -db < high else " (beyond)"
            words = f"GM {_signed(db)} dB{beyond}\n{style.hertz(f)}"
            style.tag(top, words, (f, seen), data, below=db > 0 if not beyond else db < 0)


def _phase_margins(data: dict[str, Any], top: Axes, bottom: Axes) -> None:
    """Draw each phase margin as the distance to the odd multiple of 180 deg at its gain crossover."""
    low, high = bottom.get_ylim()
    for level in range(math.ceil((low / 180.0 - 1) / 2), math.floor((high / 180.0 - 1) / 2) + 1):
        bottom.axhline(180.0 * (2 * level + 1), color=style.INK, linewidth=0.9)
    for k, margin in enumerate(data.get("phase_margins", ())):
        f, deg = margin["frequency_hz"], margin["deg"]
        if not _inside(f, data):
            continue
        phase = _at(f, data["frequency_hz"], data["series"][0]["phase_deg"])
        border = 180.0 * (2 * round(((phase - deg) / 180.0 - 1) / 2) + 1)
        top.plot([f], [0.0], marker="o", markersize=5, color=style.GREEN, linestyle="none")
        top.plot([f, f], [0.0, top.get_ylim()[0]], color=style.GREEN, linewidth=0.8, linestyle=(0, (1, 2)))
        bottom.plot(
            [f, f], [bottom.get_ylim()[1], phase], color=style.GREEN, linewidth=0.8, linestyle=(0, (1, 2))
        )
        bottom.plot([f, f], [border, border + deg], color=style.GREEN, linewidth=2.2, solid_capstyle="butt")
        bottom.plot([f], [border + deg], marker="o", markersize=5, color=style.GREEN, linestyle="none")
        if k < LABELLED:
            style.tag(
                bottom, f"PM {_signed(deg)}°\n{style.hertz(f)}", (f, border + deg / 2), data, below=None
            )


def _inside(frequency_hz: float, data: dict[str, Any]) -> bool:
    return data["frequency_hz"][0] <= frequency_hz <= data["frequency_hz"][-1] * 1.001


def _at(x: float, xs: list[float], ys: list[float | None]) -> float:
    """Read a curve at a frequency, linear in its logarithm."""
    for k in range(1, len(xs)):
        a, b = ys[k - 1], ys[k]
        if xs[k] >= x and a is not None and b is not None:
            part = math.log(x / xs[k - 1]) / math.log(xs[k] / xs[k - 1])
            return a + (b - a) * min(max(part, 0.0), 1.0)
    return next((y for y in reversed(ys) if y is not None), 0.0)


def _signed(value: float) -> str:
    return f"{value:.1f}".replace("-", "−")
