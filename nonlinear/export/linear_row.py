"""The drive without anything that is not linear: its row, and its start; emitted only, for the live page.

An elastic drive train is held in contact and slipping forward, torque in the direction of motion ("driving"),
on the first piece of its friction map: its guards are taken away, so that nothing ends this mode.
"""

# mypy: disallow-untyped-defs=False
import math

import numpy as np

from actuator_lti.design.over_angle import ROUNDED
from nonlinear._kernels import elastic_layout, layout
from nonlinear._kernels.elastic_modes import enter_mode, put_output
from nonlinear._kernels.start import init

KERNELS = True

CLEARED = np.array([
    layout.LAW, layout.DRY, layout.DRY_REVERSE, layout.OFFSET, layout.LOAD,
    *range(layout.MOMENT_PEAK, layout.LOAD_TABLE), *range(layout.TORQUE_PEAK, layout.SUPPLY_TABLE),
    layout.FRICTION_FEEDFORWARD, layout.COUNTS_PER_RAD, layout.POSITION_COUNTS,
    layout.PROFILED, layout.PROFILE_SAMPLES, layout.SUPPLY, layout.OVERLOAD, layout.CURRENT_RESOLUTION,
    layout.CURRENT_NOISE, layout.ANGLE_NOISE, layout.OUTPUT_NOISE, layout.JITTER, layout.SEED,
    layout.CURRENT_START, layout.SPEED_START, layout.ANGLE_START, layout.CURRENT_INTEGRATOR_START,
    layout.VELOCITY_INTEGRATOR_START, layout.SPEED_COMMAND_START, layout.CURRENT_COMMAND_START,
    layout.VOLTAGE_START, layout.LOAD_TABLE_LENGTH, layout.TORQUE_TABLE_LENGTH, layout.WITH_ENERGY,
    *range(layout.BEND_TORQUE, layout.BEND_STIFFNESS_2 + 1),
    layout.HALF_PLAY, layout.LOAD_DRY, layout.LOAD_OFFSET, layout.TWIST_START, layout.LOAD_SPEED_START,
    layout.MAP_COUNT, layout.MAP_COUNT_REVERSE, layout.OWN_COUNTS, layout.OWN_OUTPUT_COUNTS,
    *range(layout.OWN_START, layout.OWN_START + layout.MOST_STATES),
])  # fmt: skip
UNLIMITED = np.array([
    place for name, place in layout.LIMIT.items()
    if name not in ("overload", "profile")  # switched off above
])  # fmt: skip


def averaged(p):
    """How many waves a drive has the mean of: the first of each torque, gear error and cogging, in motion."""
    return 1 if p[layout.HAS_VELOCITY] > 0.0 and p[layout.HAS_POSITION] <= 0.0 else 0


def slope_at_zero(p, slope, waves, peak, order):
    """Slope of a torque over its angle at zero; what rounding leaves of it, as at a quarter turn, is none."""
    size = abs(slope)
    for j in range(averaged(p), waves):
        steepest, phase = p[peak + j] * p[order + 2 * j], p[order + 2 * j + 1]
        slope += steepest * math.cos(phase)
        size += abs(steepest) * (abs(math.cos(phase)) + abs(phase))
    return 0.0 if abs(slope) <= ROUNDED * size else slope


def stiffness_at_zero(p):
    """Stiffness of the spring's piece on which the load's own torque at angle zero leaves the drive."""
    moment, k = 0.0, p[layout.STIFFNESS]
    for j in range(averaged(p), layout.MOMENT_WAVES):
        moment += p[layout.MOMENT_PEAK + j] * math.sin(p[layout.MOMENT_ORDER + 2 * j + 1])
    torque = abs(moment) * p[layout.RATIO_TO_COUPLING] / p[layout.RATIO]
    for j in range(2):
        bend = layout.BEND_TORQUE + 2 * j
        if p[bend] > 0.0 and torque > p[bend]:
            k = p[bend + 1]
    return k


def linear_row(p, q):
    """Copy the parameters of a run, without anything that is not linear; what bends becomes its slope."""
    for k in range(layout.SIZE):
        q[k] = p[k]
    peak, order = layout.MOMENT_PEAK, layout.MOMENT_ORDER
    q[layout.STIFFNESS] = stiffness_at_zero(p)
    q[layout.LOAD_SLOPE] = slope_at_zero(p, p[layout.LOAD_SLOPE], layout.MOMENT_WAVES, peak, order)
    peak, order = layout.TORQUE_PEAK, layout.TORQUE_ORDER
    q[layout.TORQUE_SLOPE] = slope_at_zero(p, p[layout.TORQUE_SLOPE], layout.TORQUE_WAVES, peak, order)
    if p[layout.MAP_COUNT] > 0.0:  # the first piece of the friction map for w > 0
        q[layout.VISCOUS] = 0.0
    if p[layout.MAP_COUNT] > 1.0:
        at = layout.MAP
        q[layout.VISCOUS] = (p[at + 3] - p[at + 1]) / (p[at + 2] - p[at])
    for k in range(CLEARED.shape[0]):
        q[CLEARED[k]] = 0.0
    for k in range(UNLIMITED.shape[0]):
        q[UNLIMITED[k]] = math.inf
    q[layout.VISCOUS_REVERSE] = q[layout.VISCOUS]
    if p[layout.ELASTIC_DRIVE] <= 0.0 or p[layout.RIGID] > 0.0:  # it acts through |M_ext|
        q[layout.LOAD_COEFFICIENT] = 0.0


def set_off(q, s):
    """Hold an elastic drive train in its linear mode, its angles those of motor and twist."""
    if q[layout.ELASTIC_DRIVE] <= 0.0:
        return
    s[layout.S_DIRECTION], s[elastic_layout.ES_SEGMENT] = 1.0, 0.0
    s[elastic_layout.ES_LOAD], s[elastic_layout.ES_CONTACT] = 1.0, 1.0
    enter_mode(q, s)
    s[elastic_layout.ES_GUARDS] = 0.0
    turned = s[layout.S_ANGLE] / q[layout.RATIO_TO_COUPLING]
    s[elastic_layout.ES_LOAD_ANGLE] = turned - s[elastic_layout.ES_TWIST]
    put_output(q, s)


def at_rest(q, s):
    """Put the drive at its start, ready to be run as a linear map."""
    init(q, s)
    set_off(q, s)
