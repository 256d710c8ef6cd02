"""`stability_margins` beside `control.stability_margins` on the same loops, in one run."""

from __future__ import annotations

import statistics
import time
import warnings
from collections.abc import Callable, Iterable

import control
import numpy as np

from actuator_lti.margins import stability_margins
from benchmarks.row import Row

ORDER = 10
PERIOD_S = 1e-3


def rows(quick: bool = False) -> Iterable[Row]:
    """Ratio of the times on stable random loops of order 10, continuous and sampled: median of the loops."""
    seeds = range(3 if quick else 8)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for kind, target in (("continuous", 1.5), ("sampled", 1.0)):
            pairs = [_times(_loop(seed, kind == "sampled"), 20 if quick else 60) for seed in seeds]
            ours, theirs = (statistics.median(pair[k] for pair in pairs) for k in (0, 1))
            yield Row(
                group="margins",
                name=f"order {ORDER}, state space, {kind}: time over control.stability_margins",
                measured=statistics.median(a / b for a, b in pairs),
                unit="",
                target=target,
                note=f"{1e3 * ours:.2f} ms against {1e3 * theirs:.2f} ms",
            )


def _loop(seed: int, sampled: bool) -> control.StateSpace:
    rng = np.random.default_rng(seed)
    A = np.zeros((ORDER, ORDER))
    for k in range(0, ORDER, 2):
        w, zeta = 10.0 ** rng.uniform(0, 3), 10.0 ** rng.uniform(-2, -0.2)
        A[k : k + 2, k : k + 2] = [[0.0, w], [-w, -2.0 * zeta * w]]
    T = np.linalg.qr(rng.standard_normal((ORDER, ORDER)))[0]
    B, C = rng.standard_normal((ORDER, 1)), rng.standard_normal((1, ORDER))
    loop = control.ss(T.T @ A @ T, 10.0 * B, C, [[0.0]])
    return control.c2d(loop, PERIOD_S) if sampled else loop


def _times(loop: control.StateSpace, repeats: int) -> tuple[float, float]:
    """Best time of each, taken in turns."""
    calls: tuple[Callable[[], object], ...] = (
        lambda: stability_margins(loop),
        lambda: control.stability_margins(loop),
    )
    best = [float("inf"), float("inf")]
    for _ in range(repeats):
        for k, call in enumerate(calls):
            start = time.perf_counter()
            call()
            best[k] = min(best[k], time.perf_counter() - start)
    return best[0], best[1]
