"""Margins by exact arithmetic on the given doubles: certified, or withheld with the reason."""

from __future__ import annotations

import math
from dataclasses import replace

from actuator_lti.errors import InputError
from actuator_lti.margins.assemble import Figures, assembled, far_note, hidden_notes, out_of_sight
from actuator_lti.margins.distances import DISK, MODULUS
from actuator_lti.margins.exact.crossings import Findings
from actuator_lti.margins.exact.determined import FAR_DB, Settled, settled
from actuator_lti.margins.exact.extremes import smallest
from actuator_lti.margins.exact.loop import ExactLoop, exact_loop, neighbours
from actuator_lti.margins.given import ULP, Given
from actuator_lti.margins.results import Agreement, StabilityMargins

_METHOD = "roots of exact polynomials, isolated in certified intervals; no grid"
_MOVED = 1e-9


def certified_margins(given: Given) -> StabilityMargins:
    """All margins of a rational loop from the exact values of its doubles, see `stability_margins`.

    The answer is given where it is the same for neighbours of the data, each entry 8 ulp away.

    Raises
    ------
    InputError
        The closed loop is not well posed, or a pole on the stability boundary is cancelled.
    NumericalError
        The gain is one at every frequency.
    """
    loop = exact_loop(given)
    _refuse_ill_posed(loop)
    others = neighbours(given, loop)
    base = Findings(loop)
    return _margins(given, base, settled(base, [Findings(other) for other in others]))


def _refuse_ill_posed(loop: ExactLoop) -> None:
    above, below = (loop.N(1), loop.D(1)) if loop.sampled else (loop.N[loop.degree], loop.D[loop.degree])
    if below and abs(above + below) <= abs(below) * 2 * ULP // (1 << 53):
        raise InputError("1 + L is zero at infinite frequency: the closed loop is not well posed")


def _margins(given: Given, base: Findings, result: Settled) -> StabilityMargins:
    T = given.period_s

    def frequency(w: float) -> float:
        return w if T is None else 2.0 * math.atan(w) / T

    figures = None
    if result.problem is None:
        modulus, disk = (smallest(base.loop, distance) for distance in (MODULUS, DISK))
        figures = Figures(
            tuple(c.gain_margin(frequency(c.w)) for c in result.reals if not out_of_sight(c.L)),
            tuple(c.phase_margin(frequency(c.w)) for c in result.gains),
            (modulus[0], frequency(modulus[1])),
            (disk[0], frequency(disk[1])),
        )
    return assembled(
        T,
        Agreement(result.unstable, None, result.border),
        figures,
        method=_METHOD,
        notes=_notes(base, result),
        evidence="certified" if result.problem is None else "withheld",
        reason=result.problem or _reason(result),
        hidden_border=max(base.hidden.on_border, result.hidden_at_dc) + base.loop.hidden_at_end,
    )


def _reason(result: Settled) -> str:
    moved = f"move a crossing by {result.moved:.1g}" if result.moved > _MOVED else "change nothing"
    if result.border:
        return "exact arithmetic on the given doubles: poles lie exactly on the stability boundary"
    return f"exact arithmetic on the given doubles, certified roots; {ULP} ulp of the entries {moved}"


def _notes(base: Findings, result: Settled) -> tuple[str, ...]:
    hidden = base.hidden
    if result.hidden_at_dc > hidden.at_zero:  # one that the data do not tell from a mode at zero
        hidden = replace(hidden, at_zero=result.hidden_at_dc)
    notes = [
        *hidden_notes(hidden.at_zero, hidden.pairs, hidden.right),
        *far_note(sum(out_of_sight(c.L) for c in result.reals)),
    ]
    if result.dropped:
        notes.append(
            f"{result.dropped} crossing(s) of the real axis more than {FAR_DB:g} dB from -1 are left out: "
            "not resolved in double precision"
        )
    return tuple(notes)
