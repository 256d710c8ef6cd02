"""What is asked of the failure cases."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isfinite
from typing import TYPE_CHECKING, Annotated

from actuator_lti.errors import InputError
from actuator_lti.start.public_arguments import asked
from analyses.request import Option, given

if TYPE_CHECKING:
    from actuator_lti.design.model import Design

NEAR_SHARE = 0.1  # of the full deflection: the deflection asked for where none is stated


@asked
@dataclass(frozen=True, kw_only=True)
class Asked:
    """Simulate jam, hard-over, open phase, frozen and lost sensor and an oscillatory command.

    Prints for each failure the time to a stated deflection and to the mechanical stop, the deflection until
    the failure is detected (of a speed drive, which fails as it turns, the angle run on), the largest speed
    and current, and the largest torque in the train. What is not given comes from [failure] of the design.
    The exit status is 1 where a requirement on failures is not met.

    Try: actuator-lti failures joint --stop "25 deg" --deflection "2 deg" --detection 0.05, or of a spindle
    actuator-lti failures spindle.toml --speed "3000 rpm"
    """

    stop_rad: Annotated[
        float,
        Option(
            'Mechanical stop, such as "25 deg"; the full deflection, of a speed drive none.',
            "ANGLE",
            kind="output",
        ),
    ]
    deflection_rad: Annotated[
        float,
        Option('Deflection to which times are given, such as "2 deg"; stop/10.', "ANGLE", kind="output"),
    ]
    detection_s: Annotated[float, Option("Seconds from the failure to its detection; 0.1.", "s")] = 0.1
    watched_s: Annotated[float, Option("How long each failure is followed; 1.", "s", flag="duration")] = 1.0
    load_Nm: Annotated[
        float,
        Option(
            'Load torque that pushes the output forward from the start, such as "4 N*m"; none.',
            "LOAD",
            kind="load",
        ),
    ] = 0.0
    speed_rad_s: Annotated[
        float,
        Option(
            'Speed at which a speed drive turns before, such as "300 rpm"; half its top speed.',
            "SPEED",
            kind="speed",
        ),
    ] = 0.0

    def __post_init__(self) -> None:
        """Refuse what cannot be answered."""
        for name in ("stop_rad", "deflection_rad", "detection_s", "watched_s"):
            value = getattr(self, name)
            if not value > 0.0 or (value == inf and name.endswith("_s")):
                raise InputError(f"{name} = {value:.6g}: must be positive")
        near, stop, seen, end = self.deflection_rad, self.stop_rad, self.detection_s, self.watched_s
        if near > stop:
            raise InputError(f"deflection: must not be beyond the stop, it is {near / stop:.4g} times that")
        if seen > end:
            raise InputError(f"detection {seen:g} s: must not be after {end:g} s, the end")
        if not isfinite(self.load_Nm):
            raise InputError(f"load {self.load_Nm}: must be finite")
        if not 0.0 <= self.speed_rad_s < inf:
            raise InputError(f"speed_rad_s = {self.speed_rad_s:.6g}: must be 0 or more, and finite")

    @classmethod
    def of(cls, design: Design, **chosen: float | None) -> Asked:
        """What is chosen, else [failure] of the design; else its full deflection is the stop, if any."""
        from analyses.large_signal.tones import full_command

        stated = vars(design.failure) if design.failure is not None else {}
        stop = inf if design.controller.position is None else design.validation.full_deflection_rad
        turns = design.controller.outermost == "velocity"
        usual = {"stop_rad": stop, **({"speed_rad_s": 0.5 * full_command(design)} if turns else {})}
        made = given(usual, stated, chosen)
        if "speed_rad_s" in made and not turns:
            name = "speed_rad_s" if "speed_rad_s" in given(chosen) else "failure.speed"
            raise InputError(f"{name} = {made['speed_rad_s']:.6g}: allowed of a drive commanded in speed")
        return cls(**{"deflection_rad": NEAR_SHARE * made["stop_rad"], **made})
