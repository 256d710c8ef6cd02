"""The judge of rest, against closed forms, plain long runs, and drives described in words."""

import sys
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest

from actuator_lti import load_design
from actuator_lti.design import Design, with_values
from analyses.failures import Asked, failures
from analyses.friction_effects import friction_effects
from analyses.friction_effects.breakaway import static_threshold
from analyses.limit_cycles.run import limit_cycles
from analyses.motion.settling import NOTICED, Settling, conduct, counted, ending_of, settle, words
from analyses.validation import validate
from analyses.validation.settings import QUICK
from nonlinear import Rows, State, commands, simulate
from nonlinear._kernels import layout as at
from nonlinear.bench.operating_motion import quiet
from nonlinear.runs.reduced import BatchResult
from nonlinear.settling.drift import overload, ticks_until_it_acts
from nonlinear.settling.rest import _repeated, _Watch, first_motion_s, judge
from reports.sections.cycles import summary
from reports.sections.names import fine_unit
from tests.changed import changed
from tests.validation.random_drives import full_drive, is_stable

HERE = Path(__file__).parent
AMBER, JOINT = load_design("ilr33-amber"), load_design("joint")
QUIET, FULL = quiet(JOINT), JOINT.validation.full_deflection_rad
DEG = 180.0 / np.pi


def plain_run(design: Design, step: float, ticks: float, window: float, load_Nm: float = 0.0) -> BatchResult:
    """A run with no leap and no judge, and its last windows."""
    rows = Rows.of(design)
    rows["load"], rows["ticks"] = load_Nm, ticks
    rows.step("command", step)
    rows.window(round(window), 1, 0)
    return rows.run()


def test_pieces_of_a_run_are_the_run_and_the_same_state_has_the_same_end() -> None:
    whole = simulate(JOINT, commands.step(0.02), 0.1)
    rows = Rows.of(JOINT)
    rows.step("command", 0.02)
    drive = rows.running()
    pieces = [drive.advance(n) for n in (8, 1000, whole.time_s.size - 1008)]
    output = np.concatenate([piece.columns[1] for piece in pieces])
    assert (output == whole.output_angle_rad).all()
    start = State(motor_angle_rad=0.01 * AMBER.total_ratio)
    rest = judge(simulate(AMBER, commands.hold(0.01), 0.01, initial=start).running)
    assert rest.comes_to_rest
    assert rest.error == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(("command", "held"), [
    (commands.step(0.01), True),
    (commands.ramp(0.1), False),
    (commands.ramp(0.1, stop_s=0.05), True),
    (commands.sine(0.01, 2.0), False),
    (commands.sampled([0.0, 0.05], [0.0, 0.01]), True),
    (commands.step(0.01, start_s=0.2), False),
])  # fmt: skip
def test_only_what_stays_is_judged(command: commands.Command, held: bool) -> None:
    rest = judge(simulate(AMBER, command, 0.1).running)
    assert (rest is not None) == held
    if rest is not None:
        assert rest.verdict == "at rest"


def test_a_slow_stick_slip_cycle_and_waiting_take_their_own_time_and_little_work() -> None:
    """Breakaway 1.5, an integral of 100 s: the closed form of the stick foresees some hours a period."""
    values = {"friction.breakaway_ratio": 1.5, "control.velocity.integral_time": 100.0}
    design = changed(with_values(AMBER, values), validation={"loads_Nm": (0.0,)})
    cycles = friction_effects(design).points[0].cycles
    assert cycles.hunting is not None
    rest = cycles.hunting.rest
    assert rest.verdict == "limit cycle"
    assert rest.frequency_hz == pytest.approx(cycles.stick_slip.frequency_hz, rel=1e-3)
    assert rest.amplitude == pytest.approx(cycles.stick_slip.output_amplitude_rad, rel=1e-3)
    assert rest.work < 1e-3 * rest.after_s / design.controller.period_s
    # a step of 0.1 of the threshold moves after Tn (1/0.1 - 1), an hour and a half; 1e5 ticks of work
    design = with_values(AMBER, {"control.velocity.integral_time": 600.0})
    size = 0.1 * static_threshold(AMBER).forward_rad
    rows = Rows.of(design)
    rows.step("command", size)
    assert first_motion_s(rows.running()) == pytest.approx(600.0 * 9.0, rel=1e-3)
    rest = judge(rows.running(), most_work=100_000)
    assert 600.0 * 9.0 < rest.after_s < 600.0 * 9.0 + 10.0


def protected(current_A: float, memory: float, overloaded: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Row and state of a protection alone: a rate of 3e-4 a tick, 5 A for ever, released at 0.9."""
    p, s = np.zeros(at.SIZE + 400), np.zeros(at.S_QUEUE)
    p[at.OVERLOAD_RATE], p[at.CONTINUOUS_CURRENT], p[at.OVERLOAD_RELEASE] = 3e-4, 5.0, 0.9
    s[at.S_CURRENT], s[at.S_OVERLOAD], s[at.S_OVERLOADED] = current_A, memory, overloaded
    return p, s


def test_overload_over_a_leap_and_when_it_acts_are_those_of_its_own_recursion() -> None:
    """It trips at 1, lets go below 0.9; one tick before it has not."""
    p, s = protected(-1.0, 0.3)
    x, n = 0.3, 5000
    for k in range(n):
        x += 3e-4 * (((-1.0 + 3.5 * k / n) / 5.0) ** 2 - x)
    assert overload(p, s, 2.5, n) == pytest.approx(x, rel=1e-9)
    assert overload(p, s, -1.0, 0) == 0.3
    never = [(4.9, 0.5, 0.0), (4.9, 1.3, 1.0), (5.0, 0.5, 0.0)]  # the last values lie this side of it
    for begin in [(6.0, 0.0, 0.0), (5.5, 0.99, 0.0), (4.0, 1.3, 1.0), (0.0, 0.91, 1.0), *never]:
        (current_A, x, overloaded), (p, s), ticks = begin, protected(*begin), 0
        last = (current_A / 5.0) ** 2
        acts = last < 0.9 if overloaded else last > 1.0
        while acts and (x >= 0.9 if overloaded else x < 1.0):
            x, ticks = x + 3e-4 * (last - x), ticks + 1
        assert ticks_until_it_acts(p, s) == max(ticks - 1, 0), begin


def test_overload_on_its_way_is_leapt_over_and_not_waited_for_where_it_stays() -> None:
    """The joint holds 60 N m for half a minute before the protection trips: the plain run says when."""
    rest, Ts = settle(QUIET, 60.0, 0.1309).rest, QUIET.controller.period_s
    assert rest.verdict == "at rest"
    assert "overload" in rest.limited
    run = plain_run(QUIET, 0.1309, rest.after_s / Ts, 1, 60.0)
    trips_s = Ts * float(run.outs[0, at.OUT_LIMIT_FIRST + at.LIMITERS.index("overload")])
    assert trips_s < rest.after_s < 1.1 * trips_s
    assert rest.work < 200_000
    # 60 N m ask for more than the continuous current: the protection trips and never releases
    rest = settle(QUIET, 60.0, 1e-3 * FULL).rest
    assert rest.verdict == "at rest"
    assert "overload" in rest.limited
    after = rest.after_s / QUIET.controller.period_s
    run = plain_run(QUIET, 1e-3 * FULL, 2.0 * after, 1.2 * after, 60.0)
    assert np.ptp(run.span("output_angle_rad")) < 1e-12
    assert run.window_limit_fraction("overload")[0] == pytest.approx(1.0, abs=0.15)


def test_a_load_that_nothing_damps_is_in_no_limit_cycle_while_the_motor_rests() -> None:
    """Its energy stays, so it swings on as a step has left it; a cycle would come back to its own size."""
    load = {"friction": None, "gravity": None}
    free = changed(JOINT, coupling={"damping_Nms_rad": 0.0, "play_rad": 0.0}, load=load)
    ends = [settle(free, 0.0, step).rest for step in (0.01, 0.02, 0.04)]
    assert {rest.verdict for rest in ends} == {"still moving"}
    assert all(rest.amplitude > rest.motor_amplitude == 0.0 for rest in ends)
    assert words(ends[0], 1.0, "rad").endswith("the motor at rest")


def test_a_gimbal_with_a_spring_and_a_steering_motor_with_play_hunt() -> None:
    """+-0.40 deg at 0.12 Hz; 0.213 Hz, 0.458 deg peak to peak at the motor's side, 0.3 deg of it play."""
    gimbal = settle(load_design(HERE / "gimbal.toml"), 0.0, 0.1).rest
    steering = settle(load_design(HERE / "steering.toml"), 0.0, 0.002).rest
    assert (gimbal.verdict, steering.verdict, gimbal.limited) == ("limit cycle", "limit cycle", ())
    assert DEG * gimbal.amplitude == pytest.approx(0.40, abs=0.01)
    assert gimbal.frequency_hz == pytest.approx(0.12, abs=0.005)
    assert 2.0 * DEG * steering.motor_amplitude == pytest.approx(0.458, abs=0.004)
    assert steering.frequency_hz == pytest.approx(0.213, abs=0.003)
    assert steering.amplitude < 0.2 * steering.motor_amplitude


@pytest.mark.parametrize("load_Nm", [0.0, 100.0, 200.0])
@pytest.mark.parametrize("every", [2, 10])
def test_a_valve_that_stands_for_seconds_swings_as_often_as_its_record_passes_the_middle(every, load_Nm):
    """0.2625 Hz: every stand is shorter than the look for one, which finds one in three."""
    design = with_values(load_design(HERE / "valve.toml"), {"control.position.every": every})
    rest = settle(design, load_Nm, 0.166 / DEG).rest
    run = simulate(design, commands.step(0.166 / DEG), 60.0, load_Nm=load_Nm)
    late = run.output_angle_rad[run.time_s.size // 4 :]
    above = late > 0.5 * (late.max() + late.min())
    rises = np.flatnonzero(above[1:] & ~above[:-1]) * run.period_s
    period_s = (rises[-1] - rises[0]) / (rises.size - 1)
    assert rises.size > 9
    assert rest.frequency_hz == pytest.approx(1.0 / period_s, rel=0.01)


def test_breakaways_are_as_many_a_period_as_the_fewest_that_repeat() -> None:
    """Two a period of 1.5 s, from 0 and 1; four are two periods; one is none, nor two with a place off."""
    times, places, ways = np.cumsum([1.0, 0.5] * 4), np.tile([0.0, 1.0], 4), np.tile([1.0, -1.0], 4)
    left = np.stack([times, times, places, places, ways])
    assert [n for n in range(1, 6) if _repeated(left, n, 1.0)] == [2, 4]
    left[2, 5] += 0.02
    assert not _repeated(left, 2, 1.0)


def test_an_irregular_swing_has_no_period_by_chance() -> None:
    """Breakaways from one count 20 s apart, twice, with others between them, are no period of 20 s."""
    values = {"friction.breakaway_ratio": 1.61833, "control.velocity.integral_time": 5.373e-3}
    design = with_values(load_design(HERE / "valve.toml"), values)
    rest = settle(design, 0.0, 0.015708).rest
    run = simulate(design, commands.step(0.015708), 200.0)
    late = run.output_angle_rad[run.time_s.size // 4 :]
    low, high = late.min() + 0.25 * np.ptp(late), late.max() - 0.25 * np.ptp(late)
    sides = np.flatnonzero((late < low) | (late > high))
    rises = sides[1:][(late[sides[1:]] > high) & (late[sides[:-1]] < low)] * run.period_s
    assert np.diff(rises).min() < 1.0 / rest.frequency_hz < np.diff(rises).max()


@pytest.mark.parametrize("share", [0.01, 0.05, 0.25, 1.0])
@pytest.mark.parametrize("counts", [586, None])
def test_a_coarse_encoder_read_by_difference_never_settles(counts: int | None, share: float) -> None:
    """586 counts at 35 us: one count is 306 rad/s; without counts the same drive comes to rest."""
    values = {"control.period": 35e-6, "control.position.gain": 250.0, "control.velocity.integral_time": 3e-3}
    design = changed(with_values(AMBER, values), encoder={"speed": "difference", "counts_per_rev": counts})
    rest = settle(design, 0.0, share * design.validation.full_deflection_rad).rest
    assert rest.verdict == ("at rest" if counts is None else "limit cycle")


def test_the_joint_crosses_its_friction_every_209_s() -> None:
    """A plain run of 15 min, looked at by its extremes: no leap, no judge."""
    rest, Ts = settle(JOINT, 0.0, 0.1 * FULL).rest, JOINT.controller.period_s
    assert rest.verdict == "limit cycle"
    low, high = plain_run(JOINT, 0.1 * FULL, 440.0 / Ts, 215.0 / Ts).span("output_angle_rad")
    assert rest.amplitude == pytest.approx(0.5 * float(high[0] - low[0]), rel=0.02)
    assert rest.frequency_hz == pytest.approx(1.0 / 209.3, rel=0.01)
    # from other starts slips minutes apart, several a cycle: figures of plain runs over 900 s
    for part, period_s, amplitude_deg in ((0.05, 58.4, 0.01746), (0.5, 303.0, 0.0311)):
        rest = settle(JOINT, 0.0, part * FULL).rest
        assert rest.verdict == "limit cycle"
        assert 1.0 / rest.frequency_hz == pytest.approx(period_s, rel=2e-3)
        assert DEG * rest.amplitude == pytest.approx(amplitude_deg, rel=5e-3)
        assert rest.work < 1_000_000


PLAIN_TICKS = 300_000


def test_a_filter_s_rounding_ends_no_leap_and_hops_of_a_billionth_are_rest() -> None:
    """A notch at 37 Hz sums up rounding at 8 kHz; errors are integrated for minutes between slips."""
    rest = settle(QUIET, 0.0, 1e-3 * FULL).rest
    assert rest.verdict == "limit cycle"
    assert rest.work < 1_800_000
    # an integral that a count keeps from zero moves 4.6 mm by 3e-13 m a day: a plain run stands
    design = full_drive(2000019)
    step = design.validation.full_deflection_rad
    assert settle(design, 0.0, step).rest.verdict == "at rest"
    assert conduct(simulate(design, commands.step(step), 1.0)).status == "comes to rest"
    assert np.ptp(plain_run(design, step, 1_000_000, 500_000).span("output_angle_rad")) < 1e-9 * step


def stable_position_drive(seed: int) -> Design:
    design = full_drive(seed)
    if not is_stable(design) or design.controller.outermost != "position":
        pytest.skip("no stable position loop")
    return design


@pytest.mark.parametrize("seed", range(1, 31))
def test_random_drives_against_a_plain_run(seed: int) -> None:
    """What is said to be at rest by then has stopped; a cycle that it saw often enough has the same size."""
    design = stable_position_drive(seed)
    noises = ("current_noise_A", "angle_noise_rad", "output_angle_noise_rad", "jitter_s")
    silent = changed(design, instruments=dict.fromkeys(noises, 0.0))
    step = 0.01 * design.validation.full_deflection_rad
    rest = settle(design, 0.0, step).rest
    span = np.ptp(plain_run(silent, step, PLAIN_TICKS, PLAIN_TICKS // 5).span("output_angle_rad"))
    waited = PLAIN_TICKS * design.controller.period_s
    if rest.verdict == "at rest" and rest.after_s < 0.6 * waited:
        assert span < 1e-8 * step
    if rest.verdict == "limit cycle" and rest.frequency_hz is not None and rest.frequency_hz * waited > 20.0:
        assert span == pytest.approx(2.0 * rest.amplitude, rel=0.25)


def ends_alike(design: Design, settlings: Iterable[Settling], *lengths: int) -> None:
    """Whether steps end as runs of `simulate` of some lengths (ticks) do."""
    full, tick_s = design.validation.full_deflection_rad, design.controller.period_s
    for one in settlings:
        for ticks in lengths:
            asked = (commands.step(one.amplitude_rad), ticks * tick_s, one.load_Nm)
            run = simulate(design, *asked, raise_on_failure=False)
            rest = None if run.running is None else judge(run.running)
            verdict = "none" if rest is None else counted(rest, NOTICED * full).verdict
            assert verdict == one.rest.verdict, (one, ticks)


@pytest.mark.parametrize("seed", [4, 9, 13, 20, 35, 43, 44])
def test_all_who_ask_get_one_answer(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """`cycles`, `validate`, `failures` before any, `simulate` after two lengths; the words of the report."""
    design = stable_position_drive(seed)
    # what large commands and failures make of it are other questions, and half the time
    monkeypatch.setattr(sys.modules["analyses.validation.validate"], "conditional_stability", lambda *_: None)
    monkeypatch.setattr(sys.modules["analyses.failures.run"], "_reaches", lambda *_: False)
    waited, checked = limit_cycles(design), validate(design, QUICK)
    assert checked.settlings == waited.settlings
    assert (waited.verdict, waited.hunting) == (checked.rest, checked.hunting)
    ends_alike(design, waited.settlings, 1_000, 20_000)
    ends_alike(design, failures(design, Asked.of(design)).before, 20_000)
    swing, said = waited.hunting, (summary(waited), checked.words)
    if swing is None:
        assert not any("not come to rest" in text for text in said)
    else:
        wanted = (words(swing.rest, *fine_unit(design.axis)), ending_of(design, swing))
        assert all(part in text for text, part in zip(said, wanted, strict=True))


@pytest.mark.parametrize("ticks", [4096, 2900])
def test_a_drive_that_hunts_unevenly_hunts_whenever_the_judge_looks(ticks, monkeypatch) -> None:
    """Two integrals, coarse counts and play: no two of its swings are one, and in 250 s they never shrink."""
    hunting = {
        "coupling.play": np.radians(0.02), "encoder.counts_per_rev": 2048, "control.velocity.gain": 0.1,
        "control.velocity.integral_time": 0.05, "control.position.gain": 16.0,
        "control.position.integral_time": 1.5,
    }  # fmt: skip
    monkeypatch.setattr("nonlinear.settling.rest.PIECE_TICKS", ticks)
    rest = judge(simulate(with_values(JOINT, hunting), commands.step(0.006145), 0.02).running)
    assert (rest.verdict, rest.limited) == ("limit cycle", ())
    assert rest.amplitude == pytest.approx(2.4e-4, rel=0.1)


def watch_of(seen: np.ndarray, flags: int = 0) -> _Watch:
    """A judge at the end of its work that has seen the output, and the motor, do that; with events."""
    watch = _Watch(simulate(AMBER, commands.step(1e-3), 0.01).running.held(), 1)
    watch.times, watch.seen = [np.arange(seen.size, dtype=float)], [np.stack([0.0 * seen, seen, seen])]
    watch.acted = [(seen.size, flags, 1)]
    return watch


def test_swings_of_many_sizes_go_on_and_one_larger_than_all_before_is_no_divergence() -> None:
    """Sizes by chance, the largest last or not; decaying, growing, and at rest in the last quarter."""
    swing, chance = np.sin(2.0 * np.pi * np.arange(6400) / 100.0), np.random.default_rng(3)
    ends = []
    for _ in range(20):
        watch = watch_of(swing * np.repeat(chance.uniform(0.7, 1.0, 64), 100))
        ends.append((watch._goes_on(), watch._grows()))
    assert set(ends) == {(True, False)}
    time = np.linspace(0.0, 1.0, swing.size)
    assert not watch_of(swing * np.exp(-0.1 * time))._goes_on()
    assert not watch_of(swing * (time < 0.75))._goes_on()
    assert watch_of(swing * np.exp(time))._grows()
    largest_last = swing * np.where(time > 0.95, 1.1, 1.0)
    assert (watch_of(largest_last)._grows(), watch_of(largest_last, at.FLAG_CURRENT)._grows()) == (
        False,
        True,
    )


def test_a_stiff_drive_is_left_where_its_work_ends() -> None:
    """A rotor of 3.6e-5 g cm^2 under 0.39 N m of tanh friction: ten thousands of steps a tick are work."""
    stiff = {"motor.rotor_inertia": 3.56654e-12, "friction.dry_torque": 0.38856}
    gears = {
        f"gear.{name}.{side}_inertia": 0.0 for name in ("planetary", "worm") for side in ("input", "output")
    }
    design = with_values(load_design("ilr33-amber-tanh"), stiff | gears | {"load.inertia": 1e-9})
    rows = Rows.of(design)
    rows.step("command", 0.01)
    drive = rows.running()
    drive.run(64)
    steps = drive.value("STEPS")
    assert steps >= 64 * 10_000
    rest = judge(rows.running(), most_work=200_000)
    assert rest.verdict == "still moving"
    assert 200_000 <= rest.work < 200_000 + 2 * 512 * 2 * 2**15
    assert rest.after_s < 64 * design.controller.period_s


def test_swings_below_a_count_are_not_measured_at_every_breakaway(monkeypatch: pytest.MonkeyPatch) -> None:
    """They were as often as breakaways squared: a fin that hunts about an edge of a count took 80 s."""
    integral = {"integral_time_s": 2.0, "sensor": "output"}
    fin = changed(
        load_design("fin"), output_encoder={"counts_per_rev": 8192}, controller={"position": integral}
    )
    measured = list[tuple[int, ...]]()
    monkeypatch.setattr("nonlinear.settling.rest._span", lambda moved: measured.append(moved.shape))
    found = judge(simulate(fin, commands.step(np.radians(2.0)), 0.5).running)
    assert (found.verdict, measured) == ("limit cycle", [])
    assert 2.0 * found.amplitude < 2.0 * np.pi / 8192
