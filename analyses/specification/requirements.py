"""Requirements of a design file against what was found, by loops and by analyses."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import compress
from math import inf
from types import SimpleNamespace

from actuator_lti.asked.drive_figure import drive_figure
from actuator_lti.asked.quantities import LOOPS, QUANTITIES, judged_loops, with_unit
from actuator_lti.asked.verdict import Role, Tally, Verdict
from actuator_lti.design.asked import ResponseTo
from actuator_lti.design.loader import AnyDesign, as_design
from actuator_lti.design.model import Design, Requirement, Waiver
from actuator_lti.design.suspicions import beyond_profile
from actuator_lti.drive.operating import IN_MOTION, turned
from actuator_lti.drive.profile import command_mean
from actuator_lti.errors import InputError
from actuator_lti.loops import assemble_loops
from actuator_lti.types import Progress
from analyses.linear.loop_figures import HELD, LoopFigures, all_loop_figures


def evaluate_requirements(
    design: AnyDesign, figures: Mapping[str, LoopFigures] | None = None, progress: Progress = None
) -> tuple[RequirementVerdict, ...]:
    """Judge every requirement of a design.

    ``figures`` are those of the sampled, sliding loops, computed where left out.
    ``progress``: called with (requirements judged, requirements in all).

    Raises `InputError`: if a requirement names a quantity or a loop that is not known.
    """
    design = as_design(design)
    if figures is None:
        figures = all_loop_figures(assemble_loops(design))
    from analyses.specification.asked_figures import AskedFigures

    @cache
    def moving() -> LoopFigures | None:
        there = dict(turned(design)).get(IN_MOTION)
        return None if there is None else all_loop_figures(assemble_loops(there))["position"]

    made: list[RequirementVerdict] = []
    for done, requirement in enumerate(design.requirements):
        if progress is not None:
            progress(done, len(design.requirements))
        for one in judged(design, requirement, figures, AskedFigures(design).figure):
            said = () if one.value is None else (_in_motion(one, moving), _limited(design, one))
            made.append(replace(one, reason="; ".join(filter(None, (one.reason, *said)))))
    return tuple(made)


def judged_nominally(
    design: Design,
    left: Sequence[Requirement],
    figures: Mapping[str, LoopFigures] | None,
    untold: str,
    progress: Progress = None,
) -> tuple[RequirementVerdict, ...]:
    """Judge in the nominal design what is not asked of its variants: not met, or by ``untold`` not proven."""
    if not left:
        return ()

    def of_all(one: RequirementVerdict) -> RequirementVerdict:
        if one.verdict is not Verdict.NOT_MET:
            waiver = design.waiver_of(one.id)
            return replace(one, verdict=Verdict.NOT_PROVEN, reason=untold, waiver=waiver)
        found = one.reason if one.value is None else with_unit(one.value, one.requirement.unit, ".4g")
        return replace(one, reason=f"fails in the nominal design: {found}")

    nominal = replace(design, requirements=tuple(left))
    return tuple(map(of_all, evaluate_requirements(nominal, figures, progress)))


def _limited(design: Design, verdict: RequirementVerdict) -> str:
    """Beside a bandwidth, a rate or an acceleration what the profile of the command makes of it."""
    of, value = verdict.requirement, verdict.value
    if value is not None and (profile := beyond_profile(design, of, value)):
        return profile
    limits = (design.command.rate_rad_s, design.command.acceleration_rad_s2)
    if (of.quantity, verdict.loop) != ("bandwidth", "position") or of.to == "reference" or min(limits) == inf:
        return ""
    from analyses.specification.asked_figures import said_of

    return said_of(design, value)


def _in_motion(verdict: RequirementVerdict, moving: Callable[[], LoopFigures | None]) -> str:
    """Beside a response of a drive that stands in its cogging what it is in a motion over many periods."""
    of, value = verdict.requirement, verdict.value
    if verdict.loop != "position" or not QUANTITIES[of.quantity].of_response or (found := moving()) is None:
        return ""
    other = QUANTITIES[of.quantity].read(found.asked(of)) if found.stable else None
    here, there = (one and with_unit(one, of.unit, ".4g") for one in (value, other))
    if there is None or there == here:
        return ""
    return f"within a period of its cogging or gear error; in a motion over many {there}"


@dataclass(frozen=True, kw_only=True)
class RequirementVerdict:
    """One requirement at one place."""

    id: str  # of the requirement, with ``/loop`` where it holds for every loop
    requirement: Requirement
    loop: str | None  # the loop that was judged; ``None`` for the whole drive
    value: float | None = None  # what was found, in ``requirement.unit``; ``inf``: there is no such bound
    distance: float | None = None  # to the limit in ``requirement.unit``, positive on the good side
    verdict: Verdict  # not proven where it cannot be judged; ``reason`` says why
    reason: str = ""  # what has to be known to read it
    waiver: Waiver | None = None  # of what is not proven
    rotor: str = ""  # of a current loop: whether its rotor is ``"free"`` or ``"locked"``
    load_unit: str = ""  # of the requirement's load, where it has one

    @property
    def figure(self) -> tuple[object, ...]:
        """What is judged: verdicts of two designs stand side by side where it is the same."""
        of, load_unit = self.requirement, self.load_unit * bool(self.requirement.load_Nm)
        return self.id, of.quantity, self.loop, of.rotor, of.to, of.load_Nm, load_unit, of.unit

    @property
    def passes(self) -> bool:
        return self.verdict.passes(waived=self.waiver is not None)

    @property
    def role(self) -> Role:
        return self.verdict.role(waived=self.waiver is not None)


def words_of(of: Requirement, loop: str | None, load_unit: str, rotor: str = "") -> str:
    """What a requirement limits of a loop or, at a load, of the drive."""
    what = QUANTITIES[of.quantity].words
    if loop is not None:
        to = f", to the {of.to}" if of.to and loop == "position" else ""
        return f"{loop.capitalize()} loop{f', rotor {rotor}' * bool(rotor)}: {what}{to}"
    return f"Drive: {what}" + ("" if of.load_Nm is None else f" at {of.load_Nm:g} {load_unit}")


def tally(verdicts: Iterable[RequirementVerdict]) -> Tally:
    """Count verdicts: the one count that every headline and exit status comes from."""
    every = list(verdicts)
    return Tally.of((one.verdict for one in every), (one.waiver is not None for one in every))


def judged(
    design: Design,
    requirement: Requirement,
    figures: Mapping[str, LoopFigures],
    asked: Callable[[str], tuple[float | None, str]],
) -> list[RequirementVerdict]:
    """Judge one requirement wherever it holds; ``asked``: by a name what an analysis finds, or why not."""
    quantity = QUANTITIES.get(requirement.quantity)
    if quantity is None:
        reason = f"quantity = {requirement.quantity!r}: allowed are {', '.join(QUANTITIES)}"
        raise InputError(f"requirement {requirement.id}: {reason}", where=design.origin or None)
    if quantity.scope == "analysis":
        value, reason = asked(quantity.name)
        verdicts = [_verdict(requirement, None, value, reason or NOT_STATED * (value is None))]
    elif quantity.scope == "drive":
        value = float(drive_figure(design, quantity.name, requirement.load_Nm or 0.0))
        reason = "the design has no such figure" if math.isnan(value) else ""
        verdicts = [_verdict(requirement, None, value, reason)]
    else:
        loops = judged_loops(requirement.loop, figures)
        verdicts = [_judge_loop(design, requirement, name, figures.get(name)) for name in loops]
    waivers = [design.waiver_of(one.id) if one.verdict == "not proven" else None for one in verdicts]
    unit = "" if requirement.load_Nm is None else design.load_unit
    return [replace(one, waiver=w, load_unit=unit) for one, w in zip(verdicts, waivers, strict=True)]


NOT_STATED = "the design does not state what this needs"


def judged_by(design: Design, analysis: str, result: object) -> tuple[RequirementVerdict, ...]:
    """Judge the requirements on what ``failures``, ``duty`` or ``stiffness`` finds, by its result."""

    def found(name: str) -> tuple[float | None, str]:
        return QUANTITIES[name].read(SimpleNamespace(**{analysis: result}), design.axis), ""

    of = analysis, f"{analysis}."
    own = {name for name, one in QUANTITIES.items() if one.source in of or one.reader.startswith(of)}
    asked = (one for one in design.requirements if one.quantity in own)
    return tuple(verdict for one in asked for verdict in judged(design, one, {}, found))


def _judge_loop(
    design: Design, requirement: Requirement, name: str, found: LoopFigures | None
) -> RequirementVerdict:
    """Judge one requirement on one loop; an unstable loop meets none."""
    rotor = requirement.rotor or (found.rotor if found else "") if name == "current" else ""
    if name not in LOOPS:
        reason = f"loop = {name!r}: allowed are {', '.join(LOOPS)}, every"
        raise InputError(f"requirement {requirement.id}: {reason}", where=design.origin or None)
    if found is None:
        return _verdict(requirement, name, None, f"the design has no {name} loop", rotor)
    result = found.asked(requirement)
    if result.margins.stable is None:
        return _verdict(requirement, name, None, "stability is not certain, so no figure is given", rotor)
    if not result.stable:
        unstable = _verdict(requirement, name, None, f"the {name} loop is {result.margins.verdict}", rotor)
        return replace(unstable, verdict=Verdict.NOT_MET)
    value = QUANTITIES[requirement.quantity].read(result)
    reason = which_response(requirement.quantity, name, requirement.to or "command", design)
    if value is None:
        reason = "not found in the band of this loop"
    if found.held is not None and requirement.rotor != "locked":
        held = f"with the {HELD[name]}; by itself, {found.by_itself}"
        reason = ", ".join(filter(None, (reason, held)))
    return _verdict(requirement, name, value, reason, rotor)


def which_response(quantity: str, loop: str, to: ResponseTo = "command", design: Design | None = None) -> str:
    """Which of several responses a figure is taken of, in words; empty for a figure that they share.

    Bandwidth, resonance and step of the position loop are those of the response to the user's command,
    with profile, filter and feed-forward, or to the reference behind profile and filter; of an inner loop,
    those of the feedback loop, or with a law of one's own of the response to its command. Of ``design`` only
    the parts are named that it has.

    >>> which_response("bandwidth", "position"), which_response("phase_margin", "position")
    ('of the response to the command: mean of its profile, filter and feed-forward included', '')
    """
    if not QUANTITIES[quantity].of_response:
        return ""
    if loop != "position":
        own = design.controller.own_law if design else None
        return "of the response to its command" if own and own[0] == loop else "of the feedback loop"
    if to == "reference":
        return "of the response to the reference, behind profile and filter of the command"
    parts = ["mean of its profile", "filter", "feed-forward"]
    if design is not None:
        position = design.controller.position
        fed = position is not None and bool(position.feedforward or position.acceleration_feedforward)
        there = (command_mean(design) is not None, design.command.filter_time_s > 0.0, fed)
        parts = [*compress(parts, there)]
    included = f": {', '.join(parts[:-1])}{' and ' * (len(parts) > 1)}{parts[-1]} included" if parts else ""
    return f"of the response to the command{included}"


def _verdict(
    requirement: Requirement, loop: str | None, value: float | None, reason: str, rotor: str = ""
) -> RequirementVerdict:
    """Compare a value with the limits; ``reason``: why there is none, or what has to be known to read it."""
    id = requirement.id if loop is None or requirement.loop == loop else f"{requirement.id}/{loop}"
    of = RequirementVerdict(
        id=id, requirement=requirement, loop=loop, verdict=Verdict.NOT_PROVEN, reason=reason, rotor=rotor
    )
    if value is None or math.isnan(value):
        return of
    room = float(requirement.distance(value))
    reason = "nothing limits it" if value == inf else reason
    return replace(of, value=value, distance=room, verdict=Verdict.of(room >= 0.0), reason=reason)
