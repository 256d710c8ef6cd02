"""The border of linear validity, found in the simulator by bisection, against the smallest A_k(w)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from actuator_lti.design.model import Command, Design
from actuator_lti.drive import signals
from actuator_lti.drive.profile import command_mean
from actuator_lti.loops import Loops, assemble_loops
from actuator_lti.loops.assemble import loops_at
from actuator_lti.loops.limiters import onset
from analyses.large_signal.classify import limiter_fractions
from analyses.large_signal.grid import frequency_range_hz, tone
from analyses.large_signal.nonlinear_parts import nonlinear_parts
from analyses.large_signal.steady_start import linear_steady_state
from analyses.large_signal.tones_run import run_tones
from analyses.linear.responses import response_at
from nonlinear import LIMITERS
from nonlinear.bench.on_the_bench import on_the_bench

FREQUENCIES, ROUNDS = 14, 9
TIGHT, WIDE = (0.94, 1.06), (0.3, 3.0)
TOLERANCE = 0.01
LONG = 0.1  # periods of the highest tone


@dataclass(frozen=True)
class BorderCheck:
    """Amplitude at which a limit first acts, linear and simulated, at each frequency.

    Attributes
    ----------
    friction_on : bool
    frequency_hz : ndarray, shape (f,)
    predicted_rad, simulated_rad : ndarray, shape (f,)
        Smallest A_k(w); what the simulation shows. NaN where no limit acts within the range tried, or
        where nothing limits.
    predicted_limiter, simulated_limiter : tuple of str
        Empty where there is none.
    resolution : float
        Relative width of the last interval of the bisection.
    reason : str
        Why it is not judged, if so.
    left_out : str
        What the drive was judged without, as it has no single slope; in the loops and in the simulation.
    each_rad : mapping of str to ndarray, shape (f,)
        A_k(w) of every limiter.
    command_gain : ndarray, shape (f,), or float
        Of mean and filter of the command, which the amplitudes are behind.
    """

    friction_on: bool
    frequency_hz: np.ndarray
    predicted_rad: np.ndarray
    simulated_rad: np.ndarray
    predicted_limiter: tuple[str, ...]
    simulated_limiter: tuple[str, ...]
    resolution: float
    reason: str = ""
    left_out: str = ""
    each_rad: Mapping[str, np.ndarray] = field(default_factory=dict)
    command_gain: np.ndarray | float = 1.0

    @property
    def ratio(self) -> np.ndarray:
        """Simulated over predicted."""
        return np.asarray(self.simulated_rad / self.predicted_rad)

    @property
    def largest_error(self) -> float | None:
        """Largest relative difference; ``None`` where nothing limits."""
        known = np.abs(self.ratio - 1.0)[np.isfinite(self.ratio)]
        return float(known.max()) if known.size else None

    @property
    def same_limiter(self) -> tuple[bool, ...]:
        """Whether the limiter that acts is the first foreseen, or foreseen within `TOLERANCE` of there."""
        result = []
        for k, (name, acting) in enumerate(zip(self.predicted_limiter, self.simulated_limiter, strict=True)):
            foreseen = self.each_rad.get(acting)
            near = foreseen is not None and abs(foreseen[k] / self.simulated_rad[k] - 1.0) <= TOLERANCE
            result.append(name == acting or bool(near))
        return tuple(result)

    @property
    def passed(self) -> bool | None:
        """Within `TOLERANCE` with the same limiter at every frequency; ``None`` where not judged."""
        if self.reason:
            return None
        if (np.isfinite(self.predicted_rad) & ~np.isfinite(self.simulated_rad)).any():
            return False  # predicted, but not found even in the wide range
        error = self.largest_error
        return error is None or (error <= TOLERANCE and all(self.same_limiter))


def check_border(
    design: Design, loops: Loops, *, friction_on: bool = False, count: int = FREQUENCIES
) -> BorderCheck | None:
    """Bisect the amplitude at which a limit first acts in steady state, at each of several frequencies.

    Every run begins in the linear steady state just below the border and is judged by its last window, so
    that no start-up counts. Where it then acts early the tone swells up from rest instead: what a start
    lacks, the states of filters, may reach the limit, and a drive that is limited may stay so. ``None`` where
    the loop is unstable: it has no border.

    The command is taken as it comes behind its profile and filter: what these do is no property of the loops.

    Parameters
    ----------
    friction_on : bool
        Without dry friction the border is that of the linear loop; with it, the shift is what is asked for.
        Encoder counts are left out together with the friction, and so is the drop of a soft supply, which
        lowers the voltage limit by what the drive draws: neither is a part of the linear loop. So is an
        overload protection (I2t) that is slow against the tones (`slow_protection`).
    """
    left_out, given, design = "", loops, replace(design, command=Command())
    if friction_on and loops.design.command != design.command:
        loops = loops_at(replace(loops.design, command=design.command), loops.operating)
    if not friction_on:
        design = replace(on_the_bench(design), supply=None)
        slow = [signals.LIMITERS[name].words for name in slow_protection(design, loops)]
        left_out = ", ".join([*_bent(design), *slow])
        if left_out:
            design = _straight(design)
        if left_out or loops.design.command != design.command:
            model = on_the_bench(loops.design)  # need not be the drive that is simulated
            loops = assemble_loops(_straight(model)) if left_out else loops_at(model, loops.operating)
    low, high = frequency_range_hz(design, loops)
    chosen = tuple(tone(float(f), design) for f in np.geomspace(low, high, count))
    omega = np.array([t.omega_rad_s for t in chosen])
    border, start = onset(loops, omega), linear_steady_state(loops, omega)
    if not start.stable:
        return None
    tries, limited = WIDE if friction_on else TIGHT, np.flatnonzero(np.isfinite(border.amplitude_rad))
    simulated, names = np.full(len(omega), np.nan), np.full(len(omega), "", dtype=object)

    def search(which: np.ndarray, tries: tuple[float, float], *, swelling: bool = False) -> None:
        foreseen = border.amplitude_rad[which]

        def acting(amplitude: np.ndarray) -> np.ndarray:
            begin = 0.0 * amplitude if swelling else np.minimum(amplitude, 0.99 * foreseen)
            result = run_tones(
                design, chosen, which, amplitude, start, begin,
                friction_on=friction_on, harmonics=1, swelling=swelling,
            )  # fmt: skip
            return limiter_fractions(result)

        wanted = [border.active[k] for k in which]
        simulated[which], names[which] = _bisect(acting, foreseen, tries, wanted)

    if len(limited):
        search(limited, tries)
    if not friction_on:
        early = limited[~(simulated[limited] > (1.0 - TOLERANCE) * border.amplitude_rad[limited])]
        if len(early):  # what a run begins without (states of filters) may reach the limit, and stay there
            search(early, tries, swelling=True)
        lost = limited[np.isnan(simulated[limited])]
        if len(lost):  # it is not about where it was foreseen: look for it
            search(lost, WIDE, swelling=True)
    return BorderCheck(
        friction_on,
        omega / (2.0 * np.pi),
        np.where(np.isfinite(border.amplitude_rad), border.amplitude_rad, np.nan),
        simulated,
        border.active,
        tuple(names),
        (tries[1] / tries[0]) ** (0.5**ROUNDS) - 1.0,
        _not_linear(design, friction_on),
        left_out,
        border.each_rad,
        _command_gain(given, loops, omega),
    )


def _command_gain(given: Loops, behind: Loops, omega_rad_s: np.ndarray) -> np.ndarray | float:
    """What mean and filter of the command make of a sine, from how far in front of each a limit lies."""
    if given.design.command == behind.design.command:
        return 1.0
    mean = command_mean(given.design)
    gain = 1.0 if mean is None else np.abs(mean.response(omega_rad_s))
    whole, rest = (np.abs(response_at(one.plain_response, omega_rad_s)) for one in (given, behind))
    return np.asarray(gain * whole / rest)


def _not_linear(design: Design, friction_on: bool) -> str:
    """Say why the border need not be that of the linear loop; empty where it must be."""
    if friction_on:
        return "dry friction shifts the border"
    parts = _bent(design)
    if not parts:
        return ""
    return f"{', '.join(parts)}: no single linear loop describes the drive"


def _bent(design: Design) -> list[str]:
    """What is not linear beside the limits, and not left out together with dry friction."""
    left_out = ("dry friction", "offset torque", "friction of the load")
    return [word for word in nonlinear_parts(design) if word not in left_out]


def slow_protection(design: Design, loops: Loops) -> list[str]:
    """Limiters that average for longer than a tone is simulated: at their border they act much later."""
    limits = design.limits
    if limits.peak_time_s is None or limits.overload_time_s is None:
        return []
    _, high = frequency_range_hz(design, loops)
    return ["overload"] if limits.overload_time_s * high > LONG else []


def _straight(design: Design) -> Design:
    """The drive without play, bent loads and friction without a single slope: what is left are its limits."""
    friction, place, coupling = design.friction, design.controller.position_loop, design.coupling
    friction = replace(friction, points=(), viscous_reverse_Nms_rad=None, load_coefficient=0.0)
    return replace(
        design,
        friction=friction,
        load=design.load.straight(),
        coupling=None if coupling is None else replace(coupling, play_rad=0.0),
        controller=replace(design.controller, position=replace(place, friction_feedforward=0.0)),
        limits=replace(design.limits, peak_time_s=None),
    )


def _bisect(
    acting: Callable[[np.ndarray], np.ndarray],
    foreseen: np.ndarray,
    tries: tuple[float, float],
    wanted: Sequence[str],
) -> tuple[np.ndarray, np.ndarray]:
    """Close in on the border from both sides, all frequencies at once, on a logarithmic scale.

    The limiter that acts is the one foreseen, where it does: behind the border a drive may swing against
    another one for longer.
    """
    low, high = np.log(tries[0] * foreseen), np.log(tries[1] * foreseen)
    at_low, at_high = acting(np.exp(low)), acting(np.exp(high))
    valid = (at_low.max(axis=1) == 0.0) & (at_high.max(axis=1) > 0.0)
    last = at_high
    for _ in range(ROUNDS):
        middle = 0.5 * (low + high)
        seen = acting(np.exp(middle))
        hit = seen.max(axis=1) > 0.0
        low, high = np.where(hit, low, middle), np.where(hit, middle, high)
        last = np.where(hit[:, None], seen, last)
    names = [
        "" if not ok else one if one and row[LIMITERS.index(one)] > 0.0 else LIMITERS[int(np.argmax(row))]
        for row, ok, one in zip(last, valid, wanted, strict=True)
    ]
    return np.where(valid, np.exp(0.5 * (low + high)), np.nan), np.array(names, dtype=object)
