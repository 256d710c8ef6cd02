"""What `assemble_loops` returns."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

from actuator_lti.drawing import draw
from actuator_lti.errors import InputError
from actuator_lti.start.public_arguments import checks_arguments
from actuator_lti.systems.as_control import as_control

Form = Literal["sampled", "continuous", "ideal"]
InnerLoops = Literal["closed", "open"]

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from actuator_lti.design.model import Design
    from actuator_lti.drive.operating import Operating, RotorState
    from actuator_lti.drive.wiring import Drive
    from actuator_lti.loops.limiters import LimiterPath
    from actuator_lti.loops.simulation import TickSystem


@dataclass(frozen=True, repr=False)
class Loop:
    """A loop seen at one place: `open_loop`, `closed_loop` and `sensitivity` are python-control systems.

    With e the error there, y what comes back: ``y = L e``, ``e = r - y``.

    ``name``: "current", "velocity", "position", or the break point with all other loops closed.
    ``break_point``: where it is cut: "u", "i_ref", "w_ref", "output". A loop cut at its own error has the
    same L where nothing is fed forward: that stays closed there.
    ``plain_open``, ``plain_closed``, ``plain_sensitivity``: the `PlainSystem` or `PlainDelaySystem` that
    `open_loop`, `closed_loop` and `sensitivity` are made of when they are first asked for; all figures take
    these as well.
    ``period_s``: sampling period of this loop; None where not sampled.
    ``unit_in``, ``unit_out``: units of e and y (the same).
    ``periodic``: whether faster ticks inside slower loops make the loop periodically time-varying: then S and
    T are the fundamental responses of the exact loop and L = T/S, see `actuator_lti.loops.periodic`.
    ``rotor``: "free" or "locked"; with a locked one there is a current loop alone.
    ``at_law``: whether it is the loop of a stage, cut at what a law of one's own gives.
    ``plain_commanded``: of an inner stage with such a law its response from command to measured value:
    L/(1 + L) only where the law takes nothing but the error; else None.
    """

    name: str
    break_point: str
    plain_open: Any
    plain_closed: Any
    plain_sensitivity: Any
    period_s: float | None
    unit_in: str
    unit_out: str
    periodic: bool = False
    rotor: RotorState = "free"
    at_law: bool = False
    plain_commanded: Any = None

    @cached_property
    def open_loop(self) -> Any:
        """L as a python-control system.

        ``control.StateSpace`` (sampled with dt, ideal without) or
        `actuator_lti.systems.delay_system.DelaySystem` (continuous).
        """
        return as_control(self.plain_open)

    @cached_property
    def closed_loop(self) -> Any:
        """T = L/(1 + L) as a python-control system: the feedback loop alone, without the feed-forward.

        Its bandwidth is not that of the drive: see ``Loops.reference_to_output`` for the response to the
        reference, and `actuator_lti.loops.commanded` for that to the command, behind the mean of its profile.
        """
        return as_control(self.plain_closed)

    @cached_property
    def sensitivity(self) -> Any:
        """S = 1/(1 + L) as a python-control system, without the feed-forward."""
        return as_control(self.plain_sensitivity)

    def plot_bode(self, axes: Any = None) -> list[Axes]:
        """Draw the open loop over frequency with every gain and phase margin; gives matplotlib's axes.

        Examples
        --------
        >>> from actuator_lti import assemble_loops
        >>> magnitude, phase = assemble_loops("ilr33-amber").position.plot_bode()
        >>> magnitude.get_ylabel()
        'magnitude, dB'
        """
        return draw("loop_bode", self, axes)

    def plot_nyquist(self, axes: Any = None) -> Axes:
        """Draw the locus of the open loop near -1; gives matplotlib's axes."""
        return draw("plot_nyquist", self.open_loop, label=self.name, axes=axes)

    def plot_step(self, duration_s: float | None = None, axes: Any = None) -> Axes:
        """Draw the step response of the closed loop; gives matplotlib's axes."""
        return draw("plot_step", self.closed_loop, duration_s=duration_s, label=self.name, axes=axes)

    def __repr__(self) -> str:
        kind = "continuous" if self.period_s is None else f"every {1e3 * self.period_s:g} ms"
        periodic = ", fundamental of a periodic loop" if self.periodic else ""
        return f"Loop({self.name}, broken at {self.break_point}, in {self.unit_in}, {kind}{periodic})"


def loop_of(
    wired: Drive, place: str, parts: tuple[Any, Any, Any], own: Any,
    named: Callable[[Any, str, str, str], Any], period_s: float | None = None, *, periodic: bool = False,
) -> Loop:  # fmt: skip
    """The loop of a stage, or at a break point, of L, T, S and an ``own`` response to its command."""
    error, measured = wired.around(place)
    name = place if place in wired.stages else f"at {place}"
    label, unit = name.replace(" ", "_"), wired.unit(error)
    return Loop(
        name=name, break_point=wired.target.get(place, place),
        plain_open=named(parts[0], f"{label}_open_loop", error, measured),
        plain_closed=named(parts[1], f"{label}_closed_loop", "reference", measured),
        plain_sensitivity=named(parts[2], f"{label}_sensitivity", "reference", error), period_s=period_s,
        unit_in=unit, unit_out=unit, periodic=periodic, rotor=wired.operating.rotor,
        at_law=wired.has_own_law(place),
        plain_commanded=None if own is None else named(own, f"{label}_commanded", "command", place),
    )  # fmt: skip


@dataclass(frozen=True, repr=False)
class Loops:
    """All loops of a design in one form at one operating point.

    ``current``, ``velocity``, ``position``: each broken at its own error, with the loops inside it closed (or
    open, see ``inner_loops``) and those outside it open; motor side; None where the design has no such loop.
    ``break_points``: "u", "i_ref", "w_ref", "output", as far as they exist: the loop seen there, all other
    loops closed. "output" is the angle fed back to the position controller (output shaft); a speed estimated
    from the angle stays closed.
    ``limiters``: a `LimiterPath` from the command to what each limiter sees, by the names of
    `actuator_lti.drive.signals.LIMITERS`, as far as they exist.
    ``plain_response``, ``load_torque_system``: what `reference_to_output` is made of when it is first asked
    for (as of a `Loop`), and what makes `load_torque_to_output`.
    ``tick_system``: the whole sampled closed loop, tick by tick (form "sampled").
    ``period_s``: base period Ts; None where not sampled.
    """

    design: Design
    form: Form
    operating: Operating
    inner_loops: InnerLoops
    current: Loop | None
    velocity: Loop | None
    position: Loop | None
    break_points: Mapping[str, Loop]
    limiters: Mapping[str, LimiterPath]
    plain_response: Any | None
    load_torque_system: Callable[[], Any] | None
    tick_system: TickSystem | None
    period_s: float | None

    @cached_property
    def reference_to_output(self) -> Any | None:
        """Command at the output shaft to output angle, feed-forward included, as a python-control system.

        The command is that behind the mean which limits its jerk (`actuator_lti.drive.profile`), before its
        filter. Of a speed drive the command to the motor's speed, of a torque drive to its current, of a
        voltage drive to the motor's speed. None with the rotor locked.
        """
        return as_control(self.plain_response)

    @cached_property
    def load_torque_to_output(self) -> Any | None:
        """Moment on the output shaft, held over every tick, to the output angle, all loops closed.

        The compliance, as a python-control system; its inverse is the dynamic stiffness. It is made when it
        is first asked for: with slow outer stages it has hundreds of states
        (`actuator_lti.loops.stiffness` has the same response with few). None with the rotor locked.
        """
        return None if self.load_torque_system is None else as_control(self.load_torque_system())

    @property
    def operating_point(self) -> str:
        """Name of the operating point, see `actuator_lti.drive.operating.Operating`."""
        return self.operating.point

    @property
    def load_Nm(self) -> float:
        return self.operating.load_Nm

    @property
    def present(self) -> dict[str, Loop]:
        """The loops that exist, innermost first, by name."""
        named = {"current": self.current, "velocity": self.velocity, "position": self.position}
        return {name: loop for name, loop in named.items() if loop is not None}

    @checks_arguments
    def __getitem__(self, name: str) -> Loop:
        known = dict(self.items())
        if name not in known:
            raise InputError(f"loops[{name!r}]: allowed: {', '.join(known)}")
        return known[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.keys())

    def __len__(self) -> int:
        return len(self.items())

    def keys(self) -> list[str]:
        return [name for name, _ in self.items()]

    def values(self) -> list[Loop]:
        return [loop for _, loop in self.items()]

    def items(self) -> list[tuple[str, Loop]]:
        """Names and loops, innermost first, then the break points."""
        return [*self.present.items(), *self.break_points.items()]

    def plot_bode(self, axes: Any = None) -> list[Axes]:
        """Draw the open loops of all stages in one Bode figure; gives matplotlib's axes."""
        for loop in self.present.values():
            axes = draw("plot_bode", loop.open_loop, label=loop.name, axes=axes)
        return list(axes)

    def _repr_html_(self) -> str:
        return draw("loops_html", self)

    def __repr__(self) -> str:
        names, load = ", ".join(self.present), f"{self.load_Nm:g} {self.design.load_unit}"
        where = f"{self.operating_point}, {load}, rotor {self.operating.rotor}"
        return f"Loops({self.design.name}: {names}; {self.form}, {where})"
