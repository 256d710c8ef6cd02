"""The following error as a clock: the loops' gains are per second, whatever the drive's torque."""

from __future__ import annotations

import numpy as np

from actuator_lti.design.model import Design
from analyses.estimation.arrays import FloatArray
from analyses.identification.verdict import Item, share_item
from analyses.records.record import Record

LARGEST_ERROR = 0.015
LEAST_ALIKE = 0.9
SMALLEST = 5.0
"""Rms of the following error in steps of the recorded angle below which nothing is said."""


def following_item(design: Design, record: Record, simulated: Record) -> Item | None:
    """Whether the recorded following error is that of the design's loops at this motion.

    Inertia, friction and gravity of a record whose clock runs wrong agree with each other, as its torque is
    right and its motion only stretched. But a position loop over a velocity loop lags by ``(v + i/Kp)/Kv``
    (without the second term where the velocity loop has an integral), whatever the motor: a clock off by a
    factor shows as about the same factor between the recorded following error and the simulated one.

    Returns
    -------
    Item or None
        None where the drive has no such loops, or the two are too unlike to be compared.
    """
    design = record.drive(design)
    control = design.controller
    if control.position is None or control.velocity is None:
        return None
    errors = _errors(design, record, simulated)
    if errors is None:
        return None
    own, model = errors
    size = float(np.linalg.norm(own) * np.linalg.norm(model))
    if size == 0.0 or float(own @ model) / size < LEAST_ALIKE:
        return None
    ratio = float(own @ model) / float(model @ model)
    reason = (
        f"the following error is {ratio:.4g} times that of the design's loops at this motion: "
        f"a clock about {100.0 * (ratio - 1.0):+.2g} % off, a command logged early or late, or another gain"
    )
    label = f"{record.name}: following error is that of the design's loops"
    return share_item(f"following-{record.name}", label, abs(ratio - 1.0), LARGEST_ERROR, reason)


def _errors(design: Design, record: Record, simulated: Record) -> tuple[FloatArray, FloatArray] | None:
    """Recorded and simulated following error at the side that the position loop measures, without means."""
    linear = design.axis == "linear"
    command = "position_reference" if linear else "reference"
    assert design.controller.position is not None
    side = "angle" if design.controller.position.sensor == "motor" else "output_angle"
    place = "position" if linear else side
    if not {command, place} <= set(record.signals) or place not in simulated.signals:
        return None
    factor = design.total_ratio if place == "angle" else 1.0
    record = record.slice(0, len(simulated))  # of a long one the first part is simulated
    wanted = factor * record[command]
    own, model = wanted - record[place], wanted - simulated[place]
    steps = np.abs(np.diff(record[place]))
    step = float(np.min(steps[steps > 0.0], initial=np.inf))
    if not np.isfinite(step) or float(np.std(own)) < SMALLEST * step:
        return None
    return own - own.mean(), model - model.mean()
