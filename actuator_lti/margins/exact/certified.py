"""Margins by exact arithmetic on the given doubles: certified, or withheld with the reason.

What the data determine is the answer that is the same for neighbours 8 ulp away.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice, takewhile
from operator import attrgetter

import numpy as np

from actuator_lti.errors import InputError
from actuator_lti.margins.assemble import Figures, assembled, far_note, hidden_notes, out_of_sight
from actuator_lti.margins.distances import DISK, MODULUS
from actuator_lti.margins.exact.crossings import Crossing, Findings, crossings, smallest
from actuator_lti.margins.exact.loop import exact_loop, neighbours
from actuator_lti.margins.exact.roots import half_planes
from actuator_lti.margins.given import ULP, Given, unwarped
from actuator_lti.margins.loop import Complex, Mask, Real
from actuator_lti.margins.results import StabilityMargins
from actuator_lti.margins.single import Agreement

_METHOD = "roots of exact polynomials, isolated in certified intervals; no grid"
_MOVED = 1e-9
_FAR_DB = 30.0
_FAR = 10.0 ** (_FAR_DB / 20.0)  # a real-axis crossing farther from -1 than this is of no consequence
_SAME_W = 0.05
_SAME_GAIN = 0.5
_BESIDE = 4
_SHARP = 1e-3  # a pole is placed where its own error is below this part of its modulus
_TOLD = 1e-6
Crossings = tuple[Crossing, ...]
Lists = tuple[Crossings, Crossings]
Compared = tuple[Crossings, Crossings, int, float, str | None]


def certified_margins(given: Given) -> StabilityMargins:
    """All margins of a rational loop from the exact values of its doubles, see `stability_margins`.

    The answer is given where it is the same for neighbours of the data, each entry 8 ulp away.
    """
    loop = exact_loop(given)
    above, below = (loop.N(1), loop.D(1)) if loop.sampled else (loop.N[loop.degree], loop.D[loop.degree])
    if below and abs(above + below) <= abs(below) * 2 * ULP // (1 << 53):
        raise InputError("1 + L is zero at infinite frequency: the closed loop is not well posed")
    others = neighbours(given, loop)
    base = Findings(loop)
    return _margins(given, base, _settled(base, [Findings(other) for other in others]))


def _margins(given: Given, base: Findings, result: _Settled) -> StabilityMargins:
    frequency, figures = partial(unwarped, period_s=given.period_s), None
    if result.problem is None:
        modulus, disk = (smallest(base.loop, distance) for distance in (MODULUS, DISK))
        figures = Figures(
            tuple(c.gain_margin(frequency(c.w)) for c in result.reals if not out_of_sight(c.L)),
            tuple(c.phase_margin(frequency(c.w)) for c in result.gains),
            (modulus[0], frequency(modulus[1])),
            (disk[0], frequency(disk[1])),
        )
    return assembled(
        given.period_s,
        Agreement(result.unstable, None, result.border),
        figures,
        method=_METHOD,
        notes=_notes(base, result),
        evidence="certified" if result.problem is None else "withheld",
        reason=result.problem or _reason(result),
        hidden_border=max(base.hidden.on_border, result.hidden_at_dc) + base.loop.hidden_at_end,
    )


def _reason(result: _Settled) -> str:
    if result.border:
        return "exact arithmetic on the given doubles: poles lie exactly on the stability boundary"
    return f"exact arithmetic on the given doubles, certified roots; {moved_text(result.moved)}"


def moved_text(moved: float) -> str:
    """What neighbours of the data change."""
    what = f"move a crossing by {moved:.1g}" if moved > _MOVED else "change nothing"
    return f"{ULP} ulp of the entries {what}"


def _notes(base: Findings, result: _Settled) -> tuple[str, ...]:
    hidden = base.hidden
    if result.hidden_at_dc > hidden.at_zero:  # one that the data do not tell from a mode at zero
        hidden = replace(hidden, at_zero=result.hidden_at_dc)
    return (
        *hidden_notes(hidden.at_zero, hidden.pairs, hidden.right),
        *far_note(sum(out_of_sight(c.L) for c in result.reals)),
        *dropped_note(result.dropped),
    )


def dropped_note(dropped: int) -> tuple[str, ...]:
    """What is said of crossings far from -1 that the data do not determine."""
    if not dropped:
        return ()
    return (
        f"crossings of the real axis more than {_FAR_DB:g} dB from -1 that are left out, as double "
        f"precision does not resolve them: {dropped}",
    )


@dataclass(frozen=True)
class _Settled:
    """What stands, whichever of the neighbours is meant."""

    unstable: int | None  # closed-loop poles outside the stable region; ``None`` where the data do not tell
    border: int  # closed-loop poles exactly on the border
    hidden_at_dc: int  # modes at zero frequency that the loop does not show
    gains: tuple[Crossing, ...]  # the crossings that the data determine
    reals: tuple[Crossing, ...]
    dropped: int  # crossings of the real axis, far from -1, that they do not
    moved: float  # largest relative change of a crossing among the neighbours
    problem: str | None  # why no answer is given


def _settled(base: Findings, others: list[Findings]) -> _Settled:
    """Compare the findings of the given doubles with those of their neighbours: poles first."""
    unstable, border, hidden, problem = _poles(base, others)
    agreed: Compared = (), (), 0, 0.0, problem
    if problem is None:
        for merge in (False, True):
            lists = [crossings(f.loop, merge) for f in (base, *others)]
            agreed = compared(lists[0], lists[1:])
            if agreed[-1] is None:
                break
    return _Settled(unstable, border, hidden, *agreed)


def compared(ours: Lists, others: list[Lists]) -> Compared:
    """Both lists of crossings, less those far from -1 that neighbours do not share, and what else differs."""
    (gains, reals), dropped = ours, 0
    for _, theirs in others:
        kept = tuple(c for c in reals if not _far(c) or _partner(c, theirs))
        dropped, reals = dropped + len(reals) - len(kept), kept
    moved, problem = 0.0, None
    for their_gains, their_reals in others:
        problem = problem or difference(gains, their_gains, "|L| = 1")
        problem = problem or difference(reals, their_reals, "the real axis")
        moved = max([moved, *[_movement(c, their_gains) for c in gains]])
        moved = max([moved, *[_movement(c, their_reals) for c in reals]])
    return gains, reals, dropped, moved, problem


def _far(c: Crossing) -> bool:
    return not 1.0 / _FAR < abs(c.L) < _FAR


def _partner(c: Crossing, others: tuple[Crossing, ...]) -> Crossing | None:
    """The crossing that is the same one in another list, which is in order."""
    first = bisect_left(others, c.w / (1.0 + _SAME_W), key=attrgetter("w"))
    beside = takewhile(lambda other: other.w <= c.w * (1.0 + _SAME_W), islice(others, first, None))
    same = (other for other in beside if c.touch == other.touch and _same_size(abs(c.L), abs(other.L)))
    return next(same, None)


def _same_size(a: float, b: float) -> bool:
    return a == b or (min(a, b) > 0.0 and abs(math.log(a / b)) < _SAME_GAIN)


def difference(ours: tuple[Crossing, ...], theirs: tuple[Crossing, ...], line: str) -> str | None:
    """Why two lists do not tell of the same crossings, those far from -1 left out."""
    core, their_core = [c for c in ours if not _far(c)], [c for c in theirs if not _far(c)]
    if [c.touch for c in core] == [c.touch for c in their_core]:
        return None
    for some, others in ((core, theirs), (their_core, ours)):
        for c in some:
            if _partner(c, others) is None:
                return (
                    f"{ULP} ulp of the entries decide whether L meets {line} at w = {c.w:.6g} of the s-plane"
                )
    return None


def _movement(c: Crossing, others: tuple[Crossing, ...]) -> float:
    at = bisect_left(others, c.w, key=attrgetter("w"))
    beside = others[max(at - _BESIDE, 0) : at + _BESIDE]
    other = min(beside, key=lambda o: abs(o.L - c.L) + abs(o.w - c.w) / (c.w or 1.0), default=None)
    if other is None or not 0.0 < c.w < math.inf or not c.L:
        return 0.0
    return max(abs(other.w / c.w - 1.0), abs(other.L / c.L - 1.0))


def _poles(base: Findings, others: list[Findings]) -> tuple[int | None, int, int, str | None]:
    hidden = base.hidden.at_zero
    counts = {(f.unstable, f.on_border, f.hidden.at_zero) for f in (base, *others)}
    closed = _values(base, closed=True)
    size = np.sort(np.abs(closed[closed != 0.0]))
    if len(counts) == 1 and not (size.size and size[0] < _TOLD * size[size.size // 2]):
        return base.unstable, base.on_border, hidden, None
    return _by_movement(base, others, closed)


def _values(f: Findings, closed: bool) -> Complex:
    """Poles in the s-plane, hidden ones and those at zero among them."""
    seen = f.closed if closed else half_planes(f.loop.D)
    return np.array(seen.values + f.hidden.values, dtype=complex)


def _by_movement(
    base: Findings, others: list[Findings], closed: Complex
) -> tuple[int | None, int, int, str | None]:
    """Count with each pole's own error: how far it moves among the neighbours.

    On the border is a pole that lies there exactly; one that the neighbours only carry across it may lie on
    either side, which is no answer. A hidden mode at zero frequency alone is known by its place.
    """
    radius = _movements(closed, [_values(f, closed=True) for f in others])
    size, exact = np.abs(closed), _exactly_on_border(base, closed)
    near = np.abs(closed.real) <= 2.0 * radius
    unstable = int(np.count_nonzero((closed.real > 0.0) & ~near & ~exact))
    beyond = [size[size > 10.0 * max(r, s)].min(initial=math.inf) for r, s in zip(radius, size, strict=True)]
    at_dc = near & ((radius > _SHARP * size) | (size == 0.0)) & (radius <= _SHARP * np.array(beyond))
    unsure = int(np.count_nonzero(at_dc & ~exact))
    problem, hidden = None, int(np.count_nonzero(at_dc))
    if np.count_nonzero(near & ~exact & ~at_dc):
        problem = f"{ULP} ulp of the entries move a closed-loop pole across the stability boundary"
    elif unsure > 1:  # be they hidden or not
        problem = f"{ULP} ulp of the entries decide about several modes at zero frequency"
    elif hidden:
        shown = _values(base, closed=False)
        spread = _movements(shown, [_values(f, closed=False) for f in others])
        hidden = min(hidden, int(np.count_nonzero(np.abs(shown) <= 10.0 * spread)))
        if hidden > 1 or unsure > hidden:
            problem = f"{ULP} ulp of the entries decide about a mode at zero frequency"
    if problem is not None:
        return None, 0, 0, problem
    return unstable, base.closed_at_end + int(np.count_nonzero(exact | at_dc)) - hidden, hidden, None


def _exactly_on_border(base: Findings, closed: Complex) -> Mask:
    """Which of the poles, hidden ones among them, lie exactly on the axis."""
    found = np.zeros(closed.size, dtype=bool)
    for part in (base.closed, base.hidden):
        places = [0j] * part.at_zero
        for w, times in part.border:
            places += [complex(0.0, float(w.mid())), complex(0.0, -float(w.mid()))] * times
        for place in places:
            found[np.argmin(np.where(found, math.inf, np.abs(closed - place)))] = True
    return found


def _movements(values: Complex, others: list[Complex]) -> Real:
    if not values.size:
        return np.zeros(0)
    return np.max([np.abs(values[:, None] - other).min(axis=1) for other in others], axis=0)
