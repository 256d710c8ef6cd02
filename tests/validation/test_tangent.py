"""The simulator's derivative against the linear writing, which shares no code with it, and closed forms."""

from dataclasses import replace

import numpy as np
import pytest

from actuator_lti import InputError, stability_margins
from actuator_lti.asked.verdict import Verdict
from actuator_lti.design import Design, load_design, shipped_designs
from actuator_lti.design.law import LAW_WORDS
from actuator_lti.drive.wiring import wire
from actuator_lti.loops import Loops, assemble_loops, exact_margins, periodic_loop
from analyses.validation import CHECKS, validate
from analyses.validation.in_time import bench_sweep
from analyses.validation.places import Bench
from analyses.validation.small_signal import nearest_pole, small_signal
from nonlinear import tangent
from nonlinear.bench import operating_motion as motions
from nonlinear.bench.lifted import GRID, relative
from nonlinear.bench.operating_motion import on_its_stand, on_the_bench, operating_motion
from tests.changed import changed
from tests.loops.own_laws import random_law
from tests.validation.random_drives import full_drive

Z = np.exp(1j * GRID)
JOINT = load_design("joint")
RANDOM = range(300_000, 300_030)
FAILED_ONCE = [710_132, 710_235, 710_141, 710_248, 710_259, 710_265, 710_301, 730_011, 730_035, 740_026,
               741_646, 90_006, 770_155, 910_883, 1_010_043,
               1_010_057, 1_101_223, 1_101_436, 1_102_029, 1_102_211, 1_301_202, 2_100_068,
               5_300_352, 1_211_006, 1_211_041]  # fmt: skip


def stood(design: Design) -> tuple[Design, Loops]:
    """A drive on the bench, and its linear loops on the same motion."""
    bench = on_its_stand(on_the_bench(design))
    at = operating_motion(bench).operating(bench)
    return bench, assemble_loops(bench, operating_point=at.point, speed_rad_s=at.speed_rad_s)


def predicted(bench: Design, loops: Loops, place: str) -> np.ndarray:
    if place == "current":
        return np.asarray(assemble_loops(bench, rotor="locked").current.plain_closed(Z))
    if place in wire(bench).stages:
        return np.asarray(loops.present[place].plain_closed(Z))
    return periodic_loop(loops, place).closed(Z)


@pytest.mark.parametrize("drive", [*shipped_designs(), *RANDOM])
def test_every_loop_and_break_point_is_that_of_the_linear_writing(drive: str | int) -> None:
    """Random drives with play, gravity, maps, filters, sensors, rates, unstable; shipped ones to 1e-7."""
    shipped = isinstance(drive, str)
    try:
        bench, loops = stood(load_design(drive) if shipped else full_drive(drive))
    except InputError:
        assert not shipped
        pytest.skip("no steady motion within the limits")
    for place in (*wire(bench).stages, *wire(bench).points):
        found = tangent(bench, place)
        assert found.stated_error <= 1e-7 or not shipped, place
        off = relative(found.closed(Z), predicted(bench, loops, place))
        assert np.max(off) <= max(1e-6, 10.0 * found.stated_error), place


def test_python_control_draws_it() -> None:
    found, w = tangent("ilr33-amber", "velocity"), 300.0
    assert (found.system.nstates, found.system.dt) == (len(found.states), found.period_s)
    response = found.system(np.exp(1j * w * found.period_s))
    assert response == pytest.approx(found.closed(np.exp(1j * w * found.hold_s)))


@pytest.mark.parametrize("seed", FAILED_ONCE)
def test_drives_that_failed_once(seed: int) -> None:
    """Slow poles beside 1, modes at rest, figures of roundings; gains beyond 200 dB are not listed."""
    result = validate(full_drive(seed), CHECKS)
    assert result.passed, [str(row) for row in result.not_met]
    assert all(row.verdict == Verdict.MET for row in result.rows)
    assert all(row.predicted > 1e-10 for row in result.rows if row.name == "gain_margin")


def test_a_slow_pole_is_judged_by_its_own_error() -> None:
    """One drive has the same poles wherever it is cut: two tangents say how well each knows the slow one."""
    drive = full_drive(1_500_687)
    bench = Bench(drive, drive)
    places = [bench.place(name) for name in ("position", "u")]
    slow = complex(max(places[0].poles, key=abs))
    seen = [nearest_pole(place.tangent.A, slow) for place in places]
    assert abs(seen[1] - seen[0]) > 1e-6 * abs(np.log(slow))  # more than is allowed of a pole that is known
    assert places[1].tangent.stated_error < 1e-7  # of the response at that place, which hardly has it
    rows = [row for place in places for row in small_signal(place) if row.name == "poles"]
    assert all(row.verdict != Verdict.NOT_MET for row in rows)
    assert rows[1].allowed > abs(seen[1] - seen[0])


@pytest.mark.parametrize("integral_time_s", [None, 0.3])
def test_a_standing_drive_stands_where_its_cogging_is_taken(integral_time_s: float | None) -> None:
    """A law fed with a pressed twist asks for a speed: the motor stood off by an error, 0.4 % in a slope."""
    plain = changed(
        load_design("ilr33-amber-compliant"),
        motor={"cogging_Nm": 2e-3, "cogging_periods": 5.0},
        controller={"position": {"integral_time_s": integral_time_s}},
        requirements=(),
    )
    gain = plain.controller.velocity.gain
    law = ([], [], [], [[gain, -20.0 * gain]], plain.controller.period_of("velocity"))
    bench, loops = stood(plain.with_law("velocity", law, ["error", "twist"]))
    for place in ("position", "u", "output"):
        off = relative(tangent(bench, place).closed(Z), predicted(bench, loops, place))
        assert np.max(off) <= 1e-7, place


@pytest.mark.parametrize("speed", ["difference", "tracking"])
def test_a_speed_made_of_the_output_s_angle_is_none_behind_a_twisted_spring(speed: str) -> None:
    """The sensor saw the output where it stands, off the motor by the twist: a jump was 10 % off."""
    band = {"bandwidth_rad_s": 300.0} if speed == "tracking" else {}
    design = changed(
        load_design("ilr33-amber-compliant"),
        motor={"cogging_Nm": 4e-3, "cogging_periods": 5.0},
        controller={"velocity": {"sensor": "output", "every": 8}, "position": {"every": 8}},
        encoder={"speed": speed, **band},
    )
    bench, loops = stood(design)
    for place in ("position", "u"):
        off = relative(tangent(bench, place).closed(Z), predicted(bench, loops, place))
        assert np.max(off) <= 1e-7, place


def test_a_locked_rotor_moves_no_angle() -> None:
    """The law sees an angle that stands: of it, however slow, the loop is that of the law on the error."""
    base, T = load_design("ilr33-amber"), load_design("ilr33-amber").controller.period_s
    own, other = (
        tangent(base.with_law("current", ([], [], [], [[0.02, *more]], T), ["error", *names]), "current")
        for more, names in (((), ()), ((-5e3,), ("angle",)))
    )
    z = np.exp(1j * np.array([1e-12, 1e-9, 1e-6, 1e-3, 1.0]))
    assert other.closed(z) == pytest.approx(own.closed(z), rel=1e-9)


def test_a_pole_that_passes_one_beside_another_slow_one_is_known_by_the_response_there() -> None:
    """Poles 1e-6 apart, of which rounding leaves 1e-11: the gain at which one of them passes is 1/T(1)."""
    design = random_law(np.random.default_rng([6_000_153, 0]), full_drive(6_000_153), "position", stable=True,
                        words=LAW_WORDS)  # fmt: skip
    rows = small_signal(Bench(design, design).place("output"))
    assert any("; pole beside" in row.because and row.because.startswith("0 Hz") for row in rows)
    assert all(row.verdict is Verdict.MET for row in rows)


NOT_PROVEN_ONCE = {
    730_131: ("command", "load"), 730_124: ("position", "w_ref", "command"), 720_019: ("velocity", "i_ref"),
    240: ("command", "load"), 800_742: ("u",), 1_010_199: ("position", "i_ref"),
    1_010_254: ("w_ref", "i_ref"), 1_010_187: ("velocity", "u", "output", "command"),
    1_500_430: ("velocity", "load"), 1_400_122: ("command",), 1_400_214: ("velocity",),
    1_400_330: ("position", "output"), 1_400_195: ("command",), 1_500_506: ("velocity",),
    1_500_082: ("velocity",), 1_700_648: ("position", "command"),
}  # fmt: skip


@pytest.mark.parametrize("seed", NOT_PROVEN_ONCE)
def test_drives_that_were_not_proven_once(seed: int) -> None:
    """Steps that are large beside cogging or tanh, or lost beside a large angle or speed.

    Couplings pressed by next to nothing (240, 1 500 430, 1 400 122, 1 700 648); rests that an integral and a
    hanging load hold (1 500 506, 1 500 082); a pole at 0 Hz beside a mode at rest (800 742).
    """
    design = full_drive(seed)
    bench = Bench(design, design)
    for name in NOT_PROVEN_ONCE[seed]:
        assert {row.verdict for row in small_signal(bench.place(name))} == {Verdict.MET}, name


def test_a_moving_drive_is_pressed_at_no_cost_to_its_motor() -> None:
    """The coupling of a seed of which its rating presses 9e-5 of the play; a torque at the shaft holds it."""
    drive = on_its_stand(on_the_bench(full_drive(1_700_648)))
    coupling, motion = drive.coupling, operating_motion(drive)
    plain = motions.operating_motion_at(drive, motion.speed_rad_s, motion.load_Nm)
    assert motion.speed_rad_s > 0.0
    past_rad = abs(motion.twist_rad) - 0.5 * coupling.play_rad
    assert past_rad == pytest.approx(0.01 * coupling.play_rad, rel=1e-9)
    assert motion.coupling_Nm == pytest.approx(coupling.stiffness_Nm_rad * past_rad, rel=1e-9)
    torque_Nm = drive.effective_motor.torque_constant_Nm_A * (plain.current_A - motion.current_A)
    assert motion.extra_Nm == pytest.approx(torque_Nm, rel=1e-9)
    assert abs(motion.current_A) < 0.4 * drive.limits.peak_current_A < abs(plain.current_A)


def test_a_rest_that_an_integral_holds_is_no_border_under_any_delay() -> None:
    """Under parts of a tick rounding kept its mode at 1; the certified loop has no crossover at all."""
    loops = assemble_loops(full_drive(1_101_436))
    certified = stability_margins(loops.break_points["u"].open_loop, certify=True)
    assert certified.stable
    assert not certified.delay_margins
    assert exact_margins(loops, "u").delay_s == np.inf


def test_a_margin_at_rest_is_proven_as_far_as_it_is_resolved() -> None:
    """A P current loop feeds 0.8 of the back-EMF forward: at 1/0.8 the speed is an integrator, exactly.

    Its pole is at 1 - 2.7e-9 a tick: no response beside 0 Hz. With 100 times the errors it is not proven.
    """
    design = full_drive(910_869)
    assert design.controller.current.back_emf_feedforward == 0.8
    assert design.controller.current.integral_time_s is None
    place = Bench(design, design).place("u")
    rows = small_signal(place)
    assert all(row.verdict is Verdict.MET for row in rows)
    (row,) = (row for row in rows if row.name == "gain_margin" and row.because.startswith("0 Hz"))
    assert row.predicted == pytest.approx(1.0 / 0.8, rel=1e-9)
    assert row.found == pytest.approx(1.0 / 0.8, rel=1e-5)
    coarse = replace(place.tangent, entry_errors=100.0 * place.tangent.entry_errors)
    rows = small_signal(replace(place, tangent=coarse))
    (row,) = (row for row in rows if row.verdict is not Verdict.MET)
    assert (row.name, row.verdict) == ("gain_margin", Verdict.NOT_PROVEN)
    assert "stated error of the tangent there" in row.because
    assert row.found == pytest.approx(1.0 / 0.8, rel=0.05)


def test_a_resonance_that_is_not_resolved_is_not_proven() -> None:
    """Damping of 5e-9, pressed past the play, is resolved; with errors of the entries times 1e4 not."""
    design = full_drive(760_008)
    place = Bench(design, design).place("u")
    assert all(row.verdict is Verdict.MET for row in small_signal(place))
    coarse = replace(place.tangent, entry_errors=1e4 * place.tangent.entry_errors)
    rows = small_signal(replace(place, tangent=coarse))
    unproven = [row for row in rows if row.verdict is not Verdict.MET]
    assert {"response", "sensitivity_peak"} <= {row.name for row in unproven}
    for row in unproven:
        assert row.verdict is Verdict.NOT_PROVEN
        assert "stated error of the tangent there" in row.because


@pytest.mark.parametrize(
    "place", ["current", "velocity", "position", "u", "i_ref", "w_ref", "command", "load"]
)
def test_counts_are_no_part_of_a_tangent(place: str) -> None:
    """A drive with counts has the tangent of the same drive without them."""
    counted, ideal = (tangent(one, place) for one in (JOINT, motions.without_counts(JOINT)))
    assert counted.stated_error < 1e-8
    assert relative(counted.closed(Z), ideal.closed(Z)).max() < 1e-9


def test_a_place_that_there_is_not() -> None:
    with pytest.raises(InputError, match="one of"):
        tangent("emps", "current")


@pytest.mark.parametrize("name", ["emps", "ilr33-amber-tanh", "joint"])
def test_an_injected_sweep_finds_the_linear_loop(name: str) -> None:
    """A large sine meets no event in smoothed friction or in gravity, and yet bends: 5e-3 and 5e-5 off."""
    design = load_design(name)
    bench = Bench(design, design)
    sweep = bench_sweep(bench, bench.place("position"))
    assert np.isfinite(sweep.open_loop).all()
    np.testing.assert_allclose(sweep.open_loop, sweep.linear, rtol=1e-8)
