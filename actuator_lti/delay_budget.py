"""Where the phase of a loop goes: controller, motor, speed measurement, hold, computing delay, sampling.

The loop is built up form by form, and each item is what its step adds to the phase, so the items sum to the
phase of the exact sampled loop:

    ideal form = controller PI(s) * plant (motor with the inner loops closed)
    + lag of the speed measurement + holds of all rates -> continuous form without computing delay
    + computing delay -> continuous form
    + sampling effects (digital PI against PI(s), aliasing, exact hold) -> sampled form
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from actuator_lti.errors import InputError
from actuator_lti.loops.cascade import ERRORS, MEASURED, Cascade, cascade
from actuator_lti.loops.flow import FlowProgram

if TYPE_CHECKING:
    from actuator_lti.design.model import Design
    from actuator_lti.plant import OperatingPoint

_GRID = 1000
_LOW = 1e-4  # of the frequency asked for: where unwrapping starts


@dataclass(frozen=True)
class DelayBudget:
    """Phase of a loop at one frequency in degrees, item by item; negative is lag.

    Attributes
    ----------
    loop : str
    frequency_rad_s : float
    controller_deg : float
        PI(s), or 0 for P.
    plant_deg : float
        Motor, with the inner loops closed and ideal.
    measurement_deg : float
        Age of a speed taken by difference (0 where w itself is measured; a measurement filter is in the
        plant's item).
    hold_deg : float
        Holds of all rates inside this loop.
    computing_delay_deg : float
    sampling_deg : float
        The rest up to the exact sampled loop: digital instead of continuous PI, aliasing.
    total_deg : float
        Phase of the sampled loop, the sum of the items.
    one_more_sample_deg : float
        What one more base period of computing delay would add (not in the total).
    """

    loop: str
    frequency_rad_s: float
    controller_deg: float
    plant_deg: float
    measurement_deg: float
    hold_deg: float
    computing_delay_deg: float
    sampling_deg: float
    total_deg: float
    one_more_sample_deg: float

    @property
    def items(self) -> dict[str, float]:
        """The items that sum to `total_deg`, in degrees."""
        return {
            "controller": self.controller_deg,
            "plant": self.plant_deg,
            "measurement": self.measurement_deg,
            "hold": self.hold_deg,
            "computing delay": self.computing_delay_deg,
            "sampling": self.sampling_deg,
        }


def delay_budget(
    design: Design,
    loop_name: str,
    frequency_rad_s: float,
    operating_point: OperatingPoint = "sliding",
    load_Nm: float = 0.0,
) -> DelayBudget:
    """Degrees spent by each part of a loop at a frequency, usually its crossover.

    Parameters
    ----------
    design : Design
    loop_name : {"current", "velocity", "position"}
        The loop broken at its own error, inner loops closed.
    frequency_rad_s : float
        Positive, below the Nyquist frequency of this loop.

    Raises
    ------
    InputError
        For a loop that the design does not have, or a frequency out of range.
    """
    wired = cascade(design, operating_point, load_Nm)
    if loop_name not in wired.stages:
        raise InputError(f"loop {loop_name!r}: one of {', '.join(wired.stages)}")
    nyquist = np.pi / wired.period_s(loop_name)
    if not 0 < frequency_rad_s < nyquist:
        raise InputError(f"frequency_rad_s = {frequency_rad_s}: between 0 and Nyquist, {nyquist:g} rad/s")
    omega = np.geomspace(frequency_rad_s * _LOW, frequency_rad_s, _GRID)
    kinds = ("none", "no computing, no measurement", "no computing", "all")
    ideal, held, measured, full = (_continuous(wired, loop_name, kind, omega) for kind in kinds)
    sampled, later = _sampled(wired, loop_name, omega), _sampled(_one_later(wired), loop_name, omega)
    controller = wired.pi(loop_name).continuous(omega)
    controller_deg = float(np.degrees(np.angle(controller[-1])))
    plant_deg = _from_low(ideal / controller)
    steps = {
        "hold_deg": _from_low(held / ideal),
        "measurement_deg": _from_low(measured / held),
        "computing_delay_deg": _from_low(full / measured),
        "sampling_deg": _from_low(sampled / full),
    }
    return DelayBudget(
        loop=loop_name,
        frequency_rad_s=frequency_rad_s,
        controller_deg=controller_deg,
        plant_deg=plant_deg,
        total_deg=controller_deg + plant_deg + sum(steps.values()),
        one_more_sample_deg=_from_low(later / sampled),
        **steps,
    )


def _continuous(wired: Cascade, stage: str, delays: str, omega: np.ndarray) -> np.ndarray:
    from actuator_lti.loops.continuous import delay_system

    flow = FlowProgram(wired, stage, ERRORS[stage], delays).flow()
    return np.asarray(delay_system(flow, "cut", MEASURED[stage])(1j * omega))


def _sampled(wired: Cascade, stage: str, omega: np.ndarray) -> np.ndarray:
    from actuator_lti.loops.sampled import stage_loop

    loop = stage_loop(wired, stage).open_loop
    return np.asarray(loop(np.exp(1j * omega * loop.dt)))


def _one_later(wired: Cascade) -> Cascade:
    control = wired.design.controller
    slower = replace(control, computing_delay_s=control.computing_delay_s + control.period_s)
    return replace(wired, design=replace(wired.design, controller=slower))


def _from_low(values: np.ndarray) -> float:
    """Phase at the last frequency in degrees, unwrapped from the first one (which starts in (-270, 90])."""
    phase = np.unwrap(np.angle(values))
    start = 90.0 - (90.0 - np.degrees(phase[0])) % 360.0
    return float(np.degrees(phase[-1] - phase[0]) + start)
