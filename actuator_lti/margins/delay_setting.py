"""Where a loop with delays is to be looked at, and the intervals that leave nothing unseen there."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from actuator_lti.errors import InputError, NumericalError
from actuator_lti.margins.collocation import open_loop_matrix
from actuator_lti.margins.delay_form import DelayForm, Intervals, border_values
from actuator_lti.margins.loop import Mask, Real
from actuator_lti.margins.nyquist import slope_at_dc
from actuator_lti.margins.poles import BorderPole, SortedPoles, sorted_poles
from actuator_lti.margins.sweep import RESOLVED, subdivided, variation

FLOOR = 0.01  # gain below which no crossing of the real axis is listed: 40 dB
_PER_DECADE = 12
_NEAR_ZERO = 1e-6  # of the next pole: worth asking whether a pole is exactly zero
_NO_TURN = 0.99  # a gain below this takes 1 + L out of the right half plane nowhere


@dataclass(frozen=True)
class Setting:
    """What has to be known of a loop before its intervals are laid out.

    Attributes
    ----------
    form : DelayForm
        The loop.
    open_poles : SortedPoles
        Its poles, inner delays collocated.
    low, high : float
        Where the intervals run (x): below, L follows its pole at zero; above, the gain stays below `FLOOR`.
    order, hidden : int
        Poles at zero frequency that L shows, and that it does not.
    listed_to : float
        Up to which x crossings of the real axis are listed however small the gain.
    floor : float
        Beyond that they are listed only where the gain is above this.
    """

    form: DelayForm
    open_poles: SortedPoles
    low: float
    high: float
    order: int
    hidden: int
    listed_to: float = 0.0
    floor: float = FLOOR


def setting_of(form: DelayForm, band: tuple[float, float] | None, tail: bool = True) -> Setting:
    """Find the setting of a loop; ``band`` in rad/s, as asked for."""
    matrix = open_loop_matrix(form, 24)
    poles = _exact_zero(form, sorted_poles(matrix, form.sampled, gather=True))
    if poles.at_dc > 1 and not form.sampled and form.delays.size:
        poles = _parted(form, poles, sorted_poles(matrix, in_z=False))
    at_dc = poles.at_dc
    with np.errstate(divide="ignore"):
        sizes = np.abs(np.log(poles.values)) if form.sampled else np.abs(poles.values)
    sizes = sizes[(sizes > 0.0) & np.isfinite(sizes)]
    low = 1e-3 * float(sizes.min()) if sizes.size else 1e-3
    longest = max([form.series, *form.delays.tolist()], default=0.0)
    if longest:
        low = min(low, 1e-2 / longest)
    order, hidden = 0, 0
    if at_dc:
        low, order = _order_atdc_value(form.without_series(), low, at_dc)
        hidden = at_dc - order
        if hidden not in (0, 1):
            raise InputError("poles at zero frequency are cancelled by zeros: cancel them in the loop first")
    if form.sampled:
        return Setting(form, poles, low, math.pi, order, hidden, math.pi)
    if not tail:
        return Setting(form, poles, low, math.inf, order, hidden)
    high = _tail(form, max(float(sizes.max()) if sizes.size else 0.0, low * 10.0))
    if band is None:
        return Setting(form, poles, low, high, order, hidden)
    return Setting(form, poles, low, max(high, float(band[1])), order, hidden, float(band[1]), math.inf)


def _exact_zero(form: DelayForm, poles: SortedPoles) -> SortedPoles:
    """The poles with a simple one at zero put there, where the entries say so exactly.

    Balanced eigenvalues are known to the size of the whole matrix, which is far more than the rounding of
    two rows that are the same but for a factor: an integrator of the speed beside the angle.
    """
    if form.sampled or poles.at_dc or not poles.values.size:
        return poles
    size = np.abs(poles.values)
    k = int(size.argmin())
    beyond = float(np.delete(size, k).min(initial=np.inf))
    if size[k] > _NEAR_ZERO * beyond:
        return poles
    from actuator_lti.margins.exact_delay import singular_at_rest  # python-flint only where it is needed

    if not singular_at_rest(form):
        return poles
    values = poles.values.copy()
    values[k] = 0.0
    count = 1 + poles.border_count
    unstable = int(np.count_nonzero(values.real > 0.0)) if not poles.border else poles.unstable
    return SortedPoles(values, unstable, (BorderPole(0.0, 1), *poles.border), count, poles.doubtful)


def _parted(form: DelayForm, gathered: SortedPoles, plain: SortedPoles) -> SortedPoles:
    """A slow pole that was gathered to zero put back, where the entries say that it is none."""
    from actuator_lti.margins.exact_delay import poles_at_rest  # python-flint only where it is needed

    count = poles_at_rest(form)
    if not count or count >= gathered.at_dc:
        return gathered
    values = plain.values.copy()
    values[np.abs(values).argsort()[:count]] = 0.0
    border = (BorderPole(0.0, count), *(pole for pole in gathered.border if pole.x > 0.0))
    away = gathered.at_dc - count
    slow = values[np.abs(values).argsort()[count : count + away]]
    unstable = gathered.unstable + int(np.count_nonzero(slow.real > 0.0))
    return SortedPoles(values, unstable, border, gathered.border_count - away, gathered.doubtful)


def low_frequency(form: DelayForm) -> tuple[float, int]:
    """A frequency x below which L follows its pole at zero, and the multiplicity of that pole in L."""
    setting = setting_of(form.without_series(), None, tail=False)
    return setting.low, setting.order


def _order_atdc_value(form: DelayForm, low: float, most: int) -> tuple[float, int]:
    """A frequency at which L already follows its pole at zero, and the order of that pole."""
    order, _ = slope_at_dc(lambda x: border_values(form, x), 10.0 * low, most)
    if most == 1 and not order and not form.sampled:
        from actuator_lti.margins.exact_delay import shown_at_rest  # python-flint only where it is needed

        order = int(shown_at_rest(form))
    for _ in range(14):
        L = border_values(form, np.array([low, 0.1 * low]))
        with np.errstate(divide="ignore", invalid="ignore"):  # zero: a response that is none has no slope
            slope = float(np.log10(np.abs(L[1]) / np.abs(L[0])))
        if abs(slope - order) < 2e-3 and (not order or abs(L[0]) > 1e3):
            return low, order
        low *= 0.1
    raise InputError("the loop has a pole at zero frequency that is almost cancelled: cancel it first")


def _tail(form: DelayForm, start: float) -> float:
    """A frequency from which on |L| < FLOOR: with abs(F^-1) <= (w - |A|, ...)^-1 an M-matrix."""
    n, q = form.B1.size, form.delays.size
    if form.D11 and not form.series_s:
        raise InputError("a loop with delays and direct feed-through: its gain does not fall off")
    if not n and not q:
        return start

    def bound(w: float) -> float:
        M = np.block(
            [
                [w * np.eye(n) - np.abs(form.A), -np.abs(form.B2)],
                [-np.abs(form.C2), np.eye(q) - np.abs(form.D22)],
            ]
        )
        try:
            inverse = np.linalg.inv(M)
        except np.linalg.LinAlgError:
            return math.inf
        if inverse.min() < -1e-12 * np.abs(inverse).max():
            return math.inf  # w is not yet large enough for an M-matrix
        X = inverse @ np.concatenate((np.abs(form.B1), np.abs(form.D21)))
        return float(np.abs(form.C1) @ X[:n] + np.abs(form.D12) @ X[n:]) + abs(form.D11)

    w = start
    for _ in range(60):
        if bound(w) < FLOOR:
            return w
        w *= 2.0
    raise InputError(
        "the gain of the loop does not fall off towards high frequency (feed-through behind a delay): "
        "its closed loop is of neutral type, for which no margins are given"
    )


def excluded(intervals: Intervals, R: Real, setting: Setting) -> tuple[Mask, Mask]:
    """Intervals that hold no crossing of the unit circle; none of the negative real axis."""
    size = np.abs(intervals.L)
    no_gain = (size - intervals.spread > 1.0) | (size + intervals.spread < 1.0)
    to_axis = np.where(intervals.L.real < 0.0, np.abs(intervals.L.imag), size)
    beyond = intervals.x - intervals.half > setting.listed_to
    return no_gain, (to_axis > R) | ((size + R < setting.floor) & beyond)


def intervals_of(setting: Setting) -> Intervals:
    """Intervals over the whole axis in which every crossing and every turn about -1 is resolved."""
    form = setting.form

    def resolved(intervals: Intervals) -> Mask:
        R = variation(form, intervals)
        no_gain, no_phase = excluded(intervals, R, setting)
        size = np.abs(intervals.L)
        followed = (0.7 * np.abs(1.0 + intervals.L) > R) | (size + intervals.spread < _NO_TURN)
        return followed & ((RESOLVED * size >= R) | (no_gain & no_phase))

    decades = max(math.log10(setting.high / setting.low), 0.1)
    edges = np.geomspace(setting.low, setting.high, int(_PER_DECADE * decades) + 2)
    if setting.order == 0 and setting.hidden == 0:
        edges = np.concatenate(([0.0], edges))
    try:
        return subdivided(form, edges, resolved)
    except NumericalError as error:
        if _touches(form, edges):
            raise NumericalError(f"{error} (or a closed-loop pole there)") from error
        raise


def _touches(form: DelayForm, edges: Real) -> bool:
    return bool(np.abs(1.0 + border_values(form, edges[1:])).min() < 1e-6)


def dc_value(setting: Setting) -> float:
    """L at zero frequency, where it has no pole there."""
    x = setting.low if setting.hidden else 0.0
    return float(border_values(setting.form.without_series(), np.array([x]))[0].real)
