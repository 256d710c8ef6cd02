"""Figures that only an analysis of one design finds: failures, duty, limit cycles, corners, command."""

from dataclasses import dataclass, replace
from functools import lru_cache
from math import inf, log10, pi
from typing import Any

import numpy as np

from actuator_lti.asked.quantities import ANALYSIS_QUANTITIES, QUANTITIES
from actuator_lti.design.model import Design
from actuator_lti.drive.profile import profile_onset_rad
from actuator_lti.errors import InputError
from actuator_lti.loops import assemble_loops
from analyses.corners import corners, worst_of
from analyses.duty import duty
from analyses.failures import failures
from analyses.large_signal.tones import linear_steady_state, run_until_steady, tone, tone_rows
from analyses.limit_cycles import limit_cycles
from analyses.motion.settling import ending_of


def said_of(design: Design, frequency_hz: float | None) -> str:
    """What rate and acceleration of the command make of a bandwidth, in words; simulated if they act."""
    if frequency_hz is None or not 0.0 < frequency_hz < inf:
        return ""
    full = design.validation.full_deflection_rad
    onset = float(profile_onset_rad(design, np.array([2.0 * pi * frequency_hz]))[0])  # peak, output side
    if onset == inf:
        return ""
    scale, unit = (1e3, "mm") if design.axis == "linear" else (180.0 / pi, "deg")
    said = (
        f"rate and acceleration of the command are not in it: they act above {scale * onset:.3g} {unit} at "
        f"{frequency_hz:.3g} Hz"
    )
    if onset >= full:
        return f"{said}, beyond full deflection"
    chosen = tone(frequency_hz, design)
    start = linear_steady_state(assemble_loops(design), np.array([chosen.omega_rad_s]))
    amplitude, nothing = np.array([full]), np.zeros(1)
    run, _ = run_until_steady(tone_rows(design, (chosen,), np.zeros(1, int), amplitude, start, nothing))
    gain = float(abs(run.phasor("output_angle_rad")[0])) / full
    share = float(run.window_limit_fraction("profile")[0])
    said = f"{said}; simulated at {scale * full:.3g} {unit} and {chosen.frequency_hz:.3g} Hz: "
    return said + f"{20.0 * log10(gain) if gain else -inf:.3g} dB, {100.0 * share:.0f} % of the time limited"


_ANSWERS = {"failures": failures, "duty": duty, "cycles": limit_cycles, "corners": corners}


def answer_of(design: Design, analysis: str) -> Any:
    """What ``failures``, ``duty``, ``cycles`` or ``corners`` finds by default, once for all who ask."""
    if analysis == "corners":
        return _answered(design, analysis)
    own = tuple(one for one in design.requirements if one.quantity in ANALYSIS_QUANTITIES)
    alone = replace(design, requirements=tuple(one for one in own if not QUANTITIES[one.quantity].cornered))
    return replace(_answered(alone, analysis), design=design)  # what else is required changes no figure


@lru_cache(maxsize=len(_ANSWERS))
def _answered(design: Design, analysis: str) -> Any:
    return _ANSWERS[analysis](design)


@dataclass(frozen=True)
class AskedFigures:
    """What readers of `ANALYSIS_QUANTITIES` ask of one design: each analysis is run where one is read."""

    design: Design

    failures = property(lambda self: answer_of(self.design, "failures"))
    duty = property(lambda self: answer_of(self.design, "duty"))
    cycles = property(lambda self: answer_of(self.design, "cycles"))

    @property
    def limit_cycle_rad(self) -> float | None:
        """Largest swing that a step of the drive as it is ends in; 0: it rests; ``None``: not known."""
        swing = self.cycles.hunting
        return 0.0 if swing is None else swing.limit_cycle_rad

    def figure(self, name: str) -> tuple[float | None, str]:
        """A figure in its unit, and what there is to say of it."""
        quantity = ANALYSIS_QUANTITIES[name]
        try:
            if quantity.cornered:
                return worst_of(answer_of(self.design, "corners").corners, name), ""
            value = quantity.read(self, self.design.axis)
        except InputError as error:
            return None, error.message
        if name == "limit_cycle" and self.cycles.hunting is not None:  # after which step that is
            return value, ending_of(self.design, self.cycles.hunting)
        return value, ""
