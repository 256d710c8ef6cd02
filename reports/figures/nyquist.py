"""Nyquist figure around the critical point, with the modulus circle and every crossing.

Data: ``real``, ``imag`` (null where the curve leaves the frame); ``modulus`` (distance) and
``modulus_point`` [re, im] or null; ``gain_points`` (real coordinates), ``phase_points`` [re, im]; ``reach``.
"""

from __future__ import annotations

import math
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from reports.figures import style

SIZE = (5.2, 5.0)


def draw(data: dict[str, Any], fig: Figure) -> None:
    """Draw the curve, its mirror image and the circles."""
    ax = fig.add_subplot()
    real, imag = style.gaps(data["real"]), style.gaps(data["imag"])
    ax.axhline(0.0, color=style.MUTED, linewidth=0.8)
    ax.axvline(0.0, color=style.MUTED, linewidth=0.8)
    ax.add_patch(Circle((0, 0), 1.0, fill=False, edgecolor=style.MUTED, linestyle=(0, (3, 2)), linewidth=0.9))
    ax.plot(real, imag, color=style.BLUE, label="L(jω), ω > 0")
    ax.plot(real, [-y for y in imag], color=style.BLUE, linewidth=1.0, linestyle=(0, (4, 2)), label="ω < 0")
    _modulus(data, ax)
    for x in data.get("gain_points", ()):
        ax.plot([x], [0.0], marker="s", markersize=5, color=style.RED, linestyle="none")
    for x, y in data.get("phase_points", ()):
        ax.plot([x], [y], marker="o", markersize=5, color=style.GREEN, linestyle="none")
    ax.plot([-1], [0], marker="+", markersize=11, markeredgewidth=2, color=style.INK, linestyle="none")
    ax.annotate("−1", (-1, 0), xytext=(-6, -11), textcoords="offset points", ha="right", fontsize=9)
    _frame(data, ax, fig)


def _modulus(data: dict[str, Any], ax: Axes) -> None:
    """Draw the circle about -1 that the curve just touches."""
    distance, point = data.get("modulus"), data.get("modulus_point")
    if distance is None or distance <= 0:
        return
    label = f"modulus circle, {distance:.3f}"
    ax.add_patch(Circle((-1, 0), distance, facecolor=style.ORANGE, alpha=0.10, edgecolor="none"))
    ax.add_patch(Circle((-1, 0), distance, fill=False, edgecolor=style.ORANGE, linewidth=1.3, label=label))
    if point is not None:
        ax.plot([-1, point[0]], [0, point[1]], color=style.ORANGE, linewidth=1.2)
        ax.plot([point[0]], [point[1]], marker="D", markersize=4.5, color=style.ORANGE, linestyle="none")


def _frame(data: dict[str, Any], ax: Axes, fig: Figure) -> None:
    """Keep -1 and the unit circle in view, whatever the curve does far away."""
    reach = data.get("reach", 1.6)
    ax.set_aspect("equal")
    ax.set_xlim(-1.0 - reach, reach - 0.35)
    ax.set_ylim(-reach, reach)
    ax.set_xlabel("real part of L")
    ax.set_ylabel("imaginary part of L")
    fig.legend(loc="outside lower center", ncols=3, fontsize=8)
    step = 0.5 if reach < 3 else 2.0 ** math.ceil(math.log2(reach / 4))
    ax.xaxis.set_major_locator(style.multiples(step))
    ax.yaxis.set_major_locator(style.multiples(step))
