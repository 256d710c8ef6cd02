"""What is asked and known of a drive as data: studies, requirements, tolerances, pedigree, objects."""

import copyreg
from dataclasses import dataclass, field
from math import inf
from types import MappingProxyType
from typing import Annotated, Any, Literal

import numpy as np

from actuator_lti.asked.quantities import QUANTITIES
from actuator_lti.design.field import (
    Axis,
    choice,
    day,
    label,
    limit,
    not_negative,
    positive,
    quantities,
    quantity,
    text,
)

# fmt: off
Rotor = Literal["free", "locked"]
ResponseTo = Literal["command", "reference"]
ObjectFamily = Literal["", "faulhaber-mc-v3"]


@dataclass(frozen=True, kw_only=True)
class Failure:
    """What is asked of the failure cases: deflections from where the output was, a load from the start."""

    stop_rad: Annotated[float | None, positive("mechanical stop; default the full deflection",
        example="25 deg")] = None
    deflection_rad: Annotated[float | None, positive("deflection to which the time is taken; default a "
        "tenth of the stop", example="2 deg")] = None
    detection_s: Annotated[float | None, positive("from a failure to its detection; default 0.1 s",
        key="detection_time", high=1e4, example="50 ms")] = None
    load_Nm: Annotated[float | None, quantity("load torque that pushes the output forward; default none",
        example="4 N*m")] = None
    speed_rad_s: Annotated[float | None, positive("speed at which a speed drive turns before, output side; "
        "default half its top speed", example="100 deg/s")] = None


@dataclass(frozen=True, kw_only=True)
class DutyCycle:
    """The duty within the continuous rating; ``None`` is what `analyses.duty.Asked` takes for it."""

    amplitude_rad: Annotated[float | None, positive("peak of the motion, output side; default half the full "
        "deflection", example="5 deg")] = None
    speed_rad_s: Annotated[float | None, positive("peak speed of a speed drive, output side; default half "
        "its top speed", example="100 deg/s")] = None
    current_A: Annotated[float | None, positive("peak current of a drive that is commanded in current; "
        "default half the peak current", example="5 A")] = None
    frequency_rad_s: Annotated[float | None, positive("of the motion; default 1 Hz", unit="rad/s",
        example="0.5 Hz")] = None
    ramp_s: Annotated[float | None, not_negative("rise and fall of a trapezoid, each; 0 is a sine, the "
        "default but for a speed drive: twice the time that its acceleration takes", high=1e6,
        example="0.2 s")] = None
    load_Nm: Annotated[float | None, quantity("load torque, all the time; default the largest of "
        "validation.loads, against a speed drive", example="4 N*m")] = None
    share: Annotated[float | None, positive("share of the time in motion; default 1", high=1.0,
        example="0.4")] = None
    cycle_s: Annotated[float | None, positive("one motion and one rest together; default 10 s", high=1e6,
        example="60 s")] = None


def default_deflection(axis: Axis) -> float:
    """Full deflection where a design states none: 10 deg, or 0.01 m on a linear axis."""
    return 0.01 if axis == "linear" else 0.17453292519943295


@dataclass(frozen=True, kw_only=True)
class Validation:
    """What the validator and the report are to look at: deflections (output side) and load torques."""

    full_deflection_rad: Annotated[float, positive("largest amplitude to look at, output side",
        example="10 deg")]
    amplitude_fractions: Annotated[tuple[float, ...], quantities("amplitudes as fractions of the full "
        "deflection", low=1e-09, high=1.0)] = (0.05, 0.1, 0.25, 0.5, 1.0)
    loads_Nm: Annotated[tuple[float, ...], quantities("load torques to look at")] = (0.0,)


@dataclass(frozen=True, kw_only=True)
class Requirement:
    """A limit on a figure; ``loop`` is a loop name, ``"every"``, or ``None`` for the whole drive."""

    id: Annotated[str, label("what reports call it")]
    quantity: Annotated[str, choice("the figure that is limited", tuple(QUANTITIES))]
    loop: Annotated[str | None, text("name of a loop, or every; not for a figure of the drive")] = None
    rotor: Annotated[Rotor | None, choice("which current loop is meant; default free")] = None
    to: Annotated[ResponseTo | None, choice("which response of the position loop: to the user's command "
        "(default), its profile and filter included, or to the reference behind them")] = None
    minimum: Annotated[float | None, limit("smallest value allowed")] = None
    maximum: Annotated[float | None, limit("largest value allowed")] = None
    load_Nm: Annotated[float | None, quantity("load torque at which it holds")] = None
    source: Annotated[str, text("where the limit comes from")] = ""
    note: Annotated[str, text("any remark")] = ""
    unit: str

    @property
    def bound(self) -> Any:
        """Its limit, the lower one where it has both."""
        return self.maximum if self.minimum is None else self.minimum

    def nearer(self, value: float) -> float:
        """Of its limits the one that a value is nearer to."""
        limits = (one for one in (self.minimum, self.maximum) if one is not None)
        return min(limits, key=lambda limit: abs(value - limit))

    @property
    def size(self) -> float:
        """What a distance is measured against: the limit itself, or the usual size of such a figure."""
        return abs(self.bound) or QUANTITIES[self.quantity].size

    def distance(self, value: Any) -> Any:
        """Of a value, or an array of them, to the nearer limit, in its unit, positive on the good side.

        >>> float(Requirement(id="a", quantity="gain_margin", unit="dB", minimum=6.0).distance(9.5))
        3.5
        """
        least = -inf if self.minimum is None else self.minimum
        most = inf if self.maximum is None else self.maximum
        with np.errstate(invalid="ignore"):  # of a value that is itself unlimited, too
            return np.fmin(value - least, most - value)


@dataclass(frozen=True, kw_only=True)
class Waiver:
    """Leave to go on while a requirement or a check is not proven; one that is not met stays so."""

    requirement: Annotated[str, text("id of the requirement or check")]  # ``id/loop`` of one on every loop
    reason: Annotated[str, label("reason for the waiver")]
    date: Annotated[str, day("day of the waiver")]

    @property
    def words(self) -> str:
        return f"waived {self.date}: {self.reason}"


@dataclass(frozen=True, kw_only=True)
class Correlation:
    """Correlation coefficient between two toleranced parameters, named by their dotted keys."""

    first: Annotated[str, text("dotted key with a tolerance")]
    second: Annotated[str, text("another one")]
    coefficient: Annotated[float, quantity("their correlation", low=-1.0, high=1.0)]


@dataclass(frozen=True, kw_only=True)
class Fact:
    """Something known of the drive that no equation needs, as text with its pedigree."""

    label: Annotated[str, text("what is known")]
    value: Annotated[str, text("as text")]
    source: Annotated[str, text("where it comes from")] = ""
    grade: Annotated[str, text("A to D or X")] = ""


@dataclass(frozen=True, kw_only=True)
class Tolerance:
    """How far a value may lie from its nominal, in SI: a uniform or (truncated) normal distribution."""

    kind: Literal["uniform", "normal", "truncated-normal"]
    half_width: float | None = None
    std: float | None = None
    lower: float = -inf  # a value of the parameter itself, no deviation; so is `upper`
    upper: float = inf
    text: str = ""  # the width as written, so that a relative one ("50 %") follows a changed nominal

    @property
    def relative(self) -> bool:
        return self.text.strip().endswith("%")

    @property
    def width(self) -> float:
        """The half width of a uniform one, else the standard deviation."""
        return (self.half_width if self.kind == "uniform" else self.std) or 0.0


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """One value of the design file with its pedigree: dotted key, text as written, SI value."""

    path: str
    text: str
    value: float
    unit: str
    symbol: str = ""
    source: str = ""
    grade: str = ""
    tolerance: Tolerance | None = None
    stated: str = field(default="", compare=False)  # what the file has, where it is computed from that


FrozenMap = MappingProxyType  # a mapping that stays as it is, equal to any with the same items


def _frozen(items: dict[Any, Any]) -> MappingProxyType[Any, Any]:
    return FrozenMap(items)


copyreg.pickle(FrozenMap, lambda held: (_frozen, (dict(held),)))  # so that it can be sent to a worker


@dataclass(frozen=True)
class ObjectPlace:
    """Where an object stands in the dictionary of the motion controller."""

    index: int
    subindex: int

    @property
    def place(self) -> tuple[int, int]:
        return self.index, self.subindex

    @property
    def label(self) -> str:
        return f"0x{self.index:04X}.{self.subindex:02X}"


@dataclass(frozen=True, kw_only=True)
class ControllerObject(ObjectPlace):
    """One entry of the motion controller's object dictionary, as an integer in the object's own unit."""

    value: int
    name: str = ""
    data_type: str = ""


@dataclass(frozen=True, kw_only=True)
class ControllerObjects:
    """The controller's own settings that a design was imported from, also those that no key holds."""

    velocity_gain_factor: float = 1.0  # 1 if 0x2344.01 is per rad/s, 60/2 pi if per rpm; no document says
    values: tuple[ControllerObject, ...] = ()  # in the order of index and subindex
    family: ObjectFamily = ""  # by which the drive is run: its gains have the ranges and steps of its objects

    @property
    def named(self) -> bool:
        """Whether the drive is run by the motion controller whose objects these are."""
        return bool(self.family or self.values)

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", tuple(sorted(self.values, key=lambda item: item.place)))
