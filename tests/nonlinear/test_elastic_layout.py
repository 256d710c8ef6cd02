"""The parts of the rows that belong to the event-driven plant."""

from nonlinear._kernels import elastic_layout, layout


def test_state_fits_its_place() -> None:
    assert elastic_layout.ES_END - layout.ELASTIC_STATE == layout.ELASTIC_STATE_SIZE
