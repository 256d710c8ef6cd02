"""What each number of the state is: the kinds that stand beside the names of the layout."""

from __future__ import annotations

from functools import cache
from typing import get_args, get_type_hints

import numpy as np
import numpy.typing as npt

from nonlinear._kernels import elastic_layout, layout

CONTINUOUS, COUNTER, FLAG, NOTE, WORK = KINDS = tuple(
    get_args(kind)[1] for kind in (layout.Continuous, layout.Counter, layout.Flag, layout.Note, layout.Work)
)


@cache
def _declared() -> dict[int, str]:
    """Kind by the place from which on it holds."""
    return {
        getattr(part, name): get_args(hint)[1]
        for part in (layout, elastic_layout)
        for name, hint in get_type_hints(part, include_extras=True).items()
        if name.startswith(("S_", "ES_"))
    }


def state_kinds(p: npt.NDArray[np.float64]) -> npt.NDArray[np.str_]:
    """Kind of each number of the state, one of `KINDS`.

    Parameters
    ----------
    p : ndarray
        Parameters of a run with their sizes written, see `lengths.lengthened`.

    Returns
    -------
    ndarray of str, shape (p[STATE_SIZE],)
        ``continuous``: a quantity that the next tick goes on from. ``counter``: ticks, events, places in a
        ring. ``flag``: which piece of the drive acts, and what follows from that alone. ``note``: held for
        reading, by a jittering instant too; energies; random streams. ``work``: work space.
    """
    starts = _declared() | {int(p[layout.AT_WORK]): WORK}
    places = sorted(starts)
    lengths = np.diff([*places, int(p[layout.STATE_SIZE])])
    return np.repeat([starts[place] for place in places], lengths)


def places_of(p: npt.NDArray[np.float64], *kinds: str) -> npt.NDArray[np.intp]:
    """Places in the state of the numbers of some kinds."""
    return np.flatnonzero(np.isin(state_kinds(p), kinds))


@cache
def _named() -> dict[int, str]:
    """Name of the number of the state by its place, as the layout has it."""
    return {
        getattr(part, name): name[len(prefix) :].lower()
        for part, prefix in ((layout, "S_"), (elastic_layout, "ES_"))
        for name in get_type_hints(part)
        if name.startswith(prefix)
    }


def names_of(places: npt.NDArray[np.intp]) -> tuple[str, ...]:
    """Names of numbers of the state: the layout's, and how far behind it for one of a chain or line."""
    named = _named()
    starts = np.array(sorted(named))
    begins = starts[np.searchsorted(starts, places, "right") - 1]
    return tuple(
        named[begin] if place == begin else f"{named[begin]}_{place - begin}"
        for begin, place in zip(begins.tolist(), places.tolist(), strict=True)
    )
