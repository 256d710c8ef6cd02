"""Least squares of one or several records: what they tell, what they do not, and how sure it is."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.signal import lfilter

from actuator_lti.errors import InputError
from actuator_lti.systems.root import root
from actuator_lti.types import Floats
from analyses.estimation.fit import Fit
from analyses.estimation.series import autocovariance

LEAST_OWN_SHARE = 0.03  # a column with less of its own beside those before it is not separated from them
RESOLVED = 1e-5  # share of a slope that is its own: below it two values do the same


@dataclass(frozen=True, kw_only=True)
class NotIdentified:
    """A parameter that the rows do not tell, and which others it cannot be told from."""

    name: str
    moves: Mapping[str, float] = field(default_factory=dict)  # its column is about theirs times these factors

    def __str__(self) -> str:
        others = " and ".join(self.moves)
        return f"cannot be separated from {others}" if others else "is not excited at all"


@dataclass(frozen=True, kw_only=True)
class Solution:
    """Values and covariances: ``white`` as if the residuals were white, ``correlated`` as they are."""

    values: Floats
    white: Floats
    correlated: Floats
    residual: Floats
    condition: float


def identifiable(
    w: Floats, names: Sequence[str] = (), *, least: float = LEAST_OWN_SHARE
) -> tuple[tuple[int, ...], tuple[NotIdentified, ...]]:
    """Which columns can be told apart (a share above ``least`` their own), the first before others.

    >>> w = np.column_stack([np.arange(4.0), np.ones(4), np.ones(4), np.zeros(4)])
    >>> kept, left = identifiable(w, ("viscous", "dry", "offset", "load"))
    >>> kept, [f"{one.name} {one}" for one in left]
    ((0, 1), ['offset cannot be separated from dry', 'load is not excited at all'])
    """
    kept: list[int] = []
    basis: list[Floats] = []
    left = []
    names = names or [""] * w.shape[1]
    for k, name in enumerate(names):
        size = float(np.linalg.norm(w[:, k]))
        unit = w[:, k] / (size or 1.0)
        rest = unit - sum((b * float(b @ unit) for b in basis), np.zeros(len(unit)))
        own = float(np.linalg.norm(rest))
        if not own < least:  # what is no number stays
            kept.append(k)
            basis.append(rest / own)
            continue
        moves = {}
        if size:
            sizes = np.linalg.norm(w[:, kept], axis=0)
            share = np.linalg.lstsq(w[:, kept] / sizes, unit, rcond=None)[0]
            chosen = np.flatnonzero(np.abs(share) > 0.2 * np.abs(share).max())
            moves = {names[kept[j]]: float(share[j] * size / sizes[j]) for j in chosen}
        left.append(NotIdentified(name=name, moves=moves))
    return tuple(kept), tuple(left)


def solve(w: Floats, y: Floats, ends: Sequence[int] = ()) -> Solution:
    """Ordinary least squares of ``y = w p``, of shapes (n, p) and (n,).

    ``ends``: where each record ends, so that no block of rows reaches over two of them. The variance behind
    ``white`` is that about the residual's mean, over n - 1 rows, as published for EMPS.

    Raises `InputError`: where there are no more rows than values.
    """
    if len(y) <= w.shape[1]:
        reason = f"{len(y)} sample(s) are left to fit {w.shape[1]} parameter(s)"
        raise InputError(f"{reason}; allowed: longer motion")
    values = scaled_lstsq(w, y)
    residual = np.asarray(y - w @ values)
    return Solution(
        values=values,
        white=np.asarray(np.var(residual, ddof=1) * np.linalg.inv(w.T @ w)),
        correlated=correlated_covariance(w, residual, ends),
        residual=residual,
        condition=float(np.linalg.cond(w / np.linalg.norm(w, axis=0))),
    )


def correlated_covariance(w: Floats, residual: Floats, ends: Sequence[int] = ()) -> Floats:
    """As `covariance_of`, of rows of several records, one after the other."""
    blocks = zip(np.split(w, ends[:-1]), np.split(residual, ends[:-1]), strict=True)
    return covariance_of([information_of(*block) for block in blocks])


@dataclass(frozen=True, kw_only=True)
class Information:
    """What one record tells: ``W'W``, ``W' G W``, its rows, and how many coefficients its noise took."""

    gram: Floats
    noise: Floats
    rows: int
    order: int


def information_of(w: Floats, noise: Floats) -> Information:
    """Of the rows of one record and (at least a part of) its noise.

    G is the autocovariance of the noise's own autoregressive model: with ``A(q) e = v`` white, ``W' G W =
    var(v) Z'Z``, Z the rows filtered backward by 1/A.
    """
    a, variance = autoregressive(noise)
    z = lfilter([1.0], a, w[::-1], axis=0)
    return Information(gram=w.T @ w, noise=variance * z.T @ z, rows=len(w), order=len(a) - 1)


def events_of(w: Floats, noise: Floats) -> Information:
    """As `information_of`, of noise that comes in events: at a jump, a reversal, a limit, no two alike.

    Root n blocks of root n rows each, whatever their own sizes, each left out in turn: ``W'W`` times what the
    values then move by takes the place of its sum of ``w e`` (jackknife; Bell and McCaffrey, Survey
    Methodology 28, 2002), as one event bends the values towards itself.
    """
    size = np.maximum(np.linalg.norm(w, axis=0), 1e-300)
    parts = np.array_split(np.column_stack([w / size, noise]), event_blocks(len(noise)))
    tables = np.array([part.T @ part for part in parts])
    gram, own, sums = np.sum(tables, axis=0)[:-1, :-1], tables[:, :-1, :-1], tables[:, :-1, -1]
    moved = np.linalg.pinv(gram - own, hermitian=True) @ sums[:, :, None]
    sums = size * (gram @ moved)[:, :, 0] * np.sqrt(1.0 - 1.0 / len(parts))
    return Information(gram=w.T @ w, noise=sums.T @ sums, rows=len(w), order=0)


def event_blocks(rows: int) -> int:
    """In how many blocks `events_of` takes its rows."""
    return max(int(np.sqrt(rows)), 2)


def wider_covariance(
    records: Sequence[tuple[Floats, Floats]], events: Sequence[tuple[Floats, Floats]] = ()
) -> Floats:
    """Covariance from the rows and noise of each record, of a steady noise or of events.

    Each value has the larger error of the two: few blocks hold what tells it, and at times little of a noise.
    ``events``: the same rows with those of signals that one event meets side by side.
    """
    steady = covariance_of([information_of(*each) for each in records])
    single = covariance_of([events_of(*each) for each in events or records])
    grown = np.sqrt(np.maximum(np.diag(steady) / np.maximum(np.diag(single), 1e-300), 1.0))
    return np.asarray(single * np.outer(grown, grown))


def covariance_of(records: Sequence[Information]) -> Floats:
    """Covariance of the least-squares values that all records together give.

    ``(W'W)^-1 W' G W (W'W)^-1``: no row of one record is correlated with one of another. Grown by rows over
    rows less all that was found of them: the values, and the coefficients of A.
    """
    inverse = np.linalg.inv(sum(part.gram for part in records))
    rows, found = sum(part.rows for part in records), len(inverse) + sum(part.order for part in records)
    return np.asarray(rows / max(rows - found, 1) * inverse @ sum(part.noise for part in records) @ inverse)


def scaled_lstsq(w: Floats, y: Floats) -> Floats:
    """Least-squares values of ``y = w p``, of one y or several columns, each of w over its size first."""
    scale = np.maximum(np.linalg.norm(w, axis=0), 1e-300)
    return np.asarray((np.linalg.lstsq(w / scale, y, rcond=None)[0].T / scale).T)


def autoregressive(values: Floats) -> tuple[Floats, float]:
    """Coefficients of ``A(q) e = v`` and the variance of v, by Levinson's recursion.

    The order is that of the lowest information criterion of Akaike, up to ``10 log10 n``.

    >>> rng = np.random.default_rng(1)
    >>> a, variance = autoregressive(lfilter([1.0], [1.0, -0.8], rng.standard_normal(20_000)))
    >>> round(float(a[1]), 1), round(variance, 1)
    (-0.8, 1.0)
    """
    n = len(values)
    r = autocovariance(values, min(int(10.0 * np.log10(max(n, 1))), n // 4))
    a, variance = np.ones(1), float(r[0])
    best, lowest = (a, variance), n * np.log(max(variance, 1e-300))
    for order in range(1, len(r)):
        if not variance > 0.0:
            break
        reflection = -float(a @ r[order:0:-1]) / variance
        wide = np.append(a, 0.0)
        a, variance = wide + reflection * wide[::-1], variance * (1.0 - reflection**2)
        criterion = n * np.log(max(variance, 1e-300)) + 2.0 * order
        if criterion < lowest:
            best, lowest = (a, variance), criterion
    return best


def between_records(values: Sequence[float], stds: Sequence[float] | Floats) -> float:
    """Standard deviation between records beyond their own errors (Mandel and Paule); 0 for one record.

    The scatter with which ``sum((x - mean)^2 / (std^2 + scatter^2))`` is one less than the number of records.

    >>> round(between_records([1.0, 3.0], [1e-6, 1e-6]), 6)
    1.414214
    >>> between_records([1.0, 1.1], [1.0, 1.0])
    0.0
    """
    x, s = np.asarray(values, dtype=float), np.asarray(stds, dtype=float)
    if len(x) < 2:
        return 0.0

    def excess(variance: float) -> float:
        weight = 1.0 / np.maximum(s**2 + variance, 1e-300)
        mean = float(weight @ x / weight.sum())
        return float(weight @ (x - mean) ** 2) - (len(x) - 1)

    if excess(0.0) <= 0.0:
        return 0.0
    return float(np.sqrt(root(excess, 0.0, float(np.ptp(x)) ** 2 * len(x))))


def by_record(estimates: Sequence[Fit], names: Sequence[str]) -> dict[str, tuple[float, float]]:
    """For each parameter: the scatter between the records that tell it, and of their joint value.

    There each record is weighed by its own error.
    """
    out = {}
    for name in names:
        own = [one for one in estimates if name in one]
        stds = np.array([one.std(name) for one in own])
        scatter = between_records([one[name] for one in own], stds)
        weight = (np.min(stds) / np.maximum(stds, 1e-300)) ** 2 if scatter else np.ones(1)
        out[name] = (scatter, float(scatter * np.sqrt(weight @ weight) / weight.sum()))
    return out
