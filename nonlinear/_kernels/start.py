"""What comes before the first tick, for every drive: lengths, derived parameters, the state at t_0."""

from __future__ import annotations

from actuator_lti.compiled.kernel import kernel
from nonlinear._kernels import layout
from nonlinear._kernels.elastic_prepare import prepare_elastic, prepare_elastic_sizes
from nonlinear._kernels.energy import prepare_forms
from nonlinear._kernels.prepare import prepare, prepare_run_sizes
from nonlinear._kernels.smooth import prepare_tanh
from nonlinear._kernels.tick import init_elastic, init_run, retune_elastic, retune_rigid


@kernel
def prepare_sizes(p):
    """Work out the lengths of both rows; of an elastic drive train also its friction segments."""
    prepare_run_sizes(p)
    if p[layout.ELASTIC_DRIVE] > 0.0:
        prepare_elastic_sizes(p)


@kernel
def derive(p, s):
    """Fill all derived parameters; ``s`` lends its work space."""
    prepare(p, s)
    if p[layout.WITH_ENERGY] > 0.0:
        prepare_forms(p, s)
    if p[layout.LAW] > 0.0:
        prepare_tanh(p, s)
    if p[layout.ELASTIC_DRIVE] > 0.0:
        prepare_elastic(p, s)


@kernel
def init(p, s):
    """Write the state at t_0 into ``s``, ``p[STATE_SIZE]`` numbers."""
    init_run(p, s)
    if p[layout.ELASTIC_DRIVE] > 0.0:
        init_elastic(p, s)


@kernel
def retune(p, s):
    """Fit the state to parameters that were changed between two ticks, after `derive`."""
    retune_rigid(p, s)
    if p[layout.ELASTIC_DRIVE] > 0.0:
        retune_elastic(p, s)
