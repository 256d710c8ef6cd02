"""Margins by exact arithmetic on the given doubles: certified, or withheld with the reason.

What the data determine is the verdict that is the same for neighbours 8 ulp away.
"""

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from actuator_lti.errors import InputError
from actuator_lti.margins.assemble import Figures, assembled
from actuator_lti.margins.distances import DISK, MODULUS
from actuator_lti.margins.exact.crossings import crossings, smallest
from actuator_lti.margins.exact.decided import ACROSS, COUNTED, UNRESOLVED, Shared, hidden_notes, settled
from actuator_lti.margins.exact.loop import ExactLoop, exact_loop, neighbours
from actuator_lti.margins.exact.roots import within
from actuator_lti.margins.given import ULP, Given
from actuator_lti.margins.results import StabilityMargins
from actuator_lti.margins.single import Agreement
from actuator_lti.systems.precision import precision
from actuator_lti.types import Complex, Mask, Real

_METHOD = "roots of exact polynomials, isolated in certified intervals; no grid"
_GIVEN = "exact arithmetic on the given doubles"
_SHARP = 1e-3  # a pole is placed where its own error is below this part of its modulus
_RESOLVED = 1e-6  # of the modulus of half of the poles: one that is smaller is far slower
_MANY = 2.0  # a modulus below which half of the poles lie, where counting shows it


@lru_cache(maxsize=64)
@precision()
def certified_margins(given: Given, band_rad_s: tuple[float, float] | None = None) -> StabilityMargins:
    """All margins of a rational loop from the exact values of its doubles, see `stability_margins`.

    The verdict is given where it is the same for neighbours of the data, each entry 8 ulp away; a crossing
    that they do not share is one of the given doubles, and noted.
    """
    loop = exact_loop(given)
    above, below = (loop.N(1), loop.D(1)) if loop.sampled else (loop.N[loop.degree], loop.D[loop.degree])
    if below and abs(above + below) <= abs(below) * 2 * ULP // (1 << 53):
        raise InputError("1 + L is zero at infinite frequency: the closed loop is not well posed")
    others = neighbours(given, loop)
    poles, hidden, figures = _poles(loop, others), loop.hidden_modes, None
    found = Shared((), ())
    if poles.problem is None:
        found = settled(lambda merge: [crossings(each, loop, merge) for each in (loop, *others)])
        figures = Figures(found.gains, found.reals, [smallest(loop.N, loop.D, d) for d in (MODULUS, DISK)])
    if poles.hidden > hidden.at_zero:  # one that the data do not resolve from a mode at zero
        hidden = replace(hidden, at_zero=poles.hidden)
    reason = f"{_GIVEN}, certified roots; {found.moved_text}"
    if poles.at_limit:
        reason = f"{_GIVEN}: poles lie exactly on the stability boundary"
    return assembled(
        given.period_s,
        Agreement(poles.unstable, None, poles.at_limit),
        figures,
        method=_METHOD,
        notes=(*hidden_notes(hidden), *found.notes, *filter(None, (poles.note,))),
        evidence="certified",
        reason=poles.problem or reason,
        band_rad_s=band_rad_s,
        hidden_at_limit=max(loop.hidden_modes.at_limit, poles.hidden) + loop.hidden_at_end,
    )


@dataclass(frozen=True)
class _Poles:
    """Closed-loop poles, whichever of the neighbours is meant."""

    unstable: int | None = None  # outside the stable region; ``None`` where that is not resolved
    at_limit: int = 0  # exactly at the stability limit
    hidden: int = 0  # modes at zero frequency that the loop does not show
    problem: str | None = None
    note: str = ""  # what of these numbers double precision does not resolve


def _poles(base: ExactLoop, others: list[ExactLoop]) -> _Poles:
    counts = {(f.unstable, f.at_limit, f.hidden_modes.at_zero) for f in (base, *others)}
    if len(counts) == 1 and not _slow(base):
        return _Poles(*counts.pop())
    closed = _values(base, closed=True)
    return _by_movement(base, others, closed)


def _slow(loop: ExactLoop) -> bool:
    """Whether a closed-loop pole, hidden ones among them, is far slower than half of them."""
    p = (loop.N + loop.D) * loop.hidden
    near, most = within(p, _RESOLVED * _MANY), within(p, _MANY)
    if near == 0 and most is not None and most > p.degree() // 2:
        return False  # most of a sampled loop's are near one; so no pole need be found
    closed = _values(loop, closed=True)
    size = np.sort(np.abs(closed[closed != 0.0]))
    return bool(size.size and size[0] < _RESOLVED * size[size.size // 2])


def _values(loop: ExactLoop, closed: bool) -> Complex:
    """Poles in the s-plane, hidden ones and those at zero among them."""
    seen = loop.closed_poles if closed else loop.poles
    return np.array(seen.values + loop.hidden_modes.values, dtype=complex)


def _by_movement(base: ExactLoop, others: list[ExactLoop], closed: Complex) -> _Poles:
    """Count with each pole's own error: how far it moves among the neighbours.

    At the limit is a pole that lies there exactly; one that the neighbours only carry across it may lie on
    either side, which is no answer, unless others lie in the right half plane whatever is meant. A hidden
    mode at zero frequency alone is known by its place.
    """
    radius = _movements(closed, [_values(f, closed=True) for f in others])
    size, exact = np.abs(closed), _exactly_at_limit(base, closed)
    near = np.abs(closed.real) <= 2.0 * radius
    unstable = int(np.count_nonzero((closed.real > 0.0) & ~near & ~exact))
    beyond = [size[size > 10.0 * max(r, s)].min(initial=math.inf) for r, s in zip(radius, size, strict=True)]
    at_dc = near & ((radius > _SHARP * size) | (size == 0.0)) & (radius <= _SHARP * np.array(beyond))
    unsure, hidden = int(np.count_nonzero(at_dc & ~exact)), int(np.count_nonzero(at_dc))
    across = bool(np.count_nonzero(near & ~exact & ~at_dc))
    if unstable and (across or unsure > 1):
        return _Poles(base.unstable, base.at_limit, base.hidden_modes.at_zero, note=COUNTED)
    if across:
        return _Poles(problem=ACROSS)
    if unsure > 1:  # be they hidden or not
        return _Poles(problem=f"{UNRESOLVED}several modes at zero frequency")
    if hidden:
        shown = _values(base, closed=False)
        spread = _movements(shown, [_values(f, closed=False) for f in others])
        hidden = min(hidden, int(np.count_nonzero(np.abs(shown) <= 10.0 * spread)))
        if hidden > 1 or unsure > hidden:
            return _Poles(problem=f"{UNRESOLVED}a mode at zero frequency")
    at_limit = base.closed_at_end + int(np.count_nonzero(exact | at_dc)) - hidden
    return _Poles(unstable, at_limit, hidden)


def _exactly_at_limit(base: ExactLoop, closed: Complex) -> Mask:
    """Which of the poles, hidden ones among them, lie exactly on the axis."""
    found = np.zeros(closed.size, dtype=bool)
    for part in (base.closed_poles, base.hidden_modes):
        places = [0j] * part.at_zero
        for w, times in part.undamped:
            places += [complex(0.0, float(w.mid())), complex(0.0, -float(w.mid()))] * times
        for place in places:
            found[np.argmin(np.where(found, math.inf, np.abs(closed - place)))] = True
    return found


def _movements(values: Complex, others: list[Complex]) -> Real:
    if not values.size:
        return np.zeros(0)
    return np.max([np.abs(values[:, None] - other).min(axis=1) for other in others], axis=0)
