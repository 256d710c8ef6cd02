"""A signal measured and modelled, and the difference below.

Data: ``time_s``, ``measured``, ``modelled``, ``difference``; ``label`` (with unit), ``difference_label``.
"""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure

from reports.figures import style

SIZE = (8.4, 4.0)


def draw(data: dict[str, Any], fig: Figure) -> None:
    """Draw both, and the difference."""
    upper, lower = fig.subplots(2, 1, sharex=True, height_ratios=(2.2, 1.0))
    upper.plot(
        data["time_s"], style.gaps(data["measured"]), color=style.BLUE, linewidth=1.8, label="measured"
    )
    look = {"color": style.ORANGE, "linewidth": 1.2, "linestyle": style.DASHES[1]}
    upper.plot(data["time_s"], style.gaps(data["modelled"]), label="model", **look)
    upper.set_ylabel(data["label"])
    upper.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2)
    lower.axhline(0.0, color=style.MUTED, linewidth=0.9)
    lower.plot(data["time_s"], style.gaps(data["difference"]), color=style.RED, linewidth=0.9)
    lower.set_ylabel(data["difference_label"])
    lower.set_xlabel("time, s")
    lower.set_xlim(data["time_s"][0], data["time_s"][-1])
    fig.align_ylabels([upper, lower])
