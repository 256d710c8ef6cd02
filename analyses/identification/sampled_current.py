"""What a current sampled at the controller's ticks tells of the current between them."""

from dataclasses import dataclass

import numpy as np

from actuator_lti.design.model import Design
from actuator_lti.types import Complexes, Floats
from analyses.records.record import Record, period_of

TICK_TOLERANCE = 1e-3
LARGEST_CHANGE = 0.2


@dataclass(frozen=True, kw_only=True)
class HeldVoltage:
    """A winding whose voltage is held over a period and switched some time after a sample.

    The part of the current that the back-EMF drives is smooth and needs no correction: with
    ``i_e = -kE w/(R + L s)`` the mean current is ``F (i - i_e) + i_e``, ``F`` by `mean_over_sample`.
    """

    rate_1_s: float  # a = R/L
    period_s: float
    delay_s: float
    back_emf_A_per_rad_s: float

    def mean_over_sample(self, omega_rad_s: Floats) -> Complexes:
        """F: the line of the current over the line of its samples, for a voltage in steps.

        Of a voltage ``u_k = exp(j w k T)`` the line is ``exp(-j w d) (1 - 1/z)/(j w T)``, z = exp(j w T),
        that of the current this over ``1 + j w/a``; its samples follow ``i_(k+1) = exp(-a T) i_k +
        (1 - exp(-a d)) exp(-a (T - d)) u_(k-1) + 1 - exp(-a (T - d))``.
        """
        a, T = self.rate_1_s, self.period_s
        d = self.delay_s % T  # a delay of whole ticks moves both alike
        step = 1j * np.asarray(omega_rad_s) * T
        z = np.exp(step)
        line = np.exp(-1j * omega_rad_s * d) * -np.expm1(-step) / step / (1.0 + step / (a * T))
        before = -np.expm1(-a * d) * np.exp(-a * (T - d)) / z
        sample = (before - np.expm1(-a * (T - d))) / (z - np.exp(-a * T))
        return np.asarray(line / sample)

    @property
    def lead_s(self) -> float:
        """By how much the samples lead the current, at low frequency.

        The current lags by ``d + T/2 + L/R``, the samples by ``T + T exp(-a (T - d))/(1 - exp(-a T))``.
        """
        a, T = self.rate_1_s, self.period_s
        d = self.delay_s % T
        return d - 0.5 * T + 1.0 / a + T * np.exp(-a * (T - d)) / np.expm1(-a * T)


def held_s(design: Design) -> float:
    """What a voltage is held for: the period of the innermost stage."""
    control = design.controller
    return float(control.period_of(control.stages[-1] if control.stages else "voltage"))


def acts_later_s(design: Design, record: Record) -> float:
    """By how much a voltage acts later than its row: the computing delay, and half a step of what is seen.

    That is what it is held for, or a row where these are closer.
    """
    return design.controller.computing_delay_s + 0.5 * min(held_s(design), period_of(record))


def held_voltage(design: Design, record: Record) -> HeldVoltage | None:
    """The winding and its voltage's steps; None where samples are not taken with the ticks.

    A recorder of its own meets the steps at any phase, so that its samples are right in the mean.
    """
    motor, period = design.effective_motor, held_s(design)
    if motor.resistance_ohm is None or not motor.inductance_H or record.averaged > 1:
        return None
    ticks = record.period_s / period
    if round(ticks) < 1 or abs(ticks - round(ticks)) > TICK_TOLERANCE * ticks:
        return None
    back = motor.back_emf_constant_Vs_rad or motor.torque_constant_Nm_A or 0.0
    return HeldVoltage(
        rate_1_s=motor.resistance_ohm / motor.inductance_H,
        period_s=period,
        delay_s=design.controller.computing_delay_s,
        back_emf_A_per_rad_s=back / motor.resistance_ohm,
    )


def mean_current(design: Design, record: Record, current: Floats, acceleration: Floats) -> Floats:
    """The current between the ticks: the samples less their lead times the rate of what the voltage drives.

    That rate is ``di/dt + (kE/R) dw/dt``. A correction that is not small is left out.
    """
    held = held_voltage(design, record)
    if held is None:
        return current
    rate = np.gradient(current, record.period_s) + held.back_emf_A_per_rad_s * acceleration
    change = held.lead_s * rate
    small = np.linalg.norm(change) < LARGEST_CHANGE * np.linalg.norm(current)
    return np.asarray(current - change if small else current)
