"""Stick-slip hunting, predicted exactly where a describing function is blind: rest, breakaway, slip, rest.

A controller winds up while the rotor rests at an error E, until the drive torque reaches breakaway; then the
drive is the sampled linear loop with the smaller sliding friction until the speed returns to zero. A cycle
is an E that the slip turns into -E. A constant load and an offset of friction move the integral alone.

At rest the drive is linear as well, whatever the controller is: the loop with a rotor that nothing moves.
With one mode at 1 (an integral), l and v its left and right vector, the other states z come to a ramp along
v, and ``l z`` says how far. What else moves has died out by the next breakaway.
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from actuator_lti.design.model import Design
from actuator_lti.drive.operating import straight
from actuator_lti.drive.steady import steady_input
from actuator_lti.loops import Loops, assemble_loops
from actuator_lti.loops.assemble import loops_at
from actuator_lti.loops.simulation import TickSystem
from actuator_lti.systems.root import root
from actuator_lti.types import Floats
from analyses.large_signal.tones import settling_ticks_in_periods

SMALLEST, LARGEST, POINTS = 1e-3, 1.0, 241  # of the error that breaks away before anything has wound up
SLOPE_STEP = 1e-3
HELD = 1e30  # so many times its inertia hold the rotor
AT_ONE = 1e-6  # an eigenvalue so near to 1 integrates
LOST = 1e-12  # of what it moves otherwise: rounding


@dataclass(frozen=True)
class StickSlipCycle:
    """A symmetric stick-slip cycle."""

    output_amplitude_rad: float  # error at rest on either side, output side
    frequency_hz: float
    slope: float  # of the next error over this; below 1 in magnitude the cycle attracts

    @property
    def stable(self) -> bool:
        """Whether motion near it comes nearer."""
        return abs(self.slope) < 1.0


@dataclass(frozen=True)
class _Slip:
    """Slip from breakaway as the sum of a part that goes with E and a part that does not, and rest."""

    period_s: float
    states: tuple[str, ...]
    runs: Floats  # of both parts, tick by tick, shape (2, ticks, states), from where they break away
    counts: Floats  # what l z is when the next period begins, of the states at each tick of one that rests
    pace: float  # growth of l z over a period at a motor angle of 1

    @cached_property
    def speeds(self) -> Floats:
        """Those of both parts."""
        return np.ascontiguousarray(self.runs[:, :, self.states.index("w")])

    def from_error(self, error: float) -> tuple[float, float] | None:
        """Error after the slip in its direction, time until the next slip; None: it does not end."""
        w = np.array([1.0, error]) @ self.speeds
        ends = np.flatnonzero((w[1:-1] > 0.0) & (w[2:] <= 0.0)) + 1
        if not ends.size:
            return None
        k = int(ends[0])
        part = w[k] / (w[k] - w[k + 1])
        x = self.runs[0, k : k + 2] + error * self.runs[1, k : k + 2]
        landed = (1.0 - part) * x[0] + part * x[1]
        th = float(landed[self.states.index("th")])
        rest = math.inf if th <= 0.0 else max(self._rest(landed, th, k), 0.0)
        return -th, float(k + part + rest) * self.period_s

    def _rest(self, landed: Floats, th: float, tick: int) -> float:
        """Ticks from landing until the state is that of breakaway the other way, -l z of the error ``th``."""
        ticks = len(self.counts) - 1
        goes = -self.counts[-1] @ (self.runs[0, 0] + th * self.runs[1, 0])
        periods = (goes - self.counts[tick % ticks] @ landed) / (self.pace * th)
        return float(ticks * (1.0 + periods) - tick % ticks)


def stick_slip_cycle(design: Design, load_Nm: float, loops: Loops | None = None) -> StickSlipCycle | None:
    """The symmetric cycle of an integrating controller, by its sampled sliding ``loops``, if any."""
    if (slip := _slip(design, load_Nm, loops)) is None:
        return None
    first, by_error = slip.runs[:, 0] @ slip.counts[-1]
    if not by_error < 0.0:
        return None
    grid = -first / by_error * np.geomspace(SMALLEST, LARGEST, POINTS)

    def surplus(error: float) -> float:
        result = slip.from_error(error)
        return -error if result is None else -result[0] - error

    values = np.array([surplus(float(error)) for error in grid])
    falls = np.flatnonzero((values[:-1] > 0.0) & (values[1:] <= 0.0))
    if not falls.size:
        return None
    k = int(falls[-1])
    error = root(surplus, grid[k], grid[k + 1], 1e-12 * grid[k])
    result = slip.from_error(error)
    if result is None or not math.isfinite(result[1]):
        return None
    step = SLOPE_STEP * error
    slope = (surplus(error + step) - surplus(error - step)) / (2.0 * step) + 1.0
    return StickSlipCycle(error / design.total_ratio, 0.5 / result[1], slope)


def _alone(design: Design, load_Nm: float) -> bool:
    """Whether one dry friction, the same both ways, is all that is not linear in the drive."""
    friction, coupling, behind = design.friction, design.coupling, design.load.friction
    symmetric = friction.dry_torque_reverse_Nm is None and friction.viscous_reverse_Nms_rad is None
    rubs = friction.law == "coulomb" and not friction.points and friction.dry_Nm(load_Nm) > 0.0
    dry_behind = behind is not None and behind.dry_torque_Nm > 0.0
    beyond = coupling is not None and (coupling.play_rad or friction.load_coefficient or dry_behind)
    return symmetric and rubs and not beyond and straight(design) == design


def _slip(design: Design, load_Nm: float, loops: Loops | None) -> _Slip | None:
    """Follow the slip after breakaway; None: nothing winds up, or more than sticking is not linear."""
    if not _alone(design, load_Nm):
        return None
    loops = assemble_loops(design) if loops is None else loops
    rotor = replace(design.motor, rotor_inertia_kgm2=HELD * design.motor.rotor_inertia_kgm2)
    held = loops_at(replace(design, motor=rotor), loops.operating, loops.form).tick_system
    dry = design.friction.dry_Nm(load_Nm)
    if (system := loops.tick_system) is None or held is None:
        return None
    if (stands := _stands(design, held, dry * design.friction.breakaway_ratio)) is None:
        return None
    (*starts, count), pace = stands
    counts = [count]
    for j in reversed(range(held.ticks)):
        counts.append(counts[-1] @ held.matrices(j)[0])
    runs = _runs(system, np.array(starts), np.array([-dry, 0.0]), settling_ticks_in_periods(loops))
    return _Slip(design.controller.period_s, system.states, runs, np.array(counts[::-1]), pace)


def _stands(design: Design, held: TickSystem, torque_Nm: float) -> tuple[Floats, float] | None:
    """As the drive breaks away: the states without an error, by an error of 1, and l; growth of l z.

    None: not one mode integrates, or one grows, or it does not drive against an error.
    """
    names, over = held.states, np.eye(len(held.states))
    for j in range(held.ticks):
        over = held.matrices(j)[0] @ over
    th = names.index("th")
    moves = np.array([k for k, name in enumerate(names) if name not in ("w", "th")])
    A, fed = over[np.ix_(moves, moves)], over[moves, th]
    modes = np.linalg.eigvals(A)
    integrates = np.abs(modes - 1.0) < AT_ONE
    if integrates.sum() != 1 or np.abs(modes[~integrates]).max(initial=0.0) > 1.0 - AT_ONE:
        return None
    current, volts = steady_input(design, torque_Nm, 0.0)
    seen, level = ("i", current) if "i" in names else ("u", volts)
    row = held.matrices(0)[2][held.outputs.index(seen)]
    left, _, right = np.linalg.svd(A - np.eye(len(A)))
    if abs(row[moves] @ right[-1]) < LOST * np.abs(row).max():
        return None
    ramp = right[-1] / (row[moves] @ right[-1])
    count = left[:, -1] / (left[:, -1] @ ramp)
    whole = np.block([[np.eye(len(A)) - A, ramp[:, None]], [row[moves], 0.0]])  # of z, and its growth
    given = np.array([[*(0.0 * fed), level], [*-fed, row[th]]])
    found = np.zeros((3, len(names)))
    found[:2, moves], found[1, th], found[2, moves] = np.linalg.solve(whole, given.T).T[:, :-1], -1.0, count
    pace = float(count @ fed)
    return (found, pace) if pace < 0.0 else None


def _runs(system: TickSystem, x: Floats, torques_Nm: Floats, count: int) -> Floats:
    """The states from each row of x on, at so many ticks, whole periods, under a constant torque each.

    What follows so many periods already known is one affine map of them; then tick by tick, of all at once.
    """
    phases = [system.matrices(j) for j in range(system.ticks)]
    steps = [(A.T, np.outer(torques_Nm, B[:, 1])) for A, B, _, _ in phases]
    A, driven = np.eye(x.shape[1]), np.zeros(x.shape)
    for step, torque in steps:
        A, driven = A @ step, driven @ step + torque
    runs, known = np.empty((count // system.ticks, system.ticks, *x.shape)), 1
    runs[:1, 0] = x
    while known < len(runs):
        more = min(known, len(runs) - known)
        runs[known : known + more, 0] = runs[:more, 0] @ A + driven
        A, driven, known = A @ A, driven @ A + driven, known + more
    for j, (step, torque) in enumerate(steps[:-1], 1):
        runs[:, j] = runs[:, j - 1] @ step + torque
    return runs.reshape(-1, *x.shape).swapaxes(0, 1)
