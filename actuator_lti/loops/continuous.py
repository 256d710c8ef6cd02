"""The continuous form with exact delays, and the ideal form without: every loop as an LTI system."""

from __future__ import annotations

from typing import Any

import numpy as np

from actuator_lti.delay_system import DelaySystem
from actuator_lti.loops.cascade import ERRORS, MEASURED, Cascade
from actuator_lti.loops.flow import INPUTS, Flow, FlowProgram
from actuator_lti.loops.result import Loop


def delay_system(flow: Flow, source: str, signal: str, scale: float = 1.0, **names: Any) -> DelaySystem:
    """SISO system from one input of a flow to one of its signals."""
    n, k = len(flow.states), len(flow.delays_s)
    column = n + k + INPUTS.index(source)
    row = scale * flow.signals[signal]
    x, z, u = slice(0, n), slice(n, n + k), [column]
    dx, y, v = flow.rates, row[None, :], flow.delayed
    return DelaySystem(
        *(dx[:, x], dx[:, u], dx[:, z]),
        *(y[:, x], v[:, x], y[:, u], y[:, z], v[:, u], v[:, z]),
        flow.delays_s,
        **names,
    )


def finished(system: DelaySystem, **names: Any) -> Any:
    """The system under its names; `control.StateSpace` where it has no delay."""
    system.update_names(**names)
    return system.to_state_space() if system.delay_free else system


def _loop(wired: Cascade, loop: DelaySystem, name: str, point: str, signals: tuple[str, str]) -> Loop:
    error, measured = signals
    label, unit = name.replace(" ", "_"), wired.unit(error)
    one = DelaySystem.from_system(1.0)
    return Loop(
        name=name,
        break_point=point,
        open_loop=finished(loop, name=f"{label}_open_loop", inputs=[error], outputs=[measured]),
        closed_loop=finished(
            loop.feedback(), name=f"{label}_closed_loop", inputs=["reference"], outputs=[measured]
        ),
        sensitivity=finished(
            one.feedback(loop), name=f"{label}_sensitivity", inputs=["reference"], outputs=[error]
        ),
        period_s=None,
        unit_in=unit,
        unit_out=unit,
    )


def stage_loop(wired: Cascade, stage: str, delays: str, opened: tuple[str, ...] = ()) -> Loop:
    """The loop of a stage broken at its own error, inner loops closed (unless opened), outer ones absent."""
    flow = FlowProgram(wired, stage, ERRORS[stage], delays, opened).flow()
    loop = delay_system(flow, "cut", MEASURED[stage])
    return _loop(wired, loop, stage, wired.target[stage], (ERRORS[stage], MEASURED[stage]))


def point_loop(wired: Cascade, point: str, delays: str) -> Loop:
    """The loop seen at a break point with all other loops closed."""
    flow = FlowProgram(wired, wired.stages[-1], point, delays).flow()
    loop = delay_system(flow, "cut", point, scale=-1.0)
    return _loop(wired, loop, f"at {point}", point, (point, f"{point}_returned"))


def feedforward_rate(wired: Cascade, delays: str, s: np.ndarray) -> np.ndarray:
    """What the feed-forward takes for the derivative of the command: s, or with delays the controller's own.

    With delays it is the backward difference over the position period, (1 - exp(-s T))/T, as in the tick.
    """
    T = wired.period_s("position")
    return s if delays == "none" else -np.expm1(-s * T) / T


def reference_to_output(wired: Cascade, delays: str) -> Any:
    """Command at the output shaft to output angle, with the feed-forward on the derivative of the command.

    Ideal form: the exact derivative (with x' = x - B_rate r the command itself remains as input); with
    delays see `feedforward_rate`, its delay kept exactly.
    """
    flow = FlowProgram(wired, "position", None, delays).flow()
    system = delay_system(flow, "ref", "th", scale=1 / wired.ratio)
    rate = delay_system(flow, "ref_rate", "th", scale=1 / wired.ratio)
    if wired.design.controller.position_loop.feedforward == 0.0:
        total = system
    elif system.delay_free:
        B, D = system.B1 + system.A @ rate.B1, system.D11 + system.C1 @ rate.B1
        total = DelaySystem(system.A, B, [], system.C1, [], D, [], [], [], [])
    else:
        T = wired.period_s("position")
        total = system + rate * ((DelaySystem.from_system(1.0) - DelaySystem.delay(T)) / T)
    return finished(total, name="reference_to_output", inputs=["th_ref"], outputs=["output_angle"])
