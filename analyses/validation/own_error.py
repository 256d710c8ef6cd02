"""What a measurement is off by itself: transients that have not ended, and rounding of a growing angle."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from nonlinear.loop_setup import LoopSetup, producer

Floats = npt.NDArray[np.float64]
ROUNDING = 1e-11  # relative, of a fundamental that is a small part of the signal it is taken from
FEW_BITS = 8.0  # a motion beyond so many last bits of the angle spreads its rounding


def carried_on(change: Floats, window: npt.ArrayLike, slowest: float) -> Floats:
    """What a transient that changes by d from one window W to the next still holds.

    ``d/(1 - exp(-W/tau))`` with its time constant tau.
    """
    return change / -np.expm1(-np.asarray(window) / slowest)


def speed_bit(setup: LoopSetup, ticks: npt.ArrayLike) -> Floats:
    """The last bit of the speed after so many ticks on the bias motion, as it is seen at the point.

    That of the speed w itself, ``ulp(w)``.  A speed made from angles divides also the last bit of the angle
    by the time between them: ``ulp(w t)/t_d`` (a difference) or ``2 b ulp(w t)`` (a tracking estimator of
    bandwidth b).  The controllers in front of the point multiply it.  0 where none of them sees the speed.

    Returns
    -------
    ndarray, shape of ``ticks``
        In the unit of the point.
    """
    control, encoder = setup.design.controller, setup.design.encoder
    velocity, ticks = control.velocity, np.asarray(ticks, dtype=float)
    if velocity is None or setup.outer == "current":
        return np.zeros(ticks.shape)
    speed = abs(setup.bias.speed_rad_s)
    if encoder.speed == "difference":
        per_angle = 1.0 / (encoder.difference_samples * velocity.every * control.period_s)
    else:
        per_angle = 0.0 if encoder.speed == "ideal" else 2.0 * (encoder.bandwidth_rad_s or 0.0)
    angle = speed * ticks * control.period_s
    stage = producer(setup.design, setup.point)
    gain = 1.0 if stage == "position" else velocity.gain
    if stage == "current" and control.current is not None:
        gain *= control.current.gain_V_A
    bits = np.spacing(np.maximum(angle, 1e-300)) * per_angle + np.spacing(max(speed, 1e-300))
    return np.asarray(bits * gain)


def angle_rounding(setup: LoopSetup, window: npt.NDArray[np.int64], ticks: Floats, seen: Floats) -> Floats:
    """What rounding of the growing angle leaves in a fundamental in front of the instrument.

    Over the samples of a window it is noise, of which the fundamental keeps ``sqrt(2/N)``.  A motion of few
    such bits does not spread its rounding: it may be lost whole, alike in every window.

    Parameters
    ----------
    window, ticks : ndarray, shape (K,)
        Length of a window and of the whole run.
    seen : ndarray, shape (K,)
        The fundamental, in the unit of the point.
    """
    bit = speed_bit(setup, ticks)
    return np.where(seen > FEW_BITS * bit, bit * np.sqrt(2.0 * setup.hold_ticks / window), bit)
