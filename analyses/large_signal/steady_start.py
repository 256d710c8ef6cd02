"""Begin a sine where the linear drive would be in steady state, so that no start-up hits a limit."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterable
from dataclasses import dataclass

import numpy as np

from actuator_lti.design.model import Design
from actuator_lti.drive.facts import speed_torque_Nm
from actuator_lti.drive.profile import command_mean
from actuator_lti.drive.steady import steady_input
from actuator_lti.errors import NumericalError
from actuator_lti.loops import Loops
from actuator_lti.systems.resolvent import states_at
from analyses.large_signal.classify import FULL_TRIANGLE
from nonlinear import Rows

AT_REST = (
    r"w|W|acc",  # speeds, and the angle gained since the last estimate
    r"speed\d*\..+|estimate\..+|hold_w_meas",  # what is made of the speed
    r"command\..+|ref_prev|rate_prev|rate\..+",  # the command's filter and feed-forward, the command at zero
)
"""Names of states that are zero where the motor rests and the command is zero (`actuator_lti.loops.tick`)."""


def without_value(states: Iterable[str], known: Collection[str], patterns: Iterable[str] = ()) -> list[str]:
    """Give the states that an analysis has no value for, by name or by pattern.

    Examples
    --------
    >>> without_value(("w", "th", "torque1.1"), {"th"}, AT_REST)
    ['torque1.1']
    """
    whole = re.compile("|".join(f"(?:{each})" for each in patterns) or r"(?!)")
    return [name for name in states if name not in known and not whole.fullmatch(name)]


PLACES = {
    "i": "current_start",
    "w": "speed_start",
    "th": "angle_start",
    "current.I": "current_integrator_start",
    "velocity.I": "velocity_integrator_start",
    "hold_i_ref": "current_command_start",
    "u1": "voltage_start",
}
ELASTIC = {"W": "load_speed_start", "twist": "twist_start"}  # in contact; with play nobody knows them
LEFT_AT_REST = (
    r"W|twist|acc|u\d+",
    r"(?:speed\d*|estimate|torque\d+|command|position|derivative)\..+",
    r"hold_\w+|\w+_prev|(?:current|velocity)\.x\d+",
)
"""States that a run begins at rest: rows have no word for them; the settling time counts their decay."""
DECAY = math.log(1e9)  # what begins at rest is gone by then, so that small sines are the linear ones
LONGEST_PERIODS = 20_000


@dataclass(frozen=True)
class LinearSteadyState:
    """The whole sampled loop under ``sin(w t)`` at the command, friction sliding without its dry part."""

    # Shape (K,): command to output angle: the fundamental over all ticks, the mean of a limited jerk included
    output: np.ndarray
    states: dict[str, np.ndarray]  # shape (K,): by column of the rows: value at t = 0 is the imaginary part
    stable: bool
    settling_ticks: int  # ticks in which the slowest mode falls to 1e-9

    def put(self, rows: Rows, which: np.ndarray, amplitude_rad: np.ndarray) -> None:
        """Write the initial state of each row: tone ``which[r]`` at an amplitude."""
        if not self.stable:
            return
        for place, values in self.states.items():
            rows[place] = amplitude_rad * values.imag[which]


def linear_steady_state(loops: Loops, omega_rad_s: np.ndarray) -> LinearSteadyState:
    """Solve the sampled loop for its periodic state at each frequency."""
    system = loops.tick_system
    assert system is not None
    Ts, M, n = loops.design.controller.period_s, system.ticks, len(system.states)
    phases = [system.matrices(j) for j in range(M)]
    A, B = np.eye(n), np.zeros(n)
    before = []
    for A_j, B_j, _, _ in phases:
        before.append((A, B))
        A, B = A_j @ A, A_j @ B + B_j[:, 0]
    z = np.exp(1j * omega_rad_s * M * Ts)
    x = states_at(A, B[:, None], z)[..., 0]
    angle = system.outputs.index("output_angle")
    output = np.zeros(len(z), dtype=complex)
    for j, ((A_b, B_b), (_, _, C, D)) in enumerate(zip(before, phases, strict=True)):
        seen = (x @ A_b.T + B_b) @ C[angle] + D[angle, 0]
        output += seen * np.exp(-1j * omega_rad_s * j * Ts) / M
    unknown = without_value(system.states, PLACES.keys(), LEFT_AT_REST)
    if unknown:
        raise NumericalError(f"state {unknown[0]} of the linear drive: no start of a run knows it")
    coupling = loops.design.coupling
    places = {**PLACES, **ELASTIC} if coupling is not None and coupling.play_rad == 0.0 else PLACES
    states = {places[name]: x[:, k] for k, name in enumerate(system.states) if name in places}
    if "w_ref" in system.outputs:
        row = system.outputs.index("w_ref")
        C, D = phases[0][2], phases[0][3]
        states["speed_command_start"] = (x @ C[row] + D[row, 0]) / z
    radius = float(np.max(np.abs(np.linalg.eigvals(A))))
    periods = 1 if radius < 1.0 else 500
    if 0.0 < radius < 1.0:
        periods = min(math.ceil(-DECAY / math.log(radius)), LONGEST_PERIODS)
    mean = command_mean(loops.design)
    if mean is not None:  # in front of the loop: all that follows it is that much smaller and later
        before_loop = mean.response(omega_rad_s)
        output, states = output * before_loop, {name: x * before_loop for name, x in states.items()}
        periods += math.ceil(mean.samples * loops.design.controller.position_loop.every / M)
    return LinearSteadyState(output, states, radius < 1.0, periods * M)


def triangle_start(design: Design, rows: Rows, amplitude_rad: np.ndarray, limited: np.ndarray) -> None:
    """Begin sines far beyond the speed limit on the flank of the triangle that they end in.

    A triangle finds its mean only slowly, by a factor of about (x - 1)/(x + 1) each half period; from the
    right place it need not.  Rows with ``x = w A/R`` below that of a full triangle, or not
    ``limited``, stay as they are.
    """
    limit = design.limits.speed_rad_s
    if design.controller.velocity is None or not math.isfinite(limit):
        return
    rate, omega = limit / design.total_ratio, 2.0 * np.pi * rows.frequency_hz()
    x = omega * amplitude_rad / rate
    which = np.flatnonzero((x >= FULL_TRIANGLE) & limited)
    lag = np.arccos(np.pi / (2.0 * x[which]))
    rows["angle_start"][which] = -limit * lag / omega[which]
    rows["speed_start"][which] = rows["speed_command_start"][which] = limit
    current, voltage = steady_input(design, speed_torque_Nm(design, limit), limit)
    rows["current_start"][which], rows["voltage_start"][which] = current, voltage
    if design.controller.current is None:
        rows["velocity_integrator_start"][which] = voltage
    else:
        rows["velocity_integrator_start"][which] = rows["current_command_start"][which] = current
        rows["current_integrator_start"][which] = voltage
