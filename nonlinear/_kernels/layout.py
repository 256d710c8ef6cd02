"""Where each number lives: flat rows of floats for parameters, state, inputs and outputs, and results.

A row of floats (and not an object) is what lets thousands of different runs be set up by column
arithmetic, what a snapshot of the whole drive is, and what C code takes unchanged.  Names are full words,
units are SI, motor side.

``p``, the parameters: `SIZE` numbers that describe a run (below), then what `prepare` derives from them.
``s``, the state of the drive: names that begin with ``S_``; its length is ``p[STATE_SIZE]``.
``io``, inputs and outputs of one tick: ``IN_`` and ``IO_``.  ``out``, the results of a run: ``OUT_``.
"""

from itertools import count
from typing import Annotated

from actuator_lti.design import law
from actuator_lti.drive import signals

# --- parameters of one run -------------------------------------------------------------------------
(
    TICKS,  # number of ticks n; rows k = 0 .. n-1 are sampled at t_k = k Ts
    PERIOD,  # Ts [s]
    EVERY_VELOCITY,  # n_v
    EVERY_POSITION,  # n_p
    DELAY_TICKS,  # q, whole ticks of the computing delay
    DELAY_FRACTION,  # f, rest of the computing delay, 0 <= f < Ts [s]
    RESISTANCE,  # [ohm]
    INDUCTANCE,  # [H]
    BACK_EMF,  # kE [V s/rad]
    TORQUE_CONSTANT,  # kM [N m/A]
    INERTIA,  # J [kg m2]
    SOURCE,  # 1: no electrical dynamics
    ELASTIC_DRIVE,  # 1: coupling or friction map: the plant of the elastic block
    SOURCE_GAIN,  # [N m/V]
    RATIO,  # N
    LAW,  # 0 coulomb, 1 tanh
    VISCOUS,  # Cv for w > 0 [N m s/rad]
    VISCOUS_REVERSE,  # Cv for w < 0 [N m s/rad]
    DRY,  # C0 for w > 0 [N m]
    DRY_REVERSE,  # C0 for w < 0 [N m]
    LOAD_COEFFICIENT,  # CM
    BREAKAWAY,  # breakaway ratio
    SMOOTHING,  # w_s of the tanh law [rad/s]
    OFFSET,  # constant torque against positive motion [N m]
    BACK_DRIVABLE,  # 1: T_bd = M/N
    TANH_TOLERANCE,
    TANH_LEVEL,  # >= 0: 2**level sub-steps always (order tests)
    HAS_VELOCITY,
    HAS_CURRENT,
    POSITION_GAIN,  # Kv
    FEEDFORWARD,  # k_ff
    VELOCITY_GAIN,
    VELOCITY_INTEGRAL,  # Kp T/Tn
    CURRENT_GAIN,  # [V/A]
    CURRENT_INTEGRAL,  # [V/A]
    SPEED_LIMIT,  # [rad/s]
    ACCELERATION_LIMIT,  # [rad/s2]
    CURRENT_LIMIT,  # [A]
    VOLTAGE_LIMIT,  # [V]
    SPEED_SOURCE,  # 0 ideal, 1 difference, 2 tracking loop
    DIFFERENCE_SAMPLES,  # m
    COUNTS_PER_RAD,  # of the angle that the speed is made of; 0: not quantised [1/rad]
    FILTER_COEFFICIENT,  # T/(TF + T); 1: no filter
    CURRENT_START,  # [A]
    SPEED_START,  # [rad/s]
    ANGLE_START,  # [rad]
    CURRENT_INTEGRATOR_START,  # [V]
    VELOCITY_INTEGRATOR_START,
    SPEED_COMMAND_START,  # [rad/s]
    CURRENT_COMMAND_START,  # [A]
    VOLTAGE_START,  # [V]
    LOAD,  # constant part of M_ext [N m]
    LOAD_SLOPE,  # N m per rad of output angle [N m/rad]
    LOAD_DAMPING,  # N m against the motion per rad/s of the output
    MOMENT_PEAK,  # of moments that bend with the output angle: peak sin(order y + phase) [N m]
    MOMENT_PEAK_2,  # [N m]
    LOAD_TABLE,  # offset into the tables
    LOAD_TABLE_LENGTH,
    TORQUE_TABLE,  # extra torque at the motor shaft
    TORQUE_TABLE_LENGTH,
    TORQUE_SLOPE,  # of the motor's own torque over its angle [N m/rad]
    TORQUE_PEAK,  # of one that bends with it: peak sin(order th + phase) [N m]
    SUPPLY_TABLE,  # bus voltage
    SUPPLY_TABLE_LENGTH,
    MAX_EVENTS,  # per tick
    RECORD_EVERY,
    WITH_ENERGY,
    WITH_EXTREMES,
    WINDOW,  # ticks of one reducer window, 0: none
    CYCLES,  # whole cycles in the window
    HARMONICS,
    STEP_TARGET,  # of what the command orders, in its unit; 0: no step figures
    STEP_BAND,
    HAS_POSITION,
    POSITION_INTEGRAL,  # Kv Tp/Ti
    DERIVATIVE,  # Kv Td
    DERIVATIVE_COEFFICIENT,  # Tp/(TD + Tp)
    OUTPUT_SENSOR,  # 1: position from the output's sensor
    SPEED_SENSOR,  # 1: speed from the output's sensor
    POSITION_COUNTS,  # counts per rad of the angle that the position loop reads; 0: not quantised [1/rad]
    ACCELERATION_FEEDFORWARD,  # k_aff J/(kM Tp^2), of the reference at the motor
    FRICTION_FEEDFORWARD,  # i_fr
    PROFILED,  # 1: a profile limits the command
    PROFILE_RANGE,  # of the command itself; inf: none
    PROFILE_RATE,  # of its first and second derivative
    PROFILE_ACCELERATION,
    PROFILE_SAMPLES,  # samples of the moving average that limits the jerk; 0, 1: none
    COMMAND_FILTERS,  # number of sections, 0 or 1
    SPEED_FILTERS,
    TORQUE_FILTERS,
    TRACKING_ANGLE,  # 2 w0 T of the tracking loop
    TRACKING_SPEED,  # w0^2 T
    VELOCITY_WINDUP,  # 0 conditional, 1 clamped, 2 back-calculation
    VELOCITY_TRACKING,  # T/Tt
    CURRENT_WINDUP,
    CURRENT_TRACKING,
    BACK_EMF_FEEDFORWARD,  # share times kE [V s/rad]
    RESISTANCE_FEEDFORWARD,  # share times R [ohm]
    SUPPLY,  # 1: the supply is modelled; its voltage is a table: 2 that limits u, 3 that u is a share of
    SUPPLY_VOLTAGE,  # of the source; of the table, the voltage at which gains are in volts [V]
    SUPPLY_RESISTANCE,  # [ohm]
    REGENERATIVE,
    CAPACITANCE,  # [F]
    BRAKE_VOLTAGE,  # [V]
    OVERLOAD,  # 1: the overload protection acts
    OVERLOAD_RATE,  # Ts/tau
    OVERLOAD_RELEASE,
    CONTINUOUS_CURRENT,  # [A]
    CURRENT_RESOLUTION,  # 0: none [A]
    CURRENT_NOISE,  # rms [A]
    ANGLE_NOISE,  # [rad]
    OUTPUT_NOISE,  # [rad]
    JITTER,  # s, rms [s]
    SEED,
    RIGID,  # of an elastic drive train; 1: a friction map, but no coupling
    RATIO_TO_COUPLING,  # N_c; N without a coupling
    MOTOR_INERTIA,  # J_m; J without a coupling
    LOAD_INERTIA,  # J_l at the coupling's shaft
    STIFFNESS,  # k
    COUPLING_DAMPING,  # c
    HALF_PLAY,  # b
    BEND_TORQUE,  # T1 at which the spring bends, and its stiffness K2 beyond; 0: it does not
    BEND_STIFFNESS,
    BEND_TORQUE_2,  # T2 and K3
    BEND_STIFFNESS_2,
    LOAD_DRY,  # C0_l
    LOAD_VISCOUS,  # Cv_l
    LOAD_BREAKAWAY,
    LOAD_OFFSET,
    TWIST_START,  # delta
    LOAD_SPEED_START,  # W
    MAP_COUNT,  # points of the friction map for w > 0; 0: no map
    MAP_COUNT_REVERSE,
    OWN_STAGE,  # that has a law of one's own: 1 current, 2 velocity, 3 position; 0: none
    OWN_STATES,  # its order n
    OWN_GAIN,  # factor on C x + D e
    OWN_READS_SPEED,  # 1: it takes the measured speed
    OWN_COUNTS,  # counts per rad of the motor's angle that it takes; 0: not quantised [1/rad]
    OWN_OUTPUT_COUNTS,  # of the output's angle [1/rad]
    MOMENT_ORDER,
    MOMENT_PHASE,  # [rad]
    MOMENT_ORDER_2,
    MOMENT_PHASE_2,  # [rad]
    TORQUE_ORDER,
    TORQUE_PHASE,  # [rad]
    COMMAND,  # first of SIGNAL_SIZE numbers
) = range(146)
COLUMN_NAMES = frozenset(name for name in dir() if name.isupper())

TABLES = (LOAD_TABLE, TORQUE_TABLE, SUPPLY_TABLE)  # offsets of series; their lengths stand behind them

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

# --- sections of second order: b0, b1, b2, a1, a2 (direct form II transposed, a0 = 1) -----------------
SECTION = 5
MAX_SECTIONS = 8  # in one chain
COMMAND_CHAIN = PROBES + 4 * PROBE_SIZE
SPEED_CHAIN = COMMAND_CHAIN + SECTION
TORQUE_CHAIN = SPEED_CHAIN + MAX_SECTIONS * SECTION

# --- friction map, used where ELASTIC_DRIVE is 1 ----------------------------------------------------
MAX_POINTS = 16  # per side
MAP = TORQUE_CHAIN + MAX_SECTIONS * SECTION  # points (|w|, T) for w > 0, then for w < 0

# --- torques that bend with an angle: as many as have a place above -----------------------------------
MOMENT_WAVES, TORQUE_WAVES = LOAD_TABLE - MOMENT_PEAK, SUPPLY_TABLE - TORQUE_PEAK

# --- limiters: place of the limit, bit in the flags; those without a name above have their places here -----
LIMITERS = tuple(signals.LIMITERS)
LIMITS = MAP + 4 * MAX_POINTS
LIMIT = {
    "speed": SPEED_LIMIT,
    "acceleration": ACCELERATION_LIMIT,
    "current": CURRENT_LIMIT,
    "voltage": VOLTAGE_LIMIT,
    "torque-command": CURRENT_LIMIT,
    "overload": CONTINUOUS_CURRENT,
    "profile": PROFILE_RATE,
}
_NAMED = len(LIMIT)
LIMIT |= {name: LIMITS + k for k, name in enumerate(name for name in LIMITERS if name not in LIMIT)}
FLAG = {name: 1 << limiter.bit for name, limiter in signals.LIMITERS.items()}
FLAG_SPEED, FLAG_ACCELERATION, FLAG_CURRENT = FLAG["speed"], FLAG["acceleration"], FLAG["current"]
FLAG_VOLTAGE, FLAG_TORQUE_COMMAND = FLAG["voltage"], FLAG["torque-command"]
FLAG_OVERLOAD, FLAG_PROFILE, FLAG_STICK = FLAG["overload"], FLAG["profile"], 1 << signals.REST_BIT
LIMITER_BITS = tuple(FLAG.values())
LIMITER_COUNT = len(LIMITERS)

# --- a law of one's own: rows of A and B one after the other, C, D, L, the states that it starts in ---------
MOST_STATES, OWN_INPUTS = law.MOST_STATES, len(law.LAW_INPUTS)
OWN_CURRENT, OWN_VELOCITY, OWN_POSITION = 1.0, 2.0, 3.0
OWN_A = LIMITS + LIMITER_COUNT - _NAMED
OWN_B = OWN_A + MOST_STATES * MOST_STATES
OWN_C = OWN_B + MOST_STATES * OWN_INPUTS
OWN_D = OWN_C + MOST_STATES
OWN_L = OWN_D + OWN_INPUTS
OWN_START = OWN_L + MOST_STATES

SIZE = OWN_START + MOST_STATES  # what describes a run; what follows is derived from it

# --- derived: one transition x+ = A x + b u + c T with x = (i, w, th), and one direction of slip ----------
A11, A12, A21, A22, A31, A32, B1, B2, B3, C1, C2, C3 = range(12)
TRANSITION = 12
SLIP_ORDER, TANH_ORDER = 5, 7  # of the matrices: with held inputs, and with a torque quadratic in time
FORWARD, REVERSE = 0, 1
KIND, CLOSE, MEAN, ROOT, M11, M12, M21, M22 = range(8)
MODAL = 8

SLIP = SIZE  # four transitions: direction (forward, reverse), segment
MODES = SLIP + 4 * TRANSITION  # two directions
DECAY = MODES + 2 * MODAL  # of the locked current, two segments
LENGTH = DECAY + 2  # of the two segments, s
(
    OUTPUT_START,  # angle of the output at the start [rad]
    RELAX,  # R/L
    LOCKED_GAIN,  # 1/R; 0 for a torque source
    SMOOTH,  # 1: no dry friction and one viscous slope, so nothing happens at w = 0
    LOOK,  # 1: no short way over a segment: tanh law, elastic, or w' may turn twice within
    SPLIT,  # 1: the computing delay has a fraction of a tick
    LOAD_VARIES,  # 1: the load changes from tick to tick
    HAS_INSTRUMENTS,  # 1: instruments or the supply are modelled
    HAS_FULL_COMMAND,  # 1: the outermost stage is more than the P loop of position
    HAS_MEASURED_SPEED,  # 1: the measured speed is not w itself
    HAS_FULL_VELOCITY,  # 1: the velocity controller is more than a PI with conditional integration
    HAS_FULL_CURRENT,
    OWN_MEASURES,  # 1: the speed is measured for the law of one's own, before all stages
    PROBING,  # 1: there is a probe
    NOTING,  # 1: more than the usual outputs are to be noted
    OUTER_EVERY,  # ticks between updates of the outermost stage
    SPEED_STEP,  # change of the speed command allowed in one update
    POSITION_PERIOD,
    VELOCITY_PERIOD,
    DELAY_LINE,  # q + 2 values
    AT_ANGLES,  # place in the state of the last m angles
    AT_AVERAGE,  # of the profile's moving average
    AT_OWN,  # of the states of a law of one's own
    AT_PROBES,  # of the probes' rings
    PROBE_RING,  # length of one ring
    AT_WORK,  # of the work space
    STATE_SIZE,
    PARAMETER_SIZE,  # length of the row of parameters with all that is derived
) = range(LENGTH + 2, LENGTH + 30)

# integrals over a whole segment as forms of (i, w, u, T): of i (4), of i^2, i w and w^2 (10 each)
FORM = 34
FORMS = LENGTH + 30  # four: direction, segment
P_SIZE = FORMS + 4 * FORM

# --- behind that, either the block of an elastic drive train, as long as it needs ---------------------
ELASTIC = P_SIZE
# --- or the tanh law's coefficients: two segments, LEVELS step lengths, LEVEL numbers each -------------
TANH = P_SIZE
LEVELS = 16
# one level: transition over h/2 (12), over h (12), phi1 at h/2 (3), weights of N(u), N(a)+N(b), N(c) (9)
LEVEL = 2 * TRANSITION + 12
# behind them the largest rate times step, the share of its way that the current goes in each segment, 1/w_s,
# the fastest rate of the linear plant and the part of an acceleration that such a motion has
TANH_RATE = TANH + 2 * LEVELS * LEVEL
TANH_SHARE = TANH_RATE + 1
TANH_PER_SPEED = TANH_SHARE + 2
TANH_FASTEST = TANH_PER_SPEED + 1
TANH_SHAKEN = TANH_FASTEST + 1
TANH_SIZE = 2 * LEVELS * LEVEL + 6
# and with energies: integrals over one step as forms of (i, w, u, T, n0, nm, nc), n0, nm, nc the friction
# torque at its beginning, middle and end: i (7), i^2, i w and w^2 (28 each), n w (28)
TANH_FORM = 119
TANH_FORMS = TANH + TANH_SIZE
TANH_FORMS_SIZE = 2 * LEVELS * TANH_FORM

# --- the state of the drive -------------------------------------------------------------------------
# what each number of it is; the kind of a name holds up to the next that has one (`state_kinds`)
Continuous = Annotated[int, "continuous"]  # a quantity that the next tick goes on from
Counter = Annotated[int, "counter"]  # ticks, events, and places in a ring
Flag = Annotated[int, "flag"]  # which piece of the drive acts, and what follows from that alone
Note = Annotated[int, "note"]  # held for reading (by jitter, too), and the random streams
Work = Annotated[int, "work"]  # work space: written before it is read

_places = count()
S_TICK: Counter = next(_places)
S_STATUS: Flag = next(_places)
S_CURRENT: Continuous = next(_places)  # [A]
S_SPEED: Continuous = next(_places)  # [rad/s]
S_ANGLE: Continuous = next(_places)  # [rad]
S_DIRECTION: Flag = next(_places)  # 1, -1 slipping, 0 at rest
S_OUTPUT: Continuous = next(_places)  # output angle where the drive train is elastic [rad]
S_OUTPUT_SPEED: Continuous = next(_places)  # [rad/s]
S_HELD: Note = next(_places)  # voltage that acted last [V]
S_LOAD: Continuous = next(_places)  # hinge moment of this tick [N m]
S_DRY: Continuous = next(_places)  # dry friction of this tick, forward [N m]
S_DRY_REVERSE: Continuous = next(_places)  # [N m]
S_TORQUE: Continuous = next(_places)  # torque beside motor and dry friction [N m]
S_EXTRA: Continuous = next(_places)  # its part that is an extra torque at the motor shaft
S_UNTIL_OUTER: Counter = next(_places)  # ticks until the outermost stage is updated
S_UNTIL_VELOCITY: Counter = next(_places)
S_CURRENT_INTEGRATOR: Continuous = next(_places)  # [V]
S_VELOCITY_INTEGRATOR: Continuous = next(_places)
S_POSITION_INTEGRATOR: Continuous = next(_places)
S_SPEED_COMMAND: Continuous = next(_places)  # after both limits [rad/s]
S_SPEED_REFERENCE: Continuous = next(_places)  # w_ref: the same, behind its probe [rad/s]
S_CURRENT_BEFORE: Continuous = next(_places)  # [A]
S_CURRENT_REFERENCE: Continuous = next(_places)  # [A]
S_VOLTAGE_BEFORE: Note = next(_places)  # [V]
S_VOLTAGE: Continuous = next(_places)  # [V]
S_OUTPUT_BEFORE: Note = next(_places)
S_OUTPUT_AFTER: Note = next(_places)
S_MEASURED_SPEED: Continuous = next(_places)  # [rad/s]
S_FILTERED_SPEED: Continuous = next(_places)  # before the speed filters [rad/s]
S_TRACKED_ERROR: Continuous = next(_places)  # tracked less seen angle [rad]
S_TRACKED_SPEED: Continuous = next(_places)  # [rad/s]
S_FLAGS_OUTER: Flag = next(_places)  # limiters that acted at the last update of each stage
S_FLAGS_PROFILE: Flag = next(_places)
S_FLAGS_VELOCITY: Flag = next(_places)
S_FLAGS_CURRENT: Flag = next(_places)
S_REFERENCE: Continuous = next(_places)  # shaped command of the last update, motor side [rad]
S_REFERENCE_BEFORE: Continuous = next(_places)  # [rad]
S_ERROR: Continuous = next(_places)  # [rad]
S_ERROR_RATE: Continuous = next(_places)  # [rad/s]
S_TORQUE_FEEDFORWARD: Continuous = next(_places)  # i_ff, held
S_PROFILE: Continuous = next(_places)  # position of the profile, its speed, the command of the last update
S_PROFILE_SPEED: Continuous = next(_places)
S_PROFILE_COMMAND: Continuous = next(_places)
S_AVERAGE_PLACE: Counter = next(_places)
S_AVERAGE_SUM: Continuous = next(_places)
S_CURRENT_LIMIT: Flag = next(_places)  # of this tick [A]
S_VOLTAGE_LIMIT: Continuous = next(_places)  # [V]
S_OVERLOAD: Continuous = next(_places)
S_OVERLOAD_REST: Continuous = next(_places)  # that the sum of the overload has left over
S_OVERLOADED: Flag = next(_places)
S_EVENTS: Counter = next(_places)  # in all
S_MAX_EVENTS: Counter = next(_places)  # most in one tick
S_STEPS: Note = next(_places)  # integration steps within segments, in all: what a run costs beside its ticks
STATE_NAMES = frozenset(name for name in dir() if name.startswith("S_"))
S_NOISE: Note = next(_places)  # four random streams of two numbers: current, angle, output angle, jitter
NOISE_CURRENT, NOISE_ANGLE, NOISE_OUTPUT, NOISE_INSTANT = range(4)
S_ENERGY: Note = S_NOISE + 8
(
    ENERGY_INPUT,  # integral of u i
    ENERGY_COPPER,  # integral of R i^2
    ENERGY_DRY,  # dry friction
    ENERGY_VISCOUS,
    ENERGY_OFFSET,  # constant offset torque
    ENERGY_LOAD,  # work done on the load (back-drivable) and against the extra torque
    ENERGY_CONVERSION,  # (kE - kM) i w
    ENERGY_SUPPLY,  # drawn from the source behind the supply's resistance
    ENERGY_SUPPLY_LOSS,  # in that resistance
    ENERGY_BRAKE,  # in the brake
    ENERGY_CAPACITOR,  # taken up by the bus
    ENERGY_DAMPING,  # of the coupling
    ENERGY_PARTING,  # spring energy left when contact ends
    ENERGY_LOAD_DRY,  # friction behind the coupling
    ENERGY_LOAD_VISCOUS,
    ENERGY_LOAD_OFFSET,
) = range(16)
ENERGY_SIZE = 16
S_COMMAND_CHAIN: Continuous = S_ENERGY + ENERGY_SIZE
S_SPEED_CHAIN: Continuous = S_COMMAND_CHAIN + 2  # [rad/s]
S_TORQUE_CHAIN: Continuous = S_SPEED_CHAIN + 2 * MAX_SECTIONS
S_PROBE_PLACES: Counter = S_TORQUE_CHAIN + 2 * MAX_SECTIONS  # next place in each probe's ring
ELASTIC_STATE = S_PROBE_PLACES + 4
ELASTIC_STATE_SIZE = 211
S_QUEUE: Continuous = (
    ELASTIC_STATE + ELASTIC_STATE_SIZE
)  # delay line, oldest first; then angles, average, states of a law of one's own, rings
WORK_SIZE = 4 * 49 + 24  # four matrices of 7 by 7, and what is made of them
WORK_MORE = 4 * 49

# --- inputs of a block of ticks, worked out ahead: commands, loads, torques, injected signals ------------
BLOCK, EVERY_TICK = 256, 1
BLOCK_LOAD, BLOCK_TORQUE, BLOCK_PROBES, BLOCK_SUPPLY = BLOCK, 2 * BLOCK, 3 * BLOCK, 7 * BLOCK
BLOCK_SIZE = 8 * BLOCK
SUPPLY_LIMITS, SUPPLY_SCALES = 2.0, 3.0

# --- inputs and outputs of one tick -------------------------------------------------------------------
(
    IN_COMMAND,  # of the outermost stage; output shaft
    IN_LOAD,  # hinge moment beside the load's own [N m]
    IN_TORQUE,  # extra torque at the motor shaft [N m]
    IN_CURRENT,  # measured: what the controller sees [A]
    IN_SPEED,  # [rad/s]
    IN_ANGLE,  # [rad]
    IN_OUTPUT,  # output angle, or motor angle over N [rad]
    IN_OUTPUT_SPEED,  # [rad/s]
    IN_BUS,  # voltage that the controller has [V]
    IN_PROBE,  # four injected signals
) = range(10)
(
    IO_REFERENCE,  # from here on in the order of SIGNALS: what was at t_k
    IO_OUTPUT,  # [rad]
    IO_SPEED,  # [rad/s]
    IO_CURRENT,  # [A]
    IO_VOLTAGE,  # [V]
    IO_CURRENT_COMMAND,  # [A]
    IO_SPEED_COMMAND,  # [rad/s]
    IO_PROBES,  # before and after each probe
) = range(IN_PROBE + 4, IN_PROBE + 12)
IO_ANGLE = IO_PROBES + 8  # [rad]
IO_FLAGS = IO_ANGLE + 1
IO_OUTPUT_SPEED = IO_FLAGS + 1  # of an elastic drive: speed of the output shaft, twist, T_s
IO_TWIST = IO_OUTPUT_SPEED + 1
IO_COUPLING_TORQUE = IO_TWIST + 1
IO_MOMENT = IO_COUPLING_TORQUE + 1  # on the output shaft, where it varies
IO_SIZE = IO_MOMENT + 1
VARYING_LOAD = slice(LOAD_SLOPE, SUPPLY_TABLE)  # what makes the load of a run change from tick to tick

# --- signals that are recorded and reduced, in this order ------------------------------------------
SIGNALS = (
    "reference_rad",
    "output_angle_rad",
    "motor_speed_rad_s",
    "current_A",
    "voltage_V",
    "current_command_A",
    "speed_command_rad_s",
    *(f"probe_{point}_{side}" for point in POINTS for side in ("before", "after")),
)
BASE_SIGNALS = 7
ALL_SIGNALS = 15
# columns of the history: the base signals, then the motor angle, then before and after of each active probe,
# then output speed, twist and coupling torque of an elastic drive, then the load torque where it varies
HISTORY_ANGLE = 7
HISTORY_PROBES = 8
ELASTIC_COLUMNS = 3

# --- results of one run ----------------------------------------------------------------------------
(
    OUT_TICKS,  # ticks done
    OUT_STICK_TICKS,  # ticks that began at rest
    OUT_TWIST,  # of an elastic drive, at the end
    OUT_STATE,  # the first numbers of the state at the end, up to the energies
) = range(4)
OUT_LIMIT_TICKS = OUT_STATE + S_COMMAND_CHAIN  # of each limiter: ticks active
OUT_LIMIT_FIRST = OUT_LIMIT_TICKS + LIMITER_COUNT  # first tick, -1 if never
OUT_STEP = OUT_LIMIT_FIRST + LIMITER_COUNT
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
OUT_WINDOW_STICK = OUT_WINDOW_LIMITS + LIMITER_COUNT
OUT_PHASOR = OUT_WINDOW_STICK + 1  # of the window's fundamental: now, and its turn in a tick
OUT_STEP_BEFORE = OUT_PHASOR + 4  # normalised output of the tick before
OUT_SIZE = OUT_STEP_BEFORE + 1

# --- status ----------------------------------------------------------------------------------------
OK, TOO_MANY_EVENTS, NOT_FINITE, CANCELLED, NO_ROOT = range(5)
