"""`stability_margins`: one entry for every kind of loop."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from actuator_lti.errors import InputError, NumericalError
from actuator_lti.margins.delay_form import DelayForm, delay_form, from_rational
from actuator_lti.margins.delayed import delayed_margins, without_intervals
from actuator_lti.margins.given import Given, given_of
from actuator_lti.margins.loop import loop_of
from actuator_lti.margins.measured import measured_margins
from actuator_lti.margins.rational import checked_margins
from actuator_lti.margins.results import StabilityMargins
from actuator_lti.margins.trust import Doubtful

_MOST_SAMPLES = 100


def stability_margins(
    system: Any,
    delay_s: float = 0.0,
    band_rad_s: tuple[float, float] | None = None,
    *,
    certify: bool = False,
) -> StabilityMargins:
    """Find all margins of a loop L closed by negative unit feedback.

    Rational loops need no grid: crossovers are eigenvalues (Boyd, Balakrishnan, Kabamba 1989), each held by a
    change of sign and polished by Newton. With delays, inside or in series, intervals are split until a bound
    on the change of L shows that nothing hides between two points. Stability is found twice: from closed-loop
    poles (with delays, by collocation) and from the Nyquist curve alone. What double precision cannot check
    in this way is worked out in exact arithmetic; ``.evidence`` says how the answer is known. Quoted are, see
    `StabilityMargins`: the gain margin nearest to 0 dB, the phase margin nearest to 0 deg with its sign, the
    smallest delay margin (0 for an unstable loop), the smallest distance to -1.

    Parameters
    ----------
    system : StateSpace, TransferFunction, DelaySystem or FrequencyResponseData
        The open loop L, one input and one output, continuous or sampled. With ``dt=True`` the period counts
        as 1 s. Measured data give bounds between neighbouring points and no verdict.
    delay_s : float, optional
        Exact extra delay in series, s. In a sampled loop whole samples become states; a fraction of a sample
        is the factor exp(-j w delay) up to the Nyquist frequency; the verdict is then that of
        the Nyquist curve alone.
    band_rad_s : tuple of float, optional
        Where margins are listed. Default: everywhere; under a delay, whose phase crossovers never end, up to
        where the gain stays below -40 dB (``.band_rad_s`` of the result). The verdict, the modulus and the
        disk margin are those of the whole axis in any case.
    certify : bool, optional
        Exact arithmetic in any case: rational loops, sampled ones with whole samples of delay, continuous
        ones with exact delays. A fraction of a sample and measured data stay as they are.

    Returns
    -------
    StabilityMargins
        Printing it shows units.

    Raises
    ------
    InputError
        Not SISO, not finite, improper or not well posed (1 + L(inf) = 0), a pole on the border of stability
        cancelled by a zero, a direct feed-through behind a delay (neutral type), data too coarse.
    NumericalError
        ``|L|`` is one at every frequency, or a search was not settled to its accuracy.

    Examples
    --------
    >>> import control
    >>> m = stability_margins(control.tf([100], [1, 0]), delay_s=0.005)
    >>> m.stable, round(m.gain_margin_db, 4), round(m.phase_margin_deg, 4), round(1e3 * m.delay_margin_s, 5)
    (True, 9.943, 61.3521, 10.70796)
    """
    if not (math.isfinite(delay_s) and delay_s >= 0.0):
        raise InputError(f"delay_s = {delay_s}: must be finite and not negative")
    if band_rad_s is not None and not 0.0 <= band_rad_s[0] < band_rad_s[1]:
        raise InputError(f"band_rad_s = {band_rad_s}: two frequencies, 0 <= low < high, in rad/s")
    if not hasattr(system, "delays_s") and hasattr(system, "frdata"):
        return measured_margins(system, delay_s, band_rad_s)
    if hasattr(system, "delays_s"):
        if system.delays_s.size or delay_s:
            return _delayed(delay_form(system, delay_s), band_rad_s, certify)
        system = system.to_state_space()
    if not (hasattr(system, "num") or hasattr(system, "A")):
        raise InputError(
            f"{type(system).__name__}: a StateSpace, TransferFunction, DelaySystem or FrequencyResponseData"
        )
    given = given_of(system)
    if not delay_s:
        return within(_rational(given, certify), band_rad_s)
    samples = None if given.period_s is None else whole_samples(delay_s / given.period_s)
    if samples is None:
        return _delayed(from_rational(loop_of(given), delay_s), band_rad_s, certify)
    late = _rational(replace(given, samples=samples), certify)
    return replace(within(late, band_rad_s), delay_s=delay_s)


def _rational(given: Given, certify: bool) -> StabilityMargins:
    """In double precision, and by exact arithmetic where that is not sure of itself."""
    from actuator_lti.margins.certified import certified_margins  # python-flint only where it is needed

    if certify:
        return certified_margins(given)
    try:
        return checked_margins(loop_of(given, warp=True))
    except Doubtful:
        return certified_margins(given)


def _delayed(form: DelayForm, band: tuple[float, float] | None, certify: bool) -> StabilityMargins:
    """In double precision, and by certified intervals where the two ways to stability do not both tell."""
    from actuator_lti.margins.certified_delay import certified_delayed_margins, withheld
    from actuator_lti.margins.exact_axis import Undetermined

    try:
        margins = delayed_margins(form, band)
    except NumericalError as error:
        if form.sampled:
            raise
        unknown = without_intervals(form, band)
        try:
            return certified_delayed_margins(form, unknown, band)
        except Undetermined as exact:
            return withheld(unknown, str(exact))
        except (NumericalError, InputError):
            raise error from None
    told_twice = margins.agreement.agree and None not in (
        margins.agreement.unstable_poles,
        margins.agreement.unstable_nyquist,
    )
    if form.sampled or (told_twice and not certify):
        return margins
    try:
        return certified_delayed_margins(form, margins, band)
    except (NumericalError, InputError) as error:
        if not margins.agreement.agree:
            return withheld(margins, f"poles and Nyquist count disagree; {error}")
        return replace(margins, evidence_reason=f"{margins.evidence_reason}; not certified: {error}")


def whole_samples(samples: float) -> int | None:
    """The number of samples, where it is a whole one and becomes states."""
    whole = round(samples)
    return whole if abs(samples - whole) <= 1e-9 * max(samples, 1.0) and whole <= _MOST_SAMPLES else None


def within(margins: StabilityMargins, band: tuple[float, float] | None) -> StabilityMargins:
    """The same with only the margins of a band listed."""
    if band is None:
        return margins
    low, high = band

    def inside(listed: tuple[Any, ...]) -> tuple[Any, ...]:
        return tuple(margin for margin in listed if low <= margin.frequency_rad_s <= high)

    return replace(
        margins,
        gain_margins=inside(margins.gain_margins),
        phase_margins=inside(margins.phase_margins),
        delay_margins=inside(margins.delay_margins),
        band_rad_s=(low, high),
    )
