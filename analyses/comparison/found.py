"""What is found of each design of a comparison: figures with their names, and where they are kept.

JSON, by the hash of all that it depends on (designs, commands, code, libraries), so that a study goes on;
what is damaged is computed again.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib import metadata
from math import isnan, pi
from pathlib import Path

from pydantic import TypeAdapter

from actuator_lti.asked.drive_figure import drive_figure
from actuator_lti.asked.quantities import LOOP_QUANTITIES, QUANTITIES, drive_cases
from actuator_lti.batch import Population
from actuator_lti.design import write_design
from actuator_lti.design.model import Design
from actuator_lti.errors import InputError
from actuator_lti.files.atomic import write_bytes
from actuator_lti.files.reading import decode, read_bytes
from actuator_lti.loops import Loops
from actuator_lti.loops.limiters import onset
from analyses.large_signal.tones import full_command
from analyses.linear.loop_figures import LoopFigures
from analyses.linear.loop_survey import with_cogging
from analyses.monte_carlo.task import StepCheck, step_columns
from analyses.specification.requirements import RequirementVerdict
from analyses.studies.proof import code_version
from analyses.validation.row import Row
from nonlinear.runs.trajectory import COMMAND_UNITS

Figures = Mapping[str, float | None]


@dataclass(frozen=True)
class FigureName:
    key: str
    label: str
    unit: str
    group: str  # ``"current"``, ``"velocity"``, ``"position"``, ``"drive"`` or ``"large"``
    better: int  # 1 where larger is better, -1 where smaller is, 0 where neither


def small_signal(design: Design, result: Mapping[str, LoopFigures]) -> dict[str, float | None]:
    """Linear and static figures; an unstable loop has none, and its drive no stiffness."""
    figures: dict[str, float | None] = {}
    for loop, found in result.items():
        one = found.judged
        for name, quantity in LOOP_QUANTITIES.items():
            value = quantity.read(one) if one.stable else None
            figures[f"{loop}.{name}"] = None if value is None else float(value)
    stands = all(one.is_stable is not False for one in result.values())
    for name, load in drive_cases(design.validation.loads_Nm):
        value = float(drive_figure(design, name, load))
        there = stands or QUANTITIES[name].source != "stiffness"
        figures[f"drive.{name}@{load:g}"] = value if there and not isnan(value) else None
    return figures


@dataclass(frozen=True)
class LargeSignal:
    """Large-signal figures, taken of every design at the same commands."""

    frequencies_hz: tuple[float, ...]  # where the largest linear amplitude is given
    step: float  # of the command: the full deflection (output side), half of the top speed or peak current
    loads_Nm: tuple[float, ...]
    command: tuple[str, str]  # axis and stage that take it

    @classmethod
    def plan(cls, base: Design) -> LargeSignal:
        """Choose commands from the base, so that all designs that take such get the same."""
        outer, full = base.controller.outermost, full_command(base)
        step = full if outer == "position" else 0.5 * full
        return cls((1.0, 5.0), step, base.validation.loads_Nm, _command(base))

    def figures(self, design: Design, loops: Loops) -> dict[str, float | None]:
        """Largest linear amplitudes, and the nonlinear step at every load; of another command its own."""
        if _command(design) != self.command:
            return LargeSignal.plan(design).figures(design, loops)
        shown = COMMAND_UNITS[design.axis, design.controller.outermost][1]
        figures: dict[str, float | None] = {}
        for frequency in self.frequencies_hz:
            try:
                linear_limit = with_cogging(loops, onset(loops, [2 * pi * frequency]))
            except InputError:
                continue  # beyond Nyquist of the position loop
            figures[f"large.onset@{frequency:g}"] = float(linear_limit.amplitude_rad[0]) * shown
        for load in self.loads_Nm:
            step = StepCheck(self.step, load_Nm=load)
            columns = step_columns(step, Population(design, {}, 1))
            for name in ("rise_time", "overshoot", "settling_time", "peak_current"):
                value = float(columns[f"nonlinear.{name}"][0])
                figures[f"large.{name}@{load:g}"] = None if isnan(value) else value
        return figures


def _command(design: Design) -> tuple[str, str]:
    return design.axis, design.controller.outermost


def apart(key: str, base: Design, design: Design) -> str:
    """What sets a figure apart from the base's: another axis (" linear"), with its units, or command."""
    group, _, rest = key.partition(".")
    quantity, _, load = rest.partition("@")
    own, its = _command(design), _command(base)
    if group == "large" and own != its:
        return " ".join(("", *own))
    if group != "drive" or own[0] == its[0]:
        return ""
    units = {QUANTITIES[quantity].unit_for(one.axis) for one in (design, base)}
    return "" if len(units) == 1 and float(load) == 0.0 else f" {own[0]}"


def figure_names(found: Iterable[tuple[Figures, Design]]) -> tuple[FigureName, ...]:
    """Names of all figures that occur, in the order in which they first do."""
    names: dict[str, FigureName] = {}
    for figures, design in found:
        names |= {key: _name(key, design) for key in figures if key not in names}
    return tuple(names.values())


def _name(whole: str, design: Design) -> FigureName:
    key, _, kind = whole.partition(" ")
    group, _, rest = key.partition(".")
    quantity, _, at = rest.partition("@")
    known, words = QUANTITIES.get(quantity), quantity.replace("_", " ")
    if known is not None:
        unit, better = known.unit_for(design.axis), int(known.better)
    else:  # of the large signal
        command = COMMAND_UNITS[design.axis, design.controller.outermost][0]
        unit, better = (command, 1) if quantity == "onset" else ("A", -1)
    if quantity == "onset":
        words, at = "largest linear command", f"{at} Hz"
    elif known is not None and known.source == "stiffness":
        at = ""  # no load changes it
    elif at:
        at = f"{at} {design.load_unit}"
    words += f" at {at}" * bool(at) + f", {kind} drive" * bool(kind)
    return FigureName(whole, words, "" if unit == "1" else unit, group, better)


@dataclass(frozen=True)
class Changed:
    """One key that differs from the base, as texts."""

    path: str
    base: str
    text: str


@dataclass(frozen=True)
class Contribution:
    """What one changed key alone does to a figure, starting from the base."""

    path: str
    amount: float


@dataclass(frozen=True, kw_only=True)
class Found:
    """What is found of one design of a comparison: plain data, kept on disk as they are."""

    figures: dict[str, float | None]  # by column, such as ``"position.phase_margin"``
    verdicts: tuple[RequirementVerdict, ...]
    unstable: tuple[str, ...] = ()  # the loops that are not stable: they have no figures
    changed: tuple[Changed, ...] = ()
    differences: dict[str, float] = field(default_factory=dict)  # figure minus the base's, where they differ
    # Of each difference what each changed key does alone, the strongest first; the rest is interaction
    moved_by: dict[str, tuple[Contribution, ...]] = field(default_factory=dict)
    checks: tuple[Row, ...] = ()  # of the validator; empty where not asked for
    untested: str = ""  # why the validator could not test this design


_FOUND = TypeAdapter(Found)


@dataclass(frozen=True)
class Kept:
    """What is found of the designs of a study, in one folder; nothing without one."""

    folder: Path | None
    base: Design
    settings: object  # its ``repr`` says all of them

    def read(self, design: Design) -> Found | None:
        """What was found; ``None`` where there is nothing, or nothing whole."""
        path = self._path(design)
        if path is None or not path.exists():
            return None
        try:
            head, _, body = decode(read_bytes(path, "entry"), str(path)).partition("\n")
            return _FOUND.validate_python(json.loads(body)) if head == _digest(body) else None
        except (InputError, ValueError, RecursionError):  # or not what this version writes
            return None

    def write(self, design: Design, found: Found) -> Found:
        """Keep what was found, and give it back."""
        if (path := self._path(design)) is not None:
            body = json.dumps(_FOUND.dump_python(found))
            write_bytes(path, f"{_digest(body)}\n{body}".encode())
        return found

    def _path(self, design: Design) -> Path | None:
        if self.folder is None:
            return None
        texts = [write_design(one) for one in (self.base, design)]
        key = _digest(json.dumps([texts, repr(self.settings), _code()]))
        return self.folder / key[:2] / f"{key}.json"


@cache
def _code() -> list[str]:
    return [code_version(), *(f"{name} {metadata.version(name)}" for name in ("numpy", "scipy"))]


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
