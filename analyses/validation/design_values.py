"""Every number of a design that no small signal sees, confronted once by an exact question.

Friction and breakaway, play, inertias (`torque_values`), limits, profile, counts, overload and supply
(`controller_values`): the compiled tick starts in a state in which the number decides what comes out of one
tick or a few, and the prediction is a formula of the model.  Nothing is waited for.
"""

from __future__ import annotations

from actuator_lti.design.model import Design
from analyses.validation.controller_values import controller_rows
from analyses.validation.row import Row
from analyses.validation.torque_values import torque_rows


def design_value_rows(design: Design, model: Design | None = None) -> list[Row]:
    """Rows of the drive's numbers, in the order of the power: mechanics first, command last.

    Parameters
    ----------
    design : Design
        What is simulated.
    model : Design, optional
        What is predicted; by default the same.

    Examples
    --------
    >>> from actuator_lti import load_design
    >>> rows = design_value_rows(load_design("ilr33-amber"))
    >>> {str(row.verdict) for row in rows}
    {'met'}
    """
    predicted = design if model is None else model
    return [*torque_rows(design, predicted), *controller_rows(design, predicted)]
