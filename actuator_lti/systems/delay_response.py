"""What a response with delays does over frequency: at rest, its gain, its phase, its smallest distances."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from flint import arb, fmpq, fmpq_poly

from actuator_lti.errors import NumericalError
from actuator_lti.margins.delays.axis import IMAGINARY, REAL, Axis, Form, smallest, zeros
from actuator_lti.margins.delays.exact import HIGHEST_ORDER, ExactDelayLoop, Quasi, exact_inside_delays
from actuator_lti.margins.delays.form import DelayForm, delay_form, without_series_delays
from actuator_lti.margins.distances import Distance
from actuator_lti.systems.exact_response import double
from actuator_lti.systems.plain_system import PlainSystem
from actuator_lti.systems.precision import precision
from actuator_lti.types import Real

_BITS = 128
_SAME = fmpq(1, 100)  # relative: what 8 ulp of the entries change by more is not told from zero
_AT_REST = 6  # coefficients asked


def plain_behind_delay(system: Any, delay_s: float = 0.0) -> tuple[PlainSystem, float] | None:
    """A system whose delays stand in series with all of it, without them, and their sum with one more, s."""
    if (plain := without_series_delays(delay_form(system, delay_s))) is None:
        return None
    given, late = plain
    assert given.A is not None
    return PlainSystem(given.A, given.b[:, None], given.c[None], np.array([[given.d]]), 0), late


@dataclass(frozen=True)
class DelayResponse:
    """A response L = N/D, both exact but for what 8 ulp of the entries decide at zero frequency."""

    loop: ExactDelayLoop

    @classmethod
    def of(cls, form: DelayForm) -> DelayResponse:
        loop, *others = exact_inside_delays(form, reduced=False)
        N, D = _known(loop.N, [other.N for other in others]), _known(loop.D, [other.D for other in others])
        return cls(replace(loop, N=N, D=D))

    def behind_mean(self, samples: int, period_s: float) -> DelayResponse:
        """Behind the mean over the last samples: (1 - exp(-n s T))/(n (1 - exp(-s T)))."""
        T = fmpq(*period_s.as_integer_ratio())
        N, D = self.loop.N, self.loop.D
        return DelayResponse(replace(self.loop, N=N + N.late(samples * T).times(-1),
                                     D=D.times(samples) + D.late(T).times(-samples)))  # fmt: skip

    @cached_property
    def _axis(self) -> Axis:
        return Axis(self.loop)

    @cached_property
    def _orders(self) -> tuple[int, int]:
        n, d = (next(k for k in range(HIGHEST_ORDER) if f[k] != 0) for f in self.loop.at_rest)
        return n, d

    @property
    def order(self) -> int:
        """Multiplicity of the pole at zero frequency (negative: of the zero)."""
        return self._orders[1] - self._orders[0]

    @property
    def lead(self) -> float:
        """L s^order at s = 0: the value at zero frequency where ``order`` is 0."""
        return double(self.loop.at_rest[0][self._orders[0]] / self.loop.at_rest[1][self._orders[1]])

    def crossings(self, level: float, top: float | None = None) -> list[float]:
        """Where the gain passes a level, rad/s, in order, up to ``top`` or to where it stays below."""
        with precision(_BITS):
            form = Form(fmpq(1), fmpq(0), -(fmpq(*level.as_integer_ratio()) ** 2))
            top = self.loop.beyond(level) if top is None else top
            return [float(x.mid()) for x in zeros(self._axis, form, self._axis.edges(self.loop.lowest, top))]

    def smallest(self, distance: Distance, top: float | None = None) -> tuple[float, float]:
        """Smallest value of a distance over the axis, or up to ``top``, and where."""
        with precision(_BITS):
            return smallest(self._axis, distance, top=top)

    def first_turn(self, floor: float) -> float | None:
        """Where the phase first falls to 90 deg below that at zero frequency; ``None``: not above the floor.

        The phase lies in one half turn between two zeros of the real part; which one is counted.
        """
        with precision(_BITS):
            level = Form(fmpq(1), fmpq(0), -(fmpq(*floor.as_integer_ratio()) ** 2))
            half_turns = 0
            for edges in pairwise(self._axis.edges(self.loop.lowest, self.loop.beyond(floor))):
                fallen = zeros(self._axis, level, list(edges))
                for x in zeros(self._axis, REAL, list(edges)):
                    if fallen and fallen[0] < x:
                        return None
                    below = (self._value(x).imag < 0.0) == (self.lead > 0.0)
                    half_turns += 1 if below == bool(half_turns % 2) else -1
                    if half_turns < 0:
                        return float(x.mid())
                if fallen:
                    return None
        return None

    def phase(self, omega: Real) -> Real:
        """Phase, rad: -90 deg for each integrator at zero frequency, 180 deg less for a negative gain."""
        with precision(_BITS):
            top = max(float(omega.max()) * 1.001, 2.0 * self.loop.lowest)
            meets = zeros(self._axis, IMAGINARY, self._axis.edges(self.loop.lowest, top))
            values = np.array([self._value(arb(float(x))) for x in omega])
            first = 0.5 * min([*(float(x.mid()) for x in meets), self.loop.lowest])
            start = np.angle(self._value(arb(first)))
            turns = [(float(x.mid()), self._turn(x)) for x in meets]
        begins = -0.5 * np.pi * self.order - (np.pi if self.lead < 0.0 else 0.0)
        whole = round((begins - start) / (2.0 * np.pi))
        at = np.array([x for x, turn in turns if turn])
        count = np.concatenate(([0], np.cumsum([turn for _, turn in turns if turn], dtype=int)))
        return np.angle(values) + 2.0 * np.pi * (whole + count[np.searchsorted(at, omega)])

    def _value(self, x: arb) -> complex:
        N, D = self._axis.values(x)
        return complex(N / D)

    def _turn(self, x: arb) -> int:
        """A whole turn that the angle between -180 and 180 deg hides where L meets the negative real axis."""
        near = self._axis.series((x, x))
        real, rate = REAL.along(*near)[0], IMAGINARY.along(*near)[1]
        if not (real < 0 or real > 0):
            raise NumericalError(f"the phase jumps near {float(x.mid()):.10g} rad/s: a zero or a pole there")
        return 0 if real > 0 else 1 if rate < 0 else -1


def _known(f: Quasi, others: list[Quasi]) -> Quasi:
    """The same with what the data do not tell from zero at s = 0 made zero."""
    series = [g.series(_AT_REST) for g in (f, *others)]
    for k in range(_AT_REST):
        own = series[0][k]
        if own != 0 and all(abs(near[k] / own - 1) < _SAME for near in series[1:]):
            (p, tau), *rest = f.terms
            return Quasi(((p - fmpq_poly([series[0][j] for j in range(k)]), tau), *rest))
    raise NumericalError("the response could not be separated from zero at zero frequency")
