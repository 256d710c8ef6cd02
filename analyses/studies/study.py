"""Study files: a base design, variants of it as overrides, sweeps and grids, and what to do with them.

A study file is TOML and only data::

    [study]
    name = "gear and gains"
    base = "ilr33-amber"                     # shipped name, or path beside the study file
    validation = false

    [[variant]]
    name = "slower gear"
    override = { "gear.worm.ratio" = 50 }

    [[variant]]
    name = "more voltage, less resistance"
    override = { "limits.voltage" = "16 V", "motor.resistance" = "50 mohm" }
    # motor = "motor-24V.toml"               # its [motor] table replaces the base's

    [[sweep]]                                # one parameter: a list, or from, to, points, spacing
    parameter = "control.velocity.gain"
    values = ["0.06 A*s/rad", "0.24 A*s/rad"]

    [[grid]]                                 # every combination
    axes = [{ parameter = "motor.resistance", values = ["50 mohm", "60 mohm"] },
            { parameter = "limits.voltage", from = "10 V", to = "14 V", points = 3 }]

    [[requirement]]                          # added to the base's, or in place of one with the same id
    id = "bandwidth"
    quantity = "bandwidth"
    loop = "position"
    minimum = "20 Hz"

    [monte_carlo]
    samples = 1000
    seed = 0

    [nightly]                                # read by the nightly alone: a PDF beside each report
    pdf = true
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import chain, product
from math import prod
from pathlib import Path
from typing import TYPE_CHECKING, Any

from actuator_lti.bounds import GRID_AXES, SAMPLES, STUDY_VARIANTS
from actuator_lti.errors import InputError
from actuator_lti.files.reading import read_toml, shown_path
from actuator_lti.files.tree import Tree
from analyses.slugs import slug
from analyses.studies.study_axes import Axis, read_axis
from analyses.studies.study_reading import Reader

if TYPE_CHECKING:
    from actuator_lti.design.model import Design

LONGEST_NAME = 200


@dataclass(frozen=True)
class Variant:
    """One design of a study.

    Attributes
    ----------
    name : str
        As written; any text, never used as a path.
    slug : str
        The name as part of a file name, unique in the study.
    design : Design or None
        ``None`` where it was refused; then ``error`` says why.
    overrides : mapping of str to object
        Dotted keys as written.
    error : str
    """

    name: str
    slug: str
    design: Design | None
    overrides: Mapping[str, Any] = field(default_factory=dict)
    error: str = ""


@dataclass(frozen=True)
class MonteCarloPlan:
    """What a study asks of Monte Carlo."""

    samples: int
    seed: int


@dataclass(frozen=True)
class Study:
    """A base design and its variants.

    Attributes
    ----------
    name, title, description, origin : str
    base : Variant
        With the study's own requirements.
    variants : tuple of Variant
        In the order of the file: variants, sweeps, grids.
    validation : bool
        Whether the nonlinear validation is wanted.
    monte_carlo : MonteCarloPlan or None
    """

    name: str
    title: str
    description: str
    origin: str
    base: Variant
    variants: tuple[Variant, ...]
    validation: bool = False
    monte_carlo: MonteCarloPlan | None = None

    @property
    def all(self) -> tuple[Variant, ...]:
        """The base, then the variants."""
        return (self.base, *self.variants)


def is_study(path: str | Path) -> bool:
    """Whether a file is a study (a TOML file with a ``[study]`` table) and not a design."""
    file = Path(path)
    try:
        there = file.is_file()
    except OSError:  # a name that is too long, say: whoever reads it as a design tells
        return False
    return there and "study" in read_toml(file, "study file")


def load_study(path: str | Path, *, keep_going: bool = False) -> Study:
    """Read a study file.

    Parameters
    ----------
    path : path
        TOML, at most 1 MiB and 10000 variants (`actuator_lti.bounds`).
    keep_going : bool
        Keep a variant that its design's checks refuse, with its error, instead of refusing the study.

    Raises
    ------
    InputError
        One line: file, key, value and what is allowed.
    """
    tree = read_toml(path, "study file")
    return study_from_tree(tree, shown_path(path), Path(path).parent, keep_going=keep_going)


def study_of(design: Design) -> Study:
    """A study of one design, without variants."""
    base = Variant(design.name, slug(design.name), design)
    return Study(design.name, design.title, design.description, design.origin, base, ())


def study_from_tree(tree: Tree, where: str, folder: Path, *, keep_going: bool = False) -> Study:
    """Build a study from its parsed tree; designs are looked for beside the file."""
    reader = Reader(where, folder)
    reader.only(tree, "", {"study", "variant", "sweep", "grid", "requirement", "monte_carlo", "nightly"})
    head = reader.table(tree, "study")
    reader.only(head, "study", {"name", "title", "description", "base", "validation"})
    base = reader.design(reader.text(head, "study", "base"))
    extra = reader.tables(tree, "requirement")
    base = _required(base, extra, reader)
    maker = _Maker(base, reader, extra, keep_going)
    variants = _bounded(chain(maker.variants(tree), maker.sweeps(tree), maker.grids(tree)), where)
    name = reader.text(head, "study", "name", base.name, LONGEST_NAME)
    first = Variant(base.name, slug(base.name), base)
    _check_names((first, *variants), reader)
    return Study(
        name,
        reader.text(head, "study", "title", ""),
        reader.text(head, "study", "description", ""),
        where,
        first,
        variants,
        reader.flag(head, "study", "validation", False),
        _plan(tree, reader),
    )


def _required(design: Design, extra: list[Tree], reader: Reader) -> Design:
    """Add the study's requirements, in place of those with the same id."""
    from actuator_lti.design import design_tree, with_overrides

    if not extra:
        return design
    replaced = [item.get("id") for item in extra]  # as written: what is no text is refused with its place
    kept = [item for item in design_tree(design).get("requirement", []) if item.get("id") not in replaced]
    return reader.located("requirement", lambda: with_overrides(design, {"requirement": [*kept, *extra]}))


def _plan(tree: Tree, reader: Reader) -> MonteCarloPlan | None:
    if "monte_carlo" not in tree:
        return None
    table = reader.table(tree, "monte_carlo")
    reader.only(table, "monte_carlo", {"samples", "seed"})
    return MonteCarloPlan(
        reader.integer(table, "monte_carlo", "samples", 1000, 1, SAMPLES.most),
        reader.integer(table, "monte_carlo", "seed", 0, 0, 2**63 - 1),
    )


def _check_names(variants: tuple[Variant, ...], reader: Reader) -> None:
    seen: set[str] = set()
    for variant in variants:
        if variant.name in seen:
            raise reader.error(
                f"variant.name = {reader.shown(variant.name)}: twice; allowed: names that differ"
            )
        seen.add(variant.name)


def _bounded(variants: Iterator[Variant], where: str) -> tuple[Variant, ...]:
    """Take variants until there are too many."""
    taken = []
    for variant in variants:
        taken.append(variant)
        STUDY_VARIANTS.check(len(taken), where)
    return tuple(taken)


@dataclass(frozen=True)
class _Maker:
    """Makes variants of a base."""

    base: Design
    reader: Reader
    requirements: list[Tree]
    keep_going: bool

    def variants(self, tree: Tree) -> Iterator[Variant]:
        reader = self.reader
        for place, table in enumerate(reader.tables(tree, "variant")):
            where = f"variant[{place + 1}]"
            reader.only(table, where, {"name", "base", "motor", "override"})
            name = reader.text(table, where, "name", None, LONGEST_NAME)
            overrides = dict(reader.table(table, "override", where, optional=True))
            if "motor" in table:
                overrides = {"motor": reader.motor(reader.text(table, where, "motor")), **overrides}
            origin = None
            if "base" in table:
                origin = reader.text(table, where, "base")
            yield self._made(name, overrides, origin)

    def sweeps(self, tree: Tree) -> Iterator[Variant]:
        for place, table in enumerate(self.reader.tables(tree, "sweep")):
            axis = read_axis(table, f"sweep[{place + 1}]", self.base, self.reader)
            yield from (self._point((axis,), (value,)) for value in axis.values)

    def grids(self, tree: Tree) -> Iterator[Variant]:
        reader = self.reader
        for place, table in enumerate(reader.tables(tree, "grid")):
            where = f"grid[{place + 1}]"
            reader.only(table, where, {"axes"})
            axes = tuple(
                read_axis(item, f"{where}.axes[{k + 1}]", self.base, reader)
                for k, item in enumerate(reader.tables(table, "axes", where))
            )
            if not axes:
                raise reader.error(f"{where}.axes: no axis; allowed: 1 to {GRID_AXES.most}")
            GRID_AXES.check(len(axes), reader.where, name=f"{where}.axes")
            size = prod(len(axis.values) for axis in axes)
            STUDY_VARIANTS.check(size, reader.where, name=where)
            for point in product(*(axis.values for axis in axes)):
                yield self._point(axes, point)

    def _point(self, axes: tuple[Axis, ...], point: tuple[Any, ...]) -> Variant:
        overrides = {axis.parameter: value for axis, value in zip(axes, point, strict=True)}
        return self._made(", ".join(f"{key} = {value}" for key, value in overrides.items()), overrides, None)

    def _made(self, name: str, overrides: Tree, origin: str | None) -> Variant:
        from actuator_lti.design import with_overrides

        def make() -> Design:
            start = self.base
            if origin is not None:
                start = _required(self.reader.design(origin), self.requirements, self.reader)
            return with_overrides(start, overrides) if overrides else start

        try:
            design = self.reader.located(f"variant {self.reader.shown(name)}", make)
        except InputError as error:
            if not self.keep_going:
                raise
            return Variant(name, slug(name), None, overrides, str(error))
        return Variant(name, slug(name), design, overrides)
