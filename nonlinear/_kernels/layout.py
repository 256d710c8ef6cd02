"""Where each number lives: one flat row of floats goes into a run, one flat row comes out.

A row of floats (and not an object) is what lets thousands of different runs be set up by column
arithmetic: ``rows[:, layout.RESISTANCE] = samples``.  Names are full words, units are SI, motor side.
"""

from __future__ import annotations

# --- parameters of one run -------------------------------------------------------------------------
(
    TICKS,  # number of ticks n; rows k = 0 .. n-1 are sampled at t_k = k Ts
    PERIOD,  # Ts, s
    EVERY_VELOCITY,  # n_v
    EVERY_POSITION,  # n_p
    DELAY_TICKS,  # q, whole ticks of the computing delay
    DELAY_FRACTION,  # f, rest of the computing delay, s, 0 <= f < Ts
    RESISTANCE,
    INDUCTANCE,
    BACK_EMF,  # kE
    TORQUE_CONSTANT,  # kM
    INERTIA,  # J
    SOURCE,  # 1: no electrical dynamics
    SOURCE_GAIN,  # N m/V
    RATIO,  # N
    LAW,  # 0 coulomb, 1 tanh
    VISCOUS,  # Cv for w > 0
    VISCOUS_REVERSE,  # Cv for w < 0
    DRY,  # C0 for w > 0
    DRY_REVERSE,  # C0 for w < 0
    LOAD_COEFFICIENT,  # CM
    BREAKAWAY,  # breakaway ratio
    SMOOTHING,  # w_s of the tanh law
    OFFSET,  # constant torque against positive motion
    BACK_DRIVABLE,  # 1: T_bd = M/N
    TANH_TOLERANCE,
    TANH_LEVEL,  # >= 0: 2**level sub-steps always (order tests)
    HAS_VELOCITY,
    HAS_CURRENT,
    POSITION_GAIN,  # Kv
    FEEDFORWARD,  # k_ff
    VELOCITY_GAIN,
    VELOCITY_INTEGRAL,  # Kp T/Tn
    CURRENT_GAIN,
    CURRENT_INTEGRAL,
    SPEED_LIMIT,
    ACCELERATION_LIMIT,
    CURRENT_LIMIT,
    VOLTAGE_LIMIT,
    SPEED_SOURCE,  # 0 ideal, 1 difference
    DIFFERENCE_SAMPLES,  # m
    COUNTS_PER_RAD,  # 0: not quantised
    FILTER_COEFFICIENT,  # T/(TF + T); 1: no filter
    CURRENT_START,
    SPEED_START,
    ANGLE_START,
    CURRENT_INTEGRATOR_START,
    VELOCITY_INTEGRATOR_START,
    SPEED_COMMAND_START,
    CURRENT_COMMAND_START,
    VOLTAGE_START,
    LOAD,  # constant part of M_ext
    LOAD_SLOPE,  # N m per rad of output angle
    LOAD_TABLE,  # offset into the tables
    LOAD_TABLE_LENGTH,
    TORQUE_TABLE,  # extra torque at the motor shaft
    TORQUE_TABLE_LENGTH,
    MAX_EVENTS,  # per tick
    RECORD_EVERY,
    WITH_ENERGY,
    WITH_EXTREMES,
    WINDOW,  # ticks of one reducer window, 0: none
    CYCLES,  # whole cycles in the window
    HARMONICS,
    STEP_TARGET,  # output angle, rad; 0: no step figures
    STEP_BAND,
    COMMAND,  # first of SIGNAL_SIZE numbers
) = range(66)

# --- a signal: kind and parameters -----------------------------------------------------------------
SIGNAL_SIZE = 8
NONE, STEP, RAMP, SINE, TRIANGLE, CHIRP, LOG_CHIRP, TABLE = range(8)

BIAS = COMMAND + SIGNAL_SIZE
PROBES = BIAS + SIGNAL_SIZE  # four probes: u, i_ref, w_ref, output

# --- a probe ---------------------------------------------------------------------------------------
PROBE_ON = 0
PROBE_GAIN = 1
PROBE_DELAY = 2  # whole samples before the first tap
PROBE_TAPS = 3  # number of taps, 0: no filter
PROBE_TAP = 4  # six taps
MAX_TAPS = 6
PROBE_SIGNAL = PROBE_TAP + MAX_TAPS
PROBE_SIZE = PROBE_SIGNAL + SIGNAL_SIZE
POINT_VOLTAGE, POINT_CURRENT, POINT_SPEED, POINT_OUTPUT = range(4)
POINTS = ("u", "i_ref", "w_ref", "output")

SIZE = PROBES + 4 * PROBE_SIZE

# --- signals that are recorded and reduced, in this order ------------------------------------------
SIGNALS = (
    "reference_rad",
    "output_angle_rad",
    "motor_speed_rad_s",
    "current_A",
    "voltage_V",
    "current_command_A",
    "speed_command_rad_s",
    "probe_u_before",
    "probe_u_after",
    "probe_i_ref_before",
    "probe_i_ref_after",
    "probe_w_ref_before",
    "probe_w_ref_after",
    "probe_output_before",
    "probe_output_after",
)
BASE_SIGNALS = 7
ALL_SIGNALS = 15
# columns of the history: the base signals, then the motor angle, then before and after of each active probe
HISTORY_ANGLE = 7
HISTORY_PROBES = 8

# --- limiters --------------------------------------------------------------------------------------
LIMITERS = ("speed", "acceleration", "current", "voltage")
FLAG_SPEED, FLAG_ACCELERATION, FLAG_CURRENT, FLAG_VOLTAGE = 1, 2, 4, 8
FLAG_STICK = 16

# --- results of one run ----------------------------------------------------------------------------
(
    OUT_TICKS,  # ticks done
    OUT_EVENTS,
    OUT_MAX_EVENTS,  # most events in one tick
    OUT_STICK_TICKS,  # ticks that began at rest
    OUT_CURRENT,  # final values
    OUT_SPEED,
    OUT_ANGLE,
    OUT_CURRENT_INTEGRATOR,
    OUT_VELOCITY_INTEGRATOR,
    OUT_SPEED_COMMAND,
    OUT_CURRENT_COMMAND,
    OUT_VOLTAGE,
    OUT_LIMIT_TICKS,  # 4: ticks active
) = range(13)
OUT_LIMIT_FIRST = OUT_LIMIT_TICKS + 4  # 4: first tick, -1 if never
OUT_ENERGY = OUT_LIMIT_FIRST + 4
(
    ENERGY_INPUT,  # integral of u i
    ENERGY_COPPER,  # integral of R i^2
    ENERGY_DRY,  # dry friction
    ENERGY_VISCOUS,
    ENERGY_OFFSET,  # constant offset torque
    ENERGY_LOAD,  # work done on the load (back-drivable) and against the extra torque
    ENERGY_CONVERSION,  # (kE - kM) i w
) = range(7)
ENERGY_SIZE = 7
OUT_STEP = OUT_ENERGY + ENERGY_SIZE
STEP_T10, STEP_T90, STEP_PEAK, STEP_SETTLED, STEP_LAST = range(5)
STEP_SIZE = 5
OUT_EXTREMES = OUT_STEP + STEP_SIZE  # minimum, maximum of each signal over the run
OUT_WINDOWS = OUT_EXTREMES + 2 * ALL_SIGNALS
# each window: each signal: sum, sum of squares, minimum, maximum, then cosine and sine sums of each harmonic
WINDOW_BASE = 4
MAX_HARMONICS = 9
WINDOW_SIGNAL = WINDOW_BASE + 2 * MAX_HARMONICS
WINDOWS = 2  # 0: the last window, 1: the one before
# what happened in the last window: ticks each limiter was active, ticks that began at rest
OUT_WINDOW_LIMITS = OUT_WINDOWS + WINDOWS * ALL_SIGNALS * WINDOW_SIGNAL
OUT_WINDOW_STICK = OUT_WINDOW_LIMITS + 4
OUT_SIZE = OUT_WINDOW_STICK + 1

# --- status ----------------------------------------------------------------------------------------
OK, TOO_MANY_EVENTS, NOT_FINITE, CANCELLED, NO_ROOT = range(5)
