"""The one style of all figures, and how a figure becomes an SVG that follows the page's colours.

Colours are those of Okabe and Ito (colour-blind safe); every series also has its own dash, so that a
figure can be read without colour.  Text stays text in the page's own font.
"""

from __future__ import annotations

import io
import math
import re
from collections.abc import Callable, Sequence
from typing import Any

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, MultipleLocator, NullFormatter

INK = "#1f2933"
MUTED = "#66727f"
GRID = "#dde2e7"
PAPER = "#fefefe"
BLUE, ORANGE, GREEN, RED, PURPLE, SKY, BROWN = (
    "#0072b2",
    "#c46200",
    "#00805f",
    "#c0392b",
    "#8e4585",
    "#3a8fc4",
    "#7a5c1e",
)
SERIES = (BLUE, ORANGE, GREEN, PURPLE, RED, SKY, BROWN)
DASHES: tuple[Any, ...] = (
    "-",
    (0, (6, 2)),
    (0, (2, 1.5)),
    (0, (7, 2, 1.5, 2)),
    (0, (1, 1.2)),
    (0, (9, 3)),
    (0, (4, 1)),
)

# What a page may recolour: the light colour stands in the SVG as the fallback of its variable.
VARIABLES = {
    INK: "--ink",
    MUTED: "--muted",
    GRID: "--grid",
    PAPER: "--paper",
    BLUE: "--c1",
    ORANGE: "--c2",
    GREEN: "--c3",
    RED: "--c5",
    PURPLE: "--c4",
    SKY: "--c6",
    BROWN: "--c7",
}

STYLE: dict[str, Any] = {
    "svg.fonttype": "none",
    "text.parse_math": False,
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": 9.0,
    "axes.titlesize": 9.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": 9.0,
    "axes.labelcolor": INK,
    "axes.edgecolor": MUTED,
    "axes.facecolor": "none",
    "axes.linewidth": 0.8,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.unicode_minus": True,
    "axes.formatter.use_mathtext": False,
    "figure.facecolor": "none",
    "savefig.facecolor": "none",
    "grid.color": GRID,
    "grid.linewidth": 0.7,
    "text.color": INK,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "xtick.labelsize": 8.5,
    "ytick.labelsize": 8.5,
    "xtick.minor.visible": False,
    "lines.linewidth": 1.7,
    "lines.solid_capstyle": "round",
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "legend.handlelength": 2.6,
    "path.simplify": True,
    "path.simplify_threshold": 0.2,
    "timezone": "UTC",
}


def render(
    draw: Callable[[dict[str, Any], Figure], None],
    data: dict[str, Any],
    *,
    size: tuple[float, float],
    prefix: str,
    page: bool,
) -> str:
    """Draw with the one style and give the SVG element; the same data give the same bytes."""
    settings: dict[Any, Any] = {**STYLE, "svg.hashsalt": prefix}
    with matplotlib.rc_context(settings):
        fig = Figure(figsize=size, layout="constrained")
        draw(data, fig)
        buffer = io.StringIO()
        fig.savefig(
            buffer, format="svg", metadata={"Date": None, "Creator": None, "Format": None, "Type": None}
        )
    return _tidy(buffer.getvalue(), prefix, page)


def log_frequency(ax: Axes, label: str = "frequency, Hz") -> None:
    """Make the x axis logarithmic with plain numbers."""
    ax.set_xscale("log")
    ax.xaxis.set_major_locator(LogLocator(base=10.0, numticks=12))
    ax.xaxis.set_minor_locator(LogLocator(base=10.0, subs=(2.0, 5.0), numticks=12))
    ax.xaxis.set_major_formatter(FuncFormatter(plain_decade))
    ax.xaxis.set_minor_formatter(NullFormatter())
    if label:
        ax.set_xlabel(label)


def plain_decade(value: float, _position: int | None = None) -> str:
    """Write a tick such as 0.1, 10, 1k.

    Examples
    --------
    >>> plain_decade(0.01), plain_decade(100.0), plain_decade(2e4)
    ('0.01', '100', '20k')
    """
    for scale, letter in ((1e6, "M"), (1e3, "k")):
        if value >= scale:
            return f"{value / scale:g}{letter}"
    return f"{value:g}"


def phase_ticks(ax: Axes, low: float, high: float) -> None:
    """Put the ticks of a phase axis at multiples of 15, 45, 90, ... degrees."""
    step = next((s for s in (15.0, 45.0, 90.0, 180.0, 360.0, 720.0) if (high - low) / s <= 7), 1440.0)
    first = step * int(low // step)
    ticks = [first + step * k for k in range(int((high - first) // step) + 2)]
    ax.set_yticks([tick for tick in ticks if low <= tick <= high])


def powers(value: float, _position: int | None = None) -> str:
    """Write a tick as a power of ten.

    Examples
    --------
    >>> powers(1e-6), powers(1.0), powers(1000.0)
    ('10⁻⁶', '1', '10³')
    """
    exponent = round(math.log10(value))
    raised = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
    return "1" if exponent == 0 else "10" + str(exponent).translate(raised)


HATCHES = ("", "//", "--", "||", "\\\\", "+", "x")


def gaps(values: Sequence[float | None]) -> list[float]:
    """Turn the nulls of JSON into gaps of a curve."""
    return [math.nan if value is None else value for value in values]


def bound(ax: Axes, values: Sequence[float | None], *, span: float, top_room: float) -> None:
    """Set the y limits to the values, at most so much below the highest, with some room above."""
    known = [value for value in values if value is not None]
    high, low = max(known, default=1.0), min(known, default=0.0)
    low = max(low, high - span)
    height = max(high - low, 1.0)
    ax.set_ylim(low - 0.04 * height, high + top_room * height)


def multiples(step: float) -> MultipleLocator:
    """Put ticks at multiples of a step."""
    return MultipleLocator(step)


def tag(
    ax: Axes,
    words: str,
    at: tuple[float, float],
    data: dict[str, Any],
    *,
    below: bool | None,
    left: bool | None = None,
) -> None:
    """Label a point above or below it (None: beside), on the side said or where the frame has room."""
    first, last = data["frequency_hz"][0], data["frequency_hz"][-1]
    if left is None:
        left = math.log(at[0] / first) > 0.72 * math.log(last / first)
    dy, va = {None: (0, "center"), True: (-3, "top"), False: (4, "bottom")}[below]
    place: dict[str, Any] = {"ha": "right" if left else "left", "va": va, "linespacing": 1.25}
    ax.annotate(
        words,
        at,
        xytext=(-8 if left else 8, dy),
        textcoords="offset points",
        fontsize=8.5,
        bbox=label_box(),
        zorder=5,
        **place,
    )


def hertz(value: float) -> str:
    """Write a frequency with its unit.

    Examples
    --------
    >>> hertz(88.457), hertz(1909.4)
    ('88.5 Hz', '1.91 kHz')
    """
    return f"{value / 1e3:.3g} kHz" if value >= 1e3 else f"{value:.3g} Hz"


def label_box() -> dict[str, Any]:
    """Give the background that keeps a label readable over curves."""
    return {"boxstyle": "round,pad=0.2", "facecolor": PAPER, "edgecolor": "none", "alpha": 0.85}


def _tidy(svg: str, prefix: str, page: bool) -> str:
    """Keep only the element: needless ids go, the others become unique, font and colours are the page's."""
    svg = svg[svg.index("<svg") :]
    svg = re.sub(r"<metadata>.*?</metadata>\s*", "", svg, flags=re.DOTALL)
    svg = re.sub(r"<!--.*?-->\s*", "", svg, flags=re.DOTALL)
    svg = re.sub(r'<g id="[A-Za-z0-9.]+_\d+(?:_\d+)?"', "<g", svg)
    svg = re.sub(r'<defs>\s*<style type="text/css">.*?</style>\s*</defs>\s*', "", svg, flags=re.DOTALL)
    svg = re.sub(r'\bid="([mpch][0-9a-f]{6,})"', rf'id="{prefix}-\1"', svg)
    svg = re.sub(r"(#)([mpch][0-9a-f]{6,})\b", rf"\1{prefix}-\2", svg)
    svg = re.sub(r' transform="rotate\(-0 [^"]*"', "", svg)
    svg = re.sub(r"<[^>]+>", _shorten, svg)
    svg = re.sub(r"\n\s*", "\n", svg)
    if not page:
        return svg
    svg = re.sub(r" font-family: [^;\"]*;", "", svg)
    svg = re.sub(r"font: ((?:\d+ |bold |italic )*)([\d.]+)px [^;\"]*", _font, svg)
    svg = re.sub(r'<svg ([^>]*?)width="([\d.]+)pt" height="([\d.]+)pt"|<svg ', _fluid, svg, count=1)
    for colour, name in VARIABLES.items():
        svg = re.sub(rf'{colour}(?=[;"])', f"var({name},{colour})", svg)
    return svg


def _shorten(tag: re.Match[str]) -> str:
    """Keep two decimals of each coordinate: a hundredth of a point is more than a screen shows."""
    return re.sub(r"(?<=[\s\"(])(-?\d+\.\d\d)\d+(?=[\s\")])", r"\1", tag.group())


def _font(match: re.Match[str]) -> str:
    """Keep weight and size; the family comes from the page."""
    words = match.group(1).split()
    weight = next((word for word in words if word == "bold" or word.isdigit()), "")
    return f"font-size:{match.group(2)}px" + (f";font-weight:{weight}" if weight else "")


def _fluid(match: re.Match[str]) -> str:
    """Let the page set the width; the view box keeps the proportions."""
    return "<svg " + (match.group(1) or "")
