"""The compiled figures of many designs, by the library of this package's kernels."""

from pathlib import Path

import numpy as np

from actuator_lti.batch._figures import COLUMNS
from actuator_lti.batch._quoted import QUOTED
from actuator_lti.batch._response import CAPACITY, DEEPEST
from actuator_lti.batch._run import POINTS
from actuator_lti.compiled.kinds import Kind
from actuator_lti.compiled.library import Entry, Library, source_files
from actuator_lti.types import Floats

_FOLDER = Path(__file__).parent
_ROW: Kind = "row"


def room(n: int) -> tuple[int, ...]:
    """Lengths of the rows that `many_loops` works in, from ``a`` on."""
    loop = (n * n, n, n, 4 * n, COLUMNS)
    return (*loop, POINTS, DEEPEST, CAPACITY, 2 * CAPACITY, 2 * CAPACITY, 2 * n * n + 2 * n, 2 * n, n)


_LOOPS: tuple[Kind, ...] = ("int", "int", *(_ROW,) * 5, "int", _ROW)
LIBRARY = Library(
    "figures",
    _FOLDER,
    (
        Entry("actuator_lti.batch._run", "many_loops", (*_LOOPS, *(_ROW,) * len(room(1)))),
        Entry("actuator_lti.batch._quoted", "many_quoted", ("int", *(_ROW,) * 5)),
    ),
    source_files(_FOLDER, wanted="_*.py"),
)


def many_loops(
    A: Floats, B: Floats, C: Floats, poles: Floats, leads: Floats, time_figures: bool, out: Floats
) -> None:
    """Fill ``out[k]`` with the figures of every open loop A[k], B[k], C[k].

    Shapes (count, n, n), (count, n), (count, n); ``poles`` (count, 4, n) holds real and imaginary parts of
    the open loop's, then of the closed loop's; where the first is NaN, the row is left as it is.
    """
    count, n = B.shape
    if n == 0:  # of a law that does not take its command: no loop, and no row has a first pole
        return
    flat = [each.reshape(-1) for each in (A, B, C, poles, leads)]
    lent = [np.zeros(length) for length in room(n)]
    LIBRARY.functions.many_loops(count, n, *flat, int(time_figures), out.reshape(-1), *lent)


def quoted(rows: Floats, period_s: Floats) -> Floats:
    """Figures to quote of each row, shape (count, names of `LOOP_QUANTITIES` and whether it is stable)."""
    out, given = np.zeros((len(rows), QUOTED)), (np.ascontiguousarray(each) for each in (rows, period_s))
    flat = [each.reshape(-1) for each in (*given, out)]
    LIBRARY.functions.many_quoted(len(rows), *flat, np.zeros(COLUMNS), np.zeros(QUOTED))
    return out
