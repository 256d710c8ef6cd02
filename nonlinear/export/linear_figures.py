"""Figures and curves of a loop that was assembled; emitted only, for the live page."""

# mypy: disallow-untyped-defs=False
from __future__ import annotations

import math

from actuator_lti.batch._eigen import eigenvalues
from actuator_lti.batch._response import evaluate
from actuator_lti.batch._run import one_loop
from actuator_lti.compiled.kernel import kernel
from nonlinear.export.linear import LOST


@kernel
def poles_of(n, a, b, c, fed_back, poles, work, lent, lent_too, real, imaginary):
    """Poles of a loop, open and closed; 0 where they were not found."""
    for side in range(2):
        closed = fed_back * side
        for i in range(n):
            for j in range(n):
                work[i * n + j] = a[i * n + j] - closed * b[i] * c[j]
        result = eigenvalues(n, work, lent, lent_too, real, imaginary)
        if result == 0:
            return 0
        for i in range(n):
            poles[2 * side * n + i] = real[i]
            poles[(2 * side + 1) * n + i] = imaginary[i]
    return 1


@kernel
def figures(
    n,
    a,
    b,
    c,
    lead,
    time_figures,
    row,
    poles,
    points,
    stack,
    xs,
    rs,
    ss,
    work,
    state,
    exchanged,
    real,
    imaginary,
):
    """Figures of a loop that was assembled (see ``one_loop``); the points scanned, `LOST` without poles."""
    fed_back = 0.0 if math.isnan(lead) else 1.0
    result = poles_of(n, a, b, c, fed_back, poles, work, exchanged, state, real, imaginary)
    if result == 0:
        return LOST
    return one_loop(
        n, a, b, c, poles, lead, time_figures > 0, row, points, stack, xs, rs, ss, work, state, exchanged
    )


@kernel
def stepped(n, h, b, c, lead, count, y, state, after):
    """Step response of a closed loop at its samples; h is A - I. Lead NaN: of A, b, c as they are."""
    fed_back = 0.0 if math.isnan(lead) else 1.0
    for i in range(n):
        state[i] = 0.0
    y[0] = 0.0
    for k in range(1, count):
        error = 1.0 - fed_back * y[k - 1]
        if k == 1 and lead > 0.0:
            error += lead
        for i in range(n):
            value = state[i] + b[i] * error
            for j in range(n):
                value += h[i * n + j] * state[j]
            after[i] = value
        total = 0.0
        for i in range(n):
            state[i] = after[i]
            total += c[i] * after[i]
        y[k] = total


@kernel
def responded(n, h, b, c, count, xs, rs, work, state, exchanged):
    """Response of a loop at angles per sample, as pairs."""
    for k in range(count):
        rr, ri, _slope_r, _slope_i = evaluate(n, h, b, c, xs[k], work, state, exchanged)
        rs[2 * k], rs[2 * k + 1] = rr, ri
