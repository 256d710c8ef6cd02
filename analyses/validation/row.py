"""One check of a validation: what is predicted, what the simulator shows, and whether the two agree."""

from dataclasses import dataclass
from math import inf, isfinite

from actuator_lti.asked.verdict import Verdict

WITHIN = 1e-6  # of a value, a response, a margin


@dataclass(frozen=True, kw_only=True)
class Row:
    """One prediction beside what the simulator shows of it."""

    name: str  # quantity: "response", "gain_margin", "breakaway_torque", ...
    loop: str  # stage, break point, "command", "load", or "drive"
    unit: str = ""  # of the predicted and found value
    predicted: float | None = None  # ``None`` where several numbers are judged (a response)
    found: float | None = None
    error: float = 0.0  # difference; in ``unit``, relative where both values are ``None``
    allowed: float = 0.0
    verdict: Verdict = Verdict.MET  # not proven: the simulator's own accuracy does not suffice
    because: str = ""
    condition: str = ""  # on which motion

    @property
    def key(self) -> tuple[str, str, str]:
        """What the row judges: the same in every design."""
        return self.loop, self.name, self.condition

    def __str__(self) -> str:
        known = self.found is not None and self.predicted is not None
        values = f" predicted {self.predicted:.6g}, found {self.found:.6g} {self.unit}" if known else ""
        words = f"error {self.error:.2g}, allowed {self.allowed:.2g}"
        return f"{self.loop} {self.name}:{values} {self.verdict}; {words}"


def judged(
    name: str, loop: str, predicted: float | None, found: float | None, allowed: float, *,
    resolved: bool = True, **words: str,
) -> Row:  # fmt: skip
    """Judge one number: both within ``allowed`` or both absent; ``resolved``: a wrong one would be told."""
    if predicted is None or found is None:
        error = 0.0 if predicted is found else inf
    else:
        error = abs(found - predicted) if isfinite(found) else inf
    verdict = Verdict.of(error <= allowed) if resolved else Verdict.NOT_PROVEN
    return Row(
        name=name, loop=loop, predicted=predicted, found=found, error=error, allowed=allowed, verdict=verdict,
        **words,
    )  # fmt: skip
