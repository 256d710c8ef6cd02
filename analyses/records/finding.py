"""One thing that was looked at in a record, and the levels at which it is believed."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field

from actuator_lti.errors import InputError

RATE_TOLERANCE = 0.02  # of speed over rate: above, no design is made; below, it widens the intervals
NO_CHANCE = 1e-3  # level at which chance is rejected
SURE = 4.0  # standard errors beyond which noise explains no difference: by chance in one look of 16 000
OVER = 1.2  # times a limit of the design that a recorded value may reach
FEW_ROWS = 1e-3  # of a record: single ones; of more the unit is wrong, not the row
ROWS = "rows of the file"
BAD_ROW = "bad rows, take them out of the file"


@dataclass(frozen=True)
class Finding:
    """One thing that was looked at."""

    subject: str
    passed: bool | None  # whether it agrees; None: not determined
    text: str
    unproven: bool = field(default=False, repr=False)  # not determined, so that it is open whether it agrees
    done: str = ""  # what was done about it where it does not agree: put right, or held by the intervals


def wrong_of(findings: Sequence[Finding]) -> str:
    """What contradicts, in words; empty where nothing does."""
    return "; ".join(f"{one.subject}: {one.text}" for one in findings if one.passed is False)


def left_out_of(findings: Mapping[str, Sequence[Finding]]) -> list[str]:
    """Sentences on rows that no result rests on, by record."""
    return [f"{name}: {one.text}." for name, each in findings.items() for one in each if one.subject == ROWS]


@contextmanager
def because(findings: Mapping[str, Sequence[Finding]]) -> Iterator[None]:
    """What is wrong with the records comes before what is refused inside."""
    try:
        yield
    except InputError as error:
        said = "; ".join(f"{name}: {why}" for name, one in findings.items() if (why := wrong_of(one)))
        raise InputError(f"{said}; so {error}") if said else error from None
