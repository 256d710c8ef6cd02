"""Linear loops of a design: nesting, break points, and what each limiter sees.

Light to import; python-control is loaded when loops are assembled.
"""

from actuator_lti.loops.assemble import assemble_loops
from actuator_lti.loops.periodic import ExactMargins, PeriodicLoop, exact_margins, periodic_loop
from actuator_lti.loops.result import Form, InnerLoops, Loop, Loops
from actuator_lti.start.public_arguments import guard

__all__ = [
    "ExactMargins", "Form", "InnerLoops", "Loop", "Loops", "PeriodicLoop", "assemble_loops", "exact_margins",
    "periodic_loop"
]  # fmt: skip

guard(__name__)
