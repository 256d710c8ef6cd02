"""The drive one tick at a time, and its controller alone, for rigs, tests and hardware in the loop."""

from collections.abc import Callable
from contextlib import suppress
from functools import cached_property
from math import isfinite
from typing import Any

import numpy as np

from actuator_lti.design.loader import AnyDesign, as_design
from actuator_lti.errors import InputError, NumericalError, finite_number, shown
from actuator_lti.start.public_arguments import asked
from actuator_lti.types import Floats
from nonlinear._kernels import layout as at
from nonlinear.commands import numbers_of
from nonlinear.native import LIBRARY, parameters
from nonlinear.row.parameters import design_row
from nonlinear.runs.setup import put_state
from nonlinear.runs.trajectory import ADVICE, STATUS, State

STATE_NAMES = {name[2:].lower(): place for name, place in vars(at).items() if name in at.STATE_NAMES}
"""Numbers of the state by name."""
NOTED_NAMES = {"output_angle": at.IO_OUTPUT, "twist": at.IO_TWIST, "coupling_torque": at.IO_COUPLING_TORQUE}
"""What a tick notes of its start, by name; twist and coupling torque are those of an elastic drive."""


def _check(**given: float) -> None:
    """Refuse what is no finite real number, asked in every tick: as cheaply as can be."""
    with suppress(TypeError, ValueError, OverflowError):
        if all(map(isfinite, given.values())):
            return
    for name, value in given.items():
        finite_number(name, value)


@asked
class Drive:
    """A drive with its whole state in one array of floats.

    ``initial``: by default everything at rest at zero; ``load_Nm``: constant load torque, beside slope and
    gravity of the design; ``friction_on``, ``limits_on`` as in `nonlinear.simulate`.

    Examples
    --------
    >>> from actuator_lti import load_design
    >>> drive = Drive(load_design("ilr33-amber"))
    >>> for _ in range(100):
    ...     drive.step(0.01)
    >>> twin = Drive(load_design("ilr33-amber"))
    >>> twin.set(drive.get())
    >>> drive.step(0.01), twin.step(0.01)
    (None, None)
    >>> bool((drive.get() == twin.get()).all())
    True
    """

    def __init__(
        self,
        design: AnyDesign,
        initial: State | None = None,
        load_Nm: float = 0.0,
        *,
        friction_on: bool = True,
        limits_on: bool = True,
    ) -> None:
        design = as_design(design)
        row = design_row(design, friction_on=friction_on, limits_on=limits_on)
        put_state(row, initial or State())
        row[at.LOAD] = finite_number("load_Nm", load_Nm)
        self.design = design
        self._p, self._s = parameters(row)
        self._io = np.zeros(at.IO_SIZE)

    def __repr__(self) -> str:
        return f"<Drive {self.design.name}: tick {self.value('tick'):.0f}>"

    def __getstate__(self) -> dict[str, Any]:
        """What is copied: calls that hold the places of these arrays are not."""
        return {name: kept for name, kept in vars(self).items() if name not in ("_tick", "_control_tick")}

    @cached_property
    def _tick(self) -> Callable[[], int]:
        return LIBRARY.functions.tick.bound(self._p, self._s, self._io)

    @cached_property
    def _control_tick(self) -> Callable[[], float]:
        return LIBRARY.functions.control_tick.bound(self._p, self._s, self._io)

    def step(self, command: float, load_Nm: float = 0.0, torque_Nm: float = 0.0) -> None:
        """One tick of controller and plant.

        ``command``: of the outermost stage, rad or rad/s at the output shaft, A or V; ``load_Nm``: added to
        the constant one, held over the tick; ``torque_Nm``: extra, at the motor shaft.

        Raises `InputError`: for a command, load or torque that is no finite number. Raises `NumericalError`:
        if the drive has failed: too many events in a tick, or a state without bound.
        """
        _check(command=command, load_Nm=load_Nm, torque_Nm=torque_Nm)
        self._io[at.IN_COMMAND] = command
        if load_Nm or torque_Nm or self._p[at.LOAD_VARIES]:
            self._p[at.LOAD_VARIES] = 1.0
            self._io[at.IN_LOAD], self._io[at.IN_TORQUE] = load_Nm, torque_Nm
        status = STATUS[self._tick()]
        if status != "ok":
            raise NumericalError(f"tick {self.value('tick'):.0f} ({status}): {ADVICE[status]}")

    def control(
        self,
        command: float,
        current_A: float,
        speed_rad_s: float,
        angle_rad: float,
        output_angle_rad: float | None = None,
        bus_V: float | None = None,
        output_speed_rad_s: float | None = None,
    ) -> float:
        """One tick of the controller alone on measured values (motor side); returns the voltage.

        ``output_angle_rad`` and ``output_speed_rad_s`` are needed where the output's sensor is used,
        ``bus_V`` where the supply is modelled.

        Raises `InputError`: for one that is no finite number.
        """
        _check(command=command, current_A=current_A, speed_rad_s=speed_rad_s, angle_rad=angle_rad)
        if output_angle_rad is None:
            output_angle_rad = angle_rad / self.design.total_ratio
        if output_speed_rad_s is None:
            output_speed_rad_s = speed_rad_s / self.design.total_ratio
        bus_V = self.design.limits.voltage_V if bus_V is None else bus_V
        _check(output_angle_rad=output_angle_rad, output_speed_rad_s=output_speed_rad_s, bus_V=bus_V)
        measured = (current_A, speed_rad_s, angle_rad, output_angle_rad, output_speed_rad_s)
        self._io[at.IN_COMMAND] = command
        self._io[at.IN_CURRENT : at.IN_OUTPUT_SPEED + 1] = measured
        self._io[at.IN_BUS] = bus_V
        return self._control_tick()

    def get(self) -> Floats:
        """A copy of the whole state."""
        return self._s.copy()

    def set(self, state: Floats) -> None:
        """Go on from a state that `get` of a drive of the same design returned."""
        given = numbers_of("state", state)
        if given.size != self._s.size:
            message = f"state of {given.size} numbers: this drive has {self._s.size}"
            raise InputError(message, where=self.design.name)
        if not (np.isfinite(given) | (given == self._s)).all():  # a limit that there is not is inf in it
            raise InputError(f"state = {shown(state)}: must be finite", where=self.design.name)
        self._s[:] = given

    def set_motion(self, state: Floats) -> None:
        """Go on from the motion in a state of another drive with this motor, load and delay."""
        end = at.S_QUEUE + int(self._p[at.DELAY_LINE])
        self._s[:end] = numbers_of("state", state)[:end]
        self._s[[at.S_UNTIL_OUTER, at.S_UNTIL_VELOCITY]] = 0.0  # its stages are updated at the next tick

    def value(self, name: str) -> float:
        """A number of the state by its name in `STATE_NAMES`."""
        if name not in STATE_NAMES:
            raise InputError(f"state {name!r}: one of {', '.join(STATE_NAMES)}")
        return float(self._s[STATE_NAMES[name]])

    def noted(self, name: str) -> float:
        """A number that the last `step` noted at its start, by its name in `NOTED_NAMES`."""
        if name not in NOTED_NAMES:
            raise InputError(f"noted {name!r}: one of {', '.join(NOTED_NAMES)}")
        return float(self._io[NOTED_NAMES[name]])
