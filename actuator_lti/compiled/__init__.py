"""C99 from kernels written in a subset of Python: the same arithmetic, in the same order; and its libraries.

The subset has floats, whole numbers and flat rows. What is outside of it is refused with its file and line,
so that nothing is translated by guess. `kernel` marks such a function, `emit_c` translates it and all that it
calls, `Library` is the compiled form that a package calls.
"""
