"""Every number of a design that no small signal sees, confronted once by an exact question.

Friction, breakaway, play and inertias (`torque_values`), limits (`limit_values`), overload and supply
(`power_values`), profile and counts (`command_values`): the compiled tick starts in a state in which the
number decides what comes out of one tick, and the prediction is a formula of the model.  Nothing is waited
for.  Noise, jitter and their seed are left: they are random.
"""

from __future__ import annotations

from actuator_lti.design.model import Design
from analyses.validation.command_values import command_rows
from analyses.validation.limit_values import limit_rows
from analyses.validation.power_values import power_rows
from analyses.validation.row import Row
from analyses.validation.torque_values import torque_rows
from analyses.validation.value_pair import Pair


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
    pair = Pair(design, design if model is None else model)
    rows = [*torque_rows(pair.design, pair.model), *limit_rows(pair), *power_rows(pair)]
    return [*rows, *command_rows(pair)]
