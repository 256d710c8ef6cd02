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
    # base = "other.toml"                    # another design in place of the base

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

    [monte_carlo]                            # read by the nightly alone: samples of every design
    samples = 1000
    seed = 0

    [nightly]                                # and a PDF beside each report
    pdf = true
"""

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import product
from math import prod
from pathlib import Path
from typing import Any, Literal

import numpy as np

from actuator_lti.bounds import AXIS_POINTS, GRID_AXES, SAMPLES, STUDY_VARIANTS
from actuator_lti.design import design_tree, load_design, shipped_designs, with_overrides
from actuator_lti.design.fields import Structure, field_of
from actuator_lti.design.loader import design_from_tree
from actuator_lti.design.mistakes import Findings, lines_of
from actuator_lti.design.model import Design
from actuator_lti.errors import InputError, as_one
from actuator_lti.files.reading import Tree, parse_toml, read_text, read_toml, shown, shown_path
from analyses.slugs import slug
from analyses.toml_tables import Table


@dataclass(frozen=True, kw_only=True)
class _Axis:
    """A parameter and how its values lie; beside it stand ``values``, or ``from`` and ``to``."""

    parameter: str
    points: int = 5
    spacing: Literal["linear", "log"] = "linear"


def _values(table: Table, base: Design) -> tuple[Any, ...]:
    """Texts or numbers: ``values``, or those between ``from`` and ``to``."""
    one, most = table.read(_Axis, beside=("values", "from", "to")), AXIS_POINTS.most
    if "values" in table:
        values = table.data["values"]
        good = isinstance(values, list) and 0 < len(values) <= most
        if not good or not all(isinstance(v, str | int | float) for v in values):
            raise table.fail("values", f"allowed: a list of 1 to {most} texts or numbers")
        return tuple(values)
    field, log = field_of(one.parameter), one.spacing == "log"
    if field is None or field.kind != "quantity":
        raise table.fail("parameter", "allowed: a key with a quantity")
    unit = field.unit(Structure.of(base))
    low, high = (table.quantity(key, unit) for key in ("from", "to"))
    if not 2 <= one.points <= most:
        raise table.fail("points", f"allowed: a whole number, 2 to {most}")
    if log and not min(low, high) > 0.0:
        raise table.fail("spacing", 'allowed: "log" between values above 0')
    texts = [f"{value:.6g}" for value in (np.geomspace if log else np.linspace)(low, high, one.points)]
    return tuple(float(text) if unit == "1" else f"{text} {unit}" for text in texts)


LONGEST_NAME = 200


@dataclass(frozen=True)
class Variant:
    name: str  # as written, any text, never used as a path
    slug: str  # its form in file names, unique in the study
    design: Design | None  # ``None`` where it was refused
    overrides: Mapping[str, Any] = field(default_factory=dict)  # dotted keys as written
    error: str = ""  # why it was refused


@dataclass(frozen=True)
class MonteCarloPlan:
    samples: int = 1000
    seed: int = 0


@dataclass(frozen=True)
class Study:
    """A base design, with the study's own requirements, and its variants in the order of the file."""

    name: str
    title: str
    description: str
    origin: str
    base: Variant
    variants: tuple[Variant, ...]
    validation: bool = False
    monte_carlo: MonteCarloPlan | None = None
    nightly: Mapping[str, Any] = field(default_factory=dict)  # the table that the nightly reads

    @property
    def all(self) -> tuple[Variant, ...]:
        return (self.base, *self.variants)


def study_or_design(path: str | Path, *, keep_going: bool = False) -> Study | Design:
    """A study of a TOML file with a ``[study]`` table, as `load_study`; else the design that is named."""
    try:
        there = Path(path).is_file()
    except OSError:  # a name that is too long, say: whoever reads it as a design tells
        there = False
    if there and "study" in parse_toml(text := read_text(path, "study file"), shown_path(path)):
        return _study_of_text(text, path, keep_going=keep_going)
    return load_design(path)


def load_study(path: str | Path, *, keep_going: bool = False) -> Study:
    """Read a study file: TOML, at most 1 MiB and 10000 variants (`actuator_lti.bounds`).

    With ``keep_going`` a variant that its design's checks refuse is kept, with its error; without, and for
    all else, an `InputError` says file, key, value and what is allowed.
    """
    return _study_of_text(read_text(path, "study file"), path, keep_going=keep_going)


def _study_of_text(text: str, path: str | Path, *, keep_going: bool) -> Study:
    where = shown_path(path)
    tree = parse_toml(text, where)
    root = Table(tree, "", where)
    root.only(("study", "variant", "sweep", "grid", "requirement", "monte_carlo", "nightly"))
    asked = [dict(table.data) for table in root.tables("requirement")]
    return _Maker(root, asked, lines_of(text, tree), Path(path).parent, keep_going).study()


def study_of(design: Design) -> Study:
    """A study of one design, without variants."""
    base = Variant(design.name, slug(design.name), design)
    return Study(design.name, design.title, design.description, design.origin, base, ())


@dataclass(frozen=True, kw_only=True)
class _Head:
    """The table ``[study]``."""

    base: str
    name: str | None = None
    title: str = ""
    description: str = ""
    validation: bool = False


@dataclass(frozen=True, kw_only=True)
class _Written:
    """A ``[[variant]]``; beside it stands ``override``."""

    name: str
    base: str | None = None
    motor: str | None = None


def _name(table: Table, name: str) -> str:
    if not 0 < len(name.strip()) <= len(name) <= LONGEST_NAME:
        raise table.fail("name", f"allowed: a text of 1 to {LONGEST_NAME} characters")
    return name


@dataclass(frozen=True)
class _Maker:
    root: Table
    asked: list[Tree]  # the study's own requirements
    lines: Mapping[str, int]  # of its keys
    folder: Path  # where designs are looked for: beside the file
    keep_going: bool

    def study(self) -> Study:
        root, head = self.root, self.root.table("study").read(_Head)
        base, variants = self._design(head.base), list[Variant]()
        for variant in self._variants(base):
            variants.append(variant)
            STUDY_VARIANTS.check(len(variants), root.origin)
        first = Variant(base.name, slug(base.name), base)
        for name, times in Counter(variant.name for variant in (first, *variants)).items():
            if times > 1:
                reason = f"variant.name = {shown(name)}: twice; allowed: names that differ"
                raise InputError(reason, where=root.origin)
        name = _name(root.table("study"), base.name if head.name is None else head.name)
        table, plan = root.table("monte_carlo"), None
        if "monte_carlo" in root:
            plan = table.read(MonteCarloPlan)
            for key, least, most in (("samples", 1, SAMPLES.most), ("seed", 0, 2**63 - 1)):
                if not least <= getattr(plan, key) <= most:
                    raise table.fail(key, f"allowed: a whole number, {least} to {most}")
        about, nightly = (name, head.title, head.description, root.origin), root.table("nightly").data
        return Study(*about, first, tuple(variants), head.validation, plan, nightly)

    def _design(self, name: str) -> Design:
        """A shipped design by name, or a file; with the requirements in place of its own with the same id."""
        design = load_design(name if name in shipped_designs() else self.folder / name)
        if not self.asked:
            return design
        tree, replaced = design_tree(design), [item.get("id") for item in self.asked]
        kept = [item for item in tree.get("requirement", []) if item.get("id") not in replaced]
        tree["requirement"] = [*self.asked, *kept]  # numbered as in the study
        return design_from_tree(tree, design.origin or design.name, Findings(self.root.origin, self.lines))

    def _variants(self, base: Design) -> Iterator[Variant]:
        """All of a file: variants, then sweeps, then grids; a sweep is a grid of one axis."""
        for table in self.root.tables("variant"):
            one = table.read(_Written, beside=("override",))
            overrides = dict(table.table("override").data)
            if one.motor is not None:
                motor = read_toml(self.folder / one.motor, "file with a [motor] table").get("motor")
                if not isinstance(motor, dict):
                    message = "no [motor] table; allowed: a TOML file with one"
                    raise InputError(message, where=shown_path(one.motor))
                overrides = {"motor": motor, **overrides}
            yield self._made(_name(table, one.name), overrides, base, one.base)
        for table in self.root.tables("sweep"):
            yield from self._points(table, [table], base)
        for table in self.root.tables("grid"):
            table.only(("axes",))
            yield from self._points(table, table.tables("axes"), base)

    def _points(self, table: Table, axes: list[Table], base: Design) -> Iterator[Variant]:
        where = self.root.origin
        if not axes:
            raise InputError(f"{table.path}.axes: no axis; allowed: 1 to {GRID_AXES.most}", where)
        GRID_AXES.check(len(axes), where, name=f"{table.path}.axes")
        values = [_values(axis, base) for axis in axes]
        STUDY_VARIANTS.check(prod(map(len, values)), where, name=table.path)
        for point in product(*values):
            overrides = {axis.data["parameter"]: value for axis, value in zip(axes, point, strict=True)}
            name = ", ".join(f"{key} = {value}" for key, value in overrides.items())
            yield self._made(name, overrides, base)

    def _made(self, name: str, overrides: Tree, base: Design, origin: str | None = None) -> Variant:
        """A variant; what refuses it names the study file and the variant."""
        where = self.root.origin
        try:
            start = base if origin is None else self._design(origin)
            design = with_overrides(start, overrides) if overrides else start
        except InputError as error:
            each = getattr(error, "mistakes", [error])
            messages = [one.message if one.where == where else str(one) for one in each]
            refused = as_one([InputError(f"variant {shown(name)}: {one}", where=where) for one in messages])
            if not self.keep_going:
                raise refused from error
            return Variant(name, slug(name), None, overrides, str(refused))
        return Variant(name, slug(name), design, overrides)
