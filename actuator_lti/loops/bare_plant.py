"""The plant by itself, its inputs and outputs named: what a controller made elsewhere is designed for."""

from __future__ import annotations

from dataclasses import replace
from os import PathLike
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from actuator_lti.design.loader import as_design
from actuator_lti.design.model import Command
from actuator_lti.drive.operating import Operating
from actuator_lti.drive.wiring import COMMANDS, Drive, wire
from actuator_lti.errors import InputError
from actuator_lti.loops import walk
from actuator_lti.loops.continuous import flow_system
from actuator_lti.loops.flow import ALL, FlowProgram
from actuator_lti.loops.result import Form
from actuator_lti.loops.tick import TickProgram

if TYPE_CHECKING:
    import control

    from actuator_lti.design.model import Design
    from actuator_lti.drive.operating import OperatingPoint, RotorState
    from actuator_lti.systems.delay_system import DelaySystem

PlantInput = Literal["u", "i_ref"]
INPUTS = ("ref", "load_torque")  # the first by the name of the command
OUTPUTS = {"current": "i", "speed": "w", "angle": "th", "output_angle": "output_angle", "twist": "twist",
           "output_speed": "output_speed"}  # fmt: skip


def plant(
    design: Design | str | PathLike[str], form: Form = "sampled", rotor: RotorState = "free",
    command: PlantInput = "u", operating_point: OperatingPoint = "sliding", load_Nm: float = 0.0
) -> control.StateSpace | DelaySystem:  # fmt: skip
    """The drive without its velocity and position controller, as a python-control system.

    ``design``: a design, a shipped name, or the path of a design file.
    ``form``: "sampled": exact, at the base period Ts, behind the hold and the computing delay d;
    "continuous": the command late by exactly d + Ts/2 (a `DelaySystem`, else a `control.StateSpace`);
    "ideal": without delay.
    ``rotor``: "free", or "locked": only the electrical part.
    ``command``: the first input: "u", the voltage in V (of an ideal source its drive signal), or "i_ref", the
    current command in A of the design's own current loop, which measures a speed that it takes in every tick.
    ``operating_point``: slope of the friction and contact of the coupling, see
    `actuator_lti.drive.operating.Operating`.
    ``load_Nm``: load torque at the output shaft: more dry friction.

    Inputs of the system: ``command``, and ``load_torque`` in N m, which pushes the output shaft forward (held
    over the tick; without effect where the load path locks itself). Outputs, those that the drive has:
    ``current`` in A, ``speed`` and ``angle`` of the motor in rad/s and rad, ``output_angle`` in rad,
    ``twist`` of the coupling in rad at its own shaft, ``output_speed`` in rad/s (linear axis: m for rad, N
    for N m): the signals that a law of one's own takes, see `Design.with_law`.

    Raises `InputError`: for an unknown form or input, or a design that has no current loop.

    Examples
    --------
    >>> system = plant("joint")
    >>> system.input_labels, system.output_labels
    (['u', 'load_torque'], ['current', 'speed', 'angle', 'output_angle', 'twist', 'output_speed'])
    """
    design = as_design(design)
    control = replace(design.controller, position=None, velocity=None)
    if command == "u":
        control = replace(control, current=None)
    elif control.current is None:
        raise InputError(f"command = 'i_ref': the design {design.name} has no current loop")
    at = Operating(point=operating_point, load_Nm=load_Nm, rotor=rotor)
    wired = wire(replace(design, controller=control, command=Command()), at)
    assert COMMANDS[wired.outermost] == command
    return _sampled(wired, command) if form == "sampled" else _continuous(wired, command, form)


def _names(signals: dict[str, Any], command: str) -> tuple[list[str], dict[str, Any]]:
    """The signals behind the outputs that there are, and the names for python-control."""
    present = {label: signal for label, signal in OUTPUTS.items() if signal in signals}
    return list(present.values()), {
        "inputs": [command, *INPUTS[1:]], "outputs": list(present), "name": "plant",
    }  # fmt: skip


def _sampled(wired: Drive, command: str) -> control.StateSpace:
    import control

    program = TickProgram(wired, wired.outermost)
    tick, n = program.tick(0), len(program.states)
    columns = [walk.INPUTS.index(name) for name in INPUTS]
    signals, names = _names(tick.signals, command)
    rows = np.array([tick.signals[signal] for signal in signals])
    parts = (tick.A, tick.B[:, columns], rows[:, :n], rows[:, n:][:, columns], wired.tick_s)
    states = [state.replace(".", "_") for state in program.states]
    return control.ss(*parts, remove_useless_states=False, states=states, **names)


def _continuous(wired: Drive, command: str, form: Form) -> control.StateSpace | DelaySystem:
    flow = FlowProgram(wired, wired.outermost, None, (), ALL if form == "continuous" else frozenset()).flow()
    signals, names = _names(flow.signals, command)
    plain = flow_system(flow, INPUTS, np.array([flow.signals[signal] for signal in signals]))
    if form == "ideal":
        import control

        parts = (plain.A, plain.B1, plain.C1, plain.D11)
        return control.ss(*parts, remove_useless_states=False, states=list(plain.states), **names)
    from actuator_lti.systems.delay_system import DelaySystem

    return DelaySystem.of(plain, **names)
