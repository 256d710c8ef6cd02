"""The continuous form with exact delays, and the ideal form without: every loop as an LTI system."""

from dataclasses import replace
from typing import Any

import numpy as np

from actuator_lti.drive.wiring import Drive
from actuator_lti.errors import InputError
from actuator_lti.loops.flow import SOURCES, Flow, FlowProgram
from actuator_lti.loops.limiters import LimiterPath, Response, limiter_paths
from actuator_lti.loops.result import Loop, loop_of
from actuator_lti.loops.sampled import whole_path
from actuator_lti.loops.tick import seen
from actuator_lti.systems.plain_system import PlainDelaySystem, static
from actuator_lti.systems.rest_mode import without_rest_mode

RATES = {"ref": ("ref", "ref_rate", "ref_rate_rate"), "cut": ("cut", "cut_rate")}
"""An input and its derivatives, as the ideal form has them."""


def delay_system(flow: Flow, source: str, signal: str, scale: float = 1.0) -> PlainDelaySystem:
    """SISO system from one input of a flow to one of its signals, of the states between both."""
    n, row = len(flow.states) + len(flow.delays_s), scale * flow.signals[signal]
    every = np.vstack([flow.rates, flow.delayed])
    family = next((names for names in RATES.values() if source in names), (source,))
    depends, driven = every[:, :n] != 0, [n + SOURCES.index(name) for name in family]
    used = seen(depends, row[:n] != 0) & seen(depends.T, np.any(every[:, driven] != 0, axis=1))
    return flow_system(flow, (source,), row[None, :], used)


def flow_system(
    flow: Flow, sources: tuple[str, ...], y: np.ndarray, used: np.ndarray | None = None
) -> PlainDelaySystem:
    """From inputs of a flow to rows over all that it has; of the states and delays used, or of all."""
    n, k = len(flow.states), len(flow.delays_s)
    used = np.ones(n + k, dtype=bool) if used is None else used
    every, u = np.vstack([flow.rates, flow.delayed]), [n + k + SOURCES.index(name) for name in sources]
    x, z = np.flatnonzero(used[:n]), n + np.flatnonzero(used[n:])
    dx, v = every[x], every[z]
    return PlainDelaySystem(
        A=dx[:, x], B1=dx[:, u], B2=dx[:, z],
        C1=y[:, x], C2=v[:, x],
        D11=y[:, u], D12=y[:, z], D21=v[:, u], D22=v[:, z],
        delays_s=np.asarray(flow.delays_s, dtype=float)[z - n],
        states=tuple(flow.states[i].replace(".", "_") for i in x),
    )  # fmt: skip


def systems(flow: Flow, source: str, signal: str, scale: float = 1.0) -> list[PlainDelaySystem]:
    """The system from an input, and from its derivatives where the flow has them (ideal form)."""
    result = [delay_system(flow, name, signal, scale) for name in RATES.get(source, (source,))]
    while len(result) > 1 and not (np.any(result[-1].B1) or np.any(result[-1].D11)):
        result.pop()
    return result


def joined(parts: list[PlainDelaySystem]) -> PlainDelaySystem:
    """``sum_j s^j G_j`` as one proper system: s (s I - A)^-1 B is B + (s I - A)^-1 A B.

    Refused where it is not proper, as with a derivative without a filter.
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
    return replace(static(D[0]), A=A, B1=B, B2=first.B2, C1=C, C2=first.C2, states=first.states)


def finished(system: PlainDelaySystem, name: str, source: str, signal: str) -> Any:
    """The system under its names; a `PlainSystem` where it has no delay.

    That one without a mode at zero frequency that it does not show, see `rest_mode`.
    """
    system = system.named(name, source, signal)
    if not system.delay_free:
        return system
    A, B, C, kept = without_rest_mode(system.A, system.B1, system.C1, 0.0)
    if not kept.all():
        labels = tuple(label for label, there in zip(system.states, kept, strict=False) if there)
        system = replace(system, A=A, B1=B, B2=B[:, :0], C1=C, C2=C[:0], states=labels)
    return system.to_state_space()


def open_loop(
    wired: Drive, place: str, delays: frozenset[str], opened: tuple[str, ...] = (), *, commanded: bool = False
) -> PlainDelaySystem:
    """The open loop of a stage at its own error, inner loops closed (unless opened), outer ones absent.

    Or that at a break point with all other loops closed; or how the stage answers its command.
    """
    cut, signal, scale = wired.command_of(place) if commanded else wired.cut_of(place)
    outer = place if place in wired.stages else wired.outermost
    return joined(systems(FlowProgram(wired, outer, cut, opened, delays).flow(), "cut", signal, scale))


def loop(wired: Drive, place: str, delays: frozenset[str], opened: tuple[str, ...] = ()) -> Loop:
    """The same with its closed loop and its sensitivity."""
    system = open_loop(wired, place, delays, opened)
    parts, own = (system, system.feedback(), static(np.eye(1)).feedback(system)), None
    if wired.responds_apart(place):
        own = open_loop(wired, place, delays, opened, commanded=True)
    return loop_of(wired, place, parts, own, finished)


def _whole(wired: Drive, delays: frozenset[str]) -> Flow:
    return FlowProgram(wired, wired.outermost, None, (), delays).flow()


def reference_to_output(wired: Drive, delays: frozenset[str]) -> Any:
    """Command to what the outermost stage moves, its feed-forward included."""
    source, signal, _, label = whole_path(wired)
    total = joined(systems(_whole(wired, delays), "ref", signal))
    return finished(total, "reference_to_output", source, label)


def load_torque_to_output(wired: Drive, delays: frozenset[str]) -> Any:
    """Moment on the output shaft to the output angle, all loops closed."""
    system = delay_system(_whole(wired, delays), "load_torque", "output_angle")
    return finished(system, "load_torque_to_output", "load_torque", "output_angle")


def limiters(wired: Drive, delays: frozenset[str]) -> dict[str, LimiterPath]:
    """From the command to what stands in front of each limiter; the change of a command as its derivative."""
    flow = _whole(wired, delays)

    def evaluate(signals: tuple[str, ...], every: int, rate: bool) -> Response:
        terms = [systems(flow, "ref", signal) for signal in signals]

        def response(omega: np.ndarray) -> np.ndarray:
            s = 1j * omega
            values = [sum((s**j * part(s) for j, part in enumerate(parts)), 0 * s) for parts in terms]
            return np.array(values) * s if rate else np.array(values)

        return response

    return limiter_paths(wired, evaluate, np.inf)
