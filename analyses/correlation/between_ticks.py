"""A run at any time: what winding and rotor do between two ticks, as the simulator has them there."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from actuator_lti.design.model import Design
from actuator_lti.drive.plant import motor_plant
from actuator_lti.drive.steady import motor_torque_Nm
from actuator_lti.systems.sampling import held_step, split_delay
from actuator_lti.types import Floats, Ints
from nonlinear import Trajectory

AT_TICK = 1e-6  # of a tick
ASIDE = 1e-2  # of a tick, over which a rate is taken
PLACES = 16  # a current turns where its voltage is switched: a search stays between two rows that see it
ROUNDS = 3


def signals_at(
    design: Design, run: Trajectory, time_s: Floats, later_s: float | None = None
) -> dict[str, Floats]:
    """The signals of a run ``later_s`` after some times, under the names of a record.

    The voltage is that of the last tick before the times themselves. Without ``later_s`` it is not known
    when the ticks are: all signals are in straight lines between them.
    """
    rate, ratio = run.output_speed_rad_s, design.total_ratio
    speed = run.motor_speed_rad_s / ratio if rate is None else rate
    columns = run.motor_angle_rad, run.motor_speed_rad_s, run.current_A, run.output_angle_rad, speed
    if later_s is None:
        *made, voltage = (np.interp(time_s, run.time_s, one) for one in (*columns, run.voltage_V))
    else:
        (tick, late), (at, _) = (_placed(run, time_s + more) for more in (later_s, 0.0))
        after, share = np.minimum(tick + 1, len(run.time_s) - 1), late / run.period_s
        voltage = run.voltage_V[at]
        made = [one[tick] + share * (one[after] - one[tick]) for one in columns]
        if np.any(late):
            bent = _bent(design, run, tick, late)
            made[:3] = np.add(made[:3], bent)
            made[3:] = np.add(made[3:], bent[:2] / ratio if rate is None else 0.0)
    angle, motor, current, output, speed = made
    return {
        "angle": angle,
        "output_angle": output,
        "position": output,
        "speed": motor,
        "velocity": speed,
        "current": current,
        "voltage": voltage,
        "force": motor_torque_Nm(design, current, voltage),
    }


def likeliest_s(
    design: Design,
    run: Trajectory,
    time_s: Floats,
    measured: Mapping[str, Floats],
    within: tuple[float, float],
) -> float:
    """By how much later than some times the rows of a record likeliest are, on the drive's own clock.

    Each signal is weighed by what is left of it; beforehand every time within the ends is as likely. A
    voltage tells nothing, as it jumps with the ticks.
    """
    aside, known = ASIDE * run.period_s, 12.0 / max(np.ptp(within), AT_TICK * run.period_s) ** 2
    names = [name for name in measured if name not in ("voltage", "force")]

    def left(more: float) -> Floats:
        made = signals_at(design, run, time_s, more)
        return np.array([measured[name] - made[name] for name in names])

    def unlikely(more: float) -> float:
        return float(np.sum(np.log(np.mean(left(more) ** 2, axis=1) + 1e-300)))

    more = min(places_s(within), key=unlikely)
    for _ in range(ROUNDS):
        off, rates = left(more), (left(more - aside) - left(more + aside)) / (2.0 * aside)
        sizes = np.mean(off**2, axis=1) + 1e-300
        gained, steep = (np.sum(rates * one, axis=1) @ (1.0 / sizes) for one in (off, rates))
        more += float((gained + known * (np.mean(within) - more)) / (steep + known))
    return float(np.clip(more, *within))


def places_s(within: tuple[float, float]) -> list[float]:
    """Where a search begins between two times."""
    return np.linspace(*within, PLACES + 2)[1:-1].tolist()


def _placed(run: Trajectory, time_s: Floats) -> tuple[Ints, Floats]:
    """The last tick before each time, and how much later that is."""
    tick = np.clip(np.floor(time_s / run.period_s + AT_TICK), 0, len(run.time_s) - 1).astype(np.int64)
    late = np.maximum(time_s - tick * run.period_s, 0.0)
    return tick, np.where(late < AT_TICK * run.period_s, 0.0, late)


def _bent(design: Design, run: Trajectory, tick: Ints, late_s: Floats) -> Floats:
    """By how much angle, speed and current are off the straight lines between their ticks, shape (3, n).

    By the plant of the linear loops (`motor_plant`), its voltage in two pieces, and over the tick a torque
    with which the speed arrives where it is at the next one: coupling, load and friction are in that.
    """
    if design.effective_motor.source_gain_Nm_V is not None:
        return np.zeros((3, len(tick)))
    plant, T, u = motor_plant(design), run.period_s, run.voltage_V
    A, B = plant.A[:3, :3], np.column_stack([plant.B_u, plant.B_T])[:3]
    whole, part = split_delay(design.controller.computing_delay_s, T)
    tick = np.minimum(tick, len(run.time_s) - 2)
    volts = u[np.maximum(tick - whole - 1, 0)], u[np.maximum(tick - whole, 0)]
    columns = np.array([run.current_A, run.motor_speed_rad_s, run.motor_angle_rad])
    begun, ends = columns[:, tick], columns[:, tick + 1]
    rates, modes = np.linalg.eig(A)  # real where the motor does not ring, which takes half the time
    into = np.linalg.inv(modes)

    def moved(torque: Floats, until_s: Floats) -> Floats:
        """By how much current, speed and angle move until some time after each tick."""
        first, state = np.minimum(until_s, part * T), into @ begun
        moved = 0.0 * state
        for held, span in zip(volts, (first, until_s - first), strict=True):
            turn = rates[:, None] * span
            grown = span * np.divide(np.expm1(turn), turn, out=np.ones_like(turn), where=turn != 0.0)
            moved = moved + grown * (rates[:, None] * (state + moved) + into @ B @ np.stack([held, torque]))
        return np.asarray((modes @ moved).real)

    short = ends[1] - begun[1] - moved(np.zeros(len(tick)), np.full(1, T))[1]
    bent = moved(short / held_step(A, B, T)[1][1, 1], late_s) - late_s / T * (ends - begun)
    return np.asarray(bent[::-1])
