"""Where the phase of a loop goes: controller, motor, speed measurement, hold, computing delay, sampling.

The loop is built up form by form, and each item is what its step adds to the phase, so the items sum to the
phase of the exact sampled loop:

    ideal form without filters = controller PI(s) * plant (motor with the inner loops closed)
    + each filter of speed and torque, one after the other -> ideal form
    + lag of the speed measurement + holds of all rates -> continuous form without computing delay
    + computing delay -> continuous form
    + sampling effects (digital PI against PI(s), aliasing, exact hold) -> sampled form
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from os import PathLike

import numpy as np

from actuator_lti.design.loader import as_design
from actuator_lti.design.model import Design, Filter
from actuator_lti.drive.blocks import centre_rad_s
from actuator_lti.drive.operating import Operating, OperatingPoint, RotorState
from actuator_lti.drive.wiring import Drive, wire
from actuator_lti.errors import InputError, finite_number
from actuator_lti.loops.continuous import open_loop
from actuator_lti.loops.flow import ALL
from actuator_lti.loops.sampled import loop

_GRID = 1000
_LOW = 1e-4  # of the frequency asked for: where unwrapping starts


@dataclass(frozen=True)
class DelayBudget:
    """Phase of a loop at one frequency in degrees, item by item; negative is lag."""

    loop: str
    frequency_rad_s: float
    # Which sum to the total: ``controller``: PI(s), or 0 for P; ``plant``: motor and load, with the inner
    # loops closed and ideal; each of `filters_deg`; ``measurement``: age of a speed taken by difference
    # (0 where w itself is measured; the lag of a tracking loop is in the plant's item); ``hold``: of all
    # rates inside this loop; ``computing delay``; ``sampling``: digital instead of continuous PI, aliasing
    items: Mapping[str, float]
    total_deg: float  # phase of the sampled loop
    one_more_sample_deg: float  # what one more base period of computing delay would add (not in the total)
    rotor: RotorState  # of a current loop
    filters_deg: Mapping[str, float]  # in or inside the loop, in the signal's order, by kind and frequency


def delay_budget(
    design: Design | str | PathLike[str], loop_name: str, frequency_rad_s: float,
    operating_point: OperatingPoint = "sliding", load_Nm: float = 0.0, *, rotor: RotorState = "free",
    torques_held: bool = False
) -> DelayBudget:  # fmt: skip
    """Degrees spent by each part of a loop at a frequency, usually its crossover.

    ``loop_name``: "current", "velocity" or "position", broken at its own error, inner loops closed.
    ``frequency_rad_s``: positive, below the Nyquist frequency of this loop.
    ``rotor``, ``torques_held``: as in `Operating`: how a loop is held that is unstable by itself.

    Raises `InputError`: for a loop that the design does not have, or a frequency out of range.
    """
    design = as_design(design)
    at = Operating(point=operating_point, load_Nm=load_Nm, rotor=rotor, torques_held=torques_held)
    wired = wire(design, at)
    if loop_name not in wired.stages:
        raise InputError(f"loop {loop_name!r}: one of {', '.join(wired.stages)}")
    if design.controller.own_law is not None:
        law = f"control.{design.controller.own_law[0]}.law"
        raise InputError(f"{law}: a delay budget is of gains and filters; allowed: without a law")
    nyquist = np.pi / wired.period_s(loop_name)
    if not 0 < finite_number("frequency_rad_s", frequency_rad_s) < nyquist:
        raise InputError(f"frequency_rad_s = {frequency_rad_s}: between 0 and Nyquist, {nyquist:g} rad/s")
    omega = np.geomspace(frequency_rad_s * _LOW, frequency_rad_s, _GRID)
    bare, steps = _built_up(wired, loop_name, omega)
    kinds = (frozenset[str](), ALL - {"computing", "measurement"}, ALL - {"computing"}, ALL)
    ideal, held, measured, full = (_continuous(wired, loop_name, kind, omega) for kind in kinds)
    systems = (loop(each, loop_name).plain_open for each in (wired, wired.later(wired.tick_s)))
    sampled, later = (np.asarray(each(np.exp(1j * omega * each.dt))) for each in systems)
    controller = wired.law(loop_name).at_s(omega)
    controlled = float(np.degrees(np.angle(controller[-1])))
    behind = {"measurement": measured / held, "hold": held / ideal, "computing delay": full / measured}
    behind["sampling"] = sampled / full
    items = {"controller": controlled, "plant": _from_low(bare / controller), **steps}
    items |= {name: _from_low(each) for name, each in behind.items()}
    one_more = _from_low(later / sampled)
    return DelayBudget(loop_name, frequency_rad_s, items, sum(items.values()), one_more, rotor, steps)


def _built_up(wired: Drive, stage: str, omega: np.ndarray) -> tuple[np.ndarray, dict[str, float]]:
    """The ideal loop without any filter, and what each filter adds to its phase."""
    velocity, encoder = wired.design.controller.velocity, wired.design.encoder
    if velocity is None or stage == "current":
        return _continuous(wired, stage, frozenset(), omega), {}
    lag = encoder.filter_time_s
    names = [f"speed filter {1 / lag:.4g} rad/s"] if lag > 0 else []
    for k, item in enumerate(velocity.filters, 1):
        centre = centre_rad_s(item)
        names.append(f"{item.on} {item.kind} {k}" + ("" if centre is None else f" {centre:.4g} rad/s"))
    steps: list[tuple[float, tuple[Filter, ...]]] = [(0.0, ())]
    if lag > 0:
        steps.append((lag, ()))
    steps += [(lag, velocity.filters[: k + 1]) for k in range(len(velocity.filters))]
    loops = [_continuous(_filtered(wired, *step), stage, frozenset(), omega) for step in steps]
    shares = [_from_low(after / before) for before, after in pairwise(loops)]
    return loops[0], dict(zip(names, shares, strict=True))


def _filtered(wired: Drive, lag_s: float, filters: tuple[Filter, ...]) -> Drive:
    design, control = wired.design, wired.design.controller
    assert control.velocity is not None
    fewer = replace(control, velocity=replace(control.velocity, filters=filters))
    encoder = replace(design.encoder, filter_time_s=lag_s)
    return replace(wired, design=replace(design, controller=fewer, encoder=encoder))


def _continuous(wired: Drive, stage: str, delays: frozenset[str], omega: np.ndarray) -> np.ndarray:
    return np.asarray(open_loop(wired, stage, delays)(1j * omega))


def _from_low(values: np.ndarray) -> float:
    """Phase at the last frequency in degrees, unwrapped from the first one (which starts in (-270, 90])."""
    phase = np.unwrap(np.angle(values))
    start = 90.0 - (90.0 - np.degrees(phase[0])) % 360.0
    return float(np.degrees(phase[-1] - phase[0]) + start)
