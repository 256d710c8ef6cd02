"""Sections of second order (b0, b1, b2, a1, a2) of the filters that a design names."""

from math import inf, pi
from typing import Any

import numpy as np

from actuator_lti.design.model import Filter
from actuator_lti.errors import InputError

Section = tuple[Any, Any, Any, Any, Any]  # floats, or arrays stacked over designs
Polynomial = tuple[Any, Any, Any]


def tustin(b: Polynomial, a: Polynomial, w0: Any, period_s: Any) -> Section:
    """``(b2 s^2 + b1 s + b0)/(a2 s^2 + a1 s + a0)``, falling powers, by Tustin's rule, exact at w0."""
    c = w0 / np.tan(0.5 * w0 * period_s)

    def sampled(q: Polynomial) -> Polynomial:
        square, slope, constant = q[0] * c * c, q[1] * c, q[2]
        return square + slope + constant, 2.0 * (constant - square), square - slope + constant

    (b0, b1, b2), (a0, a1, a2) = sampled(b), sampled(a)
    if a[0] == 0.0 and b[0] == 0.0:  # of first order: the common factor z + 1 is left out
        b0, b1, b2 = b[1] * c + b[2], b[2] - b[1] * c, 0.0
        a0, a1, a2 = a[1] * c + a[2], a[2] - a[1] * c, 0.0
    return b0 / a0, b1 / a0, b2 / a0, a1 / a0, a2 / a0


def section(item: Filter, period_s: Any, where: str = "") -> Section:
    """The section of one filter of the velocity loop at its period.

    Raises `InputError`: for a missing value, a frequency at or above pi/T, or a biquad that does not fit or
    is unstable.

    >>> from actuator_lti.design.model import Filter
    >>> notch = Filter(kind="notch", frequency_rad_s=640.0, width_rad_s=320.0, depth=0.1)
    >>> [round(float(x), 12) for x in section(notch, 2e-4)]  # a notch at 640 rad/s
    [0.972166810747, -1.922292822063, 0.96598165758, -1.922292822063, 0.938148468327]
    """
    if item.kind == "biquad":
        return _biquad(item, where)
    if item.kind == "leadlag":
        zero, pole = _given(item, "zero", where), _given(item, "pole", where)
        w0 = _below_nyquist(np.sqrt(zero * pole), period_s, item.kind, where)
        return tustin((0.0, 1.0 / zero, 1.0), (0.0, 1.0 / pole, 1.0), w0, period_s)
    if item.kind == "skewed-notch":
        zero, pole, width = (_given(item, name, where) for name in ("zero", "pole", "width"))
        w0 = _below_nyquist(np.sqrt(zero * pole), period_s, item.kind, where)
        top = (1.0 / (zero * zero), item.depth * width / (zero * zero), 1.0)
        return tustin(top, (1.0 / (pole * pole), width / (pole * pole), 1.0), w0, period_s)
    w0 = _below_nyquist(_given(item, "frequency", where), period_s, item.kind, where)
    if item.kind == "notch":
        width = _given(item, "width", where)
        return tustin((1.0, item.depth * width, w0 * w0), (1.0, width, w0 * w0), w0, period_s)
    if item.order == 1:
        return tustin((0.0, 0.0, w0), (0.0, 1.0, w0), w0, period_s)
    return tustin((0.0, 0.0, w0 * w0), (1.0, 2.0 * item.damping * w0, w0 * w0), w0, period_s)


def _given(item: Filter, name: str, where: str) -> Any:
    value = getattr(item, f"{name}_rad_s")
    if value is None or not np.all((np.asarray(value) > 0.0) & (np.asarray(value) < inf)):
        message = f"control.velocity.filter: {name} = {value}: a {item.kind} needs one above zero"
        raise InputError(message, where=where)
    return value


def _below_nyquist(w0: Any, period_s: Any, kind: str, where: str) -> Any:
    nyquist = pi / np.asarray(period_s)
    if np.any(w0 >= nyquist):
        message = f"control.velocity.filter: {kind} at {np.max(w0):g} rad/s"
        raise InputError(f"{message}: must be below pi/T = {np.min(nyquist):g} rad/s", where=where)
    return w0


def _biquad(item: Filter, where: str) -> Section:
    try:
        b, a = item.polynomials
    except InputError as error:
        raise InputError(str(error), where=where) from error
    (b0, b1, b2), (_, a1, a2) = (*b, 0.0, 0.0)[:3], (*a, 0.0, 0.0)[:3]
    return b0, b1, b2, a1, a2
