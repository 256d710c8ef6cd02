"""Frequency response from one step: for a loop that is slow against its tick.

A stepped sine waits at each frequency until the slowest mode has died out.  Where that takes too many ticks
the loop is measured by one long step at the break point instead: the response of T to it, sampled at the
updates of the point, is differenced to the impulse response, and its Fourier sum is T at any frequency,

    T(f) = sum_k (y_k - y_(k-1)) exp(-j 2 pi f k T),    S = 1 - T,    L = T/S.

The drive that runs is the same.  Half the step gives the same response again: what differs is rounding, and
whatever is not linear.  What the end of the run still moves bounds what is cut off.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from analyses.validation.coherent import coherent
from analyses.validation.own_error import speed_bit
from analyses.validation.response import Sweep
from analyses.validation.step import StepMeasured, first_size, step_response, without_step
from analyses.validation.sweep import LONGEST_SETTLE_TICKS
from nonlinear.loop_setup import LoopSetup

Floats = npt.NDArray[np.float64]
Complexes = npt.NDArray[np.complex128]
TIME_CONSTANTS = 20.0  # of the slowest mode that the run holds: 2e-9 of it is left
LEAST_CONSTANTS = 14.0  # of a run that would be too long else; its own error says what that leaves
LONGEST_ROWS, LONGEST_TICKS = 4_000_000, 8_000_000
SINE_TICKS = 8_000_000  # a sweep of so many is not too slow
BLOCK = 2048  # samples in one sum
FINE = 1e-7
BESIDE = 2  # points on either side whose error counts as well


@dataclass(frozen=True)
class Transient:
    """A loop's response to a step, long enough to be its frequency response too.

    Attributes
    ----------
    setup : LoopSetup
    step, half : StepMeasured
        Of the whole and of half the step, both per unit.
    """

    setup: LoopSetup
    step: StepMeasured
    half: StepMeasured

    @property
    def settled(self) -> bool:
        """Whether it shows the linear loop to its end."""
        return not self.step.reason and not self.half.reason

    def sweep(self, frequency_hz: Floats) -> Sweep:
        """T, S and L at frequencies below half the sampling frequency of the point."""
        T, again = (
            fourier_sum(one.response, frequency_hz, self.setup.period_s) for one in (self.step, self.half)
        )
        nothing = np.zeros(frequency_hz.size)
        return Sweep(
            design_name=self.setup.design.name,
            loop=self.setup.loop,
            point=self.setup.point,
            period_s=self.setup.period_s,
            frequency_hz=frequency_hz,
            open_loop=T / (1.0 - T),
            closed_loop=T,
            sensitivity=1.0 - T,
            plant=np.full(T.size, np.nan, complex),
            amplitude=nothing + self.step.size,
            distortion=nothing,
            unsteadiness=np.abs(T - again) / np.maximum(np.abs(T), 1e-300),
            ticks=nothing + self.step.response.size * self.setup.hold_ticks,
            reason=("",) * T.size,
            speed_rad_s=self.setup.bias.speed_rad_s,
        )

    def errors(self, sweep: Sweep) -> dict[str, Floats]:
        """Relative error of each point of T, S and L: what both steps differ by, and the end cut off."""
        from scipy.ndimage import maximum_filter1d

        T, S = np.abs(sweep.closed_loop), np.abs(sweep.sensitivity)
        both = maximum_filter1d(sweep.unsteadiness * T, 2 * BESIDE + 1)
        own = both + self.step.to_come * abs(self.step.final_value)
        return {"open_loop": own / (T * S), "closed_loop": own / T, "sensitivity": own / S}


def fourier_sum(response: Floats, frequency_hz: Floats, period_s: float) -> Complexes:
    """Frequency response from a step response at its samples, the end of which has settled."""
    impulse = np.diff(response, prepend=0.0)
    rows = np.append(impulse, np.zeros(-impulse.size % BLOCK)).reshape(-1, BLOCK)
    turn = 2.0 * np.pi * frequency_hz * period_s
    inside = np.exp(-1j * np.outer(np.arange(BLOCK), turn))
    blocks = np.exp(-1j * np.outer(np.arange(rows.shape[0]), turn * BLOCK))
    return np.asarray(((rows @ inside.real + 1j * (rows @ inside.imag)) * blocks).sum(axis=0))


def long_enough(slowest_ticks: float, hold_ticks: int) -> int | None:
    """Ticks of a step that ends settled; ``None`` where they are too many."""
    longest = min(LONGEST_ROWS * hold_ticks, LONGEST_TICKS)
    least, ticks = (int(n * slowest_ticks) + 40 * hold_ticks for n in (LEAST_CONSTANTS, TIME_CONSTANTS))
    return min(ticks, longest) if least <= longest else None


def coarse(setup: LoopSetup, slowest_ticks: float) -> bool:
    """Whether rounding of a speed made of a long way is more than `FINE` of the step that is measured."""
    ticks = long_enough(slowest_ticks, setup.hold_ticks)
    if ticks is None:
        return False
    return float(speed_bit(setup, ticks)) > FINE * first_size(setup)


def transient_of(setup: LoopSetup, slowest_ticks: float) -> Transient | None:
    """Run both steps, ``slowest_ticks`` being the slowest time constant; ``None``: they would be too long."""
    ticks = long_enough(slowest_ticks, setup.hold_ticks)
    if ticks is None:
        return None
    steady = without_step(setup, ticks)
    step = step_response(setup, ticks, slowest_ticks, steady=steady)
    again = step_response(setup, ticks, slowest_ticks, 0.5 * step.size, steady) if not step.reason else step
    return Transient(setup, step, replace(again, time_s=step.time_s))


def is_slow(frequency_hz: Floats, tick_s: float, base_ticks: int, settling_ticks: int) -> bool:
    """Whether sines of all these frequencies, each waited for, take too many ticks; or one of them."""
    window = coherent(frequency_hz, tick_s, base_ticks)
    whole = float((settling_ticks + 2 * window.ticks).sum())
    return settling_ticks > LONGEST_SETTLE_TICKS or whole > SINE_TICKS
