"""Margins by amplitude: what is not asked is said."""

from analyses.large_signal.by_amplitude import TOO_MANY, margins_by_amplitude
from analyses.validation.places import Bench
from tests.validation.random_drives import full_drive


def test_a_way_back_of_hours_is_not_simulated() -> None:
    """114 kg that 0.18 N speeds up for an hour, at 47 kHz; the table says so of each margin."""
    drive = full_drive(1_600_015)
    found = list(margins_by_amplitude(Bench(drive, drive)))
    assert len(found) == 12
    assert all(one.too_long and one.value is None for one in found)
    assert TOO_MANY * drive.controller.period_s < 900.0  # 12 values and more
