"""The same drive, moving: the nonlinear time-domain model that checks the linear predictions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from nonlinear import commands, loads
    from nonlinear.batch import Reducers, Run, simulate_many
    from nonlinear.drive import Drive
    from nonlinear.probe import Probe
    from nonlinear.rows import LIMITERS, Rows
    from nonlinear.simulation import simulate
    from nonlinear.trajectory import State, Trajectory

__all__ = [
    "LIMITERS",
    "Drive",
    "Probe",
    "Reducers",
    "Rows",
    "Run",
    "State",
    "Trajectory",
    "commands",
    "loads",
    "simulate",
    "simulate_many",
]

_WHERE = {
    "Drive": "nonlinear.drive",
    "LIMITERS": "nonlinear.rows",
    "Probe": "nonlinear.probe",
    "Reducers": "nonlinear.batch",
    "Rows": "nonlinear.rows",
    "Run": "nonlinear.batch",
    "State": "nonlinear.trajectory",
    "Trajectory": "nonlinear.trajectory",
    "simulate": "nonlinear.simulation",
    "simulate_many": "nonlinear.batch",
}


def __getattr__(name: str) -> Any:
    from importlib import import_module

    if name in ("commands", "loads"):
        return import_module(f"nonlinear.{name}")
    if name in _WHERE:
        return getattr(import_module(_WHERE[name]), name)
    raise AttributeError(f"module 'nonlinear' has no attribute {name!r}")
