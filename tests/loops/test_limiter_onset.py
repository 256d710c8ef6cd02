"""Where the limits begin: A_k(w) = limit_k/|T_k| against the tick-by-tick recursion and closed forms."""

from __future__ import annotations

from dataclasses import replace
from math import inf

import numpy as np
import pytest
from loop_designs import amber, ctms_position, emps
from loop_recursion import run

from actuator_lti import InputError, assemble_loops, onset
from actuator_lti.design.model import Design, Limits


def peaks(design: Design, cycles: int, window: int, amplitude: float) -> dict[str, float]:
    """Steady peaks of u, i_ref and w_ref for a sinusoid at the output shaft, run tick by tick."""
    t = np.arange(2 * window)
    command = amplitude * np.sin(2 * np.pi * cycles / window * t)
    result = {}
    for name, every in (("u", 1), ("i_ref", 2), ("w_ref", 10)):
        nothing = {name: np.zeros(len(t))}
        values = run(design, command, inject=nothing)["before"]
        result[name] = float(np.max(np.abs(values[-window // every :])))
        if name == "w_ref":
            result["change"] = float(np.max(np.abs(np.diff(values)[-window // every :]))) / 1e-3
    return result


@pytest.mark.parametrize("cycles", [61, 401])
@pytest.mark.parametrize("feedforward", [0.0, 0.9])
def test_onset_of_each_limiter_in_the_multirate_drive(cycles: int, feedforward: float) -> None:
    """At the onset amplitude the largest steady sample is the limit, whichever sub-tick it falls in."""
    design, window = amber(2, 10, feedforward=feedforward), 14_000
    loops = assemble_loops(design)
    omega = 2 * np.pi * cycles / (window * 1e-4)
    seen = peaks(design, cycles, window, 1e-3)
    signals = {"speed": "w_ref", "acceleration": "change", "current": "i_ref", "voltage": "u"}
    for name, path in loops.limiters.items():
        amplitude = float(path.onset_amplitude_rad(omega)[0])
        # the recursion sees samples of the sinusoid, whose phases here lie densely enough for 0.1 %
        assert seen[signals[name]] * amplitude / 1e-3 == pytest.approx(path.limit, rel=2e-3), name


def test_speed_clamp_of_a_p_position_loop_with_ideal_inner_loops() -> None:
    """Onset at A = R sqrt(1 + (w/Kv)^2)/w, R the rate limit at the output (model.md section 5)."""
    design = amber()
    control = design.controller
    assert control.velocity is not None
    assert control.current is not None
    # inner loops so fast that they count as ideal
    motor = replace(design.motor, inductance_H=1e-12, back_emf_constant_Vs_rad=1e-9)
    fast = replace(
        design,
        motor=motor,
        controller=replace(
            control,
            velocity=replace(control.velocity, gain=1e4),
            current=replace(control.current, gain_V_A=1e6),
        ),
    )
    path = assemble_loops(fast, "ideal").limiters["speed"]
    omega = np.array([10.0, 120.0, 500.0])
    R = 942.5 / 2376
    np.testing.assert_allclose(
        path.onset_amplitude_rad(omega), R * np.sqrt(1 + (omega / 120) ** 2) / omega, rtol=2e-5
    )


def test_the_active_limiter_and_its_bias() -> None:
    loops = assemble_loops(amber())
    omega = np.array([6.0, 60.0, 600.0])
    border = onset(loops, omega)
    assert border.active == ("speed", "current", "current")
    np.testing.assert_array_equal(border.amplitude_rad, np.min(list(border.each_rad.values()), axis=0))
    half = onset(loops, omega, bias={"speed": -942.5 / 2})
    assert half.amplitude_rad[0] == pytest.approx(border.amplitude_rad[0] / 2)
    gone = onset(loops, omega, bias={"speed": 2000.0})
    assert gone.amplitude_rad[0] == 0


def test_the_command_of_a_speed_drive_is_that_of_the_output() -> None:
    """At low frequency the voltage is what a steady speed takes: N (k_E + R C_v/k_M) of it, in every form."""
    design = replace(amber(), controller=replace(amber().controller, position=None))
    motor, viscous = design.effective_motor, design.friction.viscous_Nms_rad
    constants = motor.back_emf_constant_Vs_rad, motor.resistance_ohm, motor.torque_constant_Nm_A
    k_E, R, k_M = (float(value or 0.0) for value in constants)
    a_speed = k_E + R * viscous / k_M
    wanted = design.limits.voltage_V / (design.total_ratio * a_speed)
    for form in ("sampled", "continuous", "ideal"):
        border = onset(assemble_loops(design, form), [1e-3])  # type: ignore[arg-type]
        assert border.each_rad["voltage"] == pytest.approx(wanted, rel=1e-6)


def test_limiters_follow_the_stages() -> None:
    assert list(assemble_loops(amber()).limiters) == ["speed", "acceleration", "current", "voltage"]
    assert list(assemble_loops(emps()).limiters) == ["speed", "acceleration", "voltage"]
    assert list(assemble_loops(ctms_position(), "continuous").limiters) == ["voltage"]
    assert assemble_loops(emps()).limiters["acceleration"].unit == "m/s^2"
    free = replace(ctms_position(), limits=Limits(voltage_V=inf))
    nothing = onset(assemble_loops(free), [1.0])
    assert nothing.active == ("",)
    assert nothing.amplitude_rad[0] == inf


def test_results_end_at_nyquist() -> None:
    path = assemble_loops(amber(2, 10)).limiters["current"]
    assert path.responses([100.0]).shape == (5, 1)
    with pytest.raises(InputError, match="Nyquist"):
        path.response([3200.0])
    with pytest.raises(InputError, match="positive"):
        path.response([0.0])


def test_three_forms_agree_at_low_frequency() -> None:
    omega = np.array([1.0, 10.0])
    design = amber(feedforward=0.5)
    reference = assemble_loops(design, "ideal").limiters
    for form in ("sampled", "continuous"):
        for name, path in assemble_loops(design, form).limiters.items():  # type: ignore[arg-type]
            np.testing.assert_allclose(path.response(omega), reference[name].response(omega), rtol=2e-2)
