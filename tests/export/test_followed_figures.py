"""Figures of the whole drive, followed from the keys into statements, against the same figures asked anew."""

import math

import numpy as np
import pytest
from executed import executed

from actuator_lti import load_design
from actuator_lti.asked.drive_figure import drive_figure
from actuator_lti.design.access import parameter_value, paths_of, stacked
from actuator_lti.design.model import Design
from nonlinear.export.page import changes_figure, changes_row, figure_statements
from tests.validation.rich_drives import rich_drive

NAMES = ("output_rate", "motor_current", "acceleration", "torque_margin", "lost_motion")


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
    for name in NAMES:
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
