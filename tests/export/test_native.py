"""The library built at installation gives numba's bits and has one switch."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from random_drives import random_drive, random_elastic_drive

import nonlinear.native as native
from actuator_lti.errors import InputError
from nonlinear import Probe, Reducers, Run, Trajectory, commands, loads, simulate, simulate_many
from nonlinear.export.build import system_compiler

needs_compiler = pytest.mark.skipif(system_compiler() is None, reason="no C compiler on this machine")


@pytest.fixture(scope="module", autouse=True)
def _own_folder(tmp_path_factory: pytest.TempPathFactory):  # type: ignore[no-untyped-def]
    """A library of these kernels in a folder of the test's own."""
    patch = pytest.MonkeyPatch()
    patch.setattr(native, "_FOLDER", tmp_path_factory.mktemp("native"))
    native.library_path.cache_clear()
    native._opened.cache_clear()
    if system_compiler() is not None:
        native.build()
    yield
    patch.undo()
    native.library_path.cache_clear()
    native._opened.cache_clear()


def both(monkeypatch: pytest.MonkeyPatch, work):  # type: ignore[no-untyped-def]
    result = []
    for choice in ("c", "numba"):
        monkeypatch.setenv(native.SWITCH, choice)
        result.append(work())
    return result


@needs_compiler
@pytest.mark.parametrize("seed", range(12))
def test_runs_have_the_same_bits(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(300 + seed)
    design = random_elastic_drive(rng) if seed % 2 else random_drive(rng)
    probe = Probe(point="i_ref", injection=commands.sine(0.1, 40.0))

    def work() -> Trajectory:
        return simulate(
            design, commands.chirp(0.05, 1.0, 40.0, 0.05), 0.05, loads.constant(2.0), energy=seed % 4 > 1,
            probes=[probe] if seed % 3 == 0 else [], record_every=1 + seed % 2, raise_on_failure=False,
        )  # fmt: skip

    ours, theirs = both(monkeypatch, work)
    assert ours.parameters_hash == theirs.parameters_hash
    for name, values in ours.columns().items():
        assert values.tobytes() == theirs.columns()[name].tobytes(), name
    assert ours.status == theirs.status
    assert repr((ours.final, ours.energy)) == repr((theirs.final, theirs.energy))  # NaN where a run failed
    assert ours.limits == theirs.limits


@needs_compiler
def test_batches_have_the_same_bits(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(5)
    runs = [
        Run(design=replace(random_drive(rng)), command=commands.sine(0.02, 20.0), duration_s=0.2,
            reducers=Reducers(window_ticks=500, harmonics=3, extremes=True, step_target_rad=0.02))
        for _ in range(6)
    ]  # fmt: skip
    ours, theirs = both(monkeypatch, lambda: simulate_many(runs))
    assert ours.outs.tobytes() == theirs.outs.tobytes()
    assert ours.status.tolist() == theirs.status.tolist()


def test_one_switch(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(native.SWITCH, "fortran")
    with pytest.raises(InputError, match="allowed: auto, c, numba"):
        native.kernel_name()
    monkeypatch.setenv(native.SWITCH, "numba")
    assert native.kernel_name() == "numba"
    if system_compiler() is not None:
        monkeypatch.setenv(native.SWITCH, "auto")
        assert native.kernel_name() == "C library"


def test_without_a_library_auto_is_numba_and_c_is_an_error(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(native, "library_path", lambda: tmp_path / "none.so")
    native._opened.cache_clear()
    monkeypatch.setenv(native.SWITCH, "auto")
    assert native.kernel_name() == "numba"
    monkeypatch.setenv(native.SWITCH, "c")
    with pytest.raises(InputError, match="no library of these kernels"):
        native.kernel_name()
    native._opened.cache_clear()


@needs_compiler
def test_numba_is_not_even_imported_where_the_library_is() -> None:
    code = (
        "import sys, pathlib, nonlinear.native as n; n._FOLDER = pathlib.Path(sys.argv[1])\n"
        "from actuator_lti import load_design\nfrom nonlinear import commands, simulate\n"
        "run = simulate(load_design('ilr33-amber'), commands.step(0.01), 0.1)\n"
        "assert abs(run.output_angle_rad[-1] - 0.01) < 1e-3\nassert 'numba' not in sys.modules\n"
    )
    call = [sys.executable, "-c", code, str(native._FOLDER)]
    done = subprocess.run(call, capture_output=True, text=True, env={**os.environ, native.SWITCH: "c"})
    assert done.returncode == 0, done.stderr
