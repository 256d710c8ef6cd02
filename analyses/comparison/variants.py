"""Variants against their base: every figure, verdicts, differences, and what moved them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from math import isfinite, nan
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from actuator_lti.asked.verdict import Tally, Verdict
from actuator_lti.batch import variable_paths
from actuator_lti.design import design_tree, parameter_value
from actuator_lti.design.model import Design
from actuator_lti.errors import InputError, NumericalError
from actuator_lti.files.reading import as_path
from actuator_lti.loops import assemble_loops
from actuator_lti.types import Progress
from analyses.comparison import found
from analyses.comparison.found import Changed, Contribution, FigureName, Found, Kept, LargeSignal
from analyses.linear.loop_figures import LoopFigures, all_loop_figures
from analyses.specification.requirements import evaluate_requirements, tally
from analyses.specification.sensitivity import Sensitivities, moved, population_figures, sensitivities
from analyses.studies.engine import Engine
from analyses.studies.study import Study, Variant, load_study
from analyses.validation import CHECKS, validate
from analyses.validation.row import Row

_EQUAL = 1e-12  # relative; differences below are rounding


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
        return (self.base, *self.variants)

    @property
    def tally(self) -> Tally:
        return sum((tally(one.verdicts) for one in self.everything.all), Tally())

    @property
    def unconfirmed(self) -> bool:
        """Whether the simulator contradicts a prediction of a design."""
        return any(row.verdict is Verdict.NOT_MET for one in self.everything.all for row in one.checks)

    @property
    def verdict(self) -> Verdict:
        """That of all requirements; not met also where a design is refused, not stable, or contradicted."""
        unstable = any(one.unstable for one in self.everything.all)
        return Verdict.NOT_MET if self.refused or unstable or self.unconfirmed else self.tally.verdict

    def ends(self, name: FigureName) -> tuple[float, float] | None:
        """Best and worst value of a figure over all designs; ``None`` if none is better, or has one."""
        return self.everything._ends.get(name.key)

    @cached_property
    def _ends(self) -> dict[str, tuple[float, float]]:
        ends = {}
        for name in self.names:
            values = [v for c in self.all if (v := c.figures.get(name.key)) is not None and isfinite(v)]
            if name.better and values:
                low, high = min(values), max(values)
                ends[name.key] = (high, low) if name.better > 0 else (low, high)
        return ends


def compare(
    study: Study | str | PathLike[str],
    *,
    validation: bool | None = None,
    progress: Progress = None,
    engine: Engine | None = None,
    folder: Path | None = None,
) -> Comparison:
    """Compute every figure of every design of a study and what differs from the base.

    ``validation``: whether every design is validated (quick settings); by default as the study says.
    ``progress``: called with (steps done, steps in all).
    ``engine``: where to compute; in this process, one after the other, where left out.
    ``folder``: where what is found of each design is kept as soon as it is there; a study that was stopped,
    or has changed a little, goes on from it.

    Raises `InputError`, `NumericalError`: from the base or a variant.
    """
    study = study if isinstance(study, Study) else load_study(as_path(study))
    origin = _design(study.base)
    plan = LargeSignal.plan(origin)
    tested = study.validation if validation is None else validation
    good = [v for v in study.variants if v.design is not None]
    total = len(good) + 2
    tell = progress or (lambda done, total: None)
    kept = Kept(folder, origin, (plan, tested))
    base = kept.read(origin) or kept.write(origin, _evaluated(study.base, plan, tested))
    result = [kept.read(_design(variant)) for variant in good]
    tell(1, total)
    slopes = sensitivities(origin)
    missing = [(k, good[k]) for k, one in enumerate(result) if one is None]
    first = total - len(missing)
    tell(first, total)

    def take(place: tuple[int, Variant], one: Found) -> None:
        result[place[0]] = kept.write(_design(place[1]), one)

    work = partial(_beside, base, origin, plan, tested)
    (engine or Engine(threads=1)).map(work, missing, take, lambda done, _: tell(first + done, total))
    reference, *ends = (
        Compared(variant=variant, **vars(one))
        for variant, one in zip((study.base, *good), (base, *result), strict=True)
        if one is not None
    )
    names = found.figure_names((c.figures, _design(c.variant)) for c in (reference, *ends))
    refused = tuple(v for v in study.variants if v.design is None)
    return Comparison(study, names, reference, tuple(ends), slopes, refused)


def _design(variant: Variant) -> Design:
    assert variant.design is not None
    return variant.design


def _evaluated(variant: Variant, plan: LargeSignal, tested: bool) -> Found:
    design, untested = _design(variant), ""
    loops, checks = assemble_loops(design), tuple[Row, ...]()
    result = all_loop_figures(loops, certify=True)
    if tested:
        try:
            checks = validate(design, CHECKS).rows
        except (InputError, NumericalError) as error:
            untested = str(error)
    return Found(
        figures={**found.small_signal(design, result), **plan.figures(design, loops)},
        verdicts=evaluate_requirements(design, result),
        unstable=tuple(name for name, one in result.items() if one.is_stable is False),
        checks=checks,
        untested=untested,
    )


def _beside(base: Found, origin: Design, plan: LargeSignal, tested: bool, at: tuple[int, Variant]) -> Found:
    """What is found of a design, how it differs from the base, and what moved it."""
    one, design = _evaluated(at[1], plan, tested), _design(at[1])
    own = {key + found.apart(key, origin, design): value for key, value in one.figures.items()}
    one = replace(one, figures=own)
    changed, differences = changes(origin, design), {}
    for key, value in one.figures.items():
        before = base.figures.get(key)
        if value is None or before is None or not (isfinite(value) and isfinite(before)):
            continue
        if abs(value - before) > _EQUAL * max(abs(value), abs(before)):
            differences[key] = value - before
    moved = _moved_by(origin, design, changed, differences)
    return replace(one, changed=changed, differences=differences, moved_by=moved)


def changes(base: Design, other: Design) -> tuple[Changed, ...]:
    """Keys of the design file that differ; names and texts of the head do not count."""
    before, after = keys_of(base), keys_of(other)
    return tuple(
        Changed(key, before.get(key, "–"), after.get(key, "–"))
        for key in {**before, **after}
        if before.get(key) != after.get(key) and not key.startswith("requirement")
    )


def keys_of(design: Design) -> dict[str, str]:
    """What a design file says as texts, by dotted key; names and texts of the head and facts do not count."""
    leaves = _flat(design_tree(design))
    return {key: text for key, text in leaves if not key.startswith(("design.", "fact"))}


def _flat(tree: Any, path: str = "") -> Iterator[tuple[str, str]]:
    """Leaves of a design tree as texts, by dotted key; of an entry its value and its tolerance."""
    if isinstance(tree, Mapping) and "value" not in tree:
        below = list(tree.items())
    elif isinstance(tree, list) and tree and all(isinstance(item, Mapping) for item in tree):
        below = [(item.get("name") or item.get("id") or k, item) for k, item in enumerate(tree, 1)]
    else:
        yield path, str(tree["value"] if isinstance(tree, Mapping) else tree)
        if isinstance(tree, Mapping) and "tolerance" in tree:
            yield f"{path}.tolerance", str(tree["tolerance"])
        return
    for key, item in below:
        yield from _flat(item, f"{path}.{key}" if path else key)


def _moved_by(
    base: Design, other: Design, changed: tuple[Changed, ...], differences: Mapping[str, float]
) -> dict[str, tuple[Contribution, ...]]:
    """Change one number at a time, starting from the base."""
    if len(changed) == 1:
        return {key: (Contribution(changed[0].path, amount),) for key, amount in differences.items()}
    both = set(variable_paths(base)) & set(variable_paths(other))
    paths = [item.path for item in changed if item.path in both]
    origin = {path: parameter_value(base, path) for path in paths}
    alone = moved(base, origin, [{path: parameter_value(other, path)} for path in paths])
    columns = population_figures(alone, base, time_figures=True)
    causes: dict[str, tuple[Contribution, ...]] = {}
    for key, total in differences.items():
        column = columns.get(key, np.full(len(paths) + 1, nan))
        amounts = (float(there) - float(column[0]) for there in column[1:])
        parts = map(Contribution, paths, amounts)
        strong = [one for one in parts if isfinite(one.amount) and abs(one.amount) > 1e-6 * abs(total)]
        causes[key] = tuple(sorted(strong, key=lambda part: -abs(part.amount)))
    return causes
