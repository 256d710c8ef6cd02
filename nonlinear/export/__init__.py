"""The running drive outside of Python: C99, FMU and WebAssembly, all from the one emitted program.

Nothing here computes: `actuator_lti.compiled` translates `nonlinear._kernels`, and the files of this folder
put names, units, parameters and interfaces around it.
"""

from actuator_lti.start.public_arguments import guard
from nonlinear.export.c_files import c_export
from nonlinear.export.controller import controller_export
from nonlinear.export.fmu import PLATFORMS, fmu_bytes, refuse_unknown

__all__ = ["PLATFORMS", "c_export", "controller_export", "fmu_bytes", "refuse_unknown"]

guard(__name__)
