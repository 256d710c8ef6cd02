"""One panel as SVG: grid, ticks, curves, marks; the words near their points, over no curve, in the frame."""

from typing import Any

import numpy as np

from reports.charts.axis import minor_ticks
from reports.charts.chart import Curve, Item, Note, Panel, Rule, Shape
from reports.charts.labels import LINE_EM, Room, distance, text_width
from reports.charts.pen import FAR, MARKER_PATHS, Frame, Pen
from reports.visible import escape

TICK, LABEL, TITLE = 10.5, 11.5, 12.0
RULE_LENGTH = 3000  # of rules; longer ones cost a browser dear where they are dashed


def panel_svg(panel: Panel, frame: Frame, pen: Pen, *, hide_x: bool) -> str:
    room = Room((frame.left + 2, frame.top + 2, frame.right - 2, frame.bottom - 2))
    drawn = [_item(item, panel, frame, pen.within(k), room) for k, item in enumerate(panel.items)]
    world, marks = ("".join(parts) for parts in zip(("", ""), *drawn, strict=True))
    clip = f"{pen.prefix}c"
    wordy = [item for item in panel.items if isinstance(item, Rule | Note) and item.words]
    wordy.sort(key=lambda item: not (isinstance(item, Note) and item.pinned))  # which cannot give way
    notes = "".join(note_svg(item, panel, frame, pen, room) for item in wordy)
    inside = (
        f'<clipPath id="{clip}"><rect x="{frame.left:.1f}" y="{frame.top:.1f}" width="{frame.width:.1f}" '
        f'height="{frame.height:.1f}"/></clipPath><g clip-path="url(#{clip})">'
        f'<g class="world">{world}</g><g class="marks">{marks}</g></g>'
    )
    axes = _axes(panel, frame, pen, hide_x=hide_x)
    known = _data(panel, frame, hide_x) if pen.page else ""
    return f'<g class="panel"{known}>{axes}{inside}<g class="notes">{notes}</g></g>'


def _data(panel: Panel, frame: Frame, hide_x: bool) -> str:
    """Write what the script must know of the axes."""
    parts, across, up = [], (frame.left, frame.right), (frame.bottom, frame.top)
    for key, axis, ends in (("x", panel.x, across), ("y", panel.y, up)):
        low, high = axis.span()
        a, b = ends[::-1] if axis.reversed else ends
        kind = "log" if axis.log else "days" if axis.days else "lin"
        parts.append(f' data-{key}="{kind} {low:.9g} {high:.9g} {a:.2f} {b:.2f}"')
        parts.append(f' data-{key}l="{escape(axis.name or axis.label.replace(chr(10), " "))}"')
        parts.append(f' data-{key}fixed="1"' * (axis.ticks is not None))
    said = ' data-hide="1"' * hide_x + ' data-equal="1"' * panel.equal + ' data-mode="xy"' * panel.by_point
    return "".join(parts) + said


def _axes(panel: Panel, frame: Frame, pen: Pen, *, hide_x: bool) -> str:
    xs = panel.x.named_ticks(max(3, int(frame.width / (40 if panel.x.log else 58))))
    ys = panel.y.named_ticks(room_y(panel, frame.height))
    px, py = frame.x(panel.x, [v for v, _ in xs]), frame.y(panel.y, [v for v, _ in ys])
    across = "".join(f"M{x:.1f} {frame.top:.1f}V{frame.bottom:.1f}" for x in px) if panel.x.grid else ""
    up = "".join(f"M{frame.left:.1f} {y:.1f}H{frame.right:.1f}" for y in py) if panel.y.grid else ""
    small = "".join(f"M{x:.1f} {frame.bottom:.1f}v-3" for x in frame.x(panel.x, minor_ticks(panel.x)))
    small += "".join(f"M{frame.left:.1f} {y:.1f}h3" for y in frame.y(panel.y, minor_ticks(panel.y)))
    thin = pen.style(fill="none", stroke="grid", stroke_width="0.8")
    edge = pen.style(fill="none", stroke="muted", stroke_width="0.9")
    box = f"M{frame.left:.1f} {frame.top:.1f}V{frame.bottom:.1f}H{frame.right:.1f}"
    parts = [f'<path class="grid" d="{across}{up}" {thin}/><path class="edge" d="{box}{small}" {edge}/>']
    shown = [] if hide_x else zip(px, xs, strict=True)
    low, left = frame.bottom + 14.0, frame.left - 5.0
    below = [pen.words(words, x, low, size=TICK, anchor="middle") for x, (_, words) in shown]
    beside = [pen.words(w, left, y + 3.7, size=TICK, anchor="end") for y, (_, w) in zip(py, ys, strict=True)]
    parts.append(f'<g class="xt">{"".join(below)}</g><g class="yt">{"".join(beside)}</g>')
    middle: dict[str, Any] = {"size": LABEL, "anchor": "middle"}
    if panel.x.label and not hide_x:
        low = frame.bottom + (17.0 if xs else 3.0) + LABEL
        parts.append(pen.words(panel.x.label, (frame.left + frame.right) / 2.0, low, **middle))
    if panel.y.label:
        rotated = (frame.top + frame.bottom) / 2.0
        turn = f' transform="rotate(-90 11 {rotated:.1f})"'
        parts.append(pen.words(panel.y.label, 11.0, rotated, **middle, more=turn))
    if panel.title:
        parts.append(pen.words(panel.title, frame.left, frame.top - 7.0, size=TITLE, bold=True))
    return "".join(parts)


def room_y(panel: Panel, height: float) -> int:
    return min(max(2, int(height / 24)), 7) if panel.y.ticks is None else 99


def _item(item: Item, panel: Panel, frame: Frame, pen: Pen, room: Room) -> tuple[str, str]:
    """Write what scales with the axes, and the markers, which only move."""
    if isinstance(item, Note):
        return "", ""
    key = f' data-k="{pen.keys[item.label]}"' if item.label else ""
    if isinstance(item, Curve):
        return _curve(item, panel, frame, pen, room, key)
    if isinstance(item, Rule):
        return _rule(item, panel, frame, pen, room, key), ""
    if isinstance(item, Shape):
        rings = [(frame.x(panel.x, x), frame.y(panel.y, y)) for x, y in item.rings]
        if item.look.opacity > 0.5 or item.look.hatch:
            for x, y in rings:  # bars: words keep off them
                room.add_line(np.append(x, x[0]), np.append(y, y[0]))
                room.add_line(np.array([x.min(), x.max()]), np.array([y.mean(), y.mean()]))
        return pen.filled("".join(_path(x, y) + "z" for x, y in rings), item.look, key), ""
    if item.across == "x":
        a, b = frame.x(panel.x, [item.low, item.high])
        return pen.filled(f"M{a:.2f} -{FAR:.0f}V{FAR:.0f}H{b:.2f}V-{FAR:.0f}z", item.look, key), ""
    a, b = frame.y(panel.y, [item.low, item.high])
    return pen.filled(f"M-{FAR:.0f} {a:.2f}H{FAR:.0f}V{b:.2f}H-{FAR:.0f}z", item.look, key), ""


def _curve(item: Curve, panel: Panel, frame: Frame, pen: Pen, room: Room, key: str) -> tuple[str, str]:
    x, y = frame.x(panel.x, item.x), frame.y(panel.y, item.y)
    drawn, dots = "", ""
    if item.line:
        px, py = (np.repeat(x, 2)[1:], np.repeat(y, 2)[:-1]) if item.stairs else (x, y)
        more = f' class="curve{"" if item.read else " mute"}"{key}'
        more += ' data-stairs="1"' if item.stairs else ""
        if item.parameter is not None and pen.page:
            there = item.parameter[np.isfinite(x) & np.isfinite(y)]
            more += f' data-p="{" ".join(f"{v:.5g}" for v in there)}"'
        drawn = pen.line(_path(px, py), item.look, more if pen.page else "")
        room.add_line(px, py)
    if item.look.marker:
        keep = np.isfinite(x) & np.isfinite(y)
        keep &= np.arange(len(x)) % item.every == 0
        keep &= (x > frame.left - 9) & (x < frame.right + 9) & (y > frame.top - 9) & (y < frame.bottom + 9)
        dots = _dots(x[keep], y[keep], item, pen, key)
        room.add_points(x[keep], y[keep], item.look.size / 2.0 + 1.0)
    return drawn, dots


def _dots(x: np.ndarray, y: np.ndarray, item: Curve, pen: Pen, key: str) -> str:
    """Write markers: one drawn, the others refer to it."""
    if not len(x):
        return ""
    look, name = item.look, f"{pen.prefix}m"
    shape = f'<path id="{name}" d="{MARKER_PATHS[look.marker]}" transform="scale({look.size / 2:g})"/>'
    uses = "".join(f'<use href="#{name}" x="{a:.2f}" y="{b:.2f}"/>' for a, b in zip(x, y, strict=True))
    mute = "" if item.read and not item.line else " mute"
    own = f' class="dots{mute}"{key}' if pen.page else ""
    return f"<g{own} {pen.marker_style(look)}><defs>{shape}</defs>{uses}</g>"


def _rule(item: Rule, panel: Panel, frame: Frame, pen: Pen, room: Room, key: str) -> str:
    if item.across == "x":
        (at,) = frame.x(panel.x, [item.at])
        path, ends = f"M{at:.2f} -{RULE_LENGTH}V{RULE_LENGTH}", ([at, at], [frame.top, frame.bottom])
    else:
        (at,) = frame.y(panel.y, [item.at])
        path, ends = f"M-{RULE_LENGTH} {at:.2f}H{RULE_LENGTH}", ([frame.left, frame.right], [at, at])
    room.add_line(*map(np.array, ends))
    return pen.line(path, item.look, f' class="rule"{key}' if pen.page else "")


def _path(x: np.ndarray, y: np.ndarray) -> str:
    """Write a line with gaps: where it begins, then from point to point, in hundredths that do not drift."""
    good = np.isfinite(x) & np.isfinite(y)
    places = np.rint(100.0 * np.column_stack([x, y])[good]).astype(int)
    steps = np.diff(places, axis=0, prepend=0)
    begins = good & ~np.concatenate([[False], good[:-1]])
    return "".join(
        f"M{at[0] / 100} {at[1] / 100}" if first else f"l{by[0] / 100:.10g} {by[1] / 100:.10g}"
        for at, by, first in zip(places.tolist(), steps.tolist(), begins[good].tolist(), strict=True)
    )


NOTE = 10.5
LEADER = 26.0  # words further away from their point are tied to it by a line


def note_svg(item: Rule | Note, panel: Panel, frame: Frame, pen: Pen, room: Room) -> str:
    lines = item.words.split("\n")
    size = max(text_width(line, NOTE) for line in lines) + 6.0, LINE_EM * NOTE * len(lines) + 2.0
    if isinstance(item, Rule):
        return _rule_words(item, panel, frame, pen, room, size)
    if item.at is None:
        return _boxed(item, room.corner(item.corner or "top left", size), pen, "")
    (x,), (y,) = frame.x(panel.x, [item.at[0]]), frame.y(panel.y, [item.at[1]])
    x, y = float(np.clip(x, frame.left, frame.right)), float(np.clip(y, frame.top, frame.bottom))
    tied = f' data-at="{x:.2f} {y:.2f}"' if pen.page else ""
    if item.pinned:
        box = (x - size[0] / 2, y - size[1] / 2, x + size[0] / 2, y + size[1] / 2)
        room.boxes.append(box)
        return _boxed(item, box, pen, tied)
    box, leader = room.near((x, y), size, over=item.over), ""
    if distance(box, (x, y)) > LEADER and not item.over:
        ex, ey = float(np.clip(x, box[0], box[2])), float(np.clip(y, box[1], box[3]))
        thin = pen.style(stroke="muted", stroke_width="0.8", fill="none")
        leader = f'<path class="leader" d="M{x:.1f} {y:.1f}L{ex:.1f} {ey:.1f}" {thin}/>'
    return _boxed(item, box, pen, tied, leader)


def _boxed(item: Note, box: tuple[float, float, float, float], pen: Pen, tied: str, leader: str = "") -> str:
    x, y = box[0] + 3.0, box[1] + 1.0 + NOTE
    words = pen.words(item.words, x, y, size=NOTE, colour=item.colour, bold=item.bold)
    back = (
        f'<rect x="{box[0]:.1f}" y="{box[1]:.1f}" width="{box[2] - box[0]:.1f}" '
        f'height="{box[3] - box[1]:.1f}" rx="2" {pen.style(fill="paper", fill_opacity="0.82")}/>'
    )
    return f'<g class="note"{tied}>{leader}{back}{words}</g>'


def _rule_words(
    item: Rule, panel: Panel, frame: Frame, pen: Pen, room: Room, size: tuple[float, float]
) -> str:
    w, h = size
    if item.across == "y":
        (at,), ends = frame.y(panel.y, [item.at]), (frame.top, frame.bottom)
        lefts = [frame.right - w - 4, frame.left + 4, (frame.left + frame.right - w) / 2]
        boxes = [(x, y, x + w, y + h) for x in lefts for y in (at - h - 2, at + 3)]
        tied = f"{frame.right:.1f} {at:.2f}"
    else:
        (at,), ends = frame.x(panel.x, [item.at]), (frame.left, frame.right)
        tops = [frame.top + 4, frame.bottom - h - 4, (frame.top + frame.bottom - h) / 2]
        boxes = [(x, y, x + w, y + h) for y in tops for x in (at + 4, at - w - 4)]
        tied = f"{at:.2f} {frame.top:.1f}"
    if not ends[0] - 1 <= at <= ends[1] + 1:
        return ""
    note = Note(words=item.words, colour=item.look.colour)
    return _boxed(note, room.first_free(boxes), pen, f' data-at="{tied}"' if pen.page else "")
