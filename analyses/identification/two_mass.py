"""A two-mass drive from a record of a periodic excitation: lines, their noise, what fits them best."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.optimize import least_squares

from actuator_lti.errors import InputError, NumericalError
from actuator_lti.types import Complexes, Floats
from analyses.estimation.fit import Fit, Fixed
from analyses.estimation.series import autocovariance
from analyses.records.record import Record

MIN_PERIODS = 4
TOP = 0.4  # of the sampling frequency: lines above are not looked at
BESIDE = 6  # places on either side of a line that its noise is taken from; a sharp resonance allows no more
EXCITED = 25.0  # a line counts as excited where its power is this many times that of its noise
NAMES = ("motor_inertia", "load_inertia", "stiffness", "damping", "viscous", "load_viscous")
"""J_m at the motor, J_l at its own shaft, k and c at the coupling, Cv at the motor, Cv_l behind."""
FLOORS = ("damping", "viscous", "load_viscous")
"""What no drive has negative, but an estimate of it by its error may be."""


@dataclass(frozen=True, kw_only=True)
class Lines:
    """Spectral lines at the excited frequencies: of the motor's torque, its angle, and maybe the load's."""

    omega_rad_s: Floats
    means: Complexes  # amplitudes over all periods, shape (signals, lines)
    noise: Complexes  # their covariance, shape (lines, signals, signals), from the spectrum beside each line
    names: tuple[str, ...]
    periods: int
    freedom: int  # complex degrees, of the noise


def excited_lines(record: Record, names: tuple[str, ...], period_s: float) -> Lines:
    """The lines of a periodic excitation; the first signal shows which of them are excited.

    The period is a whole number of samples; the first one is left out, for the transient. A signal that
    drifts (an angle under a mean speed) loses the straight line of its mean rate first. The noise of a line
    is what the spectrum of the whole record holds beside it, where a periodic signal has nothing. (The
    scatter between periods would be too large: what a motion that is not periodic leaves at the ends of one
    period comes back at the start of the next with the opposite sign, and goes out of the mean.) A speed that
    still settles is no noise: it is smooth there, and goes out of both.
    """
    samples = round(period_s / record.period_s)
    if samples < 8 or abs(samples * record.period_s - period_s) > 1e-3 * record.period_s:
        why = f"must be a whole number (8 or more) of samples of {record.period_s:g} s"
        raise InputError(f"period {period_s:g} s: {why}", where=record.name)
    periods = len(record) // samples - 1
    if periods < MIN_PERIODS:
        why = f"{periods} periods of {period_s:g} s after the first: at least {MIN_PERIODS}"
        raise InputError(why, where=record.name)
    start = len(record) - periods * samples
    blocks = np.array([record[name][start:].reshape(periods, samples) for name in names])
    rates = (blocks[:, -1].mean(axis=1) - blocks[:, 0].mean(axis=1)) / max((periods - 1) * samples, 1)
    straight = blocks.reshape(len(names), -1) - rates[:, None] * np.arange(periods * samples)
    spectra = np.fft.rfft(straight) * (2.0 / (periods * samples))  # a line at every ``periods``-th place
    means, noise, freedom = _without_drift(spectra, periods, periods * samples)
    hertz, power = np.arange(1, means.shape[1] + 1) / period_s, np.abs(means[0]) ** 2
    largest = float(np.max(power, initial=0.0))
    floor = np.maximum(np.real(noise[:, 0, 0]), 1e-24 * largest)
    chosen = (power > EXCITED * floor) & (power > 1e-6 * largest) & (hertz <= TOP / record.period_s)
    if np.count_nonzero(chosen) < MIN_PERIODS:
        raise InputError(f"{names[0]}: no lines of a period of {period_s:g} s are excited", where=record.name)
    return Lines(
        omega_rad_s=np.asarray(2.0 * np.pi * hertz[chosen]),
        means=means[:, chosen],
        noise=noise[chosen],
        names=names,
        periods=periods,
        freedom=freedom,
    )


def _without_drift(spectra: Complexes, periods: int, samples: int) -> tuple[Complexes, Complexes, int]:
    """Lines less what a drift leaves there, the covariance of their noise, and its degrees of freedom.

    A parabola in time has the spectrum ``a/(1 - 1/z)^2``; that of a speed that settles differs from it by a
    smooth factor, a straight line over the places beside a line (the local polynomial method: Pintelon and
    Schoukens, System Identification, 2nd ed., section 7.3). What the fit of it leaves there is the noise.
    """
    reach = min(periods - 1, BESIDE)
    places = np.arange(periods, spectra.shape[1] - reach, periods)
    away = np.array([step for step in range(-reach, reach + 1) if step])
    near = places[:, None] + away
    falling = -np.expm1(-2j * np.pi * np.arange(spectra.shape[1]) / samples)
    shape = (falling[places, None] / falling[near]) ** 2
    drift = np.stack([shape, shape * away], axis=-1)
    inverse, beside = np.linalg.pinv(drift), spectra[:, near]
    found = np.einsum("krm,skm->skr", inverse, beside)
    rest = beside - np.einsum("kmr,skr->skm", drift, found)
    freedom = len(away) - 2
    own = (1.0 + np.sum(np.abs(inverse[:, 0]) ** 2, axis=-1)) / freedom
    noise = own[:, None, None] * np.einsum("akm,bkm->kab", rest, rest.conj())
    return spectra[:, places] - found[:, :, 0], noise, freedom


def response(lines: Lines, k: int = 1) -> tuple[Complexes, Floats]:
    """Frequency response from the torque to the signal of a number, and its relative standard error."""
    of, by = lines.means[k], lines.means[0]
    n = lines.noise
    relative = np.real(n[:, k, k]) / np.abs(of) ** 2 + np.real(n[:, 0, 0]) / np.abs(by) ** 2
    relative = relative - 2.0 * np.real(n[:, k, 0] / (of * by.conj()))
    return of / by, np.sqrt(np.maximum(relative, 0.0))


def period_of_excitation(record: Record, name: str) -> float:
    """The period with which a recorded command repeats itself, five times or more."""
    values = record[name] - np.polyval(np.polyfit(record.time_s, record[name], 1), record.time_s)
    n = len(values)
    correlation = n * autocovariance(values, n - 1)
    power, early = np.cumsum(values[::-1] ** 2)[::-1], np.cumsum(values**2)
    lags = np.arange(1, n // (MIN_PERIODS + 1))
    repeated = correlation[lags] / np.sqrt(np.maximum(power[lags] * early[n - 1 - lags], 1e-300))
    fallen = int(np.argmax(repeated < 0.5))
    peaks = np.flatnonzero(repeated[fallen:] > 0.98) + fallen
    if not len(repeated) or not fallen or not len(peaks):
        why = f"{name} does not repeat itself {MIN_PERIODS + 1} times: give the period of the excitation"
        raise InputError(why, where=record.name)
    group = peaks[peaks <= peaks[0] * 1.02 + 2]
    best = group[int(np.argmax(repeated[group]))]
    return float(lags[best] * record.period_s)


@dataclass(frozen=True, kw_only=True)
class TwoMass(Fit):
    """The two-mass drive that fits the lines best; its resonances are those without damping."""

    reduction: float
    # root of the mean squared residual over its noise: near 1 the model explains the lines, above the errors
    # are widened by it
    misfit: float
    lines: int
    reaction: float = 0.0

    @property
    def antiresonance_rad_s(self) -> tuple[float, float]:
        """sqrt(k/J_l), and its standard error."""
        return self._mode(0.0)

    @property
    def resonance_rad_s(self) -> tuple[float, float]:
        """sqrt(k (1/J_l + r/(J_m N_c))), r the reaction (1/N_c without load friction); its standard error."""
        return self._mode(self.reaction / self.reduction)

    def _mode(self, share: float) -> tuple[float, float]:
        """sqrt(k (1/J_l + share/J_m)), and its standard error by first derivatives."""
        load, motor = 1.0 / self["load_inertia"], share / self["motor_inertia"]
        rate = float(np.sqrt(self["stiffness"] * (load + motor)))
        shares = {"stiffness": 1.0, "load_inertia": -load / (load + motor)}
        shares["motor_inertia"] = -motor / (load + motor)
        g = np.array([0.5 * rate * shares.get(name, 0.0) / self[name] for name in self.names])
        return rate, float(np.sqrt(max(g @ self.covariance @ g, 0.0)))


def angle_responses(
    omega: Floats, p: Mapping[str, float], n: float, reaction: float | None = None
) -> tuple[Complexes, Complexes]:
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
    fixed: Mapping[str, float] | None = None,
    reaction: float | None = None,
) -> TwoMass:
    """Fit the two-mass drive to the lines, by maximum likelihood with noise on all signals.

    Each line's residual ``th - G torque`` is divided by its own standard deviation, which the spectrum
    beside it gives (errors in variables; Pintelon and Schoukens, System Identification, 2nd ed., section
    9.11). ``start`` has the names of ``NAMES``, ``reduction`` is N_c, up to the coupling, ``reaction`` the
    torque on the motor by that in the coupling, 1/N_c by default.
    """
    held, outputs = dict(fixed or {}), len(lines.names) - 1
    names = tuple(name for name in NAMES if name not in held)
    scale = _scales(start, names)

    def unpacked(q: Floats) -> dict[str, float]:
        own = dict(zip(names, (q * scale).tolist(), strict=True))
        return {**held, **{name: value if name in FLOORS else abs(value) for name, value in own.items()}}

    def residual(q: Floats) -> Floats:
        g = angle_responses(lines.omega_rad_s, unpacked(q), reduction, reaction)
        both = _whitened(lines, g[:outputs])
        return np.concatenate([both.real, both.imag]) * np.sqrt(2.0)

    fit = least_squares(residual, np.ones(len(names)), x_scale="jac", max_nfev=400, method="lm")
    if not fit.success:
        raise NumericalError(f"the two-mass fit does not converge: {fit.message}")
    size = np.linalg.norm(fit.jac, axis=0)
    if np.any(size == 0.0):
        raise NumericalError(f"the lines do not tell {names[int(np.argmin(size))]}; hold it with --fix")
    few, loss = _weighed(lines.freedom, outputs)
    misfit = float(np.sqrt(2.0 * fit.cost / max(len(fit.fun) - len(names), 1) / few))
    inverse = np.linalg.inv((fit.jac / size).T @ (fit.jac / size)) / np.outer(size, size)
    own = unpacked(fit.x)
    return TwoMass(
        names=names,
        values=np.array([own[name] for name in names]),
        covariance=np.asarray(inverse * few * loss * max(misfit, 1.0) ** 2 * np.outer(scale, scale)),
        fixed={name: Fixed(value=value, reason="fixed as asked") for name, value in held.items()},
        reduction=reduction,
        reaction=1.0 / reduction if reaction is None else reaction,
        misfit=misfit,
        lines=len(lines.omega_rad_s) * outputs,
    )


def _weighed(freedom: int, outputs: int) -> tuple[float, float]:
    """What weights from a few places beside each line do: they are too large, and the estimate scatters more.

    For a complex Wishart matrix X of n degrees of freedom and q outputs, E X^-1 = 1/(n - q) and E X^-2 =
    n/((n - q)^3 - (n - q)): the information is n/(n - q) times too large, and the variance of a value weighed
    so is E X^-2/(E X^-1)^2 = n (n - q)/((n - q)^2 - 1) times that with the true weights.
    """
    rest = max(freedom - outputs, 1)
    return freedom / rest, freedom * rest / max(rest**2 - 1.0, 1.0)


def _scales(start: Mapping[str, float], names: tuple[str, ...]) -> Floats:
    """What each parameter is measured by: its start, or a small part of what the others make critical."""
    for name in ("motor_inertia", "load_inertia", "stiffness"):
        if not start.get(name, 0.0) > 0.0:
            raise InputError(f"{name} = {start.get(name)}: the fit needs a positive start")
    natural = np.sqrt(start["stiffness"] / start["load_inertia"])
    size = {
        "damping": 0.01 * start["stiffness"] / natural,
        "viscous": 0.01 * start["motor_inertia"] * natural,
    }
    size["load_viscous"] = 0.01 * start["load_inertia"] * natural
    return np.array([max(abs(start.get(name, 0.0)), size.get(name, 0.0)) for name in names])


def _whitened(lines: Lines, responses: Sequence[Complexes]) -> Complexes:
    """Residuals ``output - G torque`` of every line, whitened together: they share the torque's noise."""
    count = len(responses)
    mix = np.zeros((len(lines.omega_rad_s), count, count + 1), dtype=complex)
    mix[:, range(count), range(1, count + 1)] = 1.0
    mix[:, :, 0] -= np.array(responses).T
    rest = np.einsum("krs,sk->kr", mix, lines.means)
    covariance = np.einsum("krs,kst,kqt->krq", mix, lines.noise, mix.conj())
    floor = 1e-24 * np.abs(lines.means[1:]).T ** 2
    root = np.linalg.cholesky(covariance + floor[:, :, None] * np.eye(count))
    return np.asarray(np.linalg.solve(root, rest[:, :, None])[:, :, 0].ravel())


def start_of(lines: Lines, reduction: float) -> dict[str, float]:
    """Starting values from the response itself: its lowest and highest part, its valley and its peak.

    Below the antiresonance the whole inertia moves, above the resonance the motor's alone.
    """
    omega = lines.omega_rad_s
    inertia = np.abs(lines.means[0] / (omega**2 * lines.means[1]))
    part = max(len(omega) // 8, 2)
    whole, own = float(np.median(inertia[:part])), float(np.median(inertia[-part:]))
    valley, behind = float(omega[int(np.argmax(inertia))]), max(whole - own, 0.05 * whole) * reduction**2
    return {"motor_inertia": min(own, 0.95 * whole), "load_inertia": behind, "stiffness": behind * valley**2}


def other_starts(start: Mapping[str, float], lines: Lines, reduction: float) -> Iterator[dict[str, float]]:
    """Starts all over the range of the lines, for where the valley of the response drowns in noise.

    The whole inertia of ``start`` is split between the sides, with the antiresonance at six frequencies.
    """
    whole = start["motor_inertia"] + start["load_inertia"] / reduction**2
    low, high = float(np.min(lines.omega_rad_s)), float(np.max(lines.omega_rad_s))
    for share, valley in product((0.5, 0.2, 0.8), np.geomspace(low, high, 8)[1:-1]):
        behind = (1.0 - share) * whole * reduction**2
        sides = {"motor_inertia": share * whole, "load_inertia": behind}
        yield {**start, **sides, "stiffness": behind * float(valley) ** 2}
