"""A fast break point inside slower loops: a periodically time-varying loop, and what is honest about it.

With n_v or n_p > 1 the loop seen at u or i_ref, all other loops closed, is not time-invariant: its period
is M = n_p/n updates of that signal.  A sinusoid d injected there, ``e = d - y``, comes back at its own
frequency and at M - 1 images.  A frequency-response analyser sees the fundamentals: S = e/d and T = y/d with
S + T = 1, and L = y/e = T/S.  These three are what `fundamental` returns, exactly, as ordinary sampled
systems.  Their closed-loop poles are the M-th roots of the eigenvalues of the true loop over one period, so
the verdict on stability from them is the truth.  A margin read from L is that of the fundamental only;
`exact_margins` gives the gains and the delay that bring the true loop to its stability limit.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

from actuator_lti.drive.wiring import Drive, wire
from actuator_lti.errors import InputError, finite_number
from actuator_lti.loops.result import Loops
from actuator_lti.loops.tick import Block, TickProgram, mean_response, siso, used
from actuator_lti.systems.resolvent import balanced
from actuator_lti.systems.rest_mode import System, without_rest_modes
from actuator_lti.systems.root import root

GAINS = np.geomspace(1.0, 1e4, 401)
_AT_ONCE = 50
_DELAY_STEPS_A_TICK = 4
AT_REST = 1e-12  # from 1: an eigenvalue that no gain of those tried moves away is a mode at rest
TRIED_GAINS = (0.37, 1.0, 2.9)


def phase_blocks(program: TickProgram, every: int, source: str, signal: str, scale: Any = 1.0) -> list[Block]:
    """From an input held `every` ticks to a signal, one block for each such time within one period."""
    ticks = [program.tick(k) for k in range(program.ticks)]
    return [
        siso(program, ticks[k : k + every], source, signal, scale) for k in range(0, program.ticks, every)
    ]


def point_blocks(wired: Drive, point: str) -> list[Block]:
    """The loop cut at a break point, y over e, one block for each update of it within one period."""
    if point not in wired.blocks_at:
        program, every = TickProgram(wired, wired.outermost, cut=point), wired.interval[wired.producer(point)]
        wired.blocks_at[point] = phase_blocks(program, every, "cut", point, scale=-1.0)
    return wired.blocks_at[point]


def cyclic(blocks: Sequence[Block]) -> Block:
    """Time-invariant system of the fundamental: state m holds the response seen at phase m."""
    if len(blocks) == 1:
        return blocks[0]
    M, n = len(blocks), len(blocks[0].states)
    stack = np.broadcast_shapes(
        *(each.shape[:-2] for block in blocks for each in (block.A, block.B, block.C))
    )
    A, B, C = (np.zeros((*stack, *shape)) for shape in ((M * n, M * n), (M * n, 1), (1, M * n)))
    for m, block in enumerate(blocks):
        after = (m + 1) % M
        A[..., after * n : after * n + n, m * n : m * n + n] = block.A
        B[..., after * n : after * n + n, :] = block.B
        C[..., :, m * n : m * n + n] = block.C / M
    names = tuple(f"{name}[{m}]" for m in range(M) for name in blocks[0].states)
    return Block(A, B, C, sum((block.D for block in blocks), np.zeros((1, 1))) / M, names)


def fundamental(blocks: Sequence[Block]) -> Block:
    """L = T/S of the fundamental of a periodic loop (see the module); for one block the loop itself.

    Its `Block.feedback` and `Block.sensitivity` are the exact fundamentals T and S.
    """
    if len(blocks) == 1:
        return blocks[0].pruned()
    closed = cyclic([block.feedback() for block in blocks])
    return replace(closed, A=closed.A + closed.B @ closed.C).pruned()


def shown(blocks: Sequence[Block]) -> list[Block]:
    """The blocks of one design without the modes at rest that no update shows, or drives (`rest_mode`)."""
    if len(blocks) == 1:
        return list(blocks)
    systems, kept = without_rest_modes([(one.A, one.B, one.C) for one in blocks])
    names = tuple(np.array(blocks[0].states)[kept])
    return [Block(*each, one.D, names) for each, one in zip(systems, blocks, strict=True)]


@dataclass(frozen=True)
class ExactMargins:
    """Stability limits of a sampled loop from the eigenvalues over one whole period."""

    stable: bool
    # Factor on the loop gain at the break point that first brings an eigenvalue to the unit circle, going up
    # from 1 and down from 1; ``inf`` and 0 where there is none within a factor of 1e4. NaN if unstable.
    gain_upper: float
    gain_lower: float
    # Smallest added computing delay that does so, in s (only at ``"u"``; ``inf`` if none within the bound
    # asked for; NaN if unstable). It moves the hold within the tick, so where it is no whole number of ticks
    # it differs a little from phase margin over frequency, which delays the sampled signal.
    delay_s: float | None
    spectral_radius: float  # largest eigenvalue magnitude over one position period


@dataclass(frozen=True)
class PeriodicLoop:
    """A loop cut at a break point over one period of the drive: M updates, each with its own matrices.

    As many states as the drive has, where the time-invariant system of the fundamental has M times as many.
    """

    systems: Sequence[System]  # one an update: y = C x seen at its start, e held over it
    dt: float  # time between two updates, s
    # How many eigenvalues stand at 1 whatever the gain (`hidden_at_rest`); they are none of its modes
    hidden: int = 0

    def modes(self, gain: npt.ArrayLike = 1.0) -> np.ndarray:
        """Eigenvalues over one period with the loop closed through a gain, or through each of several.

        By what a period changes: of slow ones rounding leaves their distance from 1, some of 1e-11 too.
        """
        over = self._over(gain)
        modes = 1.0 + np.asarray(np.linalg.eigvals(over - np.eye(over.shape[-1])), dtype=complex)
        if not self.hidden:
            return modes
        return np.take_along_axis(modes, np.argsort(np.abs(modes - 1.0))[..., self.hidden :], axis=-1)

    def _over(self, gain: npt.ArrayLike) -> np.ndarray:
        """What one period does to the states with the loop closed through a gain."""
        over, gains = np.eye(self.systems[0][0].shape[0]), np.asarray(gain)[..., None, None]
        for A, B, C in self.systems:
            over = (A - gains * B @ C) @ over
        return over

    def radius(self, gain: npt.ArrayLike = 1.0) -> Any:
        """Largest magnitude of a mode, of the shape of the gains."""
        return np.max(np.abs(self.modes(gain)), axis=-1, initial=0.0)

    def hidden_at_rest(self) -> int:
        """How many modes stand at 1 at all gains tried: what rounding leaves of a rest that the loop keeps.

        A velocity controller's integral holds a load that is a spring, and is damped, at any angle.
        """
        return min(int(np.sum(np.abs(self.modes(gain) - 1.0) < AT_REST)) for gain in TRIED_GAINS)

    def __call__(self, points: npt.ArrayLike) -> np.ndarray:
        """L = T/(1 - T) of the fundamental at points z (see the module), of their shape; inf where T is 1."""
        T = self.closed(points)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(np.where(T == 1.0, np.inf, T / (1.0 - T)))

    def closed(self, points: npt.ArrayLike) -> np.ndarray:
        """T of the fundamental at points z, of their shape."""
        z, (_, scale) = np.asarray(points, dtype=complex), balanced(self._over(1.0))
        closed = [
            ((A - B @ C) * scale / scale[:, None], B / scale[:, None], C * scale, 0.0)
            for A, B, C in self.systems
        ]
        return mean_response(closed, z.reshape(-1, 1, 1)).reshape(z.shape)


def _wired(loops: Loops) -> Drive:
    ticks = loops.tick_system
    return wire(loops.design, loops.operating) if ticks is None else ticks.program.drive


def periodic_loop(loops: Loops | Drive, point: str) -> PeriodicLoop:
    """The loop at a break point of sampled loops, or of a wired drive, what no gain moves left out."""
    wired = loops if isinstance(loops, Drive) else _wired(loops)
    _refuse_unknown(wired, point)
    return _moved(_parts(point_blocks(wired, point))[0], wired.interval[wired.producer(point)] * wired.tick_s)


def _refuse_unknown(wired: Drive, point: str) -> None:
    if point not in wired.points:
        raise InputError(f"break point {point!r}: one of {', '.join(wired.points)}")


def _moved(systems: Sequence[System], dt: float) -> PeriodicLoop:
    loop = PeriodicLoop(systems, dt)
    return replace(loop, hidden=loop.hidden_at_rest())


def _parts(blocks: Sequence[Block]) -> tuple[list[System], list[System]]:
    """What the loop moves and sees, and the rest of the drive: its eigenvalues are those of both.

    What the cut does not reach (the filter of the command), or does not see, is moved by no gain.  Taken
    apart, its eigenvalues do not disturb those of the loop: two slow ones that coincide are known to the root
    of a rounding only.
    """
    moved, others = _split(blocks)
    return without_rest_modes(moved)[0], without_rest_modes(others)[0]


def _split(blocks: Sequence[Block]) -> tuple[list[System], list[System]]:
    """The same with the modes at rest."""
    inside = used(blocks)
    moved, others = (
        [(one.A[np.ix_(part, part)], one.B[part], one.C[:, part]) for one in blocks]
        for part in (inside, ~inside)
    )
    return moved, [(a, np.zeros_like(b), np.zeros_like(c)) for a, b, c in others]


def first_limit(excess: Callable[[Any], Any], grid: np.ndarray, none: float, at_once: int = 1) -> float:
    """First root of ``excess`` (negative at grid[0]) along a grid, so many of its values asked at once."""
    found = np.atleast_1d(excess(grid[0]))
    for start in range(1, len(grid), at_once):
        part = grid[start : start + at_once] if at_once > 1 else grid[start]
        found = np.append(found, excess(part))
        for k in range(max(start - 1, 1), len(found)):
            if found[k] >= 0.0:
                return root(excess, grid[k - 1], grid[k])
            if k + 1 < len(found) and _may_reach_zero(found[k - 1 : k + 2]):
                top = _top(excess, grid[k - 1], grid[k + 1])
                if excess(top) >= 0.0:
                    return root(excess, grid[k - 1], top)
    return none


def _may_reach_zero(three: np.ndarray) -> bool:
    """Whether what is negative at three even places may reach zero between them.

    A parabola through them rises above the largest by at most an eighth of the second difference.
    """
    before, middle, after = three
    bend = 2.0 * middle - before - after
    return bool(abs(after - before) <= 2.0 * bend and -three.max() <= bend)


def _top(excess: Callable[[Any], Any], low: float, high: float) -> float:
    from scipy.optimize import minimize_scalar

    bounds, within = sorted((low, high)), 1e-9 * abs(high - low)
    return float(minimize_scalar(lambda x: -excess(x), bounds=bounds, options={"xatol": within}).x)


def exact_margins(loops: Loops, point: str, longest_delay_ticks: float = 50.0) -> ExactMargins:
    """Gain and delay margins of a sampled loop at a break point, periodic or not, by eigenvalues.

    Found by stepping outwards (1.0233 in gain, a quarter tick in delay) to the first limit, or to what peaks
    between two steps near it, and polishing it.

    Raises `InputError`: if the loops are not sampled, or have no such break point.
    """
    if loops.form != "sampled":
        raise InputError(f"form = {loops.form!r}: exact_margins needs form='sampled'")
    wired, asked = _wired(loops), (point, finite_number("longest_delay_ticks", longest_delay_ticks))
    _refuse_unknown(wired, point)
    if asked not in wired.margins_at:
        wired.margins_at[asked] = _margins_of(wired, *asked)
    found: ExactMargins = wired.margins_at[asked]
    return found


def _margins_of(wired: Drive, point: str, longest_delay_ticks: float) -> ExactMargins:
    moved, others = (_moved(part, wired.tick_s) for part in _parts(point_blocks(wired, point)))
    radius = float(max(moved.radius(), others.radius()))
    nan = float("nan")
    if radius >= 1:
        return ExactMargins(False, nan, nan, nan if point == "u" else None, radius)
    upper = first_limit(lambda g: moved.radius(g) - 1, GAINS, float("inf"), _AT_ONCE)
    lower = first_limit(lambda g: moved.radius(g) - 1, 1 / GAINS, 0.0, _AT_ONCE)
    delay = _delay_limit(wired, longest_delay_ticks, moved) if point == "u" else None
    return ExactMargins(True, upper, lower, delay, radius)


def _delay_limit(wired: Drive, longest_ticks: float, now: PeriodicLoop) -> float:
    """The first computing delay at which a mode comes to the unit circle; whole updates are a queue."""
    Ts, every = wired.tick_s, wired.interval[wired.producer("u")]
    resting = _states(_split(point_blocks(wired, "u"))[0]) - _states(now.systems)  # whatever the delay

    @cache
    def part(ticks: float) -> PeriodicLoop:
        later, _ = _split(point_blocks(wired.later(ticks * Ts), "u"))
        left = without_rest_modes(later)[0] if resting else later
        taken = _states(later) - _states(left)
        return PeriodicLoop(left, Ts, now.hidden + resting - taken)

    def excess(ticks: float) -> float:
        updates, rest = divmod(ticks, every)
        later = part(rest)
        return float(replace(later, systems=_queued(later.systems, int(updates))).radius()) - 1

    step = 1 / _DELAY_STEPS_A_TICK
    grid = np.array([0.0, *np.arange(step, longest_ticks, step)])
    return first_limit(excess, grid, float("inf")) * Ts


def _states(systems: Sequence[System]) -> int:
    return len(systems[0][0])


def _queued(systems: Sequence[System], updates: int) -> Sequence[System]:
    n, queued = _states(systems), []
    for A, B, C in systems if updates else ():
        over = np.eye(n + updates, k=-1)  # what enters is the first of the queue
        over[:n, :n], over[n, : n + 1], over[:n, -1:] = A, 0.0, B
        enters = np.zeros((n + updates, 1))
        enters[n] = 1.0
        queued.append((over, enters, np.hstack([C, np.zeros((1, updates))])))
    return queued or systems
