"""From a recorder's unit to SI."""

from __future__ import annotations

from dataclasses import dataclass

from actuator_lti.design.units import compatible, parse_unit
from actuator_lti.errors import InputError
from analyses.estimation.arrays import FloatArray
from analyses.records.naming import KNOWN_UNITS
from analyses.records.spec import AC_FORMS, TO_LINE, SignalColumn


@dataclass(frozen=True)
class Converter:
    """``(raw + offset) * factor``, and the SI unit of the result."""

    offset: float
    factor: float
    si_unit: str

    def __call__(self, raw: FloatArray) -> FloatArray:
        return (raw + self.offset) * self.factor


def unit_factor(unit: str, known: str | None, what: str) -> float:
    """Factor from ``unit`` to SI; refused where its dimension is not that of ``known``."""
    try:
        result = parse_unit(unit)
        wanted = parse_unit(known) if known is not None else None
    except ValueError as error:
        raise InputError(f'{what}.unit = "{unit}": {error}') from None
    if wanted is not None and not compatible(result, wanted):
        raise InputError(f'{what}.unit = "{unit}": must be a unit like {known}')
    return result.factor


def converter(signal: SignalColumn) -> Converter:
    """The conversion of one signal.

    Examples
    --------
    >>> import numpy as np
    >>> rpm = converter(SignalColumn(name="speed", column="n", unit="rpm"))
    >>> rpm(np.array([9000.0])).round(3).tolist(), rpm.si_unit
    ([942.478], 'rad/s')
    """
    known = KNOWN_UNITS.get(signal.name)
    factor = unit_factor(signal.unit, known, f"signals.{signal.name}")
    forms = AC_FORMS.get(known or "")
    if forms is None and signal.value != "dc":
        raise InputError(f'signals.{signal.name}.value = "{signal.value}": only of a current or a voltage')
    factor *= 1.0 if forms is None else forms[signal.value]
    factor *= TO_LINE if signal.between == "phase" else 1.0
    return Converter(signal.offset, signal.scale * factor, known or f"SI of {signal.unit}")
