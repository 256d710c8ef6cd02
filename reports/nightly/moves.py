"""How far a figure may move before it counts as changed; where it changed for good, and whether it flaps.

Change points are those of the penalised least-squares segmentation into constant levels, exact by PELT
(Killick, Fearnhead, Eckley 2012; ruptures, linear kernel), penalty ``2 sigma^2 log n``, with sigma from the
median absolute first difference and never below a third of the figure's tolerance; steps of the level
smaller than the tolerance are dropped.
"""

import fnmatch
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from actuator_lti.asked.quantities import LOOP_QUANTITIES, QUANTITIES
from actuator_lti.design.units import parse_unit
from actuator_lti.errors import InputError
from analyses.records.single_rows import NORMAL
from reports.nightly.figures import Figure
from reports.nightly.text import one_line, to_seconds

RELATIVE = 1e-3
FLOOR = 1e-9  # below it a figure is rounding, whatever its unit
_BY_HEADING = {quantity.heading: quantity for quantity in QUANTITIES.values() if quantity.heading}
_BY_UNIT = {quantity.unit: quantity.tolerance for quantity in LOOP_QUANTITIES.values()} | {"samples": 0.01}
_BY_UNIT["ms"] = 1e3 * _BY_UNIT["s"]
MAX_RULES = 200


@dataclass(frozen=True)
class Rule:
    """One line of the study: figures whose name matches ``pattern``, and their tolerance."""

    pattern: str
    absolute: float
    relative: float
    unit: str = ""  # of ``absolute``; empty: that of the figure


@dataclass(frozen=True)
class Tolerances:
    """The rules of a study in their order; what none matches moves by what the registry of quantities has."""

    rules: tuple[Rule, ...] = ()

    def pair(self, figure: Figure) -> tuple[float, float]:
        """Absolute and relative tolerance of a figure; the larger one counts."""
        if figure.kind == "verdict":
            return 0.5, 0.0
        for rule in self.rules:
            if fnmatch.fnmatchcase(figure.name.lower(), rule.pattern.lower()):
                return rule.absolute * _turned(rule.unit or figure.unit, figure.unit), rule.relative
        quantity = _BY_HEADING.get(figure.name.rpartition(" / ")[2])
        if quantity is None:
            return _BY_UNIT.get(figure.unit, FLOOR), RELATIVE
        shown, factor = quantity.shown
        scale = 1.0 if figure.unit in (quantity.unit, "") else factor * (figure.unit == shown)
        return quantity.tolerance * scale or FLOOR, RELATIVE


def _turned(unit: str, own: str) -> float:
    """What one of a tolerance's unit is in that of a figure; 1 where it is none of its kind (dB, samples)."""
    try:
        stated, shown = parse_unit(unit), parse_unit(own)
    except ValueError:
        return 1.0
    return stated.factor / shown.factor if stated.dimension == shown.dimension else 1.0


def read_tolerances(table: Mapping[str, object], where: str) -> Tolerances:
    """Read ``{"*phase_margin*" = "0.5 deg", "*bandwidth*" = "1 %"}``; a bare number is in the figure's unit.

    >>> read_tolerances({"*bandwidth*": "1 %"}, "study.toml").rules
    (Rule(pattern='*bandwidth*', absolute=0.0, relative=0.01, unit=''),)
    """
    if len(table) > MAX_RULES:
        raise InputError(f"tolerance: {len(table)} rules: at most {MAX_RULES} are allowed", where=where)
    return Tolerances(tuple(_rule(str(pattern), value, where) for pattern, value in table.items()))


def _rule(pattern: str, value: object, where: str) -> Rule:
    text = str(value).strip()
    digits, _, unit = text.partition(" ")
    try:
        amount = float(digits.rstrip("%"))
    except ValueError:
        amount = math.nan
    if isinstance(value, bool) or not (amount >= 0.0 and math.isfinite(amount)):
        said = f"tolerance {one_line(pattern, 60)!r} = {one_line(text, 40)!r}"
        raise InputError(f"{said}: write a number of at least 0 and its unit, or a percentage", where)
    if unit.strip() == "%" or digits.endswith("%"):
        return Rule(pattern, 0.0, amount / 100.0)
    return Rule(pattern, amount, 0.0, unit.strip())


# ---- over the nights -------------------------------------------------------------------------------------

WINDOW = 14
LOOK_BACK = 365  # nights in which changes of level are looked for: the search takes their square
RETURNS = 2
_GAP_FACTOR = 1.75


@dataclass(frozen=True, kw_only=True)
class ChangePoint:
    """A night from which on the level is another: index into the values, level before and after."""

    index: int
    before: float
    after: float


def change_points(values: np.ndarray, tolerance: float) -> tuple[ChangePoint, ...]:
    """Find the nights (values, NaN where there is none) at which the level of a figure changed.

    Steps that are smaller than the tolerance, in the unit of the values, do not count.

    >>> [p.index for p in change_points(np.array([1.0, 1.0, np.nan, 1.0, 2.0, 2.0]), 0.1)]
    [4]
    """
    there = np.flatnonzero(np.isfinite(values))
    x = values[there]
    if len(x) < 2 or np.ptp(x) <= tolerance:
        return ()
    noise = NORMAL * float(np.median(np.abs(np.diff(x)))) / math.sqrt(2.0)
    scale = max(noise, tolerance / 3.0, 1e-12 * float(np.max(np.abs(x))))
    ends, z = [1], (x - x[0]) / scale
    if len(x) > 2:
        import ruptures

        search = ruptures.KernelCPD(kernel="linear", min_size=1)
        ends = search.fit_predict(z.reshape(-1, 1), pen=2.0 * math.log(len(x)))[:-1]
    levels = [float(np.mean(part)) for part in np.split(x, ends)]
    return tuple(
        ChangePoint(index=int(there[end]), before=before, after=after)
        for end, before, after in zip(ends, levels[:-1], levels[1:], strict=True)
        if abs(after - before) > tolerance
    )


def flaps(values: Sequence[float], tolerance: float) -> bool:
    """Whether a figure goes to and fro: within 14 nights twice or more back to where it was before.

    >>> flaps([1.0, 2.0, 1.0, 2.0], 0.1), flaps([1.0, 1.0, 2.0, 2.0], 0.1)
    (True, False)
    """
    x = [value for value in values if math.isfinite(value)][-WINDOW:]
    levels = x[:1] + [new for old, new in pairwise(x) if abs(new - old) > tolerance]
    return sum(abs(new - old) <= tolerance for old, new in zip(levels, levels[2:], strict=False)) >= RETURNS


def missing_nights(starts: Sequence[str]) -> tuple[tuple[int, int], ...]:
    """Nights without a run: ``(index of the run before the gap, how many are missing)``.

    A gap is a pause longer than 1.75 times the usual one (the median of the last 60).

    >>> missing_nights(["2026-01-0%dT02:00:00Z" % d for d in (1, 2, 3, 6, 7)])
    ((2, 2),)
    """
    pauses = np.diff([to_seconds(start) for start in starts])
    usual = float(np.median(pauses[-60:])) if len(pauses) >= 3 else 0.0
    if usual < 3600.0:
        return ()
    long = np.flatnonzero(pauses > _GAP_FACTOR * usual)
    return tuple((int(i), max(1, round(pauses[i] / usual) - 1)) for i in long)
