"""Up to where gain margins are listed behind a delay, whose crossings of the real axis never end."""

import math
from collections.abc import Callable
from typing import TypeVar

TURNS = 4.3  # of the delay that are listed in any case: as it goes to 0, all that the loop without it has
Found = TypeVar("Found")


def listed(
    search: Callable[[float], tuple[Found, float]],
    quiet: Callable[[float], float],
    delay: float,
    floor: float,
    end: float,
) -> tuple[Found, float, float]:
    """What a search finds up to a frequency, that frequency, and a gain that L does not reach beyond it.

    It is where L stays below ``floor``, or farther: until nothing beyond is nearer to one than what is found.
    ``search`` also gives the gain, or one over it, of the nearest crossing (0: none within 200 dB), ``quiet``
    where L stays below a gain; from ``end`` on margins are beyond 200 dB, and all are listed: infinity.
    """
    to = min(max(quiet(floor), turns(delay)), end)
    while True:
        found, nearest = search(to)
        if to >= end:
            return found, math.inf, floor
        if nearest and (nearest >= floor or quiet(nearest) <= to):
            return found, to, min(floor, nearest)
        to = min(quiet(nearest) if nearest else end, 4.0 * to)


def turns(delay: float) -> float:
    """Up to where margins are listed in any case."""
    return 2.0 * math.pi * TURNS / delay if delay else math.inf


def tail_note(listed_to: float, gain: float) -> tuple[str, ...]:
    """What is said of the crossings beyond, whose gain is lower."""
    if math.isinf(listed_to):
        return ("gain margins beyond 200 dB, which never end behind a delay, are not listed",)
    quiet = -20.0 * math.log10(gain)
    return (f"gain margins beyond {listed_to:.4g} rad/s, each above {quiet:.4g} dB, are not listed",)
