"""Studies: linear figures of many designs, Monte Carlo, Dask against this process, tuning.

The reference of the speed-up is a loop over `assemble_loops` and `control.stability_margins`, timed on
a few designs and scaled; every figure of it is compared with `actuator_lti.stability_margins` as well.
"""

from __future__ import annotations

import resource
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.row import Row


def rows(quick: bool = False) -> Iterator[Row]:
    """Measure, warm: compiled code is in its cache."""
    yield from _margins(quick)
    yield from _two_mass(quick)
    yield from _monte_carlo(quick)
    yield from _growth(quick)
    yield from _dask(quick)
    yield from _tuning()


def _timed(call: Callable[[], Any]) -> tuple[float, Any]:
    start = time.perf_counter()
    result = call()
    return time.perf_counter() - start, result


def _margins(quick: bool) -> Iterator[Row]:
    """Margins of sampled designs, all three loops, against one design after the other."""
    import control

    from actuator_lti import assemble_loops, load_design, stability_margins
    from actuator_lti.batch import Population, linear_figures
    from actuator_lti.design import with_values

    design = load_design("ilr33-amber")
    count, compared = (2000, 10) if quick else (10_000, 30)
    rng = np.random.default_rng(0)
    paths = {
        "motor.resistance": 0.2, "motor.inductance": 0.2, "motor.rotor_inertia": 0.2, "friction.viscous": 0.5,
        "control.velocity.gain": 0.3, "control.current.gain": 0.3, "control.position.gain": 0.3,
    }  # fmt: skip
    nominal = {path: design.parameters[path].value for path in paths}
    values = {p: nominal[p] * (1 + width * rng.uniform(-1, 1, count)) for p, width in paths.items()}
    population = Population(design, values, count)
    linear_figures(Population(design, {}, 1))
    batch_s, figures = _timed(lambda: linear_figures(population, time_figures=False, threads=2))
    loop_s, worst = 0.0, 0.0
    for k in range(compared):
        changed = with_values(design, {p: float(v[k]) for p, v in values.items()})
        start = time.perf_counter()
        loops = assemble_loops(changed)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            for loop in loops.present.values():
                control.stability_margins(loop.open_loop)
        loop_s += time.perf_counter() - start
        for name, loop in loops.present.items():
            worst = max(worst, _difference(figures, name, k, stability_margins(loop.open_loop)))
    ratio = (loop_s / compared) / (batch_s / count)
    note = f"{1e3 * loop_s / compared:.1f} ms a design against {1e6 * batch_s / count:.0f} us, two threads"
    yield Row(
        f"margins of {count} designs: faster than one by one", ratio, "x", 100.0, comparison=">=", note=note
    )
    note = f"every crossover of {compared} designs"
    yield Row("largest relative difference to the margin engine", worst, "", 1e-6, note=note)


def _two_mass(quick: bool) -> Iterator[Row]:
    """Figures of many compliant drives over those of the rigid one, processor time, best of three."""
    from actuator_lti import load_design
    from actuator_lti.batch import Population, linear_figures
    from actuator_lti.design import parameter_value

    count = 300 if quick else 1000
    rng = np.random.default_rng(0)
    paths = ("motor.resistance", "friction.viscous", "control.velocity.gain", "control.position.gain")
    spread = {path: 1.0 + 0.2 * rng.uniform(-1, 1, count) for path in paths}
    for timed, words in ((False, "margins and bandwidths"), (True, "step figures too")):
        best = []
        for name in ("ilr33-amber", "ilr33-amber-compliant"):
            design = load_design(name)
            values = {path: parameter_value(design, path) * share for path, share in spread.items()}
            population = Population(design, values, count)
            linear_figures(population.part(slice(0, 3)), time_figures=timed)
            seconds = []
            for _ in range(3):
                start = time.process_time()
                linear_figures(population, time_figures=timed)
                seconds.append(time.process_time() - start)
            best.append(min(seconds) / count)
        note = f"{1e6 * best[1]:.0f} us a design against {1e6 * best[0]:.0f} us"
        name = f"a two-mass drive over the rigid one, {words}"
        yield Row(name, best[1] / best[0], "x", 3.0, note=note)


def _difference(figures: Any, loop: str, k: int, truth: Any) -> float:
    """Largest relative difference of any crossover; 1 if their number differs."""
    gain, phase = figures.gain_crossovers(loop), figures.phase_crossovers(loop)
    if (gain.crossings[k], phase.crossings[k]) != (len(truth.phase_margins), len(truth.gain_margins)):
        return 1.0
    pairs = [(gain.frequency_rad_s[k, j], m.frequency_rad_s) for j, m in enumerate(truth.phase_margins)]
    pairs += [(gain.margin[k, j], m.deg) for j, m in enumerate(truth.phase_margins)]
    pairs += [(phase.frequency_rad_s[k, j], m.frequency_rad_s) for j, m in enumerate(truth.gain_margins)]
    pairs += [(phase.margin[k, j], m.ratio) for j, m in enumerate(truth.gain_margins)]
    pairs.append((figures.quantity("modulus_margin", loop)[k], truth.modulus_margin))
    return max(abs(a / b - 1.0) for a, b in pairs)


def _monte_carlo(quick: bool) -> Iterator[Row]:
    """Whole studies to disk, statistics and odds included."""
    from actuator_lti import load_design
    from analyses.monte_carlo import MonteCarloSettings, StepCheck, monte_carlo

    design = load_design("ilr33-amber")
    count = 2000 if quick else 10_000
    share = count / 10_000
    with tempfile.TemporaryDirectory() as folder:
        monte_carlo(design, folder, MonteCarloSettings(samples=10, step=StepCheck(0.00873, 0.5)))
    for name, step, target in (
        ("linear samples, step figures too", None, 10.0),
        ("nonlinear steps of 0.5 s besides", StepCheck(0.00873, 0.5), 25.0),
    ):
        settings = MonteCarloSettings(samples=count, step=step, worst_cases=False, chunk=512)
        with tempfile.TemporaryDirectory() as folder:
            seconds, _ = _timed(lambda f=folder, s=settings: monte_carlo(design, f, s))  # type: ignore[misc]
        yield Row(f"{count} {name}", seconds, "s", target * share)
    yield _steps(count, share)


def _steps(count: int, share: float) -> Row:
    """Nonlinear steps alone."""
    from concurrent.futures import ThreadPoolExecutor

    from actuator_lti import load_design
    from actuator_lti.batch import Population
    from analyses.monte_carlo import StepCheck
    from analyses.monte_carlo.task import step_columns
    from analyses.studies.sampling import as_values, sampler_of

    design = load_design("ilr33-amber")
    sampler = sampler_of(design)
    step = StepCheck(0.00873, 0.5)

    def part(first: int) -> None:
        values = as_values(design, sampler.paths, sampler.draw(first, 250))
        step_columns(step, Population(design, values, 250))

    with ThreadPoolExecutor(2) as pool:
        seconds, _ = _timed(lambda: list(pool.map(part, range(0, count, 250))))
    return Row(f"{count} nonlinear steps of 0.5 s", seconds, "s", 15.0 * share)


def _growth(quick: bool) -> Iterator[Row]:
    """Time and memory of ten times as many samples."""
    from actuator_lti import load_design
    from analyses.monte_carlo import MonteCarloSettings, monte_carlo

    design = load_design("ilr33-amber")
    few = 2000 if quick else 10_000
    taken, peaks = [], []
    for count in (few, 10 * few):
        with tempfile.TemporaryDirectory() as folder:
            settings = MonteCarloSettings(samples=count, worst_cases=False)
            taken.append(_timed(lambda f=folder, s=settings: monte_carlo(design, f, s))[0])  # type: ignore[misc]
        peaks.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0)
    name = f"{10 * few} samples against {few}"
    yield Row(f"{name}: time over ten times", taken[1] / taken[0] / 10, "x", 1.2, note=f"{taken[1]:.1f} s")
    yield Row(f"{name}: more memory", peaks[1] - peaks[0], "MB", 100.0, note=f"peak {peaks[1]:.0f} MB")


def _dask(quick: bool) -> Iterator[Row]:
    """A warm local cluster of two processes against two threads here, the better of two runs each."""
    import distributed

    from actuator_lti import load_design
    from analyses.monte_carlo import SampleTask
    from analyses.monte_carlo.task import Store
    from analyses.studies.engine import Engine
    from analyses.studies.sampling import sampler_of

    design = load_design("ilr33-amber")
    task = SampleTask(design, sampler_of(design))
    count = 10_000 if quick else 100_000

    def run(engine: Engine) -> float:
        with tempfile.TemporaryDirectory() as folder:
            store = Store.open(Path(folder), {}, 1000 if quick else 4096)
            return _timed(lambda: engine.map(task, store.chunks(count), store.write))[0]

    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address="127.0.0.1:0", silence_logs=50
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        client.run(task, (0, 10))  # every worker has its compiled code
        engines = (Engine(threads=2), Engine(scheduler=cluster.scheduler_address))
        taken = [[run(engine) for engine in engines] for _ in range(2)]
    here, there = (min(pair) for pair in zip(*taken, strict=True))
    overhead = 100.0 * (there / here - 1.0)
    note = f"{there:.1f} s against {here:.1f} s in this process"
    yield Row(f"Dask, 2 workers, {count} samples: overhead", overhead, "%", 15.0, note=note)


def _tuning() -> Iterator[Row]:
    from actuator_lti import load_design
    from analyses.tuning import tune

    seconds, result = _timed(lambda: tune(load_design("ilr33-amber")))
    note = f"{result.evaluations} designs, {result.corners} corners"
    yield Row("tuning of the baseline with its trade-off curve", seconds, "s", note=note)
