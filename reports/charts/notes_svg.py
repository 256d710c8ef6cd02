"""The words inside a panel: each near its point, over no curve, inside the frame."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from reports.charts.chart import Item, Note, Panel, Rule
from reports.charts.labels import Room, text_box
from reports.charts.pen import Frame, Pen

NOTE = 10.5
LEADER = 26.0  # words further away from their point are tied to it by a line


def by_need(items: Sequence[Item]) -> list[Item]:
    """Give what has words, the pinned ones first: they cannot give way."""
    wordy = [item for item in items if (isinstance(item, Rule | Note) and item.words)]
    return sorted(wordy, key=lambda item: 0 if isinstance(item, Note) and item.pinned else 1)


def note_svg(item: Item, panel: Panel, frame: Frame, pen: Pen, room: Room) -> str:
    """Write the words of a rule or note where they cover nothing."""
    assert isinstance(item, Rule | Note)
    w, h = text_box(item.words, NOTE)
    size = (w + 6.0, h + 2.0)
    if isinstance(item, Rule):
        return _rule_words(item, panel, frame, pen, room, size)
    if item.at is None:
        box = room.corner(item.corner or "top left", size)
        return _boxed(item, box, pen, "")
    (x,), (y,) = frame.x(panel.x, [item.at[0]]), frame.y(panel.y, [item.at[1]])
    x, y = float(np.clip(x, frame.left, frame.right)), float(np.clip(y, frame.top, frame.bottom))
    tied = f' data-at="{x:.2f} {y:.2f}"' if pen.page else ""
    if item.pinned:
        box = (x - size[0] / 2, y - size[1] / 2, x + size[0] / 2, y + size[1] / 2)
        room.boxes.append(box)
        return _boxed(item, box, pen, tied)
    box, distance = room.near((x, y), size, over=item.over)
    leader = ""
    if distance > LEADER and not item.over:
        ex, ey = float(np.clip(x, box[0], box[2])), float(np.clip(y, box[1], box[3]))
        thin = pen.style(stroke="muted", stroke_width="0.8", fill="none")
        leader = f'<path class="leader" d="M{x:.1f} {y:.1f}L{ex:.1f} {ey:.1f}" {thin}/>'
    return _boxed(item, box, pen, tied, leader)


def _boxed(item: Note, box: tuple[float, float, float, float], pen: Pen, tied: str, leader: str = "") -> str:
    words = pen.words(
        item.words, box[0] + 3.0, box[1] + 1.0 + NOTE, size=NOTE, colour=item.colour, bold=item.bold
    )
    back = (
        f'<rect x="{box[0]:.1f}" y="{box[1]:.1f}" width="{box[2] - box[0]:.1f}" '
        f'height="{box[3] - box[1]:.1f}" rx="2" {pen.style(fill="paper", fill_opacity="0.82")}/>'
    )
    return f'<g class="note"{tied}>{leader}{back}{words}</g>'


def _rule_words(
    item: Rule, panel: Panel, frame: Frame, pen: Pen, room: Room, size: tuple[float, float]
) -> str:
    w, h = size
    note = Note(words=item.words, colour=item.look.colour)
    if item.across == "y":
        (at,) = frame.y(panel.y, [item.at])
        if not frame.top - 1 <= at <= frame.bottom + 1:
            return ""
        lefts = [frame.right - w - 4, frame.left + 4, (frame.left + frame.right - w) / 2]
        boxes = [(x, y, x + w, y + h) for x in lefts for y in (at - h - 2, at + 3)]
        tied = f"{frame.right:.1f} {at:.2f}"
    else:
        (at,) = frame.x(panel.x, [item.at])
        if not frame.left - 1 <= at <= frame.right + 1:
            return ""
        tops = [frame.top + 4, frame.bottom - h - 4, (frame.top + frame.bottom - h) / 2]
        boxes = [(x, y, x + w, y + h) for y in tops for x in (at + 4, at - w - 4)]
        tied = f"{at:.2f} {frame.top:.1f}"
    return _boxed(note, room.first_free(boxes), pen, f' data-at="{tied}"' if pen.page else "")
