"""Two recorders on one clock: the offset and the rate that were put in are found again."""

from __future__ import annotations

import numpy as np
import pytest

from actuator_lti.errors import InputError
from analyses.records import Record, RowCounts, join_records


def _record(name: str, time: np.ndarray, **signals: np.ndarray) -> Record:
    units = dict.fromkeys(signals, "1")
    counts = RowCounts(rows_in=len(time), rows_out=len(time))
    return Record(name=name, time_s=time, signals=signals, units=units, counts=counts)


def _happening(t: np.ndarray) -> np.ndarray:
    """A motion from 2 s to 16 s with soft edges."""
    return 1.0 / (1.0 + np.exp(-(t - 2.0) / 0.03)) - 1.0 / (1.0 + np.exp(-(t - 16.0) / 0.05))


def _pair(offset: float, rate: float, noise: float = 0.01) -> tuple[Record, Record]:
    """``t_first = offset + rate t_second``."""
    rng = np.random.default_rng(5)
    first = np.arange(0.0, 20.0, 1e-3)
    second = np.arange(0.0, (19.0 - offset) / rate, 2.3e-3)
    speed = 500.0 * _happening(first) + 500.0 * noise * rng.standard_normal(len(first))
    torque = -7.0 * _happening(offset + rate * second) + 7.0 * noise * rng.standard_normal(len(second))
    return _record("drive", first, speed=speed), _record("sensor", second, torque=torque)


@pytest.mark.parametrize("method", ["correlation", "event"])
@pytest.mark.parametrize(("offset", "rate"), [(0.7312, 1.0), (-0.4, 1.0002), (0.25, 0.9995)])
def test_offset_and_rate_are_found(method: str, offset: float, rate: float) -> None:
    first, second = _pair(offset, rate, 0.003)
    joined, join = join_records(
        first, second, first_signal="speed", second_signal="torque", method=method  # type: ignore[arg-type]
    )  # fmt: skip
    assert join.rate_std is not None
    assert abs(join.rate - rate) < max(5.0 * join.rate_std, 1e-4)
    middle = 9.0
    result = join.offset_s + join.rate * middle
    assert result == pytest.approx(offset + rate * middle, abs=2e-3)
    assert np.corrcoef(joined["speed"], -joined["torque"])[0, 1] > 0.999


def test_a_single_event_tells_no_rate() -> None:
    first, second = _pair(0.5, 1.0)
    early = second.slice(0, 3000)
    _, join = join_records(first, early, first_signal="speed", second_signal="torque", method="event")
    assert join.rate_std is None
    assert "rate not estimable" in str(join)


def test_the_given_offset_is_used_as_it_is() -> None:
    first, second = _pair(0.5, 1.0)
    joined, join = join_records(
        first, second, first_signal="speed", second_signal="torque", method="given", offset_s=0.5
    )
    assert join.offset_s == 0.5
    assert joined.time_s[0] >= 0.5
    assert "given offset" in joined.notes[-1]


def test_records_that_do_not_belong_together_are_refused() -> None:
    rng = np.random.default_rng(1)
    time = np.arange(0.0, 5.0, 1e-3)
    a = _record("a", time, speed=rng.standard_normal(5000))
    b = _record("b", time, torque=rng.standard_normal(5000))
    with pytest.raises(InputError, match="not alike"):
        join_records(a, b, first_signal="speed", second_signal="torque")
    flat = _record("c", time, torque=np.ones(5000))
    with pytest.raises(InputError, match="flat"):
        join_records(a, flat, first_signal="speed", second_signal="torque", method="correlation")
    with pytest.raises(InputError, match="flat"):
        join_records(a, flat, first_signal="speed", second_signal="torque", method="event")
