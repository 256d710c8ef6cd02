"""What is asked of a duty cycle."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isfinite, pi
from typing import TYPE_CHECKING, Annotated

from actuator_lti.errors import InputError
from actuator_lti.start.public_arguments import asked
from analyses.request import Option, given, key_of

if TYPE_CHECKING:
    from actuator_lti.design.model import Design

USUAL_SHARE, USUAL_HZ = 0.5, 1.0  # of the full command, where none is stated
SIZES = {"position": "amplitude_rad", "velocity": "speed_rad_s", "current": "current_A"}
"""The field that holds the peak of a duty, by the loop that takes the command."""


@asked
@dataclass(frozen=True, kw_only=True)
class Asked:
    """Hold a duty cycle against continuous current, overload protection (I2t) and winding temperature.

    The duty is a sine under a load, or a trapezoid from zero and back (a speed drive's, unless --ramp says
    0), for a share of the time; what is not given comes from [duty]. The temperature needs
    thermal_resistance and thermal_time in [temperature], the protection limits.peak_time. The exit status is
    1 where the duty is beyond the continuous rating or misses a requirement on it, or where neither is
    stated.

    Try: actuator-lti duty joint --amplitude "10 deg" --load "40 N*m" --share 0.3 --cycle 20, or of a spindle
    actuator-lti duty spindle.toml --speed "3000 rpm" --ramp 0.5 --frequency 0.1
    """

    amplitude_rad: Annotated[
        float | None, Option('Peak, such as "5 deg"; half the full deflection.', "ANGLE", kind="output")
    ] = None
    speed_rad_s: Annotated[
        float | None,
        Option('Peak of a speed drive, such as "300 rpm"; half its top speed.', "SPEED", kind="speed"),
    ] = None
    current_A: Annotated[
        float | None, Option("Peak of a drive commanded in current; half the peak current.", "A")
    ] = None
    frequency_hz: Annotated[float, Option("Of the motion; 1.", "Hz")] = USUAL_HZ
    ramp_s: Annotated[
        float,
        Option(
            "Rise and fall of a trapezoid, each; 0 is a sine; of a speed drive twice what its torque takes.",
            "s",
        ),
    ] = 0.0
    load_Nm: Annotated[
        float,
        Option(
            'Load torque at the output, such as "4 N*m", all the time; it pushes forward; the largest '
            "of validation.loads, against a speed drive.",
            "LOAD",
            kind="load",
        ),
    ] = 0.0
    share: Annotated[float, Option("Share of the time in motion; the drive holds still for the rest; 1.")] = (
        1.0
    )
    cycle_s: Annotated[float, Option("One motion and one rest together; 10.", "s")] = 10.0

    def __post_init__(self) -> None:
        """Refuse what is no duty."""
        sizes = [name for name in SIZES.values() if getattr(self, name) is not None]
        if len(sizes) != 1:
            several, one_of = " and ".join(map(key_of, sizes)), ", ".join(map(key_of, SIZES.values()))
            raise InputError(f"{several or 'no peak'}: allowed: one of {one_of}")
        for name in (*sizes, "frequency_hz", "cycle_s"):
            if not 0.0 < getattr(self, name) < inf:
                raise InputError(f"{name} = {getattr(self, name):.6g}: must be positive and finite")
        if not 0.0 <= self.ramp_s * self.frequency_hz <= 0.5:
            longest = 0.5 / self.frequency_hz
            raise InputError(f"ramp_s = {self.ramp_s:g}: allowed: 0 to half a period, {longest:g} s")
        if not 0.0 < self.share <= 1.0:
            raise InputError(f"share = {self.share:g}: allowed: above 0, at most 1")
        if not isfinite(self.load_Nm):
            raise InputError(f"load_Nm = {self.load_Nm}: must be finite")
        if self.share < 1.0 and self.share * self.cycle_s * self.frequency_hz < 1.0:
            period = f"{1.0 / self.frequency_hz:g} s"
            raise InputError(f"share = {self.share:g} of {self.cycle_s:g} s: must hold a period, {period}")

    def size_of(self, design: Design, place: str = "") -> float:
        """Peak of the command; an InputError where it is of another kind of drive, by the key at a place."""
        stage = design.controller.outermost
        size: float | None = getattr(self, SIZES.get(stage, ""), None)
        if size is None:
            name = next(name for name in SIZES.values() if getattr(self, name) is not None)
            wrong, right = place + key_of(name) if place else name, place + key_of(SIZES.get(stage, "none"))
            raise InputError(f"{wrong}: this drive's command is a {stage}; allowed: {right}")
        return size

    @classmethod
    def of(cls, design: Design, **chosen: float | None) -> Asked:
        """What is chosen; else [duty] of the design; else half the full command under the largest load."""
        from actuator_lti.drive.operating import runs
        from analyses.large_signal.tones import full_command

        stated = {} if design.duty is None else dict(vars(design.duty))
        turns = stated.pop("frequency_rad_s", None)
        stated["frequency_hz"] = None if turns is None else turns / (2.0 * pi)
        load = max(design.validation.loads_Nm, key=abs)
        usual = {"load_Nm": 0.0 - abs(load) if runs(design) else load}
        made = given(usual, stated, chosen)
        if not any(name in made for name in SIZES.values()):
            made[SIZES.get(design.controller.outermost, "current_A")] = USUAL_SHARE * full_command(design)
        asked = cls(**(_run_up(design, made) if "speed_rad_s" in made else made))
        if {*SIZES.values()} & {*given(stated)} - {*given(chosen)}:
            asked.size_of(design, "duty.")
        return asked


def _run_up(design: Design, made: dict[str, float]) -> dict[str, float]:
    """The trapezoid of a speed drive where none is stated: half its torque for a quarter of the period."""
    from actuator_lti.drive.facts import capability

    push = float(capability(design, made["load_Nm"]).acceleration_rad_s2)
    ramp = made.get("ramp_s", 2.0 * made["speed_rad_s"] / push if push > 0.0 else 0.0)
    hz = made.get("frequency_hz", min(USUAL_HZ, 0.25 / ramp) if ramp > 0.0 else USUAL_HZ)
    return {**made, "frequency_hz": hz, "ramp_s": made.get("ramp_s", min(ramp, 0.25 / hz))}
