"""The hosts of docs/hosts.md, each run as it stands there."""

import re
import shutil
import sys
from pathlib import Path

import pytest
from programs import needs_compiler, needs_node, ran

from actuator_lti import load_design
from nonlinear import Drive, commands, loads, simulate
from nonlinear._kernels import layout as at

PAGE = (Path(__file__).parents[2] / "docs" / "hosts.md").read_text(encoding="utf-8")
PARTS = dict(re.findall(r"(?ms)^## ([^\n]+)\n(.*?)(?=^## |\Z)", PAGE))
CC = shutil.which("gcc") or shutil.which("clang")


def block(title: str, language: str, number: int = 0) -> str:
    return re.findall(rf"(?ms)^```{language}\n(.*?)^```", PARTS[title])[number]


def exported(folder: Path, title: str) -> None:
    for line in block(title, "sh").splitlines():
        words = line.split()
        assert words[0] == "actuator-lti"
        ran(folder, sys.executable, "-m", "reports.cli", *words[1:])


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
def test_the_host_in_c_has_the_bits_of_the_simulator(truth: float, tmp_path: Path) -> None:
    exported(tmp_path, "C")
    assert float(compiled(tmp_path, "C", "drive.c", "drive_design.c")) == truth


@needs_compiler
def test_two_designs_in_one_program_each_have_the_bits_of_the_simulator(tmp_path: Path) -> None:
    title = "Several designs in one program"
    exported(tmp_path, title)
    files = ("worm/drive.c", "worm/worm_design.c", "soft/soft_design.c")
    lines = compiled(tmp_path, title, "-Iworm", "-Isoft", *files).splitlines()
    for column, (name, size) in enumerate((("ilr33-amber", 0.01), ("ilr33-amber-compliant", 0.02))):
        run = simulate(load_design(name), commands.step(size), 0.1001, loads.constant(0.0))
        assert [float(line.split(",")[column]) for line in lines] == run.output_angle_rad.tolist()


@needs_compiler
def test_the_host_of_the_unit(truth: float, tmp_path: Path) -> None:
    pytest.importorskip("fmpy", reason="FMPy is not installed (pip install 'actuator-lti[export]')")
    exported(tmp_path, "The unit")
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
def test_the_controller_s_first_step(tmp_path: Path) -> None:
    exported(tmp_path, "The controller alone")
    voltage, at_limit = compiled(tmp_path, "The controller alone", "controller.c").split()
    drive = Drive(load_design("ilr33-amber"))
    assert float(voltage) == drive.control(0.01, 0.0, 0.0, 0.0)
    assert int(at_limit) == int(drive.value("flags_outer")) & at.FLAG_SPEED == 1
