"""Margins, bandwidths and requirements of a design at one operating point; a measured response over them."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np

from actuator_lti.asked.verdict import Tally, Verdict
from actuator_lti.design.loader import AnyDesign, as_design
from actuator_lti.design.model import Design
from actuator_lti.errors import InputError
from actuator_lti.loops import Loops, assemble_loops
from actuator_lti.margins import StabilityMargins, stability_margins
from actuator_lti.measured.response import MeasuredResponse
from actuator_lti.types import Floats
from analyses.linear.loop_figures import LoopFigures, all_loop_figures, loop_figures, other_loops
from analyses.linear.loop_survey import OperatingPointFigures, operating_points
from analyses.linear.responses import response_at
from analyses.margins.asked import Asked
from analyses.records.response import Loop as Kind
from analyses.records.response import read_response
from analyses.specification.requirements import RequirementVerdict, evaluate_requirements, tally
from analyses.specification.weakest import Spread, spread

CURVE_POINTS = 600


@dataclass(frozen=True, kw_only=True, repr=False)
class Measured:
    """A measured response of a loop and the model's at the same frequencies: L, T or S as it was measured."""

    # The file; which loop; L, T or S that was measured
    name: str
    loop: str
    of: str
    frequency_hz: Floats
    measured: np.ndarray
    model: np.ndarray
    radius: Floats  # of the circle about each measured value that holds the true one in 99 % of all cases
    source: str  # where the radius comes from
    open_loop: MeasuredResponse  # the measured L: itself, T/(1 - T) or 1/S - 1
    open_model: np.ndarray
    per_second: np.ndarray  # the model's L were the numbers of the frequencies rad/s and not Hz
    # The model's L on a grid of its own, from a tenth of the least frequency to the largest that it has
    curve_hz: Floats
    curve: np.ndarray
    # Of the measured open loop, each with its range; None where the points are too coarse, see ``note``
    margins: StabilityMargins | None
    note: str
    beyond: int  # points above half the sampling frequency, left out
    left_out: int  # rows of the file without numbers, or at 0 Hz
    read_as: str = ""  # how the columns of the file were taken

    def __repr__(self) -> str:
        f, off = self.frequency_hz, np.abs(self.difference_db).max()
        said = f"{self.name}: {f.size} frequencies, {f[0]:.4g} to {f[-1]:.4g} Hz, {self.of} of {self.loop}; "
        return said + f"the model within {off:.2f} dB and {np.abs(self.difference_deg).max():.1f} deg"

    @property
    def notes(self) -> tuple[str, ...]:
        """What has to be known of the measured margins."""
        return () if self.margins is None else (self.margins.evidence_reason, *self.margins.notes)

    @property
    def nearer(self) -> tuple[str, float] | None:
        """L, T or S of the model, where another one is less than half as far off, and how far in dB (rms).

        Or what was measured with the other sign, ``-`` in front, with a phase whose lag is above 0, ``*``
        behind it, or at frequencies in rad/s.
        """
        models = _closed(self.open_model)
        models |= {f"-{self.of}": -models[self.of], f"{self.of}*": models[self.of].conj()}
        models[f"{self.of} in rad/s"] = _closed(self.per_second)[self.of]
        apart = {of: np.sqrt(np.mean(np.abs(np.log(self.measured / one)) ** 2)) for of, one in models.items()}
        best = min(apart, key=lambda of: apart[of])
        decibel = float(20.0 / np.log(10.0) * apart[best])
        return (best, decibel) if apart[best] < 0.5 * apart[self.of] else None

    @property
    def difference_db(self) -> Floats:
        """Measured over model, dB."""
        return cast("Floats", 20.0 * np.log10(np.abs(self.measured / self.model)))

    @property
    def difference_deg(self) -> Floats:
        """Measured over model, deg."""
        return cast("Floats", np.degrees(np.angle(self.measured / self.model)))

    @property
    def within(self) -> int:
        """Points at which the model lies within the measurement's own spread."""
        return int(np.count_nonzero(np.abs(self.measured - self.model) <= self.radius))


def measured_if_asked(loops: Loops, source: Any, place: str, averages: int | None) -> Measured | None:
    """`measured_over`, where there is a response; what is said of one that is not there is refused."""
    if source is not None:
        return measured_over(loops, source, place, averages)
    if place or averages is not None:
        raise InputError(f"--{'response-of' if place else 'averages'}: allowed with --response")
    return None


def measured_over(loops: Loops, source: Any, place: str = "", averages: int | None = None) -> Measured:
    """Lay a measured response over the loop that it was measured of.

    ``source``: a path, python-control's data, or a MeasuredResponse, whose noise is kept.
    ``place``: a loop or a break point, and what of it was measured behind a colon: ``"velocity"`` (its open
    loop), ``"position:T"`` (closed), ``"i_ref:S"`` (sensitivity); empty: the open outermost loop.
    ``averages``: those behind the coherence.

    Raises `InputError`: for a file that is no response, a loop that is not there, or data of another period.
    """
    every = {**loops.break_points, **loops.present}
    name, _, of = place.partition(":")
    name, of = name or list(loops.present)[-1], of or "L"
    if name not in every or of not in ("L", "T", "S"):
        allowed = f"{', '.join(every)}, each with :T (closed loop) or :S (sensitivity) behind it, or without"
        raise InputError(f"--response-of {place}: allowed: {allowed}")
    loop, read = every[name], read_response(source, averages)
    read.refuse_other_period(name, loop.period_s)
    below = np.full(read.frequency_hz.size, True)
    if loop.period_s is not None:
        below = read.frequency_hz < 0.5 / loop.period_s
    if np.count_nonzero(below) < 2:
        reason = f"no two frequencies below half that of the sampling of the {name} loop"
        raise InputError(f"{read.name}: {reason}")
    omega, values = 2.0 * np.pi * read.frequency_hz[below], read.response[below]

    def model_at(omega: np.ndarray) -> np.ndarray:
        points = 1j * omega if loop.period_s is None else np.exp(1j * omega * loop.period_s)
        return np.asarray(loop.plain_open(points)).reshape(-1)

    read = replace(read, response=values, deviation=read.deviation[below], radius=read.radius[below])
    size = np.abs(values)
    found = MeasuredResponse(omega, values, size * read.radius, loop.period_s, read.noise)
    if not np.isfinite(found.radius).all():  # not known: as the points scatter about their neighbours
        found = MeasuredResponse.from_scatter(found)
    spread_of = np.divide(found.radius, size, out=np.zeros(omega.size), where=size > 0.0)
    opened = replace(read, radius=spread_of).as_loop(cast("Kind", of))
    size = np.abs(opened.response)  # where it is 0 a circle says nothing
    radius = np.multiply(size, opened.radius, out=np.zeros(omega.size), where=size > 0.0)
    data = replace(found, frdata=opened.response, radius=radius)
    L = model_at(omega)
    top = 10.0 * read.frequency_hz[-1] if loop.period_s is None else 0.5 / loop.period_s
    grid = np.geomspace(0.1 * read.frequency_hz[0], top, CURVE_POINTS)
    margins, note = None, ""
    try:
        margins = stability_margins(data)
    except InputError as error:
        note = error.message
    return Measured(
        name=read.name, loop=name, of=of, frequency_hz=omega / (2.0 * np.pi), measured=values,
        model=_closed(L)[of], open_loop=data, open_model=L, per_second=model_at(read.frequency_hz[below]),
        radius=np.asarray(found.radius, dtype=np.float64), source=found.source,
        curve_hz=grid, curve=response_at(loop.plain_open, 2.0 * np.pi * grid),
        margins=margins, note=note, beyond=int((~below).sum()), left_out=read.left_out,
        read_as=read.read_as,
    )  # fmt: skip


def _closed(L: np.ndarray) -> dict[str, np.ndarray]:
    """What may be measured of a loop, of its open loop: that, T and S."""
    return {"L": L, "T": L / (1.0 + L), "S": 1.0 / (1.0 + L)}


@dataclass(frozen=True, kw_only=True)
class Margins:
    """The loops of a design, and whether it does."""

    design: Design
    asked: Asked
    loops: Mapping[str, LoopFigures]  # by name, innermost first
    # Of the sampled loops with sliding friction, whatever is asked
    requirements: tuple[RequirementVerdict, ...]
    # The loop that is closed around the drive, broken at the drive's command
    around: Mapping[str, LoopFigures]
    operating_points: tuple[OperatingPointFigures, ...]
    measured: Measured | None = None  # a measured response over one of the loops
    by_cogging: tuple[str, ...] = ()  # loops that are not stable by cogging alone

    @property
    def spread(self) -> Mapping[str, Mapping[str, Spread]]:
        """Least and largest margins over the operating points, by loop."""
        return spread(self.operating_points)

    @property
    def verdict(self) -> Verdict:
        """The requirements, and that every loop is stable."""
        every = Tally.of(Verdict.of(one.is_stable) for one in (*self.loops.values(), *self.around.values()))
        return (tally(self.requirements) + every).verdict

    @property
    def passed(self) -> bool:
        """Whether all is met."""
        return self.verdict.passes()


def margins(design: AnyDesign, asked: Asked | None = None) -> Margins:
    """Find the certified margins of every loop and judge the requirements.

    Raises `InputError`, `NumericalError`: where loops cannot be assembled as asked, or margins not be found.

    >>> from actuator_lti import load_design
    >>> str(margins(load_design("emps")).verdict)
    'met'
    """
    design = as_design(design)
    asked = asked or Asked()
    loops = assemble_loops(
        design,
        form=asked.form,  # type: ignore[arg-type]
        operating_point=asked.operating_point,  # type: ignore[arg-type]
        load_Nm=asked.load_Nm,
    )
    step = asked.form != "continuous"  # with delays it takes its time
    around = {}
    if asked.around is not None:
        from analyses.linear.outer_loop import loop_around, read_outer_loop  # loads python-control

        outer = read_outer_loop(asked.around)
        around[outer.name] = loop_figures(loop_around(loops, outer), step=step, certify=True)
    measured = measured_if_asked(loops, asked.response, asked.response_of, asked.averages)
    figures = all_loop_figures(loops, step=step, certify=True, locked=True)
    return Margins(
        design=design,
        asked=asked,
        loops=figures,
        requirements=evaluate_requirements(design, figures if as_judged(design, asked) else None),
        around=around,
        operating_points=tuple(operating_points(design, [], asked.load_Nm, described=False, certify=False)),
        measured=measured,
        by_cogging=_by_cogging(loops, figures),
    )


def as_judged(design: Design, asked: Asked) -> bool:
    """Whether the loops asked for are those that requirements are judged on."""
    bends = design.coupling is not None and len(design.coupling.pieces) > 1
    usual = (asked.form, asked.operating_point) == ("sampled", "sliding")
    return usual and not (bends and asked.load_Nm)


def _by_cogging(loops: Loops, figures: Mapping[str, LoopFigures]) -> tuple[str, ...]:
    """Unstable loops that are stable without cogging, which at angle 0 drives the rotor away."""
    motor, lost = loops.design.motor, [name for name, one in figures.items() if one.is_stable is False]
    if not lost or float(motor.over_angle.slope_at(0.0)) <= 0.0:
        return ()
    even = other_loops(loops, replace(loops.design, motor=replace(motor, cogging_Nm=0.0)))
    without = all_loop_figures(even, step=False)
    return tuple(name for name in lost if without[name].is_stable is True)
