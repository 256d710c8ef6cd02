"""A requirement says which current loop and which response it means."""

from contextlib import nullcontext
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from actuator_lti import assemble_loops, load_design, stability_margins
from actuator_lti.bandwidth import Bandwidth, closed_loop_bandwidth
from actuator_lti.design import design_hash, read_design_text, with_overrides, with_values, write_design
from actuator_lti.design.model import Design, Requirement
from actuator_lti.drive.profile import CommandMean, command_mean
from actuator_lti.loops.commanded import commanded_bandwidth, commanded_step
from actuator_lti.loops.limiters import onset
from actuator_lti.step import step_figures
from analyses.isolation import isolated
from analyses.large_signal.from_rest import sweep_from_rest
from analyses.large_signal.map import amplitude_map
from analyses.linear.loop_figures import all_loop_figures
from analyses.linear.responses import response_at, response_curve
from analyses.specification.requirements import RequirementVerdict, evaluate_requirements
from nonlinear import commands, simulate
from reports.sections.requirements import label
from tests.refusals import refused

SCREW = load_design("ballscrew")
PHASE = {"quantity": "phase_margin", "unit": "deg", "loop": "current"}


def asking(design: Design, **keys: object) -> Design:
    kept = {"id": "r", "quantity": "bandwidth", "unit": "Hz", "loop": "position", "minimum": 1.0}
    return replace(design, requirements=(Requirement(**{**kept, **keys}),))


def judged(design: Design, **keys: object) -> RequirementVerdict:
    (verdict,) = evaluate_requirements(asking(design, **keys))
    return verdict


def test_the_ball_screw_follows_its_command_to_5_6_hz_its_reference_to_115() -> None:
    """Simulated small sines: -2.37 dB at 5 Hz, -12.7 dB at 20 Hz; the profile alone is -3 dB at 5.5 Hz."""
    smooth = replace(SCREW, friction=replace(SCREW.friction, load_coefficient=0.0))
    figures = all_loop_figures(assemble_loops(smooth), step=False)["position"]
    db = response_curve(figures, 2.0 * np.pi * np.array([5.0, 20.0])).magnitude_db
    assert tuple(db) == (pytest.approx(-2.37, abs=0.01), pytest.approx(-12.7, abs=0.05))
    to_command, to_reference = judged(SCREW, to="command"), judged(SCREW, to="reference")
    assert to_command.value == judged(SCREW).value == pytest.approx(5.62, abs=0.01)
    assert to_reference.value == pytest.approx(114.8, abs=0.05)
    assert label(to_command) == "Position loop: bandwidth (−3 dB), to the command"
    act = "rate and acceleration of the command are not in it: they act above"
    assert (act in to_command.reason, "rate and" in to_reference.reason) == (True, False)


def test_the_feedback_loop_of_the_ball_screw_is_a_third_signal() -> None:
    """|L/(1 + L)| = 1/sqrt(2) at 16.18 Hz, from L alone; the feed-forward takes the reference to 114.8 Hz."""
    loops = assemble_loops(SCREW)
    hz = closed_loop_bandwidth(loops.position.closed_loop).minus3db_hz
    assert hz == pytest.approx(16.18, abs=0.005)
    z = np.exp(2j * np.pi * hz * loops.position.period_s)
    L = complex(loops.position.open_loop(z))
    assert abs(L / (1.0 + L)) == pytest.approx(np.sqrt(0.5), rel=1e-9)
    assert closed_loop_bandwidth(loops.reference_to_output).minus3db_hz == pytest.approx(114.8, abs=0.05)


def test_what_rate_and_acceleration_leave_is_simulated() -> None:
    """The sentence beside the requirement, against a run of the simulator read by hand."""
    verdict, full = judged(SCREW, to="command"), SCREW.validation.full_deflection_rad
    hz = verdict.value
    onset = 1e3 * min(0.4 / (2.0 * np.pi * hz), 4.0 / (2.0 * np.pi * hz) ** 2)
    assert f"above {onset:.3g} mm" in verdict.reason
    run = simulate(SCREW, commands.sine(full, hz), 60.0 / hz)
    late = run.time_s >= 20.0 / hz
    turn, y = np.exp(-2j * np.pi * hz * run.time_s[late]), run.output_angle_rad[late]
    gain_db = 20.0 * np.log10(2.0 * abs(np.mean((y - y.mean()) * turn)) / full)
    said = float(verdict.reason.rpartition("Hz: ")[2].partition(" dB")[0])
    assert said == pytest.approx(gain_db, abs=0.1)


def test_a_sine_from_rest_is_compared_with_the_response_to_the_command() -> None:
    """Below the profile's limits a drive without dry friction is linear, the mean included."""
    friction = replace(SCREW.friction, dry_torque_Nm=0.0, load_coefficient=0.0)
    still = replace(SCREW, friction=friction, load=replace(SCREW.load, friction=None))
    hz, loops = np.array([2.0, 5.0, 9.0, 20.0]), assemble_loops(still)
    least = np.minimum(
        still.validation.full_deflection_rad, 0.5 * onset(loops, 2.0 * np.pi * hz).amplitude_rad
    )
    sweep = sweep_from_rest(still, hz, least, 40_000)
    assert np.abs(sweep.measured / sweep.sliding - 1.0).max() < 1e-3
    large = amplitude_map(still, loops, friction_on=False, counts=(3, 6))
    omega = 2.0 * np.pi * large.frequency_hz[:5]  # the last one is near Nyquist: the images of a held signal
    mean = command_mean(SCREW)
    behind = np.abs(large.linear[:5]) / np.abs(response_at(loops.plain_response, omega))
    np.testing.assert_allclose(behind, np.abs(mean.response(omega)), rtol=1e-4)


@pytest.mark.parametrize("hz", [0.5, 1.0, 6.0, 60.0])
def test_the_profile_acts_from_its_closed_form_on(hz: float) -> None:
    """Rate and acceleration limit of the command are limiters like the others."""
    loops = assemble_loops(SCREW)
    found = onset(loops, np.array([2.0 * np.pi * hz])).each_rad["profile"][0]
    assert found == pytest.approx(min(0.4 / (2 * np.pi * hz), 4.0 / (2 * np.pi * hz) ** 2), rel=3e-3)
    time = np.arange(0.0, 3.0 / hz, 5e-4)
    for share, acts in ((0.99, False), (1.01, True)):  # from the crest on: no kink, nothing to catch up
        wave = share * found * (1.0 - np.cos(2.0 * np.pi * hz * time))
        run = simulate(SCREW, commands.sampled(time, wave), time[-1])
        assert bool(((run.limit_flags & 128) != 0).any()) is acts


def behind_a_mean(response: Any, samples: int) -> tuple[np.ndarray, np.ndarray, Bandwidth]:
    """A response behind the mean of the last samples on a dense grid up to its first zero, and its bandwidth.

    The bandwidth is that of the grid, too.
    """
    band = commanded_bandwidth(response, CommandMean(samples, response.dt))
    omega = np.linspace(0.0, 2.0 * np.pi / (samples * response.dt), 20_001)[1:-1]
    omega = omega[omega < np.pi / response.dt]
    z = np.exp(-1j * omega * response.dt)
    total = response_at(response, omega) * (1.0 - z**samples) / (1.0 - z) / samples
    below = int(np.argmax(np.abs(total) < np.sqrt(0.5)))
    assert omega[below - 1] * (1 - 1e-9) <= band.minus3db_rad_s <= omega[below] * (1 + 1e-9)
    return omega, total, band


@pytest.mark.parametrize("gain", [2000.0, 2300.0, 2500.0])
@pytest.mark.parametrize("behind", [0.9, 1.02, 1.15, 1.4, 2.0])
def test_a_resonance_beside_the_first_zero_of_the_mean_hides_no_crossing(gain: float, behind: float) -> None:
    design = with_values(load_design("ilr33-amber"), {"control.position.gain": gain})
    response = assemble_loops(design).plain_response
    omega = np.linspace(0.0, np.pi / response.dt, 100_001)[1:-1]
    resonance = omega[np.abs(response_at(response, omega)).argmax()]
    samples = round(2.0 * np.pi * behind / (resonance * response.dt))
    omega, total, band = behind_a_mean(response, samples)
    passed = np.flatnonzero(np.diff(np.abs(total) < np.sqrt(0.5)))
    assert len(band.crossings_rad_s) == len(passed)
    assert ((omega[passed] <= band.crossings_rad_s) & (band.crossings_rad_s <= omega[passed + 1])).all()


@settings(max_examples=12)
@given(samples=st.integers(2, 900))
def test_the_bandwidth_behind_a_mean_is_that_of_a_dense_grid(samples: int) -> None:
    response = assemble_loops(load_design("ilr33-amber")).plain_response
    omega, total, band = behind_a_mean(response, samples)
    turned = int(np.argmax(np.unwrap(np.angle(total)) < -0.5 * np.pi))
    assert omega[turned - 1] * (1 - 1e-9) <= band.minus90deg_rad_s <= omega[turned] * (1 + 1e-9)
    assert band.resonance_peak_db == pytest.approx(max(20.0 * np.log10(np.abs(total)).max(), 0.0), abs=1e-5)


def test_the_step_behind_a_mean_is_the_simulated_one() -> None:
    response, mean = assemble_loops(SCREW).plain_response, command_mean(SCREW)
    figures = commanded_step(response, step_figures(response), mean)
    loop_y, x = [], np.zeros(len(response.A))
    for _ in figures.time_s:
        loop_y.append(float((response.C @ x).item() + response.D.item()))
        x = response.A @ x + response.B[:, 0]
    y = [sum(loop_y[max(0, k - mean.samples + 1) : k + 1]) / mean.samples for k in range(len(loop_y))]
    np.testing.assert_allclose(figures.response, y, atol=1e-9)
    assert figures.overshoot_percent == pytest.approx(100.0 * (max(y) / figures.final_value - 1.0))
    last = max(k for k, v in enumerate(y) if abs(v / figures.final_value - 1.0) > 0.02)
    assert figures.settling_time_s == pytest.approx((1 + last) * mean.period_s)


def test_a_filter_of_the_command_is_in_one_response_only() -> None:
    design = with_overrides(load_design("ilr33-amber"), {"command.filter_time": "50 ms"})
    to_command, to_reference = judged(design), judged(design, to="reference")
    bare = closed_loop_bandwidth(assemble_loops(load_design("ilr33-amber")).plain_response)
    assert to_reference.value == pytest.approx(bare.minus3db_hz)
    assert to_command.value < 3.2 < to_reference.value  # 1/(2 pi 50 ms) = 3.18 Hz


def test_a_requirement_chooses_the_current_loop() -> None:
    design = load_design("ilr33-amber")
    for rotor in ("free", "locked"):
        loops = assemble_loops(design, rotor=rotor)
        verdict = judged(design, **PHASE, rotor=rotor)
        assert verdict.value == pytest.approx(stability_margins(loops.current.open_loop).phase_margin_deg)
        assert label(verdict) == f"Current loop, rotor {rotor}: phase margin"
    assert judged(design, **PHASE).rotor == "free"


@pytest.mark.parametrize("rotor", ["free", "locked"])
def test_a_locked_loop_that_fails_is_never_judged_by_the_free_one(rotor: str, monkeypatch) -> None:
    """Nor does it take the others with it where nobody requires anything of it."""
    loops = assemble_loops(asking(load_design("ilr33-amber"), **PHASE, rotor=rotor))
    monkeypatch.setattr("analyses.linear.loop_figures._locked", lambda *_a, **_k: 1 / 0)
    with isolated() as missing, nullcontext() if rotor == "free" else pytest.raises(ZeroDivisionError):
        assert all_loop_figures(loops, locked=True)["current"].locked is None
    assert [one.part for one in missing] == ["current loop with the rotor locked"] * (rotor == "free")


def test_the_keys_are_read_written_and_hashed_where_they_stand_and_refused_where_they_say_nothing() -> None:
    amber = load_design("ilr33-amber")
    chosen = asking(amber, to="reference")
    assert read_design_text(write_design(chosen), "d").requirements == chosen.requirements
    assert design_hash(chosen) != design_hash(asking(amber))
    of_margin = {"to": "reference", **PHASE, "loop": "position"}
    for keys in ({"rotor": "locked"}, of_margin, {"to": "reference", "loop": "velocity"}):
        text = write_design(asking(amber, **keys))
        refused(read_design_text, text, "d", words=f"requirement.r.{next(iter(keys))}")
