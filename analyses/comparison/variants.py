"""Variants against their base: every figure, verdicts, differences, and what moved them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cache, cached_property, partial
from math import isfinite, nan
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import TypeAdapter

from actuator_lti.asked.verdict import Tally, Verdict
from actuator_lti.batch import Population, variable_paths
from actuator_lti.design import design_tree, parameter_value
from actuator_lti.errors import InputError, NumericalError
from actuator_lti.files.reading import as_path
from actuator_lti.loops import assemble_loops
from analyses.comparison.variant_figures import (
    FigureName,
    LargeSignal,
    figure_names,
    small_signal,
)
from analyses.comparison.variant_store import Store, address
from analyses.linear.loop_figures import all_loop_figures
from analyses.specification.requirements import RequirementVerdict, evaluate_requirements, tally
from analyses.studies.engine import Engine
from analyses.studies.study import Study, Variant, load_study
from analyses.validation import CHECKS, validate
from analyses.validation.row import Row

if TYPE_CHECKING:
    from actuator_lti.design.model import Design
    from analyses.linear.loop_figures import LoopFigures
    from analyses.specification.sensitivity import Sensitivities

Progress = Callable[[int, int], None]
_ALIKE = 1e-12  # relative; differences below are rounding
_SEEN = 5e-5  # relative; differences below change no digit that is shown


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

    # By column, such as ``"position.phase_margin"``; ``None`` where there is none
    figures: dict[str, float | None]
    verdicts: tuple[RequirementVerdict, ...]
    changed: tuple[Changed, ...] = ()
    differences: dict[str, float] = field(default_factory=dict)  # figure minus the base's, where they differ
    # For each difference the changed keys one at a time, the strongest first; what is left over is their
    # interaction (or a key without a number)
    moved_by: dict[str, tuple[Contribution, ...]] = field(default_factory=dict)
    # Of the validator: each prediction beside what the simulator shows; empty where not asked for
    checks: tuple[Row, ...] = ()
    untested: str = ""  # why the validator could not test this design


@dataclass(frozen=True, kw_only=True)
class Compared(Found):
    """One design of a comparison, with what is found of it."""

    variant: Variant

    @cached_property
    def loops(self) -> Mapping[str, LoopFigures]:
        """The loops, for drawing; computed when they are first asked for, as few designs are drawn."""
        assert self.variant.design is not None
        return all_loop_figures(assemble_loops(self.variant.design), certify=True)


@dataclass(frozen=True)
class Comparison:
    """A study compared."""

    study: Study
    names: tuple[FigureName, ...]
    base: Compared
    variants: tuple[Compared, ...]
    sensitivities: Sensitivities  # of the base
    refused: tuple[Variant, ...]  # those that have no design, with the reason
    whole: Comparison | None = None  # what this one is a choice of, where its variants are not all

    @property
    def everything(self) -> Comparison:
        """All designs, also where this is a choice of them."""
        return self.whole or self

    @property
    def all(self) -> tuple[Compared, ...]:
        """Base first."""
        return (self.base, *self.variants)

    @property
    def tally(self) -> Tally:
        """The requirements of all designs, counted."""
        return sum((tally(one.verdicts) for one in self.everything.all), Tally())

    @property
    def unconfirmed(self) -> bool:
        """Whether the simulator contradicts a prediction of a design."""
        return any(row.verdict is Verdict.NOT_MET for one in self.everything.all for row in one.checks)

    @property
    def verdict(self) -> Verdict:
        """That of all requirements of all designs; not met also where one is refused, or contradicted."""
        return Verdict.NOT_MET if self.refused or self.unconfirmed else self.tally.verdict

    def ends(self, name: FigureName) -> tuple[float, float] | None:
        """Best and worst value of a figure over all designs; ``None`` if they hardly differ (0.005 %)."""
        return self.everything._ends.get(name.key)

    @cached_property
    def _ends(self) -> dict[str, tuple[float, float]]:
        return {name.key: ends for name in self.names if (ends := self._ends_of(name)) is not None}

    def _ends_of(self, name: FigureName) -> tuple[float, float] | None:
        values = [v for c in self.all if (v := c.figures.get(name.key)) is not None and isfinite(v)]
        if name.better == 0 or len(values) < 2 or max(values) - min(values) <= _SEEN * max(map(abs, values)):
            return None
        low, high = min(values), max(values)
        return (high, low) if name.better > 0 else (low, high)


def compare(
    study: Study | str | PathLike[str],
    *,
    validation: bool | None = None,
    progress: Progress | None = None,
    engine: Engine | None = None,
    folder: Path | None = None,
) -> Comparison:
    """Compute every figure of every design of a study and what differs from the base.

    Parameters
    ----------
    study : Study, or path of its file
    validation : bool, optional
        Whether every design is validated (quick settings); by default as the study says.
    progress : callable, optional
        Called with (steps done, steps in all).
    engine : Engine, optional
        Where to compute; in this process, one after the other, where left out.
    folder : Path, optional
        Where what is found of each design is kept as soon as it is there; a study that was stopped, or has
        changed a little, goes on from it.

    Raises
    ------
    InputError, NumericalError
        From the base or a variant.
    """
    from analyses.specification.sensitivity import sensitivities

    study = study if isinstance(study, Study) else load_study(as_path(study))
    assert study.base.design is not None
    plan = LargeSignal.plan(study.base.design)
    tested = study.validation if validation is None else validation
    good = [v for v in study.variants if v.design is not None]
    total = len(good) + 2
    tell = progress or (lambda done, total: None)
    kept = _Kept(None if folder is None else Store(folder), study.base, (plan, tested))
    base = kept.read(study.base) or kept.write(study.base, _evaluated(study.base, plan, tested))
    result = [kept.read(variant) for variant in good]
    tell(1, total)
    slopes = sensitivities(study.base.design)
    missing = [k for k, one in enumerate(result) if one is None]
    first = total - len(missing)
    tell(first, total)

    def take(place: tuple[int, Variant], one: Found) -> None:
        result[place[0]] = kept.write(place[1], one)

    work = partial(_beside, base, study.base, plan, tested)
    places = [(k, good[k]) for k in missing]
    (engine or Engine(threads=1)).map(work, places, take, lambda done, _: tell(first + done, total))
    ends = tuple(
        _compared(variant, one) for variant, one in zip(good, result, strict=True) if one is not None
    )
    reference = _compared(study.base, base)
    names = figure_names([c.figures for c in (reference, *ends)], study.base.design)
    refused = tuple(v for v in study.variants if v.design is None)
    return Comparison(study, names, reference, ends, slopes, refused)


def _compared(variant: Variant, result: Found) -> Compared:
    return Compared(variant=variant, **{part.name: getattr(result, part.name) for part in fields(Found)})


@dataclass(frozen=True)
class _Kept:
    """What is found of the designs of a study, where it is kept at all."""

    store: Store | None
    base: Variant
    settings: object

    def read(self, variant: Variant) -> Found | None:
        data = None if self.store is None else self.store.read(self._address(variant))
        try:
            return None if data is None else _adapter().validate_python(data)
        except ValueError:  # not what this version writes: computed again
            return None

    def write(self, variant: Variant, result: Found) -> Found:
        if self.store is not None:
            self.store.write(self._address(variant), _adapter().dump_python(result))
        return result

    def _address(self, variant: Variant) -> str:
        return address((self.base.design, variant.design), self.settings)


@cache
def _adapter() -> TypeAdapter[Found]:
    """Turns what is found into plain data and back."""
    return TypeAdapter(Found)


def _beside(
    base: Found, origin: Variant, plan: LargeSignal, tested: bool, place: tuple[int, Variant]
) -> Found:
    """What is found of a design, and how it differs from the base."""
    _, variant = place
    assert origin.design is not None
    assert variant.design is not None
    return _against(_evaluated(variant, plan, tested), variant.design, base, origin.design)


def _evaluated(variant: Variant, plan: LargeSignal, tested: bool) -> Found:
    assert variant.design is not None
    loops = assemble_loops(variant.design)
    result = all_loop_figures(loops, certify=True)
    figures = {**small_signal(variant.design, result), **plan.figures(variant.design, loops)}
    checks, untested = _checked(variant.design) if tested else ((), "")
    verdicts = evaluate_requirements(variant.design, result)
    return Found(figures=figures, verdicts=verdicts, checks=checks, untested=untested)


def _checked(design: Design) -> tuple[tuple[Row, ...], str]:
    """The validator's checks, or why there are none."""
    try:
        return validate(design, CHECKS).rows, ""
    except (InputError, NumericalError) as error:
        return (), str(error)


def _against(one: Found, design: Design, base: Found, origin: Design) -> Found:
    """Add what differs from the base, and what moved it."""
    changed = changes(origin, design)
    differences = {}
    for key, value in one.figures.items():
        before = base.figures.get(key)
        if value is None or before is None or not (isfinite(value) and isfinite(before)):
            continue
        if abs(value - before) > _ALIKE * max(abs(value), abs(before)):
            differences[key] = value - before
    moved = _moved_by(origin, design, changed, differences)
    return replace(one, changed=changed, differences=differences, moved_by=moved)


def changes(base: Design, other: Design) -> tuple[Changed, ...]:
    """Keys of the design file that differ; names and texts of the head do not count."""
    flat, flat_other = dict(_flat(design_tree(base))), dict(_flat(design_tree(other)))
    keys = [*flat, *(key for key in flat_other if key not in flat)]
    return tuple(
        Changed(key, flat.get(key, "–"), flat_other.get(key, "–"))
        for key in keys
        if flat.get(key) != flat_other.get(key) and not key.startswith(("design.", "requirement", "fact"))
    )


def _flat(tree: Any, path: str = "") -> list[tuple[str, str]]:
    """Leaves of a design tree as texts, by dotted key; an entry with a value is one leaf."""
    if isinstance(tree, Mapping):
        if "value" in tree:
            return [(path, str(tree["value"]))]
        return [leaf for key, item in tree.items() for leaf in _flat(item, f"{path}.{key}" if path else key)]
    if isinstance(tree, list) and tree and all(isinstance(item, Mapping) for item in tree):
        return [
            leaf
            for k, item in enumerate(tree)
            for leaf in _flat(item, f"{path}.{item.get('name') or item.get('id') or k}")
        ]
    return [(path, str(tree))]


def _moved_by(
    base: Design, other: Design, changed: tuple[Changed, ...], differences: Mapping[str, float]
) -> dict[str, tuple[Contribution, ...]]:
    """Change one number at a time, starting from the base."""
    if len(changed) == 1:
        return {key: (Contribution(changed[0].path, amount),) for key, amount in differences.items()}
    alone = _alone(base, other, changed)
    moved: dict[str, tuple[Contribution, ...]] = {}
    for key, total in differences.items():
        parts = [
            Contribution(path, amounts[key])
            for path, amounts in alone.items()
            if isfinite(amounts.get(key, nan)) and abs(amounts[key]) > 1e-6 * abs(total)
        ]
        moved[key] = tuple(sorted(parts, key=lambda part: -abs(part.amount)))
    return moved


def _alone(base: Design, other: Design, changed: tuple[Changed, ...]) -> dict[str, dict[str, float]]:
    """What each changed number of the other design alone does to the figures of the base."""
    from analyses.specification.sensitivity import population_figures

    both = set(variable_paths(base)) & set(variable_paths(other))
    paths = [item.path for item in changed if item.path in both]
    values = {path: np.full(len(paths) + 1, parameter_value(base, path)) for path in paths}
    for k, path in enumerate(paths):
        values[path][k + 1] = parameter_value(other, path)
    columns = population_figures(Population(base, values, len(paths) + 1), base, time_figures=True)
    return {
        path: {key: float(column[k + 1]) - float(column[0]) for key, column in columns.items()}
        for k, path in enumerate(paths)
    }
