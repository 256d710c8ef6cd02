"""Energy in balance, symmetry, scaling, the smoothed friction law; its hyperbolic tangent to forty digits."""

import ctypes
import itertools
import math
import shutil
import subprocess
import sys
from dataclasses import replace

import mpmath
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from actuator_lti import load_design
from actuator_lti.compiled.program import emit_c
from actuator_lti.design.model import Design, Limits
from nonlinear import Probe, Rows, commands, simulate
from nonlinear._kernels.hyperbolic import LAST, STEPS, tanh
from nonlinear.export.program import single
from tests.changed import changed

AMBER = load_design("ilr33-amber")


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
