"""The same drive, moving: the nonlinear time-domain model that checks the linear predictions.

>>> from nonlinear import commands, simulate
>>> run = simulate("ilr33-amber", commands.step(0.01), duration_s=0.2, load_Nm=2.0)
>>> run.status, bool(abs(run.output_angle_rad[-1] - 0.01) < 1e-3)
('ok', True)

``run.plot()`` draws it, ``run.to_pandas()`` and ``run.to_csv(path)`` give its rows. `simulate_many` runs many
at once over the cores, `Drive` runs tick by tick inside a loop of your own.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from actuator_lti.start.on_first_use import on_first_use

if TYPE_CHECKING:  # each by its name again: public to type checkers
    from nonlinear import commands as commands
    from nonlinear import loads as loads
    from nonlinear.bench.derivative import Tangent as Tangent
    from nonlinear.bench.derivative import tangent as tangent
    from nonlinear.bench.probe import Probe as Probe
    from nonlinear.drive import Drive as Drive
    from nonlinear.rows import LIMITERS as LIMITERS
    from nonlinear.rows import Rows as Rows
    from nonlinear.runs.batch import simulate_many as simulate_many
    from nonlinear.runs.setup import Reducers as Reducers
    from nonlinear.runs.setup import Run as Run
    from nonlinear.runs.simulation import simulate as simulate
    from nonlinear.runs.trajectory import State as State
    from nonlinear.runs.trajectory import Trajectory as Trajectory

_WHERE = {
    "Drive": "nonlinear.drive",
    "LIMITERS": "nonlinear.rows",
    "Probe": "nonlinear.bench.probe",
    "Reducers": "nonlinear.runs.setup",
    "Rows": "nonlinear.rows",
    "Run": "nonlinear.runs.setup",
    "State": "nonlinear.runs.trajectory",
    "Tangent": "nonlinear.bench.derivative",
    "Trajectory": "nonlinear.runs.trajectory",
    "simulate": "nonlinear.runs.simulation",
    "simulate_many": "nonlinear.runs.batch",
    "tangent": "nonlinear.bench.derivative",
}


__getattr__, __dir__ = on_first_use(__name__, _WHERE, ("commands", "loads"))
