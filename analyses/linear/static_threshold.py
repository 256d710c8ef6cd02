"""What the drive does at rest: torque against position error, and the command that breaks it away at once."""

from __future__ import annotations

import math
from dataclasses import dataclass

from actuator_lti.design.model import Design
from actuator_lti.drive.facts import breakaway_torque_Nm, stall_torque_Nm
from actuator_lti.drive.steady import torque_gain_Nm_rad


@dataclass(frozen=True)
class StaticThreshold:
    """Smallest step that moves the output at once, by the proportional parts of the controllers."""

    load_Nm: float
    # Motor torque per position error at the output, rotor at rest, before any integrator has acted
    torque_gain_Nm_rad: float
    # Command (peak, output side) that overcomes breakaway in each direction; 0 where the load already does,
    # ``inf`` where the drive is not strong enough
    forward_rad: float
    backward_rad: float
    # Integral time of the velocity controller, else of the position controller: with one any smaller command
    # moves the output later, see `waiting_time_s`; ``None`` where nothing integrates and the threshold is
    # final
    integral_time_s: float | None
    # That of the position controller, where the velocity controller integrates too
    outer_integral_time_s: float | None = None

    @property
    def smallest_rad(self) -> float:
        """The smaller of both directions."""
        return min(self.forward_rad, self.backward_rad)

    def waiting_time_s(self, amplitude_rad: float) -> float:
        """Time until a forward step moves the output: ``Tn (A0/A - 1)``; ``inf`` where it never does.

        With a constant error the torque grows as ``1 + t/Tn``; two integrals one behind the other, of times T
        and U, give ``1 + t/T + t/U + t^2/(2 T U)``.
        """
        if amplitude_rad >= self.forward_rad:
            return 0.0
        if self.integral_time_s is None or amplitude_rad <= 0.0 or math.isinf(self.forward_rad):
            return math.inf
        more = self.forward_rad / amplitude_rad - 1.0
        if self.outer_integral_time_s is None:
            return self.integral_time_s * more
        T, U = self.integral_time_s, self.outer_integral_time_s
        return math.sqrt((T + U) ** 2 + 2.0 * T * U * more) - (T + U)


def static_threshold(design: Design, load_Nm: float = 0.0) -> StaticThreshold:
    """Find the smallest command that moves the output at once.

    Examples
    --------
    >>> from actuator_lti import load_design
    >>> result = static_threshold(load_design("emps"))
    >>> round(1e6 * result.backward_rad, 3)  # um: (Fc - |offset|) and (Fc + |offset|) over the stiffness
    17.187
    """
    gain, strongest = float(torque_gain_Nm_rad(design)), float(stall_torque_Nm(design))
    both = {}
    for direction in (1, -1):
        needed = breakaway_torque_Nm(design, load_Nm, direction)
        both[direction] = needed / gain if needed < strongest else math.inf
    velocity = design.controller.velocity
    times = [
        None if velocity is None else velocity.integral_time_s,
        design.controller.position_loop.integral_time_s,
    ]
    integrals = [one for one in times if one is not None] + [None, None]
    return StaticThreshold(load_Nm, gain, both[1], both[-1], integrals[0], integrals[1])
