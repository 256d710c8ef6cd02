"""What a report.json must look like, so that a page or a PDF can be made of it: types, kinds, states.

Keys beyond these are allowed: a later version may say more. What a figure holds is for its module.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Discriminator, Field, Tag, ValidationError

from actuator_lti.errors import InputError
from actuator_lti.reading import shown

SCHEMA = "actuator-lti/report"
VERSION = 1
STATUSES = ("pass", "fail", "warn", "info")

Status = Literal["pass", "fail", "warn", "info"]
Scalar = None | bool | int | float | str


class _Part(BaseModel):
    """Strict types, no NaN; unknown keys may stand."""

    model_config = ConfigDict(strict=True, extra="allow", allow_inf_nan=False, frozen=True)


class Mark(_Part):
    """A cell with a state."""

    text: Scalar
    status: Status | Literal[""] | None = None


Cell = Annotated[
    Annotated[Mark, Tag("mark")] | Annotated[Scalar, Tag("plain")],
    Discriminator(lambda value: "mark" if isinstance(value, dict | Mark) else "plain"),
]


class Column(_Part):
    """A column of a table; see `reports.document.column`."""

    key: str
    label: str
    unit: str
    align: Literal["left", "right", "center"]
    format: Annotated[str, Field(pattern=r"^(text|yesno|int|(sig|short|fix|ms):1?[0-9])$")]


class TableBlock(_Part):
    """A table."""

    kind: Literal["table"]
    caption: str
    columns: list[Column]
    rows: list[dict[str, Cell]]
    note: str = ""


class FigureBlock(_Part):
    """A figure: its module draws it from the data alone."""

    kind: Literal["figure"]
    figure: str
    data: dict[str, Any]
    caption: str
    alt: str
    layout: Literal["wide", "half", "tall"] = "wide"


class TextBlock(_Part):
    """Paragraphs."""

    kind: Literal["text"]
    text: str


class FactItem(_Part):
    """A labelled value."""

    label: str
    value: Scalar
    unit: str


class FactsBlock(_Part):
    """Labelled values."""

    kind: Literal["facts"]
    items: list[FactItem]


class VerdictItem(_Part):
    """One verdict."""

    id: str
    label: str
    value: float | None
    limit: float | None
    comparison: str
    unit: str
    distance: float | None
    passed: bool | None
    source: str
    reason: str


class VerdictsBlock(_Part):
    """Verdicts of one kind."""

    kind: Literal["verdicts"]
    items: list[VerdictItem]
    what: str = "requirements"


class DetailsBlock(_Part):
    """Blocks that open on demand."""

    kind: Literal["details"]
    title: str
    blocks: list[Block]


class GlanceFigure(_Part):
    """One figure of a loop on the first screen, with the limit that is nearest to it."""

    label: str
    value: Scalar
    unit: str
    format: str
    limit: float | None
    comparison: str
    distance: float | None
    passed: bool | None


class GlanceLoop(_Part):
    """One loop on the first screen."""

    loop: str
    anchor: str
    stable: Cell
    figures: list[GlanceFigure]


class FindingItem(_Part):
    """One sentence that a reader must know."""

    severity: Literal["fail", "warn", "info"]
    text: str
    where: str


class GlanceBlock(_Part):
    """The first screen."""

    kind: Literal["glance"]
    loops: list[GlanceLoop]
    weakest: dict[str, Scalar] | None
    findings: list[FindingItem]
    more: int


Block = Annotated[
    TableBlock | FigureBlock | TextBlock | FactsBlock | VerdictsBlock | DetailsBlock | GlanceBlock,
    Discriminator("kind"),
]


class SectionPart(_Part):
    """A section."""

    id: Annotated[str, Field(min_length=1)]
    title: str
    result: str = ""
    intro: str
    status: Status
    findings: list[FindingItem] = Field(default_factory=list)
    blocks: list[Block]


class Verdict(_Part):
    """The verdicts of the whole document, counted."""

    passed: bool
    failed: int
    not_judged: int
    total: int


class Document(_Part):
    """A whole report.json."""

    schema_: Annotated[Literal["actuator-lti/report"], Field(alias="schema")]
    version: Literal[1]
    kind: str
    title: str
    subtitle: str
    design: dict[str, Scalar]
    provenance: dict[str, Scalar | dict[str, Scalar]]
    verdict: Verdict
    sections: list[SectionPart]


def validate(made: Any, origin: str | None = None) -> None:
    """Refuse what is no document.

    Raises
    ------
    InputError
        One line: the place, what stands there, what is allowed.
    """
    if not isinstance(made, dict) or made.get("schema") != SCHEMA:
        raise InputError(f"schema must be {SCHEMA!r}", where=origin)
    if made.get("version") != VERSION:
        raise InputError(
            f"version = {shown(made.get('version'))}: this program reads version {VERSION}", where=origin
        )
    try:
        Document.model_validate(made)
    except (ValidationError, RecursionError) as error:
        raise InputError(_line(error), where=origin) from None


def _line(error: ValidationError | RecursionError) -> str:
    if isinstance(error, RecursionError):
        return "details within details: nested too deeply"
    first = error.errors(include_url=False, include_context=False)[0]
    result = "" if first["type"] == "missing" else f" = {shown(first['input'])}"
    return f"{_place(first['loc'])}{result}: {first['msg'][:1].lower()}{first['msg'][1:]}"


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
