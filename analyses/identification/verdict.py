"""What an identification is held to before it may become a design, item by item."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.stats import chi2

from actuator_lti.asked.verdict import Tally, Verdict
from actuator_lti.design import write_design
from actuator_lti.design.model import Design
from analyses.correlation.following import Followed
from analyses.estimation.fit import Fit
from analyses.estimation.parameters import UNSTATED, own_std, parameter
from analyses.identification.design_values import DesignValue, cause
from analyses.identification.friction_law import Bend
from analyses.identification.joint_model import JointModel
from analyses.identification.residuals import ResidualTest
from analyses.records.compared import COSINE
from analyses.records.factors import with_factor
from analyses.records.finding import NO_CHANCE, RATE_TOLERANCE, SURE, Finding, wrong_of
from analyses.records.rate import one_phase
from analyses.records.record import Record

RESIDUAL_LIMIT = 0.20  # largest relative residual that is taken without being told to
LARGEST_FACTOR = 3.0
MOST_DRY_UNLOADED = 2.0  # dry friction over the design's, where a load adds to it and none is recorded
LARGEST_OF_ANY = 10.0
LARGEST_LINE_ERROR = 0.5
ROWS_EACH = 10


@dataclass(frozen=True, kw_only=True)
class Item:
    """One thing that must hold: a share of the drive signal against its limit, or a statement."""

    id: str
    label: str
    passed: bool | None
    value: float | None = None
    limit: float | None = None
    reason: str = ""

    @property
    def verdict(self) -> Verdict:
        """In the word of every page."""
        return Verdict.of(self.passed)

    @classmethod
    def of(cls, id: str, label: str, wrong: str, **share: float) -> Item:
        """What holds but for ``wrong``; empty: it holds."""
        return cls(id=id, label=label, passed=not wrong, reason=wrong, **share)

    @classmethod
    def unproven(cls, id: str, label: str, why: str) -> Item:
        """What the records do not tell."""
        return cls(id=id, label=label, passed=None, reason=why)


@dataclass(frozen=True, kw_only=True)
class Identified:
    """The design that an identification comes to, its file, and whether it may be written."""

    design: Design
    items: tuple[Item, ...]
    accepted: bool = False
    unmade: str = ""  # why no design comes of what was found: ``design`` is then that it was held against

    @cached_property
    def text(self) -> str:
        """The design's file."""
        return write_design(self.design)

    @property
    def verdict(self) -> Verdict:
        """The worst of all items."""
        return Tally.of(item.verdict for item in self.items).verdict

    @property
    def passed(self) -> bool:
        """Whether nothing failed; what records do not tell is not proven, and lets it pass."""
        return self.verdict is not Verdict.NOT_MET


def inputs_item(record: str, findings: Sequence[Finding]) -> Item:
    """Whether a record agrees with itself and with the design's limits."""
    id, label = f"inputs-{record}", f"{record} agrees with itself and the design"
    if not findings:
        return Item.unproven(id, label, "nothing to hold it against")
    wrong, doubt = wrong_of(findings), next((one for one in findings if one.unproven), None)
    if doubt is not None and not wrong:
        return Item.unproven(id, label, f"{doubt.subject}: {doubt.text}")
    return Item.of(id, label, wrong)


def share_item(id: str, label: str, value: float, limit: float, otherwise: str) -> Item:
    """A share of the drive signal against its limit, and what it means beyond."""
    return Item.of(id, label, "" if value <= limit else otherwise, value=value, limit=limit)


def residual_item(residual: float, limit: float) -> Item:
    """The relative residual of the fit."""
    why = "the model does not explain these records"
    return share_item("residual", "Relative residual of the fit", residual, limit, why)


def law_items(bend: Bend | None, model: JointModel, axis: str, feigned: str = "") -> Iterator[Item]:
    """Whether the residual asks for another friction law; beside a map the intervals hold it.

    ``feigned``: what may feign a bend.
    """
    if bend is None:
        return
    unit, sure = "m/s" if axis == "linear" else "rad/s", f"({bend.errors:.1f} standard errors)"
    said = f"below {bend.speed_rad_s:.3g} {unit} the friction leaves its law over the speed {sure}"
    cure = "--friction map finds it"
    if np.isinf(bend.speed_rad_s):
        said, cure = f"its slope differs by direction {sure}", "--friction per-direction finds it"
    passed, why = (None, "the intervals hold it") if model.knots_rad_s else (False, cure)
    if feigned:
        passed, why = None, f"{why}, or {feigned}"
    label, reason = "Friction law of the fit is that of the records", f"{said}: {why}"
    if not bend.is_sure:
        passed, reason = True, ""
    yield Item(id="law", label=label, passed=passed, reason=reason)


def independence_items(tests: Sequence[ResidualTest]) -> Iterator[Item]:
    """Inputs on which a residual hangs, beyond chance in all that were tried."""
    asked = [test for test in tests if test.input]
    for test in (one for one in asked if len(asked) * one.chance < NO_CHANCE):
        said = f"it hangs on it at a lag of {test.lag} rows: something is not modelled"
        label = f"{test.record}: residual independent of the {test.input}"
        why = f"{said}, the intervals need not hold it"
        yield Item.unproven(f"independent-{test.record}-{test.input}", label, why)


def noise_items(model: JointModel) -> Iterator[Item]:
    """Noise of a recorded motion that took more from the inertia than its standard error."""
    if model.noise_share * model.get("inertia", 0.0) > model.std("inertia") > 0.0:
        why = f"{100.0 * model.noise_share:.2g} % of its square is noise of the recorded motion, white as it"
        why += " is from row to row, which took as much from the inertia: given back; a command tells better"
        yield Item.unproven("noise", "Acceleration without noise", why)


def kept_items(fit: Fit, held: Collection[str], axis: str = "rotary") -> Iterator[Item]:
    """What the records neither confirm nor deny: the design's values, but for those held as asked.

    One of 0 that moves no other value is none of the drive; a ``gravity_cos`` of 0 is the design's offset.
    """
    for name, kept in fit.fixed.items():
        if (kept.value or kept.moves or name == "gravity_cos") and name not in held:
            yield Item.unproven(f"kept-{name}", parameter(name, axis).label, kept.reason)


def made_items(unmade: str, before: Design, made: Design) -> Iterator[Item]:
    """That no design comes of what was found; a friction map of the design that it takes the place of."""
    if unmade:
        yield Item.of("made", "A design comes of what is found", unmade)
    if before.friction.points and not made.friction.points:
        why = "viscous and dry friction take its place; --friction map finds a map"
        yield Item.unproven("map", "Friction map of the design", why)


def feigned_law(*, late: bool, reversals: bool) -> str:
    """What may feign another friction law; empty where nothing does."""
    if late:
        return "a filter feigns it, where current and motion are not at one time"
    return "reversals feign it, which no command tells" if reversals else ""


def lag_items(late_s: float, late: bool) -> Iterator[Item]:
    """A current that is, or may be, later than the motion by more than a sample."""
    if late:
        said = f"{1e3 * late_s:.2g} ms off, or not told closer: what is sure is taken back as a delay"
        why = f"{said}; the intervals hold what a filter of first order would make of it"
        yield Item.unproven("lag", "Current and motion at one time", why)


def phase_items(design: Design, model: JointModel, records: Sequence[Record]) -> Iterator[Item]:
    """Values less a bias that hangs on when rows are taken: all at one phase of a loop that runs more rarely.

    What a loop makes of a jump between the rows is then a share of the acceleration, as inertia is.
    """
    moved = {name: one / model[name] for name, one in model.bias.items() if abs(one) > SURE * model.std(name)}
    shares = [f"{100.0 * one:.2g} % of {parameter(name, design.axis).label}" for name, one in moved.items()]
    rows = [record.name for record in records if one_phase(design, replace(record, between=""))]
    if shares and rows:
        why = f"all rows of {', '.join(rows)} are at one phase of the outer loop, taken to be its tick: "
        why += f"{', '.join(shares)} is taken off for that; log faster, or at another period"
        yield Item.unproven("phase", "Rows at the outer loop's ticks", why)


def sampling_items(record: Record) -> Iterator[Item]:
    """Whether the current is sampled fast enough for its mean between the samples to be known, and when."""
    if record.as_read is not None:
        why = "irregular, assumed to be right: with jitter of the stamps the inertia comes out too small"
        if lost := record.as_read.rows_missing:
            grid = f"a regular grid of {1e3 * record.period_s:.6g} ms"
            why = f"{lost} rows are missing on {grid}, filled by straight lines"
        yield Item.unproven(f"times-{record.name}", f"{record.name}: times of the rows", why)
    x = record.signals.get("current", np.zeros(0))
    if len(x) < 3 or not np.any(x):
        return
    line = x[1:-1] - 0.5 * (x[:-2] + x[2:])
    off = float(np.sqrt(np.mean(line**2)) / np.sqrt(np.mean(x**2)))
    reason = f"the current leaves the line between its neighbours by {100.0 * off:.0f} % of its rms: "
    reason += "sampled too slowly, or noise; the inertia cannot be trusted"
    label = f"{record.name}: current sampled fast enough"
    yield Item.of(f"sampling-{record.name}", label, reason if off > LARGEST_LINE_ERROR else "")


def simulated_item(record: str, error: float, limit: float, how: str) -> Item:
    """How far the written design is from a record."""
    why = "the written design does not drive as the record does"
    return share_item(f"written-{record}", f"Written design against {record}, {how}", error, limit, why)


def size_item(design: Design, values: Sequence[DesignValue], *, kept_constants: bool, loaded: bool) -> Item:
    """Identified values against those that the design had, each and by the one cause that explains all.

    ``kept_constants``: torques are the current times the design's own constant; ``loaded``: a record holds
    the load.
    """
    reasons = []
    if explained := cause(values):
        words, factor, error = explained
        why = f"a factor {factor:.3g} (standard error {error:.1g}) in {words}"
        reasons.append(with_factor(f"identified values are off as by {why}", factor))
    feels = design.friction.load_coefficient > 0.0 and not loaded
    for one in values:
        kind = one.name.partition("_")[0]
        off = f"{parameter(one.name, design.axis).label} is {one.ratio:.3g} times the design's"
        most = LARGEST_FACTOR if kind == "inertia" else LARGEST_OF_ANY
        if one.agrees:
            continue
        if kind == "back" and kept_constants:
            with_it = "so kM and all torques are as far off: --electrical takes it from the record"
            reasons.append(f"{off}, {with_it}")
        elif not 1.0 / most <= one.ratio <= most:
            known = {design.total_ratio: f"the reduction {design.total_ratio:g}"}
            reasons.append(with_factor(off, one.ratio, known))
        elif kind == "dry" and one.ratio > (MOST_DRY_UNLOADED if feels else LARGEST_FACTOR):
            load = (one.found - one.design) / max(design.friction.load_coefficient, 1e-300)
            why = f": as under a load of {load:.3g} {design.load_unit}, not recorded"
            reasons.append(off + why * feels)
    label, passed = "Identified values are of the design's size", not reasons if values else None
    return Item(id="size", label=label, passed=passed, reason=next(iter(reasons), ""))


def offset_items(design: Design, fit: Fit) -> Iterator[Item]:
    """A constant torque that is not the design's, beyond chance with both errors; the values hold."""
    key = "friction.offset_torque"
    if "offset" not in fit.names:
        return
    own = design.friction.offset_torque_Nm
    more, allowed = fit["offset"] - own, own_std(design, key) or UNSTATED * abs(own)
    std = float(np.hypot(fit.std("offset"), allowed))
    if chi2.sf((more / max(std, 1e-300)) ** 2, 1) > NO_CHANCE:
        return
    unit, stated = parameter("offset", design.axis).unit, key in design.parameters
    beside = f"beside the design's {own:.3g} {unit}" if stated else "that the design does not state"
    why = f"{more:+.3g} {unit} {beside}: a load not recorded, or an offset of the current"
    label = "Constant torque is the design's" if design.axis == "rotary" else "Constant force is the design's"
    yield Item.unproven("offset", label, why)


def following_item(record: str, followed: Followed) -> Item:
    """Whether the record follows its command as the design's loops do at this motion."""
    label = f"{record}: the command is followed as by the design's loops"
    id = f"following-{record}"
    if followed.zero or followed.cosine < COSINE:
        return Item.of(id, label, followed.words)
    return share_item(id, label, max(abs(followed.clock), abs(followed.off)), RATE_TOLERANCE, followed.words)
