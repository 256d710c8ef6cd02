"""What any identification gives: values by name with their covariance, and what was fixed, and why."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np

from actuator_lti.types import Floats

COVERAGE = 1.959963984540054  # standard errors of a normal value in half of its 95 % interval
SAME = 1e-9  # part of a correlation below which values are one


@dataclass(frozen=True, kw_only=True)
class Fixed:
    """A value (SI) that was not found, and why."""

    value: float
    reason: str
    # by how much each value that was found grows with this one, where that grows by one
    moves: Mapping[str, float] = field(default_factory=dict)
    std: float = 0.0  # as the records tell it, beside its own tolerance


@dataclass(frozen=True)
class Found:
    """One value in SI with its standard error and 95 % interval, None where it was fixed."""

    value: float
    standard_error: float | None = None
    interval_95: tuple[float, float] | None = None


@dataclass(frozen=True, kw_only=True)
class Fit:
    """Values in SI by name, shape (p,), their covariance, shape (p, p), and those that were fixed.

    The names are those of `analyses.estimation.parameters` (label, unit, key of each), or keys of a design.
    """

    names: tuple[str, ...]
    values: Floats
    covariance: Floats
    fixed: Mapping[str, Fixed] = field(default_factory=dict)

    def __getitem__(self, name: str) -> float:
        return float(self.values[self.names.index(name)]) if name in self.names else self.fixed[name].value

    def __contains__(self, name: str) -> bool:
        return name in self.names or name in self.fixed

    def get(self, name: str, default: float) -> float:
        """A value, or another where it is not among them."""
        if name not in self:
            return default
        return self[name]

    @property
    def standard_errors(self) -> Floats:
        """Standard errors, shape (p,)."""
        return np.sqrt(np.diag(self.covariance))

    def std(self, name: str) -> float:
        """Standard error of one value; 0 where it was fixed."""
        return float(self.standard_errors[self.names.index(name)]) if name in self.names else 0.0

    def interval(self, name: str) -> tuple[float, float]:
        """95 % interval of one value."""
        half = COVERAGE * self.std(name)
        return self[name] - half, self[name] + half

    @property
    def parameters(self) -> dict[str, Found]:
        """Every value by name, those that were fixed last."""
        fixed = {name: Found(one.value) for name, one in self.fixed.items()}
        found = {n: Found(self[n], self.std(n), self.interval(n)) for n in self.names if n not in fixed}
        return found | fixed

    @property
    def correlation(self) -> Floats:
        """Correlation matrix; 0 beside a value without an error."""
        std = np.where(self.standard_errors > 0.0, self.standard_errors, 1.0)
        return np.asarray(self.covariance / np.outer(std, std))

    def mapped(
        self, slopes: Mapping[str, Mapping[str, float]], values: Mapping[str, float] | None = None
    ) -> Fit:
        """The fit of other values: each by its slopes over those of this one, first order.

        A value that is not given is the sum of slopes times values.

        >>> one = Fit(names=("a", "b"), values=np.array([1.0, 2.0]), covariance=np.diag([0.01, 0.04]))
        >>> both = one.mapped({"sum": {"a": 1.0, "b": 1.0}, "shifted": {"a": 10.0}}, {"shifted": 7.0})
        >>> both.values.tolist(), both.covariance.round(6).tolist()
        ([3.0, 7.0], [[0.05, 0.1], [0.1, 1.0]])
        """
        table = np.array([[own.get(name, 0.0) for name in self.names] for own in slopes.values()])
        table = table.reshape(len(slopes), len(self.names))
        found = dict(zip(slopes, table @ self.values, strict=True)) | dict(values or {})
        made = np.array([found[name] for name in slopes])
        return Fit(names=tuple(slopes), values=made, covariance=table @ self.covariance @ table.T)

    def refined(self, own: Fit) -> Fit:
        """The fit where some values were found anew, at all the others: with the error of these as well.

        >>> wide = np.array([[0.04, 0.02], [0.02, 0.01]])
        >>> both = Fit(names=("a", "b"), values=np.array([1.0, 2.0]), covariance=wide)
        >>> again = Fit(names=("a",), values=np.array([1.1]), covariance=np.array([[0.01]]))
        >>> both.refined(again).values.tolist(), both.refined(again).covariance.round(6).tolist()
        ([1.1, 2.0], [[0.05, 0.02], [0.02, 0.01]])
        """
        here = [self.names.index(name) for name in own.names]
        rest = [k for k, name in enumerate(self.names) if name not in own.names]
        beside = self.correlation[np.ix_(here, rest)] * self.standard_errors[here][:, None]
        inverse = np.linalg.pinv(self.correlation[np.ix_(rest, rest)], rcond=SAME, hermitian=True)
        values, covariance = self.values.copy(), self.covariance.copy()
        values[here] = own.values
        covariance[np.ix_(here, here)] = own.covariance + beside @ inverse @ beside.T
        return replace(self, values=values, covariance=covariance)

    def wider(self, moved: Floats) -> Self:
        """The fit with what an error moves all its values by, once its standard deviation."""
        return replace(self, covariance=self.covariance + np.outer(moved, moved))

    def joined(self, other: Fit, beside: Floats) -> Fit:
        """The values of both; ``beside``: their covariance, shape (p, those of the other)."""
        return Fit(
            names=(*self.names, *other.names),
            values=np.concatenate([self.values, other.values]),
            covariance=np.block([[self.covariance, beside], [beside.T, other.covariance]]),
        )

    def at(self, given: Mapping[str, float]) -> Fit:
        """The other values as they are expected where some are known to be these (conditional mean)."""
        rest = [k for k, name in enumerate(self.names) if name not in given]
        gone, c = [self.names.index(name) for name in given], self.covariance
        off = np.array(list(given.values())) - self.values[gone]
        values = self.values[rest] + c[np.ix_(rest, gone)] @ np.linalg.lstsq(c[np.ix_(gone, gone)], off)[0]
        return Fit(names=tuple(self.names[k] for k in rest), values=values, covariance=c[np.ix_(rest, rest)])

    def renamed(self, names: Mapping[str, str]) -> Fit:
        """The values that have a new name, under it, and their covariance."""
        return self.mapped({names[name]: {name: 1.0} for name in self.names if name in names})

    def beside(self, name: str, value: float, std: float) -> Fit:
        """The fit and one more value, found on its own."""
        wide = np.pad(self.covariance, (0, 1))
        wide[-1, -1] = std**2
        values = np.append(self.values, value)
        return Fit(names=(*self.names, name), values=values, covariance=wide, fixed=self.fixed)
