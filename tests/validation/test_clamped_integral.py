"""The limit that clamps an integral: where it acts first, by the z-transform of the drive written out here.

An inertia J on an ideal torque source (gain k): with b = T k/J and every stage in every tick

    W (z - 1) = b U,    TH (z - 1) = T W + T b U/2,    E = Kv (R - TH) - W,
    I' = (Kp T/Tn) z/(z - 1) E,    U = Kp E + I' + F R,    F = k_aff (J/k) (1 - 1/z)^2/T^2.

An acceleration feed-forward of three times the inertia makes the integral carry twice what the motor needs.
"""

from typing import Any

import numpy as np
import pytest

from actuator_lti import assemble_loops
from actuator_lti.asked.verdict import Verdict
from actuator_lti.design import model
from analyses.validation.places import Bench
from analyses.validation.small_signal import small_signal
from nonlinear import Rows, commands, simulate
from tests.loops.loop_designs import source_drive

T, k, J, Kp, Tn, Kv, LIMIT = 5e-4, 0.5, 0.02, 6.0, 0.05, 12.0, 30.0


def drive(law: str, feedforward: float = 3.0) -> model.Design:
    velocity = model.VelocityLoop(gain=Kp, integral_time_s=Tn, anti_windup=law)
    place = model.PositionLoop(gain=Kv, acceleration_feedforward=feedforward)
    stages = {"position": place, "velocity": velocity}
    return source_drive(J, k, T, LIMIT, load={"path": "back-drivable"}, controller=stages)


def sizes(hertz: Any, feedforward: float = 3.0) -> tuple[np.ndarray, np.ndarray]:
    """|U/R| and |I'/R| on the unit circle."""
    z, b = np.exp(2j * np.pi * np.asarray(hertz) * T), T * k / J
    per_u = Kv * T * b * (z + 1.0) / (2.0 * (z - 1.0) ** 2) + b / (z - 1.0)
    integral = Kp * T / Tn * z / (z - 1.0)
    F = feedforward * J / k * (1.0 - 1.0 / z) ** 2 / T**2
    u = ((Kp + integral) * Kv + F) / (1.0 + (Kp + integral) * per_u)
    return np.abs(u), np.abs(integral * (Kv - per_u * u))


@pytest.mark.parametrize("law", ["clamped", "conditional"])
def test_the_linear_border_knows_the_clamp(law: str) -> None:
    """Where feed-forward is, the integral may be first; without it the output is.

    There the integral lags the error by less than 90 degrees in samples: what adds to it is larger.
    """
    for feedforward in (3.0, 0.0):
        hertz = np.geomspace(0.1, 100.0 if feedforward else 900.0, 40)
        output, integral = sizes(hertz, feedforward)
        largest = np.maximum(output, integral) if law == "clamped" else output
        loops = assemble_loops(drive(law, feedforward))
        found = loops.limiters["voltage"].onset_amplitude_rad(2.0 * np.pi * hertz)
        np.testing.assert_allclose(found, LIMIT / largest, rtol=1e-7)
        assert (integral > 1.2 * output).any() == (feedforward > 0.0)
        assert (integral < 0.8 * output).any()
        assert feedforward or (integral < output).all()
        both = [assemble_loops(drive(one, feedforward)).limiters["voltage"] for one in ("clamped", law)]
        ours = [one.onset_amplitude_rad(2.0 * np.pi * hertz) for one in both]
        assert feedforward or np.testing.assert_allclose(*ours, rtol=1e-10) is None


@pytest.mark.parametrize("law", ["clamped", "conditional"])
def test_the_clamp_is_judged(law: str) -> None:
    """By what stands in front of it, the output and the integral."""
    design = drive(law)
    rows = [row for place in Bench(design, design).onsets() for row in small_signal(place)]
    assert [row.name for row in rows] == ["voltage_onset", "voltage_onset_integral"][: 1 + (law == "clamped")]
    assert {row.verdict for row in rows} == {Verdict.MET}


@pytest.mark.parametrize("law", ["clamped", "conditional"])
def test_a_run_says_that_the_integral_is_clamped(law: str) -> None:
    """Between both borders nothing limits the output; the clamp alone acts, and is told of."""
    hertz = 2.0
    output, integral = (float(x) for x in sizes(hertz))
    assert integral > 1.2 * output
    amplitude, design = 0.5 * (LIMIT / output + LIMIT / integral), drive(law)
    run = simulate(design, commands.sine(amplitude, hertz), 3.0, limits_on=True)
    late = run.limit_active("voltage")[run.time_s > 2.0]
    assert bool(late.any()) == (law == "clamped")
    assert np.abs(run.voltage_V[run.time_s > 2.0]).max() < LIMIT
    assert Rows.of(design)["velocity_windup"][0] == (1.0 if law == "clamped" else 0.0)
