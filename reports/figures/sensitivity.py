"""Magnitudes of S and T with their peaks.

Data: ``frequency_hz``, ``s_db``, ``t_db``; ``s_peak`` and ``t_peak`` (``frequency_hz``, ``db``) or null;
``limit_db`` (a requirement on the peak of S) or null; ``nyquist_hz`` or null.
"""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure

from reports.figures import style

SIZE = (8.4, 3.4)


def draw(data: dict[str, Any], fig: Figure) -> None:
    """Draw both magnitudes, the peaks and the limit."""
    ax = fig.add_subplot()
    f = data["frequency_hz"]
    ax.plot(f, style.gaps(data["s_db"]), color=style.ORANGE, label="|S|, sensitivity")
    ax.plot(
        f, style.gaps(data["t_db"]), color=style.BLUE, linestyle=style.DASHES[1], label="|T|, closed loop"
    )
    ax.axhline(0.0, color=style.INK, linewidth=0.9)
    style.log_frequency(ax)
    ax.set_xlim(f[0], f[-1])
    ax.set_ylabel("magnitude, dB")
    style.bound(ax, [*data["s_db"], *data["t_db"]], span=60.0, top_room=0.16)
    if data.get("limit_db") is not None:
        ax.set_ylim(top=max(ax.get_ylim()[1], data["limit_db"] * 1.25))
        ax.axhline(data["limit_db"], color=style.RED, linewidth=1.1, linestyle=(0, (5, 2)))
        at = (0.995, data["limit_db"])
        ax.text(
            *at, f"limit {data['limit_db']:g} dB", transform=ax.get_yaxis_transform(), ha="right", va="bottom"
        )
    for name, key, colour in (("S", "s_peak", style.ORANGE), ("T", "t_peak", style.BLUE)):
        peak = data.get(key)
        if (
            peak
            and peak["frequency_hz"]
            and f[0] <= peak["frequency_hz"] <= f[-1] * 1.001
            and peak["db"] > 0.05
        ):
            ax.plot(
                [peak["frequency_hz"]], [peak["db"]], marker="^", markersize=6, color=colour, linestyle="none"
            )
            words = f"peak of {name} {peak['db']:.2f} dB\n{style.hertz(peak['frequency_hz'])}"
            style.tag(ax, words, (peak["frequency_hz"], peak["db"]), data, below=False)
    ax.legend(loc="lower right" if data["t_db"][-1] is None else "lower center")
