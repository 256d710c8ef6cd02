"""What noise of the recorded motion takes from the inertia where no command tells the motion."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from actuator_lti.design.model import Design
from analyses.correlation.compare import white_noise
from analyses.correlation.driving import command_of
from analyses.identification.joint_model import JointModel, Recipe
from analyses.records.compared import place_of
from analyses.records.differentiation import decimated
from analyses.records.naming import RATES
from analyses.records.record import Record, period_of

PERIODS = 20  # of the cut-off: the filters have forgotten an impulse


def with_noise_of_motion(design: Design, model: JointModel, records: Sequence[Record]) -> JointModel:
    """The model with what noise of its regressors took from the values given back.

    White noise adds its own mean square, known from row to row (`white_noise`) and by the filters, to that of
    the acceleration: it comes off the sum of squares (W. A. Fuller, Measurement Error Models, 1987, 2.2).
    Where a command is recorded the simulated motion tells the regressors, which has no noise.
    """
    free = [command_of(design, record) is None or not model.simulated for record in records]
    if "inertia" not in model.names or not any(free):
        return model
    k, gram, noise = model.names.index("inertia"), np.zeros((len(model.names),) * 2), 0.0
    for weight, part, record, noisy in zip(model.weights, model.records, records, free, strict=True):
        gram = gram + weight**2 * part.w.T @ part.w
        if noisy:
            noise += weight**2 * part.rows_used * acceleration_noise(design, record, part.recipe)
    free_of = gram.copy()
    free_of[k, k] -= noise
    share = noise * float(np.linalg.inv(gram)[k, k])
    if not 0.0 < share < 1.0:  # 1: nothing but noise
        return model
    turned = np.linalg.solve(free_of, gram)
    values, covariance = turned @ model.values, turned @ model.covariance @ turned.T
    moved = zip(model.names, (values - model.values).tolist(), strict=True)
    bias = {name: model.bias.get(name, 0.0) - one for name, one in moved}
    note = f"{model.bias_note}; what noise of the recorded motion takes is given back"
    return replace(model, values=values, covariance=covariance, bias=bias, bias_note=note, noise_share=share)


def acceleration_noise(design: Design, record: Record, recipe: Recipe) -> float:
    """Mean square of the noise in the acceleration of a record's rows, (rad/s2)^2."""
    period, place = period_of(record), place_of(design, record)
    values = record[RATES[design.axis]] if place is None else place[1]
    count = max(PERIODS * round(1.0 / (recipe.cutoff_hz * period)), PERIODS * recipe.decimation) + 1
    made = recipe.motion(np.eye(1, count, count // 2)[0], period)
    answer = made.velocity if place is None else made.acceleration
    each = np.column_stack([np.roll(answer, k) for k in range(recipe.decimation)])
    return white_noise(values, values) ** 2 * float(np.sum(decimated(each, recipe.decimation) ** 2))
