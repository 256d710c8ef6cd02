"""The least change that meets the requirements: the nearest point of what is allowed to the design as it is.

Sequential quadratic programming on the change (`analyses.tuning.start.change`) from the design, and from
gains with reserve (`solve`) where that finds nothing. As margins have kinks and what is allowed may fall
apart, differential evolution (Storn and Price 1997) then searches the box that holds all that is nearer, and
the descent begins again; each value is taken back towards home by itself.
"""

import numpy as np
from scipy.optimize import NonlinearConstraint, differential_evolution, minimize

from actuator_lti.types import Floats
from analyses.tuning.problem import Problem
from analyses.tuning.solve import Program, Solution, Spent, rounds, solve, violated

MET = 1e-6  # relative distance that a requirement keeps, above the rounding of a margin
GENERATIONS = 60
MEMBERS = 8  # of a generation, for each value
INSIDE = 1.0 - 1e-6  # of the box, where a search begins: an end is outside by rounding, and refused
WIDEST = 3.0  # a factor 20, for a value that costs nothing wherever it is
WAY = np.array([0.0, 1e-4, 1e-3, 1e-2, 0.05, 0.1, 0.2, 0.4, 0.7])
BACK = np.linspace(0.0, 1.0, 17)[1:]


def least_change(problem: Problem, *, give_up: bool = False) -> Solution:
    """The nearest gains that meet every requirement at every corner, else the best compromise (`solve`)."""
    corners = problem.all_corners
    result = problem.distances(problem.present[None, :], corners)[0]
    if result.min() >= 0.0:
        return Solution(problem.present, float(result.min()), corners[:1])
    working = np.vstack([corners[:1], violated(result, problem, problem.present, corners, corners[:1])])
    near = _met(problem, None, working)
    if near is not None and near.slack >= 0.0:
        return near
    firm = solve(problem, give_up=give_up)
    if firm.slack < 0.0:
        return firm
    again = _met(problem, firm.gains, firm.working)
    assert again is not None
    return again if again.slack >= 0.0 else _between(problem, firm, again.gains)


def _met(problem: Problem, firm: Floats | None, working: Floats) -> Solution | None:
    """Nearest gains, the working set growing until they meet every corner, as ``firm`` does; None: none."""

    def nearest(start: Floats | None, working: Floats) -> Floats | None:
        begins = [row for row in (problem.present, firm if start is None else start, firm) if row is not None]
        best = _nearer(problem, firm, np.vstack([_descend(problem, row, working) for row in begins]), working)
        if best is None:
            return None
        drawn = _evolved(problem, best, working)
        best = _nearer(problem, best, np.vstack([drawn, _descend(problem, drawn, working)]), working)
        assert best is not None
        return _taken_back(problem, best, working)

    last: Solution | None = None
    for last in rounds(problem, working, nearest):
        if last.slack >= 0.0:
            break
    return last


def _descend(problem: Problem, start: Floats, working: Floats) -> Floats:
    """Minimise the change by sequential quadratic programming; rows from there back to the start."""
    program = Program(problem, lambda x: problem.rows(x, working) - MET)
    low, high = problem.coordinates(problem.lower), problem.coordinates(problem.upper)
    begin = np.clip(problem.coordinates(start), low, high)
    met = {"type": "ineq", "fun": lambda x: program.model(x)[0], "jac": lambda x: program.model(x)[1]}
    try:
        result = minimize(
            lambda x: float(problem.change(problem.values(x)[None, :])[0]),
            begin, method="SLSQP", bounds=[*zip(low, high, strict=True)], constraints=met,
            options={"maxiter": 60, "ftol": 1e-10},
        ).x  # fmt: skip
    except Spent:
        result = program.best if program.seen else begin
    rows = result + WAY[:, None] * (begin - result)
    return np.clip(problem.values(np.clip(rows, low, high)), problem.lower, problem.upper)


def _nearer(problem: Problem, known: Floats | None, rows: Floats, working: Floats) -> Floats | None:
    """Of some gains the nearest to home that meets the working set, or those known to meet it if nearer."""
    bound = np.inf if known is None else problem.change(known[None, :])[0]
    rows = rows[problem.change(rows) < bound]
    for corners in (working[:1], working[1:]):  # few are left for the corners
        if len(rows) and len(corners):
            rows = rows[problem.distances(rows, corners).min(axis=(1, 2)) >= 0.0]
    if not len(rows):
        return known
    result: Floats = rows[int(np.argmin(problem.change(rows)))]
    return result


def _evolved(problem: Problem, best: Floats, working: Floats) -> Floats:
    """What evolution finds in the box about home that holds every gain whose change is smaller."""
    low, high = problem.coordinates(problem.lower), problem.coordinates(problem.upper)
    here, free = problem.coordinates(best), [item.home is None for item in problem.variables]
    centre = np.where(free, here, problem.coordinates(problem.present))
    reach = np.where(free, WIDEST, np.sqrt(problem.change(best[None, :])[0]))
    box = np.clip([centre - reach, centre + reach], low, high)
    middle = box.mean(axis=0)
    begin = middle + INSIDE * (np.clip(here, *box) - middle)

    def limits(x: Floats) -> Floats:
        made = (problem.rows(np.atleast_2d(x.T), working) - MET).T
        return made if x.ndim > 1 else made[:, 0]

    result = differential_evolution(
        lambda x: problem.change(problem.values(x.T)), [*zip(*box, strict=True)], x0=begin,
        constraints=NonlinearConstraint(limits, 0.0, np.inf), maxiter=GENERATIONS, popsize=MEMBERS,
        tol=1e-8, polish=False, vectorized=True, updating="deferred", rng=np.random.default_rng(1),
        callback=lambda x, convergence: problem.spent,
    )  # fmt: skip
    return np.clip(problem.values(result.x), problem.lower, problem.upper)


def _taken_back(problem: Problem, gains: Floats, working: Floats) -> Floats:
    """Each value by itself, then all together, as far back home as the working set allows."""
    home = problem.coordinates(problem.present)
    for mask in (*np.eye(len(home), dtype=bool), np.ones(len(home), dtype=bool)):
        here = problem.coordinates(gains)
        rows = problem.values(here + BACK[:, None] * np.where(mask, home - here, 0.0))
        nearer = _nearer(problem, gains, np.clip(rows, problem.lower, problem.upper), working)
        assert nearer is not None
        gains = nearer
    return gains


def _between(problem: Problem, firm: Solution, gains: Floats) -> Solution:
    """The point nearest to gains on the way from a firm solution to them that meets every corner."""
    one, other = problem.coordinates(firm.gains), problem.coordinates(gains)
    low, high = 0.0, 1.0
    best = firm
    for _ in range(12):
        middle = 0.5 * (low + high)
        row = problem.values(one + middle * (other - one))
        slack = float(problem.distances(row[None, :], problem.all_corners).min())
        if slack >= 0.0:
            low, best = middle, Solution(row, slack, firm.working)
        else:
            high = middle
    return best
