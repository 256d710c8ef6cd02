"""The continuous form with exact delays, and the ideal form without: every loop as an LTI system."""

from __future__ import annotations

from typing import Any

import numpy as np

from actuator_lti.delay_system import DelaySystem
from actuator_lti.drive.wiring import ERRORS, MEASURED, Drive
from actuator_lti.errors import InputError
from actuator_lti.loops.blocks import seen
from actuator_lti.loops.flow import SOURCES, Flow, FlowProgram
from actuator_lti.loops.result import Loop
from actuator_lti.loops.sampled import whole_path
from actuator_lti.rest_mode import without_rest_mode

RATES = {"ref": ("ref", "ref_rate", "ref_rate_rate"), "cut": ("cut", "cut_rate")}
"""An input and its derivatives, as the ideal form has them."""


def delay_system(flow: Flow, source: str, signal: str, scale: float = 1.0, **names: Any) -> DelaySystem:
    """SISO system from one input of a flow to one of its signals, of the states between both."""
    n, k = len(flow.states), len(flow.delays_s)
    row = scale * flow.signals[signal]
    every = np.vstack([flow.rates, flow.delayed])
    u = [n + k + SOURCES.index(source)]
    family = next((names for names in RATES.values() if source in names), (source,))
    depends, driven = every[:, : n + k] != 0, [n + k + SOURCES.index(name) for name in family]
    used = seen(depends, row[: n + k] != 0) & seen(depends.T, np.any(every[:, driven] != 0, axis=1))
    x, z = np.flatnonzero(used[:n]), n + np.flatnonzero(used[n:])
    dx, v, y = every[x], every[z], row[None, :]
    if len(x):
        names["states"] = [flow.states[i].replace(".", "_") for i in x]
    return DelaySystem(
        *(dx[:, x], dx[:, u], dx[:, z]),
        *(y[:, x], v[:, x], y[:, u], y[:, z], v[:, u], v[:, z]),
        flow.delays_s[z - n],
        **names,
    )


def systems(flow: Flow, source: str, signal: str, scale: float = 1.0) -> list[DelaySystem]:
    """The system from an input, and from its derivatives where the flow has them (ideal form)."""
    result = [delay_system(flow, name, signal, scale) for name in RATES.get(source, (source,))]
    while len(result) > 1 and not (np.any(result[-1].B1) or np.any(result[-1].D11)):
        result.pop()
    return result


def joined(parts: list[DelaySystem]) -> DelaySystem:
    """``sum_j s^j G_j`` as one proper system: s (s I - A)^-1 B is B + (s I - A)^-1 A B.

    Raises
    ------
    InputError
        Where it is not proper, as with a derivative without a filter.
    """
    if len(parts) == 1:
        return parts[0]
    first = parts[0]
    A, C = first.A, first.C1
    B, D = np.zeros_like(first.B1), [np.zeros((1, 1)) for _ in parts]
    for j, part in enumerate(parts):
        power = part.B1
        for below in range(j):
            D[j - 1 - below] = D[j - 1 - below] + C @ power
            power = A @ power
        B, D[j] = B + power, D[j] + part.D11
    if any(np.any(np.abs(more) > 1e-12) for more in D[1:]):
        raise InputError("form = 'ideal': a derivative without a filter is no proper system; give it a time")
    return DelaySystem(A, B, [], C, [], D[0], [], [], [], [], states=first.state_labels)


def finished(system: DelaySystem, **names: Any) -> Any:
    """The system under its names; `control.StateSpace` where it has no delay.

    That one without a mode at zero frequency that it does not show, see `rest_mode`.
    """
    if system.delay_free:
        plain = system.to_state_space()
        A, B, C, kept = without_rest_mode(plain.A, plain.B, plain.C, 0.0)
        if not kept.all():
            labels = [name for name, there in zip(system.state_labels, kept, strict=True) if there]
            system = DelaySystem(A, B, [], C, [], plain.D, [], [], [], [], states=labels)
    system.update_names(**names)
    return system.to_state_space() if system.delay_free else system


def _loop(wired: Drive, loop: DelaySystem, name: str, point: str, signals: tuple[str, str]) -> Loop:
    error, measured = signals
    label, unit = name.replace(" ", "_"), wired.unit(error)
    one = DelaySystem.from_system(1.0)
    return Loop(
        name=name,
        break_point=point,
        plain_open=finished(loop, name=f"{label}_open_loop", inputs=[error], outputs=[measured]),
        plain_closed=finished(
            loop.feedback(), name=f"{label}_closed_loop", inputs=["reference"], outputs=[measured]
        ),
        plain_sensitivity=finished(
            one.feedback(loop), name=f"{label}_sensitivity", inputs=["reference"], outputs=[error]
        ),
        period_s=None,
        unit_in=unit,
        unit_out=unit,
    )


def stage_system(
    wired: Drive, stage: str, delays: frozenset[str], opened: tuple[str, ...] = ()
) -> DelaySystem:
    """The open loop of a stage at its own error, inner loops closed (unless opened), outer ones absent."""
    flow = FlowProgram(wired, stage, ERRORS[stage], opened, delays).flow()
    measured = "output" if stage == "position" else MEASURED[stage]
    return joined(systems(flow, "cut", measured, wired.ratio if stage == "position" else 1.0))


def stage_loop(wired: Drive, stage: str, delays: frozenset[str], opened: tuple[str, ...] = ()) -> Loop:
    """The loop of a stage, see `stage_system`."""
    loop = stage_system(wired, stage, delays, opened)
    return _loop(wired, loop, stage, wired.target[stage], (ERRORS[stage], MEASURED[stage]))


def point_loop(wired: Drive, point: str, delays: frozenset[str]) -> Loop:
    """The loop seen at a break point with all other loops closed."""
    flow = FlowProgram(wired, wired.outermost, point, (), delays).flow()
    loop = joined(systems(flow, "cut", point, scale=-1.0))
    return _loop(wired, loop, f"at {point}", point, (point, f"{point}_returned"))


def _whole(wired: Drive, delays: frozenset[str]) -> Flow:
    return FlowProgram(wired, wired.outermost, None, (), delays).flow()


def reference_to_output(wired: Drive, delays: frozenset[str]) -> Any:
    """Command to what the outermost stage moves, its feed-forward included."""
    source, signal, _, label = whole_path(wired)
    total = joined(systems(_whole(wired, delays), "ref", signal))
    return finished(total, name="reference_to_output", inputs=[source], outputs=[label])


def moment_to_output(wired: Drive, delays: frozenset[str]) -> Any:
    """Moment on the output shaft to the output angle, all loops closed."""
    system = delay_system(_whole(wired, delays), "moment", "output_angle")
    return finished(system, name="moment_to_output", inputs=["moment"], outputs=["output_angle"])
