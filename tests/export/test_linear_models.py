"""Linear models in a file have the margins and responses of their loops; figures followed from the keys."""

import json
import math
from collections.abc import Callable
from math import isqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from programs import executed
from scipy.io import loadmat

from actuator_lti import assemble_loops, load_design, stability_margins
from actuator_lti.asked.drive_figure import drive_figure
from actuator_lti.design import write_design
from actuator_lti.design.access import parameter_value, paths_of, stacked
from actuator_lti.design.model import Design
from actuator_lti.loops import exact_margins
from actuator_lti.systems.plain_system import PlainDelaySystem, PlainSystem
from nonlinear.export.page import changes_figure, changes_row, figure_statements
from reports.linear_models import margins_tree
from tests.validation.rich_drives import rich_drive

NAMES = ("ilr33-amber", "ilr33-amber-multirate", "ballscrew", "ctms-motor-position", "emps")
OTHERS = [("ilr33-amber-multirate", "json"), ("ctms-motor-position", "python"), ("emps", "json")]


@pytest.fixture
def written(cli, tmp_path) -> Callable[[str, str], Path]:
    def call(name: str, to: str) -> Path:
        path = tmp_path / f"models.{'py' if to == 'python' else to}"
        cli.text("export", "linear", name, "--to", to, "--out", path)
        return path

    return call


def read(path: Path) -> dict[str, Any]:
    """The tree of a file, by what any program has."""
    if path.suffix == ".mat":
        return loadmat(path, simplify_cells=True)
    if path.suffix == ".json":
        return json.loads(path.read_text(encoding="utf-8"))
    scope: dict[str, Any] = {}
    exec(path.read_text(encoding="utf-8"), scope)
    return scope["MODELS"]


def system(entry: dict[str, Any]) -> Any:
    """The system of an entry, its matrices in their shapes: MATLAB drops those of one row or column."""
    n, k = isqrt(np.size(entry["A"])), np.size(entry.get("delays_s", ()))
    shapes = {
        "A": (n, n), "B": (n, 1), "C": (1, n), "D": (1, 1), "B1": (n, 1), "B2": (n, k), "C1": (1, n),
        "C2": (k, n), "D11": (1, 1), "D12": (1, k), "D21": (k, 1), "D22": (k, k), "delays_s": (k,),
    }  # fmt: skip
    parts = {p: np.asarray(entry[p], dtype=float).reshape(size) for p, size in shapes.items() if p in entry}
    more = {} if "delays_s" in entry else {"dt": float(entry["dt"])}
    names = tuple(map(str, np.atleast_1d(entry["states"])))
    return (PlainDelaySystem if "delays_s" in entry else PlainSystem)(**parts, **more, states=names)


def same(found: Any, known: Any) -> bool:
    if isinstance(known, str):
        return bool(found == known)
    equal = np.allclose(np.ravel(found), np.ravel(known), rtol=1e-12, atol=0.0)
    return bool(equal) and np.size(found) == np.size(known)


@pytest.mark.parametrize(("name", "to"), [*((name, "mat") for name in NAMES), *OTHERS])
def test_read_back_they_have_the_same_margins_and_responses(name: str, to: str, written) -> None:
    tree = read(written(name, to))
    for form in ("sampled", "continuous"):
        loops, kept = assemble_loops(name, form), tree[form]
        for place, ours in (("loops", loops.present), ("break_points", loops.break_points)):
            assert set(kept[place]) == set(ours)
            for each, loop in ours.items():
                entry = kept[place][each]
                assert entry["open_loop"]["output_unit"] == loop.unit_out
                assert responds_alike(system(entry["closed_loop"]), loop.plain_closed)
                assert responds_alike(system(entry["sensitivity"]), loop.plain_sensitivity)
                if loop.periodic:
                    exact = exact_margins(loops, loop.break_point)
                    assert same(entry["margins"]["gain_upper"], exact.gain_upper)
                    continue
                found = stability_margins(loop.plain_open)
                assert same(entry["margins"]["gain_margins"], [one.ratio for one in found.gain_margins])
                assert same(entry["margins"]["phase_margins_deg"], [one.deg for one in found.phase_margins])
                again = margins_tree(system(entry["open_loop"]))
                assert set(again) == set(entry["margins"])
                for key, value in again.items():
                    assert same(entry["margins"][key], value), (each, key)
        assert responds_alike(system(kept["responses"]["command"]), loops.plain_response)
        assert responds_alike(system(kept["responses"]["load"]), loops.load_torque_system())


def responds_alike(found: Any, known: Any) -> bool:
    w = np.geomspace(0.1, 3000.0, 40)
    points = np.exp(1j * w * known.dt) if known.dt else 1j * w
    return same(found(points), known(points)) and tuple(found.states) == tuple(known.states)


def test_it_says_which_forms_there_are_and_that_the_command_is_behind_its_mean(cli, tmp_path) -> None:
    """The screw's jerk is limited by a mean over 2 * 4/(100 * 0.5 ms) samples; a law has one form."""
    told = cli.text("export", "linear", "ballscrew", "--out", path := tmp_path / "screw.json")
    assert "mean of 160 samples" in told
    assert "sampled and continuous" in told
    assert read(path)["sampled"]["responses"]["command"]["behind_mean_of_samples"] == 160
    assert "1.225 A is 1 A rms" in read(path)["design"]["amperes"]
    law = load_design("emps").with_law("position", ([], [], [], [[300.0]], 1e-3), inputs=["error"])
    (own := tmp_path / "own.toml").write_text(write_design(law), encoding="utf-8")
    told = cli.text("export", "linear", own, "--out", path := tmp_path / "own.json")
    assert ", sampled, " in told
    assert "mean" not in told
    assert read(path)["sampled"]["responses"]["command"]["behind_mean_of_samples"] == 1


def test_the_python_file_makes_python_control_systems(written) -> None:
    """A program that knows nothing but the file, numpy and python-control."""
    scope: dict[str, Any] = {}
    exec(written("emps", "python").read_text(encoding="utf-8"), scope)
    ours = scope["system"](scope["MODELS"]["sampled"]["loops"]["position"]["open_loop"])
    known, z = assemble_loops("emps").position, np.exp(1j * 100.0 * ours.dt)
    assert ours(z) == pytest.approx(known.open_loop(z), rel=1e-12)
    delayed = scope["system"](scope["MODELS"]["continuous"]["loops"]["position"]["open_loop"])
    continuous = assemble_loops("emps", "continuous").position
    assert delayed(100j) == pytest.approx(continuous.open_loop(100j), rel=1e-12)


FIGURES = ("output_rate", "motor_current", "acceleration", "torque_margin", "lost_motion")


def drives() -> list[Design]:
    """Random ones, friction maps, uneven friction, supplies and stages that lock themselves among them."""
    return [*map(rich_drive, range(24)), *map(load_design, ("ilr33-amber", "fin", "emps", "joint"))]


def scattered(keys: dict[str, float], spread: float, rng: np.random.Generator) -> list[float]:
    """Every value over decades; the speeds of a friction map together, as their order is its structure."""
    together = 10.0 ** rng.uniform(-spread, spread)
    own = [10.0 ** rng.uniform(-spread, spread) for _ in keys]
    return [
        value * (together if path.startswith("friction.point") and path.endswith("speed") else factor)
        for (path, value), factor in zip(keys.items(), own, strict=True)
    ]


@pytest.mark.parametrize("place", range(len(drives())))
def test_a_followed_figure_is_the_figure_at_other_values(place: int) -> None:
    """Over a decade of every key at once the statements give what the drive asked anew gives."""
    design, rng = drives()[place], np.random.default_rng(place)
    known = {path: parameter_value(design, path) for path in paths_of(design) if changes_row(design, path)}
    keys, compared = {path: value for path, value in known.items() if value != 0.0}, 0
    for name in FIGURES:
        if name == "motor_current" and not design.motor.has_electrical_dynamics:
            continue
        for load in (0.0, 0.3 * (design.load.moment_max_Nm or 5.0)):
            lines = figure_statements(design, keys, name, load)
            for spread in (0.0, 0.1, 0.5, 1.0):
                values = scattered(keys, spread, rng)
                got = executed([line.c for line in lines], values)
                changed = stacked(design, dict(zip(keys, values, strict=True)))
                wanted = float(drive_figure(changed, name, load))
                assert got[0] == pytest.approx(wanted, rel=1e-12, nan_ok=True), (design.name, name, load)
                compared += math.isfinite(wanted)
    assert compared > 10


def test_what_sets_a_figure_changes_it_and_nothing_else() -> None:
    design = load_design("ilr33-amber")
    assert changes_figure(design, "limits.speed", "output_rate", 0.0)
    assert not changes_figure(design, "control.position.gain", "output_rate", 0.0)
    assert not changes_figure(design, "motor.resistance", "lost_motion", 0.0)
