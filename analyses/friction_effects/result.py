"""Everything that is said of dry friction at small signals, in one result."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from actuator_lti.design.loader import AnyDesign, as_design
from actuator_lti.design.model import Design
from actuator_lti.drive.operating import dry_torque
from actuator_lti.loops import Loops, assemble_loops
from analyses.friction_effects.breakaway import Threshold, threshold
from analyses.friction_effects.reversal import Hysteresis, hysteresis
from analyses.large_signal.tones import settling_ticks_in_periods
from analyses.limit_cycles.describing import Cycle, at_load, cycles_of_friction, dry_Nm
from analyses.limit_cycles.run import CycleResult, confirm
from analyses.limit_cycles.stick_slip import StickSlipCycle, stick_slip_cycle
from analyses.motion.settling import Settling, noticed, settlings_of
from analyses.specification.capability import drive_figures
from nonlinear import Rows
from nonlinear.bench.operating_motion import quiet


@dataclass(frozen=True)
class LimitCycles:
    """Everything about limit cycles at one load torque."""

    design: Design  # without counts and noise
    cycles: tuple[CycleResult, ...]  # empty: the describing function predicts none
    stick_slip: StickSlipCycle | None  # what the analysis of rest, breakaway and slip predicts beside it
    settlings: tuple[Settling, ...]  # steps of several sizes: the drive rests, breaks away, and may hunt

    @property
    def hunting(self) -> Settling | None:
        """The largest motion of a step that does not come to rest; None: all do."""
        return noticed(self.design, self.settlings)

    @property
    def by_friction(self) -> bool:
        """Whether a step ended in a cycle in which no limit acts."""
        return self.hunting is not None and not self.hunting.rest.limited

    def right(self, *predicted: bool) -> bool:
        """Whether a stable cycle is predicted exactly where a step ends in one, and all are confirmed."""
        stable = any((*predicted, *(item.cycle.stable for item in self.cycles)))
        return all(item.verdict == "confirmed" for item in self.cycles) and stable == self.by_friction

    @property
    def described(self) -> bool:
        """Whether the describing function is right about friction."""
        return self.right()

    @property
    def as_predicted(self) -> bool:
        """Whether describing function and stick-slip analysis together are right about friction."""
        return self.right(self.stick_slip is not None and self.stick_slip.stable)


def limit_cycles(
    design: Design, load_Nm: float, predicted: tuple[Cycle, ...] | None = None, loops: Loops | None = None,
    settlings: Iterable[Settling] | None = None,
) -> LimitCycles:  # fmt: skip
    """Predict limit cycles, look for them in the simulator, and wait what steps end in.

    Without counts and noise (`analyses.motion.settling`). Known already: ``predicted`` cycles, sampled
    sliding ``loops``, ``settlings`` of the drive as it is, of which those at rest are not asked again.
    """
    given, design = design, quiet(design)
    equal = np.array_equal(Rows.of(given).values, Rows.of(design).values)
    if predicted is None:
        predicted = described_cycles(design, load_Nm)
    checked = tuple(confirm(design, cycle) for cycle in predicted)
    slips = stick_slip_cycle(design, load_Nm, loops)
    known = tuple(one for one in settlings or () if one.load_Nm == load_Nm)
    steps = known if known and equal else settlings_of(design, loops, (load_Nm,), known)
    return LimitCycles(design, checked, slips, steps)


def described_cycles(design: Design, load_Nm: float) -> tuple[Cycle, ...]:
    """Limit cycles by describing function, up to the top speed of the drive."""
    if dry_Nm(design, load_Nm) <= 0.0:
        return ()
    top = drive_figures(design, load_Nm).output_rate_rad_s * design.total_ratio
    return cycles_of_friction(design, load_Nm, top if 0.0 < top < math.inf else 1e3)


@dataclass(frozen=True)
class FrictionPoint:
    """What dry friction does at one load torque."""

    load_Nm: float
    dry_torque_Nm: float  # at the motor, forward
    threshold: Threshold | None  # ``None`` where a forward step has none
    hysteresis: Hysteresis | None
    cycles: LimitCycles


@dataclass(frozen=True)
class FrictionEffects:
    """Friction at small signals, one point a load torque."""

    design: Design
    points: tuple[FrictionPoint, ...]
    integrator: str  # ``"speed"`` or ``"position"``: leaves no lasting error; empty where none does
    reason: str = ""  # why there is nothing to show; then ``points`` is empty


def friction_effects(
    design: AnyDesign, loops: Loops | None = None, *, settlings: Iterable[Settling] | None = None
) -> FrictionEffects:
    """Find threshold, hysteresis, standing error and limit cycles at each load torque of the design.

    ``loops``: sampled and sliding, of this design, if they are there already.
    ``settlings``: what steps of the drive end in, if known already (`settlings_of`).

    Raises `InputError`, `NumericalError`: as `assemble_loops` and `simulate`.
    """
    design = as_design(design)
    control, own, integrator = design.controller, design.controller.own_law, ""
    if own is not None and own[1].integrates and own[0] != "current":
        integrator = "speed" if own[0] == "velocity" else own[0]
    elif control.velocity is not None and control.velocity.integral_time_s is not None:
        integrator = "speed"
    elif control.position_loop.integral_time_s is not None:
        integrator = "position"
    loads = design.validation.loads_Nm
    if not any(dry_Nm(design, load) > 0.0 for load in loads):
        return FrictionEffects(design, (), integrator, "the design has no dry friction")
    loops = assemble_loops(design) if loops is None else loops
    settling = settling_ticks_in_periods(loops)
    points, alone = list[FrictionPoint](), quiet(design)
    most = max(loads, key=lambda load: dry_Nm(design, load))
    described = described_cycles(design, most)
    for load in loads:
        scaled = tuple(at_load(cycle, design, load) for cycle in described if dry_Nm(design, load) > 0.0)
        if design.friction.points and load != most:  # a map does not grow in proportion to the load
            scaled = described_cycles(design, load)
        result = threshold(alone, load)
        loop = None if result is None else hysteresis(alone, load, result.static, settling)
        cycles = limit_cycles(design, load, scaled, loops, settlings)
        points.append(FrictionPoint(load, float(dry_torque(design, load, 1)), result, loop, cycles))
    return FrictionEffects(design, tuple(points), integrator)
