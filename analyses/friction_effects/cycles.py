"""Limit cycles in the simulator: foreseen ones confirmed or refuted, others found by waiting after a step."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from actuator_lti.design.model import Design, Instruments
from actuator_lti.drive.operating import dry_torque
from analyses.drive_figures import drive_figures
from analyses.friction_effects.describing import ForeseenCycle, foreseen_cycles
from analyses.friction_effects.stick_slip import StickSlipCycle
from analyses.large_signal.steady_start import PLACES
from analyses.settling import Settling, largest_swing, settle
from nonlinear import Rows

BELOW = 0.3
SCALES = np.geomspace(0.4, 2.5, 41)
CYCLES_WATCHED = 12.0


@dataclass(frozen=True)
class Confirmation:
    """A foreseen cycle against the simulator, from initial states of its shape at several sizes.

    Attributes
    ----------
    foreseen : ForeseenCycle
    simulated_ratio : float or None
        Size, relative to the foreseen, at which motion neither grows nor dies out; ``None``: refuted, as it
        does one or the other at every size from 0.4 to 2.5.
    simulated_hz : float or None
        Frequency next to that size.
    """

    foreseen: ForeseenCycle
    simulated_ratio: float | None
    simulated_hz: float | None

    @property
    def confirmed(self) -> bool:
        """Whether the simulator has it."""
        return self.simulated_ratio is not None


@dataclass(frozen=True)
class LimitCycles:
    """Everything about limit cycles at one load torque.

    Attributes
    ----------
    confirmations : tuple of Confirmation
        Empty: the describing function foresees none.
    stick_slip : StickSlipCycle or None
        What the analysis of rest, breakaway and slip foresees beside it.
    settlings : tuple of Settling
        Steps of several sizes, the last ones below the threshold: the drive rests, breaks away, and may hunt.
    """

    confirmations: tuple[Confirmation, ...]
    stick_slip: StickSlipCycle | None
    settlings: tuple[Settling, ...]

    @property
    def hunting(self) -> Settling | None:
        """The largest motion of a step that does not come to rest; None: all do."""
        return largest_swing(self.settlings)

    @property
    def by_friction(self) -> bool:
        """Whether a step ended in a cycle in which no limit acts."""
        return self.hunting is not None and not self.hunting.rest.limited

    @property
    def described(self) -> bool:
        """Whether the describing function is right about friction.

        A stable cycle is foreseen exactly where a step ends in one, and every foreseen one is confirmed.
        """
        stable = any(item.foreseen.stable for item in self.confirmations)
        return all(item.confirmed for item in self.confirmations) and stable == self.by_friction

    @property
    def as_foreseen(self) -> bool:
        """Whether describing function and stick-slip analysis together are right about friction."""
        slips = self.stick_slip is not None and self.stick_slip.stable
        stable = slips or any(item.foreseen.stable for item in self.confirmations)
        return all(item.confirmed for item in self.confirmations) and stable == self.by_friction


def limit_cycles(
    design: Design,
    load_Nm: float,
    step_rad: float,
    threshold_rad: float | None = None,
    stick_slip: StickSlipCycle | None = None,
    foreseen: tuple[ForeseenCycle, ...] | None = None,
) -> LimitCycles:
    """Foresee limit cycles, look for them in the simulator, and wait what steps end in.

    Parameters
    ----------
    step_rad : float
        A step, and a tenth of it.
    threshold_rad : float, optional
        Command that breaks away at once; a step of `BELOW` of it is waited for too.
    stick_slip : StickSlipCycle, optional
        A cycle foreseen by `analyses.friction_effects.stick_slip`; a step of its size is waited for too.
    foreseen : tuple of ForeseenCycle, optional
        By describing function, if known already.
    """
    design = replace(  # what noise or counts keep moving, friction does not
        design,
        instruments=Instruments(),
        encoder=replace(design.encoder, counts_per_rev=None),
        output_encoder=replace(design.output_encoder, counts_per_rev=None),
    )
    if foreseen is None:
        foreseen = described_cycles(design, load_Nm)
    checked = tuple(_confirm(design, load_Nm, cycle) for cycle in foreseen)
    sizes = [step_rad, 0.1 * step_rad] + ([BELOW * threshold_rad] if threshold_rad else [])
    sizes += [stick_slip.output_amplitude_rad] if stick_slip is not None else []
    return LimitCycles(checked, stick_slip, tuple(settle(design, load_Nm, size) for size in sizes))


def dry_Nm(design: Design, load_Nm: float) -> float:
    """Dry friction at the motor, forward and backward together; of a friction map that at its first point."""
    return float(dry_torque(design, load_Nm, 1) + dry_torque(design, load_Nm, -1))


def described_cycles(design: Design, load_Nm: float) -> tuple[ForeseenCycle, ...]:
    """Limit cycles by describing function, up to the top speed of the drive."""
    if dry_Nm(design, load_Nm) <= 0.0:
        return ()
    top = drive_figures(design, load_Nm).output_rate_rad_s * design.total_ratio
    return foreseen_cycles(design, load_Nm, top if 0.0 < top < math.inf else 1e3)


def _confirm(design: Design, load_Nm: float, cycle: ForeseenCycle) -> Confirmation:
    """Start in the shape of the cycle at many sizes; find where motion turns from dying out to growing."""
    Ts = design.controller.period_s
    window = round(3.0 / (cycle.frequency_hz * Ts))
    rows = Rows.of(design, len(SCALES), limits_on=False)
    rows["load"] = load_Nm
    rows.step("command", 0.0)
    for name, value in cycle.state.items():
        if name in PLACES:
            rows[PLACES[name]] = SCALES * cycle.speed_amplitude_rad_s * value.real
    if "th" in cycle.state and design.controller.velocity is not None:
        before = -design.controller.position_loop.gain * cycle.state["th"].real
        rows["speed_command_start"] = SCALES * cycle.speed_amplitude_rad_s * before
    rows.window(window, 3, 0)
    rows["ticks"] = round(CYCLES_WATCHED / 3.0) * window
    result = rows.run()
    low, high = result.span("motor_speed_rad_s")
    peak = np.maximum(-low, high)
    grows = ~result.ok | (peak > SCALES * cycle.speed_amplitude_rad_s)
    turns = np.flatnonzero(grows[1:] != grows[:-1])
    if len(turns) != 1:
        return Confirmation(cycle, None, None)
    k = int(turns[0])
    ratio = float(math.sqrt(SCALES[k] * SCALES[k + 1]))
    run = simulate_row(rows.take(k if cycle.stable else k + 1), window)
    return Confirmation(cycle, ratio, run)


def simulate_row(row: Rows, ticks: int) -> float | None:
    """Frequency of the motor speed over the first ticks of a row."""
    row["ticks"] = ticks
    run = row.trajectory()
    return _frequency(run.time_s, run.motor_speed_rad_s)


def _frequency(time_s: np.ndarray, values: np.ndarray) -> float | None:
    """Frequency from the rising zero crossings; ``None`` with fewer than two of them."""
    up = np.flatnonzero((values[:-1] < 0.0) & (values[1:] >= 0.0))
    if len(up) < 2:
        return None
    exact = time_s[up] - values[up] * (time_s[up + 1] - time_s[up]) / (values[up + 1] - values[up])
    return float((len(up) - 1) / (exact[-1] - exact[0]))
