"""Every number of a design is confronted, exactly: no false alarm, and 1 % is seen."""

from contextlib import suppress
from dataclasses import replace
from functools import cache
from math import isfinite
from typing import Any

import numpy as np
import pytest

from actuator_lti import InputError
from actuator_lti.asked.verdict import Verdict
from actuator_lti.design import load_design, parameter_value, paths_of, shipped_designs, with_values
from actuator_lti.design.law import LAW_WORDS
from actuator_lti.design.model import Design, FrictionPoint, Instruments, Supply
from analyses.validation.design_values import design_value_rows
from analyses.validation.torque_values import edge
from tests.changed import changed
from tests.loops.own_laws import random_law
from tests.validation.mutation_table import DRIVES, PAGE, keys_of, seen
from tests.validation.random_drives import drives, full_drive
from tests.validation.rich_drives import rich_drive

AMBER = load_design("ilr33-amber")


def red(design: Design, model: Design) -> set[str]:
    return {row.name for row in design_value_rows(design, model) if row.verdict is not Verdict.MET}


def found(design: Design, name: str, condition: str = "") -> float:
    row = next(r for r in design_value_rows(design) if r.name == name and condition in r.condition)
    return row.found


@pytest.mark.parametrize("name", shipped_designs())
def test_every_row_is_met_on_a_shipped_drive(name: str) -> None:
    rows = design_value_rows(load_design(name))
    assert len(rows) >= 6
    assert [str(row) for row in rows if row.verdict is not Verdict.MET] == []
    assert len({row.key for row in rows}) == len(rows)  # no two rows of a drive are one question


def test_no_false_alarm_on_random_drives() -> None:
    """And where a twist of 5e4 rad, faint friction, sin(pi) were rounded; where dry friction acts one way."""
    rounded = map(full_drive, (80365, 1094, 240, 723))
    one_way = {"friction.dry_torque": 0.0, "friction.dry_torque_reverse": 2e-3}
    rubbing = (with_values(load_design(name), one_way) for name in ("ctms-motor-position", "ballscrew"))
    rich = (rich_drive(seed, own_law=False) for seed in range(60))
    for design in (*rounded, *rubbing, *rich, *drives(9000, 150)):
        assert red(design, design) == set(), design.name


def test_no_false_alarm_beside_a_law_of_ones_own() -> None:
    """Of any signals, in any stage: one that takes the current answers it, one of position has no error."""
    tried = 0
    for seed, design in enumerate(drives(9000, 120)):
        rng = np.random.default_rng(seed)
        stage = str(rng.choice(design.controller.stages))
        with suppress(InputError):  # filters of the speed beside a law that takes it
            own = random_law(rng, design, stage, words=LAW_WORDS)
            assert red(own, own) == set(), (design.name, stage, own.controller.own_law[1].inputs)
            tried += 1
    assert tried > 50


def larger(design: Design, path: str) -> Design:
    """A design with one of its numbers 1 % larger; the same where it has none."""
    value = parameter_value(design, path) if path in paths_of(design) else 0.0
    return with_values(design, {path: 1.01 * value}, check=False) if value and isfinite(value) else design


STEADY, BUS, LOAD = {"steady_torque"}, {"bus_voltage"}, {"coupling_torque", "load_breakaway_moment"}
# what is changed, rows that are red, and where it has a part in a run and is not faint beside what has
CHANGES: dict[str, tuple[Any, ...]] = {
    "friction.dry_torque": (STEADY, lambda design: not design.friction.points),
    "friction.dry_torque_reverse": (STEADY, lambda design: not design.friction.points),
    "friction.load_coefficient": (STEADY,),
    "friction.offset_torque": (STEADY,),
    "friction.point.2.torque": (STEADY,),
    "load.friction.dry_torque": (LOAD, lambda design: design.coupling),
    "coupling.play": ({"half_play"},),
    "motor.rotor_inertia": (set(),),
    "limits.voltage": ({"voltage_limit"},),
    "limits.speed": ({"speed_limit"}, lambda design: design.controller.velocity),
    "limits.peak_current": ({"current_limit"}, lambda design: design.controller.current),
    "limits.acceleration": ({"acceleration_limit"}, lambda design: design.controller.velocity),
    "command.rate": ({"command_rate"}, lambda design: design.controller.velocity),
    "supply.resistance": (BUS,),
    "supply.capacitance": (BUS,),
    "supply.brake_voltage": ({"brake_voltage"},),
}


@cache
def _wide() -> tuple[Design, ...]:
    return tuple(drives(12_000, 60))


@pytest.mark.parametrize("path", CHANGES)
def test_one_per_cent_is_seen_on_random_drives(path: str) -> None:
    """Whatever the drive: a row that is named is red, and the reverse, drive and model exchanged, too."""
    names, *acts = CHANGES[path]
    pairs = [(design, larger(design, path)) for design in _wide() if all(act(design) for act in acts)]
    tried = [pair for pair in pairs if pair[0] != pair[1]][:12]
    assert tried, "no such drive drawn"
    for one, other in (order for pair in tried for order in (pair, pair[::-1])):
        assert red(one, other), (one.name, path)
        assert red(one, other) >= names, (one.name, path)


def test_thirds_of_a_map_and_directions_are_told_apart() -> None:
    """One wrong point of a map is seen, of one direction alone, and only there."""
    points = tuple(
        FrictionPoint(speed_rad_s=w, torque_Nm=T, direction=side)
        for side, scale in (("forward", 1.0), ("reverse", 1.3))
        for w, T in ((0.0, 2e-3 * scale), (50.0, 1.5e-3 * scale), (400.0, 3e-3 * scale))
    )
    design = changed(AMBER, friction={"dry_torque_Nm": 0.0, "viscous_Nms_rad": 0.0, "points": points})
    last = replace(points[-1], torque_Nm=1.01 * points[-1].torque_Nm)
    model = changed(design, friction={"points": (*points[:-1], last)})
    bad = [row for row in design_value_rows(design, model) if row.verdict is not Verdict.MET]
    assert {row.name for row in bad} == {"steady_torque"}
    assert all(row.condition.startswith("at -") for row in bad)
    assert all(abs(float(row.condition.split()[1])) > 50.0 for row in bad)


def test_the_time_of_an_overload_is_that_of_the_model() -> None:
    """Model.md section 6: r = 3, 1 s."""
    held = changed(AMBER, limits={"peak_time_s": 1.0})
    assert found(held, "overload_time") == pytest.approx(8.490187, abs=1e-6)


def test_supply_and_resolution_by_hand() -> None:
    supply = Supply(resistance_ohm=0.02, regenerative=False, capacitance_F=1e-3, brake_voltage_V=15.0)
    design = replace(AMBER, supply=supply, instruments=Instruments(current_resolution_A=5e-3))
    assert red(design, design) == set()
    assert found(design, "bus_voltage", "taken") == pytest.approx(12.0 - 0.5 * 12.0, rel=1e-12)
    assert found(design, "bus_voltage", "fed back") == pytest.approx(12.0 * 1.2**0.5, rel=1e-12)
    assert found(design, "brake_voltage") == 15.0
    finer = replace(design, instruments=Instruments(current_resolution_A=4.95e-3))
    assert red(design, finer) == {"current_resolution"}
    slower = changed(design, limits={"peak_time_s": 1.0, "release": 0.8})
    assert red(slower, changed(slower, limits={"release": 0.808})) == {"overload_release"}


def test_an_edge_is_found_beside_where_it_is_predicted_or_far() -> None:
    assert edge(lambda x: x > 2.0, 2.0, 2e-7, 4.0) == pytest.approx(2.0, rel=1e-11)
    assert edge(lambda x: x > 2.2, 2.0, 2e-7, 4.0) == pytest.approx(2.2, rel=1e-11)
    assert edge(lambda x: x < -2.2, -2.0, -2e-7, -4.0) == pytest.approx(-2.2, rel=1e-11)
    assert edge(lambda x: x > 9.0, 2.0, 2e-7, 4.0) is None


def rows_of_page(name: str) -> dict[str, str]:
    part = PAGE.read_text(encoding="utf-8").split(f"## {name}\n")[1].split("\n## ")[0]
    return {line.split("`")[1]: line for line in part.splitlines() if line.startswith("| `")}


def drawn() -> list[tuple[str, str]]:
    """Some keys of each drive, the same every time."""
    rng = np.random.default_rng(24)
    return [(name, str(key)) for name in DRIVES for key in rng.choice(keys_of(load_design(name)), 4, False)]


@pytest.mark.parametrize(("name", "key"), drawn())
def test_a_key_of_the_table_is_seen_by_the_row_it_names(name: str, key: str) -> None:
    change, row, why = seen(load_design(name), key)
    assert (f"| {change} | {row} |" if row else why) in rows_of_page(name)[key]


def test_the_table_has_every_key_and_nothing_sleeps() -> None:
    for name in DRIVES:
        assert set(rows_of_page(name)) == set(keys_of(load_design(name)))
    assert "NOT SEEN" not in PAGE.read_text(encoding="utf-8")
