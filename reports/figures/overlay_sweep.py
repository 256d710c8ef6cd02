"""Linear and measured frequency response of a loop over one another, with their differences.

Data: ``frequency_hz``, ``valid_to_hz``; ``panels``, each ``title`` with ``linear_db``, ``linear_deg``,
``measured_db``, ``measured_deg``, ``error_db``, ``error_deg`` (magnitudes); ``tolerance_db``,
``tolerance_deg``; ``title``.
"""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from reports.figures import style

SIZE = (8.4, 6.2)
LEAST = 1e-12  # errors below this are drawn there


def draw(data: dict[str, Any], fig: Figure) -> None:
    """Draw one column a response: magnitude, phase, differences."""
    columns = len(data["panels"])
    axes = fig.subplots(3, columns, sharex=True, squeeze=False, height_ratios=(3, 3, 2))
    for j, panel in enumerate(data["panels"]):
        magnitude, phase, error = axes[0][j], axes[1][j], axes[2][j]
        _overlay(magnitude, data, panel, "db")
        _overlay(phase, data, panel, "deg")
        _errors(error, data, panel)
        magnitude.set_title(panel["title"])
        style.bound(magnitude, panel["linear_db"], span=90.0, top_room=0.1)
        style.phase_ticks(phase, *phase.get_ylim())
        for ax in (magnitude, phase, error):
            ax.axvline(data["valid_to_hz"], color=style.MUTED, linewidth=0.9, linestyle=(0, (2, 2)))
        style.log_frequency(error)
    axes[0][0].set_ylabel("magnitude, dB")
    axes[1][0].set_ylabel("phase, deg")
    axes[2][0].set_ylabel("difference, dB and deg")
    axes[0][0].legend(loc="lower left", fontsize=8)
    fig.legend(*axes[2][0].get_legend_handles_labels(), loc="outside lower center", ncols=4, fontsize=8)


def _overlay(ax: Axes, data: dict[str, Any], panel: dict[str, Any], unit: str) -> None:
    """Draw the linear line and the measured points."""
    f = data["frequency_hz"]
    ax.plot(f, style.gaps(panel[f"linear_{unit}"]), color=style.BLUE, label="linear loop")
    look: dict[str, Any] = {"marker": "o", "markersize": 3.6, "linestyle": "none", "markerfacecolor": "none"}
    ax.plot(
        f, style.gaps(panel[f"measured_{unit}"]), color=style.ORANGE, label="measured by injection", **look
    )


def _errors(ax: Axes, data: dict[str, Any], panel: dict[str, Any]) -> None:
    """Draw the magnitudes of the differences and their tolerances on a logarithmic scale."""
    f = data["frequency_hz"]
    for unit, colour, dash in (("dB", style.PURPLE, "-"), ("deg", style.GREEN, (0, (5, 2)))):
        key = unit.lower()
        values = [max(x, LEAST) if x == x else x for x in style.gaps(panel[f"error_{key}"])]
        ax.plot(f, values, color=colour, linestyle=dash, linewidth=1.3, label=f"{unit}: linear and measured")
        ax.axhline(
            data[f"tolerance_{key}"], color=colour, linestyle=(0, (1, 1.5)), linewidth=1.1,
            label=f"allowed: {data[f'tolerance_{key}']:g} {unit}",
        )  # fmt: skip
    ax.set_yscale("log")
    ax.set_ylim(1e-12, 10.0)
    ax.set_yticks([1e-12, 1e-9, 1e-6, 1e-3, 1.0])
    ax.yaxis.set_major_formatter(FuncFormatter(style.powers))
    ax.minorticks_off()
