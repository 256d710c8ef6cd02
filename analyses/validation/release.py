"""Margins at small, medium and large amplitude, with dry friction and without: the drive let go from there.

There is no operating motion: the drive is released from an initial deviation (angle, speed or current, a
part of its full range), limits act, dry friction sticks.  What is looked for is the gain or delay at which
the oscillation that follows does not die out.  Saturation takes gain away, friction takes energy away: the
border found need not be the linear one, and is reported, not judged.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import ceil, isfinite

import numpy as np
import numpy.typing as npt

from actuator_lti.design.model import Design
from analyses.validation.borders import Border, Search, find_borders
from analyses.validation.confirm import Confirmation
from nonlinear import LIMITERS, Rows
from nonlinear.loop_setup import LoopSetup
from nonlinear.operating_motion import OperatingMotion, full_torque_Nm
from nonlinear.reduced import BatchResult

Floats = npt.NDArray[np.float64]
Progress = Callable[[int, int], None]
SIZES: Mapping[str, float] = {
    "small": 0.02,
    "medium": 0.2,
    "large": 1.0,
}  # of full deflection, speed, current
ALIVE = 0.02  # of the room of the signal
LASTING = 0.97  # from window to window
CYCLES = 8
VALUES = 12


@dataclass(frozen=True)
class Release(Search):
    """A search with the drive released from a deviation; ``expected`` is the linear border."""

    part: float = 1.0
    expected: float = 1.0

    def grid(self) -> Floats:
        """The nominal drive, then around the linear border."""
        if self.kind == "delay":
            return np.geomspace(self.expected / 20.0, 4.0 * self.expected, VALUES)
        return np.concatenate(
            [[1.0], np.geomspace(max(self.expected / 3.0, 1.05), 4.0 * self.expected, VALUES)]
        )

    def started(self, values: Floats) -> Rows:
        """The rig standing, then let go."""
        rows, setup = self.set_up(values), self.setup
        design, sizes = setup.design, full_range(setup.design)
        if setup.outer == "position":
            rows["angle_start"] = -self.part * sizes["position"] * design.total_ratio
        elif setup.outer == "velocity":
            rows["speed_start"] = self.part * sizes["velocity"]
        else:
            rows["current_start"] = self.part * sizes["current"]
        return rows

    @property
    def controlled(self) -> bool:
        """Whether the nominal drive oscillates is part of what is looked for."""
        return False

    def growth(self, result: BatchResult) -> Floats:
        """Positive where the oscillation lasts."""
        spans = [np.subtract(*result.span(self.setup.before, k)[::-1]) for k in (0, 1)]
        alive = spans[0] > ALIVE * _scale(self.setup)
        lasting = spans[0] >= LASTING * spans[1]
        return np.where(~result.ok | (alive & lasting), 1.0, -1.0)


@dataclass(frozen=True)
class AmplitudeMargin:
    """A border from one deviation.

    Attributes
    ----------
    loop : str
    kind : {"gain up", "delay"}
    size : {"small", "medium", "large"}
    part : float
        Of the full deflection, speed or current.
    friction_on : bool
    linear : float
        The linear border (factor, or samples).
    border : Border
        ``value`` 1 with both ends of the bracket 1: the nominal drive oscillates already.
    period_s : float
    limiter : str
        Limit that acts longest while the oscillation lasts, just past the border; empty where none does.
    """

    loop: str
    kind: str
    size: str
    part: float
    friction_on: bool
    linear: float
    border: Border
    period_s: float
    limiter: str = ""


def full_range(design: Design) -> dict[str, float]:
    """Full deflection (output), motor speed and motor current that a drive can reach."""
    limits, motor = design.limits, design.effective_motor
    speed, current = limits.speed_rad_s, limits.peak_current_A
    if motor.resistance_ohm is not None and motor.back_emf_constant_Vs_rad is not None:
        speed = min(speed, limits.voltage_V / motor.back_emf_constant_Vs_rad)
        current = min(current, limits.voltage_V / motor.resistance_ohm)
    elif motor.source_gain_Nm_V is not None and design.friction.viscous() > 0.0:
        speed = min(speed, limits.voltage_V * motor.source_gain_Nm_V / design.friction.viscous())
    if not isfinite(speed):
        place = design.controller.position
        speed = design.validation.full_deflection_rad * design.total_ratio * (place.gain if place else 1.0)
    return {"position": design.validation.full_deflection_rad, "velocity": speed, "current": current}


def _scale(setup: LoopSetup) -> float:
    """What the signal in front of the instrument can reach."""
    sizes = full_range(setup.design)
    values = {"u": setup.design.limits.voltage_V, "i_ref": sizes["current"], "w_ref": sizes["velocity"]}
    return values[setup.point]


def release_margins(
    setups: Mapping[str, LoopSetup],
    confirmed: Sequence[Confirmation],
    settle_ticks: Mapping[str, int],
    *,
    sizes: Mapping[str, float] = SIZES,
    threads: int | None = None,
    progress: Progress | None = None,
) -> tuple[AmplitudeMargin, ...]:
    """Borders of gain and delay of every loop from small, medium and large deviations.

    Parameters
    ----------
    setups, settle_ticks : mapping by stage
    confirmed : sequence of Confirmation
        Their predictions say around what to look.
    """
    cases = [
        (item, size, friction)
        for item in confirmed
        if item.loop in setups and item.kind in ("gain up", "delay") and item.predicted_hz  # a drift has none
        for size in sizes
        for friction in ((False, True) if _has_friction(setups[item.loop].design) else (False,))
    ]
    searches = [
        _release(setups[item.loop], item, sizes[size], friction, settle_ticks[item.loop])
        for item, size, friction in cases
    ]
    borders = find_borders(searches, threads=threads, progress=progress)
    return tuple(
        AmplitudeMargin(
            loop=item.loop,
            kind=item.kind,
            size=size,
            part=sizes[size],
            friction_on=friction,
            linear=float(item.predicted or 0.0),
            border=border,
            period_s=item.period_s,
            limiter=limiter,
        )
        for (item, size, friction), border, limiter in zip(
            cases, borders, _limiters(searches, borders, threads), strict=True
        )
    )


def _limiters(searches: Sequence[Release], borders: Sequence[Border], threads: int | None) -> list[str]:
    """What limits the oscillation just past each border."""
    names = [""] * len(searches)
    known = [k for k, border in enumerate(borders) if border.value is not None]
    if not known:
        return names
    rows = Rows.join([searches[k].rows(np.array([borders[k].bracket[1]])) for k in known])
    result = rows.run(threads=threads)
    shares = np.array([result.window_limit_fraction(name) for name in LIMITERS])
    for k, share in zip(known, shares.T, strict=True):
        if share.max() > 0.0:
            names[k] = LIMITERS[int(np.argmax(share))]
    return names


def _has_friction(design: Design) -> bool:
    return design.friction.dry_torque_Nm > 0.0 or design.friction.offset_torque_Nm != 0.0


def _travel_s(design: Design, stage: str, part: float) -> float:
    """About how long the drive takes to come back, at its limits."""
    if stage == "current":
        return 0.0
    sizes = full_range(design)
    speeding = design.inertia_kgm2 * sizes["velocity"] / full_torque_Nm(design)
    if stage == "velocity":
        return part * speeding
    return part * sizes["position"] * design.total_ratio / sizes["velocity"] + 2.0 * speeding


def _release(
    setup: LoopSetup, item: Confirmation, part: float, friction_on: bool, settle_ticks: int
) -> Release:
    """Set one search up: wait for the travel, then for the oscillation."""
    design, hertz = setup.design, float(item.predicted_hz or 0.0)
    tick_s = design.controller.period_s
    wait = ceil(1.3 * _travel_s(design, setup.outer, part) / tick_s) + max(
        ceil(CYCLES / (hertz * tick_s)), min(settle_ticks, 2000)
    )
    return Release(
        LoopSetup(design, setup.loop, OperatingMotion(0.0, 0.0, 0.0, friction_on)),
        "delay" if item.kind == "delay" else "gain up",
        hertz,
        wait,
        cycles=CYCLES,
        close=0.03,
        smooth=False,
        part=part,
        expected=float(item.predicted or 1.0),
    )
