"""A run looks at guards only where one may be near, and goes as if it looked at all of them at every tick."""

import pytest

from actuator_lti import load_design
from actuator_lti.design.model import Design
from nonlinear import Rows
from nonlinear.runs.running import Running
from tests.nonlinear.elastic_drive import random_drive

SINES = ((0.3, 2.0), (0.02, 15.0), (1e-3, 70.0))  # rad, Hz
TICKS, PIECES = 100, 10


def drive_of(design: Design, size_rad: float, frequency_Hz: float) -> Running:
    rows = Rows.of(design)
    rows.sine("command", size_rad, frequency_Hz)
    return rows.running()


def events_of_agreeing(design: Design) -> float:
    """Events of runs in one go, after they had the bits of runs tick by tick, which look at every guard."""
    events = 0.0
    for sine in SINES:
        at_once, by_ticks = drive_of(design, *sine), drive_of(design, *sine)
        for _ in range(PIECES):
            at_once.run(TICKS)
            for _ in range(TICKS):
                by_ticks.run(1)
            assert at_once.s[at_once.matter].tolist() == by_ticks.s[by_ticks.matter].tolist()
            assert at_once.happened == by_ticks.happened
        events += at_once.happened[0]
    return events


@pytest.mark.parametrize("name", ["ilr33-amber-compliant", "joint", "ballscrew", "fin"])
def test_shipped_drives(name: str) -> None:
    assert events_of_agreeing(load_design(name)) > 0


def test_random_drives() -> None:
    assert sum(events_of_agreeing(random_drive(seed)[0]) for seed in range(40)) > 10_000
