"""Motions in closed form: many rows a second, fast torques, another friction law, noise of the speed."""

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter

from actuator_lti.design import load_design
from analyses.identification.diagnosis import diagnosed
from analyses.identification.friction_law import bend_of
from analyses.identification.inverse import fit_records
from analyses.identification.joint_model import JointModel
from analyses.identification.motion_noise import with_noise_of_motion
from analyses.identification.rows import stands
from analyses.identification.verdict import kept_items, law_items, noise_items
from analyses.records.differentiation import low_pass
from tests.changed import changed
from tests.identification.bench_records import record_of
from tests.refusals import refused

MASS, VISCOUS, DRY, OFFSET = 95.0, 200.0, 20.0, -3.0


def _fitted(time: np.ndarray, position: np.ndarray, force: np.ndarray, **asked: Any) -> JointModel:
    return fit_records(load_design("emps"), [record_of(time, position=position, force=force)], **asked)


@pytest.mark.parametrize("per_second", [1_000, 10_000, 40_000])
def test_a_record_that_ends_in_motion_tells_its_mass_at_every_rate(per_second: int) -> None:
    """A mass of 80 % at 10 kHz: the filter's end counted samples, and the end was taken for a rest."""
    time = np.arange(2 * per_second) / per_second
    fast, slow = 2.0 * np.pi * 4.3, 2.0 * np.pi * 0.7
    position = 0.01 * np.sin(fast * time) + 0.1 * np.sin(slow * time)
    speed = 0.01 * fast * np.cos(fast * time) + 0.1 * slow * np.cos(slow * time)
    acceleration = -0.01 * fast**2 * np.sin(fast * time) - 0.1 * slow**2 * np.sin(slow * time)
    force = MASS * acceleration + VISCOUS * speed + DRY * np.sign(speed) + OFFSET
    model = _fitted(time, position, force)
    assert model["inertia"] == pytest.approx(MASS, rel=1e-3)
    assert model["viscous"] == pytest.approx(VISCOUS, rel=5e-3)
    assert model.relative_residual < 2e-3


@pytest.mark.parametrize("asked", [{}, {"form": "per-direction"}, {"knots_rad_s": (0.0, 0.01, 0.4)}])
def test_a_torque_of_fast_bits_needs_no_cut_off(asked: dict) -> None:
    """A force of bits of 2 ms, filtered as the position is; with the position filtered alone 17 % is left."""
    step, rng = 1e-4, np.random.default_rng(4)
    force = np.repeat(rng.choice([-400.0, 400.0], 1000), 20)
    force += 100.0 * np.sign(np.sin(2.0 * np.pi * 1.3 * step * np.arange(len(force))))
    fall = np.exp(-VISCOUS / MASS * step)  # the speed is exact under a force that is held
    speed = lfilter([0.0, (1.0 - fall) / VISCOUS], [1.0, -fall], force)
    travel = np.cumsum(force * step - MASS * np.diff(speed, append=speed[-1])) / VISCOUS
    position = np.concatenate([[0.0], travel[:-1]])
    between = 0.5 * (force + np.concatenate([force[:1], force[:-1]]))
    model = _fitted(step * np.arange(len(force)), position, between, **asked)
    assert model.relative_residual < 3e-3
    assert model["inertia"] == pytest.approx(MASS, rel=1e-3)


def _sines(rng: np.random.Generator, rows: int) -> tuple[np.ndarray, ...]:
    """Time, position, speed and acceleration of a motion to and fro at 1 kHz."""
    time, total = 1e-3 * np.arange(rows), np.zeros((3, rows))
    for turn in 2.0 * np.pi * rng.uniform(0.4, 4.0, 3):
        phase, size = turn * time + rng.uniform(0.0, 6.0), 0.2 / turn
        total += size * np.array([np.sin(phase), turn * np.cos(phase), -(turn**2) * np.sin(phase)])
    return time, *total


@pytest.mark.parametrize("stribeck", [0.0, 20.0])
def test_friction_that_bends_over_the_speed_fails_the_straight_law(stribeck: float) -> None:
    """Good records at the level of chance that stands once; a bend in every one of them, however it moves."""
    sure = []
    for seed in range(30):
        rng = np.random.default_rng(seed)
        time, position, speed, acceleration = _sines(rng, 4000)
        dry = (DRY + stribeck * np.exp(-((speed / 0.03) ** 2))) * np.sign(speed)
        force = MASS * acceleration + VISCOUS * speed + dry + OFFSET + 2.0 * rng.standard_normal(len(time))
        sure.append(bend_of(_fitted(time, position, force)).is_sure)
    assert all(sure) if stribeck else not any(sure)


def test_the_intervals_hold_a_bend_that_is_too_small_to_be_sure() -> None:
    """Viscous friction was up to 4.5 standard errors off: what a bend moves lies in the rows at reversals."""
    design, off = load_design("emps"), []
    for seed in range(30):
        rng = np.random.default_rng(1000 + seed)
        time, position, speed, acceleration = _sines(rng, 4000)
        size, fast, noise = 10.0 ** rng.uniform((-0.3, -2.3, 0.0), (1.3, -0.7, 1.3))
        dry = (DRY + size * np.exp(-((speed / fast) ** 2))) * np.sign(speed)
        force = MASS * acceleration + VISCOUS * speed + dry + OFFSET + noise * rng.standard_normal(len(time))
        record = record_of(time, position=position, force=force)
        right = diagnosed(design, design, [record], partial(fit_records, design), None)
        if not right.bend.is_sure:
            off.append((right.model["viscous"] - VISCOUS) / right.model.std("viscous"))
    assert len(off) > 15
    assert np.max(np.abs(off)) < 3.0
    assert np.sqrt(np.mean(np.square(off))) < 1.3


def test_a_bend_of_a_millionth_of_the_drive_fails_no_record() -> None:
    """28 standard errors of a record without noise, where simulated records err by as much."""
    time, position, speed, acceleration = _sines(np.random.default_rng(1), 4000)
    bent = 1e-3 * np.exp(-np.abs(speed) / 0.05) * np.sign(speed)
    model = _fitted(time, position, MASS * acceleration + VISCOUS * speed + OFFSET + bent)
    bend = bend_of(model)
    assert bend.chance < 1e-6
    (item,) = law_items(bend, model, "linear")
    assert item.passed


def _first_order_step(inertia: float) -> tuple[np.ndarray, ...]:
    """Time, position and force of a speed that rises to 0.2 m/s: the acceleration is what it lacks."""
    time, constant = 1e-3 * np.arange(3000), 0.05
    since = np.maximum(time - 0.2, 0.0)
    rise, moves = np.exp(-since / constant), time >= 0.2
    speed = 0.2 * (1.0 - rise)
    force = inertia * 0.2 / constant * rise * moves + VISCOUS * speed + DRY * moves + OFFSET
    noise = 0.1 * np.random.default_rng(1).standard_normal(len(time))
    return time, 0.2 * (since - constant * (1.0 - rise)), force + noise


def test_a_value_that_is_kept_for_being_negative_tells_no_others_apart() -> None:
    """Speed, acceleration and a constant are of two columns: with the mass kept, viscous was 2263 for 200."""
    model = _fitted(*_first_order_step(-5.0))
    assert model.names == ("viscous",)
    assert "negative" in model.fixed["inertia"].reason
    for name in ("dry", "offset"):
        assert "cannot be separated from viscous" in model.fixed[name].reason
    # the kept values are within 0.4 N of those drawn, the mass within the error that it is said to have
    assert abs(model["viscous"] - VISCOUS) < model.std("viscous") < 0.25 * VISCOUS


def test_a_mass_that_is_kept_is_no_drift() -> None:
    """The rise was one: all torques changed by -2600 %, and viscous was 181 +- 2422."""
    design, time, position, force = load_design("emps"), *_first_order_step(-5.0)
    held = {"inertia": MASS, "dry": DRY, "offset": OFFSET}
    record = record_of(time, position=position, force=force)
    right = diagnosed(design, design, [record], partial(fit_records, design, fixed=held), None)
    assert not right.findings["r"]
    assert right.model.std("viscous") < 0.25 * VISCOUS


def test_rows_that_differ_by_rounding_bend_no_friction_law() -> None:
    """Direction and offset are one column there: a straight law was bent by 15 to 36 standard errors."""
    step = _first_order_step(-5.0)
    for held in ({}, {"inertia": -5.0}, {"inertia": -5.0, "dry": DRY}):
        assert not bend_of(_fitted(*step, fixed=held)).is_sure


def test_a_record_shorter_than_the_filter_remembers_is_told_the_cut_off_that_it_allows() -> None:
    """By its 499 steps 500 rows hold 1.2 periods of 2.4048 Hz; taken at 2 Hz, a ramp comes out 9 % off."""
    short, words = 0.3 * np.arange(500) * 1e-3, ("cutoff = 2 Hz", "600 rows", "2.40481 Hz and more")
    refused(low_pass, short, 1e-3, cutoff_hz=2.0, order=4, words=words)
    refused(low_pass, short, 1e-3, cutoff_hz=2.40, order=4, words="allowed: 2")
    assert len(low_pass(short, 1e-3, cutoff_hz=2.40481, order=4)) == 500
    refused(low_pass, short[:12], 1e-3, cutoff_hz=20.0, order=4, words="allowed: a longer record")


def test_a_slope_by_direction_is_named() -> None:
    time, position, speed, acceleration = _sines(np.random.default_rng(1), 4000)
    force = MASS * acceleration + np.where(speed > 0.0, 260.0, 200.0) * speed + DRY * np.sign(speed)
    force += np.random.default_rng(2).standard_normal(len(time))
    model = _fitted(time, position, force)
    (item,) = law_items(bend_of(model), model, "linear")
    assert item.passed is False
    assert "--friction per-direction" in item.reason
    model = _fitted(time, position, force, form="per-direction")
    (item,) = law_items(bend_of(model), model, "linear")
    assert item.passed


def test_noise_of_a_speed_takes_nothing_from_the_mass_without_a_command() -> None:
    """3 % of the speed: 0.8 % too small in the mean, 3 standard errors; given back and said."""
    design, off, said = load_design("emps"), [], []
    for seed in range(30):
        rng = np.random.default_rng(seed)
        time, _, speed, acceleration = _sines(rng, 4000)
        force = MASS * acceleration + VISCOUS * speed + DRY * np.sign(speed) + OFFSET
        noisy = speed + 0.03 * np.std(speed) * rng.standard_normal(len(time))
        record = record_of(time, velocity=noisy, force=force)
        model = with_noise_of_motion(design, fit_records(design, [record]), [record])
        off.append((model["inertia"] - MASS) / model.std("inertia"))
        said += noise_items(model)
    assert abs(np.mean(off)) < 4.0 / np.sqrt(len(off))
    assert np.mean(np.abs(off) < 1.96) > 0.8
    assert len(said) > 10


@pytest.mark.parametrize("corner_hz", [2.0, 15.0, 80.0])
@pytest.mark.parametrize("moves", [0.0, 0.03])
def test_noise_behind_a_filter_is_no_motion(corner_hz: float, moves: float) -> None:
    """A held axis under a force to and fro; where it moves, 3 % of the speed are enough to see it."""
    rng, design = np.random.default_rng(1), load_design("emps")
    time, _, speed, acceleration = _sines(rng, 4000)
    keep = np.exp(-2.0 * np.pi * corner_hz * 1e-3)
    noise = lfilter([1.0 - keep], [1.0, -keep], rng.standard_normal(8000))[4000:]
    force = (
        MASS * acceleration + VISCOUS * speed + DRY * np.sign(speed) + 0.3 * rng.standard_normal(len(time))
    )
    logged = moves * speed + 2e-4 * noise / np.std(noise)
    assert stands(design, record_of(time, velocity=logged, force=force)) is (moves == 0.0)


def test_an_offset_that_one_direction_does_not_tell_is_not_proven() -> None:
    """It is in the dry friction then, which is as sure as if there were none."""
    design, (time, _, speed, acceleration) = load_design("emps"), _sines(np.random.default_rng(0), 4000)
    speed = speed + 2.0 * np.max(np.abs(speed))
    design = changed(design, friction={"offset_torque_Nm": 0.0})
    force = MASS * acceleration + VISCOUS * speed + DRY + OFFSET
    model = fit_records(design, [record_of(time, velocity=speed, force=force)])
    assert model["dry"] == pytest.approx(DRY + OFFSET, rel=1e-3)
    assert [item.id for item in kept_items(model, ())] == ["kept-offset"]


@pytest.mark.parametrize("place", ["velocity", "position"])
def test_a_motion_under_a_load_that_is_not_known_is_one(place: str) -> None:
    """30 times what the drive takes, as gravity or a load of turned sign leave: that may be zero then."""
    time, way, speed, acceleration = _sines(np.random.default_rng(0), 4000)
    own = MASS * acceleration + VISCOUS * speed + DRY * np.sign(speed)
    force = own + 30.0 * np.std(own) * np.sin(0.7 * time)
    record = record_of(time, **{place: {"velocity": speed, "position": way}[place]}, force=force)
    assert not stands(load_design("emps"), record)


def test_a_slope_that_came_out_negative_and_is_kept_is_no_proof_of_the_law() -> None:
    """Friction that falls with the speed, as `JointModel` has it where a command is simulated: 0 errors."""
    rng = np.random.default_rng(3)
    time, position, speed, acceleration = _sines(rng, 4000)
    dry = (DRY + 20.0 * np.exp(-np.abs(speed) / 0.1)) * np.sign(speed)
    force = MASS * acceleration + dry + OFFSET + rng.standard_normal(len(time))
    model = _fitted(time, position, force)
    assert "viscous" in model.fixed
    (part,) = model.records
    # speed and acceleration as the regressors that were found tell them
    inputs = part.w @ np.linalg.lstsq(part.w, part.inputs, rcond=None)[0]
    told = replace(model, simulated=(record_of(time),), records=(replace(part, inputs=inputs),))
    assert bend_of(told).is_sure
