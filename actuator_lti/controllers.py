"""P and PI controllers in the drive's own form, in z and in s (model.md sections 2 and 3)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class PI:
    """``v = Kp e + I`` with ``I' = I + (Kp T/Tn) e`` before the output: the integral holds the present error.

    Attributes
    ----------
    gain : float
        Kp.
    integral_time_s : float or None
        Tn; ``None`` for a P controller.
    period_s : float
        T, the controller's own period.
    """

    gain: float
    integral_time_s: float | None
    period_s: float

    @property
    def integral_step(self) -> float:
        """Kp T/Tn, what one period adds to the integral per unit error; 0 for P."""
        return 0.0 if self.integral_time_s is None else self.gain * self.period_s / self.integral_time_s

    @property
    def integral_rate_s(self) -> float:
        """Kp/Tn in 1/s, the same in continuous time; 0 for P."""
        return 0.0 if self.integral_time_s is None else self.gain / self.integral_time_s

    def sampled(self, omega_rad_s: np.ndarray) -> np.ndarray:
        """Frequency response Kp + (Kp T/Tn) z/(z - 1), z = exp(j w T)."""
        if self.integral_time_s is None:
            return np.full(np.shape(omega_rad_s), self.gain, dtype=complex)
        # expm1 keeps the digits of z - 1 at low frequency
        return self.gain - self.integral_step / np.expm1(-1j * np.asarray(omega_rad_s) * self.period_s)

    def continuous(self, omega_rad_s: np.ndarray) -> np.ndarray:
        """Frequency response Kp (1 + 1/(j w Tn))."""
        return self.gain + self.integral_rate_s / (1j * np.asarray(omega_rad_s))
