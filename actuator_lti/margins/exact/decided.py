"""What double precision resolves: the crossings that neighbours 8 ulp away share, and what is said of it."""

import math
from bisect import bisect_left
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import islice, takewhile
from operator import attrgetter

from actuator_lti.margins.assemble import Crossing
from actuator_lti.margins.exact.roots import HalfPlanes

UNRESOLVED = "not resolved in double precision: "
ACROSS = f"{UNRESOLVED}on which side of the stability limit a closed-loop pole lies"
COUNTED = f"{UNRESOLVED}how many closed-loop poles are unstable; some are"
_MOVED = 1e-9
_FAR_DB = 30.0
_FAR = 10.0 ** (_FAR_DB / 20.0)  # a real-axis crossing farther from -1 than this is of no consequence
_SAME_W = 0.05
_SAME_GAIN = 0.5
_BESIDE = 4
Crossings = tuple[Crossing, ...]
Lists = tuple[Crossings, Crossings]  # of the unit circle and of the negative real axis, in order


@dataclass(frozen=True)
class Shared:
    """The crossings, less those far from -1 that double precision does not resolve."""

    gains: Crossings
    reals: Crossings
    dropped: int = 0  # crossings of the real axis, far from -1, that it does not resolve
    moved: float = 0.0  # largest relative change of a crossing among the neighbours
    unsure: str = ""  # which near -1 is one of the given doubles, and not of all their neighbours

    @property
    def moved_text(self) -> str:
        what = f"moves a crossing by {self.moved:.1g}" if self.moved > _MOVED else "changes nothing"
        what = "decides about a crossing" if self.unsure else what
        return f"rounding of the entries {what}"

    @property
    def notes(self) -> tuple[str, ...]:
        left_out = (
            f"crossings of the real axis more than {_FAR_DB:g} dB from -1 that are left out, as double "
            f"precision does not resolve them: {self.dropped}"
        )
        return tuple(note for note in (self.dropped and left_out, self.unsure) if note)


def counted(unstable: Sequence[int]) -> tuple[str, ...] | None:
    """Notes on the unstable poles of a loop and its neighbours; ``None`` where only some of them have any.

    >>> counted([2, 2, 2]), counted([1, 2, 3]) == (COUNTED,), counted([0, 2, 1])
    ((), True, None)
    """
    if len(set(unstable)) == 1:
        return ()
    return (COUNTED,) if min(unstable) else None


def settled(lists: Callable[[bool], Sequence[Lists]]) -> Shared:
    """What a loop and its neighbours share; with what is merged where they do not share it otherwise."""
    found = shared(*lists(False))
    return shared(*lists(True)) if found.unsure else found


def shared(ours: Lists, *others: Lists) -> Shared:
    """Both lists of crossings, less those far from -1 that neighbours do not share, and what else differs."""
    (gains, reals), dropped = ours, 0
    for _, theirs in others:
        kept = tuple(c for c in reals if not _far(c) or _partner(c, theirs))
        dropped, reals = dropped + len(reals) - len(kept), kept
    moved, unsure = 0.0, ""
    for their_gains, their_reals in others:
        unsure = unsure or _difference(gains, their_gains, "|L| = 1")
        unsure = unsure or _difference(reals, their_reals, "the real axis")
        moved = max([moved, *(_movement(c, their_gains) for c in gains)])
        moved = max([moved, *(_movement(c, their_reals) for c in reals)])
    return Shared(gains, reals, dropped, moved, unsure)


def _far(c: Crossing) -> bool:
    return not 1.0 / _FAR < abs(c.L) < _FAR


def _partner(c: Crossing, others: Crossings) -> Crossing | None:
    """The crossing that is the same one in another list."""
    first = bisect_left(others, c.w / (1.0 + _SAME_W), key=attrgetter("w"))
    beside = takewhile(lambda other: other.w <= c.w * (1.0 + _SAME_W), islice(others, first, None))
    for other in beside:
        a, b = abs(c.L), abs(other.L)
        same = a == b or (min(a, b) > 0.0 and abs(math.log(a / b)) < _SAME_GAIN)
        if same and c.touch == other.touch:
            return other
    return None


def _difference(ours: Crossings, theirs: Crossings, line: str) -> str:
    """What two lists do not share, those far from -1 left out."""
    core, their_core = [c for c in ours if not _far(c)], [c for c in theirs if not _far(c)]
    if [c.touch for c in core] == [c.touch for c in their_core]:
        return ""
    alone = [c for c in core if _partner(c, theirs) is None]
    alone += [c for c in their_core if _partner(c, ours) is None]
    if not alone:
        return ""
    return f"{UNRESOLVED}whether L meets {line} at w = {alone[0].w:.6g} of the s-plane; listed as given"


def _movement(c: Crossing, others: Crossings) -> float:
    at = bisect_left(others, c.w, key=attrgetter("w"))
    beside = others[max(at - _BESIDE, 0) : at + _BESIDE]
    other = min(beside, key=lambda o: abs(o.L - c.L) + abs(o.w - c.w) / (c.w or 1.0), default=None)
    if other is None or not 0.0 < c.w < math.inf or not c.L:
        return 0.0
    return max(abs(other.w / c.w - 1.0), abs(other.L / c.L - 1.0))


def hidden_notes(hidden: HalfPlanes) -> tuple[str, ...]:
    """What is said of modes that the loop neither drives nor sees."""
    at_zero, undamped, right, notes = hidden.at_zero, hidden.undamped, hidden.right, []
    if at_zero == 1 and not undamped:
        notes.append(
            "one mode at zero frequency that the loop neither drives nor sees is left out "
            "(it is no instability)"
        )
    elif at_zero or undamped:
        at = [f"{at_zero} at zero frequency"] if at_zero else []
        pairs = ", ".join(f"{times} pair{'s' * (times > 1)} at {float(w.mid()):.6g}" for w, times in undamped)
        notes.append(
            f"modes on the stability boundary that the loop neither drives nor sees are left out "
            f"({', '.join([*at, pairs] if pairs else at)} of the s-plane): the margins are those of what is "
            "seen; inside, the loop is not asymptotically stable"
        )
    if right:
        modes = "1 unstable mode" if right == 1 else f"{right} unstable modes"
        notes.append(f"{modes} that the loop neither drives nor sees")
    return tuple(notes)
