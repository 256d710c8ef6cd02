"""The compiled kernels are the written ones, bit for bit; which library is loaded; refusals to emit."""

import os
import threading
from collections.abc import Callable
from typing import Any

import control
import numpy as np
import pytest
from programs import needs_compiler

from actuator_lti import Design, InputError, load_design, stability_margins
from actuator_lti.axis.library import LIBRARY as AXIS
from actuator_lti.batch import Population, linear_figures
from actuator_lti.batch.library import LIBRARY as FIGURES
from actuator_lti.compiled import compiler
from actuator_lti.compiled.kernel import kernel
from actuator_lti.compiled.kinds import EmitError
from actuator_lti.compiled.library import Library
from actuator_lti.compiled.program import emit_c
from nonlinear import Probe, Reducers, Run, Trajectory, commands, loads, native, simulate, simulate_many
from nonlinear._kernels.forms import forms
from nonlinear.row.parameters import design_row
from tests.changed import changed
from tests.validation.rich_drives import rich_drive, sizes

quiet = pytest.mark.filterwarnings("ignore:.*encountered in scalar:RuntimeWarning")  # Python divides by 0


def same_as_written(work: Callable[[], Trajectory]) -> Trajectory:
    """A run that is the same, to the bit, by the compiled kernels and by those as written."""
    ours = work()
    with native.LIBRARY.written():
        theirs = work()
    assert ours.parameters_hash == theirs.parameters_hash
    for name, values in ours.columns().items():
        assert values.tobytes() == theirs.columns()[name].tobytes(), name
    assert (ours.status, ours.limits) == (theirs.status, theirs.limits)
    assert repr((ours.final, ours.energy)) == repr((theirs.final, theirs.energy))  # NaN where a run failed
    return ours


@quiet
@pytest.mark.parametrize("seed", range(10))
def test_runs_have_the_bits_of_the_kernels_as_written(seed: int) -> None:
    design = rich_drive(200 + seed)
    (size, load), period_s = sizes(design), design.controller.period_s
    point = "i_ref" if design.controller.current else "u"
    probe = Probe(point=point, injection=commands.sine(0.01 * design.limits.voltage_V, 0.1 / period_s))

    def work() -> Trajectory:
        return simulate(
            design, commands.chirp(size, 1e-3 / period_s, 9e-3 / period_s, 100 * period_s), 150 * period_s,
            loads.constant(load), energy=seed % 4 > 1, probes=[probe] if seed % 3 == 0 else [],
            record_every=1 + seed % 2, raise_on_failure=False,
        )  # fmt: skip

    same_as_written(work)


@quiet
@pytest.mark.parametrize(("name", "delay_ticks", "form"), [
    *((f"ilr33-amber{name}", delay, f"{form}_{2 if delay < 1.0 else 3}")
      for name, form in (("", "dry"), ("-tanh", "tanh"), ("-compliant", "elastic"))
      for delay in (0.0, 0.3, 1.0, 1.7)),
    ("emps", 0.0, "rigid"), ("ballscrew", 1.0, "two_sided"),
    ("fin", 0.5, "measured_voltage"), ("joint", 1.0, "measured_current"),
])  # fmt: skip
def test_a_form_of_the_loop_has_the_bits_of_the_kernels_as_written(name: str, delay_ticks: float, form: str):
    """Through stick, slip and limits; the last form that fits, which is taken, is this drive's own."""
    design = load_design(name)
    period_s = design.controller.period_s
    design = changed(design, controller={"computing_delay_s": delay_ticks * period_s})
    p, _ = native.parameters(design_row(design))
    fits = [each.name for each in forms() if all(p[place] == value for place, value in each.known.items())]
    assert fits[-1] == form

    def work() -> Trajectory:
        return simulate(design, commands.triangle(2e-3, 40.0), 600 * period_s, loads.constant(3.0))

    ours = same_as_written(work)
    assert form.startswith("tanh") or ours.events > 3
    assert ours.limit_flags.any()


@quiet
def test_batches_have_the_bits_of_the_kernels_as_written() -> None:
    def one(design: Design) -> Run:
        (size, _), period_s = sizes(design), design.controller.period_s
        reducers = Reducers(window_ticks=50, harmonics=3, extremes=True, step_target_rad=size)
        return Run(
            design=design,
            command=commands.sine(size, 5e-3 / period_s),
            duration_s=200 * period_s,
            reducers=reducers,
        )

    runs = [one(rich_drive(seed)) for seed in (3, 4, 5)]
    ours = simulate_many(runs)
    with native.LIBRARY.written():
        theirs = simulate_many(runs, threads=1)
    assert ours.outs.tobytes() == theirs.outs.tobytes()
    assert ours.status.tolist() == theirs.status.tolist()


def test_a_run_leaves_the_interpreter_to_other_threads() -> None:
    """Somebody counts while a run is under way: the call has released the GIL."""
    design, counted, done = load_design("ilr33-amber"), 0, threading.Event()

    def run() -> None:
        simulate(design, commands.sine(0.05, 1.0), 20.0, record_every=1000)
        done.set()

    thread = threading.Thread(target=run)
    thread.start()
    while not done.is_set():
        counted += 1
    thread.join()
    assert counted > 10_000


@pytest.fixture
def library(tmp_path) -> Library:
    """The library of many designs' figures in a package of its own."""
    return Library("figures", tmp_path, FIGURES.entries, FIGURES.sources)


def test_a_library_is_named_by_its_sources(library: Library, tmp_path) -> None:
    changed = tmp_path / "_more.py"
    changed.write_text("# more\n")
    other = Library("figures", tmp_path, FIGURES.entries, (*FIGURES.sources, changed))
    assert library.path().parent == tmp_path / "_native"
    assert library.path() != other.path()
    assert other.path("win32-AMD64").suffix == ".dll"


def _figures() -> np.ndarray:
    design = load_design("ctms-motor-position")
    gain = design.parameters["control.position.gain"].value
    population = Population(design, {"control.position.gain": gain * np.array([1.0, 1.1])}, 2)
    return linear_figures(population, time_figures=False).raw


def _margins() -> np.ndarray:
    """Over a resonance, an integrator and a delay: the search of the axis, passages and distances."""
    found = stability_margins(control.tf([0.2, 0.3, 9.0], [1.0, 0.3, 9.0, 0.0]), delay_s=0.1)
    assert len(found.gain_margins) > 1
    gains = [one.ratio for one in found.gain_margins]
    return np.array([found.gain_margin_db, found.phase_margin_deg, found.modulus_margin, *gains])


@pytest.mark.parametrize(("work", "library"), [(_figures, FIGURES), (_margins, AXIS)])
def test_figures_are_those_of_the_kernels_as_written(work: Callable[[], np.ndarray], library: Library):
    """To rounding: Python's hypot is not the C library's."""
    ours = work()
    with library.written():
        np.testing.assert_allclose(ours, work(), rtol=1e-9)


@needs_compiler
def test_a_checkout_compiles_at_its_first_call_and_drops_what_is_old(library: Library) -> None:
    old = library.path().with_name(f"figures-0123456789abcdef-{compiler.HERE}.so")
    old.parent.mkdir()
    old.write_bytes(b"")
    assert library.functions.many_loops is not None
    assert [path.name for path in old.parent.iterdir()] == [library.path().name]


def no_compiler(patch: pytest.MonkeyPatch, _: Library) -> None:
    for name in ("system_compiler", "zig_command"):
        patch.setattr(compiler, name, lambda: None)


def of_another_machine(_: pytest.MonkeyPatch, library: Library) -> None:
    library.path().parent.mkdir()
    library.path().write_bytes(b"\x7fELF of another machine")


@pytest.mark.parametrize(("lack", "words"), [
    (no_compiler, r"gcc, clang, or pip install ziglang; then python -m nonlinear\.native: margins"),
    (lambda patch, _: patch.setattr(os, "access", lambda *_: False), "no compiled kernels of these"),
    (of_another_machine, "does not load"),
])  # fmt: skip
def test_a_library_that_cannot_be_had_is_one_line_and_none_is_made(lack, words, library, monkeypatch) -> None:
    lack(monkeypatch, library)
    before = library.path().parent.exists()
    with pytest.raises(InputError, match=words):
        _ = library.functions
    assert library.path().parent.exists() is before


@kernel
def push(s, at, x):
    old = s[at]
    s[at] = x
    return old


@kernel
def power(x):
    return x**2


@kernel
def two_types(x):
    y = 0
    y = x + 1.0
    return 2.0 * y


@kernel
def open_order(s):
    """A look into a row beside a call that writes it."""
    return s[0] + push(s, 0, 1.0)


@kernel
def twice(s):
    """Two writers in one expression."""
    return push(s, 0, 1.0) - push(s, 0, 2.0)


@kernel
def truth(x):
    if x:
        return 1.0
    return 2.0


@kernel
def sliced(s):
    s[0:2] = 1.0


@kernel
def strange(s):
    return load_design(s[0])


@pytest.mark.parametrize(("function", "kinds", "words"), [
    (strange, ["row"], "load_design is no compiled function"),
    (power, ["float"], "Pow is not in the subset"),
    (two_types, ["float"], "y is a int and becomes a float"),
    (open_order, ["row"], "writes s beside another use of s"),
    (twice, ["row"], "writes s beside another use of s"),
    (truth, ["float"], "a float as a condition"),
    (sliced, ["row"], "Slice is not in the subset"),
    (push, ["row", "row"], "takes"),
])  # fmt: skip
def test_what_is_outside_the_subset_is_refused_with_its_place(function: Any, kinds: Any, words: str) -> None:
    with pytest.raises(EmitError, match=rf"test_native\.py:[0-9]+: {function.__name__}: .*{words}"):
        emit_c({function: kinds})
