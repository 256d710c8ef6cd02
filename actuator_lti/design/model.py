"""A drive as data: what a design file becomes once it has been read and checked.

All values are in SI units on the motor side unless a name says otherwise.  For a linear axis
(``axis = "linear"``) read N for N m, m for rad, kg for kg m2 in every name.  A stage that the drive
does not have is ``None``; a limit that it does not have is ``inf``.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import pi, prod, sqrt
from typing import Annotated, Any

from actuator_lti.design.asked import (
    ControllerObject,
    ControllerObjects,
    Correlation,
    DutyCycle,
    Fact,
    Failure,
    FrozenMap,
    Parameter,
    Requirement,
    Tolerance,
    Validation,
    Waiver,
)
from actuator_lti.design.control import (
    AntiWindup,
    Command,
    Controller,
    CurrentLoop,
    Encoder,
    Filter,
    FilterPlace,
    Instruments,
    Limits,
    OutputEncoder,
    PositionLoop,
    Sensor,
    SpeedSource,
    Supply,
    VelocityLoop,
)
from actuator_lti.design.field import Axis, choice, label, text
from actuator_lti.design.law import Law, StateSpace
from actuator_lti.design.plant import (
    DC_PER_A,
    Coupling,
    Friction,
    FrictionPoint,
    Gear,
    Gravity,
    Load,
    LoadFriction,
    Motor,
    MotorConstants,
    Screw,
    Temperature,
)
from actuator_lti.drawing import draw
from actuator_lti.start.public_arguments import checks_arguments


@dataclass(frozen=True, kw_only=True)
class Design:
    """A drive: plant, controller, limits, requirements, and where each value came from."""

    name: Annotated[str, label("short name, used in file names")]
    title: Annotated[str, text("one line for the title page")] = ""
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
    waivers: tuple[Waiver, ...] = ()
    correlations: tuple[Correlation, ...] = ()
    facts: tuple[Fact, ...] = ()
    objects: ControllerObjects = field(default_factory=ControllerObjects)
    parameters: Mapping[str, Parameter] = field(default_factory=lambda: FrozenMap({}), hash=False)
    axis: Annotated[Axis, choice("rotary (rad, N m, kg m2) or linear (m, N, kg)")] = "rotary"
    revision: Annotated[str, text("revision of this file")] = ""
    description: Annotated[str, text("what the drive is and where its figures come from")] = ""
    origin: str = ""
    written: frozenset[str] = field(default=frozenset(), compare=False)  # keys that stand in its file
    nominal: "Design | None" = None  # what the controller of a drive that came out otherwise is set for

    def with_values(self, values: Mapping[str, Any]) -> "Design":
        """A copy with some keys changed, as a design file would write them.

        Raises `InputError`: for an unknown key, a wrong unit, or values that contradict each other.

        ``values``, by dotted key: text with its unit (``"90 1/s"``), or a number in SI; other keys take
        text, lists and tables. A changed value says in its source what it was; a tolerance in percent follows
        it. The copy is checked like a file.

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

    @checks_arguments
    def add_filter(self, stage: str, **keys: Any) -> "Design":
        """A copy with one more filter, the last of its place.

        Raises `InputError`: as `with_values`, and for a stage that has no filters.

        ``stage``: the stage whose filter it is, ``"velocity"``.
        ``keys``: ``kind`` and its keys as a design file has them: text with units, or numbers in SI.

        >>> from actuator_lti import load_design
        >>> notch = {"kind": "notch", "frequency": "120 Hz", "width": "60 Hz", "depth": 0.1}
        >>> load_design("ilr33-amber").add_filter("velocity", **notch).controller.velocity.filters[0].kind
        'notch'
        """
        from actuator_lti.design.writing import with_filter

        return with_filter(self, stage, keys)

    def with_law(
        self, stage: str, system: Any, inputs: Sequence[str] | None = None, **settings: Any
    ) -> "Design":
        """A copy with a law of one's own in place of a stage's gains and filters (model.md section 10).

        Raises `InputError`: for a system of another period or shape, an unknown setting, and as
        `with_values`.

        ``stage``: ``"current"``, ``"velocity"`` or ``"position"``.
        ``system``: a sampled state space or transfer function of python-control or scipy.signal, or
        ``(A, B, C, D, dt)``; its period must be that of the stage. States whose numbers are beyond 1e12 are
        scaled by powers of two.
        ``inputs``: the signals that it takes, in order: ``command``, ``error``, ``speed``, ``angle``,
        ``current``, ``output_angle``, ``output_speed``, ``twist``; by default the system's own input labels.
        ``settings``: ``L``: anti-windup, n numbers; ``gain``: factor on the law; ``every``: ticks of the
        stage, as a design file may write them (8, "8", a table with its source); ``method``: ``"tustin"`` or
        ``"zoh"``, by which a continuous system is sampled; ``continuous``: the same law in continuous time,
        for the forms without samples.

        >>> from actuator_lti import load_design
        >>> design = load_design("ilr33-amber")
        >>> mine = design.with_law("position", ([], [], [], [[60.0]], design.controller.period_s), ["error"])
        >>> mine.controller.position.law.D
        (60.0,)
        """
        from actuator_lti.design.with_law import with_law

        return with_law(self, stage, system, inputs, settings)

    def _repr_html_(self) -> str:
        return draw("design_html", self)

    def __repr__(self) -> str:
        return f"<Design {self.name}: {self.axis}, {' > '.join(self.controller.stages) or 'no loop'}>"

    def waiver_of(self, id: str) -> Waiver | None:
        """The waiver of a requirement or check by its id; one for ``id`` holds for every ``id/loop`` too."""
        return next((item for item in self.waivers if item.requirement in (id, id.rpartition("/")[0])), None)

    @property
    def load_unit(self) -> str:
        """In which loads on the output are told: N on a linear axis."""
        return "N" if self.axis == "linear" else "N m"

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

    @cached_property
    def ratio_to_coupling(self) -> float:
        """N_c, motor angle over coupling angle."""
        return prod(gear.ratio for gear in self.gears[: self.gears_before_coupling])

    @cached_property
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
        return None if counts is None else (travel_m if self.axis == "linear" else 2.0 * pi) / counts

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
    def dc_of_sheet(self) -> dict[str, float]:
        """R, L, kM and kE of the equivalent DC motor over those of the data sheet, by attribute."""
        return dict(zip(_OF_SHEET, _EQUIVALENT[self.motor.constants], strict=True))

    @property
    def controller_model(self) -> "Design":
        """The drive whose J, kM, R and kE feed-forward computes with: the nominal one, as its file has it."""
        return self.nominal or self

    @cached_property
    def effective_motor(self) -> Motor:
        """The motor as the model has it: one constant k, phase-phase R and L, at its temperature.

        An AC servo motor becomes the DC motor of the same torque, losses and voltage limit, with u the peak
        line-line voltage and i = sqrt(3/2) I_rms = (sqrt(3)/2) I_peak: then P = k i w, R and L are the
        line-line values, and the bus voltage limits u.
        """
        motor = self.motor
        if motor.resistance_ohm is None:
            return motor
        winding = magnet = 1.0
        if self.temperature is not None:
            heat = self.temperature
            magnet += heat.magnet_per_K * (heat.magnet_degC - heat.reference_degC)
            winding += heat.resistance_per_K * (heat.winding_degC - heat.reference_degC)
        warm = {"resistance_ohm": winding, "torque_constant_Nm_A": magnet, "back_emf_constant_Vs_rad": magnet}
        factors = {name: factor * warm.get(name, 1.0) for name, factor in self.dc_of_sheet.items()}
        stated = {name: getattr(motor, name) for name in factors}
        same = {name: value * factors[name] for name, value in stated.items() if value is not None}
        if motor.torque_constant_Nm_A is not None:
            same.setdefault("back_emf_constant_Vs_rad", same["torque_constant_Nm_A"])  # one constant
        return replace(motor, **same, constants="dc")


# from the data sheet to the equivalent DC motor
_OF_SHEET = ("resistance_ohm", "inductance_H", "torque_constant_Nm_A", "back_emf_constant_Vs_rad")
_EQUIVALENT: dict[MotorConstants, tuple[float, ...]] = {
    "dc": (1.0, 1.0, 1.0, 1.0),
    "rms-line": (1.0, 1.0, 1.0 / DC_PER_A["rms-line"], sqrt(2.0)),
    "peak-phase": (2.0, 2.0, 1.0 / DC_PER_A["peak-phase"], sqrt(3.0)),
}


def _train_inertia(gears: tuple[Gear, ...]) -> float:
    """Inertia of a row of gears at the input shaft of the first."""
    total, ratio = 0.0, 1.0
    for gear in gears:
        total += gear.input_inertia_kgm2 / ratio**2
        ratio *= gear.ratio
        total += gear.output_inertia_kgm2 / ratio**2
    return total
