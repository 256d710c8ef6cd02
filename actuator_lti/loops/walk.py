"""One walk over the drive, from the command to the voltage: model.md sections 2 and 7 as a program on rows.

What time is, the algebra says that a walk runs in: `actuator_lti.loops.tick` (samples) or
`actuator_lti.loops.flow` (derivatives and delays). The walk knows which signal goes where, and nothing else.

Signals that it leaves behind (motor side, before a cut): the plant's ``i``, ``w``, ``th``, ``W``, ``phi``,
``T_s`` and ``output_angle``; ``output``, the angle fed back; ``w_cmd`` and ``torque_command`` in front of
their limiters; ``velocity_integral`` and ``current_integral``; ``w_meas``; the errors ``e_*``; the break
points ``u``, ``i_ref``, ``w_ref``. The friction feed-forward has a step in it and no linear part.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from actuator_lti.design.law import Law, Matrices, twist_of
from actuator_lti.design.plant import torque_per_command
from actuator_lti.drive import blocks
from actuator_lti.drive.blocks import Block, Realisation
from actuator_lti.drive.wiring import BEHIND_FILTER, ERRORS, LAW_OUTPUT, Drive, present
from actuator_lti.loops.rows import Row, total

INPUTS = ("ref", "torque", "load_torque", "cut")
"""Reference of the outer stage, torque in N m at the motor, load torque on the output shaft, a cut signal."""
OWN_SIGNALS = {"current": "i", "angle": "th", "output_angle": "output_angle", "output_speed": "output_speed"}
"""What a law of one's own takes of the plant as it is."""


@dataclass(frozen=True)
class Program:
    """The linear drive up to a stage, perhaps with one signal cut."""

    drive: Drive
    # Outermost stage that runs; its reference is the input ``ref`` (of the position at the output shaft)
    outer: str
    # A break point (``u``, ``i_ref``, ``w_ref``, ``output``), an error (``e_i``, ``e_w``, ``e_th``), what a
    # law of one's own gives (``law``) or the command behind its filter (``command``) that is replaced by the
    # input ``cut`` where it is updated; what arrives is the signal of that name
    cut: str | None = None
    opened: tuple[str, ...] = ()  # stages whose feedback is taken away; their controllers stay in the path

    @cached_property
    def stages(self) -> tuple[str, ...]:
        names = self.drive.stages
        return names[: names.index(self.outer) + 1] if names else ()

    @property
    def measures_speed(self) -> bool:
        return "velocity" in self.stages and "velocity" not in self.opened

    @property
    def feeds_back_emf(self) -> bool:
        """Whether the measured speed is fed forward to the voltage."""
        current = self.drive.design.controller.current
        if current is None or "current" not in self.stages or self.drive.operating.rotor == "locked":
            return False
        return present(current.back_emf_feedforward)

    @property
    def shares_speed(self) -> bool:
        """Whether another stage than the velocity's own takes the measured speed."""
        own = self.drive.design.controller.own_law
        if own is None or self.drive.operating.rotor == "locked":
            return self.feeds_back_emf
        stage, law = own
        takes = "speed" in law.inputs and stage in self.stages and stage not in self.opened
        return self.feeds_back_emf or (takes and stage != "velocity")

    @property
    def ticks(self) -> int:
        """Ticks after which the program repeats."""
        every = self.drive.interval
        return max([every[s] for s in self.stages] + ([every["speed"]] if self.shares_speed else [1]))


class Walk(ABC):
    """The program once; an algebra fills in what time does to a signal."""

    def __init__(self, program: Program) -> None:
        self.program, self.drive = program, program.drive
        self.design, self.control = program.drive.design, program.drive.design.controller
        self.signals: dict[str, Row] = {}
        self.extra = Row()  # feed-forward of acceleration, to the torque command

    # -- what an algebra provides -------------------------------------------------------------------------

    @abstractmethod
    def state(self, name: str) -> Row:
        """The value of a state."""

    @abstractmethod
    def updates(self, every: int) -> bool:
        """Whether something that runs every so many ticks runs now."""

    @abstractmethod
    def held(self, name: str, value: Row | None, made: int, used: int) -> Row:
        """A value made every `made` ticks as one sees it that looks every `used` (``None``: not made now)."""

    @abstractmethod
    def apply(self, name: str, block: Block, value: Row) -> Row:
        """A block's output, its states named after its place."""

    @abstractmethod
    def own_matrices(self, law: Law) -> Matrices:
        """Matrices of a law of one's own, and in ``moves`` what they give of its states."""

    @abstractmethod
    def moves(self, name: str, value: Row) -> None:
        """What a state becomes, or its derivative."""

    @abstractmethod
    def derivative(self, name: str, value: Row, period_s: Any) -> Row:
        """What the drive takes for a derivative: the difference over a period."""

    @abstractmethod
    def estimated(self, block: Block, speed: Row, angle: Row) -> Row:
        """A speed estimated from an angle."""

    def realised(self, names: list[str], block: Realisation, value: Row) -> Row:
        """Put the states of a block's realisation on, under their names, and give its output."""
        return self.linear(names, block.A, [(gain,) for gain in block.B], block.C, (block.D,), [value])

    def linear(self, names: list[str], A: Any, B: Any, C: Any, D: Any, inputs: list[Row]) -> Row:
        """Put states on that move by A x + B e, and give C x + D e."""
        x = [self.state(name) for name in names]
        for name, row, driven in zip(names, A, B, strict=True):
            self.moves(name, _sum(row, x) + _sum(driven, inputs))
        return _sum(C, x) + _sum(D, inputs)

    # -- the drive ----------------------------------------------------------------------------------------

    def controllers(self) -> Row:
        """The cascade, outermost stage first; what it gives to the plant."""
        plant, stages = self.drive.plant, self.program.stages
        self.signals |= {name: self.state(name) for name in plant.states}
        for name, terms in plant.rows.items():
            self.signals[name] = total(value * self.state(state) for state, value in terms.items())
        if self.program.shares_speed and self.updates(self.drive.interval["speed"]):
            self.measured_speed()  # whether or not a stage takes it in this tick
        if not stages:
            value = self.command() if self.updates(1) else None
            return self.held("u", value, 1, 1)
        reference = None
        for k in reversed(range(len(stages))):
            stage, every = stages[k], self.drive.interval[stages[k]]
            target, value = self.drive.target[stage], None
            if self.updates(every):
                reference = self.command() if stage == stages[-1] else reference
                assert reference is not None
                value = self.at_cut(target, getattr(self, stage)(reference))
            reference = self.held(target, value, every, self.drive.interval[stages[k - 1]] if k else 1)
            self.signals.setdefault(target, reference)
        assert reference is not None
        return reference

    def acting(self) -> tuple[Row, Row]:
        """Torque at the motor and load torque on the output shaft: from outside, and the drive's own."""
        plant = self.drive.plant
        torque, load_torque = (
            Row.of(name) + total(gain * self.signals[row] for row, gain in own.items())
            for name, own in (("torque", plant.torque), ("load_torque", plant.load_torque))
        )
        return torque, load_torque

    def at_cut(self, name: str, value: Row) -> Row:
        """Leave a signal behind; what goes on is the cut's input where it is cut here."""
        self.signals[name] = value
        return Row.of("cut") if self.program.cut == name else value

    def command(self) -> Row:
        """The reference of the outermost stage, behind the command's filter where it is the drive's own."""
        value, block = Row.of("ref"), self.drive.command_filter
        if block is not None and self.program.outer == self.drive.outermost:
            value = self.apply("command", block, value)
        return self.at_cut(BEHIND_FILTER, value)

    def position(self, reference: Row) -> Row:
        """P, PI or PID on the angle, and the feed-forward of speed and acceleration."""
        law, N, T = self.control.position_loop, self.drive.ratio, self.drive.period_s("position")
        command = N * reference
        measured = self.signals["output_angle"] if law.sensor == "output" else self.signals["th"] / N
        own = self.at_cut("output", measured)
        error = self.at_cut("e_th", command - N * own)
        if law.law is not None:
            seen = {"output_angle": own} if law.sensor == "output" else {"angle": N * own}
            self.signals["w_cmd"] = self.own_law("position", law.law, command, error, seen)
            return self.signals["w_cmd"]
        value = self.apply("position", self.drive.law("position"), error)
        if present(law.derivative_time_s):
            slope = self.derivative("e_th", error, T)
            if present(law.derivative_filter_s):
                slope = self.apply("derivative", blocks.lag(law.derivative_filter_s, T), slope)
            value = value + law.gain * law.derivative_time_s * slope
        if present(law.feedforward) or present(law.acceleration_feedforward):
            rate = self.derivative("ref", command, T)
            value = value + law.feedforward * rate
        if present(law.acceleration_feedforward):
            model = self.design.controller_model
            needed = model.inertia_kgm2 / torque_per_command(model)  # J/kM
            made = law.acceleration_feedforward * needed * self.derivative("rate", rate, T)
            if "velocity" not in self.program.stages:
                value = value + made
            else:
                self.extra = made
        self.signals["w_cmd"] = value
        return value

    def measured_speed(self) -> Row:
        """The speed as the drive knows it, every velocity period."""
        if "w_meas" in self.signals:
            return self.signals["w_meas"]
        velocity, encoder, T = self.control.velocity, self.design.encoder, self.drive.period_s("speed")
        behind = velocity is not None and velocity.sensor == "output"
        speed = self.signals["load_speed" if behind else "w"]
        angle = self.drive.ratio * self.signals["output_angle"] if behind else self.signals["th"]
        block = blocks.speed_estimate(encoder, T)
        if block is not None:
            speed = self.estimated(block, speed, angle)
        if present(encoder.filter_time_s):
            speed = self.apply("speed", blocks.lag(encoder.filter_time_s, T), speed)
        for k, item in enumerate(self.drive.filters("speed"), 1):
            speed = self.apply(f"speed{k}", blocks.biquad(item, T), speed)
        self.signals["w_meas"] = speed
        return speed

    def velocity(self, reference: Row) -> Row:
        """PI on the speed, the feed-forward of acceleration, and the torque filters."""
        error = reference - self.measured_speed() if self.program.measures_speed else reference
        error = self.at_cut(ERRORS["velocity"], error)
        law = self.control.velocity
        assert law is not None
        if law.law is not None:
            value = self.own_law("velocity", law.law, reference, error)
        else:
            value = self.apply("velocity", self.drive.law("velocity"), error)
            self.signals["velocity_integral"] = value - law.gain * error
        if "position" in self.program.stages and present(self.control.position_loop.acceleration_feedforward):
            every = self.drive.interval
            made = self.extra if self.updates(every["position"]) else None
            value = value + self.held("i_ff", made, every["position"], every["velocity"])
        self.signals["torque_command"] = value
        for k, item in enumerate(self.drive.filters("torque"), 1):
            value = self.apply(f"torque{k}", blocks.biquad(item, self.drive.period_s("velocity")), value)
        return value

    def current(self, reference: Row) -> Row:
        """PI on the current, and the feed-forward of back-EMF and resistance voltage."""
        law, motor = self.control.current, self.design.controller_model.effective_motor
        assert law is not None
        assert motor.back_emf_constant_Vs_rad is not None
        assert motor.resistance_ohm is not None
        error = reference if "current" in self.program.opened else reference - self.signals["i"]
        error = self.at_cut(ERRORS["current"], error)
        if law.law is not None:
            value = self.own_law("current", law.law, reference, error)
        else:
            value = self.apply("current", self.drive.law("current"), error)
            self.signals["current_integral"] = value - law.gain_V_A * error
        if self.program.feeds_back_emf:
            gain = law.back_emf_feedforward * motor.back_emf_constant_Vs_rad
            value = value + gain * self.speed_in_use("current")
        if present(law.resistance_feedforward):
            value = value + law.resistance_feedforward * motor.resistance_ohm * reference
        return value

    def own_law(
        self, stage: str, law: Law, command: Row, error: Row, seen: Mapping[str, Row] | None = None
    ) -> Row:
        """What a law of one's own makes of the signals that it takes (model.md section 10).

        ``seen`` are those that the stage has cut. With its feedback taken away it knows the command alone.
        """
        e = {"command": command, "error": error}
        if stage not in self.program.opened:
            e |= {name: self.signals.get(signal, Row()) for name, signal in OWN_SIGNALS.items()}
            e |= seen or {}
            if "twist" in law.inputs:
                e["twist"] = total(gain * e[name] for name, gain in twist_of(self.design).items())
            if "speed" in law.inputs:
                e["speed"] = self.speed_in_use(stage)
        inputs = [e.get(name, Row()) for name in law.inputs]
        matrices, names = self.own_matrices(law), [f"{stage}.x{k}" for k in range(1, len(law.A) + 1)]
        value = law.gain * self.linear(names, matrices.A, matrices.B, matrices.C, matrices.D, inputs)
        return self.at_cut(LAW_OUTPUT, value)

    def speed_in_use(self, stage: str) -> Row:
        """The measured speed as a stage has it."""
        if self.drive.operating.rotor == "locked":
            return Row()
        every = self.drive.interval["speed"]
        value = self.measured_speed() if self.updates(every) else None
        return self.held("w_meas", value, every, self.drive.interval[stage])


def _sum(gains: Iterable[Any], rows: Iterable[Row]) -> Row:
    return total(gain * row for gain, row in zip(gains, rows, strict=True))
