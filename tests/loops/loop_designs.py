"""Designs for the loop tests: the shipped ones laid bare, drives D and E of the reference cases."""

from dataclasses import replace
from math import inf
from typing import Any

import numpy as np

from actuator_lti.design import load_design, model
from tests.changed import changed


def amber(n_v: int = 1, n_p: int = 1, delay_s: float = 0.0001, feedforward: float = 0.0, **changes: Any):
    """The shipped baseline with J = 1.05e-6 kg m2 in all, at its motor, and angles that are not counted."""
    base = load_design("ilr33-amber")
    bare = model.Design(
        name="amber",
        title="canard drive",
        motor=replace(base.motor, rotor_inertia_kgm2=1.05e-6),
        controller=base.controller,
        limits=replace(base.limits, continuous_current_A=inf),
        validation=model.Validation(full_deflection_rad=0.35),
        gears=(model.Gear(name="planetary", ratio=66.0), model.Gear(name="worm", ratio=36.0)),
        friction=base.friction,
    )
    stages = {"position": {"every": n_p, "feedforward": feedforward}, "velocity": {"every": n_v}}
    return replace(controlled(bare, computing_delay_s=delay_s, **stages), **changes)


def controlled(design: model.Design, **changes: Any) -> model.Design:
    """The design with parts of its controller changed: keys of a stage in a dict, or the value itself."""
    return changed(design, controller=changes)


def sprung(name: str, slope_Nm_rad: float, **more: Any) -> model.Design:
    """A shipped drive whose load follows the angle through a back-drivable path."""
    return changed(
        load_design(name), load={"path": "back-drivable", "moment_slope_Nm_rad": slope_Nm_rad, **more}
    )


def source_drive(J: float, gain_Nm_V: float, period_s: float, voltage_V: float, **parts: Any) -> model.Design:
    """An inertia on an ideal torque source, without delay or controller; and `parts` of it changed."""
    bare = model.Design(
        name="source",
        motor=model.Motor(rotor_inertia_kgm2=J, source_gain_Nm_V=gain_Nm_V),
        controller=model.Controller(period_s=period_s, computing_delay_s=0.0),
        limits=model.Limits(voltage_V=voltage_V),
        validation=model.Validation(full_deflection_rad=1.0),
    )
    return changed(bare, **parts)


def faster(design: model.Design, factor: float) -> model.Design:
    """The same continuous drive, sampled faster and later by less (its filters stay)."""
    times = {name: getattr(design.controller, name) / factor for name in ("period_s", "computing_delay_s")}
    return controlled(design, **times)


def response(system: Any, omega: np.ndarray) -> np.ndarray:
    """Of a sampled or continuous system over rad/s."""
    return np.asarray(system(np.exp(1j * omega * system.dt) if system.isdtime(strict=True) else 1j * omega))


def without(design: model.Design, *stages: str, gain: float) -> model.Design:
    """The design without its current and/or velocity loop; ``gain`` goes to the stage outside the gap."""
    outside = "position" if "velocity" in stages else "velocity"
    return controlled(design, **dict.fromkeys(stages), **{outside: {"gain": gain}})


def emps(delay_s: float = 0.0, **changes: Any) -> model.Design:
    """EMPS as published: P-P cascade on a force source, speed by backward difference of two-sample means."""
    return replace(controlled(load_design("emps"), computing_delay_s=delay_s), **changes)


def ctms_position(gain_V_rad: float = 1.0, delay_s: float = 0.0) -> model.Design:
    """CTMS motor position (G6): P position loop on the voltage, no inner loops."""
    loop = {"position": {"gain": gain_V_rad}, "computing_delay_s": delay_s}
    return controlled(load_design("ctms-motor-position"), **loop)


CONSTANTS = {"torque_constant_Nm_A": 0.05, "back_emf_constant_Vs_rad": 0.05}
MOTOR = model.Motor(rotor_inertia_kgm2=2e-5, resistance_ohm=0.5, inductance_H=1e-3, **CONSTANTS)


def drive_d(*filters: model.Filter, **changes: Any) -> model.Design:
    """Drive D: a current and a velocity loop in front of a spring, no position loop."""
    current = model.CurrentLoop(gain_V_A=1.5, integral_time_s=2e-3)
    velocity = model.VelocityLoop(gain=0.25, integral_time_s=30e-3, every=2, filters=filters)
    stages, behind = {"velocity": velocity, "current": current}, model.LoadFriction(viscous_Nms_rad=1e-3)
    design = model.Design(
        name="D",
        title="two masses",
        motor=MOTOR,
        controller=model.Controller(period_s=1e-4, computing_delay_s=1e-4, **stages),
        limits=model.Limits(voltage_V=48.0),
        validation=model.Validation(full_deflection_rad=1.0),
        gears=(model.Gear(name="gear", ratio=10.0),),
        load=model.Load(inertia_kgm2=2e-3, path="back-drivable", friction=behind),
        friction=model.Friction(viscous_Nms_rad=1e-5),
        coupling=model.Coupling(stiffness_Nm_rad=400.0, damping_Nms_rad=0.02),
    )
    return replace(design, **changes)


def drive_e() -> model.Design:
    """Drive E: the whole cascade, for the dynamic stiffness."""
    current = model.CurrentLoop(gain_V_A=0.8, integral_time_s=2e-3)
    velocity = model.VelocityLoop(gain=0.05, integral_time_s=50e-3)
    stages = {"position": model.PositionLoop(gain=20.0), "velocity": velocity, "current": current}
    controller = model.Controller(period_s=2e-4, computing_delay_s=2e-4, **stages)
    load, spring = {"friction": model.LoadFriction(viscous_Nms_rad=1e-2)}, {"damping_Nms_rad": 0.1}
    return changed(drive_d(), name="E", controller=controller, load=load, coupling=spring)
