"""An outer loop around a drive: an airframe with its controller, given as a linear system, closed and judged.

With T the drive from its command to what its outermost loop moves, and G the outer loop from there to what is
added to the command with the sign ``s`` (-1: negative feedback), the loop is broken at the command:

    L = -s G T,   the command is  r + s G y.

In the sampled form the command is held over ``k`` updates of the drive's outermost loop, and the outer loop
reads ``y`` at these instants; both are exact.  A continuous G becomes the sampled system that takes ``y`` as
held over its period.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from actuator_lti.errors import InputError
from actuator_lti.loops.result import Loop, Loops

if TYPE_CHECKING:
    import control

_SAME_TIME = 1e-9


@dataclass(frozen=True)
class OuterLoop:
    """A linear system around a drive.

    Attributes
    ----------
    name, input, output : str
        What it is, what it reads, what it gives.
    system : control.StateSpace
        One input, one output; ``dt`` 0 where continuous.
    sampling_period_s : float or None
        How often a continuous system is read, its output held in between; ``None`` where it is not said.
    sign : {-1, 1}
        With which the output is added to the command.
    """

    name: str
    input: str
    output: str
    system: control.StateSpace
    sampling_period_s: float | None = None
    sign: int = -1

    @property
    def continuous(self) -> bool:
        """Whether the system is continuous."""
        return self.system.dt == 0


def loop_around(loops: Loops, outer: OuterLoop) -> Loop:
    """The loop of an outer system around a drive, broken at the drive's command.

    Parameters
    ----------
    loops : Loops
    outer : OuterLoop

    Raises
    ------
    InputError
        For a sampled system around continuous loops, one without a sampling period around sampled ones, or a
        period that is no whole multiple of that of the drive's outermost loop.

    Examples
    --------
    >>> import control
    >>> from actuator_lti import assemble_loops
    >>> airframe = control.ss([[-2.0]], [[60.0]], [[0.5]], [[0.0]])
    >>> loop_around(assemble_loops("ilr33-amber"), OuterLoop("roll rate", "fin", "command", airframe, 1e-3))
    Loop(roll rate, broken at command, in rad, every 1 ms)
    """
    import control

    drive = loops.reference_to_output
    if drive is None:
        raise InputError("--around: these loops have no response to a command", where=loops.design.name)
    if loops.form == "sampled":
        system, period = _sampled(outer, float(drive.dt))
        drive = held(control.ss(drive), round(period / float(drive.dt)))
    else:
        if not outer.continuous:
            message = f"dt: a sampled outer loop; allowed with --form {loops.form}: a continuous one (dt = 0)"
            raise InputError(message, where=outer.name)
        system, period = outer.system, None
    around = drive * (-outer.sign * system)
    unit = _unit(loops)
    return Loop(
        name=outer.name,
        break_point="command",
        plain_open=around,
        plain_closed=around.feedback(1),
        plain_sensitivity=_sensitivity(around),
        period_s=period,
        unit_in=unit,
        unit_out=unit,
    )


def _sensitivity(open_loop: Any) -> Any:
    import control

    if isinstance(open_loop, control.StateSpace):
        return control.ss([], [], [], [[1.0]], open_loop.dt).feedback(open_loop)
    return type(open_loop).from_system(control.ss([], [], [], [[1.0]])).feedback(open_loop)


def _unit(loops: Loops) -> str:
    linear = loops.design.axis == "linear"
    units = {"position": "m" if linear else "rad", "velocity": "m/s" if linear else "rad/s", "current": "A"}
    return units.get(loops.design.controller.outermost, "V")


def _sampled(outer: OuterLoop, drive_s: float) -> tuple[control.StateSpace, float]:
    """The outer system at its instants, and their period."""
    import control

    period = outer.sampling_period_s if outer.continuous else float(outer.system.dt)
    if period is None:
        message = "sampling_period: missing; allowed: a time in s, as the drive is sampled (or --form ideal)"
        raise InputError(message, where=outer.name)
    times = round(period / drive_s)
    if times < 1 or abs(times * drive_s - period) > _SAME_TIME * period:
        key = "sampling_period" if outer.continuous else "dt"
        message = (
            f"{key} = {period:g} s: allowed: whole multiples of {drive_s:g} s, the period of the command"
        )
        raise InputError(message, where=outer.name)
    if outer.continuous:
        return control.ss(control.sample_system(outer.system, period, method="zoh")), period
    return outer.system, period


def held(system: control.StateSpace, times: int) -> control.StateSpace:
    """A sampled system at every ``times``-th instant, its input held in between."""
    import control

    if times == 1:
        return system
    A, B = np.asarray(system.A), np.asarray(system.B)
    power, total = np.eye(A.shape[0]), np.zeros_like(B)
    for _ in range(times):
        total, power = A @ total + B, A @ power
    return control.ss(power, total, system.C, system.D, times * system.dt)
