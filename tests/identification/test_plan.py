"""Planned motions: what was promised is kept on virtual drives, within the limits, by the fewest motions."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from actuator_lti.design import load_design, with_values
from analyses.identification.bench import identify_bench
from analyses.identification.plan import PERIOD_S, Plan, plan_motions
from analyses.records.record import Record
from nonlinear import commands, simulate
from tests.identification.bench_records import NOISE_A, record_of
from tests.refusals import refused

BASE = load_design("ilr33-amber")
VALUES = ("inertia", "viscous", "dry", "offset")


def _measured(plan: Plan, seed: int) -> tuple[dict[str, float], Record]:
    """A drive of other inertia and friction, driven by the plan; truth and record."""
    rng = np.random.default_rng([30, seed])
    friction = BASE.friction
    drive = with_values(
        BASE,
        {
            "motor.rotor_inertia": BASE.motor.rotor_inertia_kgm2 * rng.uniform(0.7, 1.4),
            "friction.dry_torque": friction.dry_torque_Nm * rng.uniform(0.6, 1.5),
            "friction.viscous": friction.viscous_Nms_rad * rng.uniform(0.6, 1.5),
        },
    )
    time = np.arange(0.0, plan.time_s[-1], drive.controller.period_s)
    smooth = commands.sampled(time, CubicSpline(plan.time_s, plan.command)(time))
    run = simulate(drive, smooth, float(time[-1]), record_every=10)
    assert all(use.fraction == 0.0 for use in run.limits.values())
    current = run.current_A + NOISE_A * rng.standard_normal(len(run.time_s))
    record = record_of(run.time_s, reference=run.reference_rad, angle=run.motor_angle_rad, current=current)
    values = (drive.inertia_kgm2, drive.friction.viscous_Nms_rad, drive.friction.dry_torque_Nm, 0.0)
    truth = dict(zip(VALUES, values, strict=True))
    return truth, record


def test_what_was_promised_is_kept_on_twenty_drives_and_motions_keep_off_the_limits() -> None:
    """Stated over promised errors, mean of each value; real over promised, rms of all 80: within 20 %."""
    plan = plan_motions(BASE, within=0.002, noise=NOISE_A)
    assert plan.passed
    stated, real = [], []
    for seed in range(20):
        truth, record = _measured(plan, seed)
        model = identify_bench(BASE, [record]).model
        promised = np.array([plan.expected.std(name) for name in VALUES])
        stated.append(np.array([model.std(name) for name in VALUES]) / promised)
        real.append(np.array([model[name] - truth[name] for name in VALUES]) / promised)
    assert np.mean(stated, axis=0) == pytest.approx(1.0, abs=0.2)
    assert np.sqrt(np.mean(np.square(real))) == pytest.approx(1.0, abs=0.2)
    rate = np.max(np.abs(np.gradient(plan.command, PERIOD_S))) * BASE.total_ratio
    assert rate <= 0.81 * BASE.limits.speed_rad_s
    assert np.max(np.abs(plan.command)) <= 0.8 * BASE.validation.full_deflection_rad
    assert plan.command[0] == plan.command[-1] == 0.0


def test_half_the_interval_takes_four_times_the_motion() -> None:
    """White noise: the variance falls with the time; and what is measured already need not be again."""
    coarse, fine = (plan_motions(BASE, within=within, noise=NOISE_A) for within in (0.002, 0.001))
    some = len(coarse.segments)  # of which the last may hardly be needed
    assert 4 * (some - 1) <= len(fine.segments) <= 4 * some
    _, record = _measured(coarse, 1)
    model = identify_bench(BASE, [record]).model
    rest = plan_motions(BASE, within=0.001, noise=NOISE_A, measured=model)
    assert rest.measured == 1
    assert len(rest.segments) == pytest.approx(len(fine.segments) - some, abs=2)
    refused(plan_motions, BASE, within=0.01, noise=0.0, words="the noise of the recorded current")
    bare = replace(BASE, controller=replace(BASE.controller, position=None))
    refused(plan_motions, bare, within=0.01, noise=NOISE_A, words="needs a position loop")


def test_the_command_writes_the_motions_for_the_drive(tmp_path, cli) -> None:
    ran = cli("identify", "--plan", "ilr33-amber", "--noise", NOISE_A, "--out", tmp_path, "--json")
    assert ran.status == 0
    assert ran.data["half_widths"]["inertia"] < ran.data["within"] == 0.05
    written = np.loadtxt(tmp_path / "ilr33-amber-plan.csv", delimiter=",", skiprows=1)
    assert len(written) == 4000 * len(ran.data["segments"])
    out = cli("identify", "--plan", "ballscrew", "--noise", 0.02, "--within", 1e-2).out
    assert out.startswith("FAIL")
    assert "are not enough" in " ".join(out.split())
