"""Drives D and E of the reference cases: two masses, built directly."""

from dataclasses import replace
from typing import Any

from actuator_lti.design.model import (
    Controller,
    Coupling,
    CurrentLoop,
    Design,
    Filter,
    Friction,
    Gear,
    Limits,
    Load,
    LoadFriction,
    Motor,
    PositionLoop,
    Validation,
    VelocityLoop,
)


def drive_d(*filters: Filter, **changes: Any) -> Design:
    """Drive D: a current and a velocity loop in front of a spring, no position loop."""
    design = Design(
        name="D",
        title="two masses",
        motor=Motor(
            rotor_inertia_kgm2=2e-5,
            resistance_ohm=0.5,
            inductance_H=1e-3,
            torque_constant_Nm_A=0.05,
            back_emf_constant_Vs_rad=0.05,
        ),
        controller=Controller(
            period_s=1e-4,
            computing_delay_s=1e-4,
            velocity=VelocityLoop(gain=0.25, integral_time_s=30e-3, every=2, filters=filters),
            current=CurrentLoop(gain_V_A=1.5, integral_time_s=2e-3),
        ),
        limits=Limits(voltage_V=48.0),
        validation=Validation(full_deflection_rad=1.0),
        gears=(Gear(name="gear", ratio=10.0),),
        load=Load(inertia_kgm2=2e-3, path="back-drivable", friction=LoadFriction(viscous_Nms_rad=1e-3)),
        friction=Friction(viscous_Nms_rad=1e-5),
        coupling=Coupling(stiffness_Nm_rad=400.0, damping_Nms_rad=0.02),
    )
    return replace(design, **changes)


def drive_e() -> Design:
    """Drive E: the whole cascade, for the dynamic stiffness."""
    base = drive_d()
    return replace(
        base,
        name="E",
        controller=Controller(
            period_s=2e-4,
            computing_delay_s=2e-4,
            position=PositionLoop(gain=20.0),
            velocity=VelocityLoop(gain=0.05, integral_time_s=50e-3),
            current=CurrentLoop(gain_V_A=0.8, integral_time_s=2e-3),
        ),
        load=replace(base.load, friction=LoadFriction(viscous_Nms_rad=1e-2)),
        coupling=Coupling(stiffness_Nm_rad=400.0, damping_Nms_rad=0.1),
    )
