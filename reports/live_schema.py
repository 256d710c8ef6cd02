"""What the live page is given, as JSON: the names here are those that its scripts read."""

from __future__ import annotations

from typing import NotRequired

from typing_extensions import TypedDict


class NamedKey(TypedDict):
    """A key of the design: its value in SI, its unit as written, and SI over that unit."""

    path: str
    about: str
    value: float
    unit: str
    factor: float
    whole: bool


class FixedKey(NamedKey):
    """A key without a slider, and why."""

    why: str


class SliderKey(NamedKey):
    """A key with the ends of its slider, of its tolerance, and of what a design file may have."""

    low: float
    high: float
    least: float | None
    most: float | None
    open: bool
    allowed: str
    band: list[float] | None


class FollowedFigure(TypedDict):
    """A column of the table of loops; ``factor`` from its own unit to that shown."""

    name: str
    label: str
    unit: str
    factor: float
    timed: bool
    response: bool


class FollowedLimit(TypedDict):
    """A requirement: on a loop, or on the whole drive with the statements that give its figure."""

    id: str
    loop: str | None
    quantity: str
    words: str
    absolute: bool
    timed: bool
    unit: str
    minimum: float | None
    maximum: float | None
    load: NotRequired[float]
    lines: NotRequired[list[list[str | float]]]


class NotFollowed(TypedDict):
    """A requirement that takes a simulation of its own."""

    id: str
    words: str


class StepData(TypedDict):
    """The command of the step, and what it is a step of."""

    size: float
    unit: str
    factor: float
    of: str


class MapData(TypedDict):
    """The cells of the map of sines, and the rule that names them."""

    columns: int
    levels: int
    updates: int
    lowest: float
    longest: int
    full: float
    stick: float
    decibel: float
    degrees: float
    words: dict[str, str]
    colours: dict[str, str]


class LiveData(TypedDict):
    """All of it."""

    name: str
    axis: str
    keys: list[SliderKey]
    fixed: list[FixedKey]
    lines: list[list[str | float]]
    row: list[float | str]
    places: dict[str, int]
    loops: list[str]
    stages: dict[str, int]
    points: dict[str, int]
    point: str
    relations: list[list[list[str | float]]]
    electrical: bool
    limiters: list[list[object]]
    quantities: list[str]
    figures: list[FollowedFigure]
    requirements: list[FollowedLimit]
    apart: list[NotFollowed]
    step: StepData
    limits: list[list[object]]
    borders: list[str]
    map: MapData | None
    text: str
    patches: list[list[object]]


class Refused(TypedDict):
    """Why there is no live page."""

    refused: str
