"""All that is said of a design's linear loops: forms, break points, operating points, delays, limits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from actuator_lti.design.loader import AnyDesign, as_design
from actuator_lti.design.model import Design
from actuator_lti.drawing import draw
from actuator_lti.drive.operating import Operating, OperatingPoint, rubs, slope_at, turned
from actuator_lti.errors import InputError, NumericalError
from actuator_lti.loops import ExactMargins, Loops, assemble_loops, exact_margins
from actuator_lti.loops.assemble import loops_at
from actuator_lti.loops.delay_budget import DelayBudget, delay_budget
from actuator_lti.loops.limiters import Onset, onset
from actuator_lti.loops.result import Form
from actuator_lti.margins.engine import MOST_STATES
from actuator_lti.start.extras import need
from actuator_lti.types import Progress
from analyses.isolation import attempt
from analyses.linear.loop_figures import LoopFigures, all_loop_figures, loop_figures
from analyses.specification.capability import drive_figures

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

FORMS: tuple[Form, ...] = ("sampled", "continuous", "ideal")
DESCRIBED_FRACTIONS = (0.01, 0.1)  # of the top speed, at which friction is described


@dataclass(frozen=True)
class BreakPoint:
    """A loop seen at one point with all others closed."""

    figures: LoopFigures | None  # ``None`` where they cannot be found; ``reason`` says why
    exact: ExactMargins | None  # where the loop is periodically time-varying
    reason: str = ""

    @property
    def stable(self) -> bool | None:
        """Whether the closed loop is stable; ``None`` where that is not known."""
        if self.exact is not None:
            return self.exact.stable
        return None if self.figures is None else self.figures.margins.stable


@dataclass(frozen=True)
class OperatingPointFigures:
    """The loops at one slope of the friction."""

    kind: OperatingPoint  # as `actuator_lti.assemble_loops` names it
    label: str
    load_Nm: float | None  # ``None``: that asked for, which makes a difference to a spring that bends only
    slope_Nms_rad: float  # slope of the friction torque over the motor speed
    figures: Mapping[str, LoopFigures]
    load_unit: str = "N m"
    design: Design | None = None  # where it is not the design itself: another angle, or in motion

    @property
    def place(self) -> str:
        """Label and load in words; empty where the dry part slides, as the loops are judged."""
        if self.label == SLIDING:
            return ""
        return self.label if self.load_Nm is None else f"{self.label}, load {self.load_Nm:g} {self.load_unit}"


@dataclass(frozen=True)
class LoopSurvey:
    """The loops of a design from every side."""

    design: Design
    loops: Loops  # sampled, sliding, no load
    forms: Mapping[str, Mapping[str, LoopFigures]]  # by form, then by loop; step figures of the sampled
    break_points: Mapping[str, BreakPoint]
    operating_points: tuple[OperatingPointFigures, ...]
    budgets: Mapping[str, DelayBudget]  # at the lowest gain crossover of each loop that has one
    onset: Onset | None  # the limit of linear validity; ``None`` where nothing limits
    refused: tuple[str, ...] = ()  # loops of other forms and points whose margins were not found, and why

    @property
    def figures(self) -> Mapping[str, LoopFigures]:
        """The sampled, sliding loops: those that requirements are judged by."""
        return self.forms["sampled"]

    def plot_map(self, axes: Any = None) -> Axes:
        """Draw over frequency the command amplitude at which each limiter sets in; gives the axes."""
        if self.onset is None:
            raise InputError(f"{self.design.name}: nothing limits, so there is no map")
        return draw("plot_onset", self.onset, linear_axis=self.design.axis == "linear", axes=axes)

    def to_pandas(self) -> pandas.DataFrame:
        """A data frame with one row for each form and loop: margins, bandwidth, peaks (pandas needed)."""
        names = ("stable", "gain_margin_db", "phase_margin_deg", "delay_margin_s", "modulus_margin")
        rows = [
            {
                "form": form,
                "loop": name,
                **{key: getattr(one.margins, key) for key in names},
                "bandwidth_rad_s": None if one.bandwidth is None else one.bandwidth.minus3db_rad_s,
                "evidence": one.margins.evidence,
            }
            for form, loops in self.forms.items()
            for name, one in loops.items()
        ]
        frame = need("pandas", "tables", "to_pandas").DataFrame(rows).set_index(["form", "loop"])
        frame.attrs = {"design": self.design.name}
        return frame


def survey_loops(design: AnyDesign, progress: Progress = None) -> LoopSurvey:
    """Assemble and measure the loops of a design in every form and at every operating point.

    All margins are certified, see `stability_margins`. ``progress`` gets (steps done, steps in all).

    Raises `InputError`, `NumericalError`: as `assemble_loops` and `loop_figures`; inside
    `analyses.isolation.isolated` only of the sampled loops: what else fails is left out and noted.
    """
    tell: Any = progress or (lambda done, of: None)
    design = as_design(design)
    loops = assemble_loops(design)
    refused, sampled = list[str](), all_loop_figures(loops, certify=True, locked=True)
    forms: dict[str, Mapping[str, LoopFigures]] = {"sampled": sampled}
    for form in () if design.controller.sampled_only else FORMS[1:]:
        other = attempt(f"{form} form", partial(_other_form, design, form, refused), None)
        forms |= {} if other is None else {form: other}
    tell(2, 6)
    cuts = attempt(
        "loops at the break points", lambda: {n: _break_point(loops, n) for n in loops.break_points}, {}
    )
    tell(3, 6)
    points = attempt("loops at the operating points", lambda: operating_points(design, refused), ())
    tell(4, 6)
    budgets = attempt("delay budgets", lambda: _budgets(design, sampled), {})
    tell(5, 6)
    limit = attempt("limit of linear validity", lambda: _onset(loops, sampled), None)
    tell(6, 6)
    return LoopSurvey(design, loops, forms, cuts, points, budgets, limit, tuple(dict.fromkeys(refused)))


def _other_form(design: Design, form: Form, refused: list[str]) -> Mapping[str, LoopFigures]:
    return all_loop_figures(assemble_loops(design, form=form), step=False, refused=refused, certify=True)


def _break_point(loops: Loops, name: str) -> BreakPoint:
    loop = loops.break_points[name]
    exact, states = exact_margins(loops, name) if loop.periodic else None, len(loop.plain_open.A)
    if exact is not None and states > MOST_STATES:
        why = f"the fundamental has {states} states; up to {MOST_STATES} are certified in a report"
        return BreakPoint(None, exact, f"{why}; the exact stability limits are below")
    try:
        return BreakPoint(loop_figures(loop, bandwidth=False, step=False, certify=True), exact)
    except (InputError, NumericalError) as error:
        return BreakPoint(None, exact, str(error))


def operating_points(
    design: Design, refused: list[str], load_Nm: float = 0.0, *, described: bool = True, certify: bool = True
) -> tuple[OperatingPointFigures, ...]:
    """Measure the loops at each operating point that the drive has.

    Sliding, on a crest and in a notch of what a motion averages, driving, driven, in the gap, at rest.

    ``refused`` gets the loops whose margins are not found, and why; ``load_Nm``: at the output, of the points
    that are not told at a load: it chooses the piece of a spring that bends; ``described``: friction
    described at small speeds as well; ``certify``: margins by exact arithmetic.
    """

    def point(
        label: str,
        load: float | None,
        kind: OperatingPoint,
        speed: float | None = None,
        there: Design | None = None,
    ) -> OperatingPointFigures:
        at = Operating(point=kind, load_Nm=load_Nm if load is None else load, speed_amplitude_rad_s=speed)
        slope, loops = slope_at(design, at), loops_at(there or design, at)
        figures = all_loop_figures(loops, step=False, refused=refused, certify=certify, locked=False)
        return OperatingPointFigures(kind, label, load, slope, figures, design.load_unit, there)

    points = [point(SLIDING, None, "sliding")]
    points += [point(label, None, "sliding", there=there) for label, there in turned(design)]
    if design.coupling is not None and design.friction.load_coefficient:
        points.append(point("load driven by the motor", None, "driving"))
        points.append(point("motor driven by the load", None, "driven"))
    if design.coupling is not None and design.coupling.play_rad:
        points.append(point("in the gap of the play", None, "gap"))
    top = drive_figures(design).output_rate_rad_s * design.total_ratio
    speeds = [share * top for share in DESCRIBED_FRACTIONS] if described and 0.0 < top < np.inf else []
    for load in dict.fromkeys(design.validation.loads_Nm):
        points.append(point(at_rest(design), load, "rest"))
        for speed in speeds:
            label = f"speed amplitude {speed:.3g} {'m/s' if design.axis == 'linear' else 'rad/s'}"
            points.append(point(label, load, "describing-function", speed))
    return tuple(points)


SLIDING, AT_REST = "sliding", "at rest"


def at_rest(design: Design) -> str:
    """Rest in words: a stick has no slope, so its margins go with the speed that one is made over."""
    friction = design.friction
    if friction.law == "tanh" or not rubs(design):
        return AT_REST
    unit = "m/s" if design.axis == "linear" else "rad/s"
    return f"{AT_REST}, dry friction over {friction.smoothing_speed_rad_s:.3g} {unit}"


def _budgets(design: Design, figures: Mapping[str, LoopFigures]) -> dict[str, DelayBudget]:
    """Give the delay budget at the lowest gain crossover of each loop."""
    budgets: dict[str, DelayBudget] = {}
    for name, one in figures.items() if design.controller.own_law is None else ():  # else of unknown parts
        margins = one.judged.margins
        crossovers = [m.frequency_rad_s for m in margins.phase_margins if m.frequency_rad_s > 0.0]
        if crossovers:
            quoted = margins.phase_margin
            at = quoted.frequency_rad_s if quoted and quoted.frequency_rad_s > 0 else min(crossovers)
            held = {"rotor": "locked"} if one.held and name == "current" else {"torques_held": bool(one.held)}
            budgets[name] = delay_budget(design, name, at, **held)
    return budgets


def _onset(loops: Loops, figures: Mapping[str, LoopFigures]) -> Onset | None:
    """Give the limit of linear validity around the bandwidth of the outermost loop."""
    outermost = loops.design.controller.outermost
    if not loops.limiters or outermost not in figures:
        return None
    result = figures[outermost]
    crossover = min((m.frequency_rad_s for m in result.margins.phase_margins), default=100.0)
    nyquist = min(path.nyquist_rad_s for path in loops.limiters.values())
    high = min(crossover * 30.0, nyquist * (1.0 - 1e-9))
    limit = with_cogging(loops, onset(loops, np.geomspace(crossover / 100.0, high, 160)))
    return limit if np.isfinite(limit.amplitude_rad).any() else None


COGGING_PART = 0.1
"""Of a period of the cogging, peak: its spring is 5 % softer there, 2 J1(x)/x of x = 0.2 pi."""


def with_cogging(loops: Loops, limit: Onset) -> Onset:
    """The limit with ``"cogging"``: the linear loop has the spring that the cogging is at the motor's angle.

    Its line is where a sine turns the motor by `COGGING_PART` of a period.
    """
    design, response = loops.design, loops.plain_response
    outermost = design.controller.outermost
    if response is None or design.motor.cogging_Nm == 0.0 or outermost != "position":
        return limit
    s = 1j * limit.omega_rad_s
    turned = np.abs(response(np.exp(s * response.dt))) * design.total_ratio
    own = COGGING_PART * 2.0 * np.pi / design.motor.cogging_periods / turned
    first = own < limit.amplitude_rad
    active = tuple("cogging" if of else name for of, name in zip(first, limit.active, strict=True))
    lowest = np.minimum(own, limit.amplitude_rad)
    return Onset(limit.omega_rad_s, lowest, active, {**limit.each_rad, "cogging": own})
