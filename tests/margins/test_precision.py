"""The working precision of exact arithmetic, which is one for all threads of a process."""

from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from threading import Event

import control
import pytest

from actuator_lti import stability_margins
from actuator_lti.bandwidth import closed_loop_bandwidth
from actuator_lti.margins.exact import certified, roots
from actuator_lti.step import step_figures
from actuator_lti.systems.precision import precision

LOOP = control.tf([12.0, 3.0, 100.0], [1.0, 2.3, 7.0, 0.1, 0.0])
CLOSED = control.tf([100.0], [1.0, 14.3, 100.0])
ASKED = {
    "margins": lambda: stability_margins(LOOP, certify=True),
    "bandwidth": lambda: closed_loop_bandwidth(CLOSED),
    "step": lambda: step_figures(CLOSED).settling_time_s,
}


@pytest.mark.parametrize("what", ASKED)
def test_who_asks_in_a_thread_waits_for_another_and_has_the_figures_of_one_alone(what: str) -> None:
    alone, held, done = ASKED[what](), Event(), Event()
    for module in (certified, roots):
        for kept in (each for each in vars(module).values() if isinstance(each, type(lru_cache()(len)))):
            kept.cache_clear()

    def other() -> None:
        with precision(2000):
            held.set()
            assert done.wait(60.0)

    with ThreadPoolExecutor(2) as pool:
        holding = pool.submit(other)
        assert held.wait(60.0)
        asked = pool.submit(ASKED[what])
        with pytest.raises(TimeoutError):
            asked.result(timeout=0.2)
        done.set()
        assert asked.result(timeout=60.0) == alone
        holding.result()
