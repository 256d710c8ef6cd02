"""The controller: measured current, speed and angle in, voltage out.

It is a function of its own: with measurements written into ``io`` it runs without the motor's model.
"""

from nonlinear._kernels import blocks, layout, position

KERNELS = True


def overload(p, s, i):
    """The overload (I2t) state, and the current limit of this tick.

    A tick adds less than single precision holds beside 1: what rounding leaves over is added to the next.
    """
    before, share = s[layout.S_OVERLOAD], i / p[layout.CONTINUOUS_CURRENT]
    more = p[layout.OVERLOAD_RATE] * (share * share - before) + s[layout.S_OVERLOAD_REST]
    x = before + more
    s[layout.S_OVERLOAD], s[layout.S_OVERLOAD_REST] = x, more - (x - before)
    if x >= 1.0:
        s[layout.S_OVERLOADED] = 1.0
    elif x < p[layout.OVERLOAD_RELEASE]:
        s[layout.S_OVERLOADED] = 0.0
    lower = min(p[layout.CURRENT_LIMIT], p[layout.CONTINUOUS_CURRENT])
    s[layout.S_CURRENT_LIMIT] = lower if s[layout.S_OVERLOADED] > 0.0 else p[layout.CURRENT_LIMIT]


def outer(p, s, io, th):
    """Update the outermost stage."""
    if p[layout.HAS_FULL_COMMAND] > 0.0:
        position.full_command(p, s, io, th)
        return
    N, y = p[layout.RATIO], th
    if p[blocks.PROBE_Y] > 0.0:
        y = N * position.probed_output(p, s, io, th / N)
    out, flags = position.limited(p, s, p[layout.POSITION_GAIN] * (N * io[layout.IN_COMMAND] - y))
    position.put_outer(p, s, io, out, flags)


def torque_path(p, s, e, limit):
    """Velocity controller with feed-forward: clamp with the anti-windup, filters, clamp again."""
    out, integral, hit = blocks.regulator(
        e, s[layout.S_VELOCITY_INTEGRATOR], p[layout.VELOCITY_GAIN], p[layout.VELOCITY_INTEGRAL],
        s[layout.S_TORQUE_FEEDFORWARD], limit, p[layout.VELOCITY_WINDUP], p[layout.VELOCITY_TRACKING],
    )  # fmt: skip
    s[layout.S_VELOCITY_INTEGRATOR] = integral
    stage = float(layout.FLAG_CURRENT if p[layout.HAS_CURRENT] > 0.0 else layout.FLAG_VOLTAGE)
    count = int(p[layout.TORQUE_FILTERS])
    if count <= 0:
        s[layout.S_FLAGS_VELOCITY] = hit * stage
        return out
    s[layout.S_FLAGS_VELOCITY] = hit * float(layout.FLAG_TORQUE_COMMAND)
    filtered = blocks.chain(p, layout.TORQUE_CHAIN, count, s, layout.S_TORQUE_CHAIN, out)
    out = blocks.clamp(filtered, limit)
    if out != filtered:
        s[layout.S_FLAGS_VELOCITY] += stage
    return out


def own_inner(p, s, io, th, command, measured, extra, limit):
    """A law of one's own of the velocity or the current: its output, before and behind the clamp."""
    angle = blocks.counted(th, p[layout.OWN_COUNTS])
    output = blocks.counted(io[layout.IN_OUTPUT], p[layout.OWN_OUTPUT_COUNTS])
    v = blocks.own_output(p, s, io, command, command - measured, angle, output) + extra
    return v, blocks.clamp(v, limit)


def own_velocity(p, s, io, th, measured, limit):
    """Velocity stage with a law of one's own: its output behind clamp and slope limit."""
    extra = s[layout.S_TORQUE_FEEDFORWARD]
    v, out = own_inner(p, s, io, th, s[layout.S_SPEED_REFERENCE], measured, extra, limit)
    stage = float(layout.FLAG_CURRENT if p[layout.HAS_CURRENT] > 0.0 else layout.FLAG_VOLTAGE)
    s[layout.S_FLAGS_VELOCITY] = 0.0 if out == v else stage
    if p[layout.HAS_CURRENT] > 0.0:
        out, flag = position.sloped(p, s, out, p[layout.VELOCITY_PERIOD])
        s[layout.S_FLAGS_VELOCITY] += flag
    blocks.own_states(p, s, out - v)
    return out


def velocity(p, s, io, w, th):
    """Update the velocity stage."""
    measured = w
    if p[layout.OWN_MEASURES] > 0.0:
        measured = s[layout.S_MEASURED_SPEED]
    elif p[layout.HAS_MEASURED_SPEED] > 0.0:
        measured = blocks.measured_speed(p, s, io, w, th)
    s[layout.S_MEASURED_SPEED] = measured
    e = s[layout.S_SPEED_REFERENCE] - measured
    cascaded = p[layout.HAS_CURRENT] > 0.0
    limit = s[layout.S_CURRENT_LIMIT] if cascaded else s[layout.S_VOLTAGE_LIMIT]
    if p[layout.OWN_STAGE] == layout.OWN_VELOCITY:
        out = own_velocity(p, s, io, th, measured, limit)
    elif p[layout.HAS_FULL_VELOCITY] > 0.0:
        out = torque_path(p, s, e, limit)
        if cascaded:
            out, flag = position.sloped(p, s, out, p[layout.VELOCITY_PERIOD])
            s[layout.S_FLAGS_VELOCITY] += flag
    else:
        step = p[layout.VELOCITY_INTEGRAL]
        out, integral, hit = blocks.pi(
            e, s[layout.S_VELOCITY_INTEGRATOR], p[layout.VELOCITY_GAIN], step, limit
        )
        s[layout.S_VELOCITY_INTEGRATOR] = integral
        s[layout.S_FLAGS_VELOCITY] = hit * float(layout.FLAG_CURRENT if cascaded else layout.FLAG_VOLTAGE)
    if cascaded:
        position.put_current(p, s, io, out)
    else:
        position.put_voltage(p, s, io, out)


def full_current(p, s, io, i, w, th):
    """Current controller with feed-forward, another anti-windup or an overload limit; its output."""
    wanted = blocks.clamp(s[layout.S_CURRENT_REFERENCE], s[layout.S_CURRENT_LIMIT])
    fed = p[layout.BACK_EMF_FEEDFORWARD] != 0.0 and p[layout.OWN_MEASURES] <= 0.0
    if p[layout.HAS_VELOCITY] <= 0.0 and fed:
        s[layout.S_MEASURED_SPEED] = blocks.measured_speed(p, s, io, w, th)
    extra = p[layout.BACK_EMF_FEEDFORWARD] * s[layout.S_MEASURED_SPEED]
    extra += p[layout.RESISTANCE_FEEDFORWARD] * wanted
    limit, integral = s[layout.S_VOLTAGE_LIMIT], s[layout.S_CURRENT_INTEGRATOR]
    if p[layout.OWN_STAGE] == layout.OWN_CURRENT:
        v, out = own_inner(p, s, io, th, wanted, i, extra, limit)
        hit = 0.0 if out == v else 1.0
        blocks.own_states(p, s, out - v)
    else:
        out, integral, hit = blocks.regulator(
            wanted - i, integral, p[layout.CURRENT_GAIN], p[layout.CURRENT_INTEGRAL],
            extra, limit, p[layout.CURRENT_WINDUP], p[layout.CURRENT_TRACKING],
        )  # fmt: skip
    s[layout.S_CURRENT_INTEGRATOR] = integral
    s[layout.S_FLAGS_CURRENT] = hit * float(layout.FLAG_VOLTAGE)
    if s[layout.S_OVERLOADED] > 0.0:
        s[layout.S_FLAGS_CURRENT] += float(layout.FLAG_OVERLOAD)
    return out


def current(p, s, io, i, w, th):
    """Update the current stage: every tick."""
    if p[layout.HAS_FULL_CURRENT] > 0.0:
        out = full_current(p, s, io, i, w, th)
    else:
        e, step = s[layout.S_CURRENT_REFERENCE] - i, p[layout.CURRENT_INTEGRAL]
        before = s[layout.S_CURRENT_INTEGRATOR]
        out, integral, hit = blocks.pi(e, before, p[layout.CURRENT_GAIN], step, s[layout.S_VOLTAGE_LIMIT])
        s[layout.S_CURRENT_INTEGRATOR] = integral
        s[layout.S_FLAGS_CURRENT] = hit * float(layout.FLAG_VOLTAGE)
    position.put_voltage(p, s, io, out)


def control(p, s, io, i, w, th):
    """One tick of the controller; leaves the voltage in the state."""
    if p[layout.OVERLOAD] > 0.0:
        overload(p, s, i)
    due = p[layout.HAS_VELOCITY] <= 0.0 or s[layout.S_UNTIL_VELOCITY] <= 0.0
    if p[layout.OWN_MEASURES] > 0.0 and due:  # before the outermost stage, which takes it too
        s[layout.S_MEASURED_SPEED] = (
            blocks.measured_speed(p, s, io, w, th) if p[layout.HAS_MEASURED_SPEED] > 0.0 else w
        )
    if s[layout.S_UNTIL_OUTER] <= 0.0:
        s[layout.S_UNTIL_OUTER] = p[layout.OUTER_EVERY]
        outer(p, s, io, th)
    s[layout.S_UNTIL_OUTER] -= 1.0
    if p[layout.HAS_VELOCITY] > 0.0:
        if s[layout.S_UNTIL_VELOCITY] <= 0.0:
            s[layout.S_UNTIL_VELOCITY] = p[layout.EVERY_VELOCITY]
            velocity(p, s, io, w, th)
        s[layout.S_UNTIL_VELOCITY] -= 1.0
    if p[layout.HAS_CURRENT] > 0.0:
        current(p, s, io, i, w, th)


def control_tick(p, s, io):
    """The controller alone, on what is measured, from io[IN_CURRENT] on; returns the voltage."""
    if p[layout.SUPPLY] > 0.0:
        s[layout.S_VOLTAGE_LIMIT] = io[layout.IN_BUS]
    control(p, s, io, io[layout.IN_CURRENT], io[layout.IN_SPEED], io[layout.IN_ANGLE])
    s[layout.S_TICK] += 1.0
    return s[layout.S_VOLTAGE]
