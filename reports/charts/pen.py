"""Elements of SVG in the colours of a page or of paper."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from reports.charts.axis import Axis
from reports.charts.chart import Look
from reports.charts.labels import LINE_EM
from reports.charts.paint import COLOURS, DASHES, HATCH_PATHS, MARKER_PATHS, paint
from reports.visible import escape

FAR = 1e5


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
        resolved = {
            key.replace("_", "-"): paint(value, self.page) if value in COLOURS else value
            for key, value in wanted.items()
            if value != ""
        }
        if self.page:
            return 'style="' + ";".join(f"{key}:{value}" for key, value in resolved.items()) + '"'
        return " ".join(f'{key}="{value}"' for key, value in resolved.items())

    def line(self, path: str, look: Look, more: str = "") -> str:
        stroke = self.style(
            fill="none", stroke=look.colour, stroke_width=f"{look.width:g}",
            stroke_dasharray=DASHES[look.dash % len(DASHES)],
            stroke_opacity="" if look.opacity == 1.0 else f"{look.opacity:g}", stroke_linejoin="round",
        )  # fmt: skip
        return f'<path{more} d="{path}" {stroke}/>'

    def filled(self, path: str, look: Look, more: str = "") -> str:
        fill = look.fill or look.colour
        opacity = "" if look.opacity == 1.0 else f"{look.opacity:g}"
        edge = {"stroke": "none"}
        if look.width:
            edge = {"stroke": look.colour, "stroke_width": f"{look.width:g}"}
        body = f'<path{more} d="{path}" {self.style(fill=fill, fill_opacity=opacity, **edge)}/>'
        if not look.hatch:
            return body
        name = f"{self.prefix}h"
        over = "paper" if fill != "none" else look.colour
        lines = self.style(stroke=over, stroke_width="1", fill="none")
        pattern = (
            f'<pattern id="{name}" width="6" height="6" patternUnits="userSpaceOnUse">'
            f'<path d="{HATCH_PATHS[look.hatch]}" {lines}/></pattern>'
        )
        return f'{body}{pattern}<path{more} d="{path}" fill="url(#{name})"/>'

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
