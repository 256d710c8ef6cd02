"""Many runs have the bits of single ones, reducers agree with histories; gain and delay of probes."""

import shutil

import numpy as np
import pytest

from actuator_lti import load_design
from nonlinear import Probe, Reducers, Rows, Run, commands, loads, simulate, simulate_many
from nonlinear._kernels import layout
from nonlinear.bench.probe import fractional_delay
from nonlinear.runs.reduced import whole_periods

AMBER = load_design("ilr33-amber")


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
    target, kept = 0.01, Reducers(step_target_rad=0.01)
    asked = Run(design=AMBER, command=commands.step(target), duration_s=0.2, reducers=kept)
    step, history = simulate_many([asked]).step, simulate(AMBER, commands.step(target), 0.2)
    y, t = history.output_angle_rad / target, history.time_s
    begin, end = np.interp([0.1, 0.9], y[: y.argmax()], t[: y.argmax()])
    assert step.rise_time_s[0] == pytest.approx(end - begin, rel=1e-9)
    assert step.overshoot_percent[0] == pytest.approx(max(100.0 * (y.max() - 1.0), 0.0), abs=1e-9)
    outside = np.flatnonzero(np.abs(y - 1.0) > 0.02)
    assert step.settling_time_s[0] == pytest.approx(t[outside[-1] + 1])
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
