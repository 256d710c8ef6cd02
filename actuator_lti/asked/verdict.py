"""The three words for whatever is judged: met, not met, not proven; their colour, count and exit status.

Not proven is what cannot be judged. It does not let a command end with 0, unless it is waived (of what
records of a bench do not tell: unless something fails).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum
from typing import Literal

Role = Literal["pass", "fail", "warn", "info"]
"""What a page or a terminal colours by: green, red, amber, grey."""


class Verdict(StrEnum):
    """One of the three words; equal to its text.

    >>> Verdict.of(None), Verdict.of(True) == "met", str(Verdict.NOT_MET)
    (<Verdict.NOT_PROVEN: 'not proven'>, True, 'not met')
    """

    MET = "met"
    NOT_MET = "not met"
    NOT_PROVEN = "not proven"

    @classmethod
    def of(cls, passed: bool | Verdict | None) -> Verdict:
        """The word for the outcome of a comparison; ``None``: there was nothing to compare."""
        if isinstance(passed, Verdict):
            return passed
        return cls.NOT_PROVEN if passed is None else cls.MET if passed else cls.NOT_MET

    def role(self, *, waived: bool = False) -> Role:
        """The colour: amber where it is not proven, grey where that is waived."""
        if self is Verdict.NOT_PROVEN:
            return "info" if waived else "warn"
        return "pass" if self is Verdict.MET else "fail"

    def passes(self, *, waived: bool = False) -> bool:
        """Whether a command may end with status 0; a waiver is for what is not proven only."""
        return self is Verdict.MET or (waived and self is Verdict.NOT_PROVEN)


@dataclass(frozen=True, kw_only=True)
class Tally:
    """Verdicts counted; ``waived`` are those not proven that are waived, and not among ``not_proven``.

    >>> Tally.of([Verdict.MET, Verdict.NOT_PROVEN]).words("requirements")
    '1 of 2 requirements met, 1 not proven'
    >>> Tally.of([]).passes, Tally.of([]).role, Tally.of([]).words("requirements")
    (True, 'info', 'no requirements')
    """

    met: int = 0
    not_met: int = 0
    not_proven: int = 0
    waived: int = 0

    @classmethod
    def of(cls, verdicts: Iterable[Verdict], waived: Iterable[bool] | None = None) -> Tally:
        """Count verdicts, each with whether it is waived (none is, where left out)."""
        every = list(verdicts)
        excused = [False] * len(every) if waived is None else waived
        open_ = [own for one, own in zip(every, excused, strict=True) if one is Verdict.NOT_PROVEN]
        met, not_met = every.count(Verdict.MET), every.count(Verdict.NOT_MET)
        return cls(met=met, not_met=not_met, not_proven=open_.count(False), waived=open_.count(True))

    def __add__(self, other: Tally) -> Tally:
        return Tally(**{name: count + getattr(other, name) for name, count in vars(self).items()})

    @property
    def total(self) -> int:
        return self.met + self.not_met + self.not_proven + self.waived

    @property
    def verdict(self) -> Verdict:
        """The worst of all that is not waived; nothing at all is met."""
        if self.not_met:
            return Verdict.NOT_MET
        return Verdict.NOT_PROVEN if self.not_proven else Verdict.MET

    @property
    def passes(self) -> bool:
        return self.verdict.passes()

    @property
    def role(self) -> Role:
        """The colour of the whole: grey where there is nothing, or nothing but what is waived."""
        return self.verdict.role() if self.met or not self.passes else "info"

    def words(self, name: str) -> str:
        if not self.total:
            return f"no {name}"
        others = {"not met": self.not_met, "not proven": self.not_proven, "waived": self.waived}
        rest = "".join(f", {count} {word}" for word, count in others.items() if count)
        return f"{self.met} of {self.total} {name} met{rest}"
