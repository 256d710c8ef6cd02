"""`stability_margins` beside `control.stability_margins`, over the order, and certified; in one run."""

from __future__ import annotations

import statistics
import time
import warnings
from collections.abc import Callable, Iterable
from functools import partial
from itertools import count

import control
import numpy as np

from actuator_lti.margins import stability_margins
from benchmarks.row import Row

ORDER = 10  # of the certified ones
ORDERS = (2, 5, 10, 25)
PERIOD_S = 1e-3
LARGER = ((25, 0.030), (50, 0.100), (100, 0.400))  # order, seconds allowed
CERTIFIED_S = 0.050
GAINS = count(1.0, 2.0**-10)


def rows(quick: bool = False) -> Iterable[Row]:
    """Medians: ratio of the times over order and form, then the time of larger and certified loops."""
    seeds = range(3 if quick else 8)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for order in (2,) if quick else ORDERS:
            for form in ("state space", "transfer function"):
                for kind in ("continuous", "sampled"):
                    yield _beside(order, form, kind, seeds, 5 if order > ORDER else 20)
        for order in () if quick else (50, 100):
            yield _beside(order, "state space", "sampled", seeds, 2, target=2.0)
        for order, allowed_s in LARGER:
            loops = [_loop(seed, order, False) for seed in seeds]
            yield _row(f"order {order}, state space, continuous", loops, stability_margins, allowed_s)
        for kind in ("continuous", "sampled"):
            loops = [_loop(seed, ORDER, kind == "sampled") for seed in seeds]
            yield _row(f"order {ORDER}, state space, {kind}, certified", loops, _certified, CERTIFIED_S)


def _beside(order: int, form: str, kind: str, seeds: range, repeats: int, target: float = 1.3) -> Row:
    """Median over loops of the ratio of both times."""
    loops = [_loop(seed, order, kind == "sampled") for seed in seeds]
    if form == "transfer function":
        loops = [control.tf(loop) for loop in loops]
    pairs = [_times(loop, repeats) for loop in loops]
    ours, theirs = (statistics.median(pair[k] for pair in pairs) for k in (0, 1))
    note = f"{1e3 * ours:.2f} ms against {1e3 * theirs:.2f} ms"
    return Row(
        f"order {order}, {form}, {kind}: time over control.stability_margins",
        statistics.median(a / b for a, b in pairs),
        "",
        target,
        note=note,
    )


def _certified(loop: control.StateSpace) -> object:
    """Of a gain that no call had before: what was certified once is kept."""
    return stability_margins(next(GAINS) * loop, certify=True)


def _row(name: str, loops: list[control.StateSpace], margins: Callable[..., object], allowed_s: float) -> Row:
    times = [_best(partial(margins, loop), 3) for loop in loops]
    kinds = [stability_margins(loop).evidence for loop in loops]
    note = f"slowest {1e3 * max(times):.0f} ms; checked {kinds.count('checked')} of {len(kinds)}"
    return Row(f"{name}: time", 1e3 * statistics.median(times), "ms", 1e3 * allowed_s, note=note)


def _loop(seed: int, order: int, sampled: bool) -> control.StateSpace:
    """Lightly damped modes over three decades in random coordinates; one real pole where the order is odd."""
    rng = np.random.default_rng(seed)
    A = np.zeros((order, order))
    for k in range(0, order - 1, 2):
        w, zeta = 10.0 ** rng.uniform(0, 3), 10.0 ** rng.uniform(-2, -0.2)
        A[k : k + 2, k : k + 2] = [[0.0, w], [-w, -2.0 * zeta * w]]
    if order % 2:
        A[-1, -1] = -(10.0 ** rng.uniform(0, 3))
    T = np.linalg.qr(rng.standard_normal((order, order)))[0]
    B, C = rng.standard_normal((order, 1)), rng.standard_normal((1, order))
    loop = control.ss(T.T @ A @ T, 10.0 * B, C, [[0.0]])
    return control.c2d(loop, PERIOD_S) if sampled else loop


def _best(call: Callable[[], object], repeats: int) -> float:
    best = float("inf")
    for _ in range(repeats):
        start = time.perf_counter()
        call()
        best = min(best, time.perf_counter() - start)
    return best


def _times(loop: control.LTI, repeats: int) -> tuple[float, float]:
    """Best time of each, taken in turns."""
    best = [float("inf"), float("inf")]
    for _ in range(repeats):
        for k, call in enumerate((stability_margins, control.stability_margins)):
            best[k] = min(best[k], _best(partial(call, loop), 1))
    return best[0], best[1]
