"""Loads, supply, instruments, profile against laws and closed forms; energy; the tanh law to forty digits."""

import ctypes
import itertools
import math
import shutil
import subprocess
import sys
from dataclasses import replace
from math import inf, pi, sqrt

import mpmath
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from actuator_lti import load_design
from actuator_lti.compiled.program import emit_c
from actuator_lti.design import model
from actuator_lti.design.model import Design, Limits
from nonlinear import Drive, Probe, Rows, State, commands, loads, simulate
from nonlinear._kernels.hyperbolic import LAST, STEPS, tanh
from nonlinear.export.program import single
from tests.changed import changed

AMBER = load_design("ilr33-amber")
FREE = model.Friction(viscous_Nms_rad=1e-6)
GAIN = 0.05  # V/A, of a current loop that hardly acts


TORQUE = changed(AMBER, controller={"position": None, "velocity": None})


def torque_drive(gain: float, integral_time_s: float | None, **limits: float) -> model.Design:
    current = model.CurrentLoop(gain_V_A=gain, integral_time_s=integral_time_s)
    return changed(TORQUE, controller={"current": current}, limits=model.Limits(**limits))


def test_all_that_goes_with_angle_and_speed_acts_together_and_is_held() -> None:
    """Slope, gravity, gear error, damping, series, constant, cogging: a tick integrated afresh with those of
    its beginning."""
    ticks, Ts = 200, AMBER.controller.period_s
    gravity = model.Gravity(mass_kg=3.0, arm_m=0.4, offset_rad=0.7)
    load = {"path": "back-drivable", "moment_slope_Nm_rad": -300.0, "gravity": gravity}
    load |= {"gear_error_Nm": 9.0, "gear_error_periods": 50.0, "gear_error_phase_rad": 2.5}
    motor = {"cogging_Nm": 4e-3, "cogging_periods": 12.0, "cogging_phase_rad": 1.0}
    load |= {"moment_damping_Nms_rad": 300.0}
    unlimited, at_once = model.Limits(voltage_V=1e9), {"computing_delay_s": 0.0}
    design = changed(AMBER, load=load, motor=motor, friction=FREE, limits=unlimited, controller=at_once)
    u, t = 6.0 * np.sin(0.02 * np.arange(ticks)), np.arange(ticks) * Ts
    series = 20.0 * np.sin(300.0 * t)
    given = replace(loads.series(t, series), constant_Nm=5.0, slope_Nm_rad=100.0)
    probe, begin = Probe(point="u", gain=0.0, injection=u), State(motor_speed_rad_s=50.0)
    run = simulate(design, commands.hold(), ticks * Ts, given, probes=[probe], initial=begin)
    m, N, J = design.motor, design.total_ratio, design.inertia_kgm2
    x, result = np.array([0.0, 50.0, 0.0]), np.empty((ticks, 3))
    for k in range(ticks):
        result[k] = x
        y = x[2] / N
        M = 5.0 - 200.0 * y + series[k] + 3.0 * 0.4 * 9.80665 * np.sin(y + 0.7)
        M += 9.0 * np.sin(50.0 * y + 2.5) - 300.0 * x[1] / N
        held = M / N + 4e-3 * np.sin(12.0 * x[2] + 1.0)

        def rate(_: float, x: np.ndarray, held: float = held, u: float = u[k]) -> list[float]:
            di = (u - m.resistance_ohm * x[0] - m.back_emf_constant_Vs_rad * x[1]) / m.inductance_H
            return [di, (m.torque_constant_Nm_A * x[0] - 1e-6 * x[1] + held) / J, x[1]]

        x = solve_ivp(rate, (0.0, Ts), x, "DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    for k, values in enumerate((run.current_A, run.motor_speed_rad_s, run.motor_angle_rad)):
        assert np.abs(values - result[:, k]).max() < 1e-9 * np.abs(result[:, k]).max()
    # J9: without integrals a slope leaves th/(N ref) = g/(g - slope/N^2), g the torque per position error
    load = {"path": "back-drivable", "moment_slope_Nm_rad": -6000.0}
    control = {"velocity": {"integral_time_s": None}}
    design = changed(AMBER, load=load, friction=FREE, controller=control)
    c = design.controller
    g = design.motor.torque_constant_Nm_A * c.velocity.gain * c.position.gain
    expected = g / (g + 6000.0 / design.total_ratio**2)
    run = simulate(design, commands.step(0.001), 2.0)
    assert run.output_angle_rad[-1] / 0.001 == pytest.approx(expected, rel=1e-6)
    assert expected < 0.99


@pytest.mark.parametrize("supply", [
    model.Supply(resistance_ohm=0.1),
    model.Supply(resistance_ohm=0.1, regenerative=False, capacitance_F=2e-4, brake_voltage_V=27.0),
    model.Supply(regenerative=False, capacitance_F=1e-3),
])  # fmt: skip
def test_supply(supply: model.Supply) -> None:
    """The bus by its law from recorded voltage and current, its account, and the limit that it is."""
    design = replace(AMBER, supply=supply, limits=model.Limits(voltage_V=24.0, peak_current_A=8.0))
    Ts, Us, C = design.controller.period_s, 24.0, supply.capacitance_F
    drive, U, power, braked, saturated = Drive(design), Us, 0.0, False, False
    for k in range(4000):
        u, i, before = drive.value("voltage"), drive.value("current"), U
        if k:
            i_b = u * i / U if U > 0.0 else 0.0
            power += u * i * Ts
            if i_b >= 0.0 or supply.regenerative:
                U = max(Us - supply.resistance_ohm * i_b, 0.0)
            else:
                U = min(sqrt(before**2 - 2.0 * u * i * Ts / C), supply.brake_voltage_V or inf)
        drive.step(0.3 if k < 2500 else -0.3)
        assert drive.value("voltage_limit") == pytest.approx(U, rel=1e-12)
        assert abs(drive.value("voltage")) <= U * (1 + 1e-15)
        saturated |= abs(drive.value("voltage")) == drive.value("voltage_limit") != 24.0
        braked |= supply.brake_voltage_V == U
    assert saturated or not supply.resistance_ohm
    assert drive.value("voltage_limit") > 10.0
    assert braked == (supply.brake_voltage_V is not None)
    run = simulate(design, commands.step(0.3), 0.4, energy=True)
    energy = run.energy
    account = energy.supply_J - energy.supply_loss_J - energy.brake_J - energy.bus_capacitor_J
    assert account == pytest.approx(Ts * float(run.voltage_V[:-1] @ run.current_A[1:]), rel=1e-9)
    assert energy.relative_error < 1e-9


@pytest.mark.parametrize(("amperes", "peak_s"), [(5.0, 0.0), (9.0, 1.0)])
def test_the_overload_protection_is_not_called_the_current_limit(amperes: float, peak_s: float) -> None:
    """Demand below the peak: the peak never acts; above it: until the protection takes over after 1 s."""
    # thermal: x = (i/i_c)^2 (1 - exp(-t/tau)) reaches 1; tau from one second at three times i_c
    protected = {"peak_current_A": 6.0, "continuous_current_A": 2.0, "peak_time_s": 1.0}
    design = torque_drive(GAIN, 1e-3, voltage_V=inf, **protected)
    design = changed(design, friction={"dry_torque_Nm": 10.0})  # the rotor stays
    tau = 1.0 / np.log(9.0 / 8.0)
    ratio2 = (min(amperes, 6.0) / 2.0) ** 2
    until = tau * np.log(ratio2 / (ratio2 - 1.0))
    run = simulate(design, commands.step(amperes), 1.5 * until)
    assert run.limits["overload"].first_time_s == pytest.approx(until, rel=0.01)
    use = run.limits["current"]
    assert use.active is (peak_s > 0.0)
    assert use.fraction == pytest.approx(peak_s / (1.5 * until), rel=0.01)
    assert not (run.limit_active("current") & run.limit_active("overload")).any()


def test_noise_resolution_jitter_and_their_seeds() -> None:
    """A torque drive that is commanded 0 shows its measured current as -u over its gain."""
    design = torque_drive(GAIN, None, voltage_V=inf)
    ticks, noises = 20_000, [model.Instruments(current_noise_A=0.1, seed=s) for s in (3, 3, 4)]
    runs = [simulate(replace(design, instruments=one), commands.hold(), ticks * 1e-4) for one in noises]
    assert np.array_equal(runs[0].current_A, runs[1].current_A)
    assert not np.array_equal(runs[0].current_A, runs[2].current_A)
    noise = (-runs[0].voltage_V / GAIN - runs[0].current_A) / 0.1
    assert abs(noise.mean()) < 5.0 / sqrt(ticks)
    assert noise.std() == pytest.approx(1.0, abs=5.0 / sqrt(2 * ticks))
    assert abs(np.mean(noise[1:] * noise[:-1])) < 5.0 / sqrt(ticks)
    assert np.mean(noise**4) == pytest.approx(3.0, abs=5.0 * sqrt(96 / ticks))
    other = (-runs[2].voltage_V / GAIN - runs[2].current_A) / 0.1
    assert abs(np.mean(noise * other)) < 5.0 / sqrt(ticks)
    coarse = replace(design, instruments=model.Instruments(current_resolution_A=0.25))
    run = simulate(coarse, commands.sine(200.0, 5.0), 0.2)
    measured = run.reference_rad - run.voltage_V / GAIN
    assert np.abs(measured / 0.25 - np.round(measured / 0.25)).max() < 1e-9
    assert np.abs(measured - run.current_A).max() <= 0.125 + 1e-12
    # a source that cannot be felt, at constant speed: the position loop shows what it reads
    Ts, w, ticks = 1e-3, 40.0, 4000
    place = model.PositionLoop(gain=1.0)
    design = model.Design(
        name="coasting", title="", limits=model.Limits(voltage_V=inf), validation=AMBER.validation,
        motor=model.Motor(rotor_inertia_kgm2=1.0, source_gain_Nm_V=1e-15),
        controller=model.Controller(period_s=Ts, computing_delay_s=0.0, position=place),
    )  # fmt: skip
    start = State(motor_speed_rad_s=w)
    for instruments, rms in (
        (model.Instruments(jitter_s=1e-4), 1e-4 * w),
        (model.Instruments(angle_noise_rad=0.02), 0.02),
    ):
        run = simulate(replace(design, instruments=instruments), commands.hold(), ticks * Ts, initial=start)
        seen = -run.voltage_V - run.motor_angle_rad
        assert run.motor_angle_rad[-1] == pytest.approx(w * (ticks - 1) * Ts, rel=1e-9)
        assert seen.std() == pytest.approx(rms, rel=5.0 / sqrt(2 * ticks))
        assert abs(seen.mean()) < 5.0 * rms / sqrt(ticks)


def test_profile_keeps_its_limits_and_arrives() -> None:
    limits = model.Command(rate_rad_s=0.2, acceleration_rad_s2=4.0, jerk_rad_s3=200.0)
    T = AMBER.controller.period_s
    rng = np.random.default_rng(2)
    for jerk in (inf, 200.0):
        drive, seen, n = Drive(replace(AMBER, command=replace(limits, jerk_rad_s3=jerk))), [0.0], 8000
        wanted = np.repeat(np.append(rng.uniform(-0.05, 0.05, 4), 0.03), n)
        for value in wanted:
            drive.control(value, 0.0, 0.0, 0.0)
            seen.append(drive.value("reference") / AMBER.total_ratio)
        rate, second, third = (np.diff(seen, k) / T**k for k in (1, 2, 3))
        assert np.abs(rate).max() == pytest.approx(0.2, rel=1e-6)
        assert np.abs(second).max() == pytest.approx(4.0, rel=1e-5)
        assert seen[-1] == pytest.approx(0.03, rel=1e-12)
        for k in range(1, 6):  # each step is reached, without overshoot
            assert seen[k * n] == pytest.approx(wanted[k * n - 1], rel=1e-9)
            part = np.array(seen[(k - 1) * n : k * n + 1])
            low, high = sorted((part[0], part[-1]))
            assert low - 1e-12 <= part.min() <= part.max() <= high + 1e-12
        if jerk < inf:
            assert np.abs(third).max() < 200.0 * (1 + 1e-4)


def test_profile_leaves_a_command_within_its_limits_untouched_and_holds_that_of_a_speed() -> None:
    """A cosine from its crest, where the start keeps the limits as well."""
    slow = replace(AMBER, command=model.Command(rate_rad_s=0.06))
    shaped = replace(AMBER, command=model.Command(rate_rad_s=0.2, acceleration_rad_s2=4.0))
    ramp, wave = commands.ramp(0.05, 0.0, 0.2), commands.sine(0.005, 4.0, phase_rad=pi / 2)
    crest = State(motor_angle_rad=0.005 * AMBER.total_ratio)
    for design, command, begin in ((slow, ramp, State()), (shaped, wave, crest)):
        run, free = (simulate(one, command, 1.0, initial=begin) for one in (design, AMBER))
        assert np.array_equal(run.output_angle_rad, free.output_angle_rad)
        assert run.limits["profile"].fraction == 0.0
    assert simulate(shaped, commands.step(0.1), 0.3).limits["profile"].active
    design = changed(AMBER, friction=FREE, controller={"position": None})
    slow = replace(design, command=model.Command(acceleration_rad_s2=2.0))
    ramped = simulate(slow, commands.step(0.2), 0.3).speed_command_rad_s / AMBER.total_ratio
    assert np.diff(ramped).max() == pytest.approx(2.0 * AMBER.controller.period_s, rel=1e-9)
    assert ramped[-1] == pytest.approx(0.2, rel=1e-12)


def smooth(width: float = 1.0, **friction: float) -> Design:
    return changed(AMBER, friction={"law": "tanh", "smoothing_speed_rad_s": width, **friction})


def test_a_narrow_tanh_tends_to_coulomb_knows_no_rest_and_is_of_fourth_order() -> None:
    drives = (AMBER, *map(smooth, (4.0, 0.4, 0.04)))
    exact, *runs = (simulate(one, commands.sine(0.01, 2.0), 0.5, 8.0).output_angle_rad for one in drives)
    errors = [np.abs(run - exact).max() for run in runs]
    assert errors[1] < errors[0] / 5.0
    assert errors[2] < errors[1] / 5.0
    assert errors[2] < 2e-7
    run = simulate(smooth(), commands.hold(), 0.01)
    assert run.stick_fraction == 0.0
    assert simulate(AMBER, commands.hold(), 0.01).stick_fraction == 1.0
    # runs with 2**level sub-steps in every tick
    rows = Rows.of(smooth(2.0), 4)
    rows["ticks"], rows["tanh_level"] = 120, [7, 2, 3, 4]
    rows.sine("command", 0.002, 100.0)
    exact, *speeds = (rows.trajectory(k).motor_speed_rad_s for k in range(4))
    errors = [np.sqrt(np.mean((speed - exact) ** 2)) for speed in speeds]
    assert errors[-1] > 1e-9  # far from rounding
    orders = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    np.testing.assert_allclose(orders, 4.0, atol=0.15)


@pytest.mark.parametrize("tolerance", [1e-4, 1e-8])
def test_tanh_against_an_integrator(tolerance: float) -> None:
    design = smooth(1.0, dry_torque_reverse_Nm=4e-3, offset_torque_Nm=3e-4)
    ticks, Ts = 60, design.controller.period_s
    u = 0.4 * np.sin(0.35 * np.arange(ticks))
    probe = Probe(point="u", gain=0.0, injection=u)
    run = simulate(design, commands.hold(), ticks * Ts, probes=[probe], tanh_tolerance=tolerance)
    m, f, J = design.motor, design.friction, design.inertia_kgm2

    def rate(_: float, x: np.ndarray, voltage: float) -> list[float]:
        i, w, _th = x
        dry = (f.dry_torque_Nm if w >= 0 else f.dry_torque_reverse_Nm) * np.tanh(w / f.smoothing_speed_rad_s)
        torque = m.torque_constant_Nm_A * i - dry - f.viscous_Nms_rad * w - f.offset_torque_Nm
        back = m.back_emf_constant_Vs_rad * w
        return [(voltage - m.resistance_ohm * i - back) / m.inductance_H, torque / J, w]

    x, held = np.zeros(3), np.concatenate(([0.0], u))
    speeds = np.empty(ticks)
    for k in range(ticks):
        speeds[k] = x[1]
        x = solve_ivp(rate, (0.0, Ts), x, "DOP853", args=(held[k],), rtol=1e-12, atol=1e-13).y[:, -1]
    assert np.abs(speeds).max() > 10.0
    assert np.abs(run.motor_speed_rad_s - speeds).max() < 10.0 * tolerance * f.smoothing_speed_rad_s + 1e-9


def test_a_tick_adds_no_larger_an_error_than_its_tolerance_whatever_the_drive() -> None:
    """Bare motors over decades, from states in and beside the bend; against steps for a millionth of it."""
    rng, count, tolerance = np.random.default_rng(11), 300, 1e-6
    bare = replace(smooth().controller, position=None, velocity=None, current=None, computing_delay_s=0.0)
    rows = Rows.of(replace(smooth(), controller=bare, limits=Limits(voltage_V=math.inf)), count)
    exponents = {
        "inertia": (-7, -2), "period": (-5, -2.5), "smoothing": (-2, 1.5), "dry": (-5, 0),
        "resistance": (-1, 1), "torque_constant": (-2.5, 0), "viscous": (-7, -1.5),
    }  # fmt: skip
    drawn = {name: 10.0 ** rng.uniform(*ends, count) for name, ends in exponents.items()}
    k, R, dry = drawn["torque_constant"], drawn["resistance"], drawn["dry"]
    w = drawn["smoothing"] * rng.uniform(-1.0, 1.0, count) * 10.0 ** rng.uniform(-1.0, 1.5, count)
    current = dry / k * rng.standard_normal(count) * 10.0 ** rng.uniform(-1.0, 1.0, count)
    drawn |= {
        "back_emf": k, "dry_reverse": dry, "viscous_reverse": drawn["viscous"], "offset": 0.0,
        "inductance": R * 10.0 ** rng.uniform(-5.0, -1.5, count), "speed_start": w, "current_start": current,
        "ticks": 2,
    }  # fmt: skip
    for name, values in drawn.items():
        rows[name] = values
    rows.step("command", k * w + R * current * rng.uniform(-2.0, 2.0, count))
    found = []
    for allowed in (tolerance, 1e-6 * tolerance):
        rows["tanh_tolerance"] = allowed
        found.append(np.array([rows.trajectory(n).motor_speed_rad_s[1] for n in range(count)]))
    errors = np.abs(found[0] - found[1]) / drawn["smoothing"]
    assert errors.max() > 1e-3 * tolerance
    assert errors.max() < tolerance


def test_energies_of_a_steady_speed_which_asking_for_them_does_not_change() -> None:
    asked = AMBER, commands.ramp(600.0 / AMBER.total_ratio), 2.0, 8.0
    run, plain = (simulate(*asked, energy=each) for each in (True, False))
    assert plain.energy is None
    assert np.array_equal(run.motor_angle_rad, plain.motor_angle_rad)
    energy, turned = run.energy, run.final.motor_angle_rad
    assert energy.dry_friction_J == pytest.approx((2.25e-3 + 8 * 1.34e-3) * turned, rel=1e-9)
    assert energy.kinetic_J == pytest.approx(0.5 * AMBER.inertia_kgm2 * run.final.motor_speed_rad_s**2)


def points() -> list[float]:
    """Over all sizes, and on both sides of every border between two cells of the table."""
    rng = np.random.default_rng(5)
    borders = (np.arange(int(LAST * STEPS)) + 0.5) / STEPS
    sides = [np.nextafter(borders, 0.0), borders, np.nextafter(borders, np.inf)]
    drawn = [rng.uniform(0.0, 20.0, 4000), 2.0 ** rng.uniform(-60.0, 4.5, 4000)]
    return np.concatenate([*drawn, *sides]).tolist()


def test_it_is_within_an_ulp_of_the_hyperbolic_tangent_odd_and_rising() -> None:
    with mpmath.workprec(140):
        for x in points():
            exact = mpmath.tanh(x)
            assert abs(tanh(x) - exact) < 1.1 * math.ulp(float(exact)), x
    values = [tanh(x) for x in sorted(points())]
    assert all(after - before > -1.2e-16 for before, after in itertools.pairwise(values))  # an ulp
    assert all(tanh(-x) == -tanh(x) for x in points())
    assert all(tanh(x) == x for x in (0.0, 5e-324, 2.2e-308, 1e-8))
    assert math.copysign(1.0, tanh(-0.0)) == -1.0
    assert tanh(LAST) == tanh(1e308) == tanh(math.inf) == -tanh(-math.inf) == 1.0
    assert math.isnan(tanh(math.nan))


@pytest.mark.skipif(sys.platform != "linux" or shutil.which("gcc") is None, reason="asks gcc of Linux")
@pytest.mark.parametrize("precision", ["double", "single"])
def test_compiled_it_asks_no_library_and_has_the_bits_as_written(precision: str, tmp_path) -> None:
    text, number = emit_c({tanh: ("float",)}).source, ctypes.c_double
    if precision == "single":
        text, number = single(text), ctypes.c_float
    (tmp_path / "own.c").write_text(text)
    flags = ("-std=c99", "-O3", "-ffp-contract=off", "-shared", "-fPIC", "-nostdlib", "-Wl,-z,defs")
    subprocess.run(["gcc", *flags, "own.c", "-o", "own.so"], check=True, cwd=tmp_path)
    compiled = ctypes.CDLL(str(tmp_path / "own.so")).drive_tanh
    compiled.argtypes, compiled.restype = [number], number
    if precision == "double":
        assert [compiled(x).hex() for x in points()] == [tanh(x).hex() for x in points()]
    for x in points():
        assert compiled(x) == pytest.approx(tanh(x), rel=3e-7)
