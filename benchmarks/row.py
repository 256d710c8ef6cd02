"""One line of the benchmark table."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class Row:
    """A measured figure beside its target; ``comparison`` says which side of the target is good."""

    name: str
    measured: float
    unit: str
    target: float | None = None
    comparison: Literal["<=", ">="] = "<="
    note: str = ""

    @property
    def met(self) -> bool | None:
        """Whether the target is met; ``None`` for a figure without one."""
        if self.target is None:
            return None
        return bool(self.measured <= self.target if self.comparison == "<=" else self.measured >= self.target)
