"""A real local Dask cluster gives the same numbers; one that is not there, or slow to close."""

from contextlib import contextmanager

import numpy as np
import pytest

from actuator_lti import load_design
from actuator_lti.errors import InputError, NumericalError
from analyses.monte_carlo import SampleTask
from analyses.studies.engine import Engine
from analyses.studies.sampling import sampler_of


def test_workers_of_its_own():
    task = SampleTask(load_design("ilr33-amber"), sampler_of(load_design("ilr33-amber"), seed=0))
    found = []
    for engine in (Engine(workers=1), Engine()):
        engine.run(task, [(0, 30)], lambda _, arrays: found.append(arrays["position.bandwidth"]))
    assert np.array_equal(*found)


def test_a_scheduler_that_is_not_there_is_a_clear_failure(monkeypatch):
    monkeypatch.setattr("analyses.studies.cluster.CONNECT_S", 0.5)
    with pytest.raises(NumericalError, match="127"):
        Engine(scheduler="tcp://127.0.0.1:9").run(None, [(0, 1)], lambda c, a: None)


def test_a_cluster_that_is_slow_to_close_takes_no_result_back(monkeypatch):
    """Time-outs while the workers stop, after the last result: the study is whole all the same."""

    @contextmanager
    def slow_to_close(self):
        yield None
        raise TimeoutError

    def in_place(client, call, held, todo, sink):
        for part in todo:
            sink(part, call(held, part))

    monkeypatch.setattr(Engine, "_client", slow_to_close)
    monkeypatch.setattr("analyses.studies.cluster.submit", in_place)
    sums = {}
    Engine(workers=1).map(sum, [(1, 2), (3, 4)], sums.__setitem__)
    assert sums == {(1, 2): 3, (3, 4): 7}

    def lost(item, result):
        raise TimeoutError

    with pytest.raises(NumericalError, match="no answer in time"):
        Engine(workers=1).map(sum, [(1, 2)], lost)


def test_impossible_engines_are_refused():
    with pytest.raises(InputError, match="one of them"):
        Engine(workers=2, scheduler="tcp://x")
    with pytest.raises(InputError, match="at least 1"):
        Engine(workers=0)
    with pytest.raises(InputError, match="tcp://host:8786"):
        Engine(scheduler="nowhere").run(None, [(0, 1)], lambda c, a: None)
