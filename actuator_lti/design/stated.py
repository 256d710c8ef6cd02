"""A number as a file states it, in SI: by the axis, its screw, and the amperes of the motor's data sheet."""

import re
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from math import isinf, pi, sqrt
from typing import Any

from actuator_lti.design.field import Axis, Field, Structure
from actuator_lti.design.fields import FIELDS
from actuator_lti.design.plant import DC_PER_A, MotorConstants
from actuator_lti.design.spellings import split_quantity
from actuator_lti.design.units import AdvisedError, ampere_unit, parse_limit, parse_quantity
from actuator_lti.errors import InputError

CONVENTION = re.compile(r"(?<=[AV])[ _]?\(?(rms|eff|peak|pk|p|phase)\b\)?", re.IGNORECASE)
_OF_SHEET = re.compile(rf"{CONVENTION.pattern}|(?<=A)[ _]?\(?(dc)\b\)?", re.IGNORECASE)
_DIRECT = re.compile(r"(?<=A)[ _]?dc\b", re.IGNORECASE)
_MAINS = re.compile(r"(?<=V)[ _]?\(?(?:ac|rms|eff)\b\)?|(?<=V) ?~", re.IGNORECASE)
_RANGE = re.compile(r"(?<=[0-9]) *(?:[-–]|to) *(?=[0-9])")
# A lead in mm/rev, an encoder of counts/rev.
_PER_TURN = re.compile(r"\s*(?:/|\bper\b)\s*(?:rev(?:olution)?|turn|U|r)\.?\s*\Z")
_PER_TRAVEL = re.compile(r"/ *\(?[kcmnuµ]?m\b")  # of a linear encoder
_AMPERE, _SIZED = re.compile(r"\bA\b"), re.compile(r"\b[AV]\b")
_OF_AMPERE: dict[str, MotorConstants] = {"rms": "rms-line", "eff": "rms-line", "dc": "dc"}
PHASE = "V/A phase"
_UPSIDE_DOWN = {
    "motor.back_emf_constant": (1.0, "{angle}/(V*s)"),  # "83.4 rpm/V"
    "motor.cogging_periods": (2.0 * pi, "{angle}"),
    "control.period": (2.0 * pi, "rad/s"),  # "16 kHz"
}


@dataclass(frozen=True)
class Frame:
    """What a number of a file is read by; ``travel_m_rad`` is that of a screw, None without one."""

    structure: Structure
    constants: MotorConstants
    travel_m_rad: float | None = None

    @property
    def motor_axis(self) -> Axis:
        return self.structure.axis if self.travel_m_rad is None else "rotary"

    def per_metre(self, section: str) -> bool:
        """Whether the counts of an encoder are those of a metre, not of a revolution."""
        behind_screw = section == "encoder" and self.travel_m_rad is not None
        return self.structure.axis == "linear" and not behind_screw

    def quantity(self, text: Any, field: Field) -> float:
        """The SI value of a text; behind a screw also from the units of a rotary axis.

        A speed constant is read as the back-EMF constant that it is upside down (that of a motor stated per
        phase is line-line, as makers have it), a sampling rate as its period, a magnet pitch as its order,
        amperes rms or peak as those of the motor that the model has.
        """
        unit = field.unit(self.structure)
        if isinstance(text, str):
            turn = field.key == "counts_per_rev" and not self.per_metre(field.section)
            text = _PER_TURN.sub("", text) if turn or field.key == "lead" else text
            if field.path == "limits.voltage" and _MAINS.search(text):
                _refuse_mains(_MAINS.sub("", text))
            sheet = field.section == "motor" and self.constants != "dc"
            words = _OF_SHEET if sheet else CONVENTION
            if said := {text[of.start() - 1]: of[of.lastindex or 1].lower() for of in words.finditer(text)}:
                plain = self.quantity(words.sub("" if sheet else " dc", text), field)
                return plain * self._amperes(field, unit, said)
        counted = field.key == "counts_per_rev" and self.structure.axis == "linear"
        if counted and _PER_TRAVEL.search(f"{text}"):
            whole_m = 1.0 if self.per_metre(field.section) else 2.0 * pi * (self.travel_m_rad or 0.0)
            counts = parse_quantity(text, "count/m") * whole_m  # of a metre, or of a lead
            return float(round(counts)) if abs(counts - round(counts)) <= 1e-9 * counts else counts
        refused: list[InputError] = []
        for one, factor in self._units(field).items():
            try:
                value = parse_quantity(text, one) * factor
            except InputError as error:
                refused.append(error)
            else:
                return self._said(text, field, unit, value)
            if (turned := _turned(field.path, text, one)) is not None:
                line = field.key == "back_emf_constant" and self.constants == "peak-phase"
                return turned * factor / (sqrt(3.0) if line else 1.0)
        refused = [one for one in refused if isinstance(one, AdvisedError)] or refused
        raise refused[-1 if field.section in ("load", "command", "validation") else 0]

    def _units(self, field: Field) -> dict[str, float]:
        """Units that a key is read in, in this order, and what one is in SI: behind a screw both axes'."""
        unit, rotary = (field.unit(one) for one in (self.structure, replace(self.structure, axis="rotary")))
        power = field.travel_power()
        if self.travel_m_rad is None or not power or rotary == unit:
            return {unit: 1.0}
        return {rotary: self.travel_m_rad**power, unit: 1.0}

    def upside_down(self, text: Any, field: Field) -> bool:
        """Whether a text states one over the value: a speed constant, a sampling rate, a pitch."""
        for unit in self._units(field):
            with suppress(InputError):
                parse_quantity(text, unit)
                return False
            if _turned(field.path, text, unit) is not None:
                return True
        return False

    def limit(self, text: Any, unit: str) -> float:
        """A limit of a requirement, in the unit in which its quantity is reported; amperes as of [limits]."""
        return self.quantity(text, FIELDS["limits.peak_current"]) if unit == "A" else parse_limit(text, unit)

    def _said(self, text: Any, field: Field, unit: str, value: float) -> float:
        """The value, unless an AC motor has several amperes that the text may mean."""
        which = ampere_unit(field.path, unit, self.constants)
        if which == unit or value == 0.0 or isinf(value) or not isinstance(text, str) or _DIRECT.search(text):
            return value
        own = which.replace("dc", "rms" if self.constants == "rms-line" else "peak")
        gain = unit.startswith("V/A")
        raise InputError(
            f"which amperes of the AC motor is not said; allowed: {own} (its data sheet's"
            f"{', volts line-line' * gain}) or {which} (the model's)"
            f"{f'; of a dq controller, of a phase: {PHASE}' * gain}"
        )

    def _amperes(self, field: Field, unit: str, said: Mapping[str, str]) -> float:
        """From amperes rms or peak to those of the model; constants of the motor to those of its convention.

        i = sqrt(3/2) I_rms = sqrt(3)/2 I_peak; kE against kM tells a wrong convention. The volts of a gain
        are peak line-line; ``said`` of them may be rms.
        """
        convention = said.get("A") or said["V"]
        if convention == "phase" and self.constants != "dc":
            if not unit.startswith("V/A"):
                raise InputError(f"allowed: a phase only in {PHASE}, a gain of volts over amperes")
            return 2.0  # R and L line-line are twice those of a phase
        given = _OF_AMPERE.get(convention, "peak-phase")
        if self.constants == "dc":
            phase = ", where R and L are per phase" * (given == "peak-phase")
            plain = "where the sheet's R, L, kM and kE are line-line and in these amperes: A"
            if not _AMPERE.search(unit):
                plain = "beside the constants of a DC motor: V, the peak line-line, sqrt(2) times the rms"
            raise InputError(f'allowed: with motor.constants = "{given}"{phase}; {plain}')
        own = field.section == "motor"
        above, _, below = unit.partition("/")
        sized = _SIZED if own else _AMPERE
        power = len(sized.findall(above)) - len(sized.findall(below))
        if not (own or power):
            raise InputError(f"allowed: a number with a unit like {unit}, as the model has it")
        volts = sqrt(2.0) if not own and said.get("V") in ("rms", "eff") else 1.0
        return volts * float((DC_PER_A[given] / (DC_PER_A[self.constants] if own else 1.0)) ** power)

    def other_axis(self, raw: Any, field: Field) -> str:
        other = replace(self.structure, axis="linear" if self.structure.axis == "rotary" else "rotary")
        unit = field.unit(other)
        try:
            parse_quantity(raw, unit)
        except InputError:
            return ""
        return f'; {unit} with design.axis = "{other.axis}"' if unit != field.unit(self.structure) else ""


def _refuse_mains(text: str) -> None:
    *low, high = _RANGE.split(text)  # 100-120 V
    each = [f"{number} {split_quantity(high)[1]}" for number in low] + [high]
    volts = " to ".join(f"{sqrt(2.0) * parse_quantity(one, 'V'):.4g} V" for one in each)
    raise InputError(f"the bus is direct; allowed: sqrt(2) times the mains behind a rectifier, {volts}")


def _turned(path: str, text: Any, unit: str) -> float | None:
    """A value that data sheets state upside down; None where it is not stated so."""
    one, turned = _UPSIDE_DOWN.get(path, (1.0, ""))
    try:
        value = parse_quantity(text, turned.format(angle=unit.rpartition("/")[2])) if turned else 0.0
    except InputError:
        return None
    if turned and value <= 0.0:
        raise InputError("allowed: above 0")
    return one / value if turned else None
