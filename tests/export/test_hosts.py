"""The hosts of docs/hosts.md, each run as it stands there; the drive as a WebAssembly module."""

import hashlib
import re
import shutil
import sys
from collections.abc import Callable
from dataclasses import replace
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from programs import in_json, in_node, needs_compiler, needs_node, ran

from actuator_lti import load_design
from actuator_lti.compiled.compiler import zig_command
from actuator_lti.design.model import Instruments
from nonlinear import Drive, commands, loads, simulate
from nonlinear._kernels import layout as at
from nonlinear.export.c_files import exported_row
from nonlinear.export.wasm_module import MOST_BYTES, build_wasm, kept_wasm, record, sources_hash
from nonlinear.native import parameters, tick
from tests.validation.rich_drives import random_inputs, rich_drive

PAGE = (Path(__file__).parents[2] / "docs" / "hosts.md").read_text(encoding="utf-8")
PARTS = dict(re.findall(r"(?ms)^## ([^\n]+)\n(.*?)(?=^## |\Z)", PAGE))
CC = shutil.which("gcc") or shutil.which("clang")


def block(title: str, language: str, number: int = 0) -> str:
    return re.findall(rf"(?ms)^```{language}\n(.*?)^```", PARTS[title])[number]


@pytest.fixture
def exported(tmp_path: Path, monkeypatch, cli) -> Callable[[str], None]:
    """Run the commands of a part of the page in the folder of the test."""

    def call(title: str) -> None:
        monkeypatch.chdir(tmp_path)
        for line in block(title, "sh").splitlines():
            program, *words = line.split()
            assert program == "actuator-lti"
            cli.text(*words)

    return call


def compiled(folder: Path, title: str, *files: str) -> str:
    (folder / "host.c").write_text(block(title, "c"))
    call = ("-std=c99", "-O2", "-ffp-contract=off", "-Wall", "-Wextra", "-Werror", "host.c", *files)
    ran(folder, str(CC), *call, "-lm", "-o", "host")
    return ran(folder, str(folder / "host"))


@pytest.fixture(scope="module")
def truth() -> float:
    design = load_design("ilr33-amber")
    run = simulate(design, commands.step(0.01), 1001 * design.controller.period_s, loads.constant(0.0))
    assert design.controller.period_s == 1e-4
    return float(run.output_angle_rad[1000])


@needs_compiler
def test_the_host_in_c_has_the_bits_of_the_simulator(truth: float, tmp_path: Path, exported) -> None:
    exported("C")
    assert float(compiled(tmp_path, "C", "drive.c", "drive_design.c")) == truth


@needs_compiler
def test_two_designs_in_one_program_each_have_the_bits_of_the_simulator(tmp_path: Path, exported) -> None:
    title = "Several designs in one program"
    exported(title)
    files = ("worm/drive.c", "worm/worm_design.c", "soft/soft_design.c")
    lines = compiled(tmp_path, title, "-Iworm", "-Isoft", *files).splitlines()
    for column, (name, size) in enumerate((("ilr33-amber", 0.01), ("ilr33-amber-compliant", 0.02))):
        run = simulate(load_design(name), commands.step(size), 0.1001, loads.constant(0.0))
        assert [float(line.split(",")[column]) for line in lines] == run.output_angle_rad.tolist()


@needs_compiler
def test_the_host_of_the_unit(truth: float, tmp_path: Path, exported) -> None:
    pytest.importorskip("fmpy", reason="FMPy is not installed (pip install 'actuator-lti[export]')")
    exported("The unit")
    host = ran(tmp_path, sys.executable, "-c", block("The unit", "python"))
    assert float(host) == pytest.approx(truth, rel=1e-9)


@pytest.mark.parametrize("language", [pytest.param("javascript", marks=needs_node), "python"])
def test_the_host_of_the_module(language: str, truth: float, tmp_path: Path) -> None:
    ran(tmp_path, sys.executable, "-c", block("WebAssembly", "python"))
    if language == "python":
        pytest.importorskip("wasmtime", reason="wasmtime is not installed")
        host = ran(tmp_path, sys.executable, "-c", block("WebAssembly", "python", 1))
    else:
        (tmp_path / "host.mjs").write_text(block("WebAssembly", "javascript"))
        host = ran(tmp_path, "node", "host.mjs")
    assert float(host) == pytest.approx(truth, rel=1e-9)
    assert at.IO_OUTPUT == 14  # the page says so


@needs_compiler
def test_the_controller_s_first_step(tmp_path: Path, exported) -> None:
    exported("The controller alone")
    voltage, at_limit = compiled(tmp_path, "The controller alone", "controller.c").split()
    drive = Drive(load_design("ilr33-amber"))
    assert float(voltage) == drive.control(0.01, 0.0, 0.0, 0.0)
    assert int(at_limit) == int(drive.value("flags_outer")) & at.FLAG_SPEED == 1


AT = {
    "command": at.IN_COMMAND, "moment": at.IN_LOAD, "output": at.IO_OUTPUT, "speed": at.IO_SPEED,
    "current": at.IO_CURRENT,
}  # fmt: skip


def test_kept_module_is_made_of_these_sources() -> None:
    known, data = record(), kept_wasm()
    assert known["sources_sha256"] == sources_hash(), "the kernels have changed: make wasm"
    assert known["module_sha256"] == hashlib.sha256(data).hexdigest()
    assert len(data) == known["bytes"] <= MOST_BYTES
    assert data[:4] == b"\0asm"


def _same_compiler() -> bool:
    try:
        return zig_command() is not None and record()["compiler"] == f"ziglang {version('ziglang')}"
    except PackageNotFoundError:
        return False


@pytest.mark.skipif(not _same_compiler(), reason="the ziglang that made the module is not installed")
def test_building_again_gives_the_same_bytes() -> None:
    assert build_wasm() == kept_wasm()


def drive(seed: int, ticks: int = 400) -> tuple[dict[str, Any], np.ndarray]:
    """A drive with what comes into it, and what the simulator makes of it; no instruments, which round."""
    design = load_design("ilr33-amber") if seed < 0 else rich_drive(seed)
    design = replace(design, instruments=Instruments())
    command, moment = random_inputs(design, np.random.default_rng(200 + seed), ticks)
    row = exported_row(design)
    p, s = parameters(row)
    io, ours = np.zeros(at.IO_SIZE), np.empty((ticks, 3))
    for k in range(ticks):
        io[at.IN_COMMAND], io[at.IN_LOAD] = command[k], moment[k]
        assert tick(p, s, io) == at.OK
        ours[k] = io[at.IO_OUTPUT], io[at.IO_SPEED], io[at.IO_CURRENT]
    return {"row": in_json(row), "command": command.tolist(), "moment": moment.tolist()}, ours


@needs_node
def test_instances_interleave_have_the_simulators_motion_and_go_back(tmp_path) -> None:
    """Five designs in turns, to 1e-9 (another C library's exp); the last is saved and goes back twice."""
    units, motions = zip(*map(drive, (-1, 0, 2, 3, 1)), strict=True)
    done = in_node("wasm_host.mjs", tmp_path, units=units, at=AT, keep=150)
    for theirs, ours in zip(done["rows"], motions, strict=True):
        assert (np.abs(np.array(theirs) - ours).max(axis=0) <= 1e-9 * np.abs(ours).max(axis=0)).all()
    assert done["backs"] == [done["rows"][-1][150:]] * 2
