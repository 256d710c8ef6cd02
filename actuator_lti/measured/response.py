"""Frequency-response data with what is known about their noise."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from actuator_lti.errors import InputError
from actuator_lti.systems.plain_system import period_of
from actuator_lti.types import Compared, Complex, Ints, Real, number_array

CONFIDENCE = 0.99
GAUSSIAN = math.sqrt(-math.log(1.0 - CONFIDENCE))  # radius over deviation of noise that is known
_KNOWN = "what is known goes in a column deviation, or a MeasuredResponse"
_GUESSED = f"as points scatter about their neighbours; {_KNOWN}"
NEIGHBOURS = 17  # points whose scatter tells the noise of one
_FEWEST = 6  # points: of two residuals the median has one degree of freedom
_UNKNOWN = f"not known, as so few points do not show it: no range is stated; {_KNOWN}"


@dataclass(frozen=True, eq=False)
class MeasuredResponse(Compared):
    """A measured loop L with the radius of a circle about each value that holds the true one.

    `stability_margins` takes it as it takes `control.FrequencyResponseData`; the ranges that it states are
    widened by the radius.

    ``omega``, shape (m,): angular frequencies, rad/s.
    ``frdata``, shape (m,), complex: measured values.
    ``radius``, shape (m,): of the circle, at the confidence of the range (0.99 by default).
    ``dt``: sampling period, s; ``None`` for a continuous loop.
    ``source``: where the radius comes from.
    ``noise_known``: whether anything is known of it; else the radius is 0, and no range is stated.
    """

    ninputs: ClassVar[int] = 1
    noutputs: ClassVar[int] = 1

    omega: Real
    frdata: Complex
    radius: Real
    dt: float | None
    source: str
    noise_known: bool = True

    @classmethod
    def with_noise(
        cls, data: Any, standard_deviation: ArrayLike, confidence: float = CONFIDENCE
    ) -> MeasuredResponse:
        """Noise that is given, of data with one input and one output.

        ``standard_deviation``: root mean square of the complex error of each value, sqrt(E |e|^2), in the
        unit of L; a number or one for each frequency. The error is taken as circular and Gaussian: |e|
        exceeds the radius sigma sqrt(-ln(1 - confidence)) in 1 - confidence of all cases.

        Raises `InputError`: a negative or infinite standard deviation, or a confidence outside (0, 1).
        """
        omega, L, dt = _read(data)
        sigma = _per_point("standard_deviation", standard_deviation, L.size)
        radius = sigma * math.sqrt(-math.log(1.0 - _checked(confidence)))
        return cls(omega, L, radius, dt, "given as a standard deviation")

    @classmethod
    def from_coherence(
        cls, data: Any, coherence: ArrayLike, averages: int, confidence: float = CONFIDENCE
    ) -> MeasuredResponse:
        """Noise from the coherence of an averaged measurement.

        The error of L = S_xy/S_xx over n averages lies within |e|^2 = F |L|^2 (1 - g^2)/(g^2 (n - 1)), with
        the coherence g^2 as estimated and F the quantile of F(2, 2 n - 2) (Bendat, Piersol, Random Data,
        chapter 9).

        ``coherence``: ordinary coherence g^2 of each value, in (0, 1].
        ``averages``: independent averages, at least 2.

        Raises `InputError`: a coherence outside (0, 1], fewer than 2 averages.
        """
        omega, L, dt = _read(data)
        g2 = _per_point("coherence", coherence, L.size)
        if not ((g2 > 0.0) & (g2 <= 1.0)).all():
            raise InputError("coherence: every value must lie in (0, 1]")
        if averages < 2:
            raise InputError(f"averages = {averages}: at least 2")
        sigma = np.abs(L) * np.sqrt((1.0 - g2) / (g2 * (averages - 1)))
        radius = sigma * student(averages - 1, _checked(confidence))
        return cls(omega, L, radius, dt, f"coherence of {averages} averages")

    @classmethod
    def from_repeats(cls, repeats: Sequence[Any], confidence: float = CONFIDENCE) -> MeasuredResponse:
        """Noise from the scatter of repeated measurements at the same frequencies; L is their mean.

        With n repeats |e|^2 over the estimated variance of the mean follows F(2, 2 n - 2): the radius grows
        where there are few, and neighbouring frequencies then count along (`scatter_of_repeats`).

        Raises `InputError`: fewer than 2 repeats, or other frequencies.
        """
        if len(repeats) < 2:
            raise InputError("repeats: at least two measurements are needed to see the scatter")
        read = [_read(each) for each in repeats]
        omega, _, dt = read[0]
        if any(w.shape != omega.shape or (np.abs(w - omega) > 1e-9 * omega).any() for w, _, _ in read):
            raise InputError("repeats: every one must have the same frequencies")
        values = np.array([L for _, L, _ in read])
        mean, n, rising = values.mean(axis=0), len(repeats), np.argsort(omega)
        squared, radius = (np.abs(values - mean) ** 2).sum(axis=0), np.empty(omega.size)
        count = np.full(omega.size, n)
        sigma, freedom = scatter_of_repeats(np.abs(mean)[rising], squared[rising], count)
        radius[rising] = sigma * student(freedom, _checked(confidence))
        return cls(omega, mean, radius, dt, f"scatter of {n} repeats")

    @classmethod
    def from_scatter(cls, data: Any) -> MeasuredResponse:
        """Noise as the points scatter about their neighbours."""
        omega, L, dt = _read(data)
        radius = _scatter(omega, L)
        if radius is None:
            return cls(omega, L, np.zeros(L.size), dt, _UNKNOWN, False)
        return cls(omega, L, radius, dt, _GUESSED)


def is_measured(system: Any) -> bool:
    """Whether this is frequency-response data, of either kind."""
    return isinstance(system, MeasuredResponse) or (
        hasattr(system, "frdata") and not hasattr(system, "delays_s")
    )


def refuse_measured(system: Any) -> None:
    """Refuse data where a response in time is asked for."""
    if is_measured(system):
        raise InputError(
            "measured data: a step response needs the frequencies between and beyond the points too; "
            "allowed: a StateSpace, TransferFunction or DelaySystem (bandwidths and margins take the data)"
        )


def measured_response(data: Any) -> MeasuredResponse:
    """Bring data of either kind into this form; the noise of plain ones is estimated from their scatter."""
    if isinstance(data, MeasuredResponse):
        return data
    return MeasuredResponse.from_scatter(data)


def _scatter(omega: Real, L: Complex) -> Real | None:
    """Radius about each value, from how far points nearby lie off the cubic through their own neighbours.

    Log L over log frequency, two neighbours on either side: the residual has (1 + sum of the squared weights)
    times the variance of a value. The median counts, so that a resonance between two points does not.
    ``None``: too few points, or few that bend so much that all their values would be lost in noise.
    """
    usable = np.flatnonzero((omega > 0.0) & (L != 0.0) & np.isfinite(L))
    usable = usable[np.argsort(omega[usable])]
    u, y = np.log(omega[usable]), np.log(np.abs(L[usable])) + 1j * np.unwrap(np.angle(L[usable]))
    if u.size < _FEWEST or (np.diff(u) <= 0.0).any():
        return None
    at = np.arange(2, u.size - 2)
    beside = at[:, None] + np.array([-2, -1, 1, 2])
    off = u[at, None] - u[beside]
    weight = np.ones(off.shape)
    for i in range(4):
        for j in range(4):
            if i != j:
                weight[:, i] *= off[:, j] / (u[beside[:, i]] - u[beside[:, j]])
    residual = y[at] - (weight * y[beside]).sum(axis=1)
    squared = np.abs(residual) ** 2 / (1.0 + (weight**2).sum(axis=1))
    first = np.clip(np.arange(u.size) - 2 - NEIGHBOURS // 2, 0, max(at.size - NEIGHBOURS, 0))
    window = first[:, None] + np.arange(min(NEIGHBOURS, at.size))
    sigma = np.sqrt(np.median(squared[window], axis=1) / math.log(2.0))
    reach = sigma * student(window.shape[1] // 2, CONFIDENCE)
    if u.size < NEIGHBOURS and (reach >= 1.0).all():
        return None
    radius = np.zeros(L.size)
    radius[usable] = np.abs(L[usable]) * reach
    return radius


def scatter_of_repeats(size: Real, squared: Real, count: Ints) -> tuple[Real, Real]:
    """Deviation of the mean of repeats in the unit of L, and its freedom, at rising frequencies; (m,) each.

    ``size`` of the mean, ``squared``: sum of the squared distances from it, ``count`` of the repeats. Few
    repeats are judged with those of the frequencies nearby, their noise being alike, or alike over the size:
    whichever is the likelier there.
    """
    freedom = np.asarray(count - 1, dtype=float)
    if freedom.min() >= NEIGHBOURS // 2:
        return np.sqrt(squared / freedom / count), freedom
    width = min(NEIGHBOURS, size.size)
    start = np.clip(np.arange(size.size) - width // 2, 0, size.size - width)

    def nearby(values: Real) -> Real:
        return np.asarray(np.sum(values[start[:, None] + np.arange(width)], axis=1))

    square, total = np.maximum(size, 1e-100) ** 2, nearby(freedom)
    every = np.maximum(total, 1.0)
    even, over = nearby(squared), nearby(squared / square)
    likelier = over * np.exp(nearby(freedom * np.log(square)) / every) < even
    return np.sqrt(np.where(likelier, square * over, even) / every / count), total


def at_once(radius: Real) -> Real:
    """Radii of circles that all hold at once as surely as each alone (Gaussian tails, Bonferroni)."""
    return radius * math.sqrt(1.0 + math.log(radius.size) / -math.log(1.0 - CONFIDENCE))


def _read(data: Any) -> tuple[Real, Complex, float | None]:
    if data.ninputs != 1 or data.noutputs != 1:
        raise InputError(f"a loop has one input and one output; this has {data.ninputs} and {data.noutputs}")
    dt = period_of(data)
    omega, L = np.asarray(data.omega, dtype=float), np.asarray(data.frdata, dtype=complex).reshape(-1)
    if dt is not None and (omega > math.pi / dt * (1.0 + 1e-9)).any():
        raise InputError(
            f"measured data: {omega.max():.6g} rad/s; allowed: up to the Nyquist frequency, "
            f"{math.pi / dt:.6g} rad/s"
        )
    return omega, L, dt


def _per_point(name: str, values: ArrayLike, count: int) -> Real:
    try:
        array = number_array(values)
    except (TypeError, ValueError):
        array = np.empty((0, 0))
    if array.shape not in ((), (count,)):
        raise InputError(f"{name}: allowed: one number, or one for each of the {count} frequencies")
    if not (np.isfinite(array) & (array >= 0.0)).all():
        raise InputError(f"{name}: every value must be finite and not negative")
    return np.broadcast_to(array, (count,)).astype(float)


def _checked(confidence: float) -> float:
    if not 0.0 < confidence < 1.0:
        raise InputError(f"confidence = {confidence}: between 0 and 1")
    return confidence


def student(freedom: ArrayLike, confidence: float) -> Real:
    """Root of the quantile of F(2, 2 freedom), which has a closed form."""
    freedom = np.asarray(freedom, dtype=float)
    return np.sqrt(freedom * ((1.0 - confidence) ** (-1.0 / freedom) - 1.0))
