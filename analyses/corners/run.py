"""Make the corners of a design and judge each by the linear loops."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from math import inf

import numpy as np

from actuator_lti.asked.quantities import ANALYSIS_QUANTITIES, CORNERED, QUANTITIES
from actuator_lti.asked.verdict import Tally, Verdict
from actuator_lti.design.access import varied
from actuator_lti.design.checks import contradictions
from actuator_lti.design.loader import AnyDesign, as_design
from actuator_lti.design.model import Design, Requirement, Temperature
from actuator_lti.design.tolerances import drawn, together
from actuator_lti.errors import InputError
from actuator_lti.loops import assemble_loops
from actuator_lti.types import Progress
from analyses.corners.asked import Asked
from analyses.linear.loop_figures import LoopFigures, all_loop_figures
from analyses.specification.requirements import RequirementVerdict, judged, judged_nominally, tally
from analyses.specification.sensitivity import moved, population_loop_figures
from analyses.studies.sampling import Factor


@dataclass(frozen=True)
class Corner:
    """The drive at one corner."""

    name: str
    words: str  # what differs from the nominal drive
    design: Design
    figures: Mapping[str, LoopFigures]  # of its sampled, sliding loops
    verdicts: tuple[RequirementVerdict, ...]
    refused: Mapping[str, str] = field(default_factory=dict)  # keys that contradict others there

    @property
    def tally(self) -> Tally:
        """The requirements, that every loop is stable, and that no value contradicts another."""
        is_stable = (one.is_stable for one in self.figures.values())
        return tally(self.verdicts) + Tally.of(map(Verdict.of, (*is_stable, *(False for _ in self.refused))))

    @property
    def passed(self) -> bool:
        """Whether no requirement fails, every loop is stable and no value contradicts another."""
        return self.tally.passes


@dataclass(frozen=True)
class Corners:
    """All corners of a design, the nominal drive first."""

    design: Design
    asked: Asked
    corners: tuple[Corner, ...]
    left_out: tuple[RequirementVerdict, ...] = ()  # of analyses: not met by the nominal design, or not proven
    over_all: tuple[RequirementVerdict, ...] = ()  # requirements on the worst of all corners

    @property
    def verdict(self) -> Verdict:
        """The worst of all corners, of the requirements over all of them, and of what is left out there."""
        beside = tally((*self.over_all, *self.left_out))
        return sum((corner.tally for corner in self.corners), beside).verdict

    @property
    def passed(self) -> bool:
        """Whether every corner passes, and nothing is left out that is not waived."""
        return self.verdict.passes()


def corners(design: AnyDesign, asked: Asked | None = None, *, progress: Progress = None) -> Corners:
    """Figures and requirements of a drive when hot, cold, on a low supply, and at the worst tolerances.

    Each corner is a design of its own, put through the same loops as the nominal one. Requirements on what an
    analysis finds (`actuator_lti.asked.quantities.ANALYSIS_QUANTITIES`) are judged in the nominal design
    alone, as by Monte Carlo, but for those on the margins at the corners, which are those of all of them.
    ``progress``: called with (requirements judged so, all of them).

    >>> from actuator_lti.design import load_design
    >>> [corner.name for corner in corners(load_design("fin")).corners]
    ['nominal', 'hot', 'cold', 'low supply', 'hot, low supply', 'worst gain margin', 'worst phase margin']
    """
    design = as_design(design)
    asked = Asked.of(design) if asked is None else asked
    kept = tuple(one for one in design.requirements if one.quantity not in ANALYSIS_QUANTITIES)
    made, not_here = [], lambda name: (None, f"{name} is not judged at corners")
    for name, words, there in _made(design, asked):
        refused = {key: f"{key} = {value}: {why}" for key, value, why in contradictions(there)}
        there = replace(there, requirements=kept)
        figures = all_loop_figures(assemble_loops(there))
        verdicts = tuple(verdict for one in kept for verdict in judged(there, one, figures, not_here))
        made.append(Corner(name, words, there, figures, verdicts, refused))
    over_all, left = list[RequirementVerdict](), list[Requirement]()
    for one in design.requirements:
        if QUANTITIES[one.quantity].cornered:
            over_all += judged(design, one, {}, lambda name: (worst_of(made, name), ""))
        elif one not in kept:
            left.append(one)
    untold = "not judged at corners, it takes a computation of one design"
    left_out = judged_nominally(design, left, made[0].figures, untold, progress)
    return Corners(design, asked, tuple(made), left_out, tuple(over_all))


def worst_of(corners: Iterable[Corner], name: str) -> float:
    """One of `ANALYSIS_QUANTITIES`: the worst over loops and corners; infinitely bad if one is unstable."""
    known = {one.name: QUANTITIES[figure] for figure, one in CORNERED.items()}
    if name not in known:
        raise InputError(f"quantity {name!r}: one of {', '.join(known)}")
    quantity = known[name]
    loops = [one.judged for corner in corners for one in corner.figures.values()]
    if not all(one.stable for one in loops):
        return -quantity.better * inf
    found = (quantity.read(one) for one in loops)
    worst = min((quantity.better * value for value in found if value is not None), default=inf)
    return quantity.better * worst


def _made(design: Design, asked: Asked) -> Iterator[tuple[str, str, Design]]:
    """Name, words and design of every corner."""
    yield "nominal", "as designed", design
    hot = at_temperature(design, asked.hot_degC)
    low = replace(design, limits=replace(design.limits, voltage_V=asked.supply_V))
    supply = f"{asked.supply_V:g} V"
    named = f"{'low' if asked.supply_V <= design.limits.voltage_V else 'high'} supply"
    electric, thick = design.motor.has_electrical_dynamics, asked.cold_viscous != 1.0
    if electric:
        yield "hot", f"winding and magnets at {asked.hot_degC:g} °C", hot
    if electric or thick:
        colder = [f"winding and magnets at {asked.cold_degC:g} °C"] * electric
        colder += [f"viscous friction times {asked.cold_viscous:g}"] * thick
        cold = at_temperature(design, asked.cold_degC) if electric else design
        yield "cold", ", ".join(colder), _thickened(cold, asked.cold_viscous)
    yield named, supply, low
    if electric:
        both = replace(hot, limits=low.limits)
        yield f"hot, {named}", f"{asked.hot_degC:g} °C and {supply}", both
    for quantity in CORNERED:
        name, values = f"worst {QUANTITIES[quantity].words}", worst_ends(design, quantity)
        if values:
            worse = "lowers" if QUANTITIES[quantity].better > 0 else "raises"
            away = {path: value - float(design.parameters[path].value) for path, value in values.items()}
            sides = [([path for path in away if way * away[path] > 0.0], way) for way in (1, -1)]
            ends = [f"{', '.join(paths)} {'high' if way > 0 else 'low'}" for paths, way in sides if paths]
            words = f"each tolerance at the end that {worse} it: {'; '.join(ends)}"
            yield name, words, varied(design, values)


def at_temperature(design: Design, degC: float) -> Design:
    """The design with winding and magnets at a temperature that its controller does not know."""
    heat = replace(design.temperature or Temperature(), winding_degC=degC, magnet_degC=degC)
    return replace(design, temperature=heat, nominal=design.nominal or design)


def _thickened(design: Design, factor: float) -> Design:
    """The design with its viscous friction times a factor; an `InputError` where a map holds it."""
    friction, load = design.friction, design.load
    if friction.points and factor != 1.0:
        raise InputError(f"cold viscous factor {factor:g}: a friction map has no viscous part of its own")
    back = None if friction.viscous_reverse_Nms_rad is None else factor * friction.viscous_reverse_Nms_rad
    viscous = factor * friction.viscous_Nms_rad
    if load.friction is not None:
        behind = replace(load.friction, viscous_Nms_rad=factor * load.friction.viscous_Nms_rad)
        load = replace(load, friction=behind)
    thick = replace(friction, viscous_Nms_rad=viscous, viscous_reverse_Nms_rad=back)
    return replace(design, friction=thick, load=load)


def worst_ends(design: Design, quantity: str) -> dict[str, float]:
    """For each toleranced number the end of its range that alone worsens a figure, over all loops, most."""
    boxes = ((each[0], Factor(*each).box) for each in drawn(design))
    ends = [together(design, {path: float(end)}) for path, box in boxes for end in box]
    base = {path: float(design.parameters[path].value) for end in ends for path in end}
    try:
        figures = population_loop_figures(moved(design, base, ends), design)
    except InputError:
        return {}
    better = QUANTITIES[quantity].better
    columns = [better * column for name, column in figures.items() if name.endswith(f".{quantity}")]
    if not columns:  # a drive without loops
        return {}
    margin = np.min(np.nan_to_num(columns, nan=-np.inf), axis=0)
    chosen: dict[str, float] = {}
    for k in range(0, len(ends), 2):
        low = k if margin[1 + k] <= margin[2 + k] else k + 1
        if margin[1 + low] < margin[0]:
            chosen |= ends[low]
    return chosen
