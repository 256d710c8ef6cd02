"""Exact transitions of one mode of the event-driven plant, and how fast its energy can grow.

A transition over h is held as five rows (i, w, W, delta, increment of the angle) over seven columns (i, w, W,
delta, voltage, motor torque, load torque).  What is squared is its difference D from the identity,

    D(2h) = 2 D(h) + D(h) D(h),

so that a slow state beside stiff ones keeps its digits over thirty squarings.
"""

import math

from nonlinear._kernels import elastic_layout as at

KERNELS = True

TERMS = 20  # of the Taylor series at norm 1/2: 0.5**20/20! = 4e-25
SWEEPS = 12  # of Jacobi's method; it converges quadratically, in five or six
NOTHING = 1e-30  # beside the diagonal, of the diagonal: a rotation would not change a bit of it
COEFFICIENTS = 11  # of the matrix; those of the inputs follow
# where each coefficient stands in the matrix over (i, w, W, delta)
ROWS = (0, 0, 1, 1, 1, 1, 2, 2, 2, 3, 3)
COLUMNS = (0, 1, 0, 1, 2, 3, 1, 2, 3, 1, 2)


def multiply(s, a, b, out):
    """The five rows at ``a`` times the four rows of the states at ``b``, without the inputs of ``a``."""
    for r in range(5):
        for c in range(at.STEP_COLUMNS):
            total = 0.0
            for j in range(4):
                total += s[a + r * at.STEP_COLUMNS + j] * s[b + j * at.STEP_COLUMNS + c]
            s[out + r * at.STEP_COLUMNS + c] = total


def put_short_step(p, m, h, s, d):
    """D over an h that is short against the mode, by its Taylor series; three places behind are used."""
    term, first, product = d + at.STEP_SIZE, d + 2 * at.STEP_SIZE, d + 3 * at.STEP_SIZE
    for j in range(at.STEP_SIZE):
        s[first + j] = 0.0
    for j in range(COEFFICIENTS):  # h times the matrix
        s[first + ROWS[j] * at.STEP_COLUMNS + COLUMNS[j]] = h * p[m + j]
    s[first + 4], s[first + at.STEP_COLUMNS + 5] = h * p[m + at.B_I], h * p[m + at.B_W]
    s[first + 2 * at.STEP_COLUMNS + 6], s[first + 4 * at.STEP_COLUMNS + 1] = h * p[m + at.B_V], h
    for j in range(at.STEP_SIZE):
        s[d + j] = s[first + j]
        s[term + j] = s[first + j]
    for k in range(2, TERMS):
        multiply(s, term, first, product)
        for j in range(at.STEP_SIZE):
            s[term + j] = s[product + j] / k
            s[d + j] += s[term + j]


def double_step(s, d):
    """D over twice the time."""
    product = d + 3 * at.STEP_SIZE
    multiply(s, d, d, product)
    for j in range(at.STEP_SIZE):
        s[d + j] = 2.0 * s[d + j] + s[product + j]


def keep_step(p, o, s, d):
    """Write the transition I + D at ``p[o]``."""
    for j in range(at.STEP_SIZE):
        p[o + j] = s[d + j]
    for r in range(4):
        p[o + r * (at.STEP_COLUMNS + 1)] += 1.0


def scaled_coefficient(p, m, j):
    """Coefficient ``j`` of the matrix in the units of the energy; 0 where one side weighs nothing."""
    weight = p[m + at.MODE_WEIGHT + COLUMNS[j]]
    return p[m + at.MODE_WEIGHT + ROWS[j]] * p[m + j] / weight if weight > 0.0 else 0.0


def norm_of(p, m):
    """Frobenius norm of the mode's matrix in the units of the energy."""
    total = 0.0
    for j in range(COEFFICIENTS):
        value = scaled_coefficient(p, m, j)
        total += value * value
    return math.sqrt(total)


def growth_of(p, m, s, a):
    """Logarithmic norm of the mode: the largest eigenvalue of the symmetric part, 0 where negative."""
    for j in range(16):
        s[a + j] = 0.0
    for j in range(COEFFICIENTS):
        half = 0.5 * scaled_coefficient(p, m, j)
        s[a + 4 * ROWS[j] + COLUMNS[j]] += half
        s[a + 4 * COLUMNS[j] + ROWS[j]] += half
    for _ in range(SWEEPS):
        for r in range(3):
            for c in range(r + 1, 4):
                rotate(s, a, r, c)
    largest = 0.0
    for r in range(4):
        # Gershgorin's disc: what is left beside the diagonal counts against us
        total = s[a + 5 * r]
        for c in range(4):
            if c != r:
                total += abs(s[a + 4 * r + c])
        largest = max(largest, total)
    return largest


def rotate(s, a, r, c):
    """One rotation of Jacobi's method: makes the elements (r, c) and (c, r) of the matrix at ``a`` zero."""
    beside = s[a + 4 * r + c]
    if abs(beside) <= NOTHING * (abs(s[a + 5 * r]) + abs(s[a + 5 * c])):
        return
    theta = (s[a + 5 * c] - s[a + 5 * r]) / (2.0 * beside)
    t = 1.0 / (abs(theta) + math.sqrt(theta * theta + 1.0))
    if theta < 0.0:
        t = -t
    cosine = 1.0 / math.sqrt(t * t + 1.0)
    sine = t * cosine
    for j in range(4):
        x, y = s[a + 4 * r + j], s[a + 4 * c + j]
        s[a + 4 * r + j], s[a + 4 * c + j] = cosine * x - sine * y, sine * x + cosine * y
    for j in range(4):
        x, y = s[a + 4 * j + r], s[a + 4 * j + c]
        s[a + 4 * j + r], s[a + 4 * j + c] = cosine * x - sine * y, sine * x + cosine * y
    s[a + 4 * r + c] = 0.0
    s[a + 4 * c + r] = 0.0
