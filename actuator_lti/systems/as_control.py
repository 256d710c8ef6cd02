"""The python-control system of a plain one, made where somebody asks for it: importing it takes a second."""

from typing import Any

from actuator_lti.systems.plain_system import PlainDelaySystem, PlainSystem


def as_control(system: Any) -> Any:
    """The named python-control system of a plain one; anything else as it is.

    With exact delays it is an `actuator_lti.systems.delay_system.DelaySystem`, without a
    `control.StateSpace`.
    """
    if not isinstance(system, PlainDelaySystem | PlainSystem):
        return system
    names: Any = {"inputs": [system.source], "outputs": [system.signal], "name": system.name}
    if isinstance(system, PlainDelaySystem):
        from actuator_lti.systems.delay_system import DelaySystem

        return DelaySystem.of(system, **names)
    import control

    more = {"states": [state.replace(".", "_") for state in system.states]} if system.states else {}
    parts = (system.A, system.B, system.C, system.D, system.dt)
    return control.ss(*parts, remove_useless_states=False, **names, **more)
