"""What is asked of the model against records."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from actuator_lti.errors import InputError
from analyses.request import Option


@dataclass(frozen=True, kw_only=True)
class Asked:
    """Records, and what drives the model."""

    records: Annotated[
        list[Path], Option("Records: CSV, .mat, or record files (TOML).", "RECORD...", argument=True)
    ]
    command: Annotated[
        str | None,
        Option(
            "Signal that drives the model: a recorded command (default: the outermost), or voltage "
            "(the motor's measured one).",
            "SIGNAL",
        ),
    ] = None
    error_limit: Annotated[
        float | None, Option("Error, of the motion about its mean, above which a signal fails.", "PERCENT")
    ] = None

    def __post_init__(self) -> None:
        """Refuse a negative limit."""
        if self.error_limit is not None and not self.error_limit >= 0.0:
            raise InputError(f"error_limit = {self.error_limit:g}: must be 0 or more")
