"""Loops and figures in the WebAssembly module against the linear form: two derivations of the same numbers.

In the module a loop is found by running the tick of the simulator; here it is assembled by the linear walk.
"""

from __future__ import annotations

import json
import math
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from random_drives import random_drive

from actuator_lti import assemble_loops, load_design
from actuator_lti.batch import Population, linear_figures
from actuator_lti.design.loader import shipped_designs
from actuator_lti.design.model import Design, Instruments
from actuator_lti.quantities import LOOP_QUANTITIES, LOOPS
from nonlinear._kernels import layout as at
from nonlinear.export import linear, linear_limiters
from nonlinear.export.c_files import exported
from nonlinear.parameters import design_row

MODULE = Path(__file__).parents[2] / "nonlinear/export/wasm/drive.wasm"
STAGES = {
    **{name: k for k, name in enumerate(LOOPS)},
    "w_ref": linear.AT_SPEED, "i_ref": linear.AT_CURRENT, "u": linear.AT_VOLTAGE,
}  # fmt: skip
ANGLES = np.geomspace(1e-2, 3.1, 40)  # rad per sample; below, z I - A of the linear form loses digits
FURTHEST_DB = 200.0  # a crossing further off than this is where rounding makes the phase

pytestmark = pytest.mark.skipif(shutil.which("node") is None, reason="no node on this machine")


def rigid(design: Design) -> bool:
    return bool(design_row(design)[at.ELASTIC_DRIVE] <= 0.0)


def in_node(designs: list[Design], folder: Path) -> list[dict[str, Any]]:
    def plain(value: float) -> float | str:
        return float(value) if np.isfinite(value) else str(value).replace("inf", "Infinity")

    given = {
        "rows": [[plain(value) for value in exported(design).row] for design in designs],
        "stages": STAGES,
        "quoted": len(LOOP_QUANTITIES) + 1,
        "angles": ANGLES.tolist(),
    }
    (folder / "given.json").write_text(json.dumps(given))
    host = Path(__file__).with_name("wasm_loops.mjs")
    call = ["node", str(host), str(MODULE), str(folder / "given.json")]
    done = json.loads(subprocess.run(call, capture_output=True, text=True, check=True).stdout)
    assert done["imports"] == []
    result: list[dict[str, Any]] = done["all"]
    return result


def numbers(values: list[Any]) -> np.ndarray:
    return np.array([float(str(value).replace("Infinity", "inf")) for value in values])


def figures_agree(design: Design, ours: dict[str, Any]) -> int:
    """Compare every figure of every loop; the number of loops compared."""
    theirs, count = linear_figures(Population(design, {}, 1)), 0
    for loop in theirs.loops:
        if ours[loop]["n"] == linear.PERIODIC:
            assert design.controller.velocity is not None
            assert design.controller.velocity.every > 1
            continue
        assert ours[loop]["n"] > 0
        got = numbers(ours[loop]["figures"])
        wanted = [float(theirs.quantity(name, loop)[0]) for name in LOOP_QUANTITIES]
        assert got[-1] == float(theirs.stable(loop)[0])
        for name, a, b in zip(LOOP_QUANTITIES, got, wanted, strict=False):
            if name == "gain_margin" and max(abs(a), abs(b)) > FURTHEST_DB:
                continue
            same = a == b or (math.isnan(a) and math.isnan(b))
            assert same or a == pytest.approx(b, rel=1e-9, abs=1e-9), (design.name, loop, name)
        count += 1
    return count


def responses_agree(design: Design, ours: dict[str, Any]) -> None:
    """Compare L on the unit circle: of each loop, and at each break point that is not periodic."""
    loops = assemble_loops(design)
    systems = {name: getattr(loops, name) for name in LOOPS} | dict(loops.break_points)
    for name in STAGES:
        known, system = ours[name], systems.get(name)
        if known["n"] <= 0:
            assert (
                known["n"] == linear.PERIODIC
                or system is None
                or (name == "w_ref" and loops.position is None)
            )
            continue
        assert system is not None
        assert known["period"] == pytest.approx(system.period_s, rel=1e-12)
        pairs = numbers(known["response"]).reshape(-1, 2)
        wanted = system.open_loop(np.exp(1j * ANGLES))
        got = pairs[:, 0] + 1j * pairs[:, 1]
        rounding = 1e-14 * np.abs(wanted).max()  # of the level: what is left beside a zero at Nyquist
        assert (np.abs(got - wanted) <= 1e-9 * np.abs(wanted) + rounding).all(), (design.name, name)


def limiters_agree(design: Design, ours: dict[str, Any]) -> int:
    """Compare the gain from the command to what stands in front of each limiter; the number compared."""
    control, loops = design.controller, assemble_loops(design)
    every = control.position.every if control.position else control.velocity.every if control.velocity else 1
    if ours["limiters"]["n"] <= 0:
        assert every > linear_limiters.MOST_TICKS
        return 0
    sizes = numbers(ours["limiters"]["sizes"]).reshape(3, -1)
    count = 0
    for name, signal in (("speed", 0), ("current", 1), ("voltage", 2)):
        path = loops.limiters.get(name)
        if path is None:
            continue
        wanted = np.abs(path.response(ANGLES / (every * control.period_s)))
        rounding = 1e-14 * wanted.max()  # far below its largest value a gain is a difference of large ones
        assert (np.abs(sizes[signal] - wanted) <= 1e-9 * wanted + rounding).all(), (design.name, name)
        count += 1
    return count


def test_shipped_designs(tmp_path: Path) -> None:
    designs = [design for name in shipped_designs() if rigid(design := load_design(name))]
    assert len(designs) >= 4
    for design, ours in zip(designs, in_node(designs, tmp_path), strict=True):
        assert figures_agree(design, ours) > 0
        responses_agree(design, ours)
        assert limiters_agree(design, ours) > 0


def test_drives_without_outer_stages(tmp_path: Path) -> None:
    whole = load_design("ilr33-amber")
    control = whole.controller
    designs = [
        replace(whole, controller=replace(control, **absent))
        for absent in (
            {"position": None},
            {"position": None, "velocity": None},
            {"velocity": None},
            {"current": None},
            {"current": None, "velocity": None},
        )
    ]
    for design, ours in zip(designs, in_node(designs, tmp_path), strict=True):
        assert figures_agree(design, ours) == len(design.controller.stages)
        responses_agree(design, ours)
        assert limiters_agree(design, ours) > 0


def test_random_drives(tmp_path: Path) -> None:
    """Filters, sensors, estimators, delays and periods at random; instruments do not matter to a loop."""
    made = (random_drive(np.random.default_rng(seed)) for seed in range(40))
    designs = [replace(design, instruments=Instruments()) for design in made if rigid(design)]
    result = in_node(designs, tmp_path)
    assert sum(figures_agree(design, ours) for design, ours in zip(designs, result, strict=True)) > 60
    compared = 0
    for design, ours in zip(designs, result, strict=True):
        responses_agree(design, ours)
        compared += limiters_agree(design, ours)
    assert compared > 40


def test_unstable_drives_are_called_so(tmp_path: Path) -> None:
    """Gains far beyond the margin: the verdict from the poles in the module is that of the linear form."""
    from actuator_lti.design import with_values

    design = load_design("ilr33-amber")
    designs = [
        with_values(design, {key: value}, check=False)
        for key, value in (
            ("control.position.gain", 6000.0),
            ("control.velocity.gain", 4.0),
            ("control.current.gain", 0.3),
        )
    ]
    verdicts = []
    for each, ours in zip(designs, in_node(designs, tmp_path), strict=True):
        theirs = linear_figures(Population(each, {}, 1))
        for loop in theirs.loops:
            verdicts.append(bool(theirs.stable(loop)[0]))
            assert (numbers(ours[loop]["figures"])[-1] == 1.0) == verdicts[-1]
    assert not all(verdicts)
    assert any(verdicts)
