"""The python-control system of a plain one: made where somebody asks for it.

Importing python-control takes a second, and margins, bandwidths and steps do not need it.
"""

from __future__ import annotations

from typing import Any, TypedDict

from actuator_lti.systems.plain_delays import PlainDelaySystem
from actuator_lti.systems.plain_system import PlainSystem


def as_control(system: Any) -> Any:
    """The named python-control system of a plain one; anything else as it is.

    With exact delays it is an `actuator_lti.systems.delay_system.DelaySystem`, without a
    `control.StateSpace`.
    """
    if isinstance(system, PlainDelaySystem):
        from actuator_lti.systems.delay_system import DelaySystem

        return DelaySystem.of(system, **_names(system))
    if isinstance(system, PlainSystem):
        import control

        more = {"states": [state.replace(".", "_") for state in system.states]} if system.states else {}
        parts = (system.A, system.B, system.C, system.D, system.dt)
        return control.ss(*parts, remove_useless_states=False, **_names(system), **more)
    return system


class Names(TypedDict):
    """Names of a system for python-control."""

    inputs: list[str]
    outputs: list[str]
    name: str


def _names(system: PlainSystem | PlainDelaySystem) -> Names:
    return {"inputs": [system.source], "outputs": [system.signal], "name": system.name}
