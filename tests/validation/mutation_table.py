# ruff: noqa: T201 - a script that prints lines for people
"""The smallest change of a model that a validation sees, for each thing that can be wrong in it.

Run as a script it prints a line a change::

    python -m tests.validation.mutation_table              # ilr33-amber
    python -m tests.validation.mutation_table fin          # another shipped design
    python -m tests.validation.mutation_table 3037         # a random drive
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from math import isfinite

from actuator_lti import assemble_loops, load_design
from actuator_lti.design.model import Design, Limits
from analyses.large_signal.border import check_border
from analyses.validation import validate
from tests.validation.random_drives import full_drive
from tests.validation.small_settings import SMALL

SIZES = (1e-5, 3e-5, 1e-4, 3e-4, 1e-3, 1e-2)
LIMIT_SIZES = (1e-3, 3e-3, 0.01, 0.015, 0.02, 0.05)
Change = Callable[[Design, float], Design]


def motor(name: str) -> Change:
    """One constant of the motor times 1 + x."""
    return lambda d, x: replace(
        d, motor=replace(d.motor, **{name: (getattr(d.motor, name) or 0.0) * (1.0 + x) or None})
    )


def friction(name: str) -> Change:
    """One number of the friction times 1 + x."""
    return lambda d, x: replace(
        d, friction=replace(d.friction, **{name: getattr(d.friction, name) * (1.0 + x)})
    )


def loop(stage: str, name: str) -> Change:
    """One number of a controller times 1 + x."""

    def change(d: Design, x: float) -> Design:
        one = getattr(d.controller, stage)
        if one is None or getattr(one, name) is None:
            return d
        one = replace(one, **{name: getattr(one, name) * (1.0 + x)})
        return replace(d, controller=replace(d.controller, **{stage: one}))

    return change


def load_inertia(d: Design, x: float) -> Design:
    """The load's inertia times 1 + x."""
    return replace(d, load=replace(d.load, inertia_kgm2=d.load.inertia_kgm2 * (1.0 + x)))


def delay(d: Design, x: float) -> Design:
    """x of a tick more of computing delay."""
    control = d.controller
    return replace(
        d, controller=replace(control, computing_delay_s=control.computing_delay_s + x * control.period_s)
    )


def feedforward(d: Design, x: float) -> Design:
    """Feed-forward of the command's rate by x more."""
    place = d.controller.position_loop
    return replace(
        d, controller=replace(d.controller, position=replace(place, feedforward=place.feedforward + x))
    )


def command_filter(d: Design, x: float) -> Design:
    """A filter of the command, x of 10 ms, at least the shortest that there is."""
    return replace(d, command=replace(d.command, filter_time_s=max(1e-2 * x, 0.4 * d.controller.period_s)))


def back_emf_sign(d: Design, _: float) -> Design:
    """The motor drives itself on instead of braking: a sign has no size."""
    turned = -(d.motor.back_emf_constant_Vs_rad or 0.0)
    return replace(d, motor=replace(d.motor, back_emf_constant_Vs_rad=turned))


def coupling(name: str) -> Change:
    """One number of the coupling times 1 + x."""

    def change(d: Design, x: float) -> Design:
        if d.coupling is None:
            return d
        return replace(d, coupling=replace(d.coupling, **{name: getattr(d.coupling, name) * (1.0 + x)}))

    return change


CHANGES: dict[str, Change] = {
    "inductance (pole of the current loop)": motor("inductance_H"),
    "resistance": motor("resistance_ohm"),
    "torque constant": motor("torque_constant_Nm_A"),
    "back-EMF constant": motor("back_emf_constant_Vs_rad"),
    "rotor inertia (mechanical pole)": motor("rotor_inertia_kgm2"),
    "load inertia": load_inertia,
    "current gain": loop("current", "gain_V_A"),
    "current integral time": loop("current", "integral_time_s"),
    "velocity gain": loop("velocity", "gain"),
    "velocity integral time": loop("velocity", "integral_time_s"),
    "position gain": loop("position", "gain"),
    "computing delay (of a tick)": delay,
    "sign of the back-EMF": back_emf_sign,
    "stiffness of the coupling": coupling("stiffness_Nm_rad"),
    "damping of the coupling": coupling("damping_Nms_rad"),
    "viscous friction": friction("viscous_Nms_rad"),
    "dry friction": friction("dry_torque_Nm"),
    "breakaway ratio": friction("breakaway_ratio"),
    "feed-forward (absolute)": feedforward,
    "command filter (of 10 ms)": command_filter,
}
LIMITS = {"speed_rad_s": 60.0, "peak_current_A": 1.0, "voltage_V": 3.0, "acceleration_rad_s2": 2e3}


def main(which: str = "ilr33-amber") -> None:
    """Print the table."""
    design = full_drive(int(which)) if which.isdigit() else load_design(which)
    for name, change in CHANGES.items():
        if change(design, 1e-2) == design:
            print(f"{name} | the drive has none | |", flush=True)
            continue
        for size in SIZES:
            found = validate(design, SMALL, model=change(design, size))
            if found.failed:
                over = sorted(found.failed, key=lambda row: -abs(row.difference or 0.0) / row.tolerance)
                first = ", ".join(dict.fromkeys(f"{row.loop} {row.quantity}" for row in over[:3]))
                print(f"{name} | {size:g} | {len(found.failed)} | {first}", flush=True)
                break
        else:
            print(f"{name} | not seen up to {SIZES[-1]:g} | 0 |", flush=True)
    wide = Limits(voltage_V=1e3, speed_rad_s=1e5, acceleration_rad_s2=1e9, peak_current_A=1e3)
    own = {name: getattr(design.limits, name) for name in LIMITS}
    for limit, value in (LIMITS if which == "ilr33-amber" else own).items():
        if not isfinite(value):
            continue
        alone = replace(design, limits=replace(wide, **{limit: value}))
        for size in LIMIT_SIZES:
            wrong = replace(design, limits=replace(wide, **{limit: value * (1.0 + size)}))
            border = check_border(alone, assemble_loops(wrong), count=6)
            if border is not None and border.passed is False:
                print(f"{limit} | {size:g} | 1 | onset of saturation", flush=True)
                break


if __name__ == "__main__":
    main(*sys.argv[1:2])
