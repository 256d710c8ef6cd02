"""What the linear model says about its own limits (model.md section 5).

In front of each limiter k stands a signal with the closed-loop response T_k from the command at the output
shaft: an angle or, of a speed drive, a speed there; of a torque or voltage drive its current or voltage. A
sinusoidal command of amplitude A reaches the limiter at A_k(w) = limit_k/|T_k(jw)|.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from actuator_lti.design.model import Design
from actuator_lti.drive.profile import command_mean, profile_onset_rad, sampled_rate_rad_s
from actuator_lti.drive.signals import CLAMP_OF, LIMITERS, Limiter
from actuator_lti.drive.wiring import Drive
from actuator_lti.errors import InputError, finite_number, shown
from actuator_lti.loops.result import Loops
from actuator_lti.types import Compared, number_array

Response = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class LimiterPath:
    """From the command at the output shaft to the quantity in front of a limiter, all loops closed."""

    # Of `actuator_lti.drive.signals.LIMITERS`. ``"speed"``: speed command before the clamp (rad/s, motor
    # side). ``"acceleration"``: its change per update over the period of the position loop (rad/s^2).
    # ``"current"``: current command before the clamp (A). ``"voltage"``: voltage before the clamp (V).
    # ``"torque-command"``: what the velocity controller gives to the torque filters. ``"overload"``: the
    # motor current, whose square the protection averages.
    name: str
    limit: float  # the limit, same unit; ``inf`` where there is none
    unit: str
    nyquist_rad_s: float  # pi over the period of the outermost loop for the sampled form, else ``inf``
    _evaluate: Response
    # Time constant of the mean square that the limiter looks at; ``None`` for the value itself
    averaged_s: float | None = None

    def responses(self, omega_rad_s: Any) -> np.ndarray:
        """T_k(jw), shape (M, len(omega)): a row for each update within a position period.

        Where the limit clamps an integral as well (anti-windup ``"clamped"``), its rows follow.
        """
        omega = np.atleast_1d(np.asarray(omega_rad_s, dtype=float))
        if np.any(omega <= 0) or np.any(omega > self.nyquist_rad_s * (1 + 1e-12)):
            raise InputError(f"omega_rad_s: positive and at most {self.nyquist_rad_s:g} rad/s (Nyquist)")
        return self._evaluate(omega)

    def response(self, omega_rad_s: Any) -> np.ndarray:
        """T_k(jw) at the first update; the largest magnitude over the updates where there are several."""
        rows = self.responses(omega_rad_s)
        return rows[0] if len(rows) == 1 else np.max(np.abs(rows), axis=0).astype(complex)

    def onset_amplitude_rad(self, omega_rad_s: Any, bias: float = 0.0) -> np.ndarray:
        """Command amplitude A_k(w) (peak; rad, rad/s, A or V, see the module) at which the limit is reached.

        Shape (K,), as ``omega_rad_s``. ``bias``: constant part of the quantity (in `unit`), e.g. the motor
        speed of a superposed ramp; what it uses up of the limit is no longer there.

        A mean square (time constant tau) of a sinusoid of amplitude I tends to I^2/2 with a ripple of the
        double frequency, so that its highest value is (I^2/2) (1 + 1/sqrt(1 + (2 w tau)^2)); a constant adds
        its square and, by the product of both, a ripple of the single frequency, bounded by its amplitude.
        """
        magnitude, bias = np.abs(self.response(omega_rad_s)), abs(finite_number("bias", bias))
        headroom: Any = max(self.limit - bias, 0.0)
        if self.averaged_s is not None:  # bias^2 + 2 bias I r1 + (I^2/2) (1 + r2) = limit^2
            omega = np.atleast_1d(np.asarray(omega_rad_s, dtype=float))
            r1, r2 = (1 / np.hypot(1.0, k * omega * self.averaged_s) for k in (1, 2))
            a, b, c = (1 + r2) / 2, 2 * bias * r1, bias**2 - self.limit**2
            headroom = np.where(c < 0, (-b + np.sqrt(np.maximum(b * b - 4 * a * c, 0.0))) / (2 * a), 0.0)
        with np.errstate(divide="ignore"):
            return np.asarray(headroom / magnitude)


@dataclass(frozen=True, eq=False)
class Onset(Compared):
    """The limit of linear validity: smallest A_k over the limiters, and which one it is."""

    omega_rad_s: np.ndarray  # shape (K,)
    # Peak command amplitude, shape (K,); rad, of other drives rad/s, A or V (see the module). ``inf`` where
    # nothing limits
    amplitude_rad: np.ndarray
    # Name of the limiter reached first at each frequency; ``""`` where nothing limits
    active: tuple[str, ...]
    each_rad: Mapping[str, np.ndarray]  # A_k of every limiter


def _frequencies(omega_rad_s: Any) -> np.ndarray:
    try:
        omega = np.atleast_1d(number_array(omega_rad_s))
    except (TypeError, ValueError):
        omega = np.array([np.nan])
    if omega.ndim > 1 or not np.isfinite(omega).all():
        raise InputError(f"omega_rad_s = {shown(omega_rad_s)}: allowed: a row of finite numbers, in rad/s")
    return omega


def onset(loops: Loops, omega_rad_s: Any, bias: Mapping[str, float] | None = None) -> Onset:
    """Border of linear validity of a drive over frequency (see `LimiterPath.onset_amplitude_rad`).

    Of the command as the user gives it: its rate and acceleration limit (``"profile"``) and the mean of a
    limited jerk come before all other limiters, and so does what limits the command of a drive without a
    position loop.
    """
    used, known = {} if bias is None else bias, ", ".join(loops.limiters) or "none"
    if not used.keys() <= loops.limiters.keys():
        raise InputError(f"bias = {shown(bias)}: allowed: numbers by the name of a limiter ({known})")
    used = {name: finite_number(f"bias[{name!r}]", value) for name, value in used.items()}
    omega = _frequencies(omega_rad_s)
    mean = command_mean(loops.design)
    before = np.ones(omega.shape) if mean is None else np.abs(mean.response(omega))
    with np.errstate(divide="ignore"):
        each = {
            name: path.onset_amplitude_rad(omega, used.get(name, 0.0)) / before
            for name, path in loops.limiters.items()
        }
    each |= _of_the_command(loops, omega)
    if not each:
        return Onset(omega, np.full(omega.shape, np.inf), ("",) * len(omega), {})
    names, table = list(each), np.array(list(each.values()))
    first = np.argmin(table, axis=0)
    lowest = table[first, np.arange(len(omega))]
    active = tuple(names[k] if np.isfinite(a) else "" for k, a in zip(first, lowest, strict=True))
    return Onset(omega, lowest, active, each)


def _of_the_command(loops: Loops, omega: np.ndarray) -> dict[str, np.ndarray]:
    """A_k of the limits of the command itself, as its profile's: no loop stands in front of them."""
    design, limits = loops.design, loops.design.limits
    stage, period = design.controller.outermost, design.controller.period_of(design.controller.outermost)
    change = sampled_rate_rad_s(omega, period) if loops.form == "sampled" else omega
    each = {"profile": profile_onset_rad(design, omega)}
    if stage == "velocity":
        each["speed"] = np.full(omega.shape, limits.speed_rad_s / design.total_ratio)
        each["acceleration"] = limits.acceleration_rad_s2 / design.total_ratio / change
    elif stage == "current":
        each["current"] = np.full(omega.shape, limits.peak_current_A)
        each["current-rate"] = limits.current_rate_A_s / change
    return {name: values for name, values in each.items() if np.isfinite(values).any()}


@dataclass(frozen=True)
class Place:
    """Where a limiter acts: the signals it clamps, the ticks between its updates, the limit."""

    limiter: Limiter
    signals: tuple[str, ...]
    every: int
    limit: float
    unit: str


def limiter_places(wired: Drive) -> list[Place]:
    """Every limiter that the wiring has, in the order of the registry."""
    return [place for limiter in LIMITERS.values() if (place := _place(wired, limiter)) is not None]


def _place(wired: Drive, limiter: Limiter) -> Place | None:
    """Where a limiter acts; None in a drive that has no such signal or limit."""
    limits, signal, acting = wired.design.limits, limiter.signal, limiter
    stages = {target: stage for stage, target in (wired.target or {"voltage": "u"}).items()}
    if signal == "torque_command" and wired.filters("torque"):
        stages[signal], acting = "velocity", CLAMP_OF[wired.target["velocity"]]
    elif limiter.kind == "rms" and limits.peak_time_s is not None and "current" in wired.stages:
        stages[signal] = "current"
    if signal not in stages or limiter.kind == "command":
        return None
    limit = acting.limit_of(limits)
    if not (limiter.always or np.any(np.isfinite(limit))):
        return None
    stage = stages[signal]
    every = 1 if limiter.kind == "rms" else wired.interval.get(stage, 1)
    filtered = stage == "velocity" and bool(wired.filters("torque"))
    first = "torque_command" if filtered else (wired.target or {}).get(stage)
    clamped = limiter.kind == "value" and signal == first and _integral_clamped(wired.design, stage)
    signals = (signal, f"{stage}_integral") if clamped else (signal,)
    return Place(limiter, signals, every, limit, acting.unit(wired.design.axis))


def _integral_clamped(design: Design, stage: str) -> bool:
    """Whether the limit of a stage clamps its integral as well: it may be reached before the output is.

    A controller's output is the larger of both, as the integral lags its error by less than 90 degrees in
    samples, unless a feed-forward adds to it.
    """
    law = {"velocity": design.controller.velocity, "current": design.controller.current}.get(stage)
    return law is not None and law.integral_time_s is not None and law.anti_windup == "clamped"


def limiter_paths(
    wired: Drive, evaluate: Callable[[tuple[str, ...], int, bool], Response], nyquist_rad_s: float
) -> dict[str, LimiterPath]:
    """All limiter paths; ``evaluate(signals, every, rate)`` gives the function of frequency."""
    time = wired.design.limits.overload_time_s
    # the reference of a speed drive is the motor's, its command the output's
    geared = wired.design.total_ratio if wired.outermost == "velocity" else 1.0

    def from_output(place: Place) -> Response:
        response = evaluate(place.signals, place.every, place.limiter.kind == "rate")
        return lambda omega: geared * response(omega)

    def path(place: Place) -> LimiterPath:
        averaged_s, name = time if place.limiter.kind == "rms" else None, place.limiter.name
        return LimiterPath(name, place.limit, place.unit, nyquist_rad_s, from_output(place), averaged_s)

    return {place.limiter.name: path(place) for place in limiter_places(wired)}
