"""Command amplitude at which each limiter is reached, over frequency: the border of linear validity.

Data: ``frequency_hz``; ``series`` of ``label``, ``amplitude``; ``unit``; ``full_deflection`` or null.
"""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from reports.figures import style

SIZE = (10.6, 4.0)


def draw(data: dict[str, Any], fig: Figure) -> None:
    """Draw every limiter's line; below the lowest the linear model holds."""
    ax = fig.add_subplot()
    f = data["frequency_hz"]
    for k, series in enumerate(data["series"]):
        look = {"color": style.SERIES[k % 7], "linestyle": style.DASHES[k % 7], "label": series["label"]}
        ax.plot(f, style.gaps(series["amplitude"]), **look)
    lowest = [
        min(values, default=None)
        for values in ([v for v in column if v is not None] for column in _columns(data))
    ]
    known = [v for v in lowest if v is not None]
    style.log_frequency(ax)
    ax.set_yscale("log")
    ax.yaxis.set_major_formatter(FuncFormatter(style.plain_decade))
    ax.set_xlim(f[0], f[-1])
    top = max([data.get("full_deflection") or 0.0, *known[:1]]) * 4 if known else 1.0
    bottom = max(min(known, default=0.1) * 0.6, top / 1e6)
    ax.set_ylim(bottom, top)
    ax.fill_between(f, bottom, style.gaps(lowest), color=style.GREEN, alpha=0.10, linewidth=0)
    ax.text(0.02, 0.06, "linear below the lowest line", transform=ax.transAxes, color=style.MUTED)
    full = data.get("full_deflection")
    if full:
        ax.axhline(full, color=style.INK, linewidth=1.0, linestyle=(0, (2, 2)))
        place: dict[str, Any] = {"transform": ax.get_yaxis_transform(), "ha": "right", "va": "bottom"}
        ax.text(0.995, full, f"full deflection {full:g} {data['unit']}", **place)
    ax.set_ylabel(f"command amplitude, {data['unit']}")
    fig.legend(loc="outside right upper", title="reached at this amplitude")


def _columns(data: dict[str, Any]) -> list[tuple[float | None, ...]]:
    return list(zip(*(series["amplitude"] for series in data["series"]), strict=True))
