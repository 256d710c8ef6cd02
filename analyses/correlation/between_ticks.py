"""A run at any time: what winding and rotor do between two ticks, as the simulator has them there."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from actuator_lti.design.model import Design
from actuator_lti.drive.steady import motor_torque_Nm
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
        after, share, voltage = (
            np.minimum(tick + 1, len(run.time_s) - 1),
            late / run.period_s,
            run.voltage_V[at],
        )
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

    Equations (1), (2) and (14) with the voltage in two pieces, and over the tick a torque with which the
    speed arrives where it is at the next one.
    """
    motor, T = design.effective_motor, run.period_s
    R, L, kM = motor.resistance_ohm, motor.inductance_H, motor.torque_constant_Nm_A
    if not (R and L and kM) or motor.source_gain_Nm_V is not None:
        return np.zeros((3, len(tick)))
    kE = kM if motor.back_emf_constant_Vs_rad is None else motor.back_emf_constant_Vs_rad
    J = design.motor_side_inertia_kgm2 if design.coupling is not None else design.inertia_kgm2
    rates, modes = np.linalg.eig(np.array([[-R / L, -kE / L], [kM / J, 0.0]], dtype=np.complex128))
    into = np.linalg.inv(modes)
    queue, split = divmod(design.controller.computing_delay_s, T)

    def moved(from_tick: Floats, until: Floats) -> Floats:
        """Current, speed and angle turned, from the first two at the tick, two voltages and a torque."""
        state, area = into @ from_tick[:2], np.zeros(1)
        spans = np.minimum(until, split), np.maximum(until - split, 0.0)
        for volts, span in zip(from_tick[2:4], spans, strict=True):
            push = into @ np.stack([volts / L, from_tick[4] / J])
            grown = np.expm1(rates[:, None] * span) / rates[:, None]
            area = area + grown * state + (grown - span) / rates[:, None] * push
            state = state + grown * (rates[:, None] * state + push)
        return np.asarray(np.vstack([modes @ state, (modes @ area)[1]]).real)

    tick = np.minimum(tick, len(run.time_s) - 2)
    after, u = np.maximum(tick - int(queue), 0), run.voltage_V
    columns = np.array([run.current_A, run.motor_speed_rad_s, run.motor_angle_rad])
    begun = np.vstack([columns[:2, tick], u[np.maximum(after - 1, 0)], u[after]])
    arrives = moved(np.eye(5), np.full(5, T))[1]
    torque = (columns[1, tick + 1] - arrives[:4] @ begun) / arrives[4]
    bent = moved(np.vstack([begun, torque]), late_s) - late_s / T * (columns[:, tick + 1] - columns[:, tick])
    bent[:2] -= begun[:2]
    return np.asarray(bent[::-1])
