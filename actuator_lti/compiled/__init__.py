"""C99 from kernels written in a subset of Python: the same arithmetic, in the same order; and its libraries.

The subset has floats, whole numbers and flat rows. What is outside of it is refused with its file and line,
so that nothing is translated by guess. `kernel` marks such a function, `emit_c` translates it and all that it
calls, `Library` is the compiled form that a package calls.
"""

from actuator_lti.start.on_first_use import on_first_use

_PUBLIC = {
    "EmitError": "actuator_lti.compiled.kinds",
    "Library": "actuator_lti.compiled.library",
    "Program": "actuator_lti.compiled.program",
    "emit_c": "actuator_lti.compiled.program",
    "kernel": "actuator_lti.compiled.kernel",
}

__all__ = sorted(_PUBLIC)

__getattr__, __dir__ = on_first_use(__name__, _PUBLIC)
