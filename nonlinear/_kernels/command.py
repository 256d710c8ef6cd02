"""What the drive makes of its command: a profile, a moving average, a filter."""

from __future__ import annotations

import math

from actuator_lti.compiled.kernel import kernel
from nonlinear._kernels import layout
from nonlinear._kernels.filters import chain
from nonlinear._kernels.regulator import clamp


@kernel
def closing_speed(distance, a, T):
    """Speed at which a distance is covered in whole samples T while the speed falls by a T in each."""
    d = abs(distance)
    if a == math.inf:
        return distance / T
    steps = float(math.floor(0.5 * (math.sqrt(1.0 + 8.0 * d / (a * T * T)) - 1.0)))
    speed = d / ((steps + 1.0) * T) + 0.5 * steps * a * T
    return speed if distance > 0.0 else -speed


@kernel
def profile(p, s, wanted):
    """Follow the command with limited first and second derivative; exact where it keeps both limits itself.

    The profile aims at the command's own speed, plus what closes the gap in the fewest samples without
    overshoot (the discrete-time optimal braking curve; Zanasi, Lo Bianco, Tonielli 2000).
    """
    T, rate, a = p[layout.POSITION_PERIOD], p[layout.PROFILE_RATE], p[layout.PROFILE_ACCELERATION]
    r = clamp(wanted, p[layout.PROFILE_RANGE])
    x, v, last = s[layout.S_PROFILE], s[layout.S_PROFILE_SPEED], s[layout.S_PROFILE_COMMAND]
    gap = last - x
    aim = (r - last) / T + closing_speed(gap, a, T)
    allowed = clamp(aim, rate)
    if abs(allowed - v) > a * T:
        allowed = v + a * T if allowed > v else v - a * T
    x = r if allowed == aim and abs(gap) < a * T * T else x + T * allowed
    s[layout.S_PROFILE], s[layout.S_PROFILE_SPEED], s[layout.S_PROFILE_COMMAND] = x, allowed, r
    return x


@kernel
def average(p, s, x):
    """Mean of the last n values: what an acceleration limit a becomes has a jerk of at most 2 a/(n T)."""
    n, at = int(p[layout.PROFILE_SAMPLES]), int(p[layout.AT_AVERAGE])
    place = int(s[layout.S_AVERAGE_PLACE])
    s[layout.S_AVERAGE_SUM] += x - s[at + place]
    s[at + place] = x
    place += 1
    if place == n:  # summed afresh once a turn, so that rounding does not pile up
        place = 0
        total = 0.0
        for j in range(n):
            total += s[at + j]
        s[layout.S_AVERAGE_SUM] = total
    s[layout.S_AVERAGE_PLACE] = float(place)
    return s[layout.S_AVERAGE_SUM] / n


@kernel
def shape(p, s, wanted):
    """The command behind profile and filter, at the outermost stage's period; notes the profile's flag."""
    r = wanted
    s[layout.S_FLAGS_PROFILE] = 0.0
    if p[layout.PROFILED] > 0.0:
        r = profile(p, s, r)
        if r != wanted:
            s[layout.S_FLAGS_PROFILE] = float(layout.FLAG_PROFILE)
    if p[layout.PROFILE_SAMPLES] > 1.0:
        r = average(p, s, r)
    return chain(p, layout.COMMAND_CHAIN, int(p[layout.COMMAND_FILTERS]), s, layout.S_COMMAND_CHAIN, r)
