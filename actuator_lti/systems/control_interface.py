"""What python-control asks of a system with delays, so that its own functions work on one.

python-control has no systems with delays. It takes what a class says that it is:

- frequency response data (`control.FrequencyResponseData`): ``bode_plot``, ``nyquist_plot``,
  ``nichols_plot``, ``margin``. The data are exact, on a grid that the system chooses; for other frequencies
  take ``control.frequency_response(system, omega)``.
- a system that is told its times and inputs (`control.NonlinearIOSystem`): ``step_response``,
  ``forced_response``, ``input_output_response``. Outputs and states are those of
  `actuator_lti.systems.delay_stepper`; python-control's solver has nothing left to integrate.

What asks for poles or for a finite state space is refused: `DelaySystem.pade` makes one.
"""

from __future__ import annotations

from contextlib import suppress
from functools import cached_property
from typing import TYPE_CHECKING, Any

import control
import numpy as np
from control.nlsys import NonlinearIOSystem

from actuator_lti.errors import InputError
from actuator_lti.systems.delay_stepper import DelayStepper

if TYPE_CHECKING:
    from actuator_lti.systems.delay_system import DelaySystem

_POINTS = 2000


class ControlInterface(control.FrequencyResponseData, NonlinearIOSystem):
    """Base of `DelaySystem`: the attributes and hooks that python-control looks for."""

    # of frequency response data: how to plot, and no interpolation
    _ifunc = None
    plot_phase = None
    title = None
    plot_type = "bode"
    return_magphase = False
    _return_singvals = False
    squeeze = None
    # of a nonlinear system
    params: dict[str, Any] = {}  # noqa: RUF012 - python-control replaces it, and never writes into it
    outfcn = staticmethod(lambda *_: None)
    updfcn = staticmethod(lambda *_: None)

    @property
    def sysname(self) -> str:
        return str(self.name)

    @cached_property
    def omega(self) -> np.ndarray:
        """Frequencies in rad/s from a hundredth of the slowest rate to ten times the fastest."""
        return _grid(self)

    @cached_property
    def frdata(self) -> np.ndarray:
        """The exact response at `omega`, shape (outputs, inputs, frequencies)."""
        return np.asarray(self(1j * self.omega, squeeze=False))

    # Time, as `control.input_output_response` asks for it: _update_params, _out at the start, _rhs as often
    # as its solver likes, then _out at each instant in order.
    def _isstatic(self) -> bool:
        """Whether python-control may choose the instants without poles: it may not do otherwise."""
        return True

    def _update_params(self, params: Any) -> None:
        if params:
            raise InputError(f"params = {params!r}: a system with delays has none")
        self._stepper: DelayStepper | None = None
        self._asked = 0

    def _rhs(self, t: float, x: Any, u: Any) -> np.ndarray:
        if self._asked > 1:
            raise InputError(
                "a system with delays cannot be one of several in python-control; take system.pade(n)"
            )
        return np.zeros(np.shape(x))

    def _out(self, t: float, x: Any, u: Any) -> np.ndarray:
        """Output at an instant not before the last one; the state there is written into ``x``."""
        self._asked += 1
        u = np.atleast_1d(np.asarray(u, dtype=float))
        if self._stepper is None or t <= self._stepper.start_s:
            self._stepper = DelayStepper(self, t, np.array(x, dtype=float), u)
        state, output = self._stepper.at(t, u)
        if isinstance(x, np.ndarray) and x.dtype == float:
            x[:] = state
        return output

    def linearize(self, *given: Any, **named: Any) -> Any:
        """Refused: it is linear, but no finite state space."""
        raise InputError("linearize: a system with delays is no finite state space; take system.pade(n)")


def _grid(system: DelaySystem) -> np.ndarray:
    """Logarithmic, and dense enough in phase where the delays turn."""
    rates = [np.abs(np.linalg.eigvals(system.A)), 1.0 / system.delays_s]
    with suppress(InputError):
        rates += [np.abs(system.without_delays().poles())]
    every = np.concatenate(rates)
    every = every[np.isfinite(every) & (every > 1e-9 * every.max(initial=1e-30))]
    low, high = (every.min(), every.max()) if every.size else (1.0, 1.0)
    return np.geomspace(low / 100.0, high * 10.0, _POINTS)
