"""Functions that are emitted only: what a caller outside of Python wants in one call."""

from __future__ import annotations

from typing import Any

import numba

from nonlinear._kernels import layout
from nonlinear._kernels.energy import prepare_forms
from nonlinear._kernels.prepare import prepare
from nonlinear._kernels.smooth import prepare_tanh

emitted: Any = numba.njit(error_model="numpy")  # compiled by numba in tests alone


@emitted
def derive(p, s):  # type: ignore[no-untyped-def]
    """Fill all derived parameters; ``s`` lends its work space."""
    prepare(p, s)
    if p[layout.WITH_ENERGY] > 0.0:
        prepare_forms(p, s)
    if p[layout.LAW] > 0.0:
        prepare_tanh(p, s)
