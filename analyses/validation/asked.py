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
    """Check every prediction against the derivative of the nonlinear simulator, and show where it ends.

    Each row is met, not met or not proven. Exit status 1 if one is not met, or not proven and not waived, if
    the drive does not come to rest, or if a command within full deflection makes it diverge. The page
    (--out), --json and --large also show what is large, starts from rest, or is shaken by counts.

    Try: actuator-lti validate joint --quick, or actuator-lti validate fin --out out/fin
    """

    quick: Annotated[bool, Option("Checks and verdict only, on the page and in JSON, too.")] = False
    large: Annotated[
        bool, Option("What is large, starts from rest or is shaken by counts, on the terminal, too.")
    ] = False

    @classmethod
    def of(cls, design: Design, *, quick: bool = False, large: bool = False) -> Settings:
        """The settings of `analyses.validation.validate`."""
        from analyses.validation.settings import QUICK, Settings

        return Settings() if large and not quick else QUICK
