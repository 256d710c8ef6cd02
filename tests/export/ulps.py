"""How far the figures of a loop move where each entry of its matrices moves by one unit in the last place.

Two writings of the same drive give entries that differ by their rounding. Figures that differ by no more than
such a nudge moves them differ by rounding; beyond that one of the two writings is wrong.
"""

from functools import lru_cache

import numpy as np

from actuator_lti.asked.quantities import LOOP_QUANTITIES, LOOPS
from actuator_lti.batch import Population
from actuator_lti.batch import _figures as fig
from actuator_lti.batch import figures as many
from actuator_lti.design.model import Design
from actuator_lti.drive.operating import Operating
from actuator_lti.drive.wiring import wire
from actuator_lti.loops.periodic import fundamental
from actuator_lti.loops.sampled import stage_blocks
from actuator_lti.loops.tick import Block

COUNT = 64
TIMES = ("rise_time", "settling_time")


def nudged(block: Block, rng: np.random.Generator) -> Block:
    """Copies of a loop, each entry moved by -1, 0 or 1 unit but whole numbers; the first is as it is."""
    n = len(block.states)

    def moved(part: np.ndarray, *shape: int) -> np.ndarray:
        part = np.array(np.broadcast_to(part, (COUNT, *shape)))
        result = part + np.spacing(part) * rng.choice([-1.0, 0.0, 1.0], part.shape)
        result = np.where(part == np.round(part), part, result)
        result[0] = part[0]
        return result

    parts = moved(block.A, n, n), moved(block.B, n, 1), moved(block.C, 1, n)
    return Block(*parts, block.D, block.states)


@lru_cache(maxsize=1)
def moved_by_an_ulp(design: Design, loop: str, timed: bool) -> dict[str, float]:
    """The largest change of each figure over the copies.

    A time is a whole number of ticks, which hide what moves it by less: it moves with the slowest pole's time
    constant at least.
    """
    rng = np.random.default_rng(0)
    wired = wire(Population(design, {}, COUNT).stacked, Operating())
    out = np.full((COUNT, len(LOOPS), fig.COLUMNS), np.nan)
    rows = np.full((COUNT, fig.COLUMNS), np.nan)
    lead, response = many._command_path(wired) if loop == "position" else (0.0, None)
    many._figures_of(
        nudged(fundamental(stage_blocks(wired, loop)), rng), lead, timed and response is None, rows
    )
    if response is not None:
        verdict = rows[:, [fig.STABLE, fig.RADIUS]]
        many._figures_of(nudged(response, rng), np.nan, timed, rows)
        rows[:, [fig.STABLE, fig.RADIUS]] = verdict
    out[:, LOOPS.index(loop)] = rows
    period = np.full((COUNT, len(LOOPS)), wired.period_s(loop))
    figures = many.LinearFigures(wired.stages, COUNT, out, period)
    values = {name: figures.quantity(name, loop) for name in LOOP_QUANTITIES}
    with np.errstate(invalid="ignore"):
        result = {
            name: float(np.nan_to_num(np.abs(each - each[0]), nan=0.0).max()) for name, each in values.items()
        }
        slowest = 1.0 - figures.pole_radius(loop)
        share = np.nan_to_num(np.abs(slowest / slowest[0] - 1.0), nan=0.0).max()
    for name in TIMES:
        result[name] = max(result[name], float(share * np.nan_to_num(values[name][0])))
    return result
