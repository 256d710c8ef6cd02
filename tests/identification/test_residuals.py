"""Residual tests against truths of their own: the level is kept by chance, and what is missing is found."""

import numpy as np
import pytest
from scipy.signal import lfilter

from actuator_lti.design import load_design
from analyses.identification.inverse import fit_records
from analyses.identification.residuals import LEVEL, ResidualTest, residual_tests
from tests.identification.bench_records import record_of

TIME = np.arange(0.0, 12.0, 1e-3)
SPEED = 0.3 * np.cos(3.0 * TIME) + 0.21 * np.cos(7.0 * TIME)
PLACE = 0.1 * np.sin(3.0 * TIME) + 0.03 * np.sin(7.0 * TIME)
RATE = -0.9 * np.sin(3.0 * TIME) - 1.47 * np.sin(7.0 * TIME)


def _tests(rest: np.ndarray) -> dict[str, ResidualTest]:
    """Of a mass of 5 kg with friction, whose force has something more."""
    force = 5.0 * RATE + 2.0 * SPEED + 3.0 * np.sign(SPEED) + rest
    model = fit_records(load_design("emps"), [record_of(TIME, position=PLACE, force=force)])
    part = model.records[0]
    about_mean = np.linalg.norm(part.y - part.y.mean())
    assert part.fit_percent == pytest.approx(100.0 * (1.0 - np.linalg.norm(part.residual) / about_mean))
    return {test.input or test.name: test for test in residual_tests(model)}


def test_noise_alone_keeps_the_level() -> None:
    """Coloured noise, 60 records of three tests: 1 % beyond the bound, at most 7 of 180 (binomial, 1e-3)."""
    rng = np.random.default_rng(4)
    beyond = 0
    for _ in range(60):
        noise = lfilter([1.0], [1.0, -0.98], rng.standard_normal(len(TIME)))
        beyond += sum(not test.within for test in _tests(0.1 * noise).values())
    assert LEVEL == 0.01
    assert beyond <= 7


MISSING = {
    "a spring": (40.0 * PLACE, "speed"),
    "a late force": (5.0 * (np.interp(TIME - 0.02, TIME, RATE) - RATE), "acceleration"),
    "a square wave of 0.9 s": (0.6 * np.sign(np.sin(2.0 * np.pi * TIME / 0.9)), "whiteness"),
}


@pytest.mark.parametrize("what", MISSING)
def test_what_the_model_lacks_is_found(what: str) -> None:
    missing, name = MISSING[what]
    noise = 0.5 * np.random.default_rng(1).standard_normal(len(TIME))
    test = _tests(missing + noise)[name]
    assert not test.within
