"""What a step of a drive ends in: one step, one word (`nonlinear.settling.rest`), for all who ask."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from actuator_lti.asked.verdict import Verdict
from actuator_lti.design.model import Design
from nonlinear.rows import Rows
from nonlinear.settling.rest import Rest, judge

SMALL = 1e-3  # of full deflection: a step beside those that the design asks for
NOTICED = 1e-6  # of full deflection: a smaller swing is listed, it fails nothing


@dataclass(frozen=True)
class Settling:
    """A step from rest at zero, waited for.

    Attributes
    ----------
    amplitude_rad, load_Nm : float
        The step and the load torque, both there from the start.
    rest : Rest
        What it ends in.
    """

    amplitude_rad: float
    load_Nm: float
    rest: Rest

    @property
    def hunting(self) -> bool:
        """Whether the drive does not come to rest."""
        return not self.rest.comes_to_rest

    @property
    def swing_rad(self) -> float:
        """Half the span of the output or of the motor at the output's side, whichever is larger."""
        return max(self.rest.amplitude, self.rest.motor_amplitude)


def settle(design: Design, load_Nm: float, step_rad: float) -> Settling:
    """Step and wait; the command is of the position loop.

    Examples
    --------
    >>> from actuator_lti.design import load_design
    >>> settle(load_design("ilr33-amber"), 8.0, 0.01).rest.verdict
    'at rest'
    """
    rows = Rows.of(design)
    rows["load"] = load_Nm
    rows.step("command", step_rad)
    rest = judge(rows.running())
    assert rest is not None  # a step and a load that stay
    return Settling(step_rad, load_Nm, rest)


def settlings_of(design: Design) -> tuple[Settling, ...]:
    """What steps of the drive as it is end in, small to full, without load and at every named one."""
    asked, full = design.validation, design.validation.full_deflection_rad
    loads = dict.fromkeys((0.0, *asked.loads_Nm))
    shares = sorted({SMALL, *asked.amplitude_fractions})
    return tuple(settle(design, load, share * full) for load in loads for share in shares)


def noticed(design: Design, settlings: Iterable[Settling]) -> Settling | None:
    """The largest motion of the drive as it is that does not come to rest; None: it rests."""
    least = NOTICED * design.validation.full_deflection_rad
    return largest_swing(one for one in settlings if one.swing_rad >= least)


def verdict_of(swing: Settling | None) -> Verdict:
    """Whether a drive comes to rest; what still moves at the end of the work is not proven."""
    return Verdict.of(True if swing is None else None if swing.rest.verdict == "still moving" else False)


def largest_swing(settlings: Iterable[Settling]) -> Settling | None:
    """The one of those that do not come to rest that moves most, known ends first; None: all do."""
    hunting = (one for one in settlings if one.hunting)
    known = ("limit cycle", "diverging")
    return max(hunting, key=lambda one: (one.rest.verdict in known, one.swing_rad), default=None)


def words(rest: Rest, factor: float, unit: str) -> str:
    """Say what a motion ended in; ``factor`` takes the command's SI unit to ``unit``.

    Examples
    --------
    >>> from actuator_lti.design import load_design
    >>> words(settle(load_design("ilr33-amber"), 0.0, 0.01).rest, 57.3, "deg")
    'comes to rest'
    """
    if rest.verdict == "at rest":
        return "comes to rest"
    if rest.verdict == "diverging":
        return "diverges"
    size = f"±{factor * rest.amplitude:.3g} {unit}"
    if rest.motor_amplitude > 1.05 * rest.amplitude:
        size += f" (motor ±{factor * rest.motor_amplitude:.3g} {unit})"
    if rest.verdict == "still moving":
        return f"still moving {rest.after_s:.3g} s later, by {size}"
    limits = f", {' and '.join(rest.limited)} limit acting" if rest.limited else ""
    seen = f"{rest.periods} periods seen{limits}"
    return f"limit cycle of {size} at {rest.frequency_hz:.3g} Hz ({seen})"
