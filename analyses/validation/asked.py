"""What is asked of a validation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

from analyses.request import Option

if TYPE_CHECKING:
    from actuator_lti.design.model import Design
    from analyses.validation.settings import Settings


@dataclass(frozen=True, kw_only=True)
class Asked:
    """How much is looked at beside the checks."""

    quick: Annotated[
        bool, Option(words="All checks; a coarser map, no margins by amplitude, no friction.")
    ] = False

    @classmethod
    def of(cls, design: Design, *, quick: bool = False) -> Settings:
        """The settings of `analyses.validation.validate`."""
        from analyses.validation.settings import QUICK, Settings

        return QUICK if quick else Settings()
