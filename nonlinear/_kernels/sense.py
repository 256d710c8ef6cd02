"""What lies between plant and controller: noise, resolution, jitter, and the supply's voltage.

Noise is seeded, and its whole state is two numbers a stream, the same in every language: L'Ecuyer's combined
multiplicative generator (1988), whose products all stay below 2^53, so that floats hold them exactly.
"""

import math

from nonlinear._kernels import layout
from nonlinear._kernels.blocks import clamp
from nonlinear._kernels.elastic_modes import elastic_slopes
from nonlinear._kernels.slipping import derivative
from nonlinear._kernels.smooth import tanh_torque

KERNELS = True

M_1, A_1 = 2147483563.0, 40014.0
M_2, A_2 = 2147483399.0, 40692.0
TURN = 2.0 * math.pi
WARM_UP = 16


def rest(x, m):
    """Remainder of two whole numbers held in floats, x >= 0, below 2^53."""
    r = x - math.floor(x / m) * m
    if r < 0.0:
        r += m
    return r - m if r >= m else r


def uniform(s, at):
    """Next number of the stream at ``s[at]``, above 0 and below 1."""
    s[at] = rest(A_1 * s[at], M_1)
    s[at + 1] = rest(A_2 * s[at + 1], M_2)
    z = s[at] - s[at + 1]
    if z < 1.0:
        z += M_1 - 1.0
    return z / M_1


def normal(s, stream):
    """Next number of a stream with mean 0 and standard deviation 1 (Box and Muller)."""
    at = layout.S_NOISE + 2 * stream
    radius = math.sqrt(-2.0 * math.log(uniform(s, at)))
    return radius * math.cos(TURN * uniform(s, at))


def seed_streams(s, seed):
    """Start every stream; another seed starts all of them elsewhere."""
    for stream in range(4):
        at = layout.S_NOISE + 2 * stream
        s[at] = 1.0 + rest(4.0 * seed + stream, M_1 - 1.0)
        s[at + 1] = 1.0 + rest(12345.0 + 7919.0 * stream + seed, M_2 - 1.0)
        for _ in range(WARM_UP):
            uniform(s, at)


def output_angle(p, s):
    """Angle of the output shaft."""
    return s[layout.S_OUTPUT] if p[layout.ELASTIC_DRIVE] > 0.0 else s[layout.S_ANGLE] / p[layout.RATIO]


def slopes(p, s):
    """(i', w') at the sampling instant under the voltage that acted last."""
    if p[layout.ELASTIC_DRIVE] > 0.0:
        di, dw, _dW, _dd = elastic_slopes(p, s)
        return di, dw
    i, w, d, u = s[layout.S_CURRENT], s[layout.S_SPEED], s[layout.S_DIRECTION], s[layout.S_HELD]
    if d == 0.0:
        return (u - p[layout.RESISTANCE] * i) * p[layout.LOCKED_GAIN] * p[layout.RELAX], 0.0
    T = s[layout.S_TORQUE]
    if p[layout.LAW] > 0.0:
        T += tanh_torque(p, w, s[layout.S_DRY], s[layout.S_DRY_REVERSE])
        return derivative(p, layout.MODES, i, w, u, T)
    T -= d * (s[layout.S_DRY] if d > 0.0 else s[layout.S_DRY_REVERSE])
    return derivative(p, layout.MODES + (layout.MODAL if d < 0.0 else 0), i, w, u, T)


def supply(p, s):
    """Bus voltage of this tick from voltage and current of the motor (model.md section 6)."""
    U, Us, Rs = s[layout.S_VOLTAGE_LIMIT], p[layout.SUPPLY_VOLTAGE], p[layout.SUPPLY_RESISTANCE]
    power, Ts = s[layout.S_VOLTAGE] * s[layout.S_CURRENT], p[layout.PERIOD]
    i_b = power / U if U > 0.0 else 0.0
    balance = layout.S_ENERGY
    if i_b >= 0.0 or p[layout.REGENERATIVE] > 0.0:
        s[layout.S_VOLTAGE_LIMIT] = max(Us - Rs * i_b, 0.0)
        s[balance + layout.ENERGY_SUPPLY] += Us * i_b * Ts
        # the drop that the current of the last tick met; a bus above the source gives from its capacitor
        charged = Us < U and p[layout.REGENERATIVE] <= 0.0
        line = layout.ENERGY_CAPACITOR if charged else layout.ENERGY_SUPPLY_LOSS
        s[balance + line] += (Us - U) * i_b * Ts
        return
    C = p[layout.CAPACITANCE]
    free = math.sqrt(max(U * U - 2.0 * power * Ts / C, 0.0))
    s[layout.S_VOLTAGE_LIMIT] = min(free, p[layout.BRAKE_VOLTAGE])
    after = s[layout.S_VOLTAGE_LIMIT]
    s[balance + layout.ENERGY_BRAKE] += 0.5 * C * (free - after) * (free + after)
    s[balance + layout.ENERGY_CAPACITOR] += 0.5 * C * (after - U) * (after + U)


def applied_voltage(p, s, io):
    """What acts on the motor: the controller's voltage, or its share of a bus voltage that varies."""
    u = s[layout.S_VOLTAGE]
    if p[layout.SUPPLY] == layout.SUPPLY_SCALES:
        u *= io[layout.IN_BUS] / p[layout.SUPPLY_VOLTAGE]
    return u


def sense(p, s, io):
    """Write what the controller measures of current, speed and angles, and the bus voltage."""
    i, w, th, y = s[layout.S_CURRENT], s[layout.S_SPEED], s[layout.S_ANGLE], output_angle(p, s)
    if p[layout.SUPPLY] == layout.SUPPLY_LIMITS:
        s[layout.S_VOLTAGE_LIMIT] = io[layout.IN_BUS]
    elif p[layout.SUPPLY] > 0.0 and p[layout.SUPPLY] < layout.SUPPLY_LIMITS:
        if s[layout.S_TICK] > 0.0:
            supply(p, s)
        io[layout.IN_BUS] = s[layout.S_VOLTAGE_LIMIT]
    rate = s[layout.S_OUTPUT_SPEED] if p[layout.ELASTIC_DRIVE] > 0.0 else w / p[layout.RATIO]
    if p[layout.JITTER] > 0.0:
        late = clamp(p[layout.JITTER] * normal(s, layout.NOISE_INSTANT), 0.5 * p[layout.PERIOD])
        di, dw = slopes(p, s)
        i, th, y = i + late * di, th + late * (w + 0.5 * late * dw), y + late * rate
        w += late * dw
    if p[layout.CURRENT_NOISE] > 0.0:
        i += p[layout.CURRENT_NOISE] * normal(s, layout.NOISE_CURRENT)
    if p[layout.CURRENT_RESOLUTION] > 0.0:
        i = p[layout.CURRENT_RESOLUTION] * float(math.floor(i / p[layout.CURRENT_RESOLUTION] + 0.5))
    if p[layout.ANGLE_NOISE] > 0.0:
        th += p[layout.ANGLE_NOISE] * normal(s, layout.NOISE_ANGLE)
    if p[layout.OUTPUT_NOISE] > 0.0:
        y += p[layout.OUTPUT_NOISE] * normal(s, layout.NOISE_OUTPUT)
    io[layout.IN_OUTPUT_SPEED] = rate
    io[layout.IN_CURRENT], io[layout.IN_SPEED], io[layout.IN_ANGLE], io[layout.IN_OUTPUT] = i, w, th, y
