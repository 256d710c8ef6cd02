"""How large each signal and each number of the state of a run has been: what its changes are measured by."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from nonlinear._kernels import elastic_layout as ES
from nonlinear._kernels import layout as at
from nonlinear.runs.running import Piece, Running

Floats = npt.NDArray[np.float64]
_SPEED, _CURRENT, _VOLTAGE, _CURRENT_COMMAND, _SPEED_COMMAND = 2, 3, 4, 5, 6
_AS_LARGE = (  # states that are as large as a signal, or rounded as coarsely
    ([at.S_SPEED, at.S_MEASURED_SPEED, at.S_FILTERED_SPEED, at.S_TRACKED_SPEED], _SPEED),
    ([*range(at.S_SPEED_CHAIN, at.S_TORQUE_CHAIN)], _SPEED),
    ([at.S_CURRENT], _CURRENT),
    ([at.S_HELD, at.S_VOLTAGE, at.S_VOLTAGE_BEFORE, at.S_CURRENT_INTEGRATOR], _VOLTAGE),
    ([at.S_CURRENT_REFERENCE, at.S_CURRENT_BEFORE, at.S_VELOCITY_INTEGRATOR], _CURRENT_COMMAND),
    ([*range(at.S_TORQUE_CHAIN, at.S_PROBE_PLACES)], _CURRENT_COMMAND),
    ([at.S_SPEED_COMMAND, at.S_SPEED_REFERENCE, at.S_POSITION_INTEGRATOR], _SPEED_COMMAND),
)


class Scales:
    """Largest values so far.

    Attributes
    ----------
    signals : ndarray
        Of each column of a piece.
    states : ndarray
        Of each number of the state.
    """

    def __init__(self, drive: Running, window_s: float) -> None:
        self.signals, self.states = np.zeros(at.HISTORY_PROBES), np.abs(drive.s)
        self._p, self._window_s = drive.p, window_s

    def take(self, drive: Running, piece: Piece) -> None:
        """Take a piece in, and the state after it."""
        signals, states = self.signals, self.states
        np.maximum(states, np.abs(drive.s), out=states)
        np.maximum(signals, np.abs(piece.columns[: at.HISTORY_PROBES]).max(axis=1), out=signals)
        if self._p[at.HAS_POSITION] > 0.0:
            self._by_angle()
        for places, column in _AS_LARGE:
            states[places] = np.maximum(states[places], signals[column])
        queue = slice(at.S_QUEUE, at.S_QUEUE + int(self._p[at.DELAY_LINE]))
        states[queue] = np.maximum(states[queue], signals[_VOLTAGE])

    def _by_angle(self) -> None:
        """All angles are as large as the largest; a speed counts by how far it goes in the window."""
        p, signals, states = self._p, self.signals, self.states
        N, N_c = p[at.RATIO], p[at.RATIO_TO_COUPLING]
        y = max(signals[0], signals[1], signals[at.HISTORY_ANGLE] / N)
        signals[[1, at.HISTORY_ANGLE]] = y, y * N
        both = [_SPEED, _SPEED_COMMAND]
        signals[both] = np.maximum(signals[both], y * N / self._window_s)
        w = signals[_SPEED]
        states[[at.S_OUTPUT, at.S_ANGLE, at.S_ERROR, at.S_OUTPUT_SPEED]] = y, y * N, y * N, w / N
        states[at.S_ERROR_RATE] = w * self._window_s / p[at.POSITION_PERIOD]
        states[at.S_TORQUE_FEEDFORWARD] = p[at.ACCELERATION_FEEDFORWARD] * y * N
        if p[at.ELASTIC_DRIVE] > 0.0:
            states[[ES.ES_TWIST, ES.ES_LOAD_ANGLE, ES.ES_LOAD_SPEED]] = y * N / N_c, y * N / N_c, w / N_c
