"""C99 from the compiled functions of the running drive: the same arithmetic, in the same order.

The subset of Python in which `nonlinear._kernels` is written has floats, whole numbers and flat rows.
What is outside the subset is refused with its file and line, so that nothing is translated by guess.
"""

from nonlinear.emit.program import EmitError, Program, emit_c

__all__ = ["EmitError", "Program", "emit_c"]
