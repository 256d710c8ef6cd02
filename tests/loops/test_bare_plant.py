"""The plant by itself, against closed forms of an RL circuit, a rigid drive and two masses."""

from dataclasses import replace
from math import exp
from typing import Any

import numpy as np
import pytest
from scipy.signal import cont2discrete

from actuator_lti import InputError, load_design, plant
from actuator_lti.design import Design, shipped_designs, with_overrides

W = np.geomspace(1.0, 2e4, 60)


def prompt(name: str, **changes: Any) -> Design:
    """A design whose voltage acts at once."""
    return with_overrides(load_design(name), {"control.computing_delay": "0 s", **changes})


def entry(system: Any, output: str, source: str) -> np.ndarray:
    at = system.output_labels.index(output), system.input_labels.index(source)
    return np.asarray(system(1j * W, squeeze=False))[at]


def ideal_motor(design: Design) -> dict[str, float]:
    motor, friction = design.effective_motor, design.friction
    return {
        "R": motor.resistance_ohm, "L": motor.inductance_H, "kM": motor.torque_constant_Nm_A,
        "kE": motor.back_emf_constant_Vs_rad, "J": design.inertia_kgm2, "C": friction.viscous(),
    }  # fmt: skip


def test_a_locked_rotor_is_a_resistance_and_an_inductance() -> None:
    design = prompt("ilr33-amber")
    p, Ts = ideal_motor(design), design.controller.period_s
    found = plant(design, "ideal", "locked")
    assert found.output_labels == ["current"]
    assert entry(found, "current", "u") == pytest.approx(1 / (1j * W * p["L"] + p["R"]), rel=1e-12)
    decay, sampled = exp(-p["R"] * Ts / p["L"]), plant(design, "sampled", "locked")
    assert sampled.dt == Ts
    assert sampled.A[0, 0] == pytest.approx(decay, rel=1e-12)
    assert sampled.B[0, 0] == pytest.approx((1 - decay) / p["R"], rel=1e-12)
    assert not np.any(sampled.B[:, 1])


def test_a_free_rotor_has_its_back_emf() -> None:
    """w/u = kM / ((L s + R)(J s + C) + kM kE); th = w/s; the output turns N times slower."""
    design = prompt("ilr33-amber")
    p, s = ideal_motor(design), 1j * W
    found = plant(design, "ideal")
    speed = p["kM"] / ((p["L"] * s + p["R"]) * (p["J"] * s + p["C"]) + p["kM"] * p["kE"])
    assert entry(found, "speed", "u") == pytest.approx(speed, rel=1e-11)
    assert entry(found, "current", "u") == pytest.approx(speed * (p["J"] * s + p["C"]) / p["kM"], rel=1e-11)
    assert entry(found, "output_angle", "u") == pytest.approx(speed / s / design.total_ratio, rel=1e-11)
    assert not np.any(entry(found, "speed", "load_torque"))  # self-locking


def test_a_spring_between_two_masses() -> None:
    """Of a force source: w (J_m s + C + felt/N_c Z) = g u and so on, solved from Newton's two equations."""
    design = prompt("joint")
    p, s, coupling = ideal_motor(design), 1j * W, design.coupling
    N, J_m, J_l = design.ratio_to_coupling, design.motor_side_inertia_kgm2, design.load_side_inertia_kgm2
    bare = replace(design, load=replace(design.load.bare(), friction=None),
                   friction=replace(design.friction, load_coefficient=0.0))  # fmt: skip
    found = plant(bare, "ideal")
    Z = coupling.stiffness_Nm_rad / s + coupling.damping_Nms_rad  # torque per speed of twist
    electric = p["kM"] * p["kE"] / (p["L"] * s + p["R"])
    for source, torque, moment in (("u", p["kM"] / (p["L"] * s + p["R"]), 0.0), ("load_torque", 0.0, 1.0)):
        # (J_m s + C + electric + Z/N^2) w - Z/N W = torque;  (J_l s + Z) W - Z/N w = moment
        a, b, d = J_m * s + p["C"] + electric + Z / N**2, -Z / N, J_l * s + Z
        w, behind = (d * torque - b * moment) / (a * d - b * b), (a * moment - b * torque) / (a * d - b * b)
        assert entry(found, "speed", source) == pytest.approx(w, rel=1e-9)
        assert entry(found, "twist", source) == pytest.approx((w / N - behind) / s, rel=1e-9)
        assert entry(found, "output_angle", source) == pytest.approx(behind / s, rel=1e-9)


@pytest.mark.parametrize("name", shipped_designs())
def test_sampled_is_the_zero_order_hold_of_ideal(name: str) -> None:
    """Without own moments, which are held over a tick, and without delay: scipy's hold of the same."""
    design = prompt(name)
    design = replace(design, load=design.load.bare(), motor=design.motor.level())
    ideal, sampled = plant(design, "ideal"), plant(design)
    order = [ideal.state_labels.index(state) for state in sampled.state_labels]
    A, B, C = ideal.A[np.ix_(order, order)], ideal.B[order], ideal.C[:, order]
    Phi, Gamma, *_ = cont2discrete((A, B, C, ideal.D), design.controller.period_s)
    np.testing.assert_allclose(sampled.A, Phi, rtol=1e-9, atol=1e-12 * np.abs(Phi).max())
    for column in (0, 1):
        size = np.abs(Gamma[:, column]).max()
        assert sampled.B[:, column] == pytest.approx(Gamma[:, column], rel=1e-9, abs=1e-12 * size)
    assert sampled.C.tolist() == C.tolist()


def test_the_continuous_form_is_late_by_the_delay_and_half_a_tick() -> None:
    design = load_design("fin")
    late = design.controller.computing_delay_s + design.controller.period_s / 2
    exact, ideal = plant(design, "continuous"), plant(design, "ideal")
    wanted = entry(ideal, "speed", "u") * np.exp(-1j * W * late)
    assert entry(exact, "speed", "u") == pytest.approx(wanted, rel=1e-10)
    assert entry(exact, "twist", "load_torque") == pytest.approx(
        entry(ideal, "twist", "load_torque"), rel=1e-10
    )


def test_a_current_command_closes_the_current_loop() -> None:
    """Locked, without delay: PI(s) G/(1 + PI(s) G), G = 1/(L s + R)."""
    design = prompt("ilr33-amber")
    p, loop, s = ideal_motor(design), design.controller.current, 1j * W
    L = loop.gain_V_A * (1 + 1 / (loop.integral_time_s * s)) / (p["L"] * s + p["R"])
    found = plant(design, "ideal", "locked", command="i_ref")
    assert entry(found, "current", "i_ref") == pytest.approx(L / (1 + L), rel=1e-10)
    assert plant(design, command="i_ref").input_labels == ["i_ref", "load_torque"]


@pytest.mark.parametrize(
    ("name", "bad", "words"),
    [
        ("joint", {"form": "zoh"}, "form = 'zoh': one of sampled, continuous, ideal"),
        ("joint", {"rotor": "held"}, "rotor = 'held': free or locked"),
        ("joint", {"command": "w_ref"}, "command = 'w_ref': one of u, i_ref"),
        ("emps", {"command": "i_ref"}, "emps has no current loop"),
        ("emps", {"rotor": "locked"}, "the design has no current"),
    ],
)
def test_bad_arguments_are_named(name: str, bad: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        plant(name, **bad)
