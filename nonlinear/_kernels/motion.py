"""From t_k to t_(k+1): the delay line, the load, and the plant over the two segments of a tick."""

import math

from actuator_lti.compiled.kernel import seldom
from nonlinear._kernels import elastic_layout, layout
from nonlinear._kernels.elastic import elastic_motion
from nonlinear._kernels.energy import energy_stick, energy_whole
from nonlinear._kernels.segment import segment, slip_step
from nonlinear._kernels.sense import applied_voltage, output_angle
from nonlinear._kernels.smooth import tanh_segment

KERNELS = True

FINITE = 1e15


def hinge_moment(p, s, io):
    """M_ext of this tick: constant, series, slope, damping, and what bends with the angle."""
    y = output_angle(p, s)
    M = p[layout.LOAD] + p[layout.LOAD_SLOPE] * y + io[layout.IN_LOAD]
    if p[layout.LOAD_DAMPING] != 0.0:
        elastic = p[layout.ELASTIC_DRIVE] > 0.0
        M -= p[layout.LOAD_DAMPING] * (
            s[layout.S_OUTPUT_SPEED] if elastic else s[layout.S_SPEED] / p[layout.RATIO]
        )
    for j in range(layout.MOMENT_WAVES):
        order = layout.MOMENT_ORDER + 2 * j  # its phase behind it
        if p[layout.MOMENT_PEAK + j] != 0.0:
            M += p[layout.MOMENT_PEAK + j] * math.sin(p[order] * y + p[order + 1])
    return M


def shaft_torque(p, s, io):
    """Extra torque at the motor shaft: from outside, and the motor's own over its angle."""
    th, T = s[layout.S_ANGLE], io[layout.IN_TORQUE]
    if p[layout.TORQUE_SLOPE] != 0.0:
        T += p[layout.TORQUE_SLOPE] * th
    for j in range(layout.TORQUE_WAVES):
        order = layout.TORQUE_ORDER + 2 * j
        if p[layout.TORQUE_PEAK + j] != 0.0:
            T += p[layout.TORQUE_PEAK + j] * math.sin(p[order] * th + p[order + 1])
    return T


def put_load(p, s, moment, torque):
    """Note dry friction and torque at the motor under a hinge moment and an extra torque."""
    dry = p[layout.LOAD_COEFFICIENT] * abs(moment)
    s[layout.S_LOAD], s[layout.S_EXTRA] = moment, torque
    s[layout.S_DRY], s[layout.S_DRY_REVERSE] = p[layout.DRY] + dry, p[layout.DRY_REVERSE] + dry
    s[layout.S_TORQUE] = p[layout.BACK_DRIVABLE] / p[layout.RATIO] * moment - p[layout.OFFSET] + torque


def fast_slip(p, s, part, u, d):
    """Slip over a segment by its precomputed transition; 0 where the speed might cross zero within."""
    i, w = s[layout.S_CURRENT], s[layout.S_SPEED]
    side = 1 if d < 0.0 else 0
    T = s[layout.S_TORQUE] - d * (s[layout.S_DRY_REVERSE] if d < 0.0 else s[layout.S_DRY])
    o = layout.SLIP + (2 * side + part) * layout.TRANSITION
    i1, w1, th1 = slip_step(p, o, i, w, s[layout.S_ANGLE], u, T)
    if p[layout.SMOOTH] <= 0.0:
        kM = p[layout.TORQUE_CONSTANT]
        Cv = p[layout.VISCOUS_REVERSE] if d < 0.0 else p[layout.VISCOUS]
        drive = p[layout.SOURCE_GAIN] * u + T
        a0, a1 = d * (kM * i + drive - Cv * w), d * (kM * i1 + drive - Cv * w1)
        if not (d * w > 0.0 and d * w1 > 0.0) or (a0 < 0.0 and a1 > 0.0):
            return 0
    if p[layout.WITH_ENERGY] > 0.0:
        energy_whole(p, s, 2 * side + part, i, w, u, T, s[layout.S_TORQUE])
    s[layout.S_CURRENT], s[layout.S_SPEED], s[layout.S_ANGLE] = i1, w1, th1
    return 1


def fast_stick(p, s, part, u):
    """Rest over a whole segment; 0 where the rotor might break away within."""
    i, Tb = s[layout.S_CURRENT], s[layout.S_TORQUE]
    final = u * p[layout.LOCKED_GAIN]
    i1 = final + (i - final) * p[layout.DECAY + part]
    kM, Kg = p[layout.TORQUE_CONSTANT], p[layout.SOURCE_GAIN]
    d0, d1 = kM * i + Kg * u + Tb, kM * i1 + Kg * u + Tb
    up, down = s[layout.S_DRY] * p[layout.BREAKAWAY], -s[layout.S_DRY_REVERSE] * p[layout.BREAKAWAY]
    if down <= d0 <= up and down <= d1 <= up:
        if p[layout.WITH_ENERGY] > 0.0:
            energy_stick(p, s, p[layout.LENGTH + part], i, u)
        s[layout.S_CURRENT] = i1
        return 1
    return 0


def fast_path(p, s, part, u):
    """The short way over a segment in which nothing happens; 0 where it has to be looked at."""
    if p[layout.LOOK] > 0.0:
        return 0
    d = s[layout.S_DIRECTION]
    if d != 0.0:
        return fast_slip(p, s, part, u, d)
    return fast_stick(p, s, part, u)


def event_path(p, s, part, u, events):
    """One segment by the general way; the events of this tick so far, -1 where there are too many."""
    if p[layout.ELASTIC_DRIVE] > 0.0:
        status = elastic_motion(p, s, part, u, s[layout.S_LOAD], s[layout.S_EXTRA])
        return events + s[elastic_layout.ES_HAPPENED] if status == layout.OK else -1.0
    if p[layout.LAW] > 0.0:
        tanh_segment(p, s, part, u)
        return events
    return segment(p, s, part, u, events)


@seldom
def count_events(s, events):
    """Add the events of a tick; -1 marks a failed one."""
    if events < 0.0:
        s[layout.S_STATUS] = float(layout.TOO_MANY_EVENTS)
        return
    s[layout.S_EVENTS] += events
    s[layout.S_MAX_EVENTS] = max(s[layout.S_MAX_EVENTS], events)


def hold(p, s, io):
    """What acts on the plant over the tick that begins: the delay line and the load."""
    # the delay line holds u_k and the q + 1 before it, oldest first
    last = layout.S_QUEUE + int(p[layout.DELAY_LINE]) - 1
    for j in range(layout.S_QUEUE, last):
        s[j] = s[j + 1]
    s[last] = applied_voltage(p, s, io)
    if p[layout.LOAD_VARIES] > 0.0:
        io[layout.IO_MOMENT] = hinge_moment(p, s, io)
        put_load(p, s, io[layout.IO_MOMENT], shaft_torque(p, s, io))


def motion(p, s, io):
    """Advance the plant by one tick."""
    hold(p, s, io)
    events = 0.0
    for part in range(0 if p[layout.SPLIT] > 0.0 else 1, 2):
        if events >= 0.0 and fast_path(p, s, part, s[layout.S_QUEUE + part]) == 0:
            events = event_path(p, s, part, s[layout.S_QUEUE + part], events)
    s[layout.S_HELD] = s[layout.S_QUEUE + 1]
    if events != 0.0:
        count_events(s, events)
    if not (abs(s[layout.S_SPEED]) < FINITE):  # the other states pass through w
        s[layout.S_STATUS] = float(layout.NOT_FINITE)
