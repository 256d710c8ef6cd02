"""`stability_margins`: one entry for every kind of loop."""

from __future__ import annotations

import math
from typing import Any

from actuator_lti.errors import InputError
from actuator_lti.margins.delay_form import delay_form, from_rational
from actuator_lti.margins.delayed import delayed_margins
from actuator_lti.margins.loop import rational_loop
from actuator_lti.margins.rational import rational_margins
from actuator_lti.margins.results import StabilityMargins


def stability_margins(
    system: Any, delay_s: float = 0.0, band_rad_s: tuple[float, float] | None = None
) -> StabilityMargins:
    """Find all margins of a loop L with negative unit feedback."""
    if not (math.isfinite(delay_s) and delay_s >= 0.0):
        raise InputError(f"delay_s = {delay_s}: must be finite and not negative")
    if hasattr(system, "delays_s"):
        if system.delays_s.size or delay_s:
            return delayed_margins(delay_form(system, delay_s), band_rad_s)
        system = system.to_state_space()
    if delay_s:
        return delayed_margins(from_rational(rational_loop(system), delay_s), band_rad_s)
    loop = rational_loop(system, warp=True)
    if loop.period_s is not None and not loop.in_z and abs(1.0 + loop.d) <= 1e-9:
        loop = rational_loop(system)  # a closed-loop pole at z = -1, at infinity of the s-plane
    return rational_margins(loop)
