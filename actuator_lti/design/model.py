"""A drive as data: what a design file becomes once it has been read and checked.

All values are in SI units on the motor side unless a name says otherwise.  For a linear axis
(``axis = "linear"``) read N for N m, m for rad, kg for kg m2 in every name.  A stage that the drive
does not have is ``None``; a limit that it does not have is ``inf``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import inf, pi
from typing import Literal

from actuator_lti.design.parameters import FrozenMap

Axis = Literal["rotary", "linear"]
FrictionLaw = Literal["coulomb", "tanh"]
LoadPath = Literal["self-locking", "back-drivable"]
SpeedSource = Literal["ideal", "difference"]


@dataclass(frozen=True, kw_only=True)
class Motor:
    """The motor: either R, L, kM, kE, or an ideal torque source with a gain.

    ``L di/dt = u - R i - kE w`` and torque ``kM i`` (paper, equations 1 and 2); without electrical
    dynamics the torque is ``source_gain_Nm_V * u``.
    """

    rotor_inertia_kgm2: float
    resistance_ohm: float | None = None
    inductance_H: float | None = None
    torque_constant_Nm_A: float | None = None
    back_emf_constant_Vs_rad: float | None = None
    source_gain_Nm_V: float | None = None

    @property
    def has_electrical_dynamics(self) -> bool:
        """Whether the current is a state."""
        return self.source_gain_Nm_V is None


@dataclass(frozen=True, kw_only=True)
class Gear:
    """One reduction stage; the inertias are those of its own input and output shafts."""

    name: str
    ratio: float
    input_inertia_kgm2: float = 0.0
    output_inertia_kgm2: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Load:
    """What hangs on the output shaft (canard), and how its moment reaches the motor."""

    inertia_kgm2: float = 0.0
    path: LoadPath = "self-locking"
    moment_max_Nm: float = 0.0
    moment_slope_Nm_rad: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Friction:
    """Friction at the motor shaft: dry ``Tc = C0 + CM |M_ext|`` plus viscous ``Cv w`` (paper, equation 9).

    ``dry_torque_reverse_Nm`` and ``viscous_reverse_Nms_rad`` hold for w < 0 where they differ; ``None``
    means symmetric.  ``offset_torque_Nm`` is a constant torque that opposes positive motion.
    """

    law: FrictionLaw = "coulomb"
    dry_torque_Nm: float = 0.0
    viscous_Nms_rad: float = 0.0
    load_coefficient: float = 0.0
    breakaway_ratio: float = 1.0
    smoothing_speed_rad_s: float = 1.0
    dry_torque_reverse_Nm: float | None = None
    viscous_reverse_Nms_rad: float | None = None
    offset_torque_Nm: float = 0.0

    def dry_Nm(self, load_Nm: float, direction: int = 1) -> float:
        """Dry friction torque Tc at a hinge moment (either sign), for motion forward (1) or backward (-1)."""
        base = self.dry_torque_Nm
        if direction < 0 and self.dry_torque_reverse_Nm is not None:
            base = self.dry_torque_reverse_Nm
        return base + self.load_coefficient * abs(load_Nm)

    def viscous(self, direction: int = 1) -> float:
        """Viscous slope Cv in N m s/rad, for motion forward (1) or backward (-1)."""
        if direction < 0 and self.viscous_reverse_Nms_rad is not None:
            return self.viscous_reverse_Nms_rad
        return self.viscous_Nms_rad


@dataclass(frozen=True, kw_only=True)
class Encoder:
    """The speed measurement: w itself, or a difference over m velocity periods of angle, filtered.

    ``counts_per_rev`` is per motor revolution after quadrature (linear axis: per metre); ``None`` is an
    encoder without quantisation.
    """

    counts_per_rev: int | None = None
    speed: SpeedSource = "ideal"
    difference_samples: int = 1
    filter_time_s: float = 0.0


@dataclass(frozen=True, kw_only=True)
class CurrentLoop:
    """Current PI, every tick: V = gain (e + integral of e / integral_time)."""

    gain_V_A: float
    integral_time_s: float | None


@dataclass(frozen=True, kw_only=True)
class VelocityLoop:
    """Velocity PI (P where integral_time_s is None), every ``every`` ticks.

    The gain is in A s/rad where a current loop follows, in V s/rad where the voltage does.
    """

    gain: float
    integral_time_s: float | None = None
    every: int = 1


@dataclass(frozen=True, kw_only=True)
class PositionLoop:
    """Position P, every ``every`` ticks.

    The gain is in 1/s where a velocity loop follows, else in A/rad or V/rad (motor side).
    """

    gain: float
    every: int = 1
    feedforward: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Controller:
    """Sampling and the cascade; an absent inner loop is ``None``."""

    period_s: float
    computing_delay_s: float
    position: PositionLoop
    velocity: VelocityLoop | None = None
    current: CurrentLoop | None = None


@dataclass(frozen=True, kw_only=True)
class Limits:
    """Limits of the stages, motor side; ``inf`` where there is none. The continuous current is no clamp."""

    voltage_V: float
    speed_rad_s: float = inf
    acceleration_rad_s2: float = inf
    peak_current_A: float = inf
    continuous_current_A: float = inf


@dataclass(frozen=True, kw_only=True)
class Validation:
    """What the validator and the report are to look at: deflections (output side) and hinge moments."""

    full_deflection_rad: float
    amplitude_fractions: tuple[float, ...] = (0.05, 0.1, 0.25, 0.5, 1.0)
    loads_Nm: tuple[float, ...] = (0.0,)


@dataclass(frozen=True, kw_only=True)
class Requirement:
    """A limit on a figure; ``loop`` is a loop name, ``"every"``, or ``None`` for the whole drive."""

    id: str
    quantity: str
    unit: str
    minimum: float | None = None
    maximum: float | None = None
    loop: str | None = None
    load_Nm: float | None = None
    source: str = ""
    note: str = ""


@dataclass(frozen=True, kw_only=True)
class Tolerance:
    """How far a value may lie from its nominal, in SI: a uniform or (truncated) normal distribution.

    ``lower`` and ``upper`` are values of the parameter itself, not deviations.  ``text`` is the width as
    written, kept so that a relative one ("50 %") follows a changed nominal.
    """

    kind: Literal["uniform", "normal", "truncated-normal"]
    half_width: float | None = None
    std: float | None = None
    lower: float = -inf
    upper: float = inf
    text: str = ""


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


@dataclass(frozen=True, kw_only=True)
class Correlation:
    """Correlation coefficient between two toleranced parameters, named by their dotted keys."""

    first: str
    second: str
    coefficient: float


@dataclass(frozen=True, kw_only=True)
class Fact:
    """Something known of the drive that no equation needs, as text with its pedigree."""

    label: str
    value: str
    source: str = ""
    grade: str = ""


@dataclass(frozen=True, kw_only=True)
class ControllerObject:
    """One entry of the motion controller's object dictionary, as an integer in the object's own unit."""

    index: int
    subindex: int
    value: int
    name: str = ""
    data_type: str = ""

    @property
    def label(self) -> str:
        """The usual spelling, such as ``0x2344.01``."""
        return f"0x{self.index:04X}.{self.subindex:02X}"


@dataclass(frozen=True, kw_only=True)
class ControllerObjects:
    """The controller's own settings that a design was imported from, also those that no key holds.

    ``velocity_gain_factor`` turns the unit of object 0x2344.01 into A s/rad: 1 if it is per rad/s,
    9.549 (60/2 pi) if it is per rpm; the documents do not settle it.  The values are kept in the order of
    index and subindex.
    """

    velocity_gain_factor: float = 1.0
    values: tuple[ControllerObject, ...] = ()

    def __post_init__(self) -> None:
        """Put the values in order."""
        ordered = tuple(sorted(self.values, key=lambda item: (item.index, item.subindex)))
        object.__setattr__(self, "values", ordered)


@dataclass(frozen=True, kw_only=True)
class Design:
    """A drive: plant, controller, limits, requirements, and where each value came from."""

    name: str
    title: str
    motor: Motor
    controller: Controller
    limits: Limits
    validation: Validation
    gears: tuple[Gear, ...] = ()
    load: Load = field(default_factory=Load)
    friction: Friction = field(default_factory=Friction)
    encoder: Encoder = field(default_factory=Encoder)
    requirements: tuple[Requirement, ...] = ()
    correlations: tuple[Correlation, ...] = ()
    facts: tuple[Fact, ...] = ()
    objects: ControllerObjects = field(default_factory=ControllerObjects)
    parameters: Mapping[str, Parameter] = field(default_factory=FrozenMap)
    axis: Axis = "rotary"
    revision: str = ""
    description: str = ""
    origin: str = ""

    @property
    def total_ratio(self) -> float:
        """N, motor angle over output angle; 1 without gears."""
        ratio = 1.0
        for gear in self.gears:
            ratio *= gear.ratio
        return ratio

    @property
    def angle_quantum_rad(self) -> float | None:
        """One encoder count at the motor, in rad (linear axis: counts per metre, so in m); None without."""
        counts = self.encoder.counts_per_rev
        if counts is None:
            return None
        return (1.0 if self.axis == "linear" else 2.0 * pi) / counts

    @property
    def inertia_kgm2(self) -> float:
        """J, all that turns, at the motor shaft (paper, equation 12, for any number of stages)."""
        total = self.motor.rotor_inertia_kgm2
        ratio = 1.0
        for gear in self.gears:
            total += gear.input_inertia_kgm2 / ratio**2
            ratio *= gear.ratio
            total += gear.output_inertia_kgm2 / ratio**2
        return total + self.load.inertia_kgm2 / ratio**2
