"""The tuning problem: gains as variables, requirements at every corner as constraints."""

import os
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import inf

import numpy as np

from actuator_lti.asked.quantities import DRIVE_QUANTITIES, LOOP_QUANTITIES, LOOPS, QUANTITIES, judged_loops
from actuator_lti.batch import Population, drive_figures, linear_figures, variable_paths
from actuator_lti.batch.figures import LinearFigures
from actuator_lti.design import parameter_value, paths_of
from actuator_lti.design.mistakes import nearest
from actuator_lti.design.model import Design, Requirement
from actuator_lti.design.tolerances import drawn
from actuator_lti.design.units import parse_limit
from actuator_lti.drive.steady import droop
from actuator_lti.errors import InputError
from actuator_lti.types import Floats
from analyses.monte_carlo.judging import drive_column, in_populations, judge, left_out, loop_columns, loops_of
from analyses.studies.sampling import Factor, as_values, correlation_of, semidefinite_root
from analyses.tuning.start import Element, Variable, allowed_range, change, place

GAINS = tuple(f"control.{loop}.{key}" for loop in LOOPS for key in ("gain", "integral_time"))
SPAN = 50.0  # a gain may leave what it is and what the rules say by this factor
MOST_FACTORS = 10
PLENTY = 10.0  # relative distance beyond which the search does not look
_Looked = tuple[Population, LinearFigures]
MOST_DESIGNS = 25_000  # looked at in one search: half a minute of one processor for a drive with two masses


@dataclass
class Problem:
    """Requirements that gains of a design move, over the corners of its tolerances."""

    design: Design
    requirements: tuple[Requirement, ...]
    variables: tuple[Variable, ...]
    elements: tuple[Element, ...] = ()  # that were added
    most: int = MOST_DESIGNS  # designs that a search may look at
    evaluations: int = 0  # that were looked at so far
    # Of the variables: keys; SI values to begin at, of the design (neutral if new); ends of what may be set
    paths: tuple[str, ...] = field(init=False)
    start: Floats = field(init=False)
    present: Floats = field(init=False)
    lower: Floats = field(init=False)
    upper: Floats = field(init=False)
    _linear: Floats = field(init=False)
    _last: tuple[object, _Looked] | None = field(default=None, init=False, repr=False)

    def __post_init__(self) -> None:
        self.paths = tuple(item.path for item in self.variables)
        self.lower = np.array([item.low for item in self.variables])
        self.upper = np.array([item.high for item in self.variables])
        self._linear = np.array([item.linear for item in self.variables], dtype=bool)
        home = [item.start if item.home is None else item.home for item in self.variables]
        self.present = np.clip(home, self.lower, self.upper)
        self.start = np.clip([item.start for item in self.variables], self.lower, self.upper)

    @property
    def spent(self) -> bool:
        """Whether as many designs were looked at as one search may."""
        return self.evaluations >= self.most

    def coordinates(self, values: Floats) -> Floats:
        """What the search moves: ln of a value; a share itself."""
        return np.where(self._linear, values, np.log(np.where(self._linear, 1.0, values)))

    def values(self, coordinates: Floats) -> Floats:
        """SI values from coordinates."""
        return np.where(self._linear, coordinates, np.exp(np.where(self._linear, 0.0, coordinates)))

    def change(self, values: Floats) -> Floats:
        """How far each row is from the design as it came, see `analyses.tuning.start.change`."""
        return change(self.variables, values)

    @cached_property
    def toleranced(self) -> tuple[Factor, ...]:
        """All toleranced parameters, the gains among them without limits: those cut about each candidate."""
        known = set(variable_paths(self.design))
        every = (
            (p, v, replace(t, lower=-inf, upper=inf) if p in self.paths else t)
            for p, v, t in drawn(self.design)
        )
        return tuple(Factor(*each) for each in every if each[0] in known)

    @cached_property
    def factors(self) -> tuple[Factor, ...]:
        """Those whose corners are looked at: all, or the ten that move the requirements most."""
        if len(self.toleranced) <= MOST_FACTORS:
            return self.toleranced
        points = np.tile([f.nominal for f in self.toleranced], (2 * len(self.toleranced) + 1, 1))
        for k, factor in enumerate(self.toleranced):
            points[2 * k + 1 : 2 * k + 3, k] = factor.box
        result = np.minimum(self.exact_distances(self.start[None, :], points, self.toleranced)[0], PLENTY)
        moved = np.abs(result[1:] - result[0]).max(axis=1).reshape(-1, 2).max(axis=1)
        chosen = sorted(np.argsort(-moved, kind="stable")[:MOST_FACTORS])
        return tuple(self.toleranced[k] for k in chosen)

    @cached_property
    def all_corners(self) -> Floats:
        """Nominal point, then the corners of the tolerance box, shape (corners, factors).

        Correlated parameters move as they are correlated: two that are one go up and down together.
        """
        size, nominal = len(self.factors), np.array([[f.nominal for f in self.factors]])
        if not size:
            return nominal
        lower, upper = np.array([f.box for f in self.factors]).T
        bits = (np.arange(2**size)[:, None] >> np.arange(size)) & 1
        matrix = correlation_of(self.design, [f.path for f in self.factors])
        if np.array_equal(matrix, np.eye(size)):
            return np.vstack([nominal, np.where(bits, upper, lower)])
        moved = np.clip((2.0 * bits - 1.0) @ semidefinite_root(matrix).T, -1.0, 1.0)
        half_range = np.where(moved > 0.0, upper - nominal, nominal - lower)
        return np.vstack([nominal, np.unique(nominal + moved * half_range, axis=0)])

    def distances(self, gains: Floats, corners: Floats) -> Floats:
        """`exact_distances` as far as the search looks."""
        return np.minimum(self.exact_distances(gains, corners), PLENTY)

    def rows(self, coordinates: Floats, corners: Floats) -> Floats:
        """Distances at coordinates, one row for each: shape (candidates, corners * requirements)."""
        return self.distances(self.values(coordinates), corners).reshape(len(coordinates), -1)

    def exact_distances(
        self, gains: Floats, corners: Floats, factors: tuple[Factor, ...] | None = None
    ) -> Floats:
        """Distance of every requirement over its size, shape (candidates, corners, requirements).

        Unstable designs get a number of at most -3 that falls with the distance of the poles from the circle,
        of the loops whose poles are known; inf where nothing bounds the figure. ``factors`` are those of the
        corners, where not those of the problem.
        """
        linear, columns = self._columns(gains, corners, self.factors if factors is None else factors)
        out = np.empty((len(gains) * len(corners), len(self.requirements)))
        radius = np.fmax.reduce([linear.pole_radius(loop) for loop in linear.loops], initial=1.0)
        for k, requirement in enumerate(self.requirements):
            result = judge(requirement, self.design, columns).distance / requirement.size
            out[:, k] = np.where(np.isneginf(result), -3.0 - 20.0 * (radius - 1.0), result)
        return out.reshape(len(gains), len(corners), len(self.requirements))

    def found(self, gains: Floats, corner: Floats) -> list[float]:
        """The figure behind each requirement, of one candidate at one corner."""
        _, columns = self._columns(gains[None, :], corner[None, :], self.factors)
        return [float(judge(one, self.design, columns).value[0]) for one in self.requirements]

    def _columns(
        self, gains: Floats, corners: Floats, factors: tuple[Factor, ...]
    ) -> tuple[LinearFigures, dict[str, np.ndarray]]:
        """Every candidate at every corner: its loops, and figures by column."""
        population, linear = self._looked_at(gains, corners, factors)
        columns = loop_columns(linear, self.design)
        for name, load in {(r.quantity, r.load_Nm or 0.0) for r in self.requirements}:
            if name in DRIVE_QUANTITIES:
                columns[drive_column(name, load)] = drive_figures(population, name, load)
        return linear, columns

    @cached_property
    def _timed(self) -> set[str]:
        """The loops whose steps a requirement is on: no other is followed."""
        asked = (r.loop for r in self.requirements if QUANTITIES[r.quantity].timed)
        return {name for loop in asked for name in judged_loops(loop, self.design.controller.stages)}

    def figure(self, quantity: str, loop: str, gains: Floats, corners: Floats) -> Floats:
        """One figure of one loop, shape (candidates, corners)."""
        _, linear = self._looked_at(gains, corners, self.factors)
        return linear.quantity(quantity, loop).reshape(len(gains), len(corners))

    def _looked_at(self, gains: Floats, corners: Floats, factors: tuple[Factor, ...]) -> _Looked:
        """Every candidate at every corner and its loops, kept for the next question on the same ones."""
        of = (gains.tobytes(), corners.tobytes(), factors)
        if self._last is None or self._last[0] != of:
            count = len(gains) * len(corners)
            self.evaluations += count
            population = Population(self.design, self.values_at(gains, corners, factors), count)
            threads = os.cpu_count() or 1
            linear = linear_figures(population, time_figures=self._timed, held=True, threads=threads)
            self._last = of, (population, linear)
        return self._last[1]

    def values_at(self, gains: Floats, corners: Floats, factors: tuple[Factor, ...]) -> dict[str, Floats]:
        """SI values of every candidate at every corner by key, each of shape (candidates * corners).

        A gain's tolerance is about the candidate, by the same share where it is in percent.
        """
        chosen = {p: np.repeat(gains[:, k], len(corners)) for k, p in enumerate(self.paths)}
        moved = as_values(self.design, [f.path for f in factors], np.tile(corners, (len(gains), 1)))
        values = {**chosen, **moved}
        for factor in (f for f in factors if f.path in chosen):
            middle, own = chosen[factor.path], self.design.parameters[factor.path].tolerance
            assert own is not None
            share = middle / factor.nominal if own.relative else 1.0
            away = share * (values[factor.path] - factor.nominal)
            values[factor.path] = np.clip(middle + away, own.lower, own.upper)
        return values


def asked_for(design: Design, extra: tuple[Requirement, ...] = ()) -> tuple[Requirement, ...]:
    """Requirements of the design, replaced by extra ones on the same figure."""
    replaced = {(r.quantity, r.loop) for r in extra}
    return (*(r for r in design.requirements if (r.quantity, r.loop) not in replaced), *extra)


def gain_requirements(design: Design, extra: tuple[Requirement, ...] = ()) -> tuple[Requirement, ...]:
    """Those of `asked_for` on loops, and on the rate of a P velocity loop; `InputError` without any."""
    moved = {*LOOP_QUANTITIES, *([] if droop(design) is None else ["output_rate"])}
    every = asked_for(design, extra)
    chosen = tuple(r for r in every if r.quantity in moved and in_populations(r, design))
    if not chosen:
        reason = "no requirement on a loop: nothing to tune for; state margins and bandwidths in the "
        reason += 'file, or as --require "position.bandwidth>=30 Hz"'
        raise InputError("; ".join(why_not_searched(every, design)) or reason)
    return chosen


def why_not_searched(requirements: Iterable[Requirement], design: Design) -> Iterator[str]:
    """Of each requirement on a loop that the search cannot have, what keeps it from it."""
    for one in requirements:
        if one.quantity in LOOP_QUANTITIES and (why := left_out(one, design)):
            yield f"not searched for is {one.id}: {why}"


def problem_of(
    design: Design,
    requirements: tuple[Requirement, ...],
    start: Mapping[str, float],
    elements: tuple[Element, ...] = (),
    most: int = MOST_DESIGNS,
) -> Problem:
    """The problem: gains and new elements, searched from ``start`` (by rules, SI) or where they are.

    An `InputError` where the design has no gain: a law of its own alone.
    """
    design, placed = place(design, elements)
    variables = []
    for path in (path for path in GAINS if path in set(paths_of(design))):
        home = parameter_value(design, path)
        begin = start.get(path, home)
        least, largest = allowed_range(design, path)
        low, high = max(min(begin, home) / SPAN, least), min(max(begin, home) * SPAN, largest)
        variables.append(Variable(path, begin, min(low, high), max(low, high), home))
    if not variables:
        stage, _ = design.controller.own_law or ("", None)
        raise InputError(
            f"nothing to tune: control.{stage}.law stays as it is, and no other stage has a gain"
        )
    return Problem(design, requirements, (*variables, *placed), elements, most)


_FORM = re.compile(r"\s*([a-z]+)\.([a-z_0-9]+)\s*(>=|<=)\s*(.+?)\s*")


def read_requirement(words: str, design: Design) -> Requirement:
    """Read a requirement on a loop; what makes no sense is refused with what is allowed.

    >>> from actuator_lti import load_design
    >>> result = read_requirement("position.bandwidth >= 30 Hz", load_design("ilr33-amber"))
    >>> result.id, result.minimum, result.unit
    ('position-bandwidth-wanted', 30.0, 'Hz')
    """
    said = f"--require {words!r}:"
    match = _FORM.fullmatch(words)
    if match is None:
        raise InputError(f'{said} allowed: LOOP.QUANTITY>=LIMIT, as "position.bandwidth>=30 Hz"')
    loop, quantity, sign, limit = match.groups()
    known = {name: q for name, q in QUANTITIES.items() if q.scope == "loop"}
    for what, one, allowed in (("loop", loop, (*loops_of(design), "every")), ("quantity", quantity, known)):
        if one not in allowed:
            raise InputError(f"{said} {what} {one!r}{nearest(one, allowed)}; allowed: {', '.join(allowed)}")
    unit = known[quantity].unit_for(design.axis)
    try:
        value = parse_limit(limit, unit)
    except InputError as error:
        raise InputError(f"{said} {error.message}") from error
    return Requirement(
        id=f"{loop}-{quantity.replace('_', '-')}-wanted", quantity=quantity, unit=unit, loop=loop,
        minimum=value if sign == ">=" else None, maximum=value if sign == "<=" else None,
        source="command line",
    )  # fmt: skip
