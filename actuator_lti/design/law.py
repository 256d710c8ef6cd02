"""A law of one's own in place of a stage's gains and filters (model.md section 10), and the keys of it.

Once a period T of its stage

    v_k = gain (C x_k + D e_k),   x_(k+1) = A x_k + B e_k + L (u_k - v_k),

u being what the limits of the stage leave of v, e the named signals as the controller sees them.
"""

from dataclasses import dataclass
from typing import Annotated, Any, Literal, NamedTuple, get_args

import numpy as np

from actuator_lti.design.field import matrix, names, positive, quantities, quantity, text

LawInput = Literal["command", "error", "speed", "angle", "current", "output_angle", "output_speed", "twist"]
LAW_WORDS: tuple[str, ...] = get_args(LawInput)
LAW_INPUTS = LAW_WORDS[:-1]
"""What a controller measures or is given; the twist it makes of two of them, see `twist_of`."""
BESIDE_A_LAW = ("every", "sensor", "back_emf_feedforward", "resistance_feedforward")
"""Keys of a stage that its law does not take the place of."""
GAIN_REPLACED = "not allowed beside {stage}.law, whose own gain is {stage}.law.gain"
MOST_STATES = 16  # order of a law that the running drive has room for
SINGULAR = 1e12  # condition of I - A beyond which a law integrates
Matrix = tuple[tuple[float, ...], ...]


class Matrices(NamedTuple):
    """A (n, n), B (n, m), C (n,), D (m,), L (n,) as arrays."""

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    L: np.ndarray


def twist_of(design: Any) -> dict[str, Any]:
    """The twist of the coupling as a controller knows it: gains on the angles of the motor and the output."""
    return {"angle": 1.0 / design.ratio_to_coupling, "output_angle": -1.0 * design.ratio_behind_coupling}


def balance(A: np.ndarray, B: np.ndarray, C: np.ndarray) -> np.ndarray:
    """Powers of two t, x = t x', that give rows and columns of A, B and C like sizes.

    As `matrix_balance` (LAPACK gebal), of A with one state more that stands for all inputs and the output.
    """
    from scipy.linalg import matrix_balance

    n = len(A)
    whole = np.block([[A, np.abs(B).sum(axis=1, keepdims=True)], [C.reshape(1, n), np.zeros((1, 1))]])
    scale = matrix_balance(whole, permute=False, separate=True)[1][0]
    return scale[:n] / scale[n]


# fmt: off
@dataclass(frozen=True, kw_only=True)
class StateSpace:
    """A, B, C and D of a law with one output: ``n`` states, ``m`` inputs; without A a mere gain D."""

    A: Annotated[Matrix, matrix("n rows of n numbers; without states left out")] = ()
    B: Annotated[Matrix, matrix("n rows, a column for each input")] = ()
    C: Annotated[tuple[float, ...], quantities("one row of n numbers")] = ()
    D: Annotated[tuple[float, ...], quantities("one row, a number for each input; "
        "zeros where left out")] = ()

    def sizes(self, inputs: int) -> dict[str, tuple[str, bool]]:
        """Of each matrix the shape that it must have, and whether it has it."""
        n = len(self.A)
        return {
            "A": (f"{n} x {n}", all(len(row) == n for row in self.A)),
            "B": (f"{n} x {inputs}", len(self.B) == n and all(len(row) == inputs for row in self.B)),
            "C": (f"1 x {n}", len(self.C) == n),
            "D": (f"1 x {inputs}", len(self.D) in ((0, inputs) if n else (inputs,))),
        }

    def matrices(self, inputs: int, L: tuple[float, ...] = ()) -> Matrices:
        n = len(self.A)
        return Matrices(
            np.array(self.A, dtype=float).reshape(n, n),
            np.array(self.B, dtype=float).reshape(n, inputs),
            np.array(self.C, dtype=float).reshape(n),
            np.array(self.D or (0.0,) * inputs, dtype=float),
            np.array(L or (0.0,) * n, dtype=float),
        )


@dataclass(frozen=True, kw_only=True)
class Law(StateSpace):
    """A discrete linear law of one stage, at that stage's period."""

    inputs: Annotated[tuple[LawInput, ...], names("the signals that it takes, a column of B and D each "
        "(state feedback: D alone), in SI: output_angle and output_speed of the output shaft, twist of the "
        "coupling by both angles, the others of the motor; the speed is held between updates of a velocity "
        "stage, without one measured in every tick; error is command minus the stage's own signal, of the "
        "position the counted angle of the motor (sensor = output: N times that of the output)")]
    file: Annotated[str, text("a .mat or .json file with A, B, C, D and Ts, beside the design file; read in "
        "their place. L, gain and inputs may stand in it or here")] = ""
    L: Annotated[tuple[float, ...], quantities("anti-windup: n numbers that the states take of u - v; zeros "
        "where left out")] = ()
    gain: Annotated[float, quantity("factor on the law; its tolerance is that of the whole law",
        example="1")] = 1.0
    period_s: Annotated[float | None, positive("period that the law was made for: must be that of its stage",
        high=1e4, example="1 ms")] = None
    continuous: StateSpace | None = None

    @property
    def sampled(self) -> Matrices:
        return self.matrices(len(self.inputs), self.L)

    @property
    def poles(self) -> np.ndarray:
        return np.linalg.eigvals(self.sampled.A)

    @property
    def integrates(self) -> bool:
        if not self.A:
            return False
        A, B, C, _, _ = self.sampled
        t = balance(A, B, C)  # the size of a state is a matter of taste
        return bool(np.linalg.cond(np.eye(len(A)) - A * t / t[:, None]) > SINGULAR)

    @property
    def direct(self) -> float:
        return self._gain_on("command", self.sampled.D)

    def steady(self, name: str) -> float:
        """Gain on a signal at zero frequency (of the command by the error, too); inf: integrates."""
        A, B, C, D, _ = self.sampled
        if self.integrates:
            return np.inf
        return self._gain_on(name, D + C @ np.linalg.solve(np.eye(len(A)) - A, B))

    def _gain_on(self, name: str, gains: np.ndarray) -> float:
        reached = ("command", "error") if name == "command" else (name,)
        return self.gain * sum(float(gains[k]) for k, one in enumerate(self.inputs) if one in reached)
