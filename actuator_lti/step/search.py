"""What is looked for in a deviation e(t) from the final value, over it: passages, the last exit, the peak."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from actuator_lti.systems.root import root
from actuator_lti.types import Mask, Real

OVER = 1e-9  # an excess below this part of the final value is no overshoot
_TEN, _NINETY, _BAND = -0.9, -0.1, 0.02
_FLAT = 1e-12
Pieces = tuple[Real, Real, Real]  # begins, lengths, and e as power series of the part of each, highest first


@dataclass
class Search:
    """What has been found so far: the first time above 10 and 90 %, the last outside the band, the peak."""

    tie: float  # an e this near to a level has reached it, and this near to the band is inside
    ten: float = np.inf
    ninety: float = np.inf
    last: float = -np.inf
    peak: float = OVER
    peak_time: float = np.inf

    def see(self, t: Real, e: Real) -> None:
        """Take in e at some times."""
        self.ten = t[e > _TEN - self.tie].min(initial=self.ten)
        self.ninety = t[e > _NINETY - self.tie].min(initial=self.ninety)
        self.last = t[np.abs(e) > _BAND + self.tie].max(initial=self.last)
        if (top := e.max(initial=self.peak)) > self.peak:
            self.peak, self.peak_time = top, np.inf
        self.peak_time = t[e == self.peak].min(initial=self.peak_time)

    def worth(self, a: Real, b: Real, low: Real, high: Real) -> Mask:
        """Whether anything better may lie between a and b, where e lies between low and high."""
        ten = (high > _TEN - self.tie) & (a < self.ten)
        ninety = (high > _NINETY - self.tie) & (a < self.ninety)
        last = (np.maximum(high, -low) > _BAND + self.tie) & (b > self.last)
        return ten | ninety | last | (high > self.peak * (1.0 + _FLAT))

    def inside(self, pieces: Pieces) -> None:
        """Look into pieces of time over which nothing jumps."""
        a, h, series = pieces
        left, others = series[:, -1], np.abs(series[:, :-1]).sum(axis=1)
        self.see(np.concatenate((a, a + h)), np.concatenate((left, series.sum(axis=1))))
        for k in np.flatnonzero(self.worth(a, a + h, left - others, left + others)):
            if self.worth(a[k], a[k] + h[k], left[k] - others[k], left[k] + others[k]):
                e = np.poly1d(series[k])
                of = (e - _TEN, e - _NINETY, e - _BAND, e + _BAND, e.deriv())
                ten, ninety, over, under, turns = (np.array(_zeros(each)) for each in of)
                self.ten = (a[k] + h[k] * ten).min(initial=self.ten)
                self.ninety = (a[k] + h[k] * ninety).min(initial=self.ninety)
                self.last = (a[k] + h[k] * np.append(over, under)).max(initial=self.last)
                self.see(a[k] + h[k] * turns, e(turns))


def _zeros(f: np.poly1d) -> list[float]:
    """Where a power series is zero in [0, 1], in order: its derivative's zeros part its own."""
    if not f.order or abs(f.coeffs[-1]) > np.abs(f.coeffs[:-1]).sum():
        return []
    return [
        root(f, low, high, 1e-15)
        for low, high in pairwise((0.0, *_zeros(f.deriv()), 1.0))
        if min(f(low), f(high)) <= 0.0 <= max(f(low), f(high))
    ]
