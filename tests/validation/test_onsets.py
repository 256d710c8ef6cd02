"""The amplitude at which each limit first acts is judged by the running drive, exactly."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from actuator_lti import load_design, onset
from actuator_lti.asked.verdict import Verdict
from actuator_lti.design import shipped_designs
from actuator_lti.design.model import Design
from analyses.validation import CHECKS, validate
from analyses.validation.places import Bench
from analyses.validation.row import Row
from analyses.validation.small_signal import Place, small_signal
from tests.validation.random_drives import full_drive


def rows(design: Design, model: Design | None = None) -> dict[str, Row]:
    places = Bench(design, design if model is None else model).onsets()
    return {row.name: row for place in places for row in small_signal(place)}


@pytest.mark.parametrize("name", shipped_designs())
def test_every_limit_of_a_shipped_drive(name: str) -> None:
    """Each limiter that the limit of linear validity lists has its row, and it is met."""
    design = load_design(name)
    bench = Bench(design, design)
    border = onset(bench.loops("command"), [10.0])
    wanted = {f"{each}_onset".replace("-", "_") for each, at in border.each_rad.items() if np.isfinite(at[0])}
    found = rows(design)
    assert set(found) == wanted
    assert {row.verdict for row in found.values()} == {Verdict.MET}
    assert max(row.allowed for row in found.values()) < 1e-5


@pytest.mark.parametrize("seed", [730_010, 730_018, 730_037, 730_051])
def test_speed_drives_and_clamped_integrals(seed: int) -> None:
    found = rows(full_drive(seed))
    assert {row.verdict for row in found.values()} == {Verdict.MET}


def test_the_clamped_integral_is_one_of_them() -> None:
    assert "voltage_onset_integral" in rows(full_drive(730_037))


def one_per_cent_more(place: Place, z: np.ndarray) -> np.ndarray:
    return 1.01 * place.predicted(z)


@pytest.mark.parametrize("name", ["ilr33-amber-multirate", "joint"])
def test_one_per_cent_of_the_linear_side_is_not_met(name: str) -> None:
    """Of every limiter: its response scaled, and a gain that all of them feel."""
    design = load_design(name)
    bench = Bench(design, design)
    for place in bench.onsets():
        (row,) = small_signal(replace(place, predicted=partial(one_per_cent_more, place)))
        assert row.verdict is Verdict.NOT_MET, row
        assert row.error == pytest.approx(0.01, rel=0.02)
    control = design.controller
    place = replace(control.position, gain=1.01 * control.position.gain)
    seen = rows(design, replace(design, controller=replace(control, position=place)))
    assert {row.verdict for row in seen.values()} == {Verdict.NOT_MET}


def test_they_are_rows_of_a_validation() -> None:
    result = validate(load_design("joint"), CHECKS)
    names = {row.name for row in result.rows if row.loop == "command"}
    assert names >= {"overload_onset", "torque_command_onset", "acceleration_onset"}
    assert result.passed
    assert all(f"{name}_onset".replace("-", "_") in names for name in ("speed", "current", "voltage"))
