"""How far figures of a loop move where values of its drive move by an ulp: so far two writings may differ."""

from functools import lru_cache

import numpy as np

from actuator_lti.asked.quantities import LOOP_QUANTITIES
from actuator_lti.batch import Population, linear_figures, variable_paths
from actuator_lti.design import Design, parameter_value

COUNT = 64
TIMES = ("rise_time", "settling_time")


@lru_cache(maxsize=1)
def moved_by_an_ulp(design: Design, loop: str) -> dict[str, float]:
    """The largest change of each figure over copies, every value but whole numbers -1, 0 or 1 ulp beside."""
    # a time is of whole ticks, which hide what moves it by less: it moves with the slowest pole's at least
    rng = np.random.default_rng(0)
    known = {path: parameter_value(design, path) for path in variable_paths(design)}
    ulps = {path: np.spacing(x) for path, x in known.items() if np.isfinite(x) and x != round(x)}
    values = {path: known[path] + ulp * rng.choice([-1.0, 0.0, 1.0], COUNT) for path, ulp in ulps.items()}
    for path, copies in values.items():
        copies[0] = known[path]
    figures = linear_figures(Population(design, values, COUNT))
    found = {name: figures.quantity(name, loop) for name in LOOP_QUANTITIES}
    with np.errstate(invalid="ignore"):
        slowest = 1.0 - figures.pole_radius(loop)
        share = np.nan_to_num(np.abs(slowest / slowest[0] - 1.0)).max()
        moved = {name: float(np.nan_to_num(np.abs(x - x[0])).max()) for name, x in found.items()}
    return moved | {name: max(moved[name], float(share * np.nan_to_num(found[name][0]))) for name in TIMES}
