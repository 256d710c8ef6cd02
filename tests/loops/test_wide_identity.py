"""Cross-check: the wider drive's tick system is sections 6 and 7 of model.md run tick by tick."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from loop_designs import amber, emps, without
from test_stacked import DRIVES, FILTERS, everything
from two_mass import drive_d, drive_e
from wide_recursion import run

from actuator_lti import assemble_loops
from actuator_lti.design.model import (
    Command,
    Controller,
    Coupling,
    Design,
    Encoder,
    Filter,
    Friction,
    Load,
    LoadFriction,
    PositionLoop,
)

UNITS = {"position": 1.0, "velocity": 30.0, "current": 2.0, "voltage": 1.0}
CONTACTS = {"driving": 1.0, "driven": -1.0}


def agree(design: Design, ticks: int, tolerance: float, point: str = "sliding") -> None:
    """Same command, a constant moment: every signal to a part of its largest value."""
    t = np.arange(ticks)
    command = UNITS[design.controller.outermost] * (0.2 * np.sin(t / 40) + 1e-3 * t)
    contact = CONTACTS.get(point, 1.0)
    theirs = run(design, command, 0.3, contact)
    system = assemble_loops(design, operating_point=point).tick_system  # type: ignore[arg-type]
    assert system is not None
    ours = system.respond(command, 0.0, None, 0.3)
    names = ("th", "w", "u", "phi") if design.coupling is not None else ("th", "w", "u")
    for name in names:
        largest = np.max(np.abs(theirs[name]))
        assert np.max(np.abs(ours[name] - theirs[name])) < tolerance * largest, name


@pytest.mark.parametrize("name", DRIVES)
def test_every_kind_of_drive(name: str) -> None:
    agree(DRIVES[name], 2000, 1e-9)


def test_an_open_loop_voltage_drive() -> None:
    agree(replace(drive_d(), controller=Controller(period_s=1e-4, computing_delay_s=1.5e-4)), 2000, 1e-10)


@pytest.mark.parametrize("point", ["driving", "driven"])
@pytest.mark.parametrize("delay", [0.0, 0.5, 1.0, 1.5])
def test_driving_and_driven_for_every_delay(point: str, delay: float) -> None:
    design = replace(everything(), friction=Friction(viscous_Nms_rad=1e-5, load_coefficient=0.02))
    control = replace(design.controller, computing_delay_s=delay * 2e-4)
    agree(replace(design, controller=control), 5000, 1e-9, point)


def test_a_coupling_between_two_gears() -> None:
    base = everything()
    gears = (replace(base.gears[0], name="first", ratio=4.0, output_inertia_kgm2=1e-5),
             replace(base.gears[0], name="second", ratio=2.5, input_inertia_kgm2=2e-5))  # fmt: skip
    assert base.coupling is not None
    agree(replace(base, gears=gears, coupling=replace(base.coupling, after="first")), 2000, 1e-9)


@st.composite
def wide_designs(draw: st.DrawFn) -> Design:
    """Any stage outermost, any plant, any slot of the controller filled or empty."""
    n_v = draw(st.sampled_from([1, 2, 3]))
    base = draw(st.sampled_from([drive_e(), amber(), without(amber(), "current", gain=0.01), emps(5e-4)]))
    control = base.controller
    velocity, current, position = control.velocity, control.current, control.position
    assert velocity is not None
    assert position is not None
    T = n_v * control.period_s
    kinds = (
        Filter(kind="lowpass", frequency_rad_s=0.4 / T, order=draw(st.sampled_from([1, 2]))),
        Filter(kind="notch", frequency_rad_s=0.8 / T, width_rad_s=0.3 / T, depth=0.2),
        Filter(kind="skewed-notch", zero_rad_s=0.5 / T, pole_rad_s=0.7 / T, width_rad_s=0.4 / T, depth=0.1),
        Filter(kind="leadlag", zero_rad_s=0.1 / T, pole_rad_s=0.3 / T, on="speed"),
        Filter(kind="biquad", b=(0.2, 0.1, 0.05), a=(-0.9, 0.25)),
    )
    some = st.booleans()
    velocity = replace(
        velocity,
        every=n_v,
        filters=tuple(item for item in kinds if draw(some)),
        integral_time_s=draw(st.sampled_from([None, 0.03])),
        sensor=draw(st.sampled_from(["motor", "output"])),
    )
    position = replace(
        position,
        every=n_v * draw(st.sampled_from([1, 2, 5])),
        feedforward=draw(st.sampled_from([0.0, 0.9])),
        acceleration_feedforward=draw(st.sampled_from([0.0, 0.5])),
        integral_time_s=draw(st.sampled_from([None, 0.5])),
        derivative_time_s=draw(st.sampled_from([0.0, 1e-3])),
        derivative_filter_s=draw(st.sampled_from([0.0, 1e-3])),
        sensor=draw(st.sampled_from(["motor", "output"])),
    )
    if current is not None:
        current = replace(
            current,
            back_emf_feedforward=draw(st.sampled_from([0.0, 0.8])),
            resistance_feedforward=draw(st.sampled_from([0.0, 0.6])),
        )
    control = replace(
        control,
        computing_delay_s=control.period_s * draw(st.floats(0.0, 3.0)),
        position=draw(st.sampled_from([position, position, None])),
        velocity=draw(st.sampled_from([velocity, velocity, None])),
        current=current,
    )
    encoder = draw(
        st.sampled_from(
            [
                Encoder(),
                Encoder(speed="difference", difference_samples=3),
                Encoder(speed="tracking", bandwidth_rad_s=0.3 / T, filter_time_s=T),
            ]
        )
    )
    coupling = draw(st.sampled_from([None, Coupling(stiffness_Nm_rad=300.0, damping_Nms_rad=0.05)]))
    J_l = 2e-3 * base.total_ratio**2 / 100 if base.axis == "rotary" else 20.0
    k = 300.0 * base.total_ratio**2 / 100 if base.axis == "rotary" else 2e6
    if coupling is not None:
        coupling = Coupling(stiffness_Nm_rad=k, damping_Nms_rad=1e-3 * k)
    load = Load(
        inertia_kgm2=J_l,
        path=draw(st.sampled_from(["back-drivable", "self-locking"])),
        moment_slope_Nm_rad=draw(st.sampled_from([0.0, -0.05 * k])),
        moment_damping_Nms_rad=draw(st.sampled_from([0.0, 2e-4 * k])),
        friction=LoadFriction(viscous_Nms_rad=1e-4 * k),
    )
    command = Command(
        filter_time_s=draw(st.sampled_from([0.0, 20 * T])), filter_order=draw(st.sampled_from([1, 2]))
    )
    friction = replace(base.friction, load_coefficient=0.3 / base.total_ratio)
    return replace(
        base, controller=control, encoder=encoder, coupling=coupling, load=load, command=command,
        friction=friction,
    )  # fmt: skip


@settings(max_examples=60)
@given(wide_designs())
def test_any_wide_design(design: Design) -> None:
    agree(design, 90, 1e-9)


def test_the_gate_has_teeth() -> None:
    """A notch moved by 0.1 % is far outside the tolerance."""
    design = everything()
    velocity = design.controller.velocity
    assert velocity is not None
    assert velocity.filters == FILTERS
    moved = replace(FILTERS[1], frequency_rad_s=900.9)
    other = replace(velocity, filters=(FILTERS[0], moved, *FILTERS[2:]))
    system = assemble_loops(design).tick_system
    assert system is not None
    command = 0.1 * np.sin(np.arange(2000) / 40)
    ours = system.respond(command)["u"]
    theirs = run(replace(design, controller=replace(design.controller, velocity=other)), command, 0.0, 1.0)
    assert np.max(np.abs(ours - theirs["u"])) > 1e-6 * np.max(np.abs(ours))


def test_position_loop_of_a_rigid_drive_does_not_care_for_the_sensor() -> None:
    design = amber()
    other = replace(design.controller, position=PositionLoop(gain=120.0, sensor="output"))
    one, two = (assemble_loops(each).position for each in (design, replace(design, controller=other)))
    assert one is not None
    assert two is not None
    np.testing.assert_allclose(one.open_loop.A, two.open_loop.A, rtol=1e-14)
