"""Every small-signal prediction judged by the simulator's own derivative (`nonlinear.tangent`).

Allowed is 1e-6 of the response, or ten times the tangent's stated error, each at its own frequency; for a
figure, what that does to it. A gain margin is a gain K and a point on the unit circle where, with G the
tangent over one base period,

    det(I + (K - 1) G(lambda)) = 0,   |lambda| = 1:

there the simulator has a closed-loop pole. It is solved for K and the angle from the predicted ones; how the
pole moves with K says on which side of the circle it lies at K (1 - 1e-6) and at K (1 + 1e-6).
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from math import degrees, pi

import numpy as np
from scipy.linalg import eig

from actuator_lti.asked.verdict import Verdict
from actuator_lti.loops import ExactMargins
from actuator_lti.systems.resolvent import balanced
from actuator_lti.types import Complexes, Floats
from analyses.linear.loop_figures import LoopFigures
from analyses.validation.row import WITHIN, Row, judged
from nonlinear import Tangent
from nonlinear.bench.lifted import GRID, eigenvalues, relative, sized

SURE = 10.0  # times the stated error
RESOLVED = 1e-4  # of a response: a tangent that is worse proves nothing
BESIDE = 1e-6  # of a margin: where the pole has to lie on either side of the circle
DB = 20.0 / np.log(10.0)  # of a relative change
ROUNDING = 1e-12  # of the norm of A, that an eigenvalue is computed with
NEWTON_STEPS = 25
LEAST_ANGLE = 1e-12  # that of z = 1
MOST_LOG = 70.0  # of a gain


@dataclass(frozen=True, kw_only=True)
class Place:
    """A loop or a path in both writings: predictions are by the linear one."""

    name: str
    condition: str  # the motion that it is tested on, in words
    tangent: Tangent
    predicted: Callable[[Complexes], Complexes]  # T at points z of the place's own rate
    poles: Complexes = field(default_factory=lambda: np.empty(0, complex))  # over one base period
    figures: LoopFigures | None = None  # of a loop; its margins are judged where it is not periodic
    exact: ExactMargins | None = None  # of a break point with all loops closed
    critical: Callable[[float], Complexes] | None = None  # eigenvalues over one base period at a gain
    # Tangent under a longer computing delay, what gives its poles over one base period; at the voltage
    delayed: Callable[[float], tuple[Tangent, Callable[[], Complexes]]] | None = None
    quantity: str = "response"  # name of the row that judges the response

    @property
    def within(self) -> float:
        """Relative difference that is agreement, by the error stated of the whole response."""
        return max(WITHIN, SURE * self.tangent.stated_error)

    def within_at(self, angle: float) -> float:
        """The same of the response at an angle a sample: a faint or a sharp part is known less well."""
        z = np.array([np.exp(1j * angle)])
        size = float(np.abs(self.tangent.closed(z))[0])
        return max(WITHIN, SURE * float(self.tangent.error_at(z)[0]) / max(size, 1e-300))

    def judged(self, name: str, predicted: float | None, found: float | None, within: float, scale: float,
               unit: str, because: str = "") -> Row:  # fmt: skip
        """A row, ``scale`` times ``within`` allowed; not proven where the tangent is too coarse."""
        proven = within <= RESOLVED
        why = because if proven else f"{because}; stated error of the tangent there {within / SURE:.1e}"
        return judged(
            name, self.name, predicted, found, within * scale, unit=unit, because=why.lstrip("; "),
            condition=self.condition, resolved=proven,
        )  # fmt: skip


def small_signal(place: Place) -> list[Row]:
    rows = [_response(place)]
    if place.poles.size:
        rows.append(_poles(place))
    if place.exact is not None and place.exact.stable:
        rows += _exact_margins(place, place.exact)
    if place.figures is not None:
        rows += _loop_margins(place, place.figures)
        rows += _figures(place, place.figures)
    return rows


def _response(place: Place) -> Row:
    """The response at the grid and at every figure's own frequency."""
    angles = np.unique(np.concatenate([GRID, [x for x in _marks(place) if 0.0 < x < pi]]))
    z = np.exp(1j * angles)
    wanted = place.predicted(z)
    off = relative(place.tangent.closed(z), wanted)
    within = np.maximum(WITHIN, SURE * place.tangent.error_at(z) / sized(wanted))
    k = _worst(off, within)
    where = f"worst at {angles[k] / (2.0 * pi * place.tangent.hold_s):.3g} Hz, of {angles.size} frequencies"
    row = place.judged(place.quantity, 0.0, float(off[k]), float(within[k]), 1.0, "1", where)
    return replace(row, predicted=None, found=None, error=float(off[k]))


def _marks(place: Place) -> list[float]:
    """Angles a sample at which the loop has figures."""
    if place.figures is None:
        return []
    figures, hold = place.figures, place.tangent.hold_s
    at = [gain.frequency_rad_s for gain in figures.margins.gain_margins]
    at += [phase.frequency_rad_s for phase in figures.margins.phase_margins]
    if figures.bandwidth is not None:
        band = figures.bandwidth
        at += [x for x in (band.minus3db_rad_s, band.minus90deg_rad_s, band.resonance_rad_s) if x]
    if figures.peaks is not None:
        at += [figures.peaks.sensitivity_rad_s, figures.peaks.complementary_rad_s]
    return [x * hold for x in at]


def _poles(place: Place) -> Row:
    """Each predicted pole beside the tangent's nearest eigenvalue, by their rates."""
    t = place.tangent
    A, scale = balanced(t.A)
    found, errors, sharp = eigenvalues(A, t.entry_errors[: len(A), : len(A)] / scale[:, None] * scale)
    rounding = ROUNDING * float(np.linalg.norm(A)) / sharp
    poles = place.poles[np.abs(place.poles) > 0.0]
    nearest = np.argmin(np.abs(found - poles[:, None]), axis=1)
    resolved = rounding[nearest] <= WITHIN * np.abs(poles)
    poles, k = poles[resolved], nearest[resolved]
    words = f"{poles.size} of {place.poles.size} poles resolved in double precision"
    off, within = 0.0, WITHIN
    if poles.size:
        size = np.abs(poles) * (np.abs(np.log(poles)) + rounding[k] / (WITHIN * np.abs(poles)))
        each, allowed = np.abs(found[k] - poles) / size, np.maximum(WITHIN, SURE * errors[k] / size)
        n = _worst(each, allowed)
        off, within = float(each[n]), float(allowed[n])
        words += f"; worst at |z| = {abs(poles[n]):.6g} over {t.period_s:.3g} s"
    row = place.judged("poles", 0.0, off, within, 1.0, "1", words)
    return replace(row, predicted=None, found=None, error=off)


def _worst(off: Floats, within: Floats) -> int:
    """Which difference is the farthest out; where all are within, but not all resolved, the least known."""
    k = int(np.argmax(off / within))
    return int(np.argmax(within)) if off[k] <= within[k] and np.max(within) > RESOLVED else k


@dataclass(frozen=True)
class _Crossing:
    """A closed-loop pole on the circle: gain, angle over a base period, and where it goes with the gain."""

    gain: float
    angle: float
    outward: float  # how far outside the circle it lies for a relative change of the gain of 1
    error: float | None = None  # of the gain, relative, where not that of the response


def _crossing(t: Tangent, gain: float, angle: float) -> _Crossing | None:
    """The crossing nearest to a gain and an angle, by Newton's method: there the gain of a pole is real."""
    if angle < LEAST_ANGLE and (t.at_rest or abs(nearest_pole(t.A, 1.0) - 1.0) <= ROUNDING):
        return _crossing_at_rest(t, gain)

    def at(turned: float) -> tuple[complex, complex]:
        """The gain nearest to the one asked, and its slope over the angle."""
        z = complex(np.exp(1j * turned))
        whole, slope = t.lifted(z)
        if not np.isfinite(whole).all():
            return complex(np.nan), complex(np.nan)
        values, left, right = eig(whole, left=True)
        gains = 1.0 - 1.0 / np.where(values == 0.0, np.nan, values)
        if np.isnan(gains).all():
            return complex(np.nan), complex(np.nan)
        k = int(np.nanargmin(np.abs(gains - gain)))
        x, y = right[:, k], left[:, k].conj()
        return complex(gains[k]), complex(1j * z * (y @ slope @ x) / (y @ x) / values[k] ** 2)

    for _ in range(NEWTON_STEPS):
        now, slope = at(angle)
        if min(angle, abs(angle - pi)) < LEAST_ANGLE or slope.imag == 0.0 or not np.isfinite(slope):
            break
        move = -now.imag / slope.imag
        if abs(move) < 1e-14 * angle:
            break
        angle += float(np.clip(move, -0.5 * angle, 0.5 * (pi - angle)))
    if not np.isfinite(now) or abs(now.imag) > RESOLVED * abs(now):
        return None
    z = complex(np.exp(1j * angle))
    change = 1j * z / slope  # of the pole with the gain
    return _Crossing(now.real, angle, now.real * (z.conjugate() * change).real)


def _crossing_at_rest(t: Tangent, gain: float) -> _Crossing | None:
    """The gain at which a real pole passes 1, beside modes at rest that no gain moves, by Newton's method.

    The product of all (pole - 1) is smooth also where another slow pole lies beside the one that passes.
    """

    def at(log_gain: float) -> tuple[Complexes, Floats]:
        poles, errors = t.poles_at(float(np.exp(log_gain)))
        return poles - 1.0, errors

    now = float(np.log(gain))
    for _ in range(NEWTON_STEPS):
        from_rest, errors = at(now)
        inside, outside = (float(np.prod(at(now + side)[0]).real) for side in (-BESIDE, BESIDE))
        slope = (outside - inside) / (2.0 * BESIDE)
        if not slope and np.min(np.abs(from_rest)) <= ROUNDING:
            return _Crossing(gain, 0.0, 0.0)  # the gain moves it by less than rounding
        move = -float(np.prod(from_rest).real) / slope if slope else np.inf
        if not abs(now + move) < MOST_LOG:
            return None
        now += move
        if abs(move) < 1e-14:
            break
    passing = int(np.argmin(np.abs(from_rest)))
    rate = slope / float(np.prod(np.delete(from_rest, passing)).real)
    return _Crossing(float(np.exp(now)), 0.0, rate, float(errors[passing]) / max(abs(rate), 1e-300))


def _gain_row(place: Place, name: str, ratio: float, angle: float, outward: int | None) -> Row:
    """One gain margin: where the tangent's pole crosses, and whether it goes ``outward`` (1, -1) there."""
    t, scale = place.tangent, max(ratio, abs(ratio - 1.0))  # what T = -1/(K - 1) moves K by, at least K
    found = _crossing(t, ratio, angle)
    if found is None:
        return place.judged(name, ratio, None, place.within, scale, "1", "no closed-loop pole crosses there")
    if not found.outward:
        words = "the gain moves the pole at z = 1 by less than rounding"
        row = place.judged(name, ratio, None, place.within, scale, "1", words)
        return replace(row, verdict=Verdict.NOT_PROVEN)
    if found.error is None:
        within = place.within_at(found.angle / t.B.shape[1])
    else:
        within = max(WITHIN, SURE * found.error * ratio / scale)
    hertz = found.angle / (2.0 * pi * t.period_s)
    side = BESIDE * found.outward
    words = f"{hertz:.6g} Hz; pole beside the circle by {-side:+.1e}, {side:+.1e}"
    row = place.judged(name, ratio, found.gain, within, scale, "1", words)
    if outward is not None and row.error < 0.1 * BESIDE * ratio and outward * side < 0.0:
        return replace(row, verdict=Verdict.NOT_MET, because=f"{words}: it crosses the other way")
    return row


def _exact_margins(place: Place, exact: ExactMargins) -> Iterator[Row]:
    """Gain limits with all loops closed, up and down, and the computing delay at the voltage."""
    assert place.critical is not None
    gains = (("gain_margin_up", exact.gain_upper, 1), ("gain_margin_down", exact.gain_lower, -1))
    for name, gain, outward in gains if place.figures is None else ():  # else they are among the loop's own
        if 0.0 < gain < np.inf:
            poles = place.critical(gain)
            pole = poles[int(np.argmin(np.abs(np.abs(poles) - 1.0)))]
            # One without its conjugate is real: a double one with the mode at rest, which rounding split
            angle = np.angle(pole if pole.conjugate() in poles else pole.real)
            yield _gain_row(place, name, gain, float(abs(angle)), outward)
    delay_s = exact.delay_s  # lengthened to either side of this the critical pole lies inside, outside
    if delay_s is None or not np.isfinite(delay_s) or place.delayed is None:
        return
    outside, poles_there = place.delayed(delay_s * (1.0 + BESIDE))
    critical = max(poles_there(), key=abs)
    inside, _ = place.delayed(delay_s * (1.0 - BESIDE))
    sizes = [abs(nearest_pole(each.A, critical)) for each in (inside, outside)]
    rates = np.log(sizes)
    found = delay_s * (1.0 - BESIDE + 2.0 * BESIDE * float(-rates[0] / (rates[1] - rates[0])))
    words = f"spectral radius beside it {sizes[0] - 1.0:+.1e}, {sizes[1] - 1.0:+.1e}"
    yield place.judged("delay_margin", delay_s, found, place.within, delay_s, "s", words)


def nearest_pole(A: Floats, pole: complex) -> complex:
    poles = np.linalg.eigvals(balanced(A)[0])
    return complex(poles[int(np.argmin(np.abs(poles - pole)))])


def _loop_margins(place: Place, figures: LoopFigures) -> Iterator[Row]:
    """Every gain and phase margin of a loop with the outer ones open."""
    hold = place.tangent.hold_s
    for margin in figures.margins.gain_margins:
        yield _gain_row(place, "gain_margin", margin.ratio, margin.frequency_rad_s * hold, None)
    for phase in figures.margins.phase_margins:
        z = np.array([np.exp(1j * phase.frequency_rad_s * hold)])
        seen = complex(place.tangent.open(z)[0])
        turned = seen / -np.exp(1j * np.radians(phase.deg))
        off = degrees(float(np.angle(turned)))
        error = max(degrees(abs(abs(turned) - 1.0)), abs(off))
        within, scale = place.within_at(phase.frequency_rad_s * hold), degrees(max(1.0, abs(1.0 + seen)))
        words = f"{phase.frequency_rad_s / (2.0 * pi):.6g} Hz; |L| = 1 {abs(turned) - 1.0:+.1e}"
        row = place.judged("phase_margin", 0.0, error, within, scale, "deg", words)
        yield replace(row, predicted=phase.deg, found=phase.deg + off)


def _figures(place: Place, figures: LoopFigures) -> Iterator[Row]:
    """Bandwidths, resonance and peaks: each where it is predicted."""
    band, peaks, t = figures.bandwidth, figures.peaks, place.tangent
    if band is not None and figures.of_feedback:
        level = abs(band.dc_gain) / np.sqrt(2.0)
        yield from _fall(place, "bandwidth", band.minus3db_rad_s, lambda T: np.log(np.abs(T) / level))
        at = band.minus90deg_rad_s
        yield from _fall(place, "bandwidth_90deg", at, lambda T: np.angle(T * 1j / band.dc_gain))
    if peaks is None:
        return
    for name, at, value, read in (
        ("sensitivity_peak", peaks.sensitivity_rad_s, peaks.sensitivity_db, lambda T: 1.0 - T),
        ("complementary_peak", peaks.complementary_rad_s, peaks.complementary_db, lambda T: T),
    ):
        if not 0.0 < at * t.hold_s <= pi:
            continue
        T = t.closed(np.array([np.exp(1j * at * t.hold_s)]))
        seen = 20.0 * float(np.log10(np.abs(read(T))[0]))
        lever = float(np.abs(T)[0] / np.abs(read(T))[0])
        yield place.judged(name, value, seen, place.within_at(at * t.hold_s), DB * max(lever, 1.0), "dB")


def _fall(place: Place, name: str, at: float | None, off: Callable[[Complexes], Floats]) -> Iterator[Row]:
    """The frequency at which ``off`` of T is zero, by one Newton step from the predicted one."""
    hold = place.tangent.hold_s
    if at is None or not 0.0 < at * hold < pi:
        return
    near = np.exp(1j * at * hold * np.array([1.0, 1.0 - 1e-5, 1.0 + 1e-5]))
    now = float(off(place.tangent.closed(near[:1]))[0])
    low, high = off(place.predicted(near))[1:]
    slope = float(high - low) / 2e-5  # over the relative frequency
    hertz = at / (2.0 * pi)
    if slope == 0.0:
        return
    found, scale = hertz * (1.0 - now / slope), hertz * (1.0 + 1.0 / abs(slope))
    yield place.judged(name, hertz, found, place.within_at(at * hold), scale, "Hz")
