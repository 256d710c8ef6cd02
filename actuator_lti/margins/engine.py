"""`stability_margins`: one entry for every kind of loop."""

from dataclasses import replace
from math import nan
from typing import Annotated, Any

from actuator_lti.errors import CHECKED, InputError, NumericalError, delay_number, shown
from actuator_lti.margins.assemble import assembled
from actuator_lti.margins.checked import checked_margins
from actuator_lti.margins.delays.form import DelayForm, delay_form, without_series_delays
from actuator_lti.margins.given import Given, given_of, whole_samples
from actuator_lti.margins.loop import loop_of
from actuator_lti.margins.measured.margins import measured_margins
from actuator_lti.margins.results import StabilityMargins
from actuator_lti.margins.single import Agreement
from actuator_lti.margins.trust import Doubtful
from actuator_lti.measured.response import is_measured
from actuator_lti.types import Delay, number_array

Band = Annotated[tuple[float, float], CHECKED]
MOST_STATES = 200  # of a loop for exact arithmetic: 7 s there, 3 s of 140, minutes of 320


def stability_margins(
    system: Any, delay_s: Delay = 0.0, band_rad_s: Band | None = None, *, certify: bool = False
) -> StabilityMargins:
    """Find all margins of a loop L closed by negative unit feedback.

    A rational loop, alone or behind a delay, is taken as its factors: the change of each over an interval of
    frequency is known, and intervals are split until the loop stays off the unit circle and the negative real
    axis in each, or moves over them one way; no crossing is left out. Behind a delay the factors are those of
    the exact polynomials where double precision does not place them. Stability is found twice where it can
    be, from closed-loop poles (behind a delay, from those without it) and from the Nyquist curve. Delays
    inside, and what double precision cannot check in this way, are worked out in exact arithmetic;
    ``.evidence`` says how the answer is known; which figures are quoted, `StabilityMargins` says.

    ``system``: the open loop L, one input and one output, continuous or sampled: StateSpace,
    TransferFunction (of scipy.signal too), `DelaySystem` or FrequencyResponseData. With ``dt=True`` the
    period counts as 1 s. Measured data give bounds between neighbouring points and no verdict.

    ``delay_s``: exact extra delay in series. In a sampled loop whole samples become states; part of a sample
    is the factor exp(-j w delay) up to the Nyquist frequency, where L jumps to its conjugate by way of the
    mean of both, which may lie on the negative real axis and be a gain margin. The verdict is then that of
    the Nyquist curve alone. As the part goes to 0 or 1 everything goes to what whole samples give.

    ``band_rad_s``: where margins are listed. Default: everywhere, gain margins within 200 dB; under a delay,
    whose phase crossovers never end, up to where the gain stays below -40 dB and for four turns of the delay,
    farther where the nearest margin lies beyond, or nearer where that would be more than 1e5 turns
    (``.band_rad_s`` of the result, and a note). The verdict, the modulus and the disk margin are those of the
    whole axis in any case.

    ``certify``: exact arithmetic in any case: rational loops, sampled ones with whole samples of delay,
    continuous ones with exact delays. A fraction of a sample, measured data and state spaces of more than 200
    states stay as they are.

    Raises `InputError`: for a loop that is not SISO, not finite, improper or not well posed (1 + L(inf) = 0),
    a direct feed-through of one or more behind a delay (neutral type), data too coarse. Raises
    `NumericalError`: if ``|L|`` is one at every frequency, or a search was not settled to its accuracy.

    Examples
    --------
    >>> import control
    >>> m = stability_margins(control.tf([100], [1, 0]), delay_s=0.005)
    >>> m.stable, round(m.gain_margin_db, 4), round(m.phase_margin_deg, 4), round(1e3 * m.delay_margin_s, 5)
    (True, 9.943, 61.3521, 10.70796)
    """
    delay_s, band_rad_s = delay_number(delay_s), _band(band_rad_s)
    if is_measured(system):
        return measured_margins(system, delay_s, band_rad_s)
    if hasattr(system, "delays_s"):
        if system.delays_s.size or delay_s:
            form = delay_form(system, delay_s)  # refuses what is no loop
            plain = without_series_delays(form)
            if plain is None:
                return _inside_delays(form, band_rad_s)
            return replace(_behind_delay(*plain, band_rad_s, certify), delay_s=delay_s)
        system = system.to_state_space()
    given = given_of(system)
    if not delay_s:
        return _rational(given, band_rad_s, certify)
    samples = None if given.period_s is None else whole_samples(delay_s / given.period_s)
    if samples is None:
        return _behind_delay(given, delay_s, band_rad_s, certify)
    return replace(_rational(replace(given, samples=samples), band_rad_s, certify), delay_s=delay_s)


def _band(band: Any) -> tuple[float, float] | None:
    if band is None:
        return None
    try:
        low, high = map(float, number_array(list(band)))
    except (TypeError, ValueError, OverflowError):
        low = high = nan
    if not 0.0 <= low < high:
        raise InputError(f"band_rad_s = {shown(band)}: two frequencies, 0 <= low < high, in rad/s")
    return low, high


def _rational(given: Given, band: tuple[float, float] | None, certify: bool) -> StabilityMargins:
    """In double precision, and by exact arithmetic where that is not sure of itself (of no large loop)."""
    if not certify or _too_large(given):
        try:
            return checked_margins(loop_of(given, warp=True), 0.0, band)
        except Doubtful as doubt:
            if _too_large(given):
                why = (
                    f"{doubt}; exact arithmetic decides up to {MOST_STATES} states, these are {given.b.size}"
                )
                return _withheld(given.period_s, 0.0, "factors of the loop", why)
    from actuator_lti.margins.exact.certified import certified_margins  # python-flint only where it is needed

    return certified_margins(given, band)


def _too_large(given: Given) -> bool:
    """Whether exact arithmetic on the matrices would take minutes."""
    return given.A is not None and given.b.size > MOST_STATES


def _behind_delay(
    given: Given, delay_s: float, band: tuple[float, float] | None, certify: bool
) -> StabilityMargins:
    """A rational loop behind a delay, which may be part of a sample: by its factors, of double precision or
    of exact polynomials; a continuous one where asked for, or where these fail, by certified intervals.
    """
    try:
        margins = checked_margins(loop_of(given, warp=True), delay_s, band)
    except Doubtful as doubt:
        from actuator_lti.margins.exact.product import late_margins  # python-flint only where it is needed

        try:
            margins = late_margins(given, delay_s, band)
        except Doubtful as error:
            margins = _withheld(given.period_s, delay_s, "factors of the loop", f"{doubt}; {error}")
    if given.period_s is not None or margins.evidence == "certified" or not (certify or margins.withheld):
        return margins
    from actuator_lti.margins.delays.certified import certified_delayed_margins  # python-flint if needed
    from actuator_lti.margins.delays.exact import exact_behind_delay

    try:
        return certified_delayed_margins(exact_behind_delay(given, delay_s), delay_s, band, margins)
    except (NumericalError, InputError) as error:
        return replace(margins, evidence_reason=f"{margins.evidence_reason}; not certified: {error}")


def _inside_delays(form: DelayForm, band: tuple[float, float] | None) -> StabilityMargins:
    from actuator_lti.margins.delays.certified import certified_delayed_margins  # python-flint if needed
    from actuator_lti.margins.delays.exact import exact_inside_delays

    loops = exact_inside_delays(form)
    try:
        return certified_delayed_margins(loops, form.series_s, band)
    except NumericalError as error:
        return _withheld(None, form.series_s, "certified intervals", str(error))


def _withheld(period_s: float | None, delay_s: float, method: str, reason: str) -> StabilityMargins:
    nothing = Agreement(None, None)
    return assembled(period_s, nothing, None, method=method, reason=reason, delay_s=delay_s)
