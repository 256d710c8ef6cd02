"""The drive as a block diagram with every key of a design file at its place, drawn from the registry of keys.

Written as a page of its own at each build; only where a section stands is said here.
"""

from __future__ import annotations

from html import escape
from itertools import groupby
from typing import Any

WIDTH, GAP, LINE, HEAD, BETWEEN = 190, 34, 15, 26, 58
ROWS: tuple[tuple[tuple[str, ...], ...], ...] = (
    (("command",), ("control.position",), ("control.velocity",), ("control.velocity.filter.*",),
     ("control.current",)),
    (("instruments",), ("output_encoder",), ("encoder",), ("limits",), ("supply",)),
    (("load", "load.gravity", "load.friction"), ("coupling",), ("gear.*", "screw"),
     ("friction", "friction.point.*"), ("motor", "temperature")),
)  # fmt: skip
"""Sections of each box, row by row: controller; sensors and limits; drive train, load to motor."""
_STYLE = """<style>
.keys-wide { overflow-x: auto; }
.keys-diagram { width: 100%; min-width: 820px; height: auto; font-size: 12px; }
.keys-diagram text { fill: var(--pst-color-text-base); }
.keys-diagram a text { fill: var(--pst-color-link); }
.keys-diagram .head { font-weight: 600; }
.keys-diagram rect { fill: var(--pst-color-surface); stroke: var(--pst-color-border); }
.keys-diagram path { fill: none; stroke: var(--pst-color-text-muted); stroke-width: 1.5; }
</style>"""


def _sections() -> dict[str, list[Any]]:
    from actuator_lti.design.key_reference import key_reference

    return {name: list(keys) for name, keys in groupby(key_reference(), key=lambda key: key.section)}


def drawn_sections() -> set[str]:
    """The sections that have a place."""
    return {section for row in ROWS for box in row for section in box}


def diagram_svg() -> str:
    """The diagram; each key says its meaning where the pointer rests on it."""
    sections = _sections()
    parts, top, tops = [], 10, []
    for row in ROWS:
        tops.append(top)
        height = max(_height(sections, box) for box in row)
        for column, box in enumerate(row):
            parts.append(_box(sections, box, _left(column), top))
        top += height + BETWEEN
    parts += [f'<path d="{line}" marker-end="url(#tip)"/>' for line in _lines(sections, tops)]
    width = 2 * 8 + 5 * WIDTH + 4 * GAP
    tip = '<marker id="tip" orient="auto" markerWidth="7" markerHeight="7" refX="6" refY="3.5">'
    tip += '<path d="M0,0 L7,3.5 L0,7"/></marker>'
    return (
        f'<svg class="keys-diagram" viewBox="0 0 {width} {top - BETWEEN + 10}" role="img" '
        f'aria-label="block diagram of the drive with the keys of a design file"><defs>{tip}</defs>'
        f"{''.join(parts)}</svg>"
    )


def _left(column: int) -> int:
    return 8 + column * (WIDTH + GAP)


def _height(sections: dict[str, list[Any]], box: tuple[str, ...]) -> int:
    return sum(HEAD + LINE * len(sections[name]) + 8 for name in box)


def _box(sections: dict[str, list[Any]], box: tuple[str, ...], left: int, top: int) -> str:
    """Title and keys of each section of a box."""
    parts, y = [f'<rect x="{left}" y="{top}" width="{WIDTH}" height="{_height(sections, box)}" rx="4"/>'], top
    for name in box:
        parts.append(f'<text class="head" x="{left + 9}" y="{y + 18}">[{escape(name)}]</text>')
        for number, key in enumerate(sections[name]):
            words = escape(key.description + (f", in {key.unit}" if key.unit != "1" else ""))
            parts.append(
                f'<a href="keys.html"><title>{words}</title><text x="{left + 9}" '
                f'y="{y + HEAD + 10 + LINE * number}">{escape(key.key)}</text></a>'
            )
        y += HEAD + LINE * len(sections[name]) + 8
    return "".join(parts)


def _lines(sections: dict[str, list[Any]], tops: list[int]) -> list[str]:
    """Signal paths: along the cascade, down to the motor, along the train, and back through the sensors."""
    across = [f"M{_left(k) + WIDTH},{tops[0] + 18} h{GAP}" for k in range(4)]
    train = [f"M{_left(k + 1)},{tops[2] + 18} h{-GAP}" for k in range(4)]
    last = _left(4) + WIDTH // 2
    down = [
        f"M{last},{tops[0] + _height(sections, ROWS[0][4])} V{tops[1]}",
        f"M{last},{tops[1] + _height(sections, ROWS[1][4])} V{tops[2]}",
    ]
    back = []
    for sensor, shaft in ((2, 4), (1, 1)):  # of the motor's shaft, of the output's
        middle, bottom = _left(sensor) + WIDTH // 2, tops[1] + _height(sections, ROWS[1][sensor])
        back.append(f"M{_left(shaft) - GAP // 2},{tops[2] + 18} V{tops[2] - 24} H{middle} V{bottom}")
        back.append(f"M{middle},{tops[1]} V{tops[0] + _height(sections, ROWS[0][sensor])}")
    return across + train + down + back


def diagram_page() -> str:
    """The page: the diagram, and the sections that are no part of it."""
    rest = [f"`[{name}]`" if name else "the head" for name in _sections() if name not in drawn_sections()]
    return "\n".join(
        [
            "# The drive and its keys",
            "",
            "Every key of a design file where it acts; the pointer on a key shows its meaning and unit, a",
            "click leads to [the list](keys.md). Only `[motor]`, `[limits]` and `[control]` must be there:",
            "what a drive lacks is left out, and what remains is wired in the same order.",
            "",
            "```{raw} html",
            _STYLE,
            f'<div class="keys-wide" tabindex="0">{diagram_svg()}</div>',
            "```",
            "",
            f"Elsewhere: {', '.join(rest)}.",
        ]
    )
