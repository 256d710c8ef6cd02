"""Loops at zero frequency: a spring or pendulum, a free rotor; what cancels there is known so."""

import warnings
from dataclasses import replace
from itertools import product
from typing import Any

import control
import numpy as np
import pytest
from flint import acb, acb_mat, ctx
from loop_designs import controlled, sprung
from mpmath import expm, lu_solve, mp, zeros

from actuator_lti import closed_loop_bandwidth, load_design, stability_margins, step_figures
from actuator_lti.batch import Population, linear_figures
from actuator_lti.design import model
from actuator_lti.drive.operating import Operating
from actuator_lti.drive.wiring import wire
from actuator_lti.loops import assemble_loops, exact_margins
from actuator_lti.loops.periodic import cyclic, fundamental, point_blocks
from actuator_lti.loops.sampled import stage_blocks
from actuator_lti.loops.tick import Block
from actuator_lti.systems.rest_mode import without_rest_mode
from nonlinear.bench.operating_motion import on_its_stand, on_the_bench
from tests.changed import changed
from tests.validation.random_drives import full_drive

TICK = 1e-4
SLOPES = (-6000.0, -100.0, -0.1, 50.0)
FORMS = ("sampled", "ideal", "continuous")
WEAK = (-1e-14, -1e-10, -1e-6, -1e-2, 1e-14, 1e-10, 1e-6)
CURRENT = {"current": model.CurrentLoop(gain_V_A=0.5, integral_time_s=1e-3)}


def at_rest(design: Any) -> float:
    """L(0) of the velocity loop, Kp/Tn kM/k: a ramp of the PI's torque is a ramp of the spring's angle."""
    law, motor = design.controller.velocity, design.effective_motor
    stiffness = -design.load.moment_slope_Nm_rad / design.total_ratio**2
    return law.gain / law.integral_time_s * motor.torque_constant_Nm_A / stiffness


@pytest.mark.parametrize(("form", "slope"), [*product(FORMS, SLOPES), *(("sampled", weak) for weak in WEAK)])
def test_the_velocity_loop_has_the_gain_at_zero_that_the_spring_gives(form: Any, slope: float) -> None:
    design = sprung("ilr33-amber", slope)
    loop, L0 = assemble_loops(design, form=form).velocity, at_rest(design)
    m = stability_margins(loop.open_loop)
    assert m.evidence in ("checked", "certified")
    assert m.stable is True
    # of the loop without a spring; its crossover lies far above the spring's frequency
    bare = stability_margins(assemble_loops("ilr33-amber", form=form).velocity.open_loop)
    assert m.phase_margin_deg == pytest.approx(bare.phase_margin_deg, abs=0.02)
    upper = [g.db for g in m.gain_margins if g.frequency_rad_s > 0.0]
    assert upper == pytest.approx([g.db for g in bare.gain_margins if g.frequency_rad_s > 0.0], abs=0.01)
    lower = [g.ratio for g in m.gain_margins if g.frequency_rad_s == 0.0]
    assert lower == pytest.approx([-1.0 / L0] if -1e10 < L0 < 0.0 else [])  # none beyond 200 dB is listed
    width = closed_loop_bandwidth(loop.closed_loop)
    assert width.dc_gain == pytest.approx(L0 / (1.0 + L0), rel=1e-6)
    assert 0.0 < width.resonance_peak_db < 2.0
    if form != "continuous":
        assert step_figures(loop.closed_loop).final_value == pytest.approx(L0 / (1.0 + L0), rel=1e-6)


@pytest.mark.parametrize("seed", [90_004, 90_006, 1_301_202])
def test_a_mode_is_taken_out_over_its_largest_part(seed: int) -> None:
    """All states at 60 digits: over the integrator that is 1e-9 of the mode the response is 2e-4 off."""
    wired = wire(on_its_stand(on_the_bench(full_drive(seed))), Operating())
    whole = fundamental(point_blocks(wired, "i_ref"))
    shown = whole.shown()
    assert len(shown.states) == len(whole.states) - 1
    for x in np.exp(1j * np.geomspace(1e-5, 3.0, 12)):
        after = shown.C @ np.linalg.solve(x * np.eye(len(shown.A)) - shown.feedback().A, shown.B)
        assert after[0, 0] == pytest.approx(closed_exactly(whole, x), rel=1e-9)


def closed_exactly(block: Block, x: complex) -> complex:
    """L/(1 + L) at z = x from the matrices as they stand, at 60 digits."""
    with ctx.workprec(200):
        A, B, C, one = (acb_mat(part.tolist()) for part in (block.A, block.B, block.C, np.eye(len(block.A))))
        return complex((C * (acb(x) * one - A + B * C).solve(B))[0, 0])


@pytest.mark.parametrize("soft", [1e-2, 1e-4, 1e-6])
def test_a_spring_far_softer_than_the_load_keeps_its_digits(soft: float) -> None:
    """A PI on the voltage, its speed from the output: the two-mass equations, continuous and sampled.

    The motor turns up to 1e9 rad for a unit of the integral that holds the load: taken out over that, the
    response was 2000 times itself.
    """
    drive = controlled(sprung("ilr33-amber-compliant", -1e4, friction=None), current=None)
    drive = controlled(drive, velocity={"sensor": "output"})
    parts = {"coupling": {"stiffness_Nm_rad": 1500.0 * soft, "damping_Nms_rad": 0.0}}
    drive = changed(replace(drive, friction=model.Friction(viscous_Nms_rad=5e-6)), **parts)
    plain = assemble_loops(drive, form="ideal").velocity.open_loop
    for s in 1j * np.geomspace(1.0, 3e3, 8):
        assert plain(s) == pytest.approx(two_mass_loop(drive, s), rel=1e-6)
    shown = fundamental(stage_blocks(wire(drive, Operating()), "velocity")).shown()
    for x in np.exp(1j * np.geomspace(1e-4, 3.0, 8)):
        after = shown.C @ np.linalg.solve(x * np.eye(len(shown.A)) - shown.A, shown.B)
        assert after[0, 0] == pytest.approx(two_masses_sampled(drive, x), rel=1e-5)


def two_mass_loop(design: Any, s: complex) -> complex:
    """K (1 + 1/(Tn s)) times the speed behind the spring, in motor turns, of a volt."""
    law, motor, k = design.controller.velocity, design.effective_motor, design.coupling.stiffness_Nm_rad
    N, cut = design.total_ratio, design.friction.viscous_Nms_rad
    passed = k / N / (design.load_side_inertia_kgm2 * s**2 + k - design.load.moment_slope_Nm_rad)
    felt = design.motor_side_inertia_kgm2 * s**2 + cut * s + k / N * (1.0 / N - passed)  # N m a radian
    volts = (motor.inductance_H * s + motor.resistance_ohm) * felt / motor.torque_constant_Nm_A
    speed = N * passed * s / (volts + motor.back_emf_constant_Vs_rad * s)
    return law.gain * (1.0 + 1.0 / (law.integral_time_s * s)) * speed


def two_masses_sampled(design: Any, x: complex) -> complex:
    """The same at z = x, at 60 digits: volts a tick late, the moment held over a tick (model.md, 6)."""
    law, motor = design.controller.velocity, design.effective_motor
    L, J, J_load = motor.inductance_H, design.motor_side_inertia_kgm2, design.load_side_inertia_kgm2
    with mp.workdps(60):
        k, N, T = (mp.mpf(v) for v in (design.coupling.stiffness_Nm_rad, design.total_ratio, TICK))
        A, z = zeros(7), mp.mpmathify(x)  # i, w, th, W, phi; volts, moment
        A[0, 0], A[0, 1] = -mp.mpf(motor.resistance_ohm) / L, -mp.mpf(motor.back_emf_constant_Vs_rad) / L
        A[1, 0], A[1, 1] = (
            mp.mpf(motor.torque_constant_Nm_A) / J,
            -mp.mpf(design.friction.viscous_Nms_rad) / J,
        )
        A[1, 2], A[1, 4], A[3, 2], A[3, 4] = -k / N**2 / J, k / N / J, k / N / J_load, -k / J_load
        A[0, 5], A[3, 6] = 1 / mp.mpf(L), 1 / mp.mpf(J_load)
        A[2, 1] = A[4, 3] = 1
        tick = expm(A * T)
        F, slope = tick[:5, :5], mp.mpf(design.load.moment_slope_Nm_rad)
        F[:, 4] += tick[:5, 6] * slope
        states = lu_solve(z * mp.eye(5) - F, tick[:5, 5] / z)
        integral = T / mp.mpf(law.integral_time_s) * z / (z - 1)
        return complex(law.gain * (1 + integral) * N * states[3])


@pytest.mark.parametrize("every", [2, 4, 8])
def test_a_mode_at_rest_that_moves_from_tick_to_tick_is_taken_out(every: int) -> None:
    """A rotor without friction, its back-EMF fed forward from a slower speed: no current shows its speed.

    The angle it gains between two measurements belongs to the mode and begins anew with each. Truth is the
    closed loop over a whole period with the mode in it, the eigenvalue at 1 that stays.
    """
    stages = {"current": {"back_emf_feedforward": 1.0}, "velocity": {"gain": 0.02, "every": every}}
    parts = {"friction": model.Friction(), "encoder": {"speed": "difference"}}
    parts["controller"] = {**stages, "position": {"every": every}}
    drive = changed(load_design("ilr33-amber-multirate"), **parts)
    blocks = stage_blocks(wire(drive, Operating()), "current")
    over = np.linalg.multi_dot([np.eye(len(blocks[0].A)), *(b.feedback().A for b in reversed(blocks))])
    modes = np.linalg.eigvals(over)
    at_rest = np.abs(modes - 1.0) < 1e-9
    assert at_rest.sum() == 2  # and the angle itself
    assert np.abs(modes[~at_rest]).max() < 1.0
    loop = assemble_loops(drive).current
    m = stability_margins(loop.open_loop)
    assert m.stable is True
    assert m.evidence in ("checked", "certified")
    gain = drive.controller.current.gain_V_A
    many = linear_figures(Population(drive, {"control.current.gain": np.array([1.2, 1.0]) * gain}, 2))
    assert many.stable("current").all()
    assert many.quantity("phase_margin", "current")[1] == pytest.approx(m.phase_margin_deg, rel=1e-9)
    whole = cyclic([b.feedback() for b in blocks])
    open_again = replace(whole, A=whole.A + whole.B @ whole.C)
    for x in np.exp(1j * np.array([1e-3, 0.1, 3.0])):
        truth = closed_exactly(open_again, x)
        assert loop.closed_loop(x) == pytest.approx(truth, rel=1e-9)


def test_a_soft_spring_is_no_mode_at_rest() -> None:
    """Time constants of 1e9 ticks and more, in closed form from the equations of motor and PI at 60 digits.

    The integral moves by 6e-12 a period where it holds the spring: a rest once, and margins 1.7 deg apart.
    Four ulp of an entry near one are 3e-4 of the slowest motion, 2.6e-12: no more of it is determined.
    """
    known = 4.0 * np.finfo(float).eps / 2.6e-12
    design = full_drive(2_100_068)
    loops = assemble_loops(on_its_stand(on_the_bench(design)))
    period_s = 10.0 * design.controller.period_s
    with mp.workdps(60):
        for loop in (loops.position.open_loop, loops.break_points["u"].open_loop):
            for omega in (1.17e-6, 5e-6, 1.0):
                exact = complex(slow_loop(design, mp.expj(omega * mp.mpf(period_s))))
                assert loop(np.exp(1j * omega * period_s)) == pytest.approx(exact, rel=known)
        slowest = mp.findroot(lambda change: 1 / slow_loop(design, 1 + change) + 1, -2.6e-12)
    found = exact_margins(loops, "u")
    assert found.delay_s == np.inf
    assert found.spectral_radius - 1.0 == pytest.approx(float(slowest), rel=1e-3)


def slow_loop(design: Any, z: Any) -> Any:
    """L of a PI on the voltage every 10 ticks, one tick late; a spring's torque is held over a tick."""
    motor, place, N = design.effective_motor, design.controller.position, mp.mpf(design.total_ratio)
    R, L, k = (mp.mpf(x) for x in (motor.resistance_ohm, motor.inductance_H, motor.torque_constant_Nm_A))
    J, T = mp.mpf(motor.rotor_inertia_kgm2) + design.load.inertia_kgm2 / N**2, design.controller.period_s
    rates = mp.matrix(5, 5)  # of current, speed, angle under voltage and torque
    rates[0, :4] = mp.matrix([[-R / L, -k / L, 0, 1 / L]])
    rates[1, :] = mp.matrix([[k / J, -mp.mpf(design.friction.viscous_Nms_rad) / J, 0, 0, 1 / J]])
    rates[2, 1] = 1
    held = mp.expm(rates * T)
    tick, voltage = held[:3, :3], held[:3, 3]
    tick[:, 2] += held[:3, 4] * design.load.moment_slope_Nm_rad / N**2
    later = mp.matrix(3, 1)
    for _ in range(9):
        later = tick * later + voltage
    moved = mp.lu_solve(z * mp.eye(3) - tick**10, later + tick**9 * voltage / z)
    return moved[2] * place.gain * (1 + 10 * T / mp.mpf(place.integral_time_s) * z / (z - 1))


@pytest.mark.parametrize("slope", [-6000.0, -100.0])
def test_a_users_own_loop_of_that_kind_has_its_bandwidth(slope: float) -> None:
    """Closed by hand from the matrices with the hidden mode in them: no resonance of 6000 dB at 0 Hz."""
    design = sprung("ilr33-amber", slope)
    block = fundamental(stage_blocks(wire(design, Operating()), "velocity")).feedback()
    T = control.StateSpace(block.A, block.B, block.C, block.D, 1e-4, remove_useless_states=False)
    width = closed_loop_bandwidth(T)
    expected = closed_loop_bandwidth(assemble_loops(design).velocity.closed_loop)
    assert width.minus3db_rad_s == pytest.approx(expected.minus3db_rad_s, rel=1e-9)
    assert width.resonance_peak_db == pytest.approx(expected.resonance_peak_db, rel=1e-9)
    grid = np.geomspace(1.0, 1e4, 4000)
    gain, L0 = np.abs(T(np.exp(1j * grid * 1e-4))), at_rest(design)
    assert width.resonance_peak_db == pytest.approx(20 * np.log10(gain.max() * (1 + L0) / L0), abs=1e-4)


@pytest.mark.parametrize("seed", range(8))
def test_nothing_else_is_taken_out(seed: int) -> None:
    """Random loops with an integrator that the output sees, by as little as 1e-9, keep every state."""
    rng = np.random.default_rng([seed, 3])
    n = int(rng.integers(2, 7))
    A = rng.normal(size=(n, n)) * 0.2
    A[0] = 0.0
    A[0, 0] = 1.0
    B, C = rng.normal(size=(n, 1)), rng.normal(size=(1, n))
    C[0, 0] += 10.0 ** -rng.uniform(0, 9)
    assert without_rest_mode(A, B, C, 1.0)[3].all()
    hidden = np.linalg.solve(np.eye(n - 1) - A[1:, 1:], A[1:, 0])
    C[0, 0] = -C[0, 1:] @ hidden  # now it does not
    assert not without_rest_mode(A, B, C, 1.0)[3].all()


def test_a_drive_that_hides_no_mode_is_told_at_one_look(monkeypatch) -> None:
    """A solution for each state of each of its systems was half the time of its loops."""
    monkeypatch.setattr("actuator_lti.systems.rest_mode._at_rest", lambda *_: pytest.fail("asked of a state"))
    assert len(assemble_loops("ilr33-amber-multirate").present) == 3


def test_both_sides_and_values_that_are_not_finite() -> None:
    A = np.array([[1.0, 0.0, 0.5], [0.0, 0.3, 0.2], [0.0, 0.1, 0.4]])  # fed by the third state: the dual
    B = np.array([[0.0], [1.0], [0.0]])
    B[0, 0] = -0.5 * np.linalg.solve(np.eye(2) - A[1:, 1:], B[1:])[1, 0]
    C = np.array([[1.0, 0.7, 0.0]])
    a, b, c, kept = without_rest_mode(A, B, C, 1.0)
    assert kept.tolist() == [False, True, True]
    z = 0.3 + 0.9j
    before = (C @ np.linalg.solve(z * np.eye(3) - A, B))[0, 0]
    assert (c @ np.linalg.solve(z * np.eye(2) - a, b))[0, 0] == pytest.approx(before, rel=1e-12)
    assert without_rest_mode(A * np.nan, B, C, 1.0)[3].all()


@pytest.mark.parametrize("slope", SLOPES)
def test_the_mode_at_rest_is_no_border_of_stability(slope: float) -> None:
    """Eigenvalues at 1 + 1e-16 whatever the gain; certified margins of the loop say where the border is."""
    design = sprung("ilr33-amber", slope)
    design = controlled(design, position=None)
    loops = assemble_loops(design)
    exact = exact_margins(loops, "u")
    certified = stability_margins(loops.break_points["u"].open_loop, certify=True)
    assert exact.stable is certified.stable
    if not exact.stable:
        return
    above = [one.ratio for one in certified.gain_margins if one.ratio > 1.0]
    below = [one.ratio for one in certified.gain_margins if 1e-4 < one.ratio < 1.0]  # so far it looks
    assert exact.gain_upper == pytest.approx(min(above, default=np.inf), rel=1e-9)
    assert exact.gain_lower == pytest.approx(max(below, default=0.0), rel=1e-9)


def servo(gain: float = 0.02, **stages: Any) -> model.Design:
    """Of radio control, without viscous friction; P loops of speed and position."""
    constants = {"torque_constant_Nm_A": 6e-3, "back_emf_constant_Vs_rad": 6e-3}
    stages |= {"velocity": model.VelocityLoop(gain=gain, integral_time_s=None)}
    stages |= {"position": model.PositionLoop(gain=30.0)}
    return model.Design(
        name="rc",
        motor=model.Motor(rotor_inertia_kgm2=1.2e-7, resistance_ohm=2.1, inductance_H=2.5e-4, **constants),
        friction=model.Friction(dry_torque_Nm=3e-4),
        gears=(model.Gear(name="spur", ratio=200.0),),
        limits=model.Limits(voltage_V=7.4),
        controller=model.Controller(period_s=5e-4, computing_delay_s=1e-4, **stages),
        validation=model.Validation(full_deflection_rad=0.5),
    )


@pytest.mark.parametrize("form", ["sampled", "continuous", "ideal"])
@pytest.mark.parametrize("stages", [CURRENT, {}])
def test_a_servo_without_viscous_friction_is_stable_in_every_form(form: Any, stages: dict[str, Any]) -> None:
    """The pole of the PI at zero lies on the zero of the plant; neither overflows on the way."""
    loops = assemble_loops(servo(**stages), form=form)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for loop in (loops.current, loops.velocity, loops.position):
            if loop is not None:
                result = stability_margins(loop.open_loop, certify=True)
                assert (result.stable, result.evidence) == (True, "certified")


@pytest.mark.parametrize("certify", [False, True])
def test_a_gain_of_one_at_rest_has_its_distances(certify: bool) -> None:
    """Velocity gain kE on a free rotor: L(0) = 1, where the disk margin's criterion has its pole.

    Whether |L| crosses one beside zero frequency is a question for exact roots, asked or not.
    """
    loop = assemble_loops(servo(6e-3), form="continuous").velocity
    result = stability_margins(loop.open_loop, certify=certify)
    assert result.stable is True
    assert result.evidence == ("certified" if certify else "checked")
    assert certify or "zeros and poles certified" in result.evidence_reason
    assert result.phase_margins == ()  # |L| starts at one and falls
    grid = 1j * np.geomspace(1.0, 1e5, 20_001)
    L = loop.open_loop(grid)
    assert result.modulus_margin == pytest.approx(np.abs(1.0 + L).min(), rel=1e-5)
    assert result.disk_margin.alpha == pytest.approx((2.0 * np.abs((1.0 + L) / (1.0 - L))).min(), rel=1e-5)


@pytest.mark.parametrize("slope", [-0.1, 0.1, 5.0, 50.0])
def test_a_weak_spring_is_told_from_none(slope: float) -> None:
    """Closed at the current only, the motor is held by the spring alone: unstable where that drives."""
    loops = assemble_loops(sprung("ilr33-amber", slope), form="continuous")
    assert stability_margins(loops.current.open_loop).stable is (slope < 0.0)
    assert stability_margins(loops.velocity.open_loop).stable is True


def test_the_gain_at_rest_of_a_current_loop_on_a_free_rotor() -> None:
    """L(0) = Kp/Tn J/(kM kE): at constant current the ramp of the PI is one of the back-EMF."""
    loop = assemble_loops(servo(**CURRENT), form="continuous").current
    at_rest = 0.5 / 1e-3 * 1.2e-7 / 6e-3**2
    dc_gain = closed_loop_bandwidth(loop.closed_loop).dc_gain
    assert dc_gain == pytest.approx(at_rest / (1.0 + at_rest), rel=1e-9)


@pytest.mark.parametrize("slope", [-40.0, -0.1, 50.0])
def test_a_slow_pole_behind_two_integrators_is_no_turn_of_the_delay(slope: float) -> None:
    """Cut at the voltage L falls by 25 decades before it crosses one: by its factors or exactly."""
    cuts = assemble_loops(sprung("ilr33-amber", slope), form="continuous").break_points
    result = stability_margins(cuts["u"].open_loop)
    assert result.evidence in ("checked", "certified")
    assert result.stable is stability_margins(cuts["w_ref"].open_loop).stable  # the same closed-loop poles
    w = np.concatenate((np.geomspace(1e-6, 99.0, 500), np.geomspace(1e2, 1e5, 3_001)))
    L = np.array([cuts["u"].open_loop(1j * x) for x in w]).ravel()
    gain = np.flatnonzero((np.abs(L[1:]) > 1.0) != (np.abs(L[:-1]) > 1.0))
    assert [p.frequency_rad_s for p in result.phase_margins] == pytest.approx(w[gain], rel=3e-3)
    assert result.phase_margin_deg == pytest.approx(np.degrees(np.angle(-L[gain[0]])), abs=0.2)
    real = np.flatnonzero(((L[1:].imag > 0.0) != (L[:-1].imag > 0.0)) & (L[1:].real < 0.0))
    listed = [g for g in result.gain_margins if 0.0 < g.frequency_rad_s < 1e5]
    assert [g.frequency_rad_s for g in listed] == pytest.approx(w[real][np.abs(L[real]) > 0.01], rel=3e-3)
    assert result.modulus_margin == pytest.approx(np.abs(1.0 + L).min(), rel=1e-4)
