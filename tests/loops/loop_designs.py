"""Designs for the loop tests, built directly, and hypothesis strategies for more."""

from dataclasses import replace
from math import pi
from typing import Any

import numpy as np
from hypothesis import strategies as st

from actuator_lti.design import load_design, model


def amber(
    n_v: int = 1, n_p: int = 1, delay_s: float = 1e-4, feedforward: float = 0.0, **changes: Any
) -> model.Design:
    """The shipped baseline with J = 1.05e-6 kg m2 in all (J_motor 9.2e-7 + 1.3e-7)."""
    design = model.Design(
        name="amber",
        title="canard drive",
        motor=model.Motor(
            rotor_inertia_kgm2=1.05e-6,
            resistance_ohm=0.055,
            inductance_H=6e-6,
            torque_constant_Nm_A=5.9e-3,
            back_emf_constant_Vs_rad=5.9e-3,
        ),
        controller=model.Controller(
            period_s=1e-4,
            computing_delay_s=delay_s,
            position=model.PositionLoop(gain=120.0, every=n_p, feedforward=feedforward),
            velocity=model.VelocityLoop(gain=0.12, integral_time_s=15e-3, every=n_v),
            current=model.CurrentLoop(gain_V_A=0.02, integral_time_s=150e-6),
        ),
        limits=model.Limits(
            voltage_V=12.0, speed_rad_s=942.5, acceleration_rad_s2=30000 * 2 * pi, peak_current_A=12.0
        ),
        validation=model.Validation(full_deflection_rad=0.35),
        gears=(model.Gear(name="planetary", ratio=66.0), model.Gear(name="worm", ratio=36.0)),
        friction=model.Friction(dry_torque_Nm=2.25e-3, viscous_Nms_rad=5.25e-6, load_coefficient=1.34e-3),
    )
    return replace(design, **changes)


def controlled(design: model.Design, **changes: Any) -> model.Design:
    """The design with parts of its controller changed: keys of a stage in a dict, or the value itself."""
    control = design.controller
    made = {
        name: replace(getattr(control, name), **value) if isinstance(value, dict) else value
        for name, value in changes.items()
    }
    return replace(design, controller=replace(control, **made))


def sprung(name: str, slope_Nm_rad: float, **more: Any) -> model.Design:
    """A shipped drive whose load follows the angle through a back-drivable path."""
    design = load_design(name)
    load = replace(design.load, path="back-drivable", moment_slope_Nm_rad=slope_Nm_rad, **more)
    return replace(design, load=load)


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
    design = model.Design(
        name="emps",
        title="linear axis",
        axis="linear",
        motor=model.Motor(rotor_inertia_kgm2=95.1089, source_gain_Nm_V=35.15065),
        controller=model.Controller(
            period_s=1e-3,
            computing_delay_s=delay_s,
            position=model.PositionLoop(gain=160.18),
            velocity=model.VelocityLoop(gain=243.45),
        ),
        limits=model.Limits(voltage_V=10.0),
        validation=model.Validation(full_deflection_rad=0.1),
        friction=model.Friction(dry_torque_Nm=20.3935, viscous_Nms_rad=203.5034, offset_torque_Nm=-3.1648),
        encoder=model.Encoder(speed="difference", difference_samples=2),
    )
    return replace(design, **changes)


def ctms_position(gain_V_rad: float = 1.0, delay_s: float = 0.0) -> model.Design:
    """CTMS motor position (G6): P position loop on the voltage, no inner loops."""
    return model.Design(
        name="ctms",
        title="motor position",
        motor=model.Motor(
            rotor_inertia_kgm2=3.2284e-6,
            resistance_ohm=4.0,
            inductance_H=2.75e-6,
            torque_constant_Nm_A=0.0274,
            back_emf_constant_Vs_rad=0.0274,
        ),
        controller=model.Controller(
            period_s=1e-3, computing_delay_s=delay_s, position=model.PositionLoop(gain=gain_V_rad)
        ),
        limits=model.Limits(voltage_V=12.0),
        validation=model.Validation(full_deflection_rad=1.0),
        friction=model.Friction(viscous_Nms_rad=3.5077e-6),
    )


@st.composite
def designs(draw: st.DrawFn) -> model.Design:
    """Valid drives around the baseline: rates, delays, stages left out, speed estimates, loads."""
    scale = st.floats(0.5, 2.0)
    n_v = draw(st.sampled_from([1, 2, 3]))
    n_p = n_v * draw(st.sampled_from([1, 2, 5]))
    base = amber(n_v, n_p, delay_s=draw(st.floats(0.0, 3e-4)), feedforward=draw(st.sampled_from([0.0, 0.9])))
    motor = base.motor
    motor = replace(
        motor,
        rotor_inertia_kgm2=motor.rotor_inertia_kgm2 * draw(scale),
        resistance_ohm=0.055 * draw(scale),
        inductance_H=6e-6 * draw(scale),
    )
    difference = st.builds(
        model.Encoder,
        speed=st.just("difference"),
        difference_samples=st.integers(1, 4),
        filter_time_s=st.sampled_from([0.0, 5e-4]),
    )
    encoder = draw(st.one_of(st.just(model.Encoder()), difference))
    load = draw(st.sampled_from([model.Load(), model.Load(path="back-drivable", moment_slope_Nm_rad=-40.0)]))
    design = replace(base, motor=motor, encoder=encoder, load=load)
    kind = draw(st.sampled_from(["cascade", "cascade", "no current", "no velocity", "position only"]))
    if kind == "no current":
        return without(design, "current", gain=0.01)
    if kind == "no velocity":
        return without(design, "velocity", gain=1.0)
    return without(design, "current", "velocity", gain=0.05) if kind == "position only" else design
