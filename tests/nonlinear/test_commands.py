"""Commands, loads and results: values, units, refusals; many runs have the bits of single ones."""

import shutil
from collections.abc import Callable
from pathlib import Path

import mpmath
import numpy as np
import pytest
from scipy import signal

from actuator_lti import load_design
from actuator_lti.errors import NumericalError
from nonlinear import Drive, Probe, Reducers, Rows, Run, State, commands, loads, simulate, simulate_many
from nonlinear._kernels import layout
from nonlinear.bench.probe import fractional_delay
from nonlinear.commands import Command
from nonlinear.runs.records import read_columns
from nonlinear.runs.reduced import whole_periods
from tests.changed import changed
from tests.refusals import refused

AMBER = load_design("ilr33-amber")
TS = 1e-3
T = np.arange(2000) * TS
SHORT = {"design": AMBER, "command": commands.hold(), "duration_s": 0.1}
TORQUE = {"position": None, "velocity": None}


def run(controller: dict[str, None], **parts: dict[str, float]) -> object:
    return simulate(changed(AMBER, controller=controller, **parts), commands.hold(), 0.01)


@pytest.mark.parametrize(("command", "expected"), [
    (commands.sine(2.0, 3.0, 0.4, 0.5), np.where(T >= 0.5, 2 * np.sin(6 * np.pi * (T - 0.5) + 0.4), 0)),
    (commands.ramp(2.0, 0.3, 0.8), 2.0 * np.clip(T - 0.3, 0.0, 0.5)),
    (commands.step(1.5, 0.25), np.where(T >= 0.25, 1.5, 0.0)),
    (commands.hold(0.7), np.full(T.size, 0.7)),
    (commands.triangle(2.0, 4.0), 2.0 * signal.sawtooth(8 * np.pi * T + np.pi / 2, 0.5)),
    (commands.chirp(1.0, 1.0, 20.0, 2.0), signal.chirp(T, 1.0, 2.0, 20.0, "logarithmic", -90.0)),
    (commands.chirp(1.0, 1.0, 20.0, 2.0, logarithmic=False), signal.chirp(T, 1.0, 2.0, 20.0, phi=-90.0)),
    (commands.sampled([0.0, 1.0, 2.0], [0.0, 3.0, 1.0]), np.interp(T, [0, 1, 2], [0, 3, 1])),
], ids=lambda value: value.kind if isinstance(value, Command) else "")  # fmt: skip
def test_values(command: Command, expected: np.ndarray) -> None:
    np.testing.assert_allclose(command.values(TS, T.size), expected, atol=1e-9)


def test_any_command_may_be_a_load() -> None:
    fin, t = load_design("fin"), np.arange(400) * load_design("fin").controller.period_s
    given = (
        loads.LoadTorque(series=commands.sine(20.0, 30.0)),
        loads.series(t, 20.0 * np.sin(60.0 * np.pi * t)),
    )
    one, other = (simulate(fin, commands.hold(), t.size * fin.controller.period_s, load) for load in given)
    assert np.ptp(one.motor_angle_rad) > 1e-3
    assert one.motor_angle_rad == pytest.approx(other.motor_angle_rad, abs=1e-9)


@pytest.mark.parametrize("frequency_hz", [1e-3, 0.7, 31.0, 499.0, 7e5])
def test_a_sine_is_right_to_its_last_digits(frequency_hz: float) -> None:
    values = commands.sine(1.0, frequency_hz, 0.3).values(TS, T.size)
    turned = 2 * np.pi * frequency_hz * T + 0.3  # as rounded: what is asked is its sine
    truth = np.array([float(mpmath.sin(mpmath.mpf(float(x)))) for x in turned])
    assert np.max(np.abs(values - truth) / np.spacing(np.abs(truth))) <= 2.0


def test_stepped_sine_joins_whole_periods_and_a_multisine_has_its_lines_and_its_seed() -> None:
    command = commands.stepped_sine(1.0, [5.0, 10.0], cycles=3, period_s=TS, settle_cycles=2)
    values = command.values(TS, 2000)
    np.testing.assert_allclose(values[:1000], np.sin(2 * np.pi * 5.0 * T[:1000]), atol=1e-12)
    np.testing.assert_allclose(values[1000:1500], np.sin(2 * np.pi * 10.0 * (T[1000:1500] - 1.0)), atol=1e-9)
    assert not values[1500:].any()
    a, b, c = (commands.multisine(0.5, [3.0, 7.0], 2.0, TS, seed=s).values(TS, 2000) for s in (1, 1, 2))
    assert np.array_equal(a, b)
    assert not np.array_equal(a, c)
    values = commands.multisine(0.3, [3.3, 7.1, 12.9], 1.0, 1e-4, seed=4).values(1e-4, 10_001)
    assert abs(values[0]) < 1e-12
    assert values[10_000] == pytest.approx(values[0], abs=1e-12)
    assert values[1] > 0.0
    lines = np.abs(np.fft.rfft(values[:10_000])) / 5000.0
    assert set(np.flatnonzero(lines > 1e-9).tolist()) == {3, 7, 13}
    assert np.abs(values).max() == pytest.approx(0.3, rel=1e-12)
    for wrong, words in (([0.2], "less than one period"), ([3.1, 3.2], "same number of periods")):
        refused(commands.multisine, 0.3, wrong, 1.0, 1e-4, match=words)


@pytest.mark.parametrize(("make", "words"), [
    (lambda: commands.sine(1.0, 0.0), "frequency_hz = 0.0: must be positive"),
    (lambda: commands.step(float("nan")), "amplitude_rad = nan"),
    (lambda: commands.ramp(1.0, 1.0, 0.5), "must be later"),
    (lambda: commands.multisine(1.0, [], 1.0, TS), "at least one frequency"),
    (lambda: commands.sampled([0.0, 1.0], [0.0]), "equal numbers"),
    (lambda: loads.series([0.0, 1.0], ["a", "b"]), "values = .*must be numbers, in SI"),
    (lambda: Drive("ilr33-amber").step(float("nan")), "command = nan: must be a finite number"),
    (lambda: Drive("ilr33-amber").step(None), "command = None: must be a finite number"),
    (lambda: Drive("ilr33-amber").step("x"), "command = 'x': must be a finite number"),
    (lambda: Drive("ilr33-amber").step(0.0, np.inf), "load_Nm = inf: must be a finite number"),
    (lambda: simulate("ilr33-amber", None, 0.1), "None: must be a Command"),
    (lambda: commands.sampled([0.0, 0.0], [0.0, 1.0]), "must be later than"),
    (lambda: commands.sampled([0.0, 1.0, 2.0], [0.0, np.nan, 1.0]), "angle in row 2"),
    (lambda: commands.sampled([0.0, 1.0, 2.0, 4.0], [0.0] * 4), "hole in time from 2 s to 4 s"),
    (lambda: commands.recorded("nowhere.csv"), "nowhere.csv: cannot be read: no such file"),
    (lambda: read_columns(Path("r.csv"), ("t", "a")), 'line 3, column 2 = "x"'),
    (lambda: read_columns(Path("r.csv"), ("b",)), 'no column "b"; there are "t", "a"'),
    (lambda: commands.recorded("x.csv", unit="furlong"), "must be deg, rad, mm, m"),
    (lambda: loads.constant(float("inf")), "finite"),
    (lambda: loads.proportional(float("nan")), "must be a number"),
    (lambda: loads.series([0.0, 1.0, 5.0, 6.0], [0.0] * 4), "hole in time"),
    (lambda: loads.series([-2.0, -1.0], [1.0, 1.0]), "must be 0 or later"),
    (lambda: simulate_many([]), "at least one"),
    (lambda: simulate_many([Run(**SHORT, reducers=Reducers(window_ticks=800))]), "must fit twice"),
    (lambda: Reducers(harmonics=40).write(np.zeros(layout.SIZE)), "harmonics"),
    (lambda: simulate("emps", commands.hold(), 0.1, probes=[Probe(point="i_ref")]), "no such stage"),
    (lambda: simulate("emps", commands.hold(), 0.1, probes=[Probe(point="u")] * 2), "one a point"),
    (lambda: Probe(point="v"), "must be one of"),
    (lambda: Probe(point="u", delay_samples=-1.0), "zero or more"),
    (lambda: run(TORQUE, command={"rate_rad_s": 1.0}), "need a position or a velocity loop"),
    (lambda: run({}, command={"acceleration_rad_s2": 1.0, "jerk_rad_s3": 1e-4}), "a mean over"),
    (lambda: run({"current": None}, limits={"peak_time_s": 1.0}), "needs a current loop"),
])  # fmt: skip
def test_refusals(make: Callable[[], object], words: str, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("r.csv").write_text("t,a\n0,1\n1,x\n")
    refused(make, match=words)


def test_trajectory_carries_units_and_leaves_as_a_frame() -> None:
    run, again = (simulate(AMBER, commands.step(0.01), 0.05, record_every=5) for _ in range(2))
    frame = run.to_pandas()
    assert list(frame.columns[:4]) == ["time_s", "reference_rad", "output_angle_rad", "motor_angle_rad"]
    assert len(frame) == 100
    assert frame["time_s"].iloc[1] == pytest.approx(5e-4)
    assert frame.attrs["design"] == "ilr33-amber"
    assert "deg" in repr(run)
    assert "A, limits" in repr(run)
    assert again.parameters_hash == run.parameters_hash


def test_a_failure_is_said_and_progress_can_interrupt() -> None:
    wild = changed(AMBER, controller={"velocity": {"gain": 50.0}})
    with pytest.raises(NumericalError, match=r"run stopped at .* s \(not finite\): .* unstable"):
        simulate(wild, commands.step(0.01), 1.0, limits_on=False)
    run = simulate(wild, commands.step(0.01), 1.0, limits_on=False, raise_on_failure=False)
    assert run.status == "not finite"
    assert np.isnan(run.output_angle_rad[-1])
    assert run.time_s.size == 10_000
    seen: list[tuple[int, int]] = []
    simulate(AMBER, commands.hold(), 1.0, progress=lambda done, total: seen.append((done, total)))
    assert seen[-1] == (10_000, 10_000)

    def stop(done: int, total: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        simulate(AMBER, commands.hold(), 100.0, record_every=1000, progress=stop)


def test_a_record_holds_the_whole_load_and_extra_torque_moves_what_friction_does_not_hold() -> None:
    """Slope and gravity at the angle that the output has, by their formulas."""
    made = simulate("joint", commands.step(0.1), 0.05, loads.proportional(-3.0, 1.5))
    load = load_design("joint").load
    angle, gravity = made.output_angle_rad, load.gravity
    own = gravity.mass_kg * 9.80665 * gravity.arm_m * np.sin(angle + gravity.offset_rad)
    wanted = 1.5 + (load.moment_slope_Nm_rad - 3.0) * angle + own
    np.testing.assert_allclose(made.load_Nm, wanted, rtol=1e-12, atol=1e-12)
    start, hold = State(motor_angle_rad=10.0), commands.hold(10.0 / AMBER.total_ratio)
    run = simulate(AMBER, hold, 0.3, initial=start, disturbance_Nm=1e-3)
    assert not run.motor_speed_rad_s.any()  # below the dry friction
    run = simulate(AMBER, hold, 0.3, initial=start, disturbance_Nm=5e-3)
    assert run.output_angle_rad.max() > 10.0 / AMBER.total_ratio
    refused(simulate, AMBER, hold, 0.3, disturbance_Nm=[0.0, np.nan], words="must be finite")


def test_bits_of_single_runs_for_any_number_of_threads() -> None:
    designs = [load_design(n) for n in ("ilr33-amber", "emps", "ilr33-amber-multirate")]
    table = commands.sampled([0.0, 0.1, 0.2], [0.0, 0.01, -0.01])
    runs, kept = [], Reducers(extremes=True)
    for k in range(12):
        command = commands.sine(0.002 * (k + 1), 2.0 + k) if k % 2 else table
        how = {"duration_s": 0.2 + 0.01 * k, "load_Nm": loads.proportional(3.0 * k, 1.0), "reducers": kept}
        runs.append(Run(design=designs[k % 3], command=command, **how))
    batches = [simulate_many(runs, threads=n) for n in (1, 2, 5)]
    for batch in batches[1:]:
        assert np.array_equal(batch.outs, batches[0].outs)
    alone = np.vstack([simulate_many([run]).outs for run in reversed(runs)][::-1])
    assert np.array_equal(alone, batches[0].outs)
    for k, run in enumerate(runs):
        single = simulate(run.design, run.command, run.duration_s, run.load_Nm)
        assert single.final.motor_angle_rad == batches[0].outs[k, layout.OUT_STATE + layout.S_ANGLE]
        assert single.current_A.max() == batches[0].extreme("current_A")[1][k]
        assert single.motor_speed_rad_s.min() == batches[0].extreme("motor_speed_rad_s")[0][k]
        assert single.events == batches[0].events[k]


@pytest.mark.parametrize("name", ["ilr33-amber", "ilr33-amber-tanh", "ballscrew"])
def test_going_on_gives_the_bits_of_one_run(name: str) -> None:
    rows = Rows.of(load_design(name), 3)
    rows.sine("command", [1e-3, 0.01, 0.05], [200.0, 20.0, 7.0])
    rows.window(400, 2, 3)
    rows["ticks"] = [1003, 1500, 2100]
    drives = [rows.running(k) for k in range(3)]
    assert np.array_equal(rows.run(drives=drives).outs, rows.run().outs)
    rows["ticks"] += [1111, 900, 5001]
    first, last = layout.OUT_WINDOWS, layout.OUT_PHASOR
    whole, on = rows.run(), rows.run(drives=drives)
    assert np.array_equal(on.outs[:, first:last], whole.outs[:, first:last])
    assert np.array_equal(on.final_output_rad, whole.final_output_rad)


def test_windows_and_step_figures_against_the_history() -> None:
    Ts = AMBER.controller.period_s
    frequency, ticks, cycles = whole_periods(37.0, Ts)
    probe = Probe(point="w_ref", injection=commands.sine(20.0, frequency))
    asked = {"command": commands.hold(), "bias": commands.ramp(0.1), "probes": (probe,)}
    asked["duration_s"] = (2 * ticks + 731) * Ts
    kept = Reducers(window_ticks=ticks, cycles=cycles, harmonics=3)
    batch, history = simulate_many([Run(design=AMBER, reducers=kept, **asked)]), simulate(AMBER, **asked)
    for last in (0, 1):
        part = slice(-(last + 1) * ticks, -last * ticks if last else None)
        t = history.time_s[part]
        for name, values in (
            ("motor_speed_rad_s", history.motor_speed_rad_s),
            ("probe_w_ref_before", history.probes["w_ref"].before),
            ("probe_w_ref_after", history.probes["w_ref"].after),
        ):
            x = values[part]
            assert batch.mean(name, last)[0] == pytest.approx(x.mean(), rel=1e-12)
            assert batch.rms(name, last)[0] == pytest.approx(np.sqrt(np.mean(x**2)), rel=1e-12)
            assert [end[0] for end in batch.span(name, last)] == [x.min(), x.max()]
            for harmonic in (1, 3):
                e = np.exp(-2j * np.pi * frequency * harmonic * t)
                expected = 2j * np.mean(x * e)
                assert batch.phasor(name, harmonic, last)[0] == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize(
    ("stages", "target"),
    [({}, 0.01), ({"position": None}, 0.3), (TORQUE, 0.5)],
    ids=["angle", "speed", "torque"],
)
def test_step_figures_are_of_what_the_command_orders(stages: dict[str, None], target: float) -> None:
    design, kept = changed(AMBER, controller=stages), Reducers(step_target_rad=target)
    asked = Run(design=design, command=commands.step(target), duration_s=0.2, reducers=kept)
    step, history = simulate_many([asked]).step, simulate(design, commands.step(target), 0.2)
    y, t = history.followed / target, history.time_s
    begin, end = np.interp([0.1, 0.9], y[: y.argmax()], t[: y.argmax()])
    assert step.rise_time_s[0] == pytest.approx(end - begin, rel=1e-9)
    assert step.overshoot_percent[0] == pytest.approx(max(100.0 * (y.max() - 1.0), 0.0), abs=1e-9)
    settled = np.append(t, np.nan)[np.flatnonzero(np.abs(y - 1.0) > 0.02)[-1] + 1]
    assert step.settling_time_s[0] == pytest.approx(settled, nan_ok=True)
    assert step.final_ratio[0] == pytest.approx(y[-1], rel=1e-14)


def test_rows_are_the_same_as_runs() -> None:
    gains, rows = np.array([0.1, 0.2, 0.3]), Rows.of(AMBER, 3)
    rows["ticks"] = 2000
    rows.ramp("bias", 0.1)
    rows.window(500, 5)
    rows.sine("i_ref", gains, 100.0)
    probes = [Probe(point="i_ref", injection=commands.sine(g, 100.0)) for g in gains]
    asked = {"command": commands.hold(), "bias": commands.ramp(0.1), "duration_s": 0.2}
    asked["reducers"] = Reducers(window_ticks=500, cycles=5)
    runs = [Run(design=AMBER, probes=(probe,), **asked) for probe in probes]
    assert np.array_equal(rows.run().outs, simulate_many(runs).outs)


@pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc here")
@pytest.mark.parametrize("name", ["ilr33-amber", "ilr33-amber-multirate"])
@pytest.mark.parametrize("motion", [(5.0, 1.0, 4.0), (0.05, 10.0, 2.0), (10.0, 3.0, 0.0)])
def test_the_simulator_agrees_with_it(name: str, motion: tuple[float, float, float]) -> None:
    from benchmarks.plain_servo import PlainServo

    design, (size_deg, frequency_hz, load_Nm) = load_design(name), motion
    command, ticks = commands.sine(np.radians(size_deg), frequency_hz), 5000
    period = design.controller.period_s
    reference = design.total_ratio * command.values(period, ticks)
    history, events = PlainServo(design).run(reference, np.full(ticks, load_Nm))
    run = simulate(design, command, ticks * period, loads.constant(load_Nm))
    assert run.events == events
    ours = (run.motor_angle_rad, run.motor_speed_rad_s, run.current_A, run.voltage_V)
    for k, values in enumerate(ours):
        assert np.abs(history[:, k] - values).max() < 1e-9 * np.abs(values).max()


def test_gain_and_delay_multiply_the_loop() -> None:
    u = np.sin(0.3 * np.arange(200.0)) * 0.1
    for delay, tolerance in ((3.0, 0.0), (2.4, 2e-6), (0.5, 2e-3)):
        probe = Probe(point="w_ref", gain=1.5, delay_samples=delay, injection=u)
        run = simulate(AMBER, commands.sine(0.001, 20.0), 0.02, probes=[probe])
        k, seen = np.arange(200), run.probes["w_ref"]
        delayed = np.interp(k - delay, k, seen.before) if tolerance else seen.before[:-3]
        expected = 1.5 * delayed + (u if tolerance else u[3:])
        got = seen.after if tolerance else seen.after[3:]
        scale = np.abs(seen.before).max()
        assert np.abs(got - expected)[10:].max() <= (tolerance + 0.01 if tolerance else 1e-14) * scale
        assert np.array_equal(run.speed_command_rad_s, seen.after)
    for delay in (0.3, 1.6, 2.5, 7.25):  # by its taps
        whole, taps = fractional_delay(delay)
        for wT in (0.01, 0.1, 0.3):
            response = np.sum(taps * np.exp(-1j * wT * (whole + np.arange(taps.size))))
            error = abs(response / np.exp(-1j * wT * delay) - 1.0)
            assert error < (wT / 2.0) ** taps.size * 2.0
