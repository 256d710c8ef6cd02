"""The sweep that an analyser would see is the exact linear loop, of drives that bend smoothly too."""

import numpy as np
import pytest

from actuator_lti import load_design
from analyses.validation.bench_sweep import bench_sweep
from analyses.validation.places import Bench


@pytest.mark.parametrize("name", ["emps", "ilr33-amber-tanh", "joint"])
def test_an_injected_sweep_finds_the_linear_loop(name: str) -> None:
    """A large sine meets no event in smoothed friction or in gravity, and yet bends: 5e-3 and 5e-5 off."""
    design = load_design(name)
    bench = Bench(design, design)
    sweep = bench_sweep(bench, bench.place("position"))
    assert np.isfinite(sweep.open_loop).all()
    np.testing.assert_allclose(sweep.open_loop, sweep.linear, rtol=1e-8)
