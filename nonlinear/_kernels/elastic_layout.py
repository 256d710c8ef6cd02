"""Where each number of the event-driven plant lives: its block of parameters and its part of the state.

What is derived for it is the last part of the row p, as its length depends on the design; symbols are those
of model.md section 6.
"""

from nonlinear._kernels import layout

MAX_TERMS = 18  # of the Taylor series over one short interval
MAX_GUARDS = 8
MAX_STEPS = 200_000  # short intervals in one held segment, beyond which the run is given up

# --- derived parameters ---------------------------------------------------------------------------
(
    EL_RATIO_BEHIND,  # N_r
    EL_REACTION,  # 1/N_c; 0 where the stage before the coupling is self-locking
    EL_BACK,  # share of M_ext that reaches the motor of a rigid drive: 1/N or 0
    EL_LOAD_COEFFICIENT,  # CM' = CM N_r; CM without a coupling
    EL_SMOOTH,  # 1: nothing happens at w = 0
    EL_LOAD_SMOOTH,  # 1: nothing happens at W = 0
    EL_LEVELS,  # K: Ts/2^K is short against every mode of the plant
    EL_TERMS,  # of the Taylor series over Ts/2^K
    EL_MODE_SIZE,
    EL_SEGMENTS,  # number of segments of the motor's friction for w > 0
    EL_SEGMENTS_REVERSE,
    EL_SPRINGS,  # number of pieces of the spring: 1 to 3
) = range(layout.ELASTIC, layout.ELASTIC + 12)
SPRING_STIFFNESS, SPRING_HALF, SPRING_TWIST, SPRING_SIZE = range(4)  # T = k (delta - half) beyond a twist
EL_SPRING = EL_SPRINGS + 1  # pieces of the spring
EL_MAP = EL_SPRING + 3 * SPRING_SIZE  # segments of w > 0, then of w < 0
MAP_SPEED, MAP_LEVEL, MAP_SLOPE, MAP_SEGMENT = 0, 1, 2, 3  # begins at; T = level + slope |w|
MAP_SIDE = layout.MAX_POINTS * MAP_SEGMENT
EL_MODES = EL_MAP + 2 * MAP_SIDE  # first mode

# --- one mode: x' = A x + B v, x = (i, w, W, delta), v = (u, motor torque, load torque) --------------
(
    A_II,
    A_IW,
    A_WI,
    A_WW,
    A_WV,  # motor acceleration from the load's speed
    A_WD,
    A_VW,
    A_VV,
    A_VD,
    A_DW,
    A_DV,
    B_I,
    B_W,
    B_V,
) = range(14)
MODE_WEIGHT = 14  # of i, w, W, delta in the norm of the energy
MODE_GROWTH = 18  # growth of that norm over Ts/2^K
MODE_REACH = 19  # h times the growth over h: for both segments, then for Ts, Ts/2, ... Ts/2^K
# one transition: rows i, w, W, delta, angle increment over columns i, w, W, delta, u, torque, torque
STEP_COLUMNS = 7
STEP_SIZE = 35
EL_LEAST = EL_MODES + MODE_REACH  # length of the row that is needed to work out its length

# --- state; current, speed, angle and direction of slip of the motor are those of every drive -----------
ES_LOAD_SPEED: layout.Continuous = layout.ELASTIC_STATE  # W
ES_TWIST: layout.Continuous = layout.ELASTIC_STATE + 1  # delta = th/N_c - phi
ES_LOAD_ANGLE: layout.Continuous = layout.ELASTIC_STATE + 2  # phi
ES_SEGMENT: layout.Flag = layout.ELASTIC_STATE + 3  # of the friction map
ES_LOAD: layout.Flag = layout.ELASTIC_STATE + 4  # direction of slip of the load: 1, -1, 0
ES_CONTACT: layout.Flag = layout.ELASTIC_STATE + 5  # GAP, 1 or -1 in contact, 2 or -2 parted, |delta| > b
ES_BEND: layout.Flag = layout.ELASTIC_STATE + 6  # piece of the spring, with the sign of the twist: 0, 1, 2
ES_HAPPENED: layout.Flag = layout.ELASTIC_STATE + 7  # events of the last held segment
# what follows from the mode, kept until it changes
ES_MODE: layout.Flag = layout.ELASTIC_STATE + 8  # place of the mode in p
ES_MOTOR_TORQUE: layout.Flag = layout.ELASTIC_STATE + 9  # constant torque on the motor
ES_MOTOR_DRY: layout.Flag = layout.ELASTIC_STATE + 10  # torque on the motor per |M_ext|
ES_LOAD_TORQUE: layout.Flag = layout.ELASTIC_STATE + 11  # constant torque on the load
ES_GUARDS: layout.Flag = layout.ELASTIC_STATE + 12  # number of guards
ES_GUARD: layout.Flag = layout.ELASTIC_STATE + 13
# one guard: an affine function of state and inputs that stays positive in this mode
(G_I, G_W, G_V, G_D, G_ONE, G_U, G_M, G_ABS_M, G_EXTRA, G_CURVE, G_ROOM, G_EVENT, GUARD_SIZE) = range(13)
# how far the state may yet go, in the norm of the energy, before a guard has to be looked at
ES_ROOM: layout.Work = ES_GUARD + MAX_GUARDS * GUARD_SIZE
# work space: the held inputs, then the Taylor coefficients of (i, w, W, delta) and of one guard
ES_INPUT: layout.Note = ES_ROOM + 1
# u, motor torque, load torque, M_ext, |M_ext|, extra torque
IN_U, IN_MOTOR, IN_LOAD, IN_M, IN_ABS_M, IN_EXTRA, IN_SIZE = range(7)
ES_SERIES: layout.Work = ES_INPUT + IN_SIZE
ES_POLYNOMIAL: layout.Work = ES_SERIES + 4 * (MAX_TERMS + 1)
ES_END = ES_POLYNOMIAL + MAX_TERMS + 1

GAP = 0.0

# --- events, in their order at one instant ---------------------------------------------------------
(
    NO_EVENT,
    MEET_PLUS,
    MEET_MINUS,
    FLIP,  # T_s changes sign where friction depends on it
    PART,
    REJOIN,
    INSIDE,
    BEND_PLUS,
    BEND_MINUS,
    MOTOR_UP,
    MOTOR_DOWN,
    MOTOR_LOWER,
    MOTOR_UPPER,
    LOAD_UP,
    LOAD_DOWN,
    LOAD_LANDS,
) = range(16)
