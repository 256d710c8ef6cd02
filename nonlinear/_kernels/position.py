"""The outermost stage: what it makes of its command, and its law beyond a P loop of position."""

import math

from nonlinear._kernels import blocks, layout

KERNELS = True

CURRENT_RATE, FLAG_CURRENT_RATE = layout.LIMIT["current-rate"], float(layout.FLAG["current-rate"])
STANDING = 1e-13  # change of the reference, relative, below which it stands still but for rounding


def profile(p, s, wanted):
    """Follow the command with limited first and second derivative; exact where it keeps both itself."""
    # it aims at the command's own speed, plus what closes the gap in the fewest samples without overshoot
    # (the discrete-time optimal braking curve; Zanasi, Lo Bianco, Tonielli 2000)
    T, rate, a = p[layout.POSITION_PERIOD], p[layout.PROFILE_RATE], p[layout.PROFILE_ACCELERATION]
    r = blocks.clamp(wanted, p[layout.PROFILE_RANGE])
    x, v, last = s[layout.S_PROFILE], s[layout.S_PROFILE_SPEED], s[layout.S_PROFILE_COMMAND]
    gap = last - x
    closing = gap / T  # covers the gap in whole samples while the speed falls by a T in each
    if a < math.inf:
        d = abs(gap)
        steps = float(math.floor(0.5 * (math.sqrt(1.0 + 8.0 * d / (a * T * T)) - 1.0)))
        speed = d / ((steps + 1.0) * T) + 0.5 * steps * a * T
        closing = speed if gap > 0.0 else -speed
    aim = (r - last) / T + closing
    allowed = blocks.clamp(aim, rate)
    if abs(allowed - v) > a * T:
        allowed = v + a * T if allowed > v else v - a * T
    x = r if allowed == aim and abs(gap) < a * T * T else x + T * allowed
    s[layout.S_PROFILE], s[layout.S_PROFILE_SPEED], s[layout.S_PROFILE_COMMAND] = x, allowed, r
    return x


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
    return blocks.chain(p, layout.COMMAND_CHAIN, int(p[layout.COMMAND_FILTERS]), s, layout.S_COMMAND_CHAIN, r)


def sloped(p, s, v, T):
    """What the slope limit leaves of a current command that is updated every T, and its flag."""
    change = v - s[layout.S_CURRENT_BEFORE]
    allowed = blocks.clamp(change, p[CURRENT_RATE] * T)
    if allowed == change:
        return v, 0.0
    return s[layout.S_CURRENT_BEFORE] + allowed, FLAG_CURRENT_RATE


def limited(p, s, v):
    """What the limits of the next stage leave of v, and their flags; nothing is stored."""
    if p[layout.HAS_VELOCITY] > 0.0:
        target = blocks.clamp(v, p[layout.SPEED_LIMIT])
        change = target - s[layout.S_SPEED_COMMAND]
        allowed = blocks.clamp(change, p[layout.SPEED_STEP])
        flags = 0.0 if target == v else float(layout.FLAG_SPEED)
        if allowed == change:
            return target, flags
        return s[layout.S_SPEED_COMMAND] + allowed, flags + float(layout.FLAG_ACCELERATION)
    if p[layout.HAS_CURRENT] > 0.0:
        target = blocks.clamp(v, s[layout.S_CURRENT_LIMIT])
        out, flags = sloped(p, s, target, p[layout.POSITION_PERIOD])
        return out, flags if target == v else flags + float(layout.FLAG_CURRENT)
    out = blocks.clamp(v, s[layout.S_VOLTAGE_LIMIT])
    return out, 0.0 if out == v else float(layout.FLAG_VOLTAGE)


def put_voltage(p, s, io, v):
    """Make v the voltage of this tick, through its probe."""
    s[layout.S_VOLTAGE_BEFORE] = s[layout.S_VOLTAGE] = v
    if p[blocks.PROBE_U] > 0.0:
        after = blocks.probe(p, s, io, layout.POINT_VOLTAGE, v)
        s[layout.S_VOLTAGE] = blocks.clamp(after, s[layout.S_VOLTAGE_LIMIT])


def put_current(p, s, io, v):
    """Make v the current command, through its probe."""
    s[layout.S_CURRENT_BEFORE] = s[layout.S_CURRENT_REFERENCE] = v
    if p[blocks.PROBE_I] > 0.0:
        after = blocks.probe(p, s, io, layout.POINT_CURRENT, v)
        s[layout.S_CURRENT_REFERENCE] = blocks.clamp(after, s[layout.S_CURRENT_LIMIT])


def put_outer(p, s, io, out, flags):
    """Hand the outermost stage's output to the stage that it drives."""
    s[layout.S_FLAGS_OUTER] = flags
    if p[layout.HAS_VELOCITY] > 0.0:
        s[layout.S_SPEED_COMMAND] = s[layout.S_SPEED_REFERENCE] = out
        if p[blocks.PROBE_W] > 0.0:
            after = blocks.probe(p, s, io, layout.POINT_SPEED, out)
            s[layout.S_SPEED_REFERENCE] = blocks.clamp(after, p[layout.SPEED_LIMIT])
    elif p[layout.HAS_CURRENT] > 0.0:
        put_current(p, s, io, out)
    else:
        put_voltage(p, s, io, out)


def probed_output(p, s, io, y):
    """The output angle behind its probe."""
    s[layout.S_OUTPUT_BEFORE] = y
    s[layout.S_OUTPUT_AFTER] = blocks.probe(p, s, io, layout.POINT_OUTPUT, y)
    return s[layout.S_OUTPUT_AFTER]


def position_feedback(p, s, io, th):
    """The angle that the position loop sees, as an angle of the motor."""
    N = p[layout.RATIO]
    if p[layout.OUTPUT_SENSOR] > 0.0:
        y = blocks.counted(io[layout.IN_OUTPUT], p[layout.POSITION_COUNTS])
        return N * probed_output(p, s, io, y) if p[blocks.PROBE_Y] > 0.0 else N * y
    angle = blocks.counted(th, p[layout.POSITION_COUNTS])
    return N * probed_output(p, s, io, angle / N) if p[blocks.PROBE_Y] > 0.0 else angle


def feedforward(p, s, reference):
    """Note the reference (motor side); returns k_ff dr/dt and renews the torque feed-forward."""
    last, before = s[layout.S_REFERENCE], s[layout.S_REFERENCE_BEFORE]
    change = reference - last
    s[layout.S_REFERENCE], s[layout.S_REFERENCE_BEFORE] = reference, last
    torque = p[layout.ACCELERATION_FEEDFORWARD] * (change - (last - before))
    rounding = STANDING * (abs(reference) + abs(last))
    if change > rounding:
        torque += p[layout.FRICTION_FEEDFORWARD]
    elif change < -rounding:
        torque -= p[layout.FRICTION_FEEDFORWARD]
    s[layout.S_TORQUE_FEEDFORWARD] = torque
    return p[layout.FEEDFORWARD] * change / p[layout.POSITION_PERIOD]


def position_law(p, s, io, reference, th):
    """P, PI or PID of position with feed-forward; returns the output behind the limits, and flags."""
    e = reference - position_feedback(p, s, io, th)
    rate = (e - s[layout.S_ERROR]) / p[layout.POSITION_PERIOD]
    s[layout.S_ERROR] = e
    s[layout.S_ERROR_RATE] += p[layout.DERIVATIVE_COEFFICIENT] * (rate - s[layout.S_ERROR_RATE])
    direct = p[layout.POSITION_GAIN] * e + feedforward(p, s, reference)
    if p[layout.DERIVATIVE] != 0.0:  # nobody waits for the division otherwise
        direct += p[layout.DERIVATIVE] * s[layout.S_ERROR_RATE]
    if p[layout.HAS_VELOCITY] <= 0.0:
        direct += s[layout.S_TORQUE_FEEDFORWARD]
    integral = s[layout.S_POSITION_INTEGRATOR]
    updated = integral + p[layout.POSITION_INTEGRAL] * e
    v = direct + updated
    out, flags = limited(p, s, v)
    if out == v or (v - out) * e < 0.0:
        s[layout.S_POSITION_INTEGRATOR] = updated
        return out, flags
    kept, _flags = limited(p, s, direct + integral)
    return kept, flags


def own_position(p, s, io, reference, th):
    """A law of one's own of the position; its own angle is the one that the probe has passed."""
    angle = blocks.counted(th, p[layout.OWN_COUNTS])
    output = blocks.counted(io[layout.IN_OUTPUT], p[layout.OWN_OUTPUT_COUNTS])
    y = position_feedback(p, s, io, th)
    if p[layout.OUTPUT_SENSOR] > 0.0:
        output = y / p[layout.RATIO]
    else:
        angle = y
    v = blocks.own_output(p, s, io, reference, reference - y, angle, output)
    out, flags = limited(p, s, v)
    blocks.own_states(p, s, out - v)
    return out, flags


def full_command(p, s, io, th):
    """Update the outermost stage, whichever it is."""
    r = shape(p, s, io[layout.IN_COMMAND])
    if p[layout.HAS_POSITION] > 0.0 and p[layout.OWN_STAGE] == layout.OWN_POSITION:
        out, flags = own_position(p, s, io, p[layout.RATIO] * r, th)
    elif p[layout.HAS_POSITION] > 0.0:
        out, flags = position_law(p, s, io, p[layout.RATIO] * r, th)
    elif p[layout.HAS_VELOCITY] > 0.0:
        out, flags = limited(p, s, p[layout.RATIO] * r)
    else:
        out, flags = limited(p, s, r)
    put_outer(p, s, io, out, flags + s[layout.S_FLAGS_PROFILE])
