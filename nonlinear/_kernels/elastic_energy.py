"""Energy ledger of the event-driven plant, one line for each place where energy goes.

Over a piece of one mode: Gauss-Legendre of ten points on the Taylor series, exact to rounding on an interval
that is short against every mode.  Only the losses of friction, of the coupling's damping and of parting are
dissipation, and none of them falls.
"""

from __future__ import annotations

import numpy as np

from actuator_lti.compiled.kernel import kernel
from nonlinear._kernels import elastic_layout as at
from nonlinear._kernels import layout
from nonlinear._kernels.elastic_modes import contact_side, map_place, spring_of
from nonlinear._kernels.elastic_series import series_state

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(10)
NODES, WEIGHTS = 0.5 * (_NODES + 1.0), 0.5 * _WEIGHTS


@kernel
def add_energies(p, s, h):
    """Add the energies over the first h of the interval whose series is filled."""
    for j in range(NODES.shape[0]):
        i, w, W, d, _turned = series_state(p, s, h * NODES[j])
        add_powers(p, s, h * WEIGHTS[j], i, w, W, d)


@kernel
def add_powers(p, s, weight, i, w, W, d):
    """Add weight times the power of every line in one state."""
    e = layout.S_ENERGY
    u = s[at.ES_INPUT + at.IN_U]
    if p[layout.SOURCE] > 0.0:
        s[e + layout.ENERGY_INPUT] += weight * p[layout.SOURCE_GAIN] * u * w
    else:
        s[e + layout.ENERGY_INPUT] += weight * u * i
        s[e + layout.ENERGY_COPPER] += weight * p[layout.RESISTANCE] * i * i
        s[e + layout.ENERGY_CONVERSION] += weight * (p[layout.BACK_EMF] - p[layout.TORQUE_CONSTANT]) * i * w
    side = contact_side(s)
    rate = w / p[layout.RATIO_TO_COUPLING] - W
    torque = 0.0
    if side != 0.0:
        k, rest = spring_of(p, s, side)
        torque = k * (d - rest) + p[layout.COUPLING_DAMPING] * rate
        s[e + layout.ENERGY_DAMPING] += weight * p[layout.COUPLING_DAMPING] * rate * rate
    parted = 0.5 * s[at.ES_CONTACT]
    if abs(parted) == 1.0:
        k, rest = spring_of(p, s, parted)
        s[e + layout.ENERGY_PARTING] -= weight * k * (d - rest) * rate
    add_motor_friction(p, s, weight, w, torque)
    s[e + layout.ENERGY_LOAD_DRY] += weight * p[layout.LOAD_DRY] * s[at.ES_LOAD] * W
    s[e + layout.ENERGY_LOAD_VISCOUS] += weight * p[layout.LOAD_VISCOUS] * W * W
    s[e + layout.ENERGY_LOAD_OFFSET] += weight * p[layout.LOAD_OFFSET] * W
    outside = p[at.EL_BACK] * s[at.ES_INPUT + at.IN_M] + s[at.ES_INPUT + at.IN_EXTRA]
    outside_load = s[at.ES_INPUT + at.IN_M] / p[at.EL_RATIO_BEHIND]
    s[e + layout.ENERGY_LOAD] -= weight * (outside * w + outside_load * W)


@kernel
def add_motor_friction(p, s, weight, w, torque):
    """Motor friction; a self-locking stage keeps what it does not hand on to the coupling."""
    e, direction, place = layout.S_ENERGY, s[layout.S_DIRECTION], map_place(p, s)
    level, slope = p[place + at.MAP_LEVEL], p[place + at.MAP_SLOPE]
    dry = (
        direction * (level + p[at.EL_LOAD_COEFFICIENT] * abs(torque))
        - s[at.ES_MOTOR_DRY] * (s[at.ES_INPUT + at.IN_ABS_M])
    )
    handed_on = torque * (1.0 / p[layout.RATIO_TO_COUPLING] - p[at.EL_REACTION])
    if p[layout.MAP_COUNT] > 0.0:
        dry += slope * w
    else:
        s[e + layout.ENERGY_VISCOUS] += weight * slope * w * w
    s[e + layout.ENERGY_DRY] += weight * (dry - handed_on) * w
    s[e + layout.ENERGY_OFFSET] += weight * p[layout.OFFSET] * w
