"""Every number of a design that no small signal sees, confronted once by an exact question.

The tick starts in a state in which the number decides what comes out, predicted by a formula of the model:
friction, play and inertias (`torque_values`), limits and supply (`limit_values`), here profile, feed-forward
and counts. Noise, jitter and their seed are left: they are random.
"""

from collections.abc import Iterator
from dataclasses import replace
from math import ceil, inf, isfinite

from actuator_lti.design.model import Design
from actuator_lti.drive.wiring import wire
from analyses.validation.limit_values import FAR, Pair, limit_rows
from analyses.validation.row import Row
from analyses.validation.torque_values import torque_rows
from nonlinear.rows import Rows


def design_value_rows(design: Design, model: Design | None = None) -> list[Row]:
    """Rows of the drive's numbers, in the order of the power: mechanics first, command last.

    ``design`` is simulated, ``model`` (by default the same) predicted.

    >>> from actuator_lti import load_design
    >>> rows = design_value_rows(load_design("ilr33-amber"))
    >>> {str(row.verdict) for row in rows}
    {'met'}
    """
    pair = Pair(design, design if model is None else model)
    rows = [*torque_rows(pair.design, pair.model), *limit_rows(pair)]
    return [*rows, *_profile(pair), *_feedforward(pair), *_counts(pair)]


def _profile(pair: Pair) -> Iterator[Row]:
    """Limits of the command's derivatives, over its first update, and the mean that limits the jerk."""
    outermost = pair.design.controller.outermost
    if outermost not in ("position", "velocity"):
        return
    model, own = pair.model.command, pair.design.command
    T = wire(pair.design).interval[outermost] * pair.design.controller.period_s
    angle = "m" if pair.design.axis == "linear" else "rad"
    keys = ("rate_rad_s", "acceleration_rad_s2", "jerk_rad_s3")
    columns = ("profile_range", "profile_rate", "profile_acceleration")
    first = 1 if outermost == "position" else 0
    rows = pair.rows(command=replace(own, filter_time_s=0.0))
    free = rows.copy()
    for column in columns:
        free[column] = inf
    for n, key in enumerate(keys[: 3 - first]):
        limit, there = float(getattr(model, key)), float(getattr(own, key))
        if not isfinite(min(limit, there)):
            continue
        alone, column = free.copy(), columns[n + first]
        alone["profile_samples"], alone[column] = 0.0, rows.value(column)
        drive = alone.running().begin(FAR * min(limit, there) * T)
        found = drive.value("PROFILE_SPEED" if n + first else "PROFILE") / (T if n + first == 2 else 1.0)
        unit = f"{angle}/s" + ("", "^2", "^3")[n]
        name = f"command_{key.split('_')[0]}"
        yield pair.judged(name, limit, found, unit, "first update of a large command")
    keeps = outermost == "position" and pair.design.controller.position_loop.law is None  # its reference
    if keeps and isfinite(min(model.jerk_rad_s3, own.jerk_rad_s3)):
        yield _jerk(pair, free, T)


def _jerk(pair: Pair, rows: Rows, T: float) -> Row:
    """Samples of the mean: what one update lets through of a command without other limits."""
    model = pair.model.command
    drive = rows.running().begin(1.0)
    samples = pair.design.total_ratio / drive.value("REFERENCE")
    wanted = max(ceil(2.0 * model.acceleration_rad_s2 / (model.jerk_rad_s3 * T) - 1e-9), 1)
    return pair.judged("command_jerk", float(wanted), samples, "1", "samples of the mean that limits it")


def _feedforward(pair: Pair) -> Iterator[Row]:
    """Feed-forward of dry friction, over the first update of a moving command."""
    model, own = (one.controller.position for one in (pair.model, pair.design))
    if model is None or own is None or not (model.friction_feedforward or own.friction_feedforward):
        return
    wanted = model.friction_feedforward
    rows = pair.rows()
    rows["acceleration_feedforward"] = 0.0
    for side in (1.0, -1.0):
        drive = rows.running().begin(side)
        unit = "V" if pair.design.controller.current is None else "A"
        yield pair.judged("friction_feedforward", side * wanted, drive.value("TORQUE_FEEDFORWARD"), unit,
                          f"command moving {'forward' if side > 0.0 else 'backward'}")  # fmt: skip


def _counts(pair: Pair) -> Iterator[Row]:
    """The size of a count where the controller reads one: one and a half of it are told as one."""
    design, model, N = pair.design, pair.model, pair.design.total_ratio
    unit = "m" if design.axis == "linear" else "rad"
    position, velocity = design.controller.position, design.controller.velocity
    quantum, own = model.output_quantum_rad, design.output_quantum_rad
    read = position is not None and position.sensor == "output" and position.law is None  # keeps its error
    if read and quantum is not None and own is not None:
        rows = pair.rows()
        rows["angle_start"] = 1.5 * quantum * N
        drive = rows.running().begin()
        yield pair.judged("output_count", quantum, -drive.value("ERROR") / N, unit, "position loop")
    if velocity is None or design.encoder.speed == "ideal":
        return
    behind = velocity.sensor == "output"
    quantum, own = (one.output_quantum_rad if behind else one.angle_quantum_rad for one in (model, design))
    scale = N if behind else 1.0
    if quantum is None or own is None:
        return
    rows, name = pair.rows(), "output_count" if behind else "count"
    rows["angle_start"] = 0.5 * quantum * scale
    drive = rows.running()
    if behind and rows.value("elastic_drive"):
        drive.begin(OUTPUT=1.5 * quantum)
    else:
        drive.begin(ANGLE=1.5 * quantum * scale)
    rate = 1.0 / (design.encoder.difference_samples * velocity.every * design.controller.period_s)
    if design.encoder.speed == "tracking":
        rate = rows.value("tracking_speed")
    seen = drive.value("FILTERED_SPEED") / rows.value("filter_coefficient") / rate / scale
    yield pair.judged(name, quantum, seen, unit, "measured speed")
