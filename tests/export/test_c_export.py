"""The exported C is the simulator: the same bits in every row, one source; margins of its loops."""

import ctypes
import re
import shutil
import subprocess
import zipfile
from ast import literal_eval
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from programs import needs_compiler, ran

import reports.exports as exports
from actuator_lti import load_design
from actuator_lti.compiled import compiler
from actuator_lti.compiled.library import Library
from actuator_lti.design import design_hash
from analyses.linear.code_check import CodeCheck, check_code
from nonlinear import commands, loads, simulate
from nonlinear._kernels import layout as at
from nonlinear._kernels.start import retune
from nonlinear.export import c_export
from nonlinear.export.c_files import exported_row, spare_parameters
from nonlinear.export.program import source_hash
from nonlinear.native import LIBRARY, parameters, tick
from reports.exports import check_text, summary
from tests.validation.rich_drives import random_inputs, rich_drive

ELASTIC = ("ballscrew", "fin", "ilr33-amber-compliant", "joint")
STRICT = ("-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-pedantic", "-Werror")


def compiled(path: Path, texts: dict[str, str]) -> Path:
    sources = {name: text for name, text in texts.items() if name[-2:] in (".c", ".h") and name != "main.c"}
    path.write_bytes(compiler.compile_files(sources, "drive.so", "linux64", (*STRICT, "-shared", "-fPIC")))
    return path


def said_by(folder: Path, texts: dict[str, str], *arguments: str, command: list[str] | None = None) -> str:
    """What a program of these files prints; no warning is let through."""
    program = folder / "program"
    program.write_bytes(compiler.compile_files(texts, "program", "linux64", STRICT, command=command))
    program.chmod(0o755)
    return ran(folder, str(program), *arguments)


@pytest.fixture(scope="module")
def library(once) -> ctypes.CDLL:
    texts = c_export(load_design("ilr33-amber"))
    return ctypes.CDLL(str(once("exported.so", lambda path: compiled(path, texts))))


def pointer(row: np.ndarray) -> ctypes.c_void_p:
    return ctypes.c_void_p(row.ctypes.data)


class Twins:
    """One drive twice: by the library of the simulator, and by the exported C."""

    def __init__(self, library: ctypes.CDLL, row: np.ndarray) -> None:
        self.library = library
        sizes = (*(each.size for each in parameters(row)), at.IO_SIZE)
        self.rows, self.c_rows = (tuple(map(np.zeros, sizes)) for _ in range(2))
        self.set(slice(0, at.SIZE), row)
        self.derive()
        LIBRARY.functions.init(*self.rows[:2])
        library.drive_init(*map(pointer, self.c_rows[:2]))

    def set(self, place: int | slice, value: float | np.ndarray) -> None:
        self.rows[0][place] = self.c_rows[0][place] = value

    def derive(self) -> None:
        (p, s, _), (p_c, s_c, _) = self.rows, self.c_rows
        LIBRARY.functions.prepare_sizes(p)
        LIBRARY.functions.derive(p, s)
        self.library.drive_prepare_sizes(pointer(p_c))
        self.library.drive_derive(pointer(p_c), pointer(s_c))
        assert p.tobytes() == p_c.tobytes()

    def retune(self) -> None:
        self.derive()
        retune(*self.rows[:2])
        self.library.drive_retune(*map(pointer, self.c_rows[:2]))

    def tick(self, command: float, moment: float) -> int:
        for rows in (self.rows, self.c_rows):
            rows[2][at.IN_COMMAND], rows[2][at.IN_LOAD] = command, moment
        status = int(tick(*self.rows))
        assert self.library.drive_tick(*map(pointer, self.c_rows)) == status
        for row, twin in zip(self.rows[1:], self.c_rows[1:], strict=True):
            assert row.tobytes() == twin.tobytes()
        return status


@needs_compiler
@pytest.mark.parametrize("seed", range(120))
def test_every_row_has_the_same_bits_in_random_drives(library: ctypes.CDLL, seed: int) -> None:
    """Both through random inputs, every row compared at every tick."""
    design, rng = rich_drive(seed), np.random.default_rng(seed)
    twins = Twins(library, exported_row(design))
    for command, moment in np.transpose(random_inputs(design, rng, 250)):
        assert twins.tick(command, moment) == at.OK
    assert np.abs(twins.rows[1][at.S_CURRENT]) > 0.0
    assert twins.rows[1][at.S_STATUS] == at.OK


@needs_compiler
@pytest.mark.parametrize("name", ELASTIC)
def test_parameters_changed_on_the_way_have_the_same_bits(library: ctypes.CDLL, name: str) -> None:
    """Coupling, friction and play of another design between two ticks: contact and slip are found again."""
    row = exported_row(load_design(name))
    for place in (at.STIFFNESS, at.HALF_PLAY, at.DRY, at.VISCOUS):
        twins = Twins(library, row)
        p = twins.rows[0]
        twins.rows = (np.concatenate([p, np.zeros(spare_parameters(p))]), *twins.rows[1:])
        twins.c_rows = (twins.rows[0].copy(), *twins.c_rows[1:])
        for k in range(1600):
            if k % 200 == 100:
                factor = 4.0 if k % 400 == 100 else 0.25
                twins.set(place, float(twins.rows[0][place]) * factor)
                twins.retune()
            assert twins.tick(0.02, 0.1 * np.cos(0.02 * k)) == at.OK
        assert twins.rows[1][at.S_ANGLE] != 0.0


@needs_compiler
def test_two_drives_interleave_and_each_goes_back(library: ctypes.CDLL) -> None:
    """Two designs in one program tick in turns; one is saved, runs ahead, goes on twice elsewhere."""
    rng, designs = np.random.default_rng(8), (rich_drive(1), rich_drive(2))
    assert [design.coupling is None for design in designs] == [True, False]
    twins = [Twins(library, exported_row(design)) for design in designs]
    inputs = [random_inputs(design, rng, 300) for design in designs]
    p, s, io = twins[1].c_rows
    kept, behind = np.zeros_like(s), io.copy()
    for k in range(300):
        if k == 120:
            library.drive_get(pointer(p), pointer(s), pointer(kept))
            behind = io.copy()
        for each, (command, moment) in zip(twins, inputs, strict=True):
            assert each.tick(command[k], moment[k]) == at.OK
    for _ in range(2):
        there = np.zeros_like(s)
        library.drive_set_state(pointer(p), pointer(there), pointer(kept))
        io[:] = behind
        for command, moment in np.transpose(inputs[1])[120:]:
            io[at.IN_COMMAND], io[at.IN_LOAD] = command, moment
            assert library.drive_tick(pointer(p), pointer(there), pointer(io)) == at.OK
        assert there.tobytes() == twins[1].rows[1].tobytes()


@needs_compiler
@pytest.mark.parametrize("name", ["ilr33-amber-multirate", "emps", *ELASTIC])
@pytest.mark.parametrize("command", ["gcc", "clang"])
def test_the_example_builds_without_a_warning_and_is_the_simulator(name: str, command: str, tmp_path):
    if shutil.which(command) is None:
        pytest.skip(f"no {command} on this machine")
    design = load_design(name)
    ours = {file: text for file, text in c_export(design).items() if file != "README.md"}
    said = said_by(tmp_path, ours, "400", "0.01", command=[command])
    table = np.array([[float(x) for x in line.split(",")] for line in said.splitlines()[1:]])
    run = simulate(design, commands.step(0.01), 400 * design.controller.period_s, loads.constant(0.0))
    assert np.array_equal(table[:, 1], run.output_angle_rad)
    assert np.array_equal(table[:, 4], run.voltage_V)
    assert np.array_equal(table[:, 5].astype(np.uint16), run.limit_flags)


@needs_compiler
@pytest.mark.parametrize("name", ["ilr33-amber", "ilr33-amber-multirate", "emps", "ctms-motor-position"])
def test_single_precision_keeps_its_stated_error(name: str, tmp_path) -> None:
    design = load_design(name)
    lib = ctypes.CDLL(str(compiled(tmp_path / "drive.so", c_export(design, single_precision=True))))
    P, S = parameters(exported_row(design))
    p, s, io = (np.zeros(n, np.float32) for n in (P.size, S.size, at.IO_SIZE))
    lib.drive_load_design(pointer(p))
    lib.drive_prepare_sizes(pointer(p))
    lib.drive_derive(pointer(p), pointer(s))
    lib.drive_init(pointer(p), pointer(s))
    IO = np.zeros(at.IO_SIZE)
    period, full = design.controller.period_s, design.validation.full_deflection_rad
    worst = 0.0
    for k in range(round(1.0 / period)):
        io[at.IN_COMMAND] = IO[at.IN_COMMAND] = 0.5 * full * np.sin(2.0 * np.pi * 2.0 * k * period)
        assert lib.drive_tick(pointer(p), pointer(s), pointer(io)) == tick(P, S, IO) == at.OK
        worst = max(worst, abs(float(io[at.IO_OUTPUT]) - IO[at.IO_OUTPUT]))
    assert 0.0 < worst < 1e-3 * full  # the README of the export says so


@pytest.mark.parametrize("single", [False, True])
def test_the_headers_say_which_design_and_source_and_name_the_flags(single: bool) -> None:
    """Texts of C and of Python have the same octal signs."""
    design = replace(load_design("emps"), name='a "b" 1.5')
    texts = c_export(design, single_precision=single)
    said = re.findall(r'^#define DRIVE_(?:DESIGN_NAME|\w+_HASH) ("[^"]*")', texts["drive_design.h"], re.M)
    assert list(map(literal_eval, said)) == [design.name, design_hash(design), source_hash()]
    flags = dict(re.findall(r"DRIVE_FLAG_(\w+) = (\d+)", texts["drive.h"]))
    assert [int(flags[name]) for name in ("VOLTAGE", "AT_REST")] == [at.FLAG_VOLTAGE, at.FLAG_STICK]


@pytest.mark.skipif(shutil.which("cppcheck") is None, reason="no cppcheck on this machine")
def test_every_deviation_from_misra_is_listed(tmp_path) -> None:
    texts = c_export(load_design("ilr33-amber"))
    for name, text in texts.items():
        (tmp_path / name).write_text(text)
    call = ["cppcheck", "--addon=misra", "--std=c99", "--enable=style", "drive.c", "drive_design.c"]
    done = subprocess.run(call, cwd=tmp_path, capture_output=True, text=True, check=True)
    result = set(re.findall(r"misra-c2012-([0-9.]+)", done.stderr))
    assert result  # the addon has run
    listed = set(re.findall(r"\b[0-9]+\.[0-9]+\b", texts["README.md"].partition("## MISRA")[2]))
    assert result <= listed
    assert "error:" not in done.stderr


def test_drive_c_is_the_same_for_every_design_and_has_no_memory_of_its_own() -> None:
    one, other = c_export(load_design("ilr33-amber")), c_export(load_design("emps"))
    assert one["drive.c"] == other["drive.c"]
    assert one["drive_design.c"] != other["drive_design.c"]
    code = re.sub(r"/\*.*?\*/", "", one["drive.c"], flags=re.DOTALL)
    for word in ("malloc", "calloc", "printf", "static double ", "static int drive_state"):
        assert word not in code.replace("static double drive_", ""), word
    outside = [line for line in code.splitlines() if line.startswith("static") and "(" not in line]
    assert all(line.startswith("static const ") for line in outside)


@needs_compiler
@pytest.mark.parametrize("name", ["ilr33-amber", "ctms-motor-position"])
def test_the_compiled_code_has_the_margins_of_the_loops(name: str) -> None:
    result = check_code(load_design(name))
    assert not result.reason
    assert not result.failed
    gain = result.largest("gain_margin")
    assert 0.0 < gain.error < 1e-6 * (gain.predicted or 0.0)
    assert {"response", "gain_margin", "phase_margin", "delay_margin"} <= {row.name for row in result.entries}


@needs_compiler
def test_a_wrong_code_is_seen(monkeypatch) -> None:
    """The current controller's gain two per cent too high in the C file alone."""
    text = replace(LIBRARY, forms=tuple).text()
    wrong = text.replace("p[CURRENT_GAIN]", "(1.02 * p[CURRENT_GAIN])")
    assert wrong != text
    monkeypatch.setattr(Library, "text", lambda _: wrong)
    result = check_code(load_design("ilr33-amber"))
    assert {entry.loop for entry in result.failed} >= {"current", "u"}
    assert "| not met |" in check_text(result)


def test_without_a_compiler_it_says_so(monkeypatch) -> None:
    monkeypatch.setattr(compiler, "system_compiler", lambda: None)
    result = check_code(load_design("ilr33-amber"))
    assert result.reason.startswith("no C compiler")
    assert not result.entries
    assert "Not measured: no C compiler" in check_text(result)
    assert "not measured" in summary(result)


@needs_compiler
def test_exports_say_what_was_measured(tmp_path, monkeypatch, cli) -> None:
    name, unit = "ctms-motor-position", tmp_path / "u.fmu"
    said = cli.text("export", "c", name, "--out", tmp_path / "c")
    assert "predictions of the linear loops are met by the compiled code" in said
    words = (tmp_path / "c/README.md").read_text()
    assert "## Margins of the compiled code" in words
    assert "| Position loop | phase margin | deg |" in words
    cli.text("export", "c", name, "--no-check", "--out", tmp_path / "d")
    assert "Not measured at this export" in (tmp_path / "d/README.md").read_text()
    monkeypatch.setattr(exports, "check_code", lambda _: CodeCheck(reason="said here"))
    cli.text("export", "fmu", name, "--platform", "linux64", "--out", unit)
    with zipfile.ZipFile(unit) as archive:
        assert b"Not measured: said here" in archive.read("documentation/compiled_code.md")
