"""Every slot of the controller against a plain writing of its equations, on random drives and inputs."""

from dataclasses import replace
from math import inf, pi

import numpy as np
import pytest
from controller_reference import Controller

from actuator_lti import load_design
from actuator_lti.design.model import (
    Command,
    CurrentLoop,
    Design,
    Encoder,
    Filter,
    Limits,
    OutputEncoder,
    PositionLoop,
    VelocityLoop,
)
from nonlinear import Drive

TICKS = 240
CASES = 120


def some_filters(rng: np.random.Generator, T: float) -> tuple[Filter, ...]:
    w = lambda: float(rng.uniform(0.02, 0.8) * pi / T)  # noqa: E731
    kinds = [
        lambda on: Filter(kind="lowpass", on=on, frequency_rad_s=w(), order=1),
        lambda on: Filter(
            kind="lowpass", on=on, frequency_rad_s=w(), order=2, damping=float(rng.uniform(0.4, 1.2))
        ),
        lambda on: Filter(
            kind="notch", on=on, frequency_rad_s=w(), width_rad_s=w(), depth=float(rng.uniform(0, 0.5))
        ),
        lambda on: Filter(kind="leadlag", on=on, zero_rad_s=w(), pole_rad_s=w()),
        lambda on: Filter(
            kind="skewed-notch", on=on, zero_rad_s=w(), pole_rad_s=w(), width_rad_s=w(), depth=0.2
        ),
        lambda on: Filter(kind="biquad", on=on, b=(0.3, 0.1, 0.05), a=(-0.4, 0.15)),
        lambda on: Filter(kind="biquad", on=on, b=(0.5,), a=(-0.5,)),
    ]
    count = int(rng.integers(0, 5))
    return tuple(kinds[rng.integers(len(kinds))](("torque", "speed")[rng.integers(2)]) for _ in range(count))


def some_drive(rng: np.random.Generator) -> Design:
    """Any stages, any options, on the motor of the baseline."""

    def pick(*values):
        return values[rng.integers(len(values))]

    base = load_design("ilr33-amber")
    Ts, n_v, wide = 10 ** rng.uniform(-5, -3), int(pick(1, 2, 5)), 10 ** rng.uniform(-1, 1)
    laws = ("conditional", "clamped", "back-calculation")
    has_position, has_velocity, has_current = (
        pick(True, True, False),
        pick(True, True, False),
        pick(True, True, False),
    )
    cascade = CurrentLoop(
        gain_V_A=wide,
        integral_time_s=pick(None, 20 * Ts),
        back_emf_feedforward=pick(0.0, 0.7),
        resistance_feedforward=pick(0.0, 0.5),
        anti_windup=pick(*laws),
        tracking_time_s=pick(None, 7 * Ts),
    )
    velocity = VelocityLoop(
        sensor=pick("motor", "motor", "output"),
        gain=0.05 * wide,
        integral_time_s=pick(None, 50 * Ts),
        every=n_v,
        anti_windup=pick(*laws),
        tracking_time_s=pick(None, 9 * Ts),
        filters=some_filters(rng, n_v * Ts),
    )
    T_p = Ts * n_v * int(pick(1, 3))
    position = PositionLoop(
        gain=0.02 / Ts if has_velocity else 0.3,
        every=round(T_p / Ts),
        feedforward=pick(0.0, 0.6),
        sensor=pick("motor", "output"),
        integral_time_s=pick(None, 30 * T_p),
        derivative_time_s=pick(0.0, 3 * T_p),
        derivative_filter_s=pick(0.0, 2 * T_p),
        acceleration_feedforward=pick(0.0, 0.5),
        friction_feedforward=pick(0.0, 0.2),
    )
    T_o = T_p if has_position else (n_v * Ts if has_velocity else Ts)
    shaped = has_position or has_velocity
    rate = 2e-4 / T_o if has_position else 0.4
    command = Command(
        filter_time_s=pick(0.0, 3 * T_o, 0.4 * T_o),
        filter_order=pick(1, 2),
        filter_damping=0.8,
        rate_rad_s=pick(inf, rate) if shaped else inf,
        acceleration_rad_s2=pick(inf, 0.1 * rate / T_o) if shaped else inf,
    )
    if command.acceleration_rad_s2 < inf:
        command = replace(command, jerk_rad_s3=pick(inf, command.acceleration_rad_s2 / (4.3 * T_o)))
    limits = Limits(
        voltage_V=20.0,
        speed_rad_s=pick(inf, 300.0),
        acceleration_rad_s2=pick(inf, 20.0 / T_p),
        peak_current_A=pick(inf, 5.0),
        current_rate_A_s=pick(inf, inf, 3.0 / T_o),
    )
    if has_current and np.isfinite(limits.peak_current_A):
        limits = replace(
            limits,
            continuous_current_A=2.0,
            peak_time_s=pick(None, 30 * Ts),
            release=0.8,
            overload=pick("thermal", "excess"),
        )
    encoder = Encoder(
        counts_per_rev=pick(None, 4096),
        speed=pick("ideal", "difference", "tracking"),
        difference_samples=int(pick(1, 3)),
        filter_time_s=pick(0.0, 4 * Ts),
        bandwidth_rad_s=0.2 / (n_v * Ts),
    )
    control = replace(
        base.controller,
        period_s=Ts,
        computing_delay_s=0.0,
        position=position if has_position else None,
        velocity=velocity if has_velocity else None,
        current=cascade if has_current else None,
    )
    return replace(
        base,
        controller=control,
        limits=limits,
        encoder=encoder,
        command=command,
        output_encoder=OutputEncoder(counts_per_rev=pick(None, 10**6)),
    )


def some_measurements(rng: np.random.Generator, design: Design) -> np.ndarray:
    """Command, current, speed, angle and output angle at every tick: smooth, large enough to reach limits."""
    t, N = np.arange(TICKS), design.total_ratio
    waves = [
        np.sin(t * rng.uniform(0.01, 0.3) + rng.uniform(0, 6)) - np.sin(rng.uniform(0, 6)) for _ in range(4)
    ]
    size = {"position": 0.05, "velocity": 1.0, "current": 4.0, "voltage": 25.0}[design.controller.outermost]
    command = size * waves[0] + size * (t > 60) * rng.uniform(-1, 1)
    w = 200.0 * waves[2]
    th = np.cumsum(w) * design.controller.period_s + 0.3
    return np.column_stack([command, 4.0 * waves[1], w, th, th / N + 1e-4 * waves[3]])


@pytest.mark.parametrize("part", range(4))
def test_random_controllers(part: int) -> None:
    limited = 0
    for case in range(part * CASES // 4, (part + 1) * CASES // 4):
        rng = np.random.default_rng(case)
        design = some_drive(rng)
        drive, plain = Drive(design), Controller(design)
        rows = some_measurements(rng, design)
        result = np.array([drive.control(*row) for row in rows])
        expected = np.array([plain.tick(*row) for row in rows])
        scale = np.abs(expected).max()
        assert np.abs(result - expected).max() <= 1e-9 * scale, (case, design)
        assert drive.value("speed_command") == pytest.approx(plain.w_ref, rel=1e-9, abs=1e-9)
        limited += bool((np.abs(result) == 20.0).any()) and not (np.abs(result) == 20.0).all()
    assert limited > CASES / 16  # the limits and what follows them were seen
