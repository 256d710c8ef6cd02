"""Linear systems with exact internal delays, compatible with python-control.

A `DelaySystem` is a state space in linear fractional form with a bank of delays::

    dx/dt = A  x + B1  u + B2  z
    y     = C1 x + D11 u + D12 z
    v     = C2 x + D21 u + D22 z,      z_k(t) = v_k(t - delays_s[k])

Series, parallel and feedback connection only rearrange these matrices, so nested loops keep every delay
exactly, and the frequency response is that of the delays themselves: nowhere a Pade approximation, unless
`DelaySystem.pade` is asked for one. python-control's plots, ``margin`` and time responses take it as it is,
see `actuator_lti.systems.control_interface`.
"""

from __future__ import annotations

from functools import reduce
from operator import mul
from typing import Any

import control
import numpy as np
from control.iosys import InputOutputSystem

from actuator_lti.errors import InputError, delay_number, shown, whole_number
from actuator_lti.margins.loop import rational_loop
from actuator_lti.systems.control_interface import ControlInterface
from actuator_lti.systems.plain_system import PlainDelaySystem, descriptor, in_parallel, in_series, response

_PARTS = (*PlainDelaySystem.parts, "delays_s")


def _matrix(value: Any, rows: int, columns: int, name: str) -> np.ndarray:
    array = np.asarray(value if np.size(value) else np.zeros((rows, columns)), dtype=float)
    array = array.reshape(rows, columns)
    if not np.all(np.isfinite(array)):
        raise InputError(f"{name}: every entry must be finite")
    return array


class DelaySystem(ControlInterface):
    """A continuous system with internal delays, see the module for the equations.

    ``A, B1, B2, C1, C2, D11, D12, D21, D22``: shapes (n,n), (n,m), (n,k), (p,n), (k,n), (p,m), (p,k), (k,m),
    (k,k).
    ``delays_s``: k delays in s, each > 0.
    ``inputs, outputs, name``: optional, names as in python-control (or the numbers of signals).

    Raises `InputError`: for a delay that is not positive, or entries that are not finite.

    Examples
    --------
    100 exp(-0.005 s)/s, its phase at 100 rad/s: -90 - 28.648 degrees.

    >>> import control, numpy as np
    >>> loop = DelaySystem.from_system(control.ss([[0]], [[1]], [[100]], [[0]])) * DelaySystem.delay(0.005)
    >>> round(float(np.degrees(np.angle(loop(100j)))), 3)
    -118.648
    >>> loop
    DelaySystem(1 state, delays 5 ms)
    """

    def __init__(
        self,
        A: Any, B1: Any, B2: Any, C1: Any, C2: Any, D11: Any, D12: Any, D21: Any, D22: Any,
        delays_s: Any, **names: Any,
    ) -> None:  # fmt: skip
        D11 = np.atleast_2d(np.asarray(D11, dtype=float))
        p, m = D11.shape
        self.delays_s = np.asarray(delays_s, dtype=float).reshape(-1)
        k, n = len(self.delays_s), round(np.size(A) ** 0.5)
        if not np.all((self.delays_s > 0) & np.isfinite(self.delays_s)):
            raise InputError(f"delays_s = {self.delays_s.tolist()}: each must be positive and finite")
        names.setdefault("inputs", m)
        names.setdefault("outputs", p)
        InputOutputSystem.__init__(self, dt=0, **({"states": n} | names))
        self.A, self.D11 = _matrix(A, n, n, "A"), _matrix(D11, p, m, "D11")
        self.B1, self.B2 = _matrix(B1, n, m, "B1"), _matrix(B2, n, k, "B2")
        self.C1, self.C2 = _matrix(C1, p, n, "C1"), _matrix(C2, k, n, "C2")
        self.D12, self.D21 = _matrix(D12, p, k, "D12"), _matrix(D21, k, m, "D21")
        self.D22 = _matrix(D22, k, k, "D22")

    @classmethod
    def of(cls, plain: PlainDelaySystem, **names: Any) -> DelaySystem:
        if plain.states:
            names["states"] = list(plain.states)
        return cls(**{part: getattr(plain, part) for part in _PARTS}, **names)

    @property
    def plain(self) -> PlainDelaySystem:
        labels = tuple(self.state_labels) if self.nstates else ()
        return PlainDelaySystem(**{part: getattr(self, part) for part in _PARTS}, states=labels)

    @classmethod
    def from_system(cls, system: Any, **names: Any) -> DelaySystem:
        """A continuous python-control system, a number, or a `DelaySystem` itself, in this form."""
        if isinstance(system, DelaySystem):
            return system
        if isinstance(system, int | float | np.number):
            return cls([], [], [], [], [], [[float(system)]], [], [], [], [], **names)
        if not isinstance(system, control.StateSpace | control.TransferFunction):
            allowed = "a continuous StateSpace or TransferFunction, or a number"
            raise InputError(f"system = {shown(system)}: {allowed}")
        if not system.isctime():
            raise InputError(f"a sampled system (dt = {system.dt}) cannot be joined to a continuous one")
        labels = {"inputs": system.input_labels, "outputs": system.output_labels} | names
        if isinstance(system, control.TransferFunction) and system.issiso():
            own = rational_loop(system)  # control.ss drops what is below 1e-14 of the numerator
            return cls(own.A, own.b, [], own.c, [], own.d, [], [], [], [], **labels)
        ss = control.ss(system)
        return cls(ss.A, ss.B, [], ss.C, [], ss.D, [], [], [], [], **labels)

    @classmethod
    def delay(cls, delay_s: float, **names: Any) -> DelaySystem:
        """The pure delay exp(-s delay_s)."""
        if delay_number(delay_s) == 0.0:
            return cls.from_system(1.0, **names)
        return cls([], [], [], [], [], [[0.0]], [[1.0]], [[1.0]], [[0.0]], [delay_s], **names)

    @property
    def delay_free(self) -> bool:
        return len(self.delays_s) == 0

    def to_state_space(self) -> control.StateSpace:
        """The same as `control.StateSpace`; refused (`InputError`) where there are delays."""
        if not self.delay_free:
            why = "the system has delays, which no finite state space holds exactly"
            raise InputError(f"to_state_space: {why}")
        labels = {"inputs": self.input_labels, "outputs": self.output_labels, "name": self.name}
        if self.nstates:
            labels["states"] = self.state_labels
        return control.ss(self.A, self.B1, self.C1, self.D11, **labels)

    def without_delays(self) -> control.StateSpace:
        """State space with every delay set to zero.

        Raises `InputError`: if that leaves an algebraic loop without a solution.
        """
        if self.delays_s.size and np.linalg.cond(np.eye(self.delays_s.size) - self.D22) > 1e12:
            raise InputError("without_delays: an algebraic loop without a solution remains")
        return self._with_each(control.ss([], [], [], 1.0))

    def pade(self, order: int = 4) -> control.StateSpace:
        """An approximation as `control.StateSpace`: each delay as a Pade quotient of this order.

        For functions of python-control that want poles; its states are those of the system, then
        ``delay0_0, delay0_1, ...`` of each delay. No figure of this library uses it.

        Raises `InputError`: for an order outside 1 to 12, beyond which the coefficients lose their digits.

        Examples
        --------
        exp(-s/100) at 50 rad/s: -28.648 degrees.

        >>> import numpy as np
        >>> near = DelaySystem.delay(0.01).pade(4)
        >>> near.state_labels
        ['delay0_0', 'delay0_1', 'delay0_2', 'delay0_3']
        >>> round(float(np.degrees(np.angle(near(50j)))), 3)
        -28.648
        """
        if isinstance(order, bool) or not isinstance(order, int) or not 1 <= order <= 12:
            raise InputError(f"order = {order!r}: allowed: a whole number, 1 to 12")
        unit = control.ss(control.tf(*control.pade(1.0, order)))  # in time over the delay: well scaled
        own = self.state_labels if self.nstates else []
        states = [*own, *(f"delay{k}_{j}" for k in range(len(self.delays_s)) for j in range(order))]
        return self._with_each(unit, name=f"{self.name}_pade{order}", states=states)

    def _with_each(self, unit: control.StateSpace, **names: Any) -> control.StateSpace:
        """State space with a system, in time over the delay, in the place of each delay."""
        rates, one = np.diag(1.0 / self.delays_s), np.eye(len(self.delays_s))
        A, B, C, D = map(np.kron, (rates, rates, one, one), (unit.A, unit.B, unit.C, unit.D))
        # v = C2 x + D21 u + D22 z, z = C p + D v
        Vx, Vp, Vu = (np.linalg.solve(one - self.D22 @ D, M) for M in (self.C2, self.D22 @ C, self.D21))
        Zx, Zp, Zu = D @ Vx, C + D @ Vp, D @ Vu
        return control.ss(
            np.block([[self.A + self.B2 @ Zx, self.B2 @ Zp], [B @ Vx, A + B @ Vp]]),
            np.vstack([self.B1 + self.B2 @ Zu, B @ Vu]), np.hstack([self.C1 + self.D12 @ Zx, self.D12 @ Zp]),
            self.D11 + self.D12 @ Zu, **({"inputs": self.input_labels, "outputs": self.output_labels} | names)
        )  # fmt: skip

    def characteristic(self, s: Any) -> np.ndarray:
        """Characteristic quasi-polynomial det [[sI - A, -B2 E], [-C2, I - D22 E]] at complex s.

        Its zeros are the poles of the system. Shape of ``s``.
        """
        points = np.asarray(s, dtype=complex)
        return np.linalg.det(descriptor(self, points.reshape(-1))).reshape(points.shape)

    def __call__(self, x: Any, squeeze: bool | None = None, warn_infinite: bool = True) -> Any:
        """Frequency response at complex s, exactly, as `control.StateSpace.__call__` shapes it."""
        points = np.atleast_1d(np.asarray(x, dtype=complex))
        if points.ndim != 1:
            raise InputError("a system is evaluated at a number or a 1D array of complex frequencies")
        return control.lti._process_frequency_response(self, x, response(self, points), squeeze=squeeze)

    def dcgain(self, warn_infinite: bool = False) -> Any:
        return self._dcgain(warn_infinite)

    def poles(self) -> np.ndarray:
        """Poles; infinitely many with delays, then `NotImplementedError` (see `characteristic`)."""
        return self._finitely_many("poles").poles()

    def zeros(self) -> np.ndarray:
        """Zeros; infinitely many with delays, then `NotImplementedError`."""
        return self._finitely_many("zeros").zeros()

    def _finitely_many(self, what: str) -> control.StateSpace:
        if not self.delay_free:
            raise NotImplementedError(f"a system with delays has infinitely many {what}")
        return self.to_state_space()

    def __neg__(self) -> DelaySystem:
        return self * -1.0

    def __add__(self, other: Any) -> DelaySystem:
        return DelaySystem.of(in_parallel(self.plain, DelaySystem.from_system(other).plain))

    __radd__ = __add__

    def __sub__(self, other: Any) -> DelaySystem:
        return self + DelaySystem.from_system(other) * -1.0

    def __rsub__(self, other: Any) -> DelaySystem:
        return DelaySystem.from_system(other) + self * -1.0

    def __mul__(self, other: Any) -> DelaySystem:
        """Series connection: ``other`` first, then this system."""
        return DelaySystem.of(in_series(DelaySystem.from_system(other).plain, self.plain))

    def __rmul__(self, other: Any) -> DelaySystem:
        return DelaySystem.of(in_series(self.plain, DelaySystem.from_system(other).plain))

    def __truediv__(self, other: Any) -> DelaySystem:
        if not isinstance(other, int | float | np.number) or not other:
            raise InputError(f"{self} / {shown(other)}: a system with delays is divided by a number, not 0")
        return self * (1.0 / float(other))

    def __rtruediv__(self, other: Any) -> DelaySystem:
        raise InputError(f"{shown(other)} / {self}: no division by a system with delays, it would look ahead")

    def __pow__(self, power: Any) -> DelaySystem:
        return reduce(mul, [self] * whole_number("power", power, 0), DelaySystem.from_system(1.0))

    def feedback(self, other: Any = 1, sign: int = -1) -> DelaySystem:
        """Closed loop ``self / (1 - sign self other)``.

        ``control.feedback`` takes it as its first system only: `from_system` makes one of the first.

        Raises `InputError`: if the delay-free path round the loop is algebraic and without a solution.
        """
        return DelaySystem.of(self.plain.feedback(DelaySystem.from_system(other).plain, sign))

    def __repr__(self) -> str:
        n = self.A.shape[0]
        delays = ", ".join(f"{1e3 * each:g} ms" for each in self.delays_s) or "none"
        return f"DelaySystem({n} state{'s' if n != 1 else ''}, delays {delays})"

    __str__ = __repr__

    def _repr_html_(self) -> str:
        return repr(self).replace("&", "&amp;").replace("<", "&lt;")
