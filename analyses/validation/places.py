"""The places of a drive that are judged: its loops, its break points, the command and the load.

Loops have no counts, noise or supply. The linear writing may be that of another drive, the ``model``.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import inf, isfinite

import numpy as np

from actuator_lti.design.model import Design
from actuator_lti.drive.operating import Operating
from actuator_lti.drive.wiring import wire
from actuator_lti.loops import Loop, Loops, assemble_loops, exact_margins, periodic_loop
from actuator_lti.loops.assemble import loops_at
from actuator_lti.loops.limiters import LimiterPath, limiter_places
from actuator_lti.loops.limiters import Place as LimiterPlace
from actuator_lti.types import Complexes
from analyses.linear.loop_figures import LoopFigures, loop_figures
from analyses.validation.small_signal import Place
from nonlinear import Tangent, tangent
from nonlinear.bench.derivative import tangents
from nonlinear.bench.injection import Watched
from nonlinear.bench.loop_setup import PATHS, LoopSetup, loop_setup
from nonlinear.bench.operating_motion import may_stand, on_its_stand, on_the_bench, standing


@dataclass(frozen=True)
class Bench:
    """A drive on the bench in both writings."""

    design: Design  # what is simulated
    model: Design  # what predictions are made of
    _assembled: dict[tuple[Operating, bool], Loops] = field(default_factory=dict, init=False, repr=False)
    _setups: dict[str, LoopSetup] = field(default_factory=dict, init=False, repr=False)
    _tangents: dict[object, Tangent] = field(default_factory=dict, init=False, repr=False)

    @cached_property
    def drive(self) -> Design:
        """The simulated drive as its loops are tested."""
        return on_its_stand(on_the_bench(self.design))

    @cached_property
    def linear(self) -> Design:
        """The drive that is predicted, tested alike."""
        return on_its_stand(on_the_bench(self.model), self.design)

    def setup(self, name: str) -> LoopSetup:
        """How a place is tested, without limits; the command with its filter where the drive then stands."""
        if name not in self._setups:
            setup = loop_setup(self.drive, name, limits_on=False, held=name == "current")
            if name == "command" and self._filtered:
                drive = _faint(self.drive, self.design)
                if may_stand(drive):
                    setup = LoopSetup(drive, name, standing(drive), limits_on=False)
            self._setups[name] = setup
        return self._setups[name]

    @property
    def _filtered(self) -> bool:
        return max(self.design.command.filter_time_s, self.model.command.filter_time_s) > 0.0

    def loops(self, name: str) -> Loops:
        """The linear loops on the motion of a place."""
        setup = self.setup(name)
        return self._loops_at(setup.bias.operating(setup.design), filtered=setup.design is not self.drive)

    @cached_property
    def commanded(self) -> Loops:
        """The linear loops with the filter of the command; a faint one does not reach the profile."""
        setup = self.setup("command")
        return self._loops_at(setup.bias.operating(setup.design), filtered=self._filtered)

    def _loops_at(self, at: Operating, *, filtered: bool) -> Loops:
        if (at, filtered) not in self._assembled:
            linear = _faint(self.linear, self.model) if filtered else self.linear
            self._assembled[at, filtered] = loops_at(linear, at)
        return self._assembled[at, filtered]

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Loops innermost first, break points, paths."""
        behind = self.design.coupling is not None or self.design.load.path == "back-drivable"
        paths = PATHS if behind else ("command",)  # a self-locking rigid drive does not yield to its load
        wired = wire(self.design)
        return (*wired.stages, *wired.points, *paths)

    def repeats(self, name: str) -> bool:
        """Whether a break point is the outermost loop again: where that is cut, or all that it feeds back."""
        if name not in wire(self.design).points:
            return False
        here, whole = self.setup(name), self.setup(self.design.controller.outermost)
        position = self.design.controller.position
        at_output = name == "output" and position is not None and position.feeds_back_its_angle
        return (here.bias, here.held) == (whole.bias, whole.held) and (here.point == whole.point or at_output)

    def loop(self, name: str) -> Loop:
        """The linear loop of a stage; of the current with the rotor locked, as it is tested."""
        if name == "current":
            return assemble_loops(self.linear, rotor="locked").present["current"]
        return self.loops(name).present[name]

    @cached_property
    def figures(self) -> dict[str, LoopFigures]:
        """Figures of the loops with the outer ones open, by stage."""
        loops = {name: self.loop(name) for name in wire(self.design).stages}
        return {name: loop_figures(loop, loop.plain_closed) for name, loop in loops.items()}

    def place(self, name: str) -> Place:
        """One of `names`, its tangent measured."""
        setup = self.setup(name)
        found = self._tangent(name, setup)
        if name in self.figures:
            own = self.figures[name]
            closed = own.loop.plain_closed
            return Place(
                name=name, condition=setup.condition, tangent=found, predicted=closed, poles=closed.poles(),
                figures=own,
            )  # fmt: skip
        loops = self.loops(name)
        if name in PATHS:
            predicted = self._path(name, loops)
            return Place(name=name, condition=setup.condition, tangent=found, predicted=predicted)
        return self._point(name, setup, found, loops)

    def _tangent(self, name: str, setup: LoopSetup) -> Tangent:
        """The tangent of a place; the outermost loop and the break point that it drives are one place."""
        if name == "command":
            return self._from_command[0]
        if name == "load":
            return tangent(self.drive, name, setup=setup)
        key = (setup.outer, setup.point, setup.bias, setup.held)
        if key not in self._tangents:
            self._tangents[key] = tangent(self.drive, name, setup=setup)
        return replace(self._tangents[key], place=name)

    def onsets(self) -> Iterator[Place]:
        """From the command to what stands in front of each limiter, at its last update before the next."""
        setup, loops = self.setup("command"), self.loops("command")
        for (limiter, k, seen), t in zip(self._watched, self._from_command[1:], strict=True):
            name = f"{limiter.limiter.name}_onset".replace("-", "_")
            path = loops.limiters[limiter.limiter.name]

            def last(z: Complexes, path: LimiterPath = path, s: float = t.hold_s, k: int = k) -> Complexes:
                return np.asarray(path.responses(np.angle(z) / s)[k], dtype=complex)

            yield Place(
                name="command", condition=setup.condition, tangent=t, predicted=last,
                quantity=name if seen.signal == limiter.signals[0] else f"{name}_integral",
            )  # fmt: skip

    @cached_property
    def _watched(self) -> list[tuple[LimiterPlace, int, Watched]]:
        """What stands in front of each limiter: its place, which of its signals, and how it is read."""
        tick_s = self.drive.controller.period_s
        return [
            (each, k, Watched(signal, each.limiter.kind, each.every, each.every * tick_s))
            for each in limiter_places(wire(self.loops("command").design))
            if isfinite(each.limit)
            for k, signal in enumerate(each.signals, -len(each.signals))
        ]

    @cached_property
    def _from_command(self) -> list[Tangent]:
        """From the command to the output, and to what stands in front of each limiter, measured at once."""
        seen = [None, *(watched for _, _, watched in self._watched)]
        return list(tangents(self.setup("command"), "command", seen))

    def _path(self, name: str, loops: Loops) -> Callable[[Complexes], Complexes]:
        """Response of the output to command or load; its poles are those of the loops."""
        if name == "load":
            assert loops.load_torque_system is not None
            return loops.load_torque_system()
        plain = loops.plain_response
        assert plain is not None
        # the reference of a speed drive is the motor's
        geared = self.linear.total_ratio if self.linear.controller.outermost == "velocity" else 1.0
        return lambda z: np.asarray(geared * plain(z), dtype=complex)

    def _point(self, name: str, setup: LoopSetup, found: Tangent, loops: Loops) -> Place:
        """A break point with all loops closed."""
        loop = periodic_loop(loops, name)
        own = loops.break_points[name]
        return Place(
            name=name, condition=setup.condition, tangent=found, predicted=loop.closed, poles=loop.modes(),
            exact=exact_margins(loops, name) if own.periodic or name == "u" else None, critical=loop.modes,
            figures=None if own.periodic else loop_figures(own, bandwidth=False, step=False),
            delayed=self._delayed if name == "u" else None,
        )  # fmt: skip

    def _delayed(self, more_s: float) -> tuple[Tangent, Callable[[], Complexes]]:
        """Tangent at the voltage, and predicted poles over a base period, under a longer computing delay."""
        longer = Bench(_later(self.design, more_s), _later(self.model, more_s))
        setup = longer.setup("u")

        def poles() -> Complexes:
            return periodic_loop(wire(longer.linear, setup.bias.operating(longer.drive)), "u").modes()

        return tangent(longer.drive, "u", setup=setup), poles


def _later(design: Design, more_s: float) -> Design:
    control = design.controller
    return replace(design, controller=replace(control, computing_delay_s=control.computing_delay_s + more_s))


def _faint(bench: Design, design: Design) -> Design:
    """With the filter of the command; a faint one does not reach its rates."""
    faint = replace(design.command, rate_rad_s=inf, acceleration_rad_s2=inf, jerk_rad_s3=inf)
    return replace(bench, command=faint)
