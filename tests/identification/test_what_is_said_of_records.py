"""One cause in a record that is otherwise right: it is named, first, and no verdict says otherwise."""

import re

import numpy as np
import pytest

from actuator_lti.design import load_design
from analyses.correlation.asked import Asked
from analyses.correlation.closed_loop import correlate_record
from analyses.correlation.run import Correlation
from analyses.records.record import Record
from tests.identification.bench_records import Columns, motion, record_of, signals_of

DRIVE = load_design("ilr33-amber")


@pytest.fixture(scope="module")
def columns() -> Columns:
    return signals_of(motion(2), 1)


def _record(columns: Columns, *names: str, **changed: np.ndarray) -> Record:
    columns = {**columns, **changed}
    return record_of(columns["time"], **{name: columns[name] for name in names})


def _correlated(record: Record) -> tuple[bool, str]:
    """Whether the drive that made a record is told to be it, and all that contradicts."""
    result = correlate_record(DRIVE, record)
    wrong = "; ".join(f"{one.subject}: {one.text}" for one in result.findings if one.passed is False)
    return Correlation(DRIVE, Asked(records=[]), (result,)).passed, wrong


@pytest.mark.parametrize("clock", [1.0, 1.03, 0.96])
def test_the_model_of_a_record_tells_its_clock(clock: float, columns: Columns) -> None:
    record = _record(columns, "reference", "angle", "current", time=clock * columns["time"])
    passed, wrong = _correlated(record)
    assert passed is (clock == 1.0), wrong
    if clock != 1.0:
        off = re.search(r"a clock about (\S+) % off", wrong)
        assert off
        assert float(off[1]) == pytest.approx(100.0 * (clock - 1.0), rel=0.05)
