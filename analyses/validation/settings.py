"""What is asked of a validation: how much it does beside its checks, which are always made."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Literal, get_args

from actuator_lti.start.public_arguments import asked
from analyses.request import Option

if TYPE_CHECKING:
    from actuator_lti.design.model import Design

Finding = Literal[
    "injected sweep", "margins by amplitude", "motion from rest", "large signals", "friction effects",
    "specification",
]  # fmt: skip
FINDINGS: tuple[Finding, ...] = get_args(Finding)


@asked
@dataclass(frozen=True, kw_only=True)
class Settings:
    """What a validation looks at beside its checks; the defaults are those of the report."""

    own: bool = True  # whether it comes to rest, and what large commands make of it; in the verdict
    findings: tuple[Finding, ...] = FINDINGS
    rest_frequencies: int = 16  # of the sweep from rest
    map_counts: tuple[int, int] = (17, 28)  # amplitudes and frequencies of the large-signal map


QUICK = Settings(findings=())  # all that the verdict is made of, without findings
CHECKS = Settings(own=False, findings=())  # the checks alone


@asked
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
        return Settings() if large and not quick else QUICK
