"""Frequency response of a small sampled loop and what is read off it, compiled.

A loop is ``L(z) = c (z I - A)^-1 b`` with A in upper Hessenberg form; h is A - I, so that near z = 1
nothing cancels: ``z - 1 = -2 sin(x/2)^2 + j sin x`` at the angle x = w T.  Derivatives are exact.
"""

# mypy: disallow-untyped-defs=False
from __future__ import annotations

import numpy as np

from ._compiled import kernel

GAIN, PHASE, SENSITIVITY, BANDWIDTH, QUARTER, RESONANCE = range(6)
LOST = 1e-12  # of the largest |L| above 0.3 rad: less is rounding, as of a zero at Nyquist
HALF_LOG_2 = 0.34657359027997264


@kernel
def evaluate(n, h, b, c, x, work, state, exchanged):
    """L and dL/dx at the angle x (rad per sample), by Gaussian elimination with row exchanges."""
    sine = np.sin(0.5 * x)
    delta = complex(-2.0 * sine * sine, np.sin(x))
    for i in range(n):
        for j in range(max(i - 1, 0), n):
            work[i, j] = -h[i, j]
        work[i, i] += delta
        state[i] = b[i]
        exchanged[i] = 0.0
    for k in range(n - 1):
        below = work[k + 1, k]
        pivot = work[k, k]
        if abs(below.real) + abs(below.imag) > abs(pivot.real) + abs(pivot.imag):
            for j in range(k, n):
                work[k, j], work[k + 1, j] = work[k + 1, j], work[k, j]
            state[k], state[k + 1] = state[k + 1], state[k]
            work[k + 1, k] = pivot / below

            exchanged[k] = 1.0
        else:
            work[k + 1, k] = below / pivot if pivot != 0.0 else 0.0
        factor = work[k + 1, k]
        if factor != 0.0:
            for j in range(k + 1, n):
                work[k + 1, j] -= factor * work[k, j]
            state[k + 1] -= factor * state[k]
    response = 0.0j
    for i in range(n - 1, -1, -1):
        total = state[i]
        for j in range(i + 1, n):
            total -= work[i, j] * state[j]
        state[i] = total / work[i, i]
        response += c[i] * state[i]
    return response, complex(1.0 + delta.real, delta.imag) * 1j * -_again(n, c, work, state, exchanged)


@kernel
def _again(n, c, work, state, exchanged):
    """c (z I - A)^-1 state with the factors that evaluate left behind."""
    carry = state[0]
    for k in range(n - 1):
        after = state[k + 1]
        if exchanged[k] > 0.5:
            carry, after = after, carry
        state[k] = carry
        carry = after - work[k + 1, k] * carry
    state[n - 1] = carry
    total_response = 0.0j
    for i in range(n - 1, -1, -1):
        total = state[i]
        for j in range(i + 1, n):
            total -= work[i, j] * state[j]
        state[i] = total / work[i, i]
        total_response += c[i] * state[i]
    return total_response


@kernel
def closed_loop(response, x, lead):
    """T = L/(1 + L) with the feed-forward in front, ``1 + lead (1 - 1/z)``; lead NaN: the response itself."""
    if np.isnan(lead):
        return response
    closed = response / (1.0 + response)
    if lead != 0.0:
        closed *= 1.0 + lead * (1.0 - complex(np.cos(x), -np.sin(x)))
    return closed


@kernel
def quantity(mode, response, slope, level, x, lead):
    """The function whose zero is looked for, from L and dL/dx at x."""
    if mode == GAIN:
        return np.log(abs(response))
    if mode == PHASE:
        return response.imag / abs(response)
    if mode == SENSITIVITY:
        return (slope / (1.0 + response)).real
    if mode == RESONANCE:  # d ln|T| / dx
        if np.isnan(lead):
            return (slope / response).real
        value = (slope / (response * (1.0 + response))).real
        if lead != 0.0:
            back = complex(np.cos(x), -np.sin(x))
            value += (lead * 1j * back / (1.0 + lead * (1.0 - back))).real
        return value
    closed = closed_loop(response, x, lead)
    if mode == BANDWIDTH:
        return np.log(abs(closed) / level) + HALF_LOG_2
    return closed.real / abs(closed)  # QUARTER


@kernel
def root(mode, level, lead, x1, f1, x2, f2, n, h, b, c, work, state, exchanged):
    """The zero between x1 and x2 (signs differ), to rounding (Chandrupatla 1997), and L there."""
    t = 0.5
    x3 = x1
    f3 = f1
    response = 0.0j
    x = x1
    for _ in range(80):
        x = x1 + t * (x2 - x1)
        response, derivative = evaluate(n, h, b, c, x, work, state, exchanged)
        f = quantity(mode, response, derivative, level, x, lead)
        if (f > 0.0) == (f1 > 0.0):
            x3, f3 = x1, f1
        else:
            x3, f3 = x2, f2
            x2, f2 = x1, f1
        x1, f1 = x, f
        best_x = x2 if abs(f2) < abs(f1) else x1
        tolerance = 4e-16 * abs(best_x)
        if f == 0.0 or abs(x2 - x1) <= 4.0 * tolerance:
            break
        share = tolerance / abs(x2 - x1)
        xi = (x1 - x2) / (x3 - x2)
        phi = (f1 - f2) / (f3 - f2)
        if phi * phi < xi and (1.0 - phi) * (1.0 - phi) < 1.0 - xi:
            t = f1 / (f2 - f1) * f3 / (f2 - f3) + (x3 - x1) / (x2 - x1) * f1 / (f3 - f1) * f2 / (f3 - f2)
        else:
            t = 0.5
        t = min(max(t, share), 1.0 - share)
    return x, response


@kernel
def _keep(count, x, response, slope, xs, rs, ss):
    xs[count] = x
    rs[count] = response
    ss[count] = slope
    return count + 1


@kernel
def scan(n, h, b, c, grid, points, tolerance, stack, xs, rs, ss, work, state, exchanged):
    """Responses on a grid of angles, refined until log L is a cubic between neighbours; return the count.

    An interval is halved until the change of log L over it meets the trapezoidal rule on its exact
    derivative to ``tolerance`` (nepers and radians), so that no half turn or resonance hides inside. Where L
    is lost in rounding (next to a multiple zero at Nyquist) nothing is refined, its slope is put down as 0.
    """
    capacity = xs.size
    response, derivative = evaluate(n, h, b, c, grid[0], work, state, exchanged)
    count = _keep(0, grid[0], response, derivative, xs, rs, ss)
    largest = 0.0
    for g in range(1, points):
        stack[0] = grid[g]
        depth = 1
        while depth > 0:
            x = stack[depth - 1]
            response, derivative = evaluate(n, h, b, c, x, work, state, exchanged)
            if x > 0.3:
                largest = max(largest, abs(response))
            if abs(response) < LOST * largest:
                derivative = 0.0j
            left = count - 1
            width = x - xs[left]
            ratio = response / rs[left]
            predicted = 0.5 * width * (derivative / response + ss[left] / rs[left])
            gain_error = np.log(abs(ratio)) - predicted.real
            turn = np.arctan2(ratio.imag, ratio.real) - predicted.imag
            turn -= 2.0 * np.pi * np.round(turn / (2.0 * np.pi))
            smooth = abs(gain_error) + abs(turn) < tolerance and abs(predicted.imag) < 1.0
            room = depth < stack.size and count + depth + points - g < capacity - 2
            if smooth or derivative == 0.0 or not room or width < 1e-12 * x:
                count = _keep(count, x, response, derivative, xs, rs, ss)
                depth -= 1
            else:
                stack[depth] = xs[left] + 0.5 * width if x < 3.0 * xs[left] else np.sqrt(xs[left] * x)
                depth += 1
    return count
