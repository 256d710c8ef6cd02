"""One run of a campaign with its steady part marked.

Data: ``time_s``; ``panels`` of ``label``, ``values``; ``window`` [start, stop] in s.
"""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure

from reports.figures import style

SIZE = (8.4, 4.4)


def draw(data: dict[str, Any], fig: Figure) -> None:
    """Draw each signal in a panel of its own, the steady part shaded."""
    panels = data["panels"]
    axes = fig.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
    start, stop = data["window"]
    for k, (ax, panel) in enumerate(zip(axes, panels, strict=True)):
        ax.plot(data["time_s"], style.gaps(panel["values"]), color=style.SERIES[k % 7], linewidth=0.9)
        ax.axvspan(start, stop, color=style.RED, alpha=0.10, linewidth=0)
        for edge in (start, stop):
            ax.axvline(edge, color=style.RED, linewidth=1.1, linestyle=(0, (5, 2)))
        ax.set_ylabel(panel["label"])
    axes[-1].set_xlabel("time, s")
    axes[0].set_xlim(data["time_s"][0], data["time_s"][-1])
    fig.align_ylabels(list(axes))
