"""Multirate drives whose inner loops are unstable: entries to 1e15, figures that are the truth or withheld.

Truth is mpmath on the exact values of the doubles of the single loop; what 8 ulp of them change is left out.
"""

from typing import Any

import numpy as np
import pytest
from margin_truth import determined, difference, truth_of

from actuator_lti import assemble_loops, load_design, stability_margins
from actuator_lti.batch import Population, linear_figures
from tests.changed import changed

BASE = load_design("ilr33-amber-multirate")
SEEDS = range(30)


def unstable_inside(seed: int) -> Any:
    """Current gain times 4 to 100; 4 to 8 ticks a velocity period, 8 to 24 a position period."""
    rng = np.random.default_rng([seed, 11])
    control = BASE.controller
    factors = 10.0 ** rng.uniform((0.6, -3.0, -3.0), (2.0, 1.0, 1.0))
    every = int(rng.choice([4, 6, 8]))
    position = {"every": every * int(rng.choice([2, 3])), "gain": control.position.gain * factors[2]}
    velocity = {"every": every, "gain": control.velocity.gain * factors[1]}
    current = {"gain_V_A": control.current.gain_V_A * factors[0]}
    return changed(BASE, controller={"current": current, "velocity": velocity, "position": position})


@pytest.mark.parametrize("seed", SEEDS)
def test_the_figures_are_the_truth_or_withheld(seed: int, capfd: pytest.CaptureFixture[str]) -> None:
    design = unstable_inside(seed)
    many = linear_figures(Population(design, {}, 1))
    for name, loop in assemble_loops(design).present.items():
        system = loop.open_loop
        m = stability_margins(system)
        try:
            truth = truth_of(system)
        except AssertionError:  # a root that is not told from the axis
            continue
        result = difference(m, truth)
        if result is not None:
            assert not determined(system, truth, np.random.default_rng(seed)), (name, result)
            assert many.withheld(name)[0]
            continue
        assert not many.stable(name)[0] or truth.unstable == 0
        if many.withheld(name)[0]:
            assert np.abs(system.A).max() > 1e5
            assert all(np.isnan(many.quantity(q, name)[0]) for q in ("gain_margin", "phase_margin"))
            continue
        assert many.stable(name)[0] == (truth.unstable == 0)
        for figure in ("gain_margin_db", "phase_margin_deg", "modulus_margin"):
            quantity, value = figure.removesuffix("_db").removesuffix("_deg"), getattr(m, figure)
            assert many.quantity(quantity, name)[0] == pytest.approx(value, rel=1e-6), (name, quantity)
    assert capfd.readouterr() == ("", "")


def test_the_seeds_reach_what_they_are_for() -> None:
    sizes = [np.abs(assemble_loops(unstable_inside(seed)).position.open_loop.A).max() for seed in SEEDS]
    assert max(sizes) > 1e11
    assert min(sizes) < 1e5


def test_entries_of_5e14_are_withheld_among_others_that_are_not() -> None:
    """One design of a population cannot be followed; its neighbours keep the bits they have alone."""
    gain = BASE.controller.current.gain_V_A
    gains = np.array([gain, 60.0 * gain, 0.7 * gain])
    base = changed(BASE, controller={"position": {"every": 20}})
    figures = linear_figures(Population(base, {"control.current.gain": gains}, 3))
    assert figures.withheld("position").tolist() == [False, True, False]
    assert figures.stable("position").tolist() == [True, False, True]
    assert figures.gain_crossovers("position").crossings[1] == 0
    for k in (0, 2):
        alone = linear_figures(Population(base, {"control.current.gain": gains[[k]]}, 1))
        assert (alone.raw[0] == figures.raw[k])[~np.isnan(alone.raw[0])].all()
