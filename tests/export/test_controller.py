"""The controller cut out of the tick for firmware: the simulator's numbers, no library, no warning."""

import re
import shutil
import struct
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from programs import ran

from actuator_lti.compiled.compiler import zig_command
from actuator_lti.design import Design, design_hash, load_design, shipped_designs, with_overrides
from nonlinear._kernels import layout as at
from nonlinear.export import controller_export
from nonlinear.export.controller_cut import controller_of
from tests.loops.own_laws import random_law
from tests.validation.rich_drives import rich_drive

STRICT = (
    "-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-pedantic", "-Werror", "-Wdouble-promotion",
    "-Wfloat-conversion",
)  # fmt: skip
PROGRAMS = Path(__file__).with_name("firmware")
MATHEMATICS = {"sqrt", "floor", "sqrtf", "floorf"}  # of a profile with limited acceleration
pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc on this machine")


def written(folder: Path, design: Design, *, single: bool, prefix: str = "drive_") -> Path:
    for name, text in controller_export(design, single_precision=single, prefix=prefix).items():
        (folder / name).write_text(text)
    return folder


def said_by(folder: Path, source: Path | str) -> str:
    """What a program around the controller prints."""
    flags = ("-std=c99", "-O1", "-ffp-contract=off", *STRICT[:6], "-I.")
    ran(folder, "gcc", *flags, str(source), "controller.c", "-lm", "-o", "run")
    return ran(folder, "./run")


def worst_of(folder: Path) -> dict[str, tuple[float, float]]:
    """Runs the vectors; difference and bound of each signal."""
    *lines, last = said_by(folder, "main.c").splitlines()
    rows = [line.split(",") for line in lines[2:]]
    assert int(last.split()[0]) > 10
    return {f"{name}{k}": (float(a), float(b)) for k, (name, a, b) in enumerate(rows)}


def without_library(folder: Path) -> set[str]:
    """Compiles for a machine without any; the functions that it calls all the same."""
    ran(folder, "gcc", "-std=c99", "-O2", "-ffreestanding", "-nostdlib", *STRICT, "-c", "controller.c")
    return {*ran(folder, "nm", "-u", "controller.o").split()} - {"U"}


@pytest.mark.parametrize("single", [False, True])
@pytest.mark.parametrize("name", shipped_designs())
def test_vectors_of_the_simulator_hold_and_no_library_is_called(name: str, single: bool, tmp_path: Path):
    folder = written(tmp_path, load_design(name), single=single)
    assert without_library(folder) <= (MATHEMATICS if name in ("joint", "ballscrew") else set())
    worst = worst_of(folder)
    assert all(difference <= bound for difference, bound in worst.values())
    moved = max(difference for difference, _ in worst.values())
    assert (moved > 0.0) if single else (moved < 1e-10)


@pytest.mark.parametrize("single", [False, True])
@pytest.mark.parametrize("name", ["fin", "ballscrew"])
def test_the_readme_says_what_sizeof_gives_and_how_to_compile(name: str, single: bool, tmp_path: Path):
    """Padding is what the compiler says; the line of the readme links what a profile with a root calls."""
    folder, readme = written(tmp_path, load_design(name), single=single), (tmp_path / "README.md")
    assert said_by(folder, PROGRAMS / "size.c") in readme.read_text()
    amperes = "1.225 A is 1 A rms, 0.866 A is 1 A peak of a phase"  # sqrt(3/2) and sqrt(3)/2, of an AC motor
    assert (amperes in readme.read_text()) == (name == "ballscrew")
    (line,) = re.findall(r"^    (cc .*) && ./vectors$", readme.read_text(), re.M)
    ran(folder, *line.split())


CORTEX_M4F = ("-target", "thumb-freestanding-eabihf", "-mcpu=cortex_m4+vfp4d16sp")


@pytest.mark.skipif(zig_command() is None, reason="ziglang is not installed")
@pytest.mark.parametrize("name", shipped_designs())
def test_it_links_for_a_cortex_m4f_with_no_library_at_all(name: str, tmp_path: Path) -> None:
    """No library of the compiler either: a ``double`` or a copied array would miss its function here."""
    folder = written(tmp_path, load_design(name), single=True)
    (folder / "math.h").write_text("float sqrtf(float);\nfloat floorf(float);\n")
    zig, *cc = zig_command() or ()
    plain = ("-std=c99", "-O2", "-ffp-contract=off", "-ffreestanding", "-nostdlib", "-isystem", ".", "-I.")
    ran(folder, zig, *cc, *CORTEX_M4F, *plain, str(PROGRAMS / "chip.c"), "controller.c", "-o", "chip")
    data = (folder / "chip").read_bytes()
    machine, flags = struct.unpack_from("<H", data, 18)[0], struct.unpack_from("<I", data, 36)[0]
    assert (machine, flags & 0x400) == (40, 0x400)  # ARM, floating-point numbers in registers
    begin, size, count = (
        struct.unpack_from(form, data, at)[0] for form, at in (("<I", 32), ("<H", 46), ("<H", 48))
    )
    sections = [struct.unpack_from("<6I", data, begin + k * size) for k in range(count)]
    code = sum(length for _, kind, flags, _, _, length in sections if kind == 1 and flags & 2)
    assert 100 < code < 3000  # the page on hosts says so


@pytest.mark.parametrize("seed", range(8))
def test_vectors_hold_for_random_drives(seed: int, tmp_path: Path) -> None:
    folder = written(tmp_path, rich_drive(seed), single=bool(seed % 2))
    assert without_library(folder) <= MATHEMATICS
    worst_of(folder)


@pytest.mark.parametrize("order", [0, 2, 16])
@pytest.mark.parametrize("stage", ["current", "velocity", "position"])
def test_a_law_of_one_s_own_has_the_simulator_s_bits(stage: str, order: int, tmp_path: Path) -> None:
    """No input that the law does not take is asked for; in ``float`` it is within the bound."""
    design = random_law(np.random.default_rng(order), load_design("ilr33-amber"), stage, order=order)
    folder = written(tmp_path, design, single=False)
    assert without_library(folder) == set()
    assert {difference for difference, _ in worst_of(folder).values()} == {0.0}
    assert max(worst_of(written(tmp_path, design, single=True)).values())[0] > 0.0
    taken = design.controller.own_law[1].inputs
    header = (folder / "controller.h").read_text()
    assert ("output_speed_rad_s" in header) == ("output_speed" in taken)
    assert f"law_states[{order}];" in header or not order


@pytest.mark.parametrize("above", [1e-3, 5e-3])
def test_single_precision_adds_up_an_overload_of_a_per_mille(above: float, tmp_path: Path) -> None:
    """x goes to (i/i_cont)^2 by T/tau of the way a tick: a millionth of it was less than half an ulp of x."""
    limits = {"limits.continuous_current": "4 A", "limits.peak_current": "12 A", "limits.peak_time": "2 s"}
    design = with_overrides(load_design("ilr33-amber"), limits)
    written(tmp_path, design, single=True)
    square, part = (1.0 + above) ** 2, design.controller.period_s * np.log(9.0 / 8.0) / 2.0
    (tmp_path / "long.c").write_text(
        (PROGRAMS / "long.c").read_text().replace("CURRENT", f"{4 + 4 * above}f")
    )
    assert float(said_by(tmp_path, "long.c")) == pytest.approx(
        np.log1p(-1 / square) / np.log1p(-part), rel=1e-3
    )


def test_a_coefficient_that_is_off_is_seen(tmp_path: Path) -> None:
    folder = written(tmp_path, load_design("ilr33-amber"), single=False)
    source = (folder / "controller.c").read_text()
    assert "0.0008 *" in source  # of the velocity integral
    (folder / "controller.c").write_text(source.replace("0.0008 *", "0.000800000001 *"))
    ran(folder, "gcc", "-std=c99", "main.c", "controller.c", "-o", "run")
    done = subprocess.run([str(folder / "run")], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert re.search(r"\b[1-9]\d* outside of the bound", done.stdout)


@pytest.mark.skipif(shutil.which("g++") is None, reason="no g++ on this machine")
def test_two_designs_in_one_program_of_cpp_by_their_prefixes(tmp_path: Path) -> None:
    for prefix, name in (("one_", "ilr33-amber"), ("two_", "emps")):
        folder = tmp_path / prefix.removesuffix("_")
        folder.mkdir()
        written(folder, load_design(name), single=True, prefix=prefix)
        ran(folder, "gcc", "-std=c99", *STRICT, "-c", "controller.c")
        symbols = [line.split()[-1] for line in ran(folder, "nm", "-g", "controller.o").splitlines()]
        assert len(symbols) == 3
        assert all(symbol.startswith(prefix) for symbol in symbols)
    call = ("-std=c++11", "-Wall", "-Wextra", "-Werror", "-I.", str(PROGRAMS / "host.cpp"))
    ran(tmp_path, "g++", *call, "one/controller.o", "two/controller.o", "-o", "host")
    assert ran(tmp_path, "./host") == f"1|{at.FLAG_VOLTAGE}|{design_hash(load_design('ilr33-amber'))}|emps"


@pytest.mark.parametrize(("name", "angles"), [("joint", {"output_counts"}), ("ballscrew", set())])
@pytest.mark.parametrize("single", [True, False])
def test_a_count_that_is_an_angle_may_not_go_round(name: str, angles: set[str], single: bool) -> None:
    """The joint's position loop reads counts of the output; a speed takes differences of the motor's."""
    ours = controller_of(load_design(name), "drive_", single_precision=single)
    counts = {each.name: each.first in ours.angles for each in ours.measured.members if each.kind == "count"}
    assert counts == {name: name in angles for name in {"motor_counts", *angles}}


@pytest.mark.parametrize("speed", [{"difference_samples": 3}, {"speed": "tracking", "bandwidth": "300 Hz"}])
def test_counts_of_the_encoder_go_round(speed: dict[str, Any], tmp_path: Path) -> None:
    """A turning drive from two counts, one of which passes the largest on the way, has the same bits."""
    encoder = {"counts_per_rev": "4096", "speed": "difference", **speed}
    changes = {f"encoder.{key}": value for key, value in encoder.items()}
    written(tmp_path, load_design("ilr33-amber").with_values(changes), single=True)
    assert "motor_counts; /* count of the encoder; it may go round" in (tmp_path / "controller.h").read_text()
    said_by(tmp_path, PROGRAMS / "round.c")


def test_firmware_with_a_sensor_at_the_output_stays_where_that_stands(tmp_path: Path) -> None:
    """A count is 12 urad, times gain and ratio 0.01 rad/s; from the motor's zero it would run off."""
    written(tmp_path, load_design("joint"), single=True)
    assert "`output_counts / DRIVE_CONTROLLER_OUTPUT_COUNTS_PER_RAD`" in (tmp_path / "README.md").read_text()
    assert "output_counts; /* count of the encoder; it may not" in (tmp_path / "controller.h").read_text()
    said_by(tmp_path, PROGRAMS / "stay.c")


def test_counts_of_a_linear_axis_are_told_by_the_metre(tmp_path: Path) -> None:
    """4096 a revolution of a lead of 10 mm."""
    encoder = {"encoder.counts_per_rev": "4096", "encoder.speed": "difference"}
    written(tmp_path, with_overrides(load_design("ballscrew"), encoder), single=True)
    header = (tmp_path / "controller.h").read_text()
    assert "#define DRIVE_CONTROLLER_COUNTS_PER_M 409600.0f" in header
    assert "PER_RAD" not in header
