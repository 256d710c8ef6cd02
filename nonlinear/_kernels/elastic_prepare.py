"""Everything of the event-driven plant that does not change with time: its modes and their transitions.

A mode is (motor at rest or slipping on a segment of its friction map) x (gap, contact on either side) x
(load at rest or slipping).  Each holds its matrix, a norm that its energy cannot outgrow, and exact
transitions over both held segments and over Ts/2^j: Taylor series of the matrix exponential at the shortest,
then squaring, for all modes at once.  Not part of the tick.
"""

from __future__ import annotations

from math import ceil, log2

import numpy as np
import numpy.typing as npt

from nonlinear._kernels import elastic_layout as at
from nonlinear._kernels import layout

Floats = npt.NDArray[np.float64]

SHORT = 0.5  # norm of A times the shortest interval
MOST_LEVELS = 30
COEFFICIENTS = 14
# where each coefficient stands in the matrix over (i, w, W, delta, angle, u, motor torque, load torque)
ROWS = (0, 0, 1, 1, 1, 1, 2, 2, 2, 3, 3, 0, 1, 2)
COLUMNS = (0, 1, 0, 1, 2, 3, 1, 2, 3, 1, 2, 5, 6, 7)
ORDER = 8
STEP_COLUMNS = [0, 1, 2, 3, 5, 6, 7]
SIDES = (0.0, 1.0, -1.0)  # gap, contact on either side


def prepare_elastic(p: Floats) -> Floats:
    """The row of parameters, made as long as needed and with all that is derived for the drive train.

    ``p`` reaches at least to ``layout.ELASTIC``; its own derived part is filled already.
    """
    row = np.zeros(at.EL_MODES)
    row[: layout.ELASTIC] = p[: layout.ELASTIC]
    _put_shares(row)
    modes = _modes(row)
    A = _matrices(modes)
    weights = _weights(row, modes)
    norm, growth = _norm_and_growth(A, weights)
    Ts = float(row[layout.PERIOD])
    levels = min(max(ceil(log2(max(norm * Ts, 1e-300) / SHORT)), 0), MOST_LEVELS)
    row[at.EL_LEVELS], row[at.EL_TERMS] = levels, _terms(norm * Ts / 2**levels)
    lengths = [*row[layout.LENGTH : layout.LENGTH + 2], *(Ts / 2**j for j in range(levels + 1))]
    halvings = [levels, levels, *(levels - j for j in range(levels + 1))]
    growths = np.exp(np.minimum(np.outer(growth, lengths), 700.0))
    block = [
        modes,
        weights,
        np.exp(np.minimum(growth * Ts / 2**levels, 700.0))[:, None],
        np.square(lengths) / 8.0 * growths,
        *(_step(A, h, n) for h, n in zip(lengths, halvings, strict=True)),
    ]
    table = np.concatenate(block, axis=1)
    row[at.EL_MODE_SIZE] = table.shape[1]
    return np.concatenate([row, table.ravel()])


def _put_shares(p: Floats) -> None:
    """How torques pass the gears, and whether anything happens at zero speed of either side."""
    behind = p[layout.RATIO] / p[layout.RATIO_TO_COUPLING]
    rigid, back = p[layout.RIGID] > 0.0, p[layout.BACK_DRIVABLE]
    p[at.EL_RATIO_BEHIND] = behind
    p[at.EL_REACTION] = back / p[layout.RATIO_TO_COUPLING]
    p[at.EL_BACK] = back / p[layout.RATIO] if rigid else 0.0
    p[at.EL_LOAD_COEFFICIENT] = p[layout.LOAD_COEFFICIENT] * (1.0 if rigid else behind)
    lines = []
    for side in range(2):
        segments = friction_segments(p, side)
        p[at.EL_SEGMENTS + side] = len(segments)
        place = at.EL_MAP + side * at.MAP_SIDE
        p[place : place + segments.size] = segments.ravel()
        lines.append(segments)
    forward, reverse = lines
    one = len(forward) == len(reverse) == 1 and forward[0, at.MAP_SLOPE] == reverse[0, at.MAP_SLOPE]
    dry = abs(forward[0, at.MAP_LEVEL]) + abs(reverse[0, at.MAP_LEVEL]) + p[at.EL_LOAD_COEFFICIENT]
    p[at.EL_SMOOTH] = float(one and dry == 0.0)
    p[at.EL_LOAD_SMOOTH] = float(p[layout.LOAD_DRY] == 0.0)


def friction_segments(p: Floats, side: int) -> Floats:
    """The motor's friction for w > 0 (side 0) or w < 0 as lines T = level + slope |w|: begins, level, slope.

    Without a map one line, C0 and Cv; the last slope of a map continues.
    """
    count, place = int(p[layout.MAP_COUNT + side]), layout.MAP + side * 2 * layout.MAX_POINTS
    if count == 0:
        return np.array([[0.0, p[layout.DRY + side], p[layout.VISCOUS + side]]])
    speed, torque = p[place : place + 2 * count].reshape(count, 2).T
    if count == 1:
        return np.array([[0.0, torque[0], 0.0]])
    slope = np.diff(torque) / np.diff(speed)
    return np.column_stack([speed[:-1], torque[:-1] - slope * speed[:-1], slope])


def _modes(p: Floats) -> Floats:
    """Coefficients of every mode, in the order of `elastic_modes.mode_number`."""
    motors = [(0.0, 0.0)]
    for side, sign in enumerate((1.0, -1.0)):
        for j in range(int(p[at.EL_SEGMENTS + side])):
            place = at.EL_MAP + side * at.MAP_SIDE + j * at.MAP_SEGMENT
            motors.append((sign, float(p[place + at.MAP_SLOPE])))
    return np.array(
        [_mode(p, s, slope, contact, slips) for s, slope in motors for contact in SIDES for slips in (0, 1)]
    )


def _mode(p: Floats, s: float, slope: float, contact: float, load_slips: int) -> Floats:
    """One mode: s the motor's direction (0 at rest), contact 0, 1 or -1."""
    a = np.zeros(COEFFICIENTS)
    k, c = (p[layout.STIFFNESS], p[layout.COUPLING_DAMPING]) if contact else (0.0, 0.0)
    N_c, J_m, J_l = p[layout.RATIO_TO_COUPLING], p[layout.MOTOR_INERTIA], p[layout.LOAD_INERTIA]
    # T_s acts on the motor with 1/N_c and, through friction, with CM' sgn(w T_s)
    share = p[at.EL_REACTION] + s * contact * p[at.EL_LOAD_COEFFICIENT]
    if not p[layout.SOURCE]:
        L = p[layout.INDUCTANCE]
        a[at.A_II], a[at.B_I] = -p[layout.RESISTANCE] / L, 1.0 / L
        if s:
            a[at.A_IW], a[at.A_WI] = -p[layout.BACK_EMF] / L, p[layout.TORQUE_CONSTANT] / J_m
    if s:
        a[at.B_W], a[at.A_WW] = 1.0 / J_m, -(slope + share * c / N_c) / J_m
        a[at.A_WD] = -share * k / J_m
    if p[layout.RIGID]:
        return a
    if s:
        a[at.A_DW] = 1.0 / N_c
    if load_slips:
        a[at.B_V], a[at.A_VV], a[at.A_VD] = 1.0 / J_l, -(p[layout.LOAD_VISCOUS] + c) / J_l, k / J_l
        a[at.A_DV] = -1.0
    if s and load_slips:
        a[at.A_WV], a[at.A_VW] = share * c / J_m, c / (N_c * J_l)
    return a


def _matrices(modes: Floats) -> Floats:
    A = np.zeros((len(modes), ORDER, ORDER))
    A[:, ROWS, COLUMNS] = modes
    A[:, 4, 1] = 1.0
    return A


def _weights(p: Floats, modes: Floats) -> Floats:
    """Square roots of L, J_m, J_l, k: in these units a passive plant does not grow.

    A state that acts on no other (the twist in the gap, the absent current) weighs nothing.
    """
    current = 0.0 if p[layout.SOURCE] else p[layout.INDUCTANCE]
    row = np.sqrt([current, p[layout.MOTOR_INERTIA], p[layout.LOAD_INERTIA], p[layout.STIFFNESS]])
    weights = np.tile(row, (len(modes), 1))
    weights[(modes[:, at.A_WD] == 0.0) & (modes[:, at.A_VD] == 0.0), 3] = 0.0
    return weights


def _norm_and_growth(A: Floats, weights: Floats) -> tuple[float, Floats]:
    """Largest norm of A in the weighted states, and of each mode the logarithmic norm where positive."""
    inverse = np.divide(1.0, weights, out=np.zeros_like(weights), where=weights > 0.0)
    scaled = weights[:, :, None] * A[:, :4, :4] * inverse[:, None, :]
    growth = np.linalg.eigvalsh(0.5 * (scaled + scaled.transpose(0, 2, 1)))[:, -1]
    return float(np.sqrt((scaled * scaled).sum(axis=(1, 2))).max()), np.maximum(growth, 0.0)


def _terms(product: float) -> int:
    """Terms of the Taylor series over an interval on which the norm of A h is ``product``."""
    terms, rest = 1, product
    while rest > 1e-18 and terms < at.MAX_TERMS:
        terms += 1
        rest *= product / terms
    return max(terms, 4)


def _step(A: Floats, h: float, halvings: int) -> Floats:
    """Transitions of all modes over h, five rows of seven numbers each, the old angle left out."""
    short = A * (h / 2**halvings)
    result = np.tile(np.eye(ORDER), (len(A), 1, 1))
    term = result
    for j in range(1, at.MAX_TERMS + 2):
        term = term @ short / j
        result = result + term
    for _ in range(halvings):
        result = result @ result
    return result[:, :5, STEP_COLUMNS].reshape(len(A), -1)
