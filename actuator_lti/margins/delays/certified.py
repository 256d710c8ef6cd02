"""Margins under exact delays by certified intervals: crossings, unstable poles, distances to -1."""

import math

from flint import acb, arb, ctx

from actuator_lti.errors import NumericalError
from actuator_lti.margins.assemble import Crossing, Figures, Place, assembled
from actuator_lti.margins.delays.axis import GAIN, IMAGINARY, NOWHERE, Axis, smallest, turn, zeros
from actuator_lti.margins.delays.exact import ExactDelayLoop
from actuator_lti.margins.distances import DISK, MODULUS
from actuator_lti.margins.exact.decided import ACROSS, Lists, Shared, hidden_notes, shared
from actuator_lti.margins.given import ULP
from actuator_lti.margins.results import StabilityMargins
from actuator_lti.margins.single import Agreement
from actuator_lti.margins.trust import TOUCH

_BITS = 128
_UNDER_ONE = 0.9
_FLOOR = 0.01  # gain below which no crossing of the real axis is listed: 40 dB
_AT_REST = 1e-3  # how far L has moved from its value at rest where a crossover is one of its own
_METHOD = "zeros of real functions of the axis, parted by intervals in certified arithmetic"
_REASON = f"certified intervals on the exact delays; {ULP} ulp of the entries change nothing"


def certified_delayed_margins(
    loops: tuple[ExactDelayLoop, ...],
    delay_s: float,
    band: tuple[float, float] | None,
    start: StabilityMargins | None = None,
) -> StabilityMargins:
    """All margins of a loop with exact delays and its neighbours 8 ulp away, by certified intervals.

    ``delay_s`` is that in series, for the result; the distances of ``start``, an answer in double precision,
    are where the search for smaller ones begins. `NumericalError`: something could not be determined.
    """
    with ctx.workprec(_BITS):
        axes = [Axis(loop) for loop in loops]
        counts = [_unstable(axis) for axis in axes]
        found, figures = Shared((), (), problem=ACROSS), None
        if len(set(counts)) == 1:
            found = shared(*(_crossings(axis, band) for axis in axes))
            if found.problem is not None:
                found = shared(*(_crossings(axis, band, merge=True) for axis in axes))
        if found.problem is None:
            near = zip((MODULUS, DISK), _known(start), strict=True)
            figures = Figures(found.gains, found.reals, [smallest(axes[0], d, known) for d, known in near])
    hidden, listed_to = loops[0].hidden, loops[0].beyond(_FLOOR)
    unstable = counts[0] + hidden.right  # proven by the turn of N + D; double precision's stands beside it
    second = None if start is None else start.agreement.unstable_nyquist
    tail = (f"gain margins above 40 dB beyond {listed_to:.4g} rad/s are not listed",)
    return assembled(
        None,
        Agreement(unstable, second if second == unstable else None) if figures else Agreement(None, None),
        figures,
        method=_METHOD,
        notes=(*hidden_notes(hidden), *found.notes, *(tail if band is None else ())),
        evidence="certified",
        reason=found.problem or _REASON,
        delay_s=delay_s,
        listed_to=listed_to,
        band_rad_s=band,
        hidden_border=hidden.on_border,
    )


def _known(start: StabilityMargins | None) -> list[Place]:
    """Both distances as double precision has them, each with its frequency."""
    if start is None or start.modulus_frequency_rad_s is None or start.disk_margin is None:
        return [NOWHERE] * 2
    disk, modulus = start.disk_margin, start.modulus_margin or 0.0
    return [(modulus, start.modulus_frequency_rad_s), (disk.alpha, disk.frequency_rad_s)]


def _crossings(axis: Axis, band: tuple[float, float] | None, merge: bool = False) -> Lists:
    """Gain crossovers and crossings of the negative real axis, up to where they are listed.

    With ``merge`` a gain of one at zero frequency, within `TOUCH`, is no crossover; that of the given doubles
    may lie at any frequency below the loop's own.
    """
    loop = axis.loop
    top = loop.beyond(_UNDER_ONE)
    far = loop.beyond(_FLOOR) if band is None else max(band[1], top)
    gains = [_crossing(axis, x) for x in zeros(axis, GAIN, axis.edges(loop.lowest, top))]
    reals = [_crossing(axis, x) for x in zeros(axis, IMAGINARY, axis.edges(loop.lowest, far))]
    reals = [c for c in reals if c.L.real < 0.0 and (band is not None or abs(c.L) >= _FLOOR)]
    N0, D0 = (part[0] for part in loop.at_rest)
    at_rest = float(arb(N0 / D0)) if D0 != 0 else math.inf
    if at_rest < 0.0:
        reals = [Crossing(0.0, complex(at_rest)), *reals]
    if merge and abs(at_rest - 1.0) <= TOUCH:
        gains = [c for c in gains if abs(c.L - at_rest) > _AT_REST]
    return tuple(gains), tuple(reals)


def _crossing(axis: Axis, x: arb) -> Crossing:
    N, D = axis.values(x)
    L = N / D
    if L.rel_accuracy_bits() < 56:
        raise NumericalError(f"the crossing near {float(x.mid()):.10g} rad/s is not separated from a pole")
    return Crossing(float(x.mid()), complex(L))


def _unstable(axis: Axis) -> int:
    """Zeros of N + D in the right half plane, from the turn of N + D along the axis (Mikhailov, retarded)."""
    loop = axis.loop
    edges = axis.edges(loop.lowest, loop.beyond(_UNDER_ONE))
    end = sum(axis.values(arb(edges[-1])), acb(0)) / (acb(0, edges[-1]) ** loop.degree * loop.lead)
    count = arb(loop.degree) / 2 - (turn(axis, edges) - end.log().imag) / arb.pi()
    whole = count.unique_fmpz()
    if whole is None:
        raise NumericalError("the number of unstable poles could not be determined")
    return int(whole)
