"""Compliance and stiffness at the output from the linear drive: dynamic, static, least; and lost motion.

K = M_ext / output angle, the inverse of the compliance: the response to a load torque held over every tick.
One design or stacked ones (arrays of shape (K,)).

Slower stages make the drive periodically time-varying, with a period of M ticks: `mean_response` needs its n
states, where one time-invariant system of the same response (`actuator_lti.loops.periodic.cyclic`) has M n.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from actuator_lti.drive.operating import Operating, OperatingPoint, reaction
from actuator_lti.drive.wiring import wire
from actuator_lti.loops.tick import Block, TickProgram, mean_response, pruned, siso
from actuator_lti.systems.settling import slowest_mode

if TYPE_CHECKING:
    from actuator_lti.design.model import Design

POINTS = 240
LOWEST_HZ, HIGHEST_HZ = 0.1, 1000.0
BELOW_NYQUIST = 0.45  # of the sampling rate: at 0.5 a held torque does not move a free mass at the samples
LOST_MOTION_SHARE = 0.03  # of the rated load torque
_AROUND = np.linspace(-1.0, 1.0, 17)  # of the spacing of the frequencies, a quarter as wide every round
_ROUNDS = 12
# Where the limit at zero frequency is decided on; is read (and at twice that), above the rounding of a pole
# there that no load moves (that of a speed drive, whose integral holds the angle); its slope
_REST_HZ, _READ_HZ, _SLOW_HZ = 1e-9, 1e-8, 1e-5
_AWAY = 1e-3  # of the stiffness at `_SLOW_HZ` is left at `_REST_HZ`: 1e-4 by one free integration


@dataclass(frozen=True)
class StiffnessFigures:
    """What a requirement may limit, each worked out where it is read; floats, or arrays of stacked designs.

    A load changes them only by the piece of a spring that bends: friction slides. Of friction by the
    coupling's torque the smaller of both `ways` counts.
    """

    design: Design
    load_Nm: float = 0.0

    @cached_property
    def static_stiffness_Nm_rad(self) -> Any:
        """Powered, at zero frequency; see `static_stiffness`."""
        return self._smallest(static_stiffness)

    @cached_property
    def least_stiffness_Nm_rad(self) -> Any:
        """Powered, the smallest size at rest and between `LOWEST_HZ` and `HIGHEST_HZ` (or Nyquist)."""
        size = self._smallest(lambda response: np.abs(stiffness_at(response, weakest_hz(response)))[..., 0])
        return _plain(np.minimum(size, self.static_stiffness_Nm_rad))

    @property
    def lost_motion_rad(self) -> Any:
        """At +-3 % of the largest load torque, never below the play; 0 of a rigid drive train."""
        return lost_motion_rad(self.design)

    def _smallest(self, read: Callable[[Compliance], Any]) -> Any:
        found = [np.where(there, read(self._responses[way]), np.inf) for way, there in ways(self.design)]
        return _plain(np.minimum.reduce(found))

    @cached_property
    def _responses(self) -> dict[OperatingPoint, Compliance]:
        at = [Operating(point=way, load_Nm=self.load_Nm) for way, _ in ways(self.design)]
        return {each.point: compliance(self.design, each) for each in at}


def ways(design: Design) -> tuple[tuple[OperatingPoint, Any], ...]:
    """Operating points at which a load meets friction, and whether each is there (stacked designs: arrays).

    Friction that grows with the coupling's torque T_s makes two of sliding: the motor moves against the load
    ("driving", T_s (1/N_c + CM')), or the load moves the motor ("driven", 1/N_c - CM'), if it can.

    >>> from actuator_lti.design import load_design
    >>> [[way for way, there in ways(load_design(name)) if there] for name in ("emps", "fin")]
    [['sliding'], ['driving', 'driven']]
    """
    if design.coupling is None or not np.any(design.friction.load_coefficient > 0.0):
        return (("sliding", True),)
    moved = reaction(design, Operating(point="driven")) > 0.0
    return (("driving", True), ("driven", moved)) if np.any(moved) else (("driving", True),)


def frequencies_hz(response: Compliance) -> npt.NDArray[np.float64]:
    """Frequencies over which a stiffness is drawn and its least value sought."""
    highest = np.minimum(HIGHEST_HZ, BELOW_NYQUIST / np.asarray(response.period_s))
    return np.moveaxis(np.geomspace(LOWEST_HZ, highest, POINTS), 0, -1)


def weakest_hz(response: Compliance) -> npt.NDArray[np.float64]:
    """Where |K| is least within `frequencies_hz`; shape (1,), of K stacked designs (K, 1).

    Between its natural frequencies K is smooth: those and the drawn ones are looked at, then about the least.
    """
    drawn = frequencies_hz(response)
    low, high, width = drawn[..., :1], drawn[..., -1:], drawn[..., 1:2] / drawn[..., :1]
    natural = np.clip(response.natural_hz, low, high)
    hertz = np.concatenate([np.broadcast_to(drawn, (*natural.shape[:-1], POINTS)), natural], axis=-1)
    for _ in range(_ROUNDS):
        least = np.abs(stiffness_at(response, hertz)).argmin(axis=-1)[..., None]
        best = np.take_along_axis(hertz, least, axis=-1)
        hertz, width = np.clip(best * width**_AROUND, low, high), width**0.25
    return best


def stiffness_at(response: Compliance, frequency_hz: npt.ArrayLike) -> npt.NDArray[np.complex128]:
    """K = 1 / G(exp(j w Ts)); inf where the output does not move."""
    period = np.asarray(response.period_s, dtype=float)[..., None]
    z = np.exp(2j * np.pi * np.atleast_1d(np.asarray(frequency_hz, dtype=float)) * period)
    G = response(z)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(G == 0.0, complex(np.inf), 1.0 / np.where(G == 0.0, 1.0, G))


def static_stiffness(response: Compliance) -> Any:
    """K at zero frequency, by its slope near there: below 0 of a drive that pushes away, 0 of a free one, inf
    with an integral; the real part, whose next term is in the square of the frequency.
    """
    hertz = [_REST_HZ, _SLOW_HZ, 10.0 * _SLOW_HZ, _READ_HZ, 2.0 * _READ_HZ]
    K = np.moveaxis(stiffness_at(response, hertz), -1, 0)
    (rest, low, high), (once, twice) = np.abs(K[:3]), K[3:].real
    gone = ~np.isfinite(low) | (high < 0.5 * low)
    free = rest < _AWAY * low
    with np.errstate(invalid="ignore"):  # inf less inf, which is gone
        return _plain(np.where(gone, np.inf, np.where(free, 0.0, (4.0 * once - twice) / 3.0)))


def lost_motion_rad(design: Design) -> Any:
    """Lost motion at the output as gear makers read it, the motor held: the twist between the middles of the
    hysteresis where the spring carries +-`LOST_MOTION_SHARE` of the largest load torque, play and twice m/k.

    The load's friction has no part in it, as on a bench for gears: it widens the hysteresis, and where it is
    larger than m the play lies within that width.
    """
    coupling = design.coupling
    if coupling is None:
        return 0.0
    m = LOST_MOTION_SHARE * design.load.moment_max_Nm / design.ratio_behind_coupling
    return (coupling.play_rad + 2.0 * coupling.stretch_rad(m)) / design.ratio_behind_coupling


def _plain(value: Any) -> Any:
    return float(value) if np.ndim(value) == 0 else value


@dataclass(frozen=True)
class Compliance:
    """From M_ext at the output shaft to the output angle, all loops closed; one design or stacked ones."""

    blocks: Sequence[Block]  # one for each tick of a period, with the same states
    period_s: Any  # of a tick

    @property
    def moves(self) -> bool:
        return bool(self.blocks[0].states)

    def __call__(self, z: npt.ArrayLike) -> npt.NDArray[np.complex128]:
        """Fundamental of the output at ``z = exp(j w Ts)``; of K stacked designs, shape (K, frequencies)."""
        points = np.atleast_1d(np.asarray(z, dtype=complex))[..., None, None]
        parts = [(block.A, block.B, block.C, block.D) for block in self.blocks]
        steps = [tuple(part[..., None, :, :] for part in each) for each in parts]
        result = mean_response(steps, points)[..., 0, 0]
        return np.asarray(result[..., 0] if np.ndim(z) == 0 else result)

    @property
    def slowest(self) -> float:
        """Magnitude, per tick, of the mode of one design that decays last or grows; see `slowest_mode`."""
        return slowest_mode([block.A for block in self.blocks])

    @property
    def natural_hz(self) -> npt.NDArray[np.float64]:
        """Frequencies of the poles, and their images by slower stages; shape (..., states * ticks)."""
        ticks = len(self.blocks)
        turns = (np.angle(self._poles)[..., None] / (2.0 * np.pi) + np.arange(ticks)) / ticks
        turns = np.abs(turns - np.rint(turns))
        return turns.reshape(*turns.shape[:-2], -1) / np.asarray(self.period_s)[..., None]

    @cached_property
    def _poles(self) -> npt.NDArray[np.complex128]:
        over = np.eye(len(self.blocks[0].states))
        for block in self.blocks:
            over = block.A @ over
        return np.asarray(np.linalg.eigvals(over), dtype=complex)


def compliance(design: Design, at: Operating | None = None) -> Compliance:
    """The compliance of a design, or of stacked designs, at an operating point (default: sliding).

    >>> import numpy as np
    >>> from actuator_lti.design import load_design
    >>> fin = compliance(load_design("fin"))
    >>> f"{1 / abs(fin(np.exp(2j * np.pi * 0.01 * fin.period_s))):.0f} N m/rad"
    '1324 N m/rad'
    """
    wired = wire(design, Operating() if at is None else at)
    program = TickProgram(wired, wired.outermost)
    ticks = [program.tick(k) for k in range(program.ticks)]
    blocks = [siso(program, [tick], "load_torque", "output_angle") for tick in ticks]
    return Compliance(pruned(blocks), wired.tick_s)
