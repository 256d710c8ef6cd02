"""Any valid drive: no NaN, no hang, bounded events, limits kept, energy in balance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from actuator_lti import load_design
from actuator_lti.design.model import Design
from nonlinear import commands, loads, simulate

BASE = load_design("ilr33-amber")


def factor(decades: float) -> st.SearchStrategy[float]:
    return st.floats(-decades, decades).map(lambda x: 10.0**x)


@st.composite
def drives(draw: st.DrawFn) -> Design:
    m, c, f = BASE.motor, BASE.controller, BASE.friction
    constant = m.torque_constant_Nm_A * draw(factor(0.7))
    motor = replace(
        m,
        resistance_ohm=m.resistance_ohm * draw(factor(1)),
        inductance_H=m.inductance_H * draw(factor(2)),
        torque_constant_Nm_A=constant,
        back_emf_constant_Vs_rad=constant,
        rotor_inertia_kgm2=m.rotor_inertia_kgm2 * draw(factor(1.5)),
    )
    if draw(st.booleans()):
        motor = replace(
            motor,
            source_gain_Nm_V=constant / motor.resistance_ohm,
            resistance_ohm=None,
            inductance_H=None,
            torque_constant_Nm_A=None,
            back_emf_constant_Vs_rad=None,
        )
    friction = replace(
        f,
        law=draw(st.sampled_from(["coulomb", "coulomb", "tanh"])),
        dry_torque_Nm=draw(st.sampled_from([0.0, 1.0])) * f.dry_torque_Nm * draw(factor(1.5)),
        dry_torque_reverse_Nm=draw(st.none() | factor(1.5).map(lambda x: x * f.dry_torque_Nm)),
        viscous_Nms_rad=draw(st.sampled_from([0.0, 1.0])) * f.viscous_Nms_rad * draw(factor(1)),
        breakaway_ratio=draw(st.floats(1.0, 2.0)),
        offset_torque_Nm=draw(st.floats(-1e-3, 1e-3)),
    )
    n_v = draw(st.integers(1, 3))
    velocity = replace(c.velocity, gain=c.velocity.gain * draw(factor(1)), every=n_v)
    current = None if motor.source_gain_Nm_V else draw(st.sampled_from([None, c.current]))
    velocity = velocity if current is not None else replace(velocity, gain=velocity.gain * 0.05)
    has_velocity = draw(st.booleans())
    controller = replace(
        c,
        computing_delay_s=c.period_s * draw(st.sampled_from([0.0, 0.3, 1.0, 2.7])),
        position=replace(
            c.position,
            every=n_v * draw(st.integers(1, 4)),
            feedforward=draw(st.sampled_from([0.0, 1.0])),
            gain=c.position.gain * draw(factor(1)) * (1.0 if has_velocity else 0.01),
        ),
        velocity=velocity if has_velocity else None,
        current=current,
    )
    encoder = replace(
        BASE.encoder,
        speed=draw(st.sampled_from(["ideal", "difference"])),
        difference_samples=draw(st.integers(1, 4)),
        filter_time_s=draw(st.sampled_from([0.0, 1e-3])),
    )
    load = replace(BASE.load, path=draw(st.sampled_from(["self-locking", "back-drivable"])))
    return replace(BASE, motor=motor, friction=friction, controller=controller, encoder=encoder, load=load)


@settings(max_examples=120)
@given(
    design=drives(),
    amplitude=factor(2.0),
    frequency=st.floats(0.5, 200.0),
    load=st.floats(-50.0, 50.0),
    slope=st.floats(-50.0, 50.0),
)
def test_any_drive(design: Design, amplitude: float, frequency: float, load: float, slope: float) -> None:
    command = commands.triangle(0.01 * amplitude, frequency)
    run = simulate(
        design, command, 0.08, loads.proportional(slope, load), energy=True, raise_on_failure=False
    )
    assert run.status == "ok", run.advice
    for name, values in run.columns().items():
        assert np.isfinite(values).all(), name
    limits = design.limits
    assert np.abs(run.voltage_V).max() <= limits.voltage_V
    assert np.abs(run.current_command_A).max() <= limits.peak_current_A
    assert np.abs(run.speed_command_rad_s).max() <= limits.speed_rad_s
    allowed = limits.acceleration_rad_s2 * design.controller.position.every * design.controller.period_s
    assert np.abs(np.diff(run.speed_command_rad_s)).max() <= allowed * (1 + 1e-9)
    assert run.events_per_tick <= 50
    if design.friction.law == "coulomb":
        assert run.energy is not None
        assert run.energy.relative_error < 1e-9
