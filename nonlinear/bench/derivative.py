"""The simulator's own derivative: a complete linear model of the running drive, from its compiled tick.

On an operating motion one base period of the drive, H ticks (the least common multiple of its stages'
updates), is a map of its state s and of a signal v added at one place and held there over its own period:
s' = F(s, v), y = G(s, v).  It is affine where no event changes (a limit, a reversal, a parting of the
coupling) and smooth under a load that bends with the angle.  Its derivative A = dF/ds, B = dF/dv, C = dG/ds,
D = dG/dv says everything that a linear loop says: response, poles, margins, at any rate, of any slow mode,
stable or not.  It shares no code with the linear loops, so the two may be held against each other.

`nonlinear.bench.differences` takes it; what two sizes of its steps differ in is the stated error.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from actuator_lti.design.loader import AnyDesign, as_design
from actuator_lti.types import Complexes, Floats
from nonlinear.bench.differences import Differences
from nonlinear.bench.injection import Watched
from nonlinear.bench.lifted import eigenvalues, even, lifted, response, sensitivities, without_rest
from nonlinear.bench.loop_setup import LoopSetup, loop_setup


@dataclass(frozen=True, eq=False)
class Tangent:
    """Linear model of the running drive from an injection at a place to what comes back there.

    ``place``: a stage (outer loops open), a break point (all loops closed), ``"command"`` or ``"load"``.
    ``A, B, C, D``, shapes (n, n), (n, M), (M, n), (M, M): over one base period. The M inputs are the values
    held one after the other at the place, the M outputs what comes back at its updates, negated: the closed
    loop T = L/(1 + L). To command and load: the output's answer.
    ``period_s, hold_s``: base period, and time between two updates at the place.
    ``states``: names of the numbers of the state that the injection moves, as the layout has them.
    ``stated_error``: largest error of the response, relative, by what two step sizes differ in.
    ``entry_errors``, shape (n + M, n + M): the same of the entries of A over C beside B over D; see
    `error_at`.
    ``places``, shape (n,): where the states lie in the row of the state.
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
    entry_errors: Floats = field(repr=False)
    places: npt.NDArray[np.intp] = field(repr=False)

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
        return response(*self._even, self.D, np.asarray(points, complex))

    def error_at(self, points: npt.ArrayLike) -> Floats:
        """Stated error of T at points z, of their shape: a sharp resonance feels errors of entries more."""
        z = np.asarray(points, complex)
        left, right = sensitivities(self.A, self.B, self.C, self.D, z.reshape(-1))
        felt = np.einsum("zi,ik,zk->z", np.abs(left), self.entry_errors, np.abs(right))
        return np.asarray(felt).reshape(z.shape)

    def open(self, points: npt.ArrayLike) -> Complexes:
        """L = T/(1 - T) at points z."""
        closed = self.closed(points)
        return np.asarray(closed / (1.0 - closed))

    def lifted(self, point: complex) -> tuple[Complexes, Complexes]:
        """The transfer matrix over a base period, shape (M, M), at z = exp(j w period_s), and its slope."""
        A, B, C = self._even
        turned = point * np.eye(len(A)) - A
        slope = -C @ np.linalg.solve(turned, np.linalg.solve(turned, B))  # -C (z - A)^-2 B
        return lifted(A, B, C, self.D, np.array([point], complex))[0], slope

    @cached_property
    def _even(self) -> tuple[Floats, Floats, Floats]:
        """A, B and C with states of like size."""
        return even(self.A, self.B, self.C)

    def at_gain(self, gain: float) -> Floats:
        """A with the loop gain at the place multiplied: v = (gain - 1) times what comes back."""
        return np.asarray(self.A - self.B @ self._factor(gain) @ self.C)

    def _factor(self, gain: float) -> Floats:
        more = gain - 1.0
        return np.asarray(more * np.linalg.inv(np.eye(len(self.D)) + more * self.D))

    @cached_property
    def at_rest(self) -> int:
        """Modes at rest that it has, whatever the gain."""
        n = len(self.A)
        return n - len(without_rest(self.A, self.entry_errors[:n, :n], n)[0])

    def poles_at(self, gain: float) -> tuple[Complexes, Floats]:
        """Poles at a gain at the place, but those at rest; the error of each, by those of the entries."""
        n, factor = len(self.A), self._factor(gain)
        back = np.hstack([np.eye(n), -self.B @ factor])
        seen = np.vstack([np.eye(n), -factor @ self.C])
        errors = np.abs(back) @ self.entry_errors @ np.abs(seen)
        values, felt, _ = eigenvalues(*without_rest(self.at_gain(gain), errors, self.at_rest))
        return values, felt

    def __str__(self) -> str:
        return (
            f"tangent at {self.place}: {len(self.A)} states over {self.period_s:g} s, "
            f"stated error {self.stated_error:.1e}"
        )


def tangent(design: AnyDesign, place: str, *, setup: LoopSetup | None = None, hold: bool = True) -> Tangent:
    """Measure the derivative of the running drive.

    ``place``: ``"current"``, ``"velocity"``, ``"position"``: the loop of a stage, outer loops open.
    ``"u"``, ``"i_ref"``, ``"w_ref"``, ``"output"``: the loop seen there, all loops closed.  ``"command"`` and
    ``"load"``: from the command, from the moment on the output shaft, to the output.
    ``setup``: operating motion and test set-up; by default `nonlinear.bench.loop_setup.loop_setup` chooses.
    ``hold``: whether the rotor is locked for the current loop, as on a bench.

    Raises `InputError`: if the design has no such place or no operating motion; `NumericalError`: if no step
    is free of events.

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
    return next(tangents(setup, place))


def tangents(setup: LoopSetup, place: str, watched: Sequence[Watched | None] = (None,)) -> Iterator[Tangent]:
    """From a place to each of some signals that are watched (None: what comes back), measured at once."""
    measured, tick_s = Differences(setup, place, watched), setup.design.controller.period_s
    for parts, entry_errors, stated_error in measured.parts():
        yield Tangent(
            place,
            *parts,
            period_s=setup.base_ticks * tick_s,
            hold_s=measured.hold * tick_s,
            states=measured.names,
            stated_error=stated_error,
            entry_errors=entry_errors,
            places=measured.moved,
        )
