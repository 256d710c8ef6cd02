"""What each number of the state is: the kinds that stand beside the names of the layout."""

from functools import cache
from typing import get_args, get_type_hints

import numpy as np
import numpy.typing as npt

from nonlinear._kernels import elastic_layout, layout

CONTINUOUS, COUNTER, FLAG, NOTE, WORK = KINDS = tuple(
    get_args(kind)[1] for kind in (layout.Continuous, layout.Counter, layout.Flag, layout.Note, layout.Work)
)


@cache
def _declared() -> dict[int, tuple[str, str]]:
    """Kind and name, as the layout has them, by the place from which on they hold."""
    return {
        getattr(part, name): (get_args(hint)[1], name[len(prefix) :].lower())
        for part, prefix in ((layout, "S_"), (elastic_layout, "ES_"))
        for name, hint in get_type_hints(part, include_extras=True).items()
        if name.startswith(prefix)
    }


def state_kinds(p: npt.NDArray[np.float64]) -> npt.NDArray[np.str_]:
    """Kind of each number of the state, one of `KINDS`, by a row of parameters with its sizes written."""
    kinds = {place: kind for place, (kind, _) in _declared().items()} | {int(p[layout.AT_WORK]): WORK}
    places = sorted(kinds)
    lengths = np.diff([*places, int(p[layout.STATE_SIZE])])
    return np.repeat([kinds[place] for place in places], lengths)


def places_of(p: npt.NDArray[np.float64], *kinds: str) -> npt.NDArray[np.intp]:
    """Places in the state of the numbers of some kinds."""
    return np.flatnonzero(np.isin(state_kinds(p), kinds))


def names_of(places: npt.NDArray[np.intp]) -> tuple[str, ...]:
    """Names of numbers of the state: the layout's, and how far behind it for one of a chain or line."""
    starts = np.array(sorted(_declared()))
    begins = starts[np.searchsorted(starts, places, "right") - 1]
    return tuple(
        _declared()[begin][1] + (f"_{place - begin}" if place > begin else "")
        for begin, place in zip(begins.tolist(), places.tolist(), strict=True)
    )
