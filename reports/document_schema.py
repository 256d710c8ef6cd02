"""What a report.json must look like, so that a page or a PDF can be made of it: types, kinds, states.

Keys beyond these are allowed: a later version may say more. What a chart holds is for `reports.charts.data`.
"""

from __future__ import annotations

from functools import cache
from typing import Annotated, Any, Final, Literal, NotRequired

from pydantic import (
    AfterValidator,
    ConfigDict,
    Discriminator,
    Field,
    SkipValidation,
    Tag,
    TypeAdapter,
    ValidationError,
    with_config,
)
from typing_extensions import TypedDict

from actuator_lti.errors import InputError
from actuator_lti.files.reading import Tree, shown

SCHEMA: Final = "actuator-lti/report"
VERSION: Final = 2
STATUSES = ("pass", "fail", "warn", "info")

Status = Literal["pass", "fail", "warn", "info"]
Layout = Literal["wide", "half", "tall"]
Align = Literal["left", "right", "center"]
Severity = Literal["fail", "warn", "info"]
Judged = Literal["met", "not met", "not proven"]
Scalar = None | bool | int | float | str
Format = Annotated[str, Field(pattern=r"^(text|yesno|int|(fix|gain):1?[0-9]|(sig|short|ms):(1?[1-9]|10))$")]


class Mark(TypedDict):
    text: Scalar
    status: Status | Literal[""] | None


class State(TypedDict):
    text: str
    status: Status


Cell = Annotated[
    Annotated[Mark, Tag("mark")] | Annotated[Scalar, Tag("plain")],
    Discriminator(lambda value: "mark" if isinstance(value, dict) else "plain"),
]


def _row_state(row: Tree) -> Tree:
    if row.get("_status") not in (*STATUSES, "", None):
        raise ValueError(f"_status = {shown(row['_status'])}: allowed: {', '.join(STATUSES)}")
    return row


# by the keys of the columns; ``_status`` colours the row; ``_scale``: what its numbers were multiplied by to
# be shown in its unit, ``_unit`` the one that they have without
Row = Annotated[dict[str, Cell], AfterValidator(_row_state)]


GOES_ON = ("", "at")
"""Labels of columns that go on with the column before them."""


class Column(TypedDict):
    key: str
    label: str
    unit: str
    align: Align
    format: Format
    better: NotRequired[int]


class TableBlock(TypedDict):
    kind: Literal["table"]
    caption: str
    columns: list[Column]
    rows: list[Row]
    note: NotRequired[str]


class FigureBlock(TypedDict):
    """A figure: its chart (`reports.charts.data`) is drawn as it stands."""

    kind: Literal["figure"]
    figure: str
    chart: Tree
    caption: str
    alt: str
    layout: NotRequired[Layout]


class TextBlock(TypedDict):
    kind: Literal["text"]
    text: str


class FactItem(TypedDict):
    label: str
    value: Scalar
    unit: str
    format: NotRequired[Format]
    better: NotRequired[int]


class FactsBlock(TypedDict):
    kind: Literal["facts"]
    items: list[FactItem]


class _Asked(TypedDict):
    id: str
    label: str
    value: float | None
    limit: float | None
    comparison: str
    unit: str
    verdict: Judged


class VerdictItem(_Asked):
    distance: float | None
    waiver: str  # by what one that is not proven is waived, else empty
    source: str
    reason: str
    loop: NotRequired[str | None]
    quantity: NotRequired[str]
    gathers: NotRequired[Counts]  # the checks that it stands for, where these are several


class VerdictsBlock(TypedDict):
    kind: Literal["verdicts"]
    items: list[VerdictItem]
    what: NotRequired[str]


class DetailsBlock(TypedDict):
    kind: Literal["details"]
    title: str
    blocks: list[Block]


class GlanceFigure(TypedDict):
    """One figure of a loop on the first screen, with the limit that is nearest to it."""

    label: str
    value: Scalar
    unit: str
    format: Format
    limit: float | None
    comparison: str
    distance: float | None
    verdict: Judged | None
    spread: NotRequired[str]


class GlanceLoop(TypedDict):
    loop: str
    anchor: str
    stable: State
    figures: list[GlanceFigure]


class Finding(TypedDict):
    """One sentence that the reader of a drive must know."""

    severity: Severity  # fail: unfit as it is; warn: to be watched; info: good to know
    text: str  # a whole sentence, with the figure that it is about
    where: str  # the id of the section that shows it


class Weakest(TypedDict):
    """The margin of all views that has least left to its limit, in words."""

    label: str
    words: str
    status: Status
    move: NotRequired[str]


class Bar(_Asked):
    """A requirement on the first screen; ``band``: between which values its figure lies at the corners."""

    band: list[float] | None


class GlanceBlock(TypedDict):
    kind: Literal["glance"]
    loops: list[GlanceLoop]
    weakest: Weakest | None
    believed: NotRequired[str]
    linear: NotRequired[str]
    bars: NotRequired[list[Bar]]
    more_bars: NotRequired[int]
    findings: list[Finding]
    more: int


Block = Annotated[
    TableBlock | FigureBlock | TextBlock | FactsBlock | VerdictsBlock | DetailsBlock | GlanceBlock,
    Discriminator("kind"),
]


class Section(TypedDict):
    id: Annotated[str, Field(min_length=1)]
    title: str
    result: NotRequired[str]
    intro: str
    status: Status
    verdict: NotRequired[Judged]
    findings: NotRequired[list[Finding]]
    blocks: list[Block]


class Counts(TypedDict):
    met: int
    not_met: int
    not_proven: int
    waived: int


class Verdict(TypedDict):
    """The verdicts of the whole document: the worst of them, and the count of each kind."""

    verdict: Judged
    passed: bool
    parts: dict[str, Counts]
    failed_sections: NotRequired[list[str]]
    unproven_sections: NotRequired[list[str]]
    met_sections: NotRequired[list[str]]  # of documents of one analysis that judges no requirements


class Provenance(TypedDict):
    """By whom, of what and when it was made; more may stand."""

    version: NotRequired[str | None]
    time: NotRequired[str | None]
    commit: NotRequired[str | None]
    design_hash: NotRequired[str | None]


@with_config(ConfigDict(strict=True, extra="allow", allow_inf_nan=False))  # no NaN; more keys may stand
class Document(TypedDict):
    schema: Literal["actuator-lti/report"]
    version: Literal[2]
    kind: str
    title: str
    subtitle: str
    design: dict[str, Scalar]
    provenance: Provenance
    verdict: Verdict
    sections: list[Section]
    live: NotRequired[SkipValidation[Tree]]  # its scripts read it, no part of the document


@cache
def _reader() -> TypeAdapter[Document]:
    """Made with the first document: what a terminal shows needs none."""
    return TypeAdapter(Document)


def validate(made: Any, origin: str | None = None) -> None:
    """Refuse what is no document, in one line: the place, what stands there, what is allowed."""
    if not isinstance(made, dict) or made.get("schema") != SCHEMA:
        raise InputError(f"schema must be {SCHEMA!r}", where=origin)
    if made.get("version") != VERSION:
        found = shown(made.get("version"))
        raise InputError(f"version = {found}: this program reads version {VERSION}", where=origin)
    try:
        _reader().validate_python(made)
    except RecursionError:
        raise InputError("details within details: nested too deeply", where=origin) from None
    except ValidationError as error:
        first = error.errors(include_url=False, include_context=False)[0]
        found = "" if first["type"] == "missing" else f" = {shown(first['input'])}"
        words = f"{_place(first['loc'])}{found}: {first['msg'][:1].lower()}{first['msg'][1:]}"
        raise InputError(words, where=origin) from None


def _place(steps: tuple[int | str, ...]) -> str:
    """A place as people write it, without the names of the kinds that the union adds."""
    kinds = {"table", "figure", "text", "facts", "verdicts", "details", "mark", "plain"}
    made = ""
    for before, step in zip((None, *steps), steps, strict=False):
        if isinstance(step, int):
            made += f"[{step + 1}]"
        elif not (isinstance(before, int) and step in kinds):
            made += f".{shown(step)[1:-1]}" if made else shown(step)[1:-1]
    return made
