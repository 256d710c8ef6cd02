"""The doubles by which a rational loop was given, untouched, and their neighbours a few ulp away."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from types import SimpleNamespace
from typing import Any

import numpy as np

from actuator_lti.errors import InputError, shown
from actuator_lti.systems.plain_system import period_of
from actuator_lti.types import Real

_MOST_SAMPLES = 100
ULP = 8  # by how much the entries may be wrong: what this changes the data do not determine


_NOTHING: Real = np.empty(0)


@dataclass(frozen=True, eq=False)
class Given:
    """Coefficients (highest power first, leading zeros trimmed), or a state space where ``A`` is not None."""

    period_s: float | None
    numerator: Real = field(default_factory=lambda: _NOTHING)
    denominator: Real = field(default_factory=lambda: _NOTHING)
    A: Real | None = None
    b: Real = field(default_factory=lambda: _NOTHING)
    c: Real = field(default_factory=lambda: _NOTHING)
    d: float = 0.0
    samples: int = 0  # whole samples of delay behind a sampled loop

    @cached_property
    def _bits(self) -> tuple[object, ...]:
        arrays = (self.numerator, self.denominator, self.A, self.b, self.c)
        parts = [None if x is None else (x.shape, x.tobytes()) for x in arrays]
        return (self.period_s, self.d, self.samples, *parts)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Given) and self._bits == other._bits

    def __hash__(self) -> int:
        return hash(self._bits)

    @property
    def entries(self) -> tuple[str, ...]:
        """The names of what it is given by."""
        return ("numerator", "denominator") if self.A is None else ("A", "b", "c", "d")

    def neighbours(self) -> tuple[Given, Given]:
        """The same with every entry moved by 8 ulp, up or down, and the other way; zeros stay.

        To first order whatever the one does the other undoes: between them lies what the data decide.
        """
        names = self.entries
        ways = self._ways_at_the_limit()
        up, down = (moved(way, *(getattr(self, name) for name in names), ways=ways) for way in (1.0, -1.0))
        pairs: Any = [dict(zip(names, entries, strict=True)) for entries in (up, down)]
        return replace(self, **pairs[0]), replace(self, **pairs[1])

    def _ways_at_the_limit(self) -> Real | None:
        """Up or down for every coefficient of z, where 8 ulp decide on which side of z = 1 or -1 a pole lies.

        The sign of N + D there tells the side, and these move N + D most. ``None`` where they do not decide.
        """
        if self.period_s is None or self.A is not None:
            return None
        powers = [np.arange(part.size)[::-1] for part in (self.numerator, self.denominator)]
        coefficients = np.concatenate((self.numerator, self.denominator))
        for z in (1.0, -1.0):
            terms = coefficients * z ** np.concatenate((powers[0], powers[1] + self.samples))
            if abs(math.fsum(terms)) <= ULP * math.fsum(np.spacing(np.abs(terms))):
                return np.sign(terms)
        return None


def moved(way: float, *entries: Any, ways: Real | None = None) -> list[Any]:
    """Arrays and numbers with every entry moved by 8 ulp, at random where no ``ways`` are given."""
    arrays = [np.asarray(each, dtype=float) for each in entries]
    ends = np.cumsum([x.size for x in arrays])
    signs = np.split(_signs(int(ends[-1])) if ways is None else ways, ends[:-1])
    return [
        x + way * ULP * np.spacing(x) * sign.reshape(x.shape) * (x != 0.0)
        for x, sign in zip(arrays, signs, strict=True)
    ]


@lru_cache
def _signs(count: int) -> Real:
    return np.random.default_rng(0).choice([-1.0, 1.0], count)


def of_scipy(system: Any) -> Any:
    """A system of scipy.signal under python-control's names; anything else as it is."""
    if not type(system).__module__.startswith("scipy.signal"):
        return system
    held = system if hasattr(system, "A") else system.to_tf()
    names = {"ninputs": held.inputs, "noutputs": held.outputs, "dt": held.dt or 0}
    if held is system:
        return SimpleNamespace(A=held.A, B=held.B, C=held.C, D=held.D, **names)
    return SimpleNamespace(num=[[held.num]], den=[[held.den]], **names)


def given_of(system: Any) -> Given:
    """Read a SISO state space or transfer function of python-control or scipy.signal, proper and finite."""
    system = of_scipy(system)
    if not hasattr(system, "ninputs") or not (hasattr(system, "num") or hasattr(system, "A")):
        inner = "; of a Loop its open_loop" if hasattr(system, "open_loop") else ""
        raise InputError(
            f"system = {shown(system)}: allowed: a StateSpace, TransferFunction, DelaySystem or "
            f"FrequencyResponseData, or a linear system of scipy.signal{inner}"
        )
    if system.ninputs != 1 or system.noutputs != 1:
        raise InputError(
            f"a loop has one input and one output; this has {system.ninputs} and {system.noutputs}"
        )
    period_s = period_of(system)
    if hasattr(system, "num"):
        parts = (np.asarray(part[0][0], dtype=float) for part in (system.num, system.den))
        num, den = (part[(part != 0.0).cumsum() > 0] for part in parts)
        if not den.size:
            raise InputError("the denominator of the loop is zero")
        if num.size > den.size:
            raise InputError(
                f"the loop is improper (numerator of degree {num.size - 1} over {den.size - 1}): "
                "it needs at least as many poles as zeros"
            )
        given = Given(period_s, num, den)
    else:
        A = np.asarray(system.A, dtype=float)
        b = np.asarray(system.B, dtype=float)[:, 0]
        given = Given(period_s, A=A, b=b, c=np.asarray(system.C, dtype=float)[0], d=float(system.D[0, 0]))
    if not all(np.isfinite(getattr(given, name)).all() for name in given.entries):
        raise InputError("the loop holds a value that is not finite")
    return given


def unwarped(w: float, period_s: float | None) -> float:
    """Angular frequency in rad/s for w of the s-plane, which of a sampled loop is tan(angle/2)."""
    return float(w) if period_s is None else 2.0 * math.atan(w) / period_s


def whole_samples(samples: float) -> int | None:
    """The number of samples, where it is a whole one and becomes states."""
    whole = round(samples)
    return whole if abs(samples - whole) <= 1e-9 * max(samples, 1.0) and whole <= _MOST_SAMPLES else None
