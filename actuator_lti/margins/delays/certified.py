"""Margins under exact delays by certified intervals: crossings, unstable poles, distances to -1."""

import math

from flint import acb, arb, fmpq

from actuator_lti.errors import NumericalError
from actuator_lti.margins.assemble import FARTHEST, Crossing, Figures, assembled
from actuator_lti.margins.delays.axis import IMAGINARY, NOWHERE, Axis, Form, smallest, turn, zeros
from actuator_lti.margins.delays.exact import ExactDelayLoop
from actuator_lti.margins.distances import DISK, MODULUS, Distance, Place
from actuator_lti.margins.exact.decided import ACROSS, Crossings, Shared, counted, hidden_notes, settled
from actuator_lti.margins.results import StabilityMargins
from actuator_lti.margins.single import Agreement
from actuator_lti.margins.tail import listed, tail_note
from actuator_lti.margins.trust import TOUCH
from actuator_lti.systems.precision import precision

_BITS = 128
_UNDER_ONE = 0.9
_FLOOR = 0.01  # gain: margins are listed up to where L stays below
_BELOW = 1.0 - 1e-12
_AT_REST = 1e-3  # how far L has moved from its value at rest where a crossover is one of its own
_METHOD = "zeros of real functions of the axis, parted by intervals in certified arithmetic"
_REASON = "certified intervals on the exact delays"


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
    with precision(_BITS):
        axes = [Axis(loop) for loop in loops]
        counts = [_unstable(axis) for axis in axes]
        notes = counted(counts)
        found, figures = Shared((), ()), None
        lists = [_reals(axis, band) for axis in axes]
        if notes is not None:
            reals = [each[0] for each in lists]
            found = settled(lambda merge: [(_gains(a, merge), r) for a, r in zip(axes, reals, strict=True)])
            near = [smallest(axes[0], d, _known(d, found.reals, start)) for d in (MODULUS, DISK)]
            figures = Figures(found.gains, found.reals, near)
    hidden, (_, listed_to, gain) = loops[0].hidden, lists[0]
    tail = tail_note(listed_to, gain) if band is None else ()
    unstable = counts[0] + hidden.right  # proven by the turn of N + D; double precision's stands beside it
    second = None if start is None else start.agreement.unstable_nyquist
    return assembled(
        None,
        Agreement(unstable, second if second == unstable else None) if figures else Agreement(None, None),
        figures,
        method=_METHOD,
        notes=(*hidden_notes(hidden), *found.notes, *(notes or ()), *tail),
        evidence="certified",
        reason=f"{_REASON}; {found.moved_text}" if figures else ACROSS,
        delay_s=delay_s,
        listed_to=listed_to,
        band_rad_s=band,
        hidden_at_limit=hidden.at_limit,
    )


def _known(distance: Distance, reals: Crossings, start: StabilityMargins | None) -> Place:
    """A small value of a distance: at a crossing, or as double precision has it."""
    places = [(distance.at(c.L), c.w) for c in reals]
    if start is not None and start.modulus_frequency_rad_s is not None and start.disk_margin is not None:
        modulus = start.modulus_margin or 0.0, start.modulus_frequency_rad_s
        disk = start.disk_margin.alpha, start.disk_margin.frequency_rad_s
        places.append(modulus if distance is MODULUS else disk)
    return min(places, default=NOWHERE)


def _gains(axis: Axis, merge: bool) -> Crossings:
    """Gain crossovers.

    With ``merge`` a gain of one at zero frequency, within `TOUCH`, is no crossover; that of the given doubles
    may lie at any frequency below the loop's own.
    """
    gains, at_rest = [_crossing(axis, x) for x in _passages(axis, 1.0)], _at_rest(axis)
    if merge and abs(at_rest - 1.0) <= TOUCH:
        gains = [c for c in gains if abs(c.L - at_rest) > _AT_REST]
    return tuple(gains)


def _reals(axis: Axis, band: tuple[float, float] | None) -> tuple[Crossings, float, float]:
    """Crossings of the negative real axis, up to where they are listed, and a gain that L is below beyond."""
    loop = axis.loop
    first = [Crossing(0.0, complex(at_rest))] if (at_rest := _at_rest(axis)) < 0.0 else []

    def search(to: float) -> tuple[Crossings, float]:
        found = [_crossing(axis, x) for x in zeros(axis, IMAGINARY, axis.edges(loop.lowest, to))]
        reals = tuple(c for c in found if c.L.real < 0.0)
        near = (min(abs(c.L), 1.0 / abs(c.L)) for c in reals if not c.out_of_sight)
        return (*first, *reals), max(near, default=0.0)

    def quiet(gain: float) -> float:
        return max((float(x.mid()) for x in _passages(axis, gain * _BELOW)), default=0.0)

    if band is not None:
        return search(max(band[1], loop.lowest))[0], band[1], 0.0
    return listed(search, quiet, loop.delay, _FLOOR, loop.beyond(1.0 / FARTHEST))


def _passages(axis: Axis, gain: float) -> list[arb]:
    """Where abs(L) passes a gain, in order; no delay of all of it changes that."""
    early, square = axis.loop.early, fmpq(*gain.as_integer_ratio()) ** 2
    edges = axis.edges(early.lowest, axis.loop.beyond(_UNDER_ONE * gain))
    return zeros(Axis(early), Form(fmpq(1), fmpq(0), -square), edges)


def _at_rest(axis: Axis) -> float:
    N, D = (part[0] for part in axis.loop.at_rest)
    return float(arb(N / D)) if D != 0 else math.inf


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
