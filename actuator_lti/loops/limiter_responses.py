"""Closed-loop responses from the command to what stands in front of each limiter, sampled and continuous."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from actuator_lti.drive.wiring import Drive
from actuator_lti.loops.blocks import compose
from actuator_lti.loops.flow import FlowProgram
from actuator_lti.loops.limiters import LimiterPath, limiter_paths
from actuator_lti.loops.tick import TickProgram
from actuator_lti.systems.resolvent import states_at

Response = Callable[[np.ndarray], np.ndarray]


def sampled_limiters(wired: Drive) -> dict[str, LimiterPath]:
    """Exact: the quantity at every tick where it is updated, a row each.

    A sinusoid passes every phase of the samples, so the peak of the samples is the magnitude of the row.
    """
    program = TickProgram(wired, wired.outermost)
    ticks = [program.tick(k) for k in range(program.ticks)]
    n, period = len(program.states), program.ticks * wired.tick_s
    A, B = compose(ticks)

    def evaluate(signals: tuple[str, ...], every: int, rate: bool) -> Response:
        rows = []
        for j in range(0, program.ticks, every):
            before = compose(ticks[:j]) if j else (np.eye(n), np.zeros_like(B))
            seen = [ticks[j].signals[signal] for signal in signals]
            rows += [np.append(row[:n] @ before[0], row[:n] @ before[1][:, 0] + row[n]) for row in seen]
        table = np.array(rows)

        def response(omega: np.ndarray) -> np.ndarray:
            z = np.exp(1j * omega * period)
            values = table[:, :n] @ states_at(A, B[:, [0]], z)[:, :, 0].T + table[:, [n]]
            return _changes(values, omega * period) / (every * wired.tick_s) if rate else values

        return response

    return limiter_paths(wired, evaluate, np.pi / period)


def _changes(values: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """Change of each update's value from that before it; the last one before the first is a turn older."""
    if len(values) == 1:
        return values * -np.expm1(-1j * turn)
    before = np.roll(values, 1, axis=0)
    before[0] *= np.exp(-1j * turn)
    return values - before


def continuous_limiters(wired: Drive, delays: frozenset[str]) -> dict[str, LimiterPath]:
    """With exact delays, or ideal; the change of a command is taken as its derivative."""
    from actuator_lti.loops.continuous import systems  # with it python-control

    flow = FlowProgram(wired, wired.outermost, None, (), delays).flow()

    def evaluate(signals: tuple[str, ...], every: int, rate: bool) -> Response:
        terms = [systems(flow, "ref", signal) for signal in signals]

        def response(omega: np.ndarray) -> np.ndarray:
            s = 1j * omega
            values = [sum((s**j * part(s) for j, part in enumerate(parts)), 0 * s) for parts in terms]
            return np.array(values) * s if rate else np.array(values)

        return response

    return limiter_paths(wired, evaluate, np.inf)
