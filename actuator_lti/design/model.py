"""A drive as data: what a design file becomes once it has been read and checked.

All values are in SI units on the motor side unless a name says otherwise.  For a linear axis
(``axis = "linear"``) read N for N m, m for rad, kg for kg m2 in every name.  A stage that the drive
does not have is ``None``; a limit that it does not have is ``inf``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import inf, pi, prod, sin, sqrt
from typing import Any, Literal

import numpy as np

from actuator_lti.design.parameters import FrozenMap
from actuator_lti.errors import InputError

Axis = Literal["rotary", "linear"]
FrictionLaw = Literal["coulomb", "tanh"]
LoadPath = Literal["self-locking", "back-drivable"]
SpeedSource = Literal["ideal", "difference", "tracking"]
Sensor = Literal["motor", "output"]
Direction = Literal["both", "forward", "reverse"]
MotorConstants = Literal["dc", "rms-line", "peak-phase"]
AntiWindup = Literal["conditional", "clamped", "back-calculation"]
FilterKind = Literal["lowpass", "notch", "skewed-notch", "leadlag", "biquad"]
FILTER_KEYS: dict[FilterKind, tuple[set[str], set[str]]] = {
    "lowpass": ({"frequency_rad_s"}, {"order", "damping"}),
    "notch": ({"frequency_rad_s", "width_rad_s"}, {"depth"}),
    "skewed-notch": ({"zero_rad_s", "pole_rad_s", "width_rad_s"}, {"depth"}),
    "leadlag": ({"zero_rad_s", "pole_rad_s"}, set()),
    "biquad": ({"b", "a"}, set()),
}
"""What each kind of filter needs, and what it may have besides."""
FilterPlace = Literal["torque", "speed"]
Overload = Literal["thermal", "excess"]
ObjectFamily = Literal["", "faulhaber-mc-v3"]
Stage = Literal["position", "velocity", "current", "voltage"]

STANDARD_GRAVITY_m_s2 = 9.80665


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
    constants: MotorConstants = "dc"

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
class Screw:
    """A screw, rack or belt between a rotary motor and a linear axis: travel per revolution.

    It lets the motor's data sheet stand in its own units: with p = lead/2 pi a torque T is the force T/p, an
    angle x the travel p x, an inertia J the mass J/p^2.  Gears before the screw keep their ratios.
    """

    lead_m: float

    @property
    def travel_m_rad(self) -> float:
        """p, travel per radian."""
        return self.lead_m / (2.0 * pi)


@dataclass(frozen=True, kw_only=True)
class Coupling:
    """The elastic coupling between the motor's side and the load's side (model.md section 6).

    Stiffness k, damping c and play (total, 2 b) are those at its own shaft, which is the output shaft of the
    gear ``after`` (``None``: of the last gear, or of the motor where there are no gears).
    """

    stiffness_Nm_rad: float
    damping_Nms_rad: float = 0.0
    play_rad: float = 0.0
    after: str | None = None


@dataclass(frozen=True, kw_only=True)
class LoadFriction:
    """Friction behind the coupling, at its shaft: C0_l, Cv_l, breakaway ratio and constant offset."""

    dry_torque_Nm: float = 0.0
    viscous_Nms_rad: float = 0.0
    breakaway_ratio: float = 1.0
    offset_torque_Nm: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Gravity:
    """A pendulum at the output shaft: M_ext = m g l sin(angle + offset); angle + offset = 0 is upright."""

    mass_kg: float
    arm_m: float
    offset_rad: float = 0.0

    def moment_Nm(self, angle_rad: float) -> float:
        """Moment on the output shaft at an output angle, in N m; positive pushes forward."""
        return self.peak_Nm * sin(angle_rad + self.offset_rad)

    @property
    def peak_Nm(self) -> float:
        """m g l."""
        return self.mass_kg * STANDARD_GRAVITY_m_s2 * self.arm_m


@dataclass(frozen=True, kw_only=True)
class Load:
    """What hangs on the output shaft, and how its moment reaches the motor.

    M_ext = constant or series (given with the run) + ``moment_slope_Nm_rad`` * output angle + gravity.
    """

    inertia_kgm2: float = 0.0
    path: LoadPath = "self-locking"
    moment_max_Nm: float = 0.0
    moment_slope_Nm_rad: float = 0.0
    friction: LoadFriction | None = None
    gravity: Gravity | None = None


@dataclass(frozen=True, kw_only=True)
class FrictionPoint:
    """One point (|w|, T) of a friction map, motor side; for both directions of motion or one."""

    speed_rad_s: float
    torque_Nm: float
    direction: Direction = "both"


@dataclass(frozen=True, kw_only=True)
class Friction:
    """Friction at the motor shaft: dry ``Tc = C0 + CM |M_ext|`` plus viscous ``Cv w`` (paper, equation 9).

    ``dry_torque_reverse_Nm`` and ``viscous_reverse_Nms_rad`` hold for w < 0 where they differ; ``None``
    means symmetric.  ``offset_torque_Nm`` is a constant torque that opposes positive motion.  ``points`` is a
    friction map that takes the place of C0 and Cv (model.md section 6); CM and the offset add.
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
    points: tuple[FrictionPoint, ...] = ()

    def map(self, direction: int = 1) -> tuple[FrictionPoint, ...]:
        """Points of the friction map for motion forward (1) or backward (-1), by rising speed."""
        other = "reverse" if direction > 0 else "forward"
        chosen = (point for point in self.points if point.direction != other)
        return tuple(sorted(chosen, key=lambda point: point.speed_rad_s))

    def dry_Nm(self, load_Nm: float, direction: int = 1) -> float:
        """Dry friction torque Tc at a load torque (either sign), for motion forward (1) or backward (-1)."""
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
    """The speed measurement: w itself, a difference of angles, or a tracking loop; perhaps filtered.

    The difference spans ``difference_samples`` m velocity periods.

    ``counts_per_rev`` is per motor revolution after quadrature (linear axis: per metre); ``None`` is an
    encoder without quantisation.  ``bandwidth_rad_s`` is w0 of the tracking loop (model.md section 7).
    """

    counts_per_rev: int | None = None
    speed: SpeedSource = "ideal"
    difference_samples: int = 1
    filter_time_s: float = 0.0
    bandwidth_rad_s: float | None = None


@dataclass(frozen=True, kw_only=True)
class OutputEncoder:
    """The angle sensor at the output shaft; counts per output revolution (linear axis: per metre)."""

    counts_per_rev: int | None = None


@dataclass(frozen=True, kw_only=True)
class Instruments:
    """Errors of the drive's own measurements; 0 is an ideal one.

    Noise is white, normal, of the stated rms value, new at every sample; jitter is the rms deviation of the
    sampling instant.  ``seed`` makes a run repeatable.
    """

    current_resolution_A: float = 0.0
    current_noise_A: float = 0.0
    angle_noise_rad: float = 0.0
    output_angle_noise_rad: float = 0.0
    jitter_s: float = 0.0
    seed: int = 0

    @property
    def ideal(self) -> bool:
        """Whether nothing is to be simulated."""
        return not any(
            (
                self.current_resolution_A,
                self.current_noise_A,
                self.angle_noise_rad,
                self.output_angle_noise_rad,
                self.jitter_s,
            )
        )


@dataclass(frozen=True, kw_only=True)
class Filter:
    """One filter of the velocity loop, at its period, discretised by Tustin, prewarped (model.md section 7).

    ``lowpass``: frequency, order 1 or 2, damping; ``notch``: frequency w0, width (rad/s), depth (gain at w0);
    ``skewed-notch``: zeros at zero, depth width wide, poles at pole, width wide; gain 1 at DC;
    ``leadlag``: zero and pole, (s/zero + 1)/(s/pole + 1); ``biquad``: sampled coefficients ``b``, ``a``.
    """

    kind: FilterKind
    on: FilterPlace = "torque"
    frequency_rad_s: float | None = None
    order: int = 1
    damping: float = 0.7071067811865476
    width_rad_s: float | None = None
    depth: float = 0.0
    zero_rad_s: float | None = None
    pole_rad_s: float | None = None
    b: tuple[float, ...] = ()
    a: tuple[float, ...] = ()


@dataclass(frozen=True, kw_only=True)
class CurrentLoop:
    """Current PI, every tick: V = gain (e + integral of e / integral_time) + feed-forward.

    The shares of back-EMF and resistance voltage that are fed forward, kE w_meas and R i_ref, are 0 to 1.
    """

    gain_V_A: float
    integral_time_s: float | None = None
    back_emf_feedforward: float = 0.0
    resistance_feedforward: float = 0.0
    anti_windup: AntiWindup = "conditional"
    tracking_time_s: float | None = None


@dataclass(frozen=True, kw_only=True)
class VelocityLoop:
    """Velocity PI (P where integral_time_s is None), every ``every`` ticks.

    The gain is in A s/rad where a current loop follows, in V s/rad where the voltage does.
    """

    gain: float
    integral_time_s: float | None = None
    every: int = 1
    sensor: Sensor = "motor"
    anti_windup: AntiWindup = "conditional"
    tracking_time_s: float | None = None
    filters: tuple[Filter, ...] = ()

    def filters_on(self, place: FilterPlace) -> tuple[Filter, ...]:
        """The filters of the measured speed or of the torque command, in order."""
        return tuple(item for item in self.filters if item.on == place)


@dataclass(frozen=True, kw_only=True)
class PositionLoop:
    """Position P, PI or PID, every ``every`` ticks (model.md section 7).

    The gain is in 1/s where a velocity loop follows, else in A/rad or V/rad (motor side).  The acceleration
    feed-forward is a share of J/kM times the command's acceleration; the friction feed-forward is the current
    (A; V without a current loop) whose sign follows the command's motion.
    """

    gain: float
    every: int = 1
    feedforward: float = 0.0
    sensor: Sensor = "motor"
    integral_time_s: float | None = None
    derivative_time_s: float = 0.0
    derivative_filter_s: float = 0.0
    acceleration_feedforward: float = 0.0
    friction_feedforward: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Command:
    """What the drive makes of a command before its outermost loop: a profile, then a filter.

    Rate, acceleration and jerk limits hold at the output shaft (``inf``: none).  The filter is a low-pass of
    order 1 or 2 with the time constant ``filter_time_s`` (order 2: damping ``filter_damping``).
    """

    filter_time_s: float = 0.0
    filter_order: int = 1
    filter_damping: float = 1.0
    rate_rad_s: float = inf
    acceleration_rad_s2: float = inf
    jerk_rad_s3: float = inf


@dataclass(frozen=True, kw_only=True)
class Controller:
    """Sampling and the cascade; an absent loop is ``None``; any stage may be the outermost."""

    period_s: float
    computing_delay_s: float
    position: PositionLoop | None = None
    velocity: VelocityLoop | None = None
    current: CurrentLoop | None = None

    @property
    def stages(self) -> tuple[Stage, ...]:
        """The loops that there are, outermost first; empty for an open-loop voltage drive."""
        names: tuple[Stage, ...] = ("position", "velocity", "current")
        return tuple(name for name in names if getattr(self, name) is not None)

    @property
    def position_loop(self) -> PositionLoop:
        """The position loop, for questions that need one.

        Raises
        ------
        InputError
            Where the drive has none.
        """
        if self.position is None:
            raise InputError("control.position: missing; this needs a drive with a position loop")
        return self.position

    @property
    def outermost(self) -> Stage:
        """The stage that takes the command; ``"voltage"`` for a drive without a loop."""
        return self.stages[0] if self.stages else "voltage"


@dataclass(frozen=True, kw_only=True)
class Limits:
    """Limits of the stages, motor side; ``inf`` where there is none.

    The continuous current is no clamp unless ``peak_time_s`` is given: then the overload protection (I2t)
    falls back to it after that time at the peak (model.md section 6), until its state is below ``release``.
    """

    voltage_V: float
    speed_rad_s: float = inf
    acceleration_rad_s2: float = inf
    peak_current_A: float = inf
    continuous_current_A: float = inf
    peak_time_s: float | None = None
    release: float = 0.9
    overload: Overload = "thermal"

    @property
    def overload_time_s(self) -> Any:
        """tau of the overload state, of one design or stacked ones; None without overload protection."""
        if self.peak_time_s is None:
            return None
        r2 = (self.peak_current_A / self.continuous_current_A) ** 2
        return (
            self.peak_time_s * (r2 - 1)
            if self.overload == "excess"
            else self.peak_time_s / np.log(r2 / (r2 - 1))
        )


@dataclass(frozen=True, kw_only=True)
class Supply:
    """The supply behind ``limits.voltage``: resistance, and where braking energy goes (section 6)."""

    resistance_ohm: float = 0.0
    regenerative: bool = True
    capacitance_F: float | None = None
    brake_voltage_V: float | None = None


@dataclass(frozen=True, kw_only=True)
class Temperature:
    """Winding and magnet temperature, in degrees Celsius, and how R, kM and kE follow them.

    ``R (1 + resistance_per_K (winding - reference))``, ``kM, kE (1 + magnet_per_K (magnet - reference))``.
    The thermal resistance and time constant of the winding serve the duty cycle.
    """

    winding_degC: float = 25.0
    magnet_degC: float = 25.0
    reference_degC: float = 25.0
    resistance_per_K: float = 0.00393
    magnet_per_K: float = -0.0011
    ambient_degC: float = 25.0
    winding_limit_degC: float = inf
    thermal_resistance_K_W: float | None = None
    thermal_time_s: float | None = None


@dataclass(frozen=True, kw_only=True)
class Failure:
    """What is asked of the failure cases; ``None`` is what `analyses.failures.Asked` takes for it.

    Deflections are those of the output from where it was; the load pushes forward from the start.
    """

    stop_rad: float | None = None
    deflection_rad: float | None = None
    detection_s: float | None = None
    load_Nm: float | None = None


@dataclass(frozen=True, kw_only=True)
class DutyCycle:
    """The duty that the drive has to do for ever; ``None`` is what `analyses.duty.Asked` takes for it."""

    amplitude_rad: float | None = None
    frequency_rad_s: float | None = None
    load_Nm: float | None = None
    share: float | None = None
    cycle_s: float | None = None


def default_deflection(axis: Axis) -> float:
    """Full deflection where a design states none: 10 deg, or 0.01 m on a linear axis."""
    return 0.01 if axis == "linear" else 0.17453292519943295


@dataclass(frozen=True, kw_only=True)
class Validation:
    """What the validator and the report are to look at: deflections (output side) and load torques."""

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

    ``family`` says that the drive is run by that kind of motion controller: its gains then have the ranges
    and steps of its objects.
    ``velocity_gain_factor`` turns the unit of object 0x2344.01 into A s/rad: 1 if it is per rad/s,
    9.549 (60/2 pi) if it is per rpm; the documents do not settle it.  The values are kept in the order of
    index and subindex.
    """

    velocity_gain_factor: float = 1.0
    values: tuple[ControllerObject, ...] = ()
    family: ObjectFamily = ""

    @property
    def named(self) -> bool:
        """Whether the drive is run by the motion controller whose objects these are."""
        return bool(self.family or self.values)

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
    output_encoder: OutputEncoder = field(default_factory=OutputEncoder)
    screw: Screw | None = None
    coupling: Coupling | None = None
    command: Command = field(default_factory=Command)
    supply: Supply | None = None
    temperature: Temperature | None = None
    failure: Failure | None = None
    duty: DutyCycle | None = None
    instruments: Instruments = field(default_factory=Instruments)
    requirements: tuple[Requirement, ...] = ()
    correlations: tuple[Correlation, ...] = ()
    facts: tuple[Fact, ...] = ()
    objects: ControllerObjects = field(default_factory=ControllerObjects)
    parameters: Mapping[str, Parameter] = field(default_factory=FrozenMap)
    axis: Axis = "rotary"
    revision: str = ""
    description: str = ""
    origin: str = ""

    def with_values(self, values: Mapping[str, Any]) -> Design:
        """A copy with some keys changed, as a design file would write them.

        Parameters
        ----------
        values : mapping of dotted key to value
            Text with its unit (``"90 1/s"``), or a number in SI; other keys take text, lists and tables.
            A changed value says in its source what it was; a tolerance in percent follows it.

        Returns
        -------
        Design
            Checked like a file.

        Raises
        ------
        InputError
            For an unknown key, a wrong unit, or values that contradict each other.

        Examples
        --------
        >>> from actuator_lti import load_design
        >>> design = load_design("ilr33-amber")
        >>> better = design.with_values({"control.position.gain": "90 1/s", "limits.voltage": 24.0})
        >>> better.controller.position.gain, better.parameters["limits.voltage"].source
        (90.0, 'changed from 12 V')
        """
        from actuator_lti.design.writing import with_overrides, with_units

        return with_overrides(self, with_units(self, values))

    def _repr_html_(self) -> str:
        """What a notebook shows."""
        from actuator_lti.notebook import design_html

        return design_html(self)

    @property
    def total_ratio(self) -> float:
        """N, motor angle over output angle; 1 without gears."""
        return prod(gear.ratio for gear in self.gears)

    @property
    def gears_before_coupling(self) -> int:
        """Number of gears up to the coupling; all of them where the drive train is rigid."""
        if self.coupling is None or self.coupling.after is None:
            return len(self.gears)
        return [gear.name for gear in self.gears].index(self.coupling.after) + 1

    @property
    def ratio_to_coupling(self) -> float:
        """N_c, motor angle over coupling angle."""
        return prod(gear.ratio for gear in self.gears[: self.gears_before_coupling])

    @property
    def ratio_behind_coupling(self) -> float:
        """N_r, coupling angle over output angle; 1 where the drive train is rigid."""
        return prod(gear.ratio for gear in self.gears[self.gears_before_coupling :])

    @property
    def angle_quantum_rad(self) -> float | None:
        """One encoder count at the motor, in rad (linear axis: in m, of a screw's lead or of a metre)."""
        return self._quantum(self.encoder.counts_per_rev, self.screw.lead_m if self.screw else 1.0)

    @property
    def output_quantum_rad(self) -> float | None:
        """One count of the output's encoder at the output shaft, in rad or m; None without."""
        return self._quantum(self.output_encoder.counts_per_rev)

    def _quantum(self, counts: int | None, travel_m: float = 1.0) -> float | None:
        if counts is None:
            return None
        return (travel_m if self.axis == "linear" else 2.0 * pi) / counts

    @property
    def inertia_kgm2(self) -> float:
        """J, all that turns, at the motor shaft (paper, equation 12, for any number of stages)."""
        return self.motor_side_inertia_kgm2 + self.load_side_inertia_kgm2 / self.ratio_to_coupling**2

    @property
    def motor_side_inertia_kgm2(self) -> float:
        """J_m, all inertia before the coupling, at the motor shaft; without a coupling all but the load's."""
        return self.motor.rotor_inertia_kgm2 + _train_inertia(self.gears[: self.gears_before_coupling])

    @property
    def load_side_inertia_kgm2(self) -> float:
        """J_l, all inertia behind the coupling, at its own shaft; rigid: the load's, at the output."""
        behind = self.gears[self.gears_before_coupling :]
        return _train_inertia(behind) + self.load.inertia_kgm2 / self.ratio_behind_coupling**2

    @property
    def effective_motor(self) -> Motor:
        """The motor as the model has it: one constant k, phase-phase R and L, at its temperature.

        An AC servo motor becomes the DC motor of the same torque, losses and voltage limit, with u the peak
        line-line voltage and i = sqrt(3/2) I_rms = (sqrt(3)/2) I_peak: then P = k i w, R and L are the
        line-line values, and the bus voltage limits u.
        """
        motor = self.motor
        if motor.resistance_ohm is None:
            return motor
        torque, voltage, impedance = _EQUIVALENT[motor.constants]
        winding = magnet = 1.0
        if self.temperature is not None:
            heat = self.temperature
            magnet += heat.magnet_per_K * (heat.magnet_degC - heat.reference_degC)
            winding += heat.resistance_per_K * (heat.winding_degC - heat.reference_degC)
        return replace(
            motor,
            resistance_ohm=_times(motor.resistance_ohm, impedance * winding),
            inductance_H=_times(motor.inductance_H, impedance),
            torque_constant_Nm_A=_times(motor.torque_constant_Nm_A, torque * magnet),
            back_emf_constant_Vs_rad=_times(motor.back_emf_constant_Vs_rad, voltage * magnet),
            constants="dc",
        )


# factors on kM, on kE, and on R and L, from the data sheet to the equivalent DC motor
_EQUIVALENT: dict[MotorConstants, tuple[float, float, float]] = {
    "dc": (1.0, 1.0, 1.0),
    "rms-line": (1.0 / sqrt(1.5), sqrt(2.0), 1.0),
    "peak-phase": (2.0 / sqrt(3.0), sqrt(3.0), 2.0),
}


def _times(value: float | None, factor: float) -> float | None:
    return None if value is None else value * factor


def _train_inertia(gears: tuple[Gear, ...]) -> float:
    """Inertia of a row of gears at the input shaft of the first."""
    total, ratio = 0.0, 1.0
    for gear in gears:
        total += gear.input_inertia_kgm2 / ratio**2
        ratio *= gear.ratio
        total += gear.output_inertia_kgm2 / ratio**2
    return total
