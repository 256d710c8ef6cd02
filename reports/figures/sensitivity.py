"""Magnitudes of S and T with their peaks.

Data: ``frequency_hz``, ``s_db``, ``t_db``; ``s_peak`` and ``t_peak`` (``frequency_hz``, ``db``) or null;
``limit_db`` (a requirement on the peak of S) or null; ``nyquist_hz`` or null.
"""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reports.figures import style

SIZE = (5.2, 2.75)


def draw(data: dict[str, Any], fig: Figure) -> None:
    """Draw both magnitudes, the peaks and the limit."""
    ax = fig.add_subplot()
    f = data["frequency_hz"]
    for k, (name, values, peak) in enumerate((("S", "s_db", "s_peak"), ("T", "t_db", "t_peak"))):
        look = {"color": (style.ORANGE, style.BLUE)[k], "linestyle": style.DASHES[k]}
        ax.plot(f, style.gaps(data[values]), label=_words(name, data.get(peak)), **look)
        at = (data.get(peak) or {}).get("frequency_hz")
        if at and f[0] <= at <= f[-1] * 1.001:
            ax.plot([at], [data[peak]["db"]], marker="^", markersize=6, color=look["color"], linestyle="none")
    ax.axhline(0.0, color=style.INK, linewidth=0.9)
    style.log_frequency(ax)
    ax.set_xlim(f[0], f[-1])
    ax.set_ylabel("magnitude, dB")
    style.bound(ax, [*data["s_db"], *data["t_db"]], span=45.0, top_room=0.12)
    if data.get("limit_db") is not None:
        _limit(ax, data["limit_db"])
    fig.legend(loc="outside lower center", ncols=2)


def _words(name: str, peak: dict[str, Any] | None) -> str:
    """Name a curve, with its peak where it has one."""
    if not peak or not peak["frequency_hz"] or peak["db"] < 0.005:
        return f"|{name}|, no peak"
    return f"|{name}|, peak {peak['db']:.2f} dB at {style.hertz(peak['frequency_hz'])}"


def _limit(ax: Axes, limit_db: float) -> None:
    """Draw the limit of a requirement."""
    ax.set_ylim(top=max(ax.get_ylim()[1], limit_db + 0.12 * (limit_db - ax.get_ylim()[0])))
    ax.axhline(limit_db, color=style.RED, linewidth=1.1, linestyle=(0, (5, 2)))
    place: dict[str, Any] = {"transform": ax.get_yaxis_transform(), "ha": "left", "va": "bottom"}
    ax.text(0.01, limit_db, f"limit of S: {limit_db:g} dB", **place)
