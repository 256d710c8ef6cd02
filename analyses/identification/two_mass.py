"""A two-mass drive from its frequency response: inertias, stiffness, damping, and their intervals."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from actuator_lti.errors import InputError, NumericalError
from analyses.estimation.arrays import ComplexArray, FloatArray
from analyses.estimation.fit import Fit, Fixed
from analyses.identification.frequency import Lines

NAMES = ("motor_inertia", "load_inertia", "stiffness", "damping", "viscous", "load_viscous")
"""J_m at the motor, J_l at its own shaft, k and c at the coupling, Cv at the motor, Cv_l behind."""
FLOORS = ("damping", "viscous", "load_viscous")
"""What no drive has negative, but an estimate of it by its error may be."""


@dataclass(frozen=True, kw_only=True)
class TwoMass(Fit):
    """The two-mass drive that fits the lines best, with 95 % intervals.

    ``misfit`` is the root of the mean squared residual over its noise: near 1 the model explains the lines.
    Where it is larger the errors are widened by it. ``resonance_rad_s`` and ``antiresonance_rad_s`` are those
    without damping.
    """

    reduction: float
    misfit: float
    lines: int
    reaction: float = 0.0

    @property
    def antiresonance_rad_s(self) -> tuple[float, float]:
        """sqrt(k/J_l), and its standard error."""
        return self._derived(lambda p: float(np.sqrt(p["stiffness"] / p["load_inertia"])))

    @property
    def resonance_rad_s(self) -> tuple[float, float]:
        """sqrt(k (1/J_l + 1/(J_m N_c^2))), and its standard error."""
        n2 = self.reduction**2
        return self._derived(
            lambda p: float(np.sqrt(p["stiffness"] * (1 / p["load_inertia"] + 1 / (p["motor_inertia"] * n2))))
        )

    def _derived(self, of: Callable[[dict[str, float]], float]) -> tuple[float, float]:
        own = {name: self[name] for name in NAMES}
        middle = of(own)
        steps = {name: 1e-6 * max(abs(own[name]), 1e-300) for name in self.names}
        g = np.array([(of({**own, name: own[name] + step}) - middle) / step for name, step in steps.items()])
        return middle, float(np.sqrt(max(g @ self.covariance @ g, 0.0)))


def angle_responses(
    omega: FloatArray, p: Mapping[str, float], n: float, reaction: float | None = None
) -> tuple[ComplexArray, ComplexArray]:
    """Motor angle and load angle over motor torque (model.md section 6, without play).

    ``J_m s^2 th + Cv s th + r T = torque``, ``J_l s^2 phi + Cv_l s phi = T``, ``T = (k + c s)(th/n - phi)``;
    r is 1/n, or ``1/n + CM' sgn(w T)`` where friction grows with the torque that the coupling carries.
    """
    share = 1.0 / n if reaction is None else reaction
    s = 1j * omega
    spring = p["stiffness"] + p["damping"] * s
    load = p["load_inertia"] * s**2 + p["load_viscous"] * s
    motor = p["motor_inertia"] * s**2 + p["viscous"] * s
    both = motor * (load + spring) + spring * load * share / n
    return np.asarray((load + spring) / both), np.asarray(spring / n / both)


def fit_two_mass(
    lines: Lines,
    start: Mapping[str, float],
    reduction: float,
    *,
    torque: str = "torque",
    motor: str = "angle",
    load: str | None = None,
    fixed: Mapping[str, float] | None = None,
    reaction: float | None = None,
) -> TwoMass:
    """Fit the two-mass drive to the lines, by maximum likelihood with noise on all signals.

    Each line's residual ``th - G torque`` is divided by its own standard deviation, which the spectrum
    beside it gives (errors in variables; Pintelon and Schoukens, System Identification, 2nd ed., section
    9.11). The lines are of the motor torque, the motor angle and, where recorded, the load's angle;
    ``start`` has the names of ``NAMES``, ``reduction`` is N_c, up to the coupling, ``reaction`` the torque
    on the motor by that in the coupling, 1/N_c by default.
    """
    from scipy.optimize import least_squares

    held = dict(fixed or {})
    names = tuple(name for name in NAMES if name not in held)
    scale = _scales(start, names)
    outputs = [motor] if load is None else [motor, load]

    def unpacked(q: FloatArray) -> dict[str, float]:
        own = dict(zip(names, (q * scale).tolist(), strict=True))
        return {**held, **{name: value if name in FLOORS else abs(value) for name, value in own.items()}}

    def residual(q: FloatArray) -> FloatArray:
        g = angle_responses(lines.omega_rad_s, unpacked(q), reduction, reaction)
        both = _whitened(lines, outputs, torque, g[: len(outputs)])
        return np.concatenate([both.real, both.imag]) * np.sqrt(2.0)

    begin = np.array([max(abs(start.get(name, 0.0)), scale[k]) for k, name in enumerate(names)]) / scale
    fit = least_squares(residual, begin, x_scale="jac", max_nfev=400, method="lm")
    if not fit.success:
        raise NumericalError(f"the two-mass fit does not converge: {fit.message}")
    size = np.linalg.norm(fit.jac, axis=0)
    if np.any(size == 0.0):
        raise NumericalError(f"the lines do not tell {names[int(np.argmin(size))]}; hold it with --fix")
    freedom = max(len(fit.fun) - len(names), 1)
    few, loss = _weighed(lines.freedom, len(outputs))
    misfit = float(np.sqrt(2.0 * fit.cost / freedom / few))
    inverse = np.linalg.inv((fit.jac / size).T @ (fit.jac / size)) / np.outer(size, size)
    covariance = inverse * few * loss * max(misfit, 1.0) ** 2 * np.outer(scale, scale)
    own = unpacked(fit.x)
    return TwoMass(
        names=names,
        values=np.array([own[name] for name in names]),
        covariance=np.asarray(covariance),
        fixed={name: Fixed(value=value, reason="fixed as asked") for name, value in held.items()},
        reduction=reduction,
        reaction=1.0 / reduction if reaction is None else reaction,
        misfit=misfit,
        lines=len(lines.omega_rad_s) * len(outputs),
    )


def _weighed(freedom: int, outputs: int) -> tuple[float, float]:
    """What weights from a few places beside each line do: they are too large, and the estimate scatters more.

    For a complex Wishart matrix X of n degrees of freedom and q outputs, E X^-1 = 1/(n - q) and E X^-2 =
    n/((n - q)^3 - (n - q)): the information is n/(n - q) times too large, and the variance of a value weighed
    so is E X^-2/(E X^-1)^2 = n (n - q)/((n - q)^2 - 1) times that with the true weights.
    """
    rest = max(freedom - outputs, 1)
    return freedom / rest, freedom * rest / max(rest**2 - 1.0, 1.0)


def _scales(start: Mapping[str, float], names: tuple[str, ...]) -> FloatArray:
    """What each parameter is measured by: its start, or a small part of what the others make critical."""
    for name in ("motor_inertia", "load_inertia", "stiffness"):
        if not start.get(name, 0.0) > 0.0:
            raise InputError(f"{name} = {start.get(name)}: the fit needs a positive start")
    natural = np.sqrt(start["stiffness"] / start["load_inertia"])
    size = {
        "damping": 0.01 * start["stiffness"] / natural,
        "viscous": 0.01 * start["motor_inertia"] * natural,
        "load_viscous": 0.01 * start["load_inertia"] * natural,
    }
    return np.array([max(abs(start.get(name, 0.0)), size.get(name, 0.0)) for name in names])


def _whitened(
    lines: Lines, outputs: Sequence[str], by: str, responses: Sequence[ComplexArray]
) -> ComplexArray:
    """Residuals ``output - G torque`` of every line, whitened by their covariance.

    The residuals of two outputs share the noise of the torque, so they are whitened together.
    """
    j = lines.names.index(by)
    rows = [lines.names.index(output) for output in outputs]
    mix = np.zeros((len(lines.omega_rad_s), len(rows), len(lines.names)), dtype=complex)
    mix[:, range(len(rows)), rows] = 1.0
    mix[:, :, j] -= np.array(responses).T
    rest = np.einsum("krs,sk->kr", mix, lines.means)
    covariance = np.einsum("krs,kst,kqt->krq", mix, lines.noise, mix.conj())
    floor = 1e-24 * np.array([np.abs(lines.means[k]) ** 2 for k in rows]).T
    covariance = covariance + floor[:, :, None] * np.eye(len(rows))
    root = np.linalg.cholesky(covariance)
    return np.asarray(np.linalg.solve(root, rest[:, :, None])[:, :, 0].ravel())


def start_of(lines: Lines, reduction: float, *, torque: str = "torque") -> dict[str, float]:
    """Starting values from the response itself: its lowest and highest part, its valley and its peak.

    Below the antiresonance the whole inertia moves, above the resonance the motor's alone.
    """
    k, j = lines.names.index("angle"), lines.names.index(torque)
    omega = lines.omega_rad_s
    inertia = np.abs(lines.means[j] / (omega**2 * lines.means[k]))
    third = max(len(omega) // 8, 2)
    whole, own = float(np.median(inertia[:third])), float(np.median(inertia[-third:]))
    valley = float(omega[int(np.argmax(inertia))])
    behind = max(whole - own, 0.05 * whole) * reduction**2
    motor = min(own, 0.95 * whole)
    return {"motor_inertia": motor, "load_inertia": behind, "stiffness": behind * valley**2}


def other_starts(start: Mapping[str, float], lines: Lines, reduction: float) -> list[dict[str, float]]:
    """Starts all over the range of the lines, for where the valley of the response drowns in noise.

    The whole inertia of ``start`` is split between the sides, with the antiresonance at six frequencies.
    """
    whole = start["motor_inertia"] + start["load_inertia"] / reduction**2
    low, high = float(np.min(lines.omega_rad_s)), float(np.max(lines.omega_rad_s))
    result = []
    for share in (0.5, 0.2, 0.8):
        for valley in np.geomspace(low, high, 8)[1:-1]:
            behind = (1.0 - share) * whole * reduction**2
            sides = {"motor_inertia": share * whole, "load_inertia": behind}
            result.append({**start, **sides, "stiffness": behind * float(valley) ** 2})
    return result
