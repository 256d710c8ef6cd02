"""The simulator's own derivative: a complete linear model of the running drive, from its compiled tick.

On an operating motion one base period of the drive, H ticks (the least common multiple of its stages'
updates), is a map of its state s and of a signal v added at one place and held there over its own period,

    s' = F(s, v),   y = G(s, v).

It is affine where no event changes (a limit, a reversal, a parting of the coupling) and smooth under a load
that bends with the angle.  Its derivative

    A = dF/ds,   B = dF/dv,   C = dG/ds,   D = dG/dv

says everything that a linear loop says: response, poles, margins, at any rate, of any slow mode, stable or
not.  It shares no code with the linear loops, so the two may be held against each other.

It is taken by central differences, a column at a time.  Which numbers of the state take part, a kick at the
place shows: those that it moves.  The step of a column grows by tens from far below the kick's own motion as
long as no event happens in the run and the derivative does not bend; the column is taken where two successive
steps agree best.  What their difference makes of the response is the stated error.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from math import isfinite
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from actuator_lti.design.loader import as_design
from actuator_lti.errors import NumericalError
from actuator_lti.resolvent import balanced
from nonlinear._kernels import layout as at
from nonlinear._kernels.state_kinds import CONTINUOUS, COUNTER, FLAG, names_of, places_of
from nonlinear.loop_setup import LoopSetup, every, loop_setup
from nonlinear.stepper import Stepper

if TYPE_CHECKING:
    from actuator_lti.design.model import Design

Floats = npt.NDArray[np.float64]
Complexes = npt.NDArray[np.complex128]
RETURNED = {
    "u": at.S_VOLTAGE_BEFORE, "i_ref": at.S_CURRENT_BEFORE, "w_ref": at.S_SPEED_COMMAND,
    "output": at.S_OUTPUT_BEFORE,
}  # fmt: skip
GRID = np.geomspace(1e-4, 0.98, 60) * np.pi  # rad a sample: where the error is stated
FAINT = 1e-6  # of the dominant part of a response: below that it is judged by that part
ROUGH, FINE = (10, 4), (1, 10)  # largest decade of a step about a kick's first motion, a sine; and steps
LEAST_DECADE = -30
LEAST_STEP = 1e-9  # of the number itself
FALLING = 0.2  # of the disagreement of the step before: it still falls as a bend lets it
PASSES = 3  # of choosing steps by what they do to the response that the last choice gave
BENT = 100.0  # times the best agreement: a step so large that the derivative bends
LOST = 1e-3  # of a response
NONE = 1e-14  # of a response: no difference
FRESH = 4  # periods from when a number is first moved, in which its motion gives its scale


@dataclass(frozen=True, eq=False)
class Tangent:
    """Linear model of the running drive from an injection at a place to what comes back there.

    Attributes
    ----------
    place : str
        A stage (outer loops open), a break point (all loops closed), ``"command"`` or ``"load"``.
    A, B, C, D : ndarray, shapes (n, n), (n, M), (M, n), (M, M)
        Over one base period. The M inputs are the values held one after the other at the place, the M outputs
        what comes back at its updates, negated: the closed loop T = L/(1 + L). To command and load:
        the output's answer.
    period_s, hold_s : float
        Base period, and time between two updates at the place.
    states : tuple of str
        Names of the numbers of the state that the injection moves, as the layout has them.
    stated_error : float
        Largest error of the response, relative, by what two step sizes differ in.
    places : ndarray of int, shape (n,)
        Where the states lie in the row of the state.
    """

    place: str
    A: Floats
    B: Floats
    C: Floats
    D: Floats
    period_s: float
    hold_s: float
    states: tuple[str, ...]
    stated_error: float
    places: npt.NDArray[np.intp] = field(repr=False, default_factory=lambda: np.empty(0, np.intp))

    @cached_property
    def system(self) -> Any:
        """The same as a `control.StateSpace` with named signals."""
        import control

        updates = range(self.B.shape[1])
        names = {"inputs": [f"{self.place}_in[{k}]" for k in updates]}
        names["outputs"] = [f"{self.place}_back[{k}]" for k in updates]
        parts = (self.A, self.B, self.C, self.D, self.period_s)
        return control.ss(*parts, remove_useless_states=False, name=f"tangent_{self.place}", **names)

    def closed(self, points: npt.ArrayLike) -> Complexes:
        """T at points z = exp(j w hold_s), of their shape; of a periodic loop the fundamental.

        That is what a sinusoid injected at the place brings back at its own frequency.
        """
        return response(self.A, self.B, self.C, self.D, np.asarray(points, complex))

    def open(self, points: npt.ArrayLike) -> Complexes:
        """L = T/(1 - T) at points z."""
        closed = self.closed(points)
        return np.asarray(closed / (1.0 - closed))

    def lifted(self, point: complex) -> Complexes:
        """The transfer matrix over a base period, shape (M, M), at a point z = exp(j w period_s)."""
        A, scale = balanced(self.A)
        inside = np.linalg.solve(point * np.eye(len(A)) - A, (self.B / scale[:, None]).astype(complex))
        return np.asarray(self.C * scale @ inside + self.D)

    def at_gain(self, gain: float) -> Floats:
        """A with the loop gain at the place multiplied: v = (gain - 1) times what comes back."""
        more = gain - 1.0
        back = np.linalg.solve(np.eye(len(self.D)) + more * self.D, self.C)
        return np.asarray(self.A - more * self.B @ back)

    def __str__(self) -> str:
        return (
            f"tangent at {self.place}: {len(self.A)} states over {self.period_s:g} s, "
            f"stated error {self.stated_error:.1e}"
        )


def response(A: Floats, B: Floats, C: Floats, D: Floats, z: Complexes) -> Complexes:
    """The fundamental of a lifted system at points of the faster rate, shape of z."""
    A, scale = balanced(A)
    B, C = B / scale[:, None], C * scale
    M, n = B.shape[1], len(A)
    points = z.reshape(-1, 1, 1)
    inside = np.linalg.solve(points**M * np.eye(n) - A, np.broadcast_to(B.astype(complex), (z.size, n, M)))
    turn = z.reshape(-1, 1) ** np.arange(M)
    whole = C @ inside + D
    return np.asarray(np.einsum("kj,kjm,km->k", 1.0 / turn, whole, turn) / M).reshape(z.shape)


def tangent(
    design: Design | str | PathLike[str], place: str, *, setup: LoopSetup | None = None, hold: bool = True
) -> Tangent:
    """Measure the derivative of the running drive.

    Parameters
    ----------
    design : Design, str or path
    place : str
        ``"current"``, ``"velocity"``, ``"position"``: the loop of a stage, outer loops open.  ``"u"``,
        ``"i_ref"``, ``"w_ref"``, ``"output"``: the loop seen there, all loops closed.  ``"command"`` and
        ``"load"``: from the command, from the moment on the output shaft, to the output.
    setup : LoopSetup, optional
        Operating motion and test set-up; by default `nonlinear.loop_setup.loop_setup` chooses one.
    hold : bool
        Whether the rotor is locked for the current loop, as on a bench.

    Returns
    -------
    Tangent

    Raises
    ------
    InputError
        If the design has no such place or no operating motion.
    NumericalError
        If no step is free of events.

    Notes
    -----
    Limits, counts, noise and supply are out of the test set-up; friction acts as the operating motion has it.

    Examples
    --------
    >>> t = tangent("ilr33-amber", "position")
    >>> t.stated_error < 1e-7, t.period_s
    (True, 0.0001)
    >>> import numpy as np
    >>> from actuator_lti import assemble_loops
    >>> z = np.exp(1j * 130.0 * t.hold_s)
    >>> bool(abs(t.open(z) / assemble_loops("ilr33-amber").position.open_loop(z) - 1.0) < 1e-9)
    True
    """
    if setup is None:
        setup = loop_setup(as_design(design), place, limits_on=False, held=hold and place == "current")
    return _Bench(setup, place).tangent()


class _Bench:
    """One place of a drive that runs by hand."""

    def __init__(self, setup: LoopSetup, place: str) -> None:
        self.place, self.setup = place, setup
        self.injected = _Injection(setup, place)
        self.drive = Stepper(self.injected.rows)
        self.injected.prepare(self.drive.p)
        self.hold = self.injected.hold_ticks
        self.updates = setup.base_ticks // self.hold
        self.watched = places_of(self.drive.p, FLAG, COUNTER)
        self.calm = self._over(self.drive.start, np.zeros(self.updates))
        self.moved, self.scale, self.kick = self._reached()
        self._known: dict[tuple[tuple[int, int], bytes], list[_Column]] = {}

    def tangent(self) -> Tangent:
        """Every column by the step that serves the response best, and the error that is left in it."""
        n, z = self.moved.size, np.exp(1j * GRID)
        rough = np.stack([column for column, _ in self._columns(self.scale, ROUGH, None)], axis=1)
        forced = sensitivities(*_split(rough, n), z)[1]
        sway = self.kick * np.max(np.abs(forced[:, :n]), axis=0)  # of each number, in a sine
        seen: tuple[Floats, Floats] | None = None
        for _ in range(PASSES):
            chosen = self._columns(np.where(np.isfinite(sway) & (sway > 0.0), sway, self.scale), FINE, seen)
            parts = _split(np.stack([column for column, _ in chosen], axis=1), n)
            left, right = (np.abs(each) for each in sensitivities(*parts, z))
            size = sized(response(*parts, z))
            seen = left / size[:, None], right
        off = np.stack([error for _, error in chosen], axis=1)
        tick_s = self.setup.design.controller.period_s
        return Tangent(
            self.place,
            *parts,
            period_s=self.setup.base_ticks * tick_s,
            hold_s=self.hold * tick_s,
            states=names_of(self.moved),
            stated_error=float(np.max(np.einsum("zi,ik,zk->z", left / size[:, None], off, right))),
            places=self.moved,
        )

    def _columns(
        self, scale: Floats, extent: tuple[int, int], seen: tuple[Floats, Floats] | None
    ) -> list[tuple[Floats, Floats]]:
        """Columns of A over C beside B over D, and their errors, by what the response sees of them."""
        felt = np.maximum(scale, LEAST_STEP * np.abs(self.drive.start[self.moved]))
        units = np.concatenate([felt, np.full(self.updates, self.kick)])
        key = (extent, units.tobytes())
        if key not in self._known:
            self._known[key] = [self._tried(k, unit, *extent) for k, unit in enumerate(units)]
        tried = self._known[key]
        if seen is None:
            return [each.best(1.0 / units[None], np.array([units[k]])) for k, each in enumerate(tried)]
        return [each.best(seen[0], seen[1][:, k]) for k, each in enumerate(tried)]

    def _over(self, state: Floats, injected: Floats) -> tuple[Floats, Floats, Floats]:
        """State behind one base period, what came back at each update, and the flags on the way."""
        drive, flags = self.drive, np.empty((self.updates, self.watched.size))
        back = np.empty(self.updates)
        drive.put(state)
        for k in range(self.updates):
            drive.p[self.injected.at] = self.injected.steady + injected[k]
            early = self.injected.read(drive.s, drive.p)
            drive.run(self.hold)
            back[k] = early if self.injected.at_start else self.injected.read(drive.s, drive.p)
            flags[k] = drive.s[self.watched]
        return drive.s.copy(), back, flags

    def _reached(self) -> tuple[npt.NDArray[np.intp], Floats, float]:
        """Which numbers a kick moves, how far each, and the kick: the largest without an event."""
        kick = self.injected.size
        while kick > 0.0:
            moved = self._kicked(kick)
            if moved is not None:
                places = places_of(self.drive.p, CONTINUOUS)
                places = places[moved[places] > 0.0]
                return places, moved[places], kick
            kick = kick / 10.0 if kick > 1e-15 * self.injected.size else 0.0
        raise NumericalError(
            f"{self.setup.design.name}: {self.place}: every kick at it ends in an event; "
            "no operating motion without one"
        )

    @property
    def _memory(self) -> int:
        """Ticks that a change may take through delay line, stored angles and moving average."""
        p = self.drive.p
        stored = p[at.DIFFERENCE_SAMPLES] * p[at.EVERY_VELOCITY] + p[at.PROFILE_SAMPLES] * p[at.OUTER_EVERY]
        return int(p[at.DELAY_LINE] + stored)

    def _kicked(self, kick: float) -> Floats | None:
        """How far a kick moves each number soon after it reaches it; None where it ends in an event."""
        none, first = np.zeros(self.updates), np.zeros(self.updates)
        first[0] = kick
        with_it = without = self.drive.start
        moved, since = np.zeros(with_it.size), np.full(with_it.size, -1)
        quiet, period = 0, 0
        patience = self._memory // self.setup.base_ticks + FRESH
        while quiet <= patience:
            with_it, _, flags = self._over(with_it, none if period else first)
            without, _, usual = self._over(without, none)
            if not np.array_equal(flags, usual):
                return None
            off = np.where(with_it == without, 0.0, with_it) - np.where(with_it == without, 0.0, without)
            off = np.abs(off)  # a limit that is lifted is infinite in both
            new = (off > 0.0) & (since < 0)
            since[new] = period
            young = (since >= 0) & (period - since < FRESH)
            moved[young] = np.maximum(moved[young], off[young])
            quiet, period = (0 if new.any() else quiet + 1), period + 1
        return moved

    def _tried(self, k: int, unit: float, most: int, steps: int) -> _Column:
        """One column by steps that fall by tens from ``unit`` times ten to the ``most``, without an event."""
        found: list[tuple[Floats, Floats]] = []
        off = [np.inf]
        for decade in range(most, LEAST_DECADE, -1):
            quotient, rounding = self._difference(k, unit * 10.0**decade)
            if quotient is None or not np.isfinite(rounding).all():
                continue
            if found:
                off.append(float(np.max(np.abs(quotient - found[-1][0]))))
            found.append((quotient, rounding))
            if len(found) >= steps and off[-1] > FALLING * off[-2]:  # no longer bent
                break
        if len(found) < 2:
            name = names_of(self.moved)[k] if k < self.moved.size else "the injection"
            raise NumericalError(
                f"{self.setup.design.name}: {self.place}: every step of {name} ends in an event"
            )
        return _Column(*(np.stack(each[::-1]) for each in zip(*found, strict=True)))

    def _difference(self, k: int, step: float) -> tuple[Floats | None, Floats]:
        """Central difference of state and returned values over one number, and what rounding may make of it.

        None after an event.
        """
        n, outcome, width = self.moved.size, [], 0.0
        for side in (step, -step):
            state, injected = self.drive.start, np.zeros(self.updates)
            if k < n:
                state = state.copy()
                state[self.moved[k]] += side
                width += abs(state[self.moved[k]] - self.drive.start[self.moved[k]])
            else:
                injected[k - n] = side
                width += abs(self.injected.steady + side - self.injected.steady)
            after, back, flags = self._over(state, injected)
            if not np.array_equal(flags, self.calm[2]) or not np.isfinite(after[self.moved]).all():
                return None, np.empty(0)
            outcome.append(np.concatenate([after[self.moved], back]))
        with np.errstate(divide="ignore", invalid="ignore"):
            quotient = (outcome[0] - outcome[1]) / width
            return quotient, np.spacing(np.maximum(*np.abs(outcome))) / width


@dataclass(frozen=True)
class _Column:
    """One column by steps that grow by tens, shape (steps, n + M), and what rounding may make of each."""

    values: Floats
    rounding: Floats

    def best(self, left: Floats, right: Floats) -> tuple[Floats, Floats]:
        """The column whose error, seen through the response, is least, up to where it bends; and that error.

        The error of a step is what it differs in from the next smaller one, and what rounding may make of it.
        """
        off = np.maximum(np.abs(np.diff(self.values, axis=0)), self.rounding[1:])
        seen = np.maximum(np.max((off @ left.T) * right, axis=1), NONE)
        bent = np.flatnonzero((seen > BENT * np.minimum.accumulate(seen)) & (seen > LOST))
        k = int(np.argmin(seen[: bent[0]] if bent.size else seen))
        return self.values[k + 1], off[k]


class _Injection:
    """Where the signal is added, how much would be large there, and what is read."""

    def __init__(self, setup: LoopSetup, place: str) -> None:
        design = setup.design
        self.place, self.rows, self.ratio = place, setup.row(), design.total_ratio
        self.at_start = place in ("command", "load")
        self.outermost = design.controller.outermost
        if place == "load":
            self.hold_ticks, self.at = 1, at.LOAD
        elif place == "command":
            self.rows.step("command", 0.0, -1.0)
            self.hold_ticks, self.at = every(design, self.outermost), at.COMMAND + 1
        else:
            point = setup.point
            self.rows.step(point, 0.0, -1.0)
            probe = at.PROBES + at.POINTS.index(point) * at.PROBE_SIZE
            self.hold_ticks, self.at = setup.hold_ticks, probe + at.PROBE_SIGNAL + 1
            self.read_at = RETURNED[point]
        self.size = setup.range if isfinite(setup.range) and setup.range > 0.0 else 1.0
        self.steady = float(self.rows.values[0, self.at])

    def prepare(self, p: Floats) -> None:
        """Let the load be looked at in every tick where it is what is moved."""
        if self.place == "load":
            p[at.RARE_LOAD] = 1.0

    def read(self, s: Floats, p: Floats) -> float:
        """What comes back, negated; the output itself for command and load."""
        if not self.at_start:
            return -float(s[self.read_at])
        if self.place == "command" and self.outermost != "position":
            return float(s[at.S_CURRENT if self.outermost == "current" else at.S_SPEED])
        return float(s[at.S_OUTPUT]) if p[at.ELASTIC_DRIVE] > 0.0 else float(s[at.S_ANGLE]) / self.ratio


def sensitivities(A: Floats, B: Floats, C: Floats, D: Floats, z: Complexes) -> tuple[Complexes, Complexes]:
    """What an entry (i, k) of A over C beside B over D does to the fundamental at z: left_i right_k."""
    A, scale = balanced(A)
    B, C = B / scale[:, None], C * scale
    M, n = B.shape[1], len(A)
    turned = z.reshape(-1, 1, 1) ** M * np.eye(n) - A
    turn = z.reshape(-1, 1) ** np.arange(M)
    back = 1.0 / (turn * M)
    right = np.linalg.solve(turned, (turn @ B.T)[:, :, None])[:, :, 0]
    left = np.linalg.solve(turned.transpose(0, 2, 1), (back @ C)[:, :, None])[:, :, 0]
    return np.concatenate([left / scale, back], axis=1), np.concatenate([right * scale, turn], axis=1)


def _split(whole: Floats, n: int) -> tuple[Floats, Floats, Floats, Floats]:
    return whole[:n, :n], whole[:n, n:], whole[n:, :n], whole[n:, n:]


def relative(found: npt.ArrayLike, wanted: npt.ArrayLike) -> Floats:
    """Difference over size, see `sized`."""
    return np.asarray(np.abs(np.asarray(found) - wanted) / sized(wanted))


def sized(response: npt.ArrayLike) -> Floats:
    """Size of a response, of a faint part of it that of its dominant part in part."""
    size = np.abs(response)
    return np.asarray(size + FAINT * np.max(size, initial=1e-300))
