"""Margins, bandwidths and step figures of many designs at once."""

from collections.abc import Collection
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from actuator_lti.asked.quantities import LOOP_QUANTITIES, LOOPS
from actuator_lti.batch import _figures as fig
from actuator_lti.batch.library import many_loops, quoted
from actuator_lti.batch.parameters import Population
from actuator_lti.bounds import LOOP_STATES
from actuator_lti.design.model import Command
from actuator_lti.drive.operating import Operating, OperatingPoint, pushes_away
from actuator_lti.drive.profile import command_mean
from actuator_lti.drive.wiring import Drive, present, wire
from actuator_lti.errors import InputError
from actuator_lti.loops.periodic import fundamental, shown
from actuator_lti.loops.sampled import commanded, fundamental_path, stage_blocks
from actuator_lti.loops.tick import Block, TickProgram

_CHUNK = 256


@dataclass(frozen=True)
class Crossovers:
    """Crossovers of one loop of many designs, in order of frequency; NaN past the last one."""

    # Shape (count, 6)
    frequency_rad_s: np.ndarray
    margin: np.ndarray  # in deg (gain crossovers) or as ratio (phase crossovers)
    crossings: np.ndarray  # shape (count,): how many there are; past 6 they are not listed


@dataclass(frozen=True)
class LinearFigures:
    """Figures of the sampled loops of many designs.

    A design whose figures double precision cannot follow has none: NaN, and it does not count as stable.
    Definitions are those of `actuator_lti.stability_margins`, `actuator_lti.bandwidth` and
    `actuator_lti.step`. A design whose loop is unstable keeps its crossovers; its closed-loop figures
    are NaN, its delay margin is 0.
    Closed-loop figures of the position loop are from command to output, feed-forward included, behind mean
    and filter of the command where the nominal design has a mean (a limited jerk); of a stage with a law of
    one's own from its command to what it measures.
    """

    loops: tuple[str, ...]  # that the structure has
    count: int
    # Shape (count, 3, columns): what the compiled code wrote (`_figures`); angles are radians per sample
    raw: np.ndarray
    period_s: np.ndarray  # shape (count, 3): sampling period of each loop

    def stable(self, loop: str) -> np.ndarray:
        """Whether the closed loop is stable, bool, shape (count,)."""
        return self._column(loop, fig.STABLE) == 1.0

    def withheld(self, loop: str) -> np.ndarray:
        """Whether a design has no figures, as rounding decides them, bool, shape (count,)."""
        return np.isnan(self._column(loop, fig.STABLE))

    def pole_radius(self, loop: str) -> np.ndarray:
        """Largest modulus of a closed-loop pole, shape (count,)."""
        return self._column(loop, fig.RADIUS).copy()

    def gain_crossovers(self, loop: str) -> Crossovers:
        """Frequencies where |L| = 1, with phase margins in deg."""
        result = self._list(loop, fig.FIRST_GAIN, fig.GAIN_CROSSOVERS)
        return replace(result, margin=np.degrees(result.margin))

    def phase_crossovers(self, loop: str) -> Crossovers:
        """Frequencies where L is negative real, with gain margins as ratio."""
        return self._list(loop, fig.FIRST_PHASE, fig.PHASE_CROSSOVERS)

    def quantity(self, name: str, loop: str) -> np.ndarray:
        """One figure of one loop, shape (count,), in its unit (`actuator_lti.asked.quantities`).

        Margins are the ones to quote; ``inf`` where there is none.
        """
        if name not in LOOP_QUANTITIES:
            raise InputError(f"quantity {name!r}: one of {', '.join(LOOP_QUANTITIES)}")
        place = self._index(loop)
        figures = quoted(self.raw[:, place], self.period_s[:, place])
        return figures[:, list(LOOP_QUANTITIES).index(name)].copy()

    def _index(self, loop: str) -> int:
        if loop not in self.loops:
            raise InputError(f"loop {loop!r}: this design has {', '.join(self.loops)}")
        return LOOPS.index(loop)

    def _column(self, loop: str, column: int) -> np.ndarray:
        return self.raw[:, self._index(loop), column]

    def _list(self, loop: str, first: int, counter: int) -> Crossovers:
        block = self.raw[:, self._index(loop), first : first + 2 * fig.LISTED]
        angles, margins = block[:, 0::2], block[:, 1::2]
        order = np.argsort(angles, axis=1, kind="stable")
        return Crossovers(
            np.take_along_axis(angles, order, 1) / self.period_s[:, self._index(loop), None],
            np.take_along_axis(margins, order, 1),
            self._column(loop, counter).astype(int),
        )


def linear_figures(
    population: Population, *, operating_point: OperatingPoint = "sliding", load_Nm: float = 0.0,
    speed_amplitude_rad_s: float | None = None, direction: int = 1,
    time_figures: bool | Collection[str] = True, held: bool = False, threads: int = 1,
    loops: Collection[str] | None = None,
) -> LinearFigures:  # fmt: skip
    """Figures of the sampled loops of every design of a population.

    The same sampled loops as `actuator_lti.assemble_loops` (form ``"sampled"``) and the same definitions
    as `actuator_lti.stability_margins`: the same walk with stacked coefficients, then compiled code: the
    response followed on a grid that is refined until nothing can hide between two points, every crossover
    polished to rounding. The bits do not depend on threads or on the rest of the population.

    ``operating_point``, ``load_Nm``, ``speed_amplitude_rad_s``, ``direction``: as in
    `actuator_lti.assemble_loops`.
    ``time_figures``: whether to follow the step responses as well (most of the time), or of which loops.
    ``held``: give an inner loop that its load, or what holds its torque over a tick, drives away by itself,
    in a drive that is stable as a whole, the figures of the same loop with the rotor held (current) or the
    load torque held (velocity), if stable.
    ``threads``: that share the designs.
    ``loops``: those whose figures are wanted, by default all that the structure has.

    Raises `InputError`: for loops of more states than `actuator_lti.bounds.LOOP_STATES`.
    """
    more: Any = {"speed_amplitude_rad_s": speed_amplitude_rad_s, "direction": direction}
    at = Operating(point=operating_point, load_Nm=load_Nm, **more)
    out = np.full((population.count, len(LOOPS), fig.COLUMNS), np.nan)
    every = LOOPS if time_figures is True else ()
    timed = every if isinstance(time_figures, bool) else time_figures
    wired = wire(population.stacked, at)
    wanted = tuple(stage for stage in wired.stages if loops is None or stage in loops)

    def fill(of: Collection[str], some: Population, numbers: np.ndarray) -> None:
        chunks = (
            group[first : first + _CHUNK] for group in some.kinds() for first in range(0, len(group), _CHUNK)
        )

        def one(chosen: np.ndarray) -> None:
            _fill(wire(some.part(chosen).stacked, at), numbers[chosen], timed, out, of)

        with ThreadPoolExecutor(max(1, threads)) as pool:
            list(pool.map(one, chunks))

    fill(wanted, population, np.arange(population.count))
    if held:
        inner = [loop for loop in wanted if loop not in (wired.outermost, "position")]
        lost = np.flatnonzero((out[:, [LOOPS.index(loop) for loop in inner], fig.STABLE] == 0.0).any(axis=1))
        if lost.size and wired.outermost not in wanted:
            fill((wired.outermost,), population.part(lost), lost)
        for loop in inner:
            _hold(population, at, loop, out, timed)
    periods = [
        np.broadcast_to(wired.period_s(loop) if loop in wired.stages else np.nan, population.count)
        for loop in LOOPS
    ]
    return LinearFigures(wanted, population.count, out, np.column_stack(periods))


def _hold(population: Population, at: Operating, loop: str, out: np.ndarray, timed: Collection[str]) -> None:
    """Put the figures of a held loop in the place of one that is unstable only by itself."""
    place, stable = LOOPS.index(loop), out[:, :, fig.STABLE] == 1.0
    outermost = LOOPS.index(population.design.controller.outermost)
    lost = stable[:, outermost] & (out[:, place, fig.STABLE] == 0.0)

    def rows(chosen: np.ndarray, operating: Operating) -> np.ndarray:
        some, result = population.part(chosen), np.full((len(chosen), *out.shape[1:]), np.nan)
        for group in some.kinds():
            _fill(wire(some.part(group).stacked, operating), group, timed, result, (loop,))
        return result[:, place]

    away = lost & pushes_away(population.stacked, at)
    others = np.flatnonzero(lost & ~away)
    if others.size:  # by the hold of their own torques over a tick alone
        away[others] = rows(others, replace(at, torques_at_once=True))[:, fig.STABLE] == 1.0
    chosen = np.flatnonzero(away)
    if chosen.size:
        alone = replace(at, rotor="locked") if loop == "current" else replace(at, torques_held=True)
        held = rows(chosen, alone)
        found = held[:, fig.STABLE] == 1.0
        out[chosen[found], place] = held[found]


def _fill(
    wired: Drive, chosen: np.ndarray, timed: Collection[str], out: np.ndarray, stages: Collection[str]
) -> None:
    """Figures of some loops of stacked designs."""
    for stage in stages:
        rows, time_figures = np.full((len(chosen), out.shape[2]), np.nan), stage in timed
        rows[:, [fig.GAIN_CROSSOVERS, fig.PHASE_CROSSOVERS]] = 0.0
        lead, response = _command_path(wired, stage)
        blocks = stage_blocks(wired, stage)
        _figures_of(fundamental(blocks), lead, time_figures and response is None, rows)
        for k in np.flatnonzero(np.isnan(rows[:, fig.STABLE]) & (len(blocks) > 1)):
            alone = shown([block.of(int(k)) for block in blocks])  # a mode at rest that moves is taken out
            _figures_of(fundamental(alone).shown(), lead, time_figures, rows[k : k + 1])
        if response is not None:
            of_loop = rows[:, [fig.STABLE, fig.RADIUS]]
            _figures_of(response, np.nan, time_figures, rows)
            rows[:, [fig.STABLE, fig.RADIUS]] = of_loop
            rows[np.isnan(of_loop[:, 0]), fig.MODULUS :] = np.nan
        out[chosen, LOOPS.index(stage)] = rows


def _figures_of(block: Block, lead: Any, time_figures: bool, rows: np.ndarray) -> None:
    """Write the figures of a stacked open loop (lead NaN: of a closed loop's response)."""
    A, B, C = _stacked(block, len(rows))
    leads = np.array(np.broadcast_to(np.asarray(lead, dtype=float), len(rows)))
    closed = A - B[:, :, None] * C[:, None, :] * ~np.isnan(leads)[:, None, None]
    finite = np.isfinite(A).all(axis=(1, 2)) & np.isfinite(closed).all(axis=(1, 2))
    result = [np.linalg.eigvals(np.where(finite[:, None, None], each, 0.0)) for each in (A, closed)]
    poles = np.stack([part for each in result for part in (each.real, each.imag)], axis=1)
    poles[~finite] = np.nan
    many_loops(A, B, C, poles, leads, time_figures, rows)


def _command_path(wired: Drive, stage: str) -> tuple[Any, Block | None]:
    """What stands between command and loop: a lead k_ff/(Kv T) of the position's, or else the whole response.

    With a P controller that feeds back the output itself, T (1 + lead (1 - 1/z)) is that response. Of a drive
    whose command has a mean it is that to the reference, behind mean and filter.
    """
    if stage != "position":
        return 0.0, commanded(wired, stage) if wired.responds_apart(stage) else None
    design, T = wired.design, wired.period_s("position")
    if command_mean(design.nominal or design):
        wired = wire(replace(design, command=Command()), wired.operating)
    law = wired.design.controller.position_loop
    more = (law.derivative_time_s, law.acceleration_feedforward, wired.design.command.filter_time_s)
    plain = law.law is None and law.integral_time_s is None and not any(map(present, more))
    if plain and (wired.design.coupling is None or law.sensor == "output"):
        return law.feedforward / (law.gain * T), None
    program = TickProgram(wired, "position")
    return 0.0, fundamental_path(program, wired.interval["position"], "ref", "output_angle")


def _stacked(block: Block, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Arrays of its own for every design, without the direct term, which is 0."""
    n = len(block.states)
    LOOP_STATES.check(n)

    def own(part: np.ndarray, *shape: int) -> np.ndarray:
        return np.array(np.broadcast_to(part, (count, *shape)))

    return own(block.A, n, n), own(block.B[..., 0], n), own(block.C[..., 0, :], n)
