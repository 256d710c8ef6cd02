"""Does a record agree with itself and with the drive it is said to come from?"""

from collections.abc import Iterator
from math import inf, isfinite

import numpy as np

from actuator_lti.design.model import Design
from actuator_lti.design.plant import reachable_speed
from actuator_lti.types import Floats
from analyses.records.compared import COSINE, inner, ratio_of, smooth
from analyses.records.driven_motion import load_finding, sign_finding, time_finding
from analyses.records.factors import explaining, named_factor, with_factor
from analyses.records.finding import BAD_ROW, FEW_ROWS, OVER, RATE_TOLERANCE, SURE, Finding
from analyses.records.naming import KNOWN_UNITS, LOADS, RATES
from analyses.records.rate import clock_doubt, clock_finding, rate_finding, rate_ratio
from analyses.records.record import Record
from analyses.records.row_by_row import disorder, frozen, steps_finding
from analyses.records.single_rows import named_rows, noise_bound, place_in_file
from analyses.records.voltage import voltage_finding

FOLLOWED = (
    ("position_reference", "position"),
    ("reference", "output_angle"),
    ("reference", "angle"),
    ("output_speed_reference", "speed"),
    ("speed_reference", "speed"),
    ("velocity_reference", "velocity"),
    ("current_reference", "current"),
    ("voltage_reference", "voltage"),
)


def check_record(design: Design, record: Record) -> tuple[Finding, ...]:
    """Hold a record against itself and against the limits of the design.

    Looked at, where recorded: the speed against the rate of the angle (this also tells a clock that is off),
    angle and output angle against the reduction, voltage against ``R i + kE w``, the command against what
    followed it, and current, speed, voltage, supply and load against the design's limits. A ratio that a
    known factor explains is named.
    """
    design, as_read = record.drive(design), record.as_read or record
    ratio = rate_ratio(design, record)
    found = (
        disorder(as_read),
        steps_finding(design, record, as_read),
        frozen(design, as_read),
        rate_finding(ratio, design, record),
        time_finding(design, record),
        clock_finding(design, record),
        _reduction(design, record),
        voltage_finding(abs(clock_doubt(design, record, ratio)), design, record),
        sign_finding(design, record),
        load_finding(design, record),
        _command(design, record),
        _supply(design, record),
        *_limits(design, as_read),
    )
    return tuple(result for result in found if result is not None)


def _reduction(design: Design, record: Record) -> Finding | None:
    if not {"angle", "output_angle"} <= set(record.signals) or design.axis == "linear":
        return None
    if not any(np.ptp(record[name]) > 0.0 for name in ("angle", "output_angle")):
        return None
    a, b = (record[name] - record[name].mean() for name in ("angle", "output_angle"))
    ratio, cosine = ratio_of(a, design.total_ratio * b)
    subject = "angle against output angle"
    if abs(cosine) < COSINE:
        return Finding(subject, False, "they are not alike")
    passed = abs(ratio - 1.0) <= RATE_TOLERANCE + _twist_share(design, record)
    text = f"the motor angle is {ratio:.4g} times the output angle and the reduction"
    if not passed:
        other = design.total_ratio * b
        slip = _slip(record, a - other, float(np.sum((a - ratio * other) ** 2)))
        text = slip or with_factor(text, ratio, {design.total_ratio: "the reduction, counted twice"})
    return Finding(subject, passed, text)


def _slip(record: Record, off: Floats, left: float) -> str:
    """One slip of an angle that is ``off`` another, where it leaves less squared than is ``left`` without."""
    rows = np.arange(1, len(off))
    before = np.cumsum(off)[:-1]
    taken = before**2 * len(off) / (rows * (len(off) - rows))
    k = int(np.argmax(taken))
    if float(off @ off) - taken[k] >= left:
        return ""
    by = -before[k] * len(off) / (rows[k] * (len(off) - rows[k]))
    where = place_in_file(record, k + 1)
    return f"the motor angle slips by {by:.3g} rad against the output angle, about {where}"


def _twist_share(design: Design, record: Record) -> float:
    """What play, largest moment and load's inertia twist the coupling by, over the output's motion, rms."""
    if design.coupling is None:
        return 0.0
    own = record["output_angle"]
    moment = float(np.max(np.abs(record["torque"]))) if "torque" in record.signals else 0.0
    moment = max(moment, float(np.max(np.abs(design.load.moment_Nm(own)))))
    slope = np.gradient(np.gradient(smooth(record, own), record.time_s), record.time_s)
    moment += design.load.inertia_kgm2 * float(np.sqrt(np.mean(slope[inner(record)] ** 2)))
    behind = design.ratio_behind_coupling
    twist = 0.5 * design.coupling.play_rad + design.coupling.stretch_rad(moment / behind)
    return twist / behind / max(float(np.std(own)), 1e-300)


def _command(design: Design, record: Record) -> Finding | None:
    """A command that is followed at all is followed about one to one, unless a factor is wrong.

    Whether it is followed as the design's loops follow it, the simulation of the record tells.
    """
    for command, answer in FOLLOWED:
        # a step that begins with the record tells no ratio
        if not {command, answer} <= record.signals.keys() or not np.ptp(record[command]):
            continue
        output = (command, answer) in (("reference", "angle"), ("output_speed_reference", "speed"))
        values = record[answer] / (design.total_ratio if output else 1.0)
        ratio, cosine = ratio_of(*(part - part.mean() for part in (values, record[command])))
        subject = f"{answer} against its command"
        if abs(cosine) < 0.7:
            return Finding(subject, None, f"cosine {cosine:.2f}: not followed")
        factor = named_factor(ratio, {design.total_ratio: f"the reduction {design.total_ratio:g}"})
        followed = 0.5 < ratio < 1.5
        wrong = factor is not None and not followed
        text = f"{answer} is {ratio:.4g} times {command}" + f": factor {factor}" * wrong
        return Finding(subject, False if wrong else followed or None, text)
    return None


def _within(subject: str, record: Record, what: str, limit: float, unit: str) -> Finding | None:
    """The largest value of a signal against a limit of the design."""
    if what not in record.signals or not isfinite(limit) or limit <= 0.0:
        return None
    size = np.abs(record[what])
    most, usual = float(np.max(size)), float(np.quantile(size, 1.0 - FEW_ROWS))
    rows = np.flatnonzero(size > OVER * limit + noise_bound(record[what], SURE))
    passed, allowed = usual <= OVER * limit, f"the design's limit is {limit:.4g} {unit}"
    if passed and len(rows):
        return Finding(subject, False, f"{named_rows(record, rows, what, unit)}, {allowed}: {BAD_ROW}")
    text = f"{subject.partition(' ')[0]} up to {most if passed else usual:.4g} {unit}, {allowed}"
    if passed and most > limit:
        text += f", {most / limit:.3g} times; {OVER:g} times are allowed"
    if not passed:
        factor = explaining(usual / limit, unit)
        text += f", {usual / limit:.3g} times" + (f": factor {factor}" if factor else "; is the unit right?")
    return Finding(subject, passed, text)


def _supply(design: Design, record: Record) -> Finding | None:
    if "supply" not in record.signals:
        return None
    level, nominal = float(np.median(record["supply"])), design.limits.voltage_V
    ratio = level / nominal if isfinite(nominal) else 1.0
    passed, text = 0.4 < ratio < 1.6, f"supply {level:.4g} V, the design's {nominal:.4g} V"
    return Finding("supply", passed, text if passed else with_factor(text, ratio))


def _limits(design: Design, record: Record) -> Iterator[Finding | None]:
    motor, limits = design.effective_motor, design.limits
    current = limits.peak_current_A if design.controller.current is not None else inf
    if not isfinite(current) and motor.resistance_ohm is not None:
        current = 2.0 * limits.voltage_V / motor.resistance_ohm
    yield _within("current against its limit", record, "current", current, "A")
    name = RATES[design.axis]
    yield _within(f"{name} against its limit", record, name, reachable_speed(design), KNOWN_UNITS[name])
    voltage = float(np.max(record["supply"])) if "supply" in record.signals else limits.voltage_V
    yield _within("voltage against the supply", record, "voltage", voltage, "V")
    yield _within("load", record, LOADS[design.axis], design.load.moment_max_Nm, design.load_unit)
