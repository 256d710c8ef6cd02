"""The step response of a loop in the simulator, and its figures."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from analyses.validation.own_error import ROUNDING, carried_on, speed_bit
from nonlinear import Trajectory
from nonlinear.loop_setup import LoopSetup, standing_setup

Floats = npt.NDArray[np.float64]
SMALL_ANGLE_RAD = 1e-6  # of a step with gravity: its moment is proportional to the angle to half of that
SETTLED = 0.02  # band of the settling time
UNSETTLED = 1e-3  # of a step: so much may be left to come for its end to count as the final value
STEP_PART = 0.02  # of the room of the signal


@dataclass(frozen=True)
class StepMeasured:
    """Step response of a loop in the simulator; figures as `actuator_lti.step.StepFigures`.

    ``reason`` is empty where neither a limit nor a reversal took part.  ``error`` is the relative error of
    the final value (what its last tenth moves, carried on to the end of the slowest mode, and rounding), the
    other two what it does to the times.  ``size`` is that of the step, in the unit of the point; the response
    is per unit.  ``to_come`` is the part of the error by which the response has not ended.
    """

    rise_time_s: float
    overshoot_percent: float
    settling_time_s: float
    final_value: float
    time_s: Floats
    response: Floats
    reason: str
    error: float = 0.0
    rise_error_s: float = 0.0
    settling_error_s: float = 0.0
    size: float = 0.0
    to_come: float = 0.0


Course = tuple[Floats, Floats]  # in front of the instrument, and of the output


def step_response(
    setup: LoopSetup,
    settle_ticks: int,
    slowest_ticks: float,
    size: float | None = None,
    steady: Course | None = None,
) -> StepMeasured:
    """Step added at the rig's point: what comes back is the step response of T.

    Parameters
    ----------
    setup : LoopSetup
    settle_ticks : int
        Length of the run.
    slowest_ticks : float
        Slowest time constant of the loop: what the end of a run that does not hold it leaves to come.
    size : float, optional
        What to begin with, by default a small part of the way to the nearest limit.
    steady : Course, optional
        What `without_step` gives for as many ticks.
    """
    size = first_size(setup) if size is None else size
    steady = without_step(setup, settle_ticks) if steady is None else steady
    for _ in range(3):
        time_s, response, reason, turned = _step(setup, size, settle_ticks, steady)
        bent = setup.design.load.gravity is not None and turned > SMALL_ANGLE_RAD
        if not reason and not bent:
            break
        size *= SMALL_ANGLE_RAD / turned if bent else 0.2
    figures = _figures(setup, size, slowest_ticks, time_s, response, reason)
    if reason:  # the smallest step still met a limit, or friction: the linear loop shows itself without them
        small = standing_setup(setup.design, setup.loop, held=setup.held)
        time_s, response, reason, _ = _step(small, size, settle_ticks, without_step(small, settle_ticks))
        figures = _figures(small, size, slowest_ticks, time_s, response, reason)
    return replace(figures, size=size)


def _figures(
    setup: LoopSetup, size: float, slowest_ticks: float, time_s: Floats, response: Floats, reason: str
) -> StepMeasured:
    """The figures, to what rounding of the speed leaves of them.

    Every tick rounds by half a bit, of which the loop forgets what is older than its rise time.
    """
    tick_s = setup.design.controller.period_s
    slowest_s = slowest_ticks * tick_s
    figures = step_figures_of(time_s, response, slowest_s, reason)
    memory = max(figures.rise_time_s / tick_s, 2.0)
    if not np.isfinite(memory):
        return figures
    rounding = 0.5 * memory * float(speed_bit(setup, time_s[-1] / tick_s)) / size
    return step_figures_of(time_s, response, slowest_s, reason, rounding)


def first_size(setup: LoopSetup) -> float:
    """A small part of the way to the nearest limit, in the unit of the point."""
    signal = {"u": "voltage_V", "i_ref": "current_command_A", "w_ref": "speed_command_rad_s"}[setup.point]
    room = setup.room[signal]
    return STEP_PART * (room if np.isfinite(room) else max(abs(setup.bias.speed_rad_s), 1.0))


def without_step(setup: LoopSetup, settle_ticks: int) -> Course:
    """The drive as it starts: what that leaves to settle is no part of an answer."""
    run = _run(setup, 0.0, settle_ticks)
    return run.probes[setup.point].before, run.output_angle_rad


def _run(setup: LoopSetup, size: float, settle_ticks: int) -> Trajectory:
    """The drive with a step, recorded at the updates of the point."""
    row, n = setup.row(), setup.hold_ticks
    row["ticks"], row["record_every"] = settle_ticks + 4 * n, n
    row.step(setup.point, size)
    return row.trajectory()


def _step(
    setup: LoopSetup, size: float, settle_ticks: int, steady: Course
) -> tuple[Floats, Floats, str, float]:
    """Times, and the difference that a step makes, at the updates of the point.

    Then what limited it, and the largest difference of the output angle.
    """
    run = _run(setup, size, settle_ticks)
    reason = next((f"{name} limit" for name, use in run.limits.items() if use.active), "")
    if run.status != "ok":
        reason = run.status
    elif not reason and run.events and setup.bias.delicate:
        reason = "speed reversal"
    turned = float(np.abs(run.output_angle_rad - steady[1]).max())
    return run.time_s, (steady[0] - run.probes[setup.point].before) / size, reason, turned


def step_figures_of(
    time_s: Floats, response: Floats, slowest_s: float, reason: str = "", rounding: float = 0.0
) -> StepMeasured:
    """Rise (10 to 90 %), overshoot and settling (2 %) at the samples of a response.

    ``slowest_s`` is the slowest time constant; ``rounding`` what the response may be off by, per unit of the
    step.
    """
    final = float(response[-1])
    nothing = float("nan")
    if not np.isfinite(response).all() or final == 0.0:
        return StepMeasured(nothing, nothing, nothing, nothing, time_s, response, reason or "run stopped")
    y, last = response / final, max(response.size // 10, 2)
    left = float(carried_on(np.asarray(np.ptp(y[-last:])), time_s[-1] - time_s[-last], slowest_s))
    if not reason and left > UNSETTLED:
        reason = (
            f"not settled at the end of the longest run of {time_s[-1]:.3g} s ({left:.1g} of it is to come)"
        )
    error = left + ROUNDING + rounding / abs(final)
    settled = [_settled(time_s, y, SETTLED + part * error) for part in (0.0, 1.0, -1.0)]
    rises = [_rise(time_s, y * (1.0 + part * error)) for part in (0.0, 1.0, -1.0)]
    over = max(100.0 * (float(y.max()) - 1.0), 0.0)
    return StepMeasured(
        rises[0],
        over,
        settled[0],
        final,
        time_s,
        response,
        reason,
        error,
        _spread(rises),
        _spread(settled),
        to_come=left,
    )


def _rise(time_s: Floats, y: Floats) -> float:
    """10 to 90 %."""
    return float(time_s[int(np.argmax(y >= 0.9))] - time_s[int(np.argmax(y >= 0.1))])


def _settled(time_s: Floats, y: Floats, band: float) -> float:
    """From when on a response stays within a band about 1."""
    outside = np.flatnonzero(np.abs(y - 1.0) > band)
    return float(time_s[min(int(outside[-1]) + 1, y.size - 1)]) if outside.size else 0.0


def _spread(values: list[float]) -> float:
    return max(values) - min(values)
