"""The continuous form with exact delays, and the ideal form without: every loop as an LTI system."""

from __future__ import annotations

from typing import Any

import numpy as np

from actuator_lti.delay_system import DelaySystem
from actuator_lti.errors import InputError
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


def stage_loop(wired: Cascade, stage: str, delays: str) -> Loop:
    """The loop of a stage broken at its own error, inner loops closed, outer ones absent."""
    flow = FlowProgram(wired, stage, ERRORS[stage], delays).flow()
    loop = delay_system(flow, "cut", MEASURED[stage])
    return _loop(wired, loop, stage, wired.target[stage], (ERRORS[stage], MEASURED[stage]))


def point_loop(wired: Cascade, point: str, delays: str) -> Loop:
    """The loop seen at a break point with all other loops closed."""
    flow = FlowProgram(wired, wired.stages[-1], point, delays).flow()
    loop = delay_system(flow, "cut", point, scale=-1.0)
    return _loop(wired, loop, f"at {point}", point, (point, f"{point}_returned"))


def reference_to_output(wired: Cascade, delays: str) -> Any:
    """Command at the output shaft to output angle; the feed-forward acts on the derivative of the command.

    The derivative is carried out exactly: with x' = x - B_rate r the command itself remains as input.
    """
    flow = FlowProgram(wired, "position", None, delays).flow()
    system = delay_system(flow, "ref", "th", scale=1 / wired.ratio)
    rate = delay_system(flow, "ref_rate", "th", scale=1 / wired.ratio)
    if np.any(rate.D11) or np.any(rate.D21):
        return _with_rate(system, rate, wired)
    B = system.B1 + system.A @ rate.B1
    D11, D21 = system.D11 + system.C1 @ rate.B1, system.D21 + system.C2 @ rate.B1
    plain = DelaySystem(
        *(system.A, B, system.B2, system.C1, system.C2), *(D11, system.D12, D21, system.D22), system.delays_s
    )
    return finished(plain, name="reference_to_output", inputs=["th_ref"], outputs=["output_angle"])


def _with_rate(system: DelaySystem, rate: DelaySystem, wired: Cascade) -> Any:
    """The feed-forward through a delay: by the backward difference over the position period (exact delay)."""
    T = wired.period_s("position")
    if np.any(rate.D11):
        raise InputError("control.position.feedforward: the command's derivative reaches the output directly")
    difference = (DelaySystem.from_system(1.0) - DelaySystem.delay(T)) / T
    total = system + rate * difference
    return finished(total, name="reference_to_output", inputs=["th_ref"], outputs=["output_angle"])
