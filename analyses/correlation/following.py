"""How a record follows its command beside how the design's loops do: what its clock and scale are off by."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from actuator_lti.design.control import FEED_FORWARD
from actuator_lti.design.model import Design
from actuator_lti.types import Floats
from analyses.correlation.driving import Driven, command_of
from analyses.estimation.least_squares import identifiable, solve
from analyses.records.compared import COSINE, ratio_of
from analyses.records.finding import OVER, RATE_TOLERANCE, SURE, Finding
from analyses.records.naming import KNOWN_UNITS, PLACES
from analyses.records.record import Record

LIMITED = {"current": "limits.peak_current", "speed": "limits.speed", "velocity": "limits.speed"}


@dataclass(frozen=True)
class Followed:
    """Shares by which a record's clock and the scale of its position are off, 0 where chance explains it."""

    stage: str  # that is commanded; behind a speed clock and scale are one
    cosine: float  # correlation of the recorded motion with the simulated one
    clock: float  # of the following error, recorded over simulated
    off: float = 0.0  # of what the position has too much of the motion
    limit: str = ""  # of the drive, where the loops take far more of a signal for the same command
    place: str = ""  # the signal that it is of
    lags: bool = True  # the simulated following error makes its speed, whatever the drive's torque
    zero: float = 0.0  # of the place from that of its command, rad (m), where that is most of what is off

    @property
    def fails(self) -> bool:
        """Whether they are off by more than an interval can hold."""
        return self.cosine < COSINE or max(abs(self.clock), abs(self.off)) > RATE_TOLERANCE

    @property
    def words(self) -> str:
        """What is off, by how much, and by what."""
        limit = f", or {self.limit}" * bool(self.limit)
        if self.zero:
            unit = "m" if self.place == "position" else "rad"
            why = f"the zero of the {self.place} is {self.zero:.4g} {unit} from that of its command"
            return f"{why}: offset of its column in a record file"
        if self.cosine < COSINE:
            other = f": another command{limit}" * bool(limit)
            return f"the motion is not that of the command (correlation {self.cosine:.2f}){other}"
        scale = "counts a revolution, the reduction, or a unit"
        what, ratio, of = "motion", 1.0 + self.clock, "which the loops make of the commanded speed"
        cause = f"the clock, {scale}"
        if abs(self.off) > RATE_TOLERANCE:
            what, ratio, of = "recorded position", 1.0 + self.off, "which the loops follow the command with"
            cause = scale
        elif self.stage == "position":
            what, of = "following error", "of the design's loops at this motion"
            clock = f"a clock about {100.0 * self.clock:+.2g} % off, " * (ratio > 0.0)
            cause = f"{clock}a command logged early or late, or another gain"
        return f"the {what} is {ratio:.4g} times that {of}: {cause}{limit}"


def followed(
    design: Design, record: Record, simulated: Mapping[str, Floats], command: str | None = None
) -> Followed | None:
    """The motion behind a command as a clock: the loops' gains are per second, whatever the drive's torque.

    Inertia, friction and gravity of a record whose clock runs wrong agree with each other, as its torque is
    right and its motion only stretched. But a position loop T over a velocity loop lags by ``(v + i/Kp)/Kv``
    (without the second term where the velocity loop has an integral), whatever the motor: a clock off by a
    factor changes Kv by it, so the motion by ``T (command - motion)``; a scale of the position by a part of
    the motion. Both are regressed together. A speed is followed one to one: there clock and scale are one.
    Noise is in the recorded position alone. None where no such loop acts, or the motion does not tell.
    """
    design = record.drive(design)
    control, driven = design.controller, command_of(design, record, command)
    if driven is None or control.velocity is None or driven.stage not in ("position", "velocity"):
        return None
    at_output = driven.stage == "position" and control.position and control.position.sensor != "motor"
    place = "position" if design.axis == "linear" else "output_angle" if at_output else "angle"
    if place not in simulated or place not in record.signals:
        return None
    model = simulated[place]
    own = record[place][: len(model)]  # of a long one the first part
    columns = [model]
    if (by_clock := moved_by_clock(driven, record, place, model)) is not None:
        columns = [by_clock, model]
    table = np.column_stack([values - values.mean() for values in columns])
    kept, _ = identifiable(table, ("clock", "motion")[-len(columns) :])
    if 0 not in kept or not np.ptp(own):
        return None
    size = np.linalg.norm(table[:, kept], axis=0)
    solved = solve(table[:, kept] / size, own - own.mean() - table[:, -1])
    shares, errors = solved.values / size, np.sqrt(np.diag(solved.correlated)) / size
    _, cosine = ratio_of(own - own.mean(), model - model.mean())
    clock, *off = np.where(np.abs(shares) > SURE * errors, shares, 0.0).tolist()
    limit, lags = _limit(record.signals, simulated), True
    position, error = control.position, _following_error(driven, place, model)
    if error is not None and position is not None and any(getattr(position, name) for name in FEED_FORWARD):
        fed = position.feedforward * np.gradient(error + model)
        lags = ratio_of(error - error.mean(), np.gradient(model) - fed)[1] >= COSINE
    return Followed(driven.stage, cosine, clock, sum(off), limit, place, lags)


def _limit(recorded: Mapping[str, Floats], simulated: Mapping[str, Floats]) -> str:
    """A limit of the drive that the design does not have: of what is longest near its largest value."""
    reasons = dict[float, str]()
    for name, key in LIMITED.items():
        sizes, unit = [np.abs(one[name]) for one in (recorded, simulated) if name in one], KNOWN_UNITS[name]
        if len(sizes) == 2 and (most := sizes[0].max()) < (would := sizes[1].max()) / OVER:
            why = (
                f"the {name} stays below {most:.3g} {unit}, the design's loops take up to {would:.3g} {unit}"
            )
            reasons[float(np.mean(sizes[0] > most / OVER))] = f"a lower limit of the {name} ({key}): {why}"
    return reasons[max(reasons)] if reasons else ""


def moved_by_clock(driven: Driven, record: Record, place: str, model: Floats) -> Floats | None:
    """By what a simulated motion changes for each part that its record's clock is off, see `followed`.

    ``place``: the signal that ``model`` is of. None where that is no place, or no position is commanded.
    """
    position, error = driven.design.controller.position, _following_error(driven, place, model)
    if error is None or position is None:
        return None
    lag = position.gain * record.period_s
    return np.asarray(-lfilter([-np.expm1(-lag)], [1.0, -np.exp(-lag)], error))


def _following_error(driven: Driven, place: str, model: Floats) -> Floats | None:
    """Command less a simulated motion; None where that is no place, or no position is commanded."""
    control = driven.design.controller
    if place not in PLACES or driven.stage != "position" or control.velocity is None or not control.position:
        return None
    factor = driven.design.total_ratio if place == "angle" else 1.0
    return factor * driven.values[: len(model)] - model


def following_finding(design: Design, one: Followed) -> Finding:
    """The same of a design as it is; not determined where the motion is another, which its error tells.

    A speed loop without an integral leaves an error that the design's friction makes, and what is fed forward
    one that all its torques make: no proof of a clock.
    """
    loop, subject = design.controller.velocity, "following error against that of the design's loops"
    if one.zero:
        return Finding(subject, False, one.words)
    if one.cosine < COSINE:
        return Finding(subject, None, one.words)
    if not one.fails:
        largest = 100.0 * max(abs(one.clock), abs(one.off))
        return Finding(subject, True, f"within {largest:.2g} %" if largest else "they agree but for chance")
    proof = (one.lags or one.limit) and loop is not None and loop.integral_time_s is not None
    return Finding(subject, False if proof else None, one.words)
