"""What the linear model says about its own limits (model.md section 5).

In front of each limiter k stands a signal with the closed-loop response T_k from the command at the output
shaft. A sinusoidal command of amplitude A reaches the limiter at A_k(w) = limit_k/|T_k(jw)|.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from actuator_lti.errors import InputError
from actuator_lti.loops.cascade import Cascade

if TYPE_CHECKING:
    from actuator_lti.loops.result import Loops


@dataclass(frozen=True)
class LimiterPath:
    """From the command at the output shaft to the quantity in front of a limiter, all loops closed.

    Attributes
    ----------
    name : str
        ``"speed"``: speed command before the clamp (rad/s, motor side). ``"acceleration"``: its change per
        update over the period of the position loop (rad/s^2).
        ``"current"``: current command before the clamp (A).
        ``"voltage"``: voltage before the clamp (V).
    limit : float
        The limit, same unit; ``inf`` where there is none.
    unit : str
    nyquist_rad_s : float
        pi over the period of the position loop for the sampled form, else ``inf``.
    """

    name: str
    limit: float
    unit: str
    nyquist_rad_s: float
    _evaluate: Callable[[np.ndarray], np.ndarray]

    def responses(self, omega_rad_s: Any) -> np.ndarray:
        """T_k(jw), shape (M, len(omega)): a row for each update within a position period."""
        omega = np.atleast_1d(np.asarray(omega_rad_s, dtype=float))
        if np.any(omega <= 0) or np.any(omega > self.nyquist_rad_s * (1 + 1e-12)):
            raise InputError(f"omega_rad_s: positive and at most {self.nyquist_rad_s:g} rad/s (Nyquist)")
        return self._evaluate(omega)

    def response(self, omega_rad_s: Any) -> np.ndarray:
        """T_k(jw) at the first update; the largest magnitude over the updates where there are several."""
        rows = self.responses(omega_rad_s)
        return rows[0] if len(rows) == 1 else np.max(np.abs(rows), axis=0).astype(complex)

    def onset_amplitude_rad(self, omega_rad_s: Any, bias: float = 0.0) -> np.ndarray:
        """Command amplitude A_k(w) at the output shaft (peak, rad) at which the limit is reached.

        Parameters
        ----------
        omega_rad_s : array_like, shape (K,)
        bias : float
            Constant value of the quantity on top of which the sinusoid acts (in `unit`), e.g. the motor speed
            of a superposed ramp; what it uses up of the limit is no longer there.
        """
        room = max(self.limit - abs(bias), 0.0)
        magnitude = np.abs(self.response(omega_rad_s))
        with np.errstate(divide="ignore"):
            return room / magnitude


@dataclass(frozen=True)
class Onset:
    """The border of linear validity: smallest A_k over the limiters, and which one it is.

    Attributes
    ----------
    omega_rad_s : ndarray, shape (K,)
    amplitude_rad : ndarray, shape (K,)
        Peak command amplitude at the output shaft; ``inf`` where nothing limits.
    active : tuple of str
        Name of the limiter reached first at each frequency; ``""`` where nothing limits.
    each_rad : mapping of str to ndarray
        A_k of every limiter.
    """

    omega_rad_s: np.ndarray
    amplitude_rad: np.ndarray
    active: tuple[str, ...]
    each_rad: Mapping[str, np.ndarray]


def onset(loops: Loops, omega_rad_s: Any, bias: Mapping[str, float] | None = None) -> Onset:
    """Border of linear validity of a drive over frequency (see `LimiterPath.onset_amplitude_rad`)."""
    omega = np.atleast_1d(np.asarray(omega_rad_s, dtype=float))
    used = bias or {}
    each = {
        name: path.onset_amplitude_rad(omega, used.get(name, 0.0)) for name, path in loops.limiters.items()
    }
    if not each:
        return Onset(omega, np.full(omega.shape, np.inf), ("",) * len(omega), {})
    names, table = list(each), np.array(list(each.values()))
    first = np.argmin(table, axis=0)
    lowest = table[first, np.arange(len(omega))]
    active = tuple(names[k] if np.isfinite(a) else "" for k, a in zip(first, lowest, strict=True))
    return Onset(omega, lowest, active, each)


def limiter_signals(wired: Cascade) -> dict[str, tuple[str, float, str]]:
    """Signal, limit and unit of each limiter that the wiring has."""
    limits = wired.design.limits
    names = {"w_ref": "speed", "i_ref": "current", "u": "voltage"}
    value = {"w_ref": limits.speed_rad_s, "i_ref": limits.peak_current_A, "u": limits.voltage_V}
    table = {names[point]: (point, value[point], wired.unit(point)) for point in wired.target.values()}
    if "speed" in table:
        unit = "rad/s^2" if wired.design.axis == "rotary" else "m/s^2"
        table["acceleration"] = ("w_ref", limits.acceleration_rad_s2, unit)
    order = ("speed", "acceleration", "current", "voltage")
    return {name: table[name] for name in order if name in table}


def limiter_paths(
    wired: Cascade, evaluate: Callable[[str, str], Callable[[np.ndarray], np.ndarray]], nyquist_rad_s: float
) -> dict[str, LimiterPath]:
    """All limiter paths; ``evaluate(signal, kind)`` gives the function of frequency, kind value or rate."""
    return {
        name: LimiterPath(
            name, limit, unit, nyquist_rad_s, evaluate(s, "rate" if name == "acceleration" else "value")
        )
        for name, (s, limit, unit) in limiter_signals(wired).items()
    }
