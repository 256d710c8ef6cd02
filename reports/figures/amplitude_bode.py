"""Closed-loop response at several amplitudes, and the bandwidths against amplitude.

Data: ``frequency_hz``; ``series`` of ``label``, ``gain_db``, ``phase_deg``; ``linear`` (``gain_db``,
``phase_deg``); ``against``: ``amplitude``, ``minus3db_hz``, ``minus90deg_hz``, ``linear_minus3db_hz``,
``linear_minus90deg_hz``, ``unit``, ``full``.
"""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from reports.figures import style

SIZE = (10.6, 5.4)
MARKERS = "os^Dv<>"


def draw(data: dict[str, Any], fig: Figure) -> None:
    """Draw gain and phase on the left, bandwidth against amplitude on the right."""
    grid = fig.add_gridspec(2, 2, width_ratios=(1.45, 1.0))
    gain = fig.add_subplot(grid[0, 0])
    phase = fig.add_subplot(grid[1, 0], sharex=gain)
    _responses(gain, data, "gain_db")
    _responses(phase, data, "phase_deg")
    style.bound(gain, [v for s in data["series"] for v in s["gain_db"]], span=45.0, top_room=0.12)
    known = [v for s in (*data["series"], data["linear"]) for v in s["phase_deg"] if v is not None]
    low, high = max(min(known, default=-180.0), -360.0), max(known, default=0.0)
    phase.set_ylim(low - 8.0, high + 8.0)
    style.phase_ticks(phase, low - 8.0, high + 8.0)
    gain.axhline(-3.0103, color=style.MUTED, linewidth=0.9, linestyle=(0, (4, 2)))
    phase.axhline(-90.0, color=style.MUTED, linewidth=0.9, linestyle=(0, (4, 2)))
    style.log_frequency(phase)
    gain.tick_params(labelbottom=False)
    gain.set_title("Output over command")
    gain.set_ylabel("gain of the fundamental, dB")
    phase.set_ylabel("phase, deg")
    gain.legend(loc="lower left", title="amplitude")
    _bandwidths(fig.add_subplot(grid[:, 1]), data["against"])


def _responses(ax: Axes, data: dict[str, Any], key: str) -> None:
    """Draw one quantity at all amplitudes over the linear one."""
    linear: dict[str, Any] = {"color": style.MUTED, "linewidth": 3.6, "alpha": 0.45}
    ax.plot(data["frequency_hz"], style.gaps(data["linear"][key]), label="linear", **linear)
    for k, series in enumerate(data["series"]):
        look: dict[str, Any] = {"color": style.SERIES[k % 7], "linestyle": style.DASHES[k % 7]}
        look |= {"marker": MARKERS[k % 7], "markersize": 3.6, "markevery": (k, 6)}
        ax.plot(data["frequency_hz"], style.gaps(series[key]), label=series["label"], **look)
    ax.set_xlim(data["frequency_hz"][0], data["frequency_hz"][-1])


def _bandwidths(ax: Axes, data: dict[str, Any]) -> None:
    """Draw both bandwidths against amplitude, with the linear ones as levels."""
    pairs = (
        ("minus3db_hz", "−3 dB", style.GREEN, "o", "-"),
        ("minus90deg_hz", "−90°", style.PURPLE, "D", (0, (6, 2))),
    )
    for key, label, colour, marker, dash in pairs:
        look: dict[str, Any] = {"color": colour, "marker": marker, "markersize": 4.2, "linestyle": dash}
        ax.plot(data["amplitude"], style.gaps(data[key]), label=label, **look)
        level = data["linear_" + key]
        if level is not None:
            ax.axhline(level, color=colour, linewidth=0.9, linestyle=(0, (1, 2)))
            place: dict[str, Any] = {"transform": ax.get_yaxis_transform(), "ha": "right", "va": "bottom"}
            ax.text(0.99, level, f"linear {style.hertz(level)}", fontsize=8.0, color=style.MUTED, **place)
    ax.axvline(data["full"], color=style.MUTED, linewidth=0.9, linestyle=(0, (2, 2)))
    ax.set_xscale("log")
    ax.set_yscale("log")
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_formatter(FuncFormatter(style.plain_decade))
        axis.set_minor_formatter(FuncFormatter(lambda _value, _position: ""))
    ax.set_xlabel(f"command amplitude, {data['unit']} (dotted: full deflection)")
    ax.set_ylabel("frequency, Hz")
    ax.set_title("Bandwidth against amplitude")
    ax.legend(loc="lower left")
