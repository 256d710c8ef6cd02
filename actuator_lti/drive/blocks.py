"""Controllers, filters and estimators as small linear blocks with a sampled and a continuous realisation.

``x+ = A x + B e`` (sampled) or ``dx/dt = A x + B e`` with ``y = C x + D e``; coefficients are floats, or
arrays of shape (K,) stacked over designs. The running tick stands in model.md sections 2 and 7.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from actuator_lti.design.model import Encoder, Filter
from actuator_lti.errors import InputError
from actuator_lti.systems.resolvent import states_at

Polynomial = tuple[Any, ...]


class Realisation(NamedTuple):
    """``A`` (n by n), ``B`` (n), ``C`` (n) and ``D`` of a SISO block, as nested tuples of coefficients."""

    A: tuple[tuple[Any, ...], ...] = ()
    B: tuple[Any, ...] = ()
    C: tuple[Any, ...] = ()
    D: Any = 1.0

    def response(self, points: np.ndarray) -> np.ndarray:
        """C (p I - A)^-1 B + D at complex points p (s, or z)."""
        p = np.atleast_1d(np.asarray(points, dtype=complex))
        if not self.B:
            return np.full(p.shape, complex(self.D))
        A, B, C = (np.array(part, dtype=float) for part in (self.A, self.B, self.C))
        return np.asarray(states_at(A, B[:, None], p)[:, :, 0] @ C + self.D)


@dataclass(frozen=True)
class Block:
    """One block in both times."""

    sampled: Realisation
    continuous: Realisation
    states: tuple[str, ...] = ()  # names of the sampled ones, told apart by the place of the block
    period_s: Any = 0.0  # T of the sampled realisation
    age_s: Any = 0.0  # delay that the continuous one needs besides (a difference over m T is m T/2 old)

    def at_s(self, omega_rad_s: np.ndarray) -> np.ndarray:
        """Frequency response of the continuous realisation, its age left out."""
        return self.continuous.response(1j * np.asarray(omega_rad_s))


def pi(gain: Any, integral_time_s: Any, period_s: Any) -> Block:
    """``v = Kp e + I'``, ``I' = I + (Kp T/Tn) e``, continuous Kp (1 + 1/(Tn s)); P where Tn is ``None``."""
    if integral_time_s is None:
        return Block(Realisation(D=gain), Realisation(D=gain), (), period_s)
    rate = gain / integral_time_s
    step = rate * period_s
    return Block(
        Realisation(((1.0,),), (step,), (1.0,), gain + step), Realisation(((0.0,),), (rate,), (1.0,), gain),
        ("I",), period_s
    )  # fmt: skip


def lag(time_s: Any, period_s: Any) -> Block:
    """First-order filter ``y_k = y_{k-1} + T/(T_F + T) (x_k - y_{k-1})``; continuous 1/(T_F s + 1)."""
    share = period_s / (time_s + period_s)
    return Block(
        Realisation(((1.0 - share,),), (share,), (1.0 - share,), share),
        Realisation(((-1 / time_s,),), (1 / time_s,), (1.0,), 0.0), ("filter",), period_s
    )  # fmt: skip


def difference(samples: int, period_s: Any) -> Block:
    """Mean speed over m periods; sampled, of the angle gained in each, continuous, of the speed."""
    m, span = samples, samples * period_s
    shift = tuple(tuple(1.0 if c == r - 1 else 0.0 for c in range(m - 1)) for r in range(m - 1))
    C = tuple(1 / span if c == m - 2 else 0.0 for c in range(m - 1))
    # D_j: angle gained over the last j periods; D_j' = gained + D_{j-1}
    sampled = Realisation(shift, (1.0,) * (m - 1), C, 1 / span)
    return Block(sampled, Realisation(), tuple(f"D{j}" for j in range(1, m)), period_s, span / 2)


def tracking(bandwidth_rad_s: Any, period_s: Any) -> Block:
    """The tracking loop of model.md section 7; inputs as `difference`. States: angle lag, speed estimate.

    With d the angle gained plus the lag left after the last update: r = d - T w^, lag' = (1 - 2 w0 T) r,
    w^' = w^ + w0^2 T r, which is y. Continuous w0^2/(s^2 + 2 w0 s + w0^2) of the speed.
    """
    w0, T = bandwidth_rad_s, period_s
    keep, pull = 1 - 2 * w0 * T, w0**2 * T
    sampled = Realisation(((keep, -keep * T), (pull, 1 - pull * T)), (keep, pull), (pull, 1 - pull * T), pull)
    flow = Realisation(((-2 * w0, -1.0), (w0**2, 0.0)), (1.0, 0.0), (0.0, 1.0), 0.0)
    return Block(sampled, flow, ("lag", "estimate"), period_s)


def speed_estimate(encoder: Encoder, period_s: Any) -> Block | None:
    """The estimator of an encoder; ``None`` where w itself is measured."""
    if encoder.speed == "difference":
        return difference(encoder.difference_samples, period_s)
    if encoder.speed == "tracking":
        if encoder.bandwidth_rad_s is None:
            raise InputError("encoder.bandwidth: missing; the tracking loop needs it")
        return tracking(encoder.bandwidth_rad_s, period_s)
    return None


def analog(item: Filter) -> tuple[Polynomial, Polynomial]:
    """Numerator and denominator in s, highest power first, of a filter that is given in s."""
    given: Any = item
    w0, zero, pole, width = given.frequency_rad_s, given.zero_rad_s, given.pole_rad_s, given.width_rad_s
    if item.kind == "lowpass":
        return ((w0,), (1.0, w0)) if item.order == 1 else ((w0**2,), (1.0, 2 * item.damping * w0, w0**2))
    if item.kind == "notch":
        return (1.0, item.depth * width, w0**2), (1.0, width, w0**2)
    if item.kind == "leadlag":
        return (pole / zero, pole), (1.0, pole)
    gain = (pole / zero) ** 2  # of a skewed notch
    return (gain, gain * item.depth * width, pole**2), (1.0, width, pole**2)


def centre_rad_s(item: Filter) -> Any:
    """The frequency at which Tustin's rule is prewarped; ``None`` for a sampled biquad."""
    given: Any = item
    if item.kind == "biquad" or item.frequency_rad_s is not None:
        return item.frequency_rad_s
    return (given.zero_rad_s * given.pole_rad_s) ** 0.5


def biquad(item: Filter, period_s: Any) -> Block:
    """A filter of the velocity loop, Tustin prewarped at its own frequency; an InputError from pi/T on."""
    if item.kind == "biquad":
        return _given(item, period_s)
    num, den = analog(item)
    order, w0 = len(den) - 1, centre_rad_s(item)
    if np.any(np.asarray(w0) * period_s >= np.pi):
        most = f"pi/T = {np.pi / np.min(period_s):g} rad/s"
        raise InputError(f"{item.kind} at {np.max(w0):g} rad/s: must be below {most}")
    c = w0 / np.tan(w0 * period_s / 2)
    padded = (0.0,) * (order + 1 - len(num)) + num
    b, a = _tustin(padded, c), _tustin(den, c)
    return Block(_canonical(b, a), _canonical(padded, den), ("1", "2")[:order], period_s)


def _tustin(p: Polynomial, c: Any) -> Polynomial:
    """Coefficients in z, highest power first, of a polynomial in s = c (z - 1)/(z + 1)."""
    if len(p) == 2:
        return (p[0] * c + p[1], p[1] - p[0] * c)
    square, middle = p[0] * c * c, p[1] * c
    return (square + middle + p[2], 2 * (p[2] - square), square - middle + p[2])


def _canonical(num: Polynomial, den: Polynomial) -> Realisation:
    """Observer form (direct form II transposed) of num/den, both highest power first and of equal length."""
    b, a = [value / den[0] for value in num], [value / den[0] for value in den]
    n = len(a) - 1
    A = tuple(tuple(-a[r + 1] if c == 0 else float(c == r + 1) for c in range(n)) for r in range(n))
    return Realisation(A, tuple(b[r + 1] - a[r + 1] * b[0] for r in range(n)), (1.0, 0.0)[:n], b[0])


def _back(p: Polynomial, h: Any) -> Polynomial:
    """Coefficients in s of a polynomial in z = (1 + s h)/(1 - s h), highest power first."""
    if len(p) == 2:
        return ((p[0] - p[1]) * h, p[0] + p[1])
    return ((p[0] - p[1] + p[2]) * h * h, 2 * (p[0] - p[2]) * h, p[0] + p[1] + p[2])


def _given(item: Filter, period_s: Any) -> Block:
    """A biquad by its sampled coefficients; its continuous realisation by the inverse of Tustin's rule."""
    b, a = item.polynomials
    if len(a) == 1:
        return Block(Realisation(D=b[0]), Realisation(D=b[0]), (), period_s)
    num, den = (_back(p, period_s / 2) for p in (b, a))
    return Block(_canonical(b, a), _canonical(num, den), ("1", "2")[: len(a) - 1], period_s)
