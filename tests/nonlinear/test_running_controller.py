"""The running controller against its equations written plainly; limits alone: H1, H2, H3, anti-windup."""

import copy
import pickle
from collections.abc import Callable
from math import acos, asin, degrees, inf, radians

import numpy as np
import pytest
from controller_reference import Controller

from actuator_lti import load_design
from actuator_lti.design import model, shipped_designs
from actuator_lti.design.checks import check_design
from actuator_lti.design.model import Design, Motor
from actuator_lti.errors import InputError
from nonlinear import Drive, Reducers, Rows, Run, State, commands, loads, simulate, simulate_many
from nonlinear._kernels import elastic_layout, layout
from nonlinear._kernels.state_kinds import CONTINUOUS, KINDS, NOTE, WORK, state_kinds
from tests.changed import changed
from tests.validation.rich_drives import rich_drive, sizes

TICKS = 240
CASES = 120


def some_drive(case: int) -> model.Design:
    """Any options of a controller, and each stage left out now and then: no plant, and no noise, matters."""
    design = rich_drive(500 + case, own_law=False)
    left_out = [name for k, name in enumerate(("position", "velocity", "current")) if case % (5 + k) == 0]
    plain = {"coupling": None, "supply": None, "instruments": model.Instruments()}
    plain |= {"limits": {"peak_time_s": None}} if "current" in left_out else {}
    return changed(design, controller=dict.fromkeys(left_out), **plain)


def some_measurements(rng: np.random.Generator, design: model.Design) -> np.ndarray:
    """Command, current, speed, angle and output angle at every tick: smooth, large enough to reach limits."""
    t, N, limits = np.arange(TICKS), design.total_ratio, design.limits
    waves = [
        np.sin(t * rng.uniform(0.01, 0.3) + rng.uniform(0, 6)) - np.sin(rng.uniform(0, 6)) for _ in "ciwy"
    ]
    command = sizes(design)[0] * (waves[0] + (t > 60) * rng.uniform(-1, 1))
    amperes = min(limits.peak_current_A, limits.voltage_V / design.effective_motor.resistance_ohm)
    w = 0.5 * limits.voltage_V / design.effective_motor.back_emf_constant_Vs_rad * waves[2]
    th = np.cumsum(w) * design.controller.period_s
    y = th / N + 1e-4 * design.validation.full_deflection_rad * waves[3]
    return np.column_stack([command, amperes * waves[1], w, th + 0.3, y])


@pytest.mark.parametrize("part", range(4))
def test_random_controllers(part: int) -> None:
    limited = 0
    for case in range(part * CASES // 4, (part + 1) * CASES // 4):
        design = some_drive(case)
        drive, plain = Drive(design), Controller(design)
        rows = some_measurements(np.random.default_rng(case), design)
        result = np.array([drive.control(*row) for row in rows])
        expected = np.array([plain.tick(*row) for row in rows])
        scale = np.abs(expected).max()
        assert np.abs(result - expected).max() <= 1e-9 * scale, (case, design)
        assert drive.value("speed_command") == pytest.approx(plain.w_ref, rel=1e-9, abs=1e-9)
        at_limit = np.abs(result) == design.limits.voltage_V
        limited += bool(at_limit.any()) and not at_limit.all()
    assert limited > CASES / 16  # the limits and what follows them were seen


STATE_TICKS, MORE_THAN_A_BLOCK = 60, layout.BLOCK + 44


def drives() -> list[model.Design]:
    """Every shipped drive, and random ones: play with stick on both sides, supplies, noise among them."""
    return [*map(load_design, shipped_designs()), *map(rich_drive, range(60))]


def command(tick: int) -> float:
    return 0.3 * np.sin(0.2 * tick) + 0.01 * tick


def test_every_number_has_a_kind_and_nothing_goes_on_from_notes_and_work_space() -> None:
    """1e300 in all of them before every tick, and then in a drive begun anew: not one bit is different."""
    assert elastic_layout.ES_END - layout.ELASTIC_STATE == layout.ELASTIC_STATE_SIZE
    for design in drives():
        plain, spoilt = Drive(design), Drive(design)
        kinds = state_kinds(plain._p)
        assert kinds.shape == plain.get().shape
        assert set(kinds) <= set(KINDS)
        lines = slice(layout.S_QUEUE, int(plain._p[layout.AT_WORK]))  # delay line, angles, average, rings
        assert set(kinds[lines]) == {CONTINUOUS}
        held = np.isin(kinds, (NOTE, WORK))
        held &= design.instruments == model.Instruments()  # noise goes on from what counts as a note
        for k in range(STATE_TICKS):
            state = spoilt.get()
            state[held] = 1e300
            spoilt = Drive(design) if k == STATE_TICKS // 2 else spoilt
            spoilt.set(state)
            for drive in (plain, spoilt):
                drive.step(command(k))
            assert np.array_equal(plain.get()[~held], spoilt.get()[~held])
        with pytest.raises(InputError, match="this drive has"):
            spoilt.set(np.zeros(3))
        ticks = STATE_TICKS if design.instruments == model.Instruments() else MORE_THAN_A_BLOCK
        for k in range(STATE_TICKS, ticks):
            plain.step(command(k))
        rows = Rows.of(design)
        rows["ticks"] = ticks
        rows.series("command", np.array([command(k) for k in range(ticks)]))
        assert rows.trajectory().final.motor_angle_rad == plain.value("angle")


AMBER = load_design("ilr33-amber")


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda drive: pickle.loads(pickle.dumps(drive))])
def test_a_copy_of_a_drive_goes_on_alone(copied: Callable[[Drive], Drive]) -> None:
    drive = Drive(AMBER)
    for k in range(20):
        drive.step(command(k))
    twin = copied(drive)
    for k in range(20, 40):
        drive.step(command(k))
    assert twin.value("tick") == 20.0
    for k in range(20, 40):
        twin.step(command(k))
    assert np.array_equal(drive.get(), twin.get())


def ideal_drive(period_s: float, limits: model.Limits) -> model.Design:
    """Inner loops without lag: a torque source whose velocity loop reaches its command in one tick."""
    inertia, place = 1e-6, model.PositionLoop(gain=0.5 / period_s)
    velocity = model.VelocityLoop(gain=inertia / period_s)
    control = {"period_s": period_s, "computing_delay_s": 0.0, "position": place, "velocity": velocity}
    return model.Design(
        name="ideal",
        title="ideal inner loops",
        motor=model.Motor(rotor_inertia_kgm2=inertia, source_gain_Nm_V=1.0),
        controller=model.Controller(**control),
        limits=limits,
        validation=model.Validation(full_deflection_rad=1.0),
    )


def test_h1_pure_rate_limit() -> None:
    """10 deg at 5 Hz through 150 deg/s: triangle of 7.5 deg, fundamental 0.607927, lag 41.4096 deg."""
    Ts, f, A, R = 2e-8, 5.0, radians(10.0), radians(150.0)
    design = ideal_drive(Ts, model.Limits(voltage_V=inf, speed_rad_s=R))
    period = round(1.0 / (f * Ts))
    run = Run(
        design=design,
        # begun on the triangle, at its lower turning point
        command=commands.sine(A, f, phase_rad=-asin(0.75)),
        initial=State(motor_angle_rad=radians(-7.5), motor_speed_rad_s=-R, speed_command_rad_s=-R),
        duration_s=2.0 / f,
        reducers=Reducers(window_ticks=period),
    )
    result = simulate_many([run])
    low, high = result.span("output_angle_rad")
    response = result.phasor("output_angle_rad")[0] / result.phasor("reference_rad")[0]
    assert degrees(high[0]) == pytest.approx(7.5, abs=5e-4)
    assert degrees(low[0]) == pytest.approx(-7.5, abs=5e-4)
    assert abs(response) == pytest.approx(0.607927, abs=5e-7)
    # tick and hold put the turning point about one tick late
    assert -degrees(np.angle(response)) - 360.0 * f * Ts == pytest.approx(degrees(acos(0.75)), abs=5e-5)
    assert result.distortion("output_angle_rad")[0] == pytest.approx(0.121, abs=5e-4)
    assert result.limit_fraction("speed")[0] > 0.999


def test_h2_pure_acceleration_limit_and_h3_an_unsteady_point_shows() -> None:
    """20 000 deg/s2 at 20 Hz: parabola train of 1.5625 deg, fundamental 1.6126 deg."""
    Ts, f, a = 1e-6, 20.0, radians(20_000.0)
    design = ideal_drive(Ts, model.Limits(voltage_V=inf, acceleration_rad_s2=a))
    start = -a / (4.0 * f)
    begin, window = State(motor_speed_rad_s=start, speed_command_rad_s=start), round(1.0 / (f * Ts))
    asked = {"command": commands.sine(radians(1000.0), f), "duration_s": 2.0 / f, "initial": begin}
    run = Run(design=design, reducers=Reducers(window_ticks=window), **asked)
    result = simulate_many([run])
    low, high = result.span("output_angle_rad", last=1)
    assert degrees(high[0] - low[0]) / 2.0 == pytest.approx(1.5625, abs=5e-4)
    assert degrees(abs(result.phasor("output_angle_rad", last=1)[0])) == pytest.approx(1.6126, abs=5e-4)
    assert result.distortion("output_angle_rad", last=1)[0] == pytest.approx(0.038, abs=1e-3)
    asked = {"design": AMBER, "command": commands.sine(0.002, 10.0), "reducers": Reducers(window_ticks=1000)}
    runs = [Run(**asked, duration_s=duration_s) for duration_s in (0.2, 2.0)]
    early, late = simulate_many(runs).unsteadiness("output_angle_rad")
    assert early > 1e-3
    assert late < 1e-6


def drive(seed: int) -> Design:
    """Any stages and features over decades; one in four on an ideal torque source, which has no current."""
    design = rich_drive(600 + seed)
    if seed % 4 or design.supply is not None or design.controller.outermost == "current":
        return design
    limits = {"peak_current_A": inf, "continuous_current_A": inf, "peak_time_s": None}
    source = Motor(rotor_inertia_kgm2=design.motor.rotor_inertia_kgm2, source_gain_Nm_V=per_volt(design))
    return changed(design, motor=source, limits=limits, controller={"current": None})


def per_volt(design: Design) -> float:
    """Torque at standstill, N m/V."""
    motor = design.motor
    return motor.source_gain_Nm_V or motor.torque_constant_Nm_A / motor.resistance_ohm


@pytest.mark.parametrize("part", range(4))
def test_any_drive(part: int) -> None:
    tried = 0
    for seed in range(1 + 30 * part, 31 + 30 * part):
        design, rng = drive(seed), np.random.default_rng(seed)
        try:
            check_design(design, design.name)
        except InputError:  # features that exclude each other
            continue
        tried += 1
        c, limits, full = design.controller, design.limits, design.validation.full_deflection_rad
        outer = c.position or c.velocity
        updates = outer.every if outer else 1
        frequency = min(10.0 ** rng.uniform(-0.3, 2.3), 0.2 / (updates * c.period_s))
        command = commands.triangle(0.1 * full * 10.0 ** rng.uniform(-2.0, 2.0), frequency)
        load = rng.uniform(-0.3, 0.3) * per_volt(design) * limits.voltage_V * design.total_ratio
        moment = loads.proportional(rng.uniform(-0.3, 0.3) * load / full, load)
        run = simulate(design, command, 800 * c.period_s, moment, energy=True, raise_on_failure=False)
        assert run.status == "ok", (seed, run.advice)
        for name, values in run.columns().items():
            assert np.isfinite(values).all(), (seed, name)
        # the bus of a supply has its own law: test_wider_running
        assert design.supply or np.abs(run.voltage_V).max() <= limits.voltage_V, seed
        assert np.abs(run.current_command_A).max() <= limits.peak_current_A, seed
        if c.position and c.velocity:
            assert np.abs(run.speed_command_rad_s).max() <= limits.speed_rad_s, seed
            allowed = limits.acceleration_rad_s2 * updates * c.period_s
            assert np.abs(np.diff(run.speed_command_rad_s)).max() <= allowed * (1 + 1e-9), seed
        assert run.events_per_tick <= 50, seed
        assert run.energy.relative_error < (1e-6 if design.friction.law == "tanh" else 1e-9), seed
    assert tried > 25


@pytest.mark.parametrize("speed", ["difference", "tracking"])
def test_a_sensor_at_the_output_begins_where_the_output_is(speed: str) -> None:
    """Behind a twisted spring, commanded to stay: no error, no speed, so no voltage at the first tick."""
    encoder = model.Encoder(speed=speed, bandwidth_rad_s=2000.0)
    at_output = {"sensor": "output"}
    design = changed(
        load_design("ilr33-amber-compliant"), encoder=encoder, instruments=model.Instruments(),
        command=model.Command(filter_time_s=2e-3, rate_rad_s=1.0),
        controller={"position": {**at_output, "feedforward": 0.8}, "velocity": at_output},
    )  # fmt: skip
    start = State(motor_angle_rad=0.3 * design.total_ratio, output_angle_rad=0.29)
    run = simulate(design, commands.hold(0.29), initial=start, duration_s=2e-3)
    assert abs(run.voltage_V[0]) < 1e-6
