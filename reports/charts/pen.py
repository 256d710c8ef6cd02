"""Elements of SVG in the colours of a page or of paper."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from reports.charts.axis import Axis
from reports.charts.chart import COLOURS, Look
from reports.charts.labels import LINE_EM
from reports.visible import escape

FAR = 1e5
_VARIABLES = {name: f"var(--{name},{colour})" for name, colour in COLOURS.items()}
DASHES = ("", "9 4", "3 3", "10 4 2.5 4", "1.5 2.5", "14 5", "6 2.5")  # lengths of dash and gap
MARKER_PATHS = {
    "o": "M-1 0a1 1 0 1 0 2 0a1 1 0 1 0-2 0z",
    "s": "M-.9-.9h1.8v1.8h-1.8z",
    "D": "M0-1.2L1.2 0L0 1.2L-1.2 0z",
    "^": "M0-1.1L1.1 .9H-1.1z",
    "v": "M0 1.1L1.1-.9H-1.1z",
    "<": "M-1.1 0L.9-1.1V1.1z",
    ">": "M1.1 0L-.9-1.1V1.1z",
    "+": "M-1 0H1M0-1V1",
    "x": "M-.8-.8L.8 .8M-.8 .8L.8-.8",
    ".": "M-.6 0a.6 .6 0 1 0 1.2 0a.6 .6 0 1 0-1.2 0z",
    "2": "M0 0V-1M0 0L-.87 .5M0 0L.87 .5",
}
HATCH_PATHS = {
    "//": "M-1 1L1-1M0 6L6 0M5 7L7 5",
    "--": "M0 3H6",
    "||": "M3 0V6",
    "\\\\": "M-1 5L1 7M0 0L6 6M5-1L7 1",
    "+": "M0 3H6M3 0V6",
    "x": "M0 0L6 6M0 6L6 0",
}


@dataclass(frozen=True)
class Frame:
    """The rectangle of a panel's axes, in units of the view box."""

    left: float
    top: float
    right: float
    bottom: float

    @property
    def width(self) -> float:
        return self.right - self.left

    @property
    def height(self) -> float:
        return self.bottom - self.top

    def x(self, axis: Axis, values: Sequence[float] | np.ndarray) -> np.ndarray:
        return np.clip(self.left + self.width * axis.place(values), -FAR, FAR)

    def y(self, axis: Axis, values: Sequence[float] | np.ndarray) -> np.ndarray:
        return np.clip(self.bottom - self.height * axis.place(values), -FAR, FAR)


@dataclass(frozen=True)
class Pen:
    """Writes elements in the colours of a page or of paper; ids begin with the prefix."""

    prefix: str
    page: bool
    keys: Mapping[str, int]

    def within(self, k: int) -> Pen:
        return replace(self, prefix=f"{self.prefix}-{k}")

    def style(self, **wanted: str) -> str:
        """Write colours and widths: as style on a page, where variables count, else as attributes."""
        colours = _VARIABLES if self.page else COLOURS
        said = {key.replace("_", "-"): colours.get(value, value) for key, value in wanted.items() if value}
        if self.page:
            return 'style="' + ";".join(f"{key}:{value}" for key, value in said.items()) + '"'
        return " ".join(f'{key}="{value}"' for key, value in said.items())

    def line(self, path: str, look: Look, more: str = "") -> str:
        stroke = self.style(
            fill="none", stroke=look.colour, stroke_width=f"{look.width:g}",
            stroke_dasharray=DASHES[look.dash % len(DASHES)],
            stroke_opacity="" if look.opacity == 1.0 else f"{look.opacity:g}", stroke_linejoin="round",
        )  # fmt: skip
        return f'<path{more} d="{path}" {stroke}/>'

    def filled(self, path: str, look: Look, more: str = "") -> str:
        fill, opacity = look.fill or look.colour, "" if look.opacity == 1.0 else f"{look.opacity:g}"
        edge = {"stroke": look.colour if look.width else "none"}
        edge |= {"stroke_width": f"{look.width:g}"} if look.width else {}
        body = f'<path{more} d="{path}" {self.style(fill=fill, fill_opacity=opacity, **edge)}/>'
        if not look.hatch:
            return body
        over = "paper" if fill != "none" else look.colour
        lines = self.style(stroke=over, stroke_width="1", fill="none")
        return (
            f'{body}<pattern id="{self.prefix}h" width="6" height="6" patternUnits="userSpaceOnUse">'
            f'<path d="{HATCH_PATHS[look.hatch]}" {lines}/></pattern>'
            f'<path{more} d="{path}" fill="url(#{self.prefix}h)"/>'
        )

    def marker(self, look: Look, x: float, y: float) -> str:
        place = f"translate({x:.2f} {y:.2f}) scale({look.size / 2:g})"
        return f'<path d="{MARKER_PATHS[look.marker]}" transform="{place}" {self.marker_style(look)}/>'

    def marker_style(self, look: Look) -> str:
        """Give the style of a marker; its lines keep their width whatever its size."""
        open_sign = look.marker in "+x2"
        fill = "none" if open_sign else "paper" if look.hollow else look.colour
        width = 3.2 / look.size if (look.hollow or open_sign) else 1.0 / look.size
        return self.style(fill=fill, stroke=look.colour, stroke_width=f"{width:.3g}")

    def words(
        self, words: str, x: float, y: float, *, size: float, anchor: str = "start", colour: str = "ink",
        bold: bool = False, more: str = "",
    ) -> str:  # fmt: skip
        lines = words.split("\n")
        weight = ' font-weight="600"' if bold else ""
        side = "" if anchor == "start" else f' text-anchor="{anchor}"'
        look, text = f"{side}{weight}{more} {self.style(fill=colour)}", escape(words)
        if len(lines) > 1:
            steps = [LINE_EM * size * bool(k) for k in range(len(lines))]
            spans = zip(steps, map(escape, lines), strict=True)
            text = "".join(f'<tspan x="{x:.1f}" dy="{dy:.1f}">{line}</tspan>' for dy, line in spans)
        return f'<text x="{x:.1f}" y="{y:.1f}" font-size="{size:g}"{look}>{text}</text>'
