"""Limit cycles of friction at one load: predicted ones confirmed or refuted, others found by waiting."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from actuator_lti.design.model import Design
from analyses.limit_cycles.friction import cycles_of_friction, dry_Nm
from analyses.limit_cycles.result import Confirmation, Cycle
from analyses.limit_cycles.run import confirm
from analyses.limit_cycles.stick_slip import StickSlipCycle, stick_slip_cycle
from analyses.motion.settling import Settling, noticed, settlings_of
from analyses.specification.drive_figures import drive_figures
from nonlinear import Rows
from nonlinear.bench.on_the_bench import quiet

if TYPE_CHECKING:
    from actuator_lti.loops import Loops


@dataclass(frozen=True)
class LimitCycles:
    """Everything about limit cycles at one load torque.

    ``design``: without counts and noise.
    ``confirmations``: empty: the describing function predicts none.
    ``stick_slip``: what the analysis of rest, breakaway and slip predicts beside it.
    ``settlings``: steps of several sizes: the drive rests, breaks away, and may hunt.
    """

    design: Design
    confirmations: tuple[Confirmation, ...]
    stick_slip: StickSlipCycle | None
    settlings: tuple[Settling, ...]

    @property
    def hunting(self) -> Settling | None:
        """The largest motion of a step that does not come to rest; None: all do."""
        return noticed(self.design, self.settlings)

    @property
    def by_friction(self) -> bool:
        """Whether a step ended in a cycle in which no limit acts."""
        return self.hunting is not None and not self.hunting.rest.limited

    @property
    def described(self) -> bool:
        """Whether the describing function is right about friction.

        A stable cycle is predicted exactly where a step ends in one, and every predicted one is confirmed.
        """
        stable = any(item.cycle.stable for item in self.confirmations)
        return all(item.verdict == "confirmed" for item in self.confirmations) and stable == self.by_friction

    @property
    def as_predicted(self) -> bool:
        """Whether describing function and stick-slip analysis together are right about friction."""
        slips = self.stick_slip is not None and self.stick_slip.stable
        stable = slips or any(item.cycle.stable for item in self.confirmations)
        return all(item.verdict == "confirmed" for item in self.confirmations) and stable == self.by_friction


def limit_cycles(
    design: Design,
    load_Nm: float,
    predicted: tuple[Cycle, ...] | None = None,
    loops: Loops | None = None,
    settlings: Iterable[Settling] | None = None,
) -> LimitCycles:
    """Predict limit cycles, look for them in the simulator, and wait what steps end in.

    The steps are those that judge the whole drive, without counts and noise (`analyses.motion.settling`).

    What is known already may be given: cycles ``predicted`` by describing function, the sampled sliding
    loops, and what steps of the drive as it is end in, of which those at rest are not asked again.
    """
    given, design = design, quiet(design)
    alike = np.array_equal(Rows.of(given).values, Rows.of(design).values)
    if predicted is None:
        predicted = described_cycles(design, load_Nm)
    checked = tuple(confirm(design, cycle) for cycle in predicted)
    slips = stick_slip_cycle(design, load_Nm, loops)
    known = tuple(one for one in settlings or () if one.load_Nm == load_Nm)
    steps = known if known and alike else settlings_of(design, loops, (load_Nm,), known)
    return LimitCycles(design, checked, slips, steps)


def described_cycles(design: Design, load_Nm: float) -> tuple[Cycle, ...]:
    """Limit cycles by describing function, up to the top speed of the drive."""
    if dry_Nm(design, load_Nm) <= 0.0:
        return ()
    top = drive_figures(design, load_Nm).output_rate_rad_s * design.total_ratio
    return cycles_of_friction(design, load_Nm, top if 0.0 < top < math.inf else 1e3)
