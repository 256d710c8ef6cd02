"""The whole sampled closed loop as exact matrices, tick by tick: the linear side of model.md section 4."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from actuator_lti.drive.wiring import COMMANDS
from actuator_lti.errors import InputError
from actuator_lti.loops.tick import TickProgram
from actuator_lti.systems.settling import slowest_mode

if TYPE_CHECKING:
    import control

OUTPUTS = ("th", "w", "i", "u", "i_ref", "w_ref", "phi", "W", "T_s", "output_angle")


@dataclass(frozen=True)
class TickSystem:
    """``x_{k+1} = A_j x_k + B_j v_k, y_k = C_j x_k + D_j v_k``, v = [ref, T, M], j = k mod `ticks`.

    ref is the command at t_k: of the position at the output shaft (rad), else ``w_ref`` (rad/s at the motor),
    ``i_ref`` (A) or ``u`` (V); T a torque in N m at the motor shaft that accelerates it, M a load torque
    in N m that pushes the output shaft forward, both held over the tick (dry friction while w > 0: T = -Tc;
    of the load while W > 0: M = -N_r C0_l).  With the feed-forward the command before t_0 counts as 0 unless
    `initial_state` says otherwise (``ref_prev``, motor side).
    """

    program: TickProgram
    # Those of `OUTPUTS` that the drive has, at t_k; motor side but for what is behind the coupling
    outputs: tuple[str, ...]

    @property
    def ticks(self) -> int:
        """n_p: ticks after which the matrices repeat."""
        return self.program.ticks

    @property
    def states(self) -> tuple[str, ...]:
        return self.program.states

    @cached_property
    def slowest(self) -> float:
        """Magnitude, per tick, of the mode that decays last or grows; see `slowest_mode`."""
        return slowest_mode([self.matrices(phase)[0] for phase in range(self.ticks)])

    def matrices(self, phase: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """A, B, C, D of tick ``phase`` (inputs: ref, T, M)."""
        tick, n = self.program.tick(phase), len(self.states)
        rows = np.array([tick.signals[name] for name in self.outputs])
        return tick.A, tick.B[:, :3], rows[:, :n], rows[:, n : n + 3]

    def initial_state(self, values: Mapping[str, float] | None = None) -> np.ndarray:
        """State vector with some states set by name (the others 0); ``phi`` instead of ``twist`` will do."""
        x, given = np.zeros(len(self.states)), dict(values or {})
        if "phi" in given and "twist" in self.states:
            N_c = self.program.drive.design.ratio_to_coupling
            given["twist"] = given.get("th", 0.0) / N_c - given.pop("phi")
        for name, value in given.items():
            if name not in self.states:
                raise InputError(f"state {name!r}: one of {', '.join(self.states)}")
            x[self.states.index(name)] = value
        return x

    def respond(
        self, reference_rad: np.ndarray, torque_Nm: np.ndarray | float = 0.0,
        initial: np.ndarray | None = None, moment_Nm: np.ndarray | float = 0.0
    ) -> dict[str, np.ndarray]:  # fmt: skip
        """Run the recursion from t_0, see `initial_state`; gives `outputs` at t_k, each of shape (K,).

        The command is that at t_k in its own unit (read only where the outermost loop updates), the torque
        accelerates the motor shaft, the load torque pushes the output shaft forward; shape (K,), or one.
        """
        reference = np.asarray(reference_rad, dtype=float)
        given = (torque_Nm, moment_Nm)
        v = np.column_stack([reference, *(np.broadcast_to(each, reference.shape) for each in given)])
        phases = [self.matrices(j) for j in range(self.ticks)]
        x = self.initial_state() if initial is None else np.array(initial, dtype=float)
        y = np.empty((len(reference), len(self.outputs)))
        for k in range(len(reference)):
            A, B, C, D = phases[k % self.ticks]
            y[k] = C @ x + D @ v[k]
            x = A @ x + B @ v[k]
        return {name: y[:, r] for r, name in enumerate(self.outputs)}

    def lifted(self) -> control.StateSpace:
        """The same over a whole position period n_p Ts, with its inputs held over it.

        Outputs are those of every tick in the period, named ``th[0] .. th[n_p-1], w[0], ...``; for n_p = 1
        plain ``th``, ``w``, ...  Good for `control.forced_response`.
        """
        import control

        A, B = np.eye(len(self.states)), np.zeros((len(self.states), 3))
        C, D, labels = [], [], []
        for j in range(self.ticks):
            A_j, B_j, C_j, D_j = self.matrices(j)
            C.append(C_j @ A)
            D.append(C_j @ B + D_j)
            A, B = A_j @ A, A_j @ B + B_j
            labels += [f"{name}[{j}]" if self.ticks > 1 else name for name in self.outputs]
        return control.ss(
            A, B, np.vstack(C), np.vstack(D), self.ticks * self.program.drive.tick_s,
            inputs=[COMMANDS[self.program.outer], "torque", "load_torque"],
            outputs=labels,
            states=[name.replace(".", "_") for name in self.states],
        )  # fmt: skip
