"""Where the limits begin: A_k(w) = limit_k/|T_k| against the recursion, closed forms, the running drive."""

from dataclasses import replace
from math import inf

import numpy as np
import pytest
from loop_designs import amber, controlled, ctms_position, emps
from recursion import run

from actuator_lti import InputError, assemble_loops, load_design, onset
from actuator_lti.design.model import Design, Limits
from nonlinear import Drive, commands, simulate
from tests.changed import changed


def peaks(design: Design, cycles: int, window: int, amplitude: float) -> dict[str, float]:
    """Steady peaks of u, i_ref and w_ref for a sinusoid at the output shaft, run tick by tick."""
    record = run(design, amplitude * np.sin(2 * np.pi * cycles / window * np.arange(2 * window)))
    steady = {
        name: record[name][-window // every :] for name, every in (("u", 1), ("i_ref", 2), ("w_ref", 10))
    }
    steady["change"] = np.diff(record["w_ref"])[-window // 10 :] / 1e-3
    steady["rate"] = np.diff(record["i_ref"])[-window // 2 :] / 2e-4
    return {name: float(np.max(np.abs(values))) for name, values in steady.items()}


@pytest.mark.parametrize("cycles", [61, 401])
@pytest.mark.parametrize("feedforward", [0.0, 0.9])
def test_onset_of_each_limiter_in_the_multirate_drive(cycles: int, feedforward: float) -> None:
    """At the onset amplitude the largest steady sample is the limit, whichever sub-tick it falls in."""
    design, window = amber(2, 10, feedforward=feedforward), 14_000
    design = changed(design, limits={"current_rate_A_s": 1e3})
    loops, omega = assemble_loops(design), 2 * np.pi * cycles / (window * 1e-4)
    seen = peaks(design, cycles, window, 1e-3)
    signals = {"speed": "w_ref", "acceleration": "change", "current": "i_ref", "voltage": "u"}
    signals["current-rate"] = "rate"
    for name, path in loops.limiters.items():
        amplitude = float(path.onset_amplitude_rad(omega)[0])
        # the recursion sees samples of the sinusoid, whose phases here lie densely enough for 0.1 %
        assert seen[signals[name]] * amplitude / 1e-3 == pytest.approx(path.limit, rel=2e-3), name


def test_speed_clamp_of_a_p_position_loop_with_ideal_inner_loops() -> None:
    """Onset at A = R sqrt(1 + (w/Kv)^2)/w, R the rate limit at the output (model.md section 5)."""
    # inner loops so fast that they count as ideal
    motor = replace(amber().motor, inductance_H=1e-12, back_emf_constant_Vs_rad=1e-9)
    fast = controlled(amber(motor=motor), velocity={"gain": 1e4}, current={"gain_V_A": 1e6})
    omega, R = np.array([10.0, 120.0, 500.0]), 942.5 / 2376
    found = assemble_loops(fast, "ideal").limiters["speed"].onset_amplitude_rad(omega)
    np.testing.assert_allclose(found, R * np.sqrt(1 + (omega / 120) ** 2) / omega, rtol=2e-5)


def test_the_active_limiter_and_its_bias() -> None:
    loops, omega = assemble_loops(amber()), np.array([6.0, 60.0, 600.0])
    border = onset(loops, omega)
    assert border.active == ("speed", "current", "current")
    np.testing.assert_array_equal(border.amplitude_rad, np.min(list(border.each_rad.values()), axis=0))
    half = onset(loops, omega, bias={"speed": -942.5 / 2})
    assert half.amplitude_rad[0] == pytest.approx(border.amplitude_rad[0] / 2)
    assert onset(loops, omega, bias={"speed": 2000.0}).amplitude_rad[0] == 0
    for none in ("2 rad/s", float("nan"), None):
        with pytest.raises(InputError, match=r"bias\['speed'\] = .*finite number"):
            onset(loops, omega, bias={"speed": none})


def test_the_command_of_a_speed_drive_is_that_of_the_output() -> None:
    """At low frequency the voltage is what a steady speed takes: N (k_E + R C_v/k_M) of it, in every form."""
    design = controlled(amber(), position=None)
    motor, viscous = design.effective_motor, design.friction.viscous_Nms_rad
    a_speed = motor.back_emf_constant_Vs_rad + motor.resistance_ohm * viscous / motor.torque_constant_Nm_A
    wanted = design.limits.voltage_V / (design.total_ratio * a_speed)
    for form in ("sampled", "continuous", "ideal"):
        border = onset(assemble_loops(design, form), [1e-3])
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
    with pytest.raises(InputError, match=r"limits\.current_rate"):
        load_design("ilr33-amber").with_values({"limits.current_rate": "0 A/s"})


def test_results_end_at_nyquist() -> None:
    path = assemble_loops(amber(2, 10)).limiters["current"]
    assert path.responses([100.0]).shape == (5, 1)
    with pytest.raises(InputError, match="Nyquist"):
        path.response([3200.0])
    with pytest.raises(InputError, match="positive"):
        path.response([0.0])


def test_three_forms_agree_at_low_frequency() -> None:
    omega, design = np.array([1.0, 10.0]), amber(feedforward=0.5)
    reference = assemble_loops(design, "ideal").limiters
    for form in ("sampled", "continuous"):
        for name, path in assemble_loops(design, form).limiters.items():
            np.testing.assert_allclose(path.response(omega), reference[name].response(omega), rtol=2e-2)


def test_a_torque_drive_ramps() -> None:
    """A step of 5 A at 2 A/ms and Ts = 0.1 ms: 0.2 A a tick, 25 ticks, of which the last needs no limit."""
    torque_drive = controlled(load_design("ilr33-amber"), position=None, velocity=None)
    design = replace(torque_drive, limits=Limits(voltage_V=1e6, current_rate_A_s=2000.0))
    step_A = 2000.0 * design.controller.period_s
    run = simulate(design, commands.step(5.0), 40 * design.controller.period_s)
    expected = np.minimum(5.0, step_A * np.arange(1, run.time_s.size + 1))
    assert np.allclose(run.current_command_A, expected, rtol=0, atol=1e-12)
    acting = run.limit_active("current-rate")
    assert acting[:24].all()
    assert not acting[26:].any()
    assert (run.limits["current-rate"].limit, run.limits["current-rate"].unit) == (2000.0, "A/s")
    free = simulate(replace(design, limits=Limits(voltage_V=1e6)), commands.step(1.0), 0.01)
    assert "current-rate" not in free.limits


def test_the_integral_of_a_position_controller_waits() -> None:
    """PI of position straight on the current: behind the slope limit out is not v, so I is kept."""
    loop = {"gain": 0.1, "every": 1, "integral_time_s": 1e-3}
    design = controlled(load_design("ilr33-amber"), velocity=None, position=loop)
    drive = Drive(replace(design, limits=Limits(voltage_V=1e6, current_rate_A_s=1.0)))
    for k in range(1, 4):
        drive.control(1.0, 0.0, 0.0, 0.0)
        assert drive.value("position_integrator") == 0.0
        assert drive.value("current_reference") == pytest.approx(1e-4 * k, rel=1e-12)
