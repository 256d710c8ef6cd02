"""The exported controller in ``float``, closed around the simulator's plant, beside the simulator itself.

The plant is the design without its loops: its command is the voltage.  At every tick the controller in
``double`` takes the step of the one in ``float`` from the same state, so that what rounding does to each
number is known; what a moved number does to the output later is the response of the closed loop.  Where that
is linear (no dry friction, no counts, no limit) the sum of both bounds the difference from the simulator.

    python -m examples.firmware_controller
"""

from __future__ import annotations

import ctypes
import re
import sys
import tempfile
from dataclasses import dataclass, replace
from math import floor, inf
from pathlib import Path
from typing import Any, Literal

import numpy as np

from actuator_lti import load_design
from actuator_lti.compiled.compiler import compile_files
from actuator_lti.design.model import Command, Design, Encoder, Instruments, Limits
from nonlinear import Drive
from nonlinear.export import controller_export
from nonlinear.row.elastic import is_elastic

Number = Literal["float", "double"]
TYPES: dict[str, Any] = {"double": ctypes.c_double, "float": ctypes.c_float, "int32_t": ctypes.c_int32}
_STRUCT = re.compile(r"typedef struct \{(.*?)\} drive_controller_(state|input|output);", re.DOTALL)
_MEMBER = re.compile(r"^\s*(\w+) (\w+)(?:\[(\d+)\])?;", re.MULTILINE)
_CONSTANT = re.compile(r"#define DRIVE_CONTROLLER_(\w+) ([\d.e+-]+)")
MOVE = 1e-6  # of a number, SI
DECAYED = 1e-9  # share of its largest at which a response has ended


def output_of(drive: Drive, name: Literal["angle", "speed"]) -> float:
    """Angle or speed of the output of a drive, now."""
    if is_elastic(drive.design):
        return drive.value("output" if name == "angle" else "output_speed")
    return drive.value(name) / drive.design.total_ratio


class Plant:
    """Motor, gear and load of a design, under a voltage."""

    def __init__(self, design: Design) -> None:
        bare = replace(design.controller, position=None, velocity=None, current=None)
        self._drive = Drive(
            replace(
                design, controller=bare, command=Command(), encoder=Encoder(), instruments=Instruments(),
                supply=None, limits=Limits(voltage_V=inf),
            )
        )  # fmt: skip

    def step(self, voltage_V: float, load_Nm: float = 0.0) -> None:
        """One tick; the voltage acts after the computing delay."""
        self._drive.step(voltage_V, load_Nm)

    @property
    def output_angle_rad(self) -> float:
        """Now."""
        return output_of(self._drive, "angle")

    def measured(self, name: str, constants: dict[str, float]) -> float:
        """What a member of the controller's input is."""
        angle, output = self._drive.value("angle"), self.output_angle_rad
        known = {"motor_angle": angle, "output_angle": output, "motor_speed": self._drive.value("speed"),
                 "motor_current": self._drive.value("current"),
                 "output_speed": output_of(self._drive, "speed")}  # fmt: skip
        unit = "M" if self._drive.design.axis == "linear" else "RAD"
        if name == "motor_counts":
            return floor(angle * constants[f"COUNTS_PER_{unit}"])
        if name == "output_counts":
            return floor(output * constants[f"OUTPUT_COUNTS_PER_{unit}"])
        return known["_".join(name.split("_")[:2])]


class Firmware:
    """The controller of a design as compiled C."""

    def __init__(self, design: Design, number: Number) -> None:
        texts = controller_export(design, single_precision=number == "float", vectors=False)
        files = {name: texts[name] for name in ("controller.h", "controller.c")}
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "controller.so"
            path.write_bytes(compile_files(files, "controller.so", "linux64", ("-shared", "-fPIC")))
            self._c = ctypes.CDLL(str(path))
        structs = {name: _struct(body) for body, name in _STRUCT.findall(texts["controller.h"])}
        self.state, self._inputs, self._out = (structs[name]() for name in ("state", "input", "output"))
        self._constants = {name: float(value) for name, value in _CONSTANT.findall(texts["controller.h"])}
        self._floats, self.names = _view(self.state, number)
        self._counts, _ = _view(self.state, "int32_t")

    def start(self, plant: Plant) -> None:
        """At rest at the measured angle."""
        self._measure(0.0, plant)
        self._c.drive_controller_start(ctypes.byref(self.state), ctypes.byref(self._inputs))

    def step(self, command: float, plant: Plant) -> float:
        """One tick; returns the voltage."""
        self._measure(command, plant)
        self._c.drive_controller_step(*map(ctypes.byref, (self.state, self._inputs, self._out)))
        return float(self._out.voltage_V)

    def _measure(self, command: float, plant: Plant) -> None:
        for name, _ in self._inputs._fields_:
            given = command if name.startswith("command_") else plant.measured(name, self._constants)
            setattr(self._inputs, name, given)

    @property
    def numbers(self) -> np.ndarray:
        """Floating-point numbers of the state, and last the voltage that is put out."""
        return np.array([*(float(each[0]) for each in self._floats), self._out.voltage_V])

    def add(self, place: int, value: float) -> None:
        """Move a number of the state."""
        self._floats[place] += value

    def copy_from(self, other: Firmware) -> None:
        """Take the state of the same controller of another type."""
        for ours, its in zip(self._floats + self._counts, other._floats + other._counts, strict=True):
            ours[0] = its[0]


def _struct(body: str) -> type[ctypes.Structure]:
    fields = [
        (name, TYPES[kind] * int(count) if count else TYPES[kind])
        for kind, name, count in _MEMBER.findall(body)
    ]
    return type("Struct", (ctypes.Structure,), {"_fields_": fields})


def _view(struct: ctypes.Structure, kind: str) -> tuple[list[np.ndarray], list[str]]:
    """Each number of a type in a structure as an array of one, and its name."""
    views, names = [], []
    for name, held in struct._fields_:
        base, length = getattr(held, "_type_", held), getattr(held, "_length_", 1)
        if TYPES[kind] in (base, held):
            at = getattr(type(struct), name).offset
            views += np.split(np.frombuffer(struct, TYPES[kind], length, at), length)
            names += [name] * length
    return views, names


@dataclass(frozen=True)
class Outcome:
    """Largest difference from the simulator at the output, and what rounding did to each number in a tick."""

    difference_rad: float
    rounding: np.ndarray


def closed(design: Design, commands: np.ndarray, number: Number) -> Outcome:
    """Close the loop of controller and plant, beside the simulator."""
    plant, drive = Plant(design), Drive(design)
    firmware, twin = Firmware(design, number), Firmware(design, "double")
    firmware.start(plant)
    worst, rounding = 0.0, np.zeros_like(firmware.numbers)
    for command in commands:
        twin.copy_from(firmware)
        twin.step(command, plant)
        plant.step(firmware.step(command, plant))
        drive.step(command)
        rounding = np.maximum(rounding, np.abs(firmware.numbers - twin.numbers))
        worst = max(worst, abs(plant.output_angle_rad - output_of(drive, "angle")))
    return Outcome(worst, rounding)


def effects(design: Design, motion: np.ndarray, ticks: int) -> np.ndarray:
    """Sum over time of what one unit of each number does to the output, at the worst phase of the loops.

    A number is moved behind a tick of a motion in which the loop is linear.
    """
    phases = design.controller.position.every if design.controller.position else 1
    firmware = Firmware(design, "double")
    result = np.zeros_like(firmware.numbers)
    for phase in range(phases):
        plain = _response(design, firmware, motion, ticks, phase, None)
        for place in range(result.size):
            moved = np.abs(_response(design, firmware, motion, ticks, phase, place) - plain)
            if moved[-10 * phases :].max() > DECAYED * moved.max():
                raise ValueError(f"{firmware.names[place]}: the response has not ended after {ticks} ticks")
            result[place] = max(result[place], moved.sum() / MOVE)
    return result


def _response(
    design: Design, firmware: Firmware, motion: np.ndarray, ticks: int, phase: int, place: int | None
) -> np.ndarray:
    """Output behind the tick ``phase``, where a number is moved."""
    plant, outputs = Plant(design), []
    firmware.start(plant)
    for k, command in enumerate(motion[: ticks + phase]):
        voltage = firmware.step(command, plant)
        if k == phase and place is not None:
            if place == len(firmware.names):
                voltage += MOVE
            else:
                firmware.add(place, MOVE)
        plant.step(voltage)
        outputs.append(plant.output_angle_rad)
    return np.array(outputs[phase:])


def smooth(design: Design) -> Design:
    """The design without its dry friction."""
    return design.with_values({"friction.dry_torque": 0.0, "friction.load_coefficient": 0.0})


def random_commands(design: Design, ticks: int, size_rad: float, seed: int = 7) -> np.ndarray:
    """Steps of a random walk behind a low-pass, a new one every 20 ms."""
    rng, period = np.random.default_rng(seed), design.controller.period_s
    held = np.repeat(rng.uniform(-1.0, 1.0, ticks // 200 + 1), 200)[:ticks]
    share, result, value = period / 0.01, np.empty(ticks), 0.0
    for k, goal in enumerate(held):
        value += share * (goal - value)
        result[k] = size_rad * value
    return result


def bound_rad(design: Design, commands: np.ndarray, found: Outcome, ticks: int = 4000) -> float:
    """What rounding moves the output by at most, where the loop is linear."""
    return float(found.rounding @ effects(design, commands, ticks))


def main(ticks: int = 20_000) -> None:
    """Difference and bound where the loop is linear, and the difference with all that the drive has."""
    design = load_design("ilr33-amber")
    linear, small = smooth(design), random_commands(design, ticks, 2e-3)
    found, large = closed(linear, small, "float"), random_commands(design, ticks, 0.2)
    sys.stdout.write(
        f"{ticks} ticks of random commands; difference from the simulator, rad at the output\n"
        f"double, with friction and limits: {closed(design, large, 'double').difference_rad:.3g}\n"
        f"float, with friction and limits: {closed(design, large, 'float').difference_rad:.3g}\n"
        f"float, linear: {found.difference_rad:.3g} of a bound of {bound_rad(linear, small, found):.3g}\n"
    )


if __name__ == "__main__":
    main()
