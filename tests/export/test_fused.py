"""What fused multiply-add does to a run: the sentence of the exported README, measured."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from actuator_lti.compiled.compiler import compile_files, system_compiler
from actuator_lti.design import Design, load_design, shipped_designs
from nonlinear import Rows
from nonlinear.native import LIBRARY
from tests.validation.rich_drives import rich_drive

CPU = Path("/proc/cpuinfo")
pytestmark = pytest.mark.skipif(
    system_compiler() is None or not CPU.is_file() or " fma " not in CPU.read_text(encoding="utf-8"),
    reason="no C compiler, or no fused multiply-add on this machine",
)


@pytest.fixture(scope="module")
def fused(once) -> Path:
    """The simulator compiled with products and sums in one rounding."""
    flags = ("-O2", "-shared", "-fPIC", "-mfma", "-ffp-contract=fast")
    command = [str(system_compiler())]

    def compiled(path: Path) -> None:
        exported = replace(LIBRARY, forms=tuple)
        path.write_bytes(compile_files({"run.c": exported.text()}, "run.so", "x", flags, command=command))

    return once("fused.so", compiled)


def apart(design: Design, fused: Path, ticks: int = 3000) -> float:
    """Largest difference to the simulator's angle, speed, current and voltage, each of its own size."""
    found = []
    for path in (LIBRARY.build(), fused):
        rows = Rows.of(design)
        rows["ticks"], rows["load"] = ticks, 0.1
        turns = np.sin(2.0 * np.pi * 3.0 * np.arange(ticks) / ticks)
        rows.series("command", 0.3 * design.validation.full_deflection_rad * turns)
        with LIBRARY.borrowed(path):
            run = rows.trajectory()
        found.append(
            np.transpose([run.output_angle_rad, run.motor_speed_rad_s, run.current_A, run.voltage_V])
        )
    plain, other = found
    there = plain.any(axis=0)  # a force source has no current
    return float((np.abs(plain - other).max(axis=0)[there] / np.abs(plain).max(axis=0)[there]).max())


@pytest.mark.parametrize("name", shipped_designs())
def test_shipped_designs_stay_within_rounding(name: str, fused: Path) -> None:
    assert apart(load_design(name), fused) < 1e-11


def test_a_count_on_the_other_side_is_seen(fused: Path) -> None:
    """Drives with counts, noise, friction: most agree to rounding, and some differ far beyond it."""
    sizes = [apart(rich_drive(seed), fused) for seed in (*range(10, 20), 50, 197, 264, 294)]
    assert np.median(sizes) < 1e-9
    assert max(sizes) > 1e-5
