"""The drive as a machine with a state, which goes on elsewhere with the same bits: `step` every tick."""

from nonlinear._kernels import elastic_layout, layout
from nonlinear._kernels.blocks import TRACKING, clamp, counted, fill_ring, settle
from nonlinear._kernels.control import control
from nonlinear._kernels.elastic_modes import contact_side, find_mode, put_output, spring_expression
from nonlinear._kernels.motion import motion
from nonlinear._kernels.sense import applied_voltage, sense

KERNELS = True


def init_controller(p, s):
    """Start values of the controller, all histories those of rest or of constant speed."""
    at_output = p[layout.OUTPUT_SENSOR] > 0.0
    th = p[layout.RATIO] * p[layout.OUTPUT_START] if at_output else p[layout.ANGLE_START]
    s[layout.S_CURRENT_INTEGRATOR] = p[layout.CURRENT_INTEGRATOR_START]
    s[layout.S_VELOCITY_INTEGRATOR] = p[layout.VELOCITY_INTEGRATOR_START]
    s[layout.S_SPEED_COMMAND] = s[layout.S_SPEED_REFERENCE] = p[layout.SPEED_COMMAND_START]
    s[layout.S_CURRENT_BEFORE] = s[layout.S_CURRENT_REFERENCE] = p[layout.CURRENT_COMMAND_START]
    s[layout.S_VOLTAGE_BEFORE] = s[layout.S_VOLTAGE] = s[layout.S_HELD] = p[layout.VOLTAGE_START]
    s[layout.S_REFERENCE] = s[layout.S_REFERENCE_BEFORE] = th
    s[layout.S_CURRENT_LIMIT], s[layout.S_VOLTAGE_LIMIT] = p[layout.CURRENT_LIMIT], p[layout.VOLTAGE_LIMIT]
    for j in range(int(p[layout.OWN_STATES])):
        s[int(p[layout.AT_OWN]) + j] = p[layout.OWN_START + j]
    chain = layout.TORQUE_CHAIN
    settle(p, chain, int(p[layout.TORQUE_FILTERS]), s, layout.S_TORQUE_CHAIN, p[layout.CURRENT_COMMAND_START])


def init_estimate(p, s):
    """Start values of the speed measurement: those of constant speed."""
    w, T, at_output = p[layout.SPEED_START], p[layout.VELOCITY_PERIOD], p[layout.SPEED_SENSOR] > 0.0
    th = p[layout.RATIO] * p[layout.OUTPUT_START] if at_output else p[layout.ANGLE_START]
    m, at = int(p[layout.DIFFERENCE_SAMPLES]), int(p[layout.AT_ANGLES])
    for j in range(m):
        s[at + j] = counted(th - (m - j) * T * w, p[layout.COUNTS_PER_RAD])
    if int(p[layout.SPEED_SOURCE]) == TRACKING:
        s[layout.S_TRACKED_ERROR] = counted(th, p[layout.COUNTS_PER_RAD]) - s[at] - T * w if w != 0.0 else 0.0
        s[layout.S_TRACKED_SPEED] = w
    s[layout.S_FILTERED_SPEED] = w
    settle(p, layout.SPEED_CHAIN, int(p[layout.SPEED_FILTERS]), s, layout.S_SPEED_CHAIN, w)
    s[layout.S_MEASURED_SPEED] = w


def init_command(p, s):
    """Start values of profile and command filter: those of the outermost stage."""
    at_output = p[layout.OUTPUT_SENSOR] > 0.0
    r = p[layout.OUTPUT_START] if at_output else p[layout.ANGLE_START] / p[layout.RATIO]
    if p[layout.HAS_POSITION] <= 0.0:
        r = p[layout.VOLTAGE_START]
        if p[layout.HAS_CURRENT] > 0.0:
            r = p[layout.CURRENT_COMMAND_START]
        if p[layout.HAS_VELOCITY] > 0.0:
            r = p[layout.SPEED_COMMAND_START] / p[layout.RATIO]
    s[layout.S_PROFILE] = s[layout.S_PROFILE_COMMAND] = r
    n, at = int(p[layout.PROFILE_SAMPLES]), int(p[layout.AT_AVERAGE])
    for j in range(n):
        s[at + j] = r
    s[layout.S_AVERAGE_SUM] = n * r
    settle(p, layout.COMMAND_CHAIN, int(p[layout.COMMAND_FILTERS]), s, layout.S_COMMAND_CHAIN, r)


def init_lines(p, s):
    """Fill the delay line and the probes' rings."""
    u, y = p[layout.VOLTAGE_START], p[layout.ANGLE_START] / p[layout.RATIO]
    for j in range(int(p[layout.DELAY_LINE])):
        s[layout.S_QUEUE + j] = u
    fill_ring(p, s, layout.POINT_OUTPUT, y)
    fill_ring(p, s, layout.POINT_SPEED, p[layout.SPEED_COMMAND_START])
    fill_ring(p, s, layout.POINT_CURRENT, p[layout.CURRENT_COMMAND_START])
    fill_ring(p, s, layout.POINT_VOLTAGE, u)
    s[layout.S_OUTPUT_BEFORE] = s[layout.S_OUTPUT_AFTER] = y


def put_direction(p, s):
    """Whether and which way the motor slips at its speed; a smooth one knows no rest."""
    w = s[layout.S_SPEED]
    s[layout.S_DIRECTION] = -1.0 if w < 0.0 else (1.0 if w > 0.0 else 0.0)
    if p[layout.SMOOTH] > 0.0 or p[layout.LAW] > 0.0:
        s[layout.S_DIRECTION] = 1.0


def init_elastic(p, s):
    """What an elastic drive train has besides: load side, twist, discrete state, the output's own angle."""
    s[elastic_layout.ES_TWIST], s[elastic_layout.ES_LOAD_SPEED] = (
        p[layout.TWIST_START],
        p[layout.LOAD_SPEED_START],
    )
    turned = s[layout.S_ANGLE] / p[layout.RATIO_TO_COUPLING]
    s[elastic_layout.ES_LOAD_ANGLE] = turned - s[elastic_layout.ES_TWIST]
    put_output(p, s)
    find_mode(p, s)
    fill_ring(p, s, layout.POINT_OUTPUT, s[layout.S_OUTPUT])
    s[layout.S_OUTPUT_BEFORE] = s[layout.S_OUTPUT_AFTER] = s[layout.S_OUTPUT]


def decide(p, s, io):
    """Sense and control at t_k, and note what there is to record."""
    i, w, th = s[layout.S_CURRENT], s[layout.S_SPEED], s[layout.S_ANGLE]
    if p[layout.HAS_INSTRUMENTS] > 0.0:
        sense(p, s, io)
        control(p, s, io, io[layout.IN_CURRENT], io[layout.IN_SPEED], io[layout.IN_ANGLE])
    else:
        control(p, s, io, i, w, th)
    io[layout.IO_REFERENCE] = io[layout.IN_COMMAND]
    io[layout.IO_OUTPUT] = s[layout.S_OUTPUT] if p[layout.ELASTIC_DRIVE] > 0.0 else th / p[layout.RATIO]
    io[layout.IO_SPEED], io[layout.IO_CURRENT], io[layout.IO_ANGLE] = w, i, th
    io[layout.IO_VOLTAGE] = applied_voltage(p, s, io)
    io[layout.IO_CURRENT_COMMAND] = s[layout.S_CURRENT_REFERENCE]
    io[layout.IO_SPEED_COMMAND] = s[layout.S_SPEED_REFERENCE]
    io[layout.IO_FLAGS] = s[layout.S_FLAGS_OUTER] + s[layout.S_FLAGS_VELOCITY] + s[layout.S_FLAGS_CURRENT]
    if s[layout.S_DIRECTION] == 0.0:
        io[layout.IO_FLAGS] += float(layout.FLAG_STICK)
    if p[layout.NOTING] > 0.0:
        note_more(p, s, io)


def note_more(p, s, io):
    """Note both sides of each probe, the current command under overload, an elastic drive's load side."""
    if p[layout.ELASTIC_DRIVE] > 0.0:
        io[layout.IO_OUTPUT_SPEED], io[layout.IO_TWIST] = s[layout.S_OUTPUT_SPEED], s[elastic_layout.ES_TWIST]
        side = contact_side(s)
        io[layout.IO_COUPLING_TORQUE] = side * spring_expression(p, s, side)
    if p[layout.OVERLOAD] > 0.0:
        io[layout.IO_CURRENT_COMMAND] = clamp(s[layout.S_CURRENT_REFERENCE], s[layout.S_CURRENT_LIMIT])
    if p[layout.PROBING] > 0.0:
        at = layout.IO_PROBES
        io[at], io[at + 1] = s[layout.S_VOLTAGE_BEFORE], s[layout.S_VOLTAGE]
        io[at + 2], io[at + 3] = s[layout.S_CURRENT_BEFORE], s[layout.S_CURRENT_REFERENCE]
        io[at + 4], io[at + 5] = s[layout.S_SPEED_COMMAND], s[layout.S_SPEED_REFERENCE]
        io[at + 6], io[at + 7] = s[layout.S_OUTPUT_BEFORE], s[layout.S_OUTPUT_AFTER]


def step(p, s, io):
    """One tick: sense, control, move.  ``s[S_STATUS]`` says whether it went well."""
    decide(p, s, io)
    motion(p, s, io)
    s[layout.S_TICK] += 1.0


def tick(p, s, io):
    """One tick, inputs held: sense, control, move by one period; returns a status."""
    s[elastic_layout.ES_ROOM] = 0.0  # the state may have been changed
    step(p, s, io)
    return int(s[layout.S_STATUS])


def get(p, s, to):
    """Copy the state out, p[STATE_SIZE] numbers."""
    for j in range(int(p[layout.STATE_SIZE])):
        to[j] = s[j]


def set_state(p, s, source):
    """Copy a state in."""
    for j in range(int(p[layout.STATE_SIZE])):
        s[j] = source[j]
