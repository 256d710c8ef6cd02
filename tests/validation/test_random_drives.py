"""A handful of random drives: no traceback, no false failure, within the time."""

from __future__ import annotations

from dataclasses import replace

import pytest

from analyses.isolation import isolated
from analyses.validation import validate
from analyses.validation.budget import Budget, OutOfTime
from tests.validation.random_drives import TRIAL, full_drive, random_drive

RIGID = (1, 2, 3, 16)
WIDER = (501, 504, 508)
# feed-forward, filters, AC motors, couplings, supplies, torque drives
# 704: a mode that feed-forward hides; 1049: one that it kicks
FULL = (16, 24, 36, 47, 200, 201, 704, 1049)


@pytest.mark.parametrize(("seed", "wider"), [*((s, False) for s in RIGID), *((s, True) for s in WIDER)])
def test_a_random_stable_drive_has_no_false_failure(seed: int, wider: bool) -> None:
    with isolated() as missing:
        validation = validate(random_drive(seed, wider=wider), replace(TRIAL, seconds=120.0))
    assert not missing
    assert validation.failed == ()
    assert all(row.reason for row in validation.ledger if row.passed is None)


@pytest.mark.parametrize("seed", FULL)
def test_a_random_drive_with_every_feature_has_no_false_failure(seed: int) -> None:
    with isolated() as missing:
        validation = validate(full_drive(seed), replace(TRIAL, seconds=120.0))
    assert not missing
    assert validation.failed == ()
    assert validation.judged
    assert all(row.reason for row in validation.ledger if row.passed is None)


def test_a_part_is_cut_when_its_share_is_used_up() -> None:
    """By a clock of its own: one second at every look."""
    seconds = iter(range(1000))
    budget = Budget(20.0, clock=lambda: float(next(seconds)))

    def endless() -> str:
        while True:
            budget.look()

    assert budget.within(0.25, "a part", endless, "nothing") == "nothing"
    assert len(budget.cut) == 1
    assert "a part: cut after" in budget.cut[0]
    assert budget.left > 5.0
    with pytest.raises(OutOfTime), budget.part(0.1):
        endless()
