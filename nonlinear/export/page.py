"""What the live page must know: places of the rows, limiters, how rows and figures follow from keys."""

from collections.abc import Mapping
from math import pi

from actuator_lti.asked.drive_figure import drive_figure
from actuator_lti.design.access import parameter_value
from actuator_lti.design.model import Design
from actuator_lti.drive.operating import turned
from actuator_lti.drive.signals import Limiter
from actuator_lti.drive.wiring import wire
from actuator_lti.loops.limiters import limiter_places
from nonlinear._kernels import layout as at
from nonlinear.export.linear_loops import SIGNALS as SEEN
from nonlinear.export.statement import Statement, used
from nonlinear.export.trace import Tape, Traced, followed, reached

PLACES = {
    "command": at.IN_COMMAND, "moment": at.IN_LOAD, "output": at.IO_OUTPUT, "speed": at.IO_SPEED,
    "angle": at.IO_ANGLE, "current": at.IO_CURRENT, "voltage": at.IO_VOLTAGE, "flags": at.IO_FLAGS,
    "period": at.PERIOD, "ratio": at.RATIO,
    "stick": at.FLAG_STICK, "dry": at.DRY, "dry_reverse": at.DRY_REVERSE, "load_dry": at.LOAD_DRY,
    "load_coefficient": at.LOAD_COEFFICIENT, "friction_map": at.MAP_COUNT,
    "mean": at.PROFILE_SAMPLES, "torque": at.TORQUE_CONSTANT,
}  # fmt: skip
# of each torque over the angle the place of its slope, then of its waves peak, order and phase
SLOPES = tuple(
    (slope, *((peak + j, order + 2 * j, order + 2 * j + 1) for j in range(waves)))
    for slope, peak, order, waves in (
        (at.LOAD_SLOPE, at.MOMENT_PEAK, at.MOMENT_ORDER, at.MOMENT_WAVES),
        (at.TORQUE_SLOPE, at.TORQUE_PEAK, at.TORQUE_ORDER, at.TORQUE_WAVES),
    )
)
AVERAGED = ((at.MOMENT_PEAK, at.MOMENT_ORDER + 1), (at.TORQUE_PEAK, at.TORQUE_ORDER + 1))
"""Places of peak and phase of the first waves, which a motion averages: gear error, cogging."""
EVERY_POSITION, EVERY_VELOCITY = at.EVERY_POSITION, at.EVERY_VELOCITY
LIMITERS = tuple(zip(at.LIMITERS, at.LIMITER_BITS, strict=True))  # name, bit in the flags


def line_of(limiter: Limiter) -> int | None:
    """The line of `linear_loops.limiter_sizes` in front of a limiter; None where there is none."""
    if limiter.signal not in SEEN or limiter.kind not in ("value", "rate"):
        return None
    return SEEN.index(limiter.signal) + (len(SEEN) if limiter.kind == "rate" else 0)


def limits_seen(design: Design) -> list[tuple[str, int, int]]:
    """Words, place of the limit in the row and line of `limiter_sizes`, of each limiter of a drive."""
    lines = [(place.limiter, line_of(place.limiter)) for place in limiter_places(wire(design))]
    return [(item.words, at.LIMIT[item.name], line) for item, line in lines if line is not None]


def turned_rows(design: Design) -> dict[str, list[tuple[int, float]]]:
    """What a row holds, place by place, where `turned` puts the drive: phases on a crest and in a notch."""
    put = (
        [(phase, 0.0) for _, phase in AVERAGED],
        [(phase, pi) for _, phase in AVERAGED],
        [(peak, 0.0) for peak, _ in AVERAGED],
    )
    return {where: there for (where, _), there in zip(turned(design), put, strict=False)}


def changes_row(design: Design, path: str) -> bool | None:
    """Whether a key has an influence on the row; None where it cannot be followed."""
    places = reached(design, path, Tape(interpreted=True))
    return None if places is None else bool(places)


def changes_figure(design: Design, path: str, name: str, load_Nm: float) -> bool:
    """Whether a key has an influence on a figure of the whole drive."""
    lines = figure_statements(design, {path: parameter_value(design, path)}, name, load_Nm)
    return lines is not None and isinstance(lines[-1].terms[0], str)  # else a number


def figure_statements(
    design: Design, keys: Mapping[str, float], name: str, load_Nm: float
) -> tuple[Statement, ...] | None:
    """The statements from keys to a figure of the whole drive, ``p[0]``; None where it cannot be followed."""
    tape = Tape(interpreted=True)
    try:
        figure = drive_figure(followed(design, keys, tape), name, load_Nm)
    except TypeError:
        return None
    term = figure.name if isinstance(figure, Traced) else float(figure)
    return used([*tape.statements, Statement("store", 0, "", (term,))])
