"""A drive and the model of it, on the bench without what a question does not ask for."""

from dataclasses import dataclass, replace
from math import inf, isfinite
from typing import Any

from actuator_lti.design.model import Command, Design, Instruments, Limits
from analyses.validation.row import Row, judged
from nonlinear.rows import Rows

WITHIN = 1e-6  # of a value


LIFTED = Limits(voltage_V=inf)


def only(**limits: Any) -> Limits:
    """These limits, the others lifted."""
    return replace(LIFTED, **limits)


@dataclass(frozen=True)
class Pair:
    """A design and the model of it, with what a row of either needs."""

    design: Design
    model: Design

    def rows(self, limits: Limits = LIFTED, **changes: object) -> Rows:
        """A row of the design on the bench, at rest, with these limits alone."""
        bare = replace(self.design, limits=limits, supply=None, command=Command(), instruments=Instruments())
        rows = Rows.of(replace(bare, **changes))  # type: ignore[arg-type]
        rows["torque_filters"] = 0.0  # their gain at once is that of small signals
        return rows

    @property
    def speed_unit(self) -> str:
        return "m/s" if self.design.axis == "linear" else "rad/s"

    def judged(self, name: str, predicted: float, found: float | None, unit: str, condition: str) -> Row:
        """A row that is exact but for rounding; an absent limit is predicted as none."""
        wanted = predicted if isfinite(predicted) else None
        seen = None if found is None or not isfinite(found) else found
        return judged(name, "drive", wanted, seen, WITHIN * abs(predicted) if wanted else 0.0, unit=unit,
                      condition=condition)  # fmt: skip
