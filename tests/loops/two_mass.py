"""Drives D and E of the reference cases: two masses, built directly."""

from dataclasses import replace
from typing import Any

from actuator_lti.design import model
from tests.changed import changed

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
