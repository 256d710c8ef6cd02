"""Open-loop Bode figures of several loops side by side, each in several forms.

Data: ``panels`` of ``title`` and the data of `reports.figures.bode` without margins.
"""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure

from reports.figures import style
from reports.figures.bode import curves

SIZE = (10.6, 4.8)


def draw(data: dict[str, Any], fig: Figure) -> None:
    """Draw a column a loop."""
    panels = data["panels"]
    axes = fig.subplots(2, len(panels), sharex="col", squeeze=False)
    for k, panel in enumerate(panels):
        top, bottom = axes[0][k], axes[1][k]
        curves(panel, top, bottom)
        top.axhline(0.0, color=style.INK, linewidth=0.9)
        bottom.axhline(-180.0, color=style.INK, linewidth=0.9)
        style.bound(top, [y for s in panel["series"] for y in s["magnitude_db"]], span=120.0, top_room=0.06)
        top.set_title(panel["title"])
        if k:
            top.set_ylabel("")
            bottom.set_ylabel("")
    handles, labels = axes[0][0].get_legend_handles_labels()
    fig.legend(handles, labels, loc="outside lower center", ncols=len(labels))
