"""Where words go: how wide they are, and the place near their point where nothing else stands."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from itertools import product

import numpy as np

NARROW, BROAD = set("iljtfrI.,:;|!'()[] "), set("mwMW%@—≥≤→")
LINE_EM = 1.28
PAD, INSET = 2.0, 6.0
COVERED, CROSSED, AWAY = 400.0, 6.0, 0.22  # what each fault of a place costs
DISTANCES = (7.0, 16.0, 30.0, 48.0, 70.0, 105.0, 150.0)
DIRECTIONS = tuple((math.cos(math.radians(a)), math.sin(math.radians(a))) for a in range(-60, 300, 30))

Box = tuple[float, float, float, float]


def text_width(words: str, size: float) -> float:
    """Estimate the width of a line of text, rather too wide than too narrow.

    >>> round(text_width("GM 9.4 dB", 10.0))
    49
    """
    return size * sum(0.33 if c in NARROW else 0.92 if c in BROAD else 0.6 for c in words)


@dataclass
class Room:
    """A frame in which words look for a place; knows what stands there already."""

    frame: Box
    ink: list[np.ndarray] = field(default_factory=list)
    boxes: list[Box] = field(default_factory=list)

    def add_line(self, x: np.ndarray, y: np.ndarray) -> None:
        """Keep words off a line, given by its corners."""
        good = np.isfinite(x) & np.isfinite(y)
        points = np.column_stack([x, y])
        pairs = good[1:] & good[:-1]
        start, stop = points[:-1][pairs], points[1:][pairs]
        low, high = np.minimum(start, stop), np.maximum(start, stop)
        near = (high >= self.frame[:2]).all(axis=1) & (low <= self.frame[2:]).all(axis=1)  # roughly
        start, stop = start[near], stop[near]
        if len(start):
            parts = min(max(int(float(np.max(np.abs(stop - start))) / 4.0), 1), 120)
            t = np.linspace(0.0, 1.0, parts + 1)[:, None, None]
            self.ink.append((start + t * (stop - start)).reshape(-1, 2))

    def add_points(self, x: np.ndarray, y: np.ndarray, size: float = 4.0) -> None:
        good = np.isfinite(x) & np.isfinite(y)
        for dx, dy in ((0, 0), (size, 0), (-size, 0), (0, size), (0, -size)):
            self.ink.append(np.column_stack([x[good] + dx, y[good] + dy]))

    def near(self, at: tuple[float, float], size: tuple[float, float], *, over: bool = False) -> Box:
        """Take the best place near a point; ``over`` it, if free."""
        return self._best((box, distance(box, at)) for box in _around(at, size, over))

    def corner(self, wanted: str, size: tuple[float, float]) -> Box:
        """Take the best corner, the one asked for where it is free."""
        x0, y0, x1, y1 = self.frame
        w, h = size
        across = {"left": x0 + INSET, "right": x1 - INSET - w, "middle": (x0 + x1 - w) / 2.0}
        up = {"top": y0 + INSET, "bottom": y1 - INSET - h, "center": (y0 + y1 - h) / 2.0}
        first_up, first_across = wanted.split()
        tops = [up.pop(first_up), *up.values()]
        lefts = [across.pop(first_across), *across.values()]
        return self.first_free([(x, y, x + w, y + h) for y in tops for x in lefts])

    def first_free(self, boxes: Iterable[Box]) -> Box:
        """Take the cheapest of some places, the earlier the better."""
        return self._best((box, 20.0 * k) for k, box in enumerate(boxes))

    def _best(self, boxes: Iterable[tuple[Box, float]]) -> Box:
        """Take the cheapest of places, each with how far it is from where it should be."""
        box, _ = min(boxes, key=lambda place: self._cost(place[0]) + AWAY * place[1])
        self.boxes.append(box)
        return box

    def _cost(self, box: Box) -> float:
        x0, y0, x1, y1 = box
        left, top, right, bottom = self.frame
        outside = max(left - x0, 0) + max(x1 - right, 0) + max(top - y0, 0) + max(y1 - bottom, 0)
        cost = 1e4 + 100.0 * outside if outside > 0.5 else 0.0
        cost += COVERED * sum(x0 < a1 and a0 < x1 and y0 < b1 and b0 < y1 for a0, b0, a1, b1 in self.boxes)
        self.ink = [np.concatenate([np.empty((0, 2)), *self.ink])] if len(self.ink) != 1 else self.ink
        x, y = self.ink[0].T
        crossed = (x > x0 - PAD) & (x < x1 + PAD) & (y > y0 - PAD) & (y < y1 + PAD)
        return cost + CROSSED * int(crossed.sum())


def _around(at: tuple[float, float], size: tuple[float, float], over: bool) -> Iterator[Box]:
    w, h = size
    if over:
        yield (at[0] - w / 2.0, at[1] - h / 2.0, at[0] + w / 2.0, at[1] + h / 2.0)
    for far, (dx, dy) in product(DISTANCES, DIRECTIONS):
        x, y = at[0] + far * dx + (w / 2.0) * dx, at[1] + far * dy + (h / 2.0) * dy
        # the box stands beside the point, not on it
        x = x if abs(dx) < 0.3 else at[0] + math.copysign(far, dx) + math.copysign(w / 2.0, dx)
        yield (x - w / 2.0, y - h / 2.0, x + w / 2.0, y + h / 2.0)


def distance(box: Box, at: tuple[float, float]) -> float:
    dx = max(box[0] - at[0], 0.0, at[0] - box[2])
    dy = max(box[1] - at[1], 0.0, at[1] - box[3])
    return math.hypot(dx, dy)
