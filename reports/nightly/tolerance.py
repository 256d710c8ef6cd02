"""How far a figure may move before it counts as changed."""

from __future__ import annotations

import fnmatch
import math
from collections.abc import Mapping
from dataclasses import dataclass

from actuator_lti.asked.quantities import LOOP_QUANTITIES, QUANTITIES
from actuator_lti.errors import InputError
from reports.nightly.figures import Figure
from reports.nightly.text import one_line

RELATIVE = 1e-3
FLOOR = 1e-9  # below it a figure is rounding, whatever its unit
_IN_UNIT = {("s", "ms"): 1e3}
_BY_HEADING = {quantity.heading: quantity for quantity in QUANTITIES.values() if quantity.heading}
_BY_UNIT = {quantity.unit: quantity.tolerance for quantity in LOOP_QUANTITIES.values()} | {"samples": 0.01}
MAX_RULES = 200


@dataclass(frozen=True)
class Rule:
    """One line of the study: figures whose name matches ``pattern``, and their tolerance."""

    pattern: str
    absolute: float
    relative: float


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
                return rule.absolute, rule.relative
        quantity = _BY_HEADING.get(figure.name.rpartition(" / ")[2])
        if quantity is None:
            return _BY_UNIT.get(figure.unit, FLOOR), RELATIVE
        scale = 1.0 if figure.unit in (quantity.unit, "") else _IN_UNIT.get((quantity.unit, figure.unit), 0.0)
        return quantity.tolerance * scale or FLOOR, RELATIVE


def read_tolerances(table: Mapping[str, object], where: str) -> Tolerances:
    """Read ``{"*phase_margin*" = "0.5 deg", "*bandwidth*" = "1 %"}``; a bare number is in the figure's unit.

    Examples
    --------
    >>> read_tolerances({"*bandwidth*": "1 %"}, "study.toml").rules
    (Rule(pattern='*bandwidth*', absolute=0.0, relative=0.01),)
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
        raise InputError(
            f"tolerance {one_line(pattern, 60)!r} = {one_line(text, 40)!r}: write a number of at least 0 and"
            " its unit, or a percentage",
            where=where,
        )
    if unit.strip() == "%" or digits.endswith("%"):
        return Rule(pattern, 0.0, amount / 100.0)
    return Rule(pattern, amount, 0.0)
