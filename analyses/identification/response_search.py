"""Coordinates in which the values of a design are looked for, and the least squares in them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import block_diag
from scipy.optimize import least_squares

from actuator_lti.design import parameter_value
from actuator_lti.design.model import Design
from actuator_lti.types import Floats, Mask
from analyses.estimation.least_squares import scaled_lstsq
from analyses.estimation.parameters import own_share
from analyses.identification.output_error import LEAST_STEPPED, box_of
from analyses.identification.response_model import Values
from analyses.studies.sampling import correlation_of

NEVER_ZERO = "motor.rotor_inertia", "load.inertia", "coupling.stiffness"  # by their logarithms
STEP = 1e-5  # share of a value for its differences: those of a sharp resonance curve at 1e-3 already
FURTHEST = 1e6  # factor of the design's inertia or stiffness at which a search ends
MOST_TICKS = 100.0  # of computing delay: a design has no more
FINE = 1e-6  # of what is left: what a step has to save for another
ROUNDS = 100  # steps of a fit


@dataclass(frozen=True)
class Point:
    """Coordinates, shape (p,), what the response is off by there in its deviations, and slopes of that."""

    x: Floats
    rest: Floats
    slopes: Floats

    @cached_property
    def cost(self) -> float:
        """Sum of squares."""
        return float(self.rest @ self.rest)

    @cached_property
    def covariance(self) -> Floats:
        """Of the coordinates, as if the response were straight in them; of a QR factor, so never below 0."""
        size = np.linalg.norm(self.slopes, axis=0)
        spread = np.linalg.inv(np.linalg.qr(self.slopes / size, mode="r")) / size[:, None]
        return np.asarray(spread @ spread.T)

    def along(self, k: int) -> Floats:
        """By how much all move with one of them, as if the response were straight: what it takes up best."""
        others = np.arange(len(self.x)) != k
        moved = np.ones(len(self.x))
        moved[others] = -scaled_lstsq(self.slopes[:, others], self.slopes[:, k])
        return moved


@dataclass(frozen=True, kw_only=True)
class Search:
    """Coordinates of values that are looked for, and of others that are kept.

    The values are ``origin + turn y``, y the exponential of a coordinate where it is a logarithm: that of an
    inertia or a stiffness over the design's. What is kept has independent deviations of the design's own
    error, which weigh as measured.
    """

    residual: Callable[[Values], Floats]
    grows: Callable[[Values], Mask]  # see `Seen`
    names: tuple[str, ...]
    count: int  # of those that are looked for, the first
    logs: Mask
    origin: Floats
    turn: Floats
    box: Floats  # of the coordinates, shape (2, p)
    ends: Floats  # of the values
    most: Floats  # how far is searched at once: a slope over the computing delay is that within its tick
    unit: float  # deviation of what is left of the response

    @classmethod
    def of(
        cls,
        start: Design,
        names: tuple[str, ...],
        residual: Callable[[Values], Floats],
        grows: Callable[[Values], Mask],
        kept: tuple[str, ...] = (),
        unit: float = 1.0,
    ) -> Search:
        """The search of some values beside others, within what their keys allow."""
        every, n = np.array((*names, *kept)), len(names)
        scale, ends = box_of(start, (*names, *kept))
        late, tick_s = every == "control.computing_delay", start.controller.period_s
        ends[1, late] = MOST_TICKS * tick_s
        own = np.array([parameter_value(start, key) for key in kept])
        std = own * [own_share(start, key) for key in kept]
        size, turn = np.linalg.eigh(np.outer(std, std) * correlation_of(start, kept))
        logs = np.isin(every, NEVER_ZERO) & (np.arange(len(every)) < n)
        box = np.where(logs, np.log(np.clip(ends / scale, 1.0 / FURTHEST, FURTHEST)), ends / scale)
        box[:, n:] = [[-np.inf], [np.inf]]
        return cls(
            residual=residual,
            grows=grows,
            names=(*names, *kept),
            count=n,
            logs=logs,
            origin=np.append(np.zeros(n), own),
            turn=block_diag(np.diag(scale[:n]), turn * np.sqrt(np.maximum(size, 0.0))),
            box=box,
            ends=ends,
            most=np.where(late, tick_s / scale, np.inf),
            unit=unit,
        )

    def values(self, x: Floats) -> Floats:
        """Values of coordinates, shape (..., p)."""
        straight = np.where(self.logs, np.exp(np.where(self.logs, x, 0.0)), x)
        return np.clip(self.origin + straight @ self.turn.T, *self.ends)

    def sizes(self, x: Floats) -> Floats:
        """By how much a value that is looked for changes with its coordinate, shape (count,)."""
        size = np.where(self.logs, np.exp(np.where(self.logs, x, 0.0)), 1.0) * np.diag(self.turn)
        return np.asarray(size[: self.count])

    def off(self, x: Floats) -> Floats:
        """What is left at coordinates of shape (K, p), beside it the deviations of what is kept."""
        return np.hstack([self.residual(self._named(x)) / self.unit, x[:, self.count :]])

    def _named(self, x: Floats) -> Values:
        return dict(zip(self.names, self.values(x).T, strict=True))

    def rank(self, one: Point) -> tuple[bool, float]:
        """By which fits are sorted: what grows last, since nobody measures that, then by the cost."""
        return bool(self.grows(self._named(one.x[None]))[0]), one.cost

    def at(self, x: Floats) -> Point:
        """What is left at coordinates, held in the box, and its slopes by central differences."""
        x = np.clip(x, *self.box)
        straight = ~self.logs & (np.arange(len(x)) < self.count)
        step = STEP * np.diag(np.where(straight, np.maximum(np.abs(x), LEAST_STEPPED), 1.0))
        up, down = (np.clip(x + side * step, *self.box) for side in (1.0, -1.0))
        here, *moved = self.off(np.vstack([x, up, down]))
        change = np.subtract(*np.split(np.array(moved), 2))
        return Point(x, here, (change / np.diag(up - down)[:, None]).T)

    def least(self, begin: Point, *, enough: float = FINE, hold: int | None = None) -> Point:
        """The least sum of squares near a point, in the box, one coordinate of which may be held.

        By a trust region (scipy), within a tick of the computing delay and then from there. It ends
        where a step saves less than a part ``enough`` of what is left: the values are off by as little of
        their errors (Bates and Watts, Technometrics 23, 1981).
        """
        here, free = begin, np.arange(len(begin.x)) != hold

        def at(part: Floats) -> Floats:
            x = here.x.copy()
            x[free] = part
            return x

        def slopes(part: Floats) -> Floats:
            return self.at(at(part)).slopes[:, free]

        options = {"x_scale": "jac", "ftol": enough, "gtol": None}
        for _ in range(ROUNDS if free.any() else 0):
            if not (np.isfinite(here.cost) and np.isfinite(here.slopes).all()):
                break
            near = np.clip(self.box, here.x - self.most, here.x + self.most)[:, free]
            found = least_squares(
                lambda part: self.off(at(part)[None])[0],
                here.x[free], slopes, near, max_nfev=ROUNDS, **options,
            )  # fmt: skip
            side = 1 + found.active_mask.astype(int)  # of floats, where nothing has a bound
            ended = np.choose(side, [near[0], found.x, near[1]])
            before, here = here, self.at(at(ended))
            if np.all(np.abs(here.x - before.x) <= 0.5 * self.most):
                break
        return here
