"""Words that several sections use for the same things."""

from __future__ import annotations

import math

from actuator_lti.design.model import Design

LOOPS = {"current": "Current loop", "velocity": "Velocity loop", "position": "Position loop"}
FORMS = {"sampled": "sampled", "continuous": "continuous with delays", "ideal": "ideal, no delay"}
POINTS = {
    "u": "voltage u",
    "i_ref": "current command i_ref",
    "w_ref": "speed command w_ref",
    "output": "output angle",
}
QUANTITIES = {
    "gain_margin": "gain margin",
    "phase_margin": "phase margin",
    "delay_margin": "delay margin",
    "modulus_margin": "modulus margin",
    "sensitivity_peak": "peak of S",
    "bandwidth": "bandwidth (−3 dB)",
    "bandwidth_90deg": "bandwidth (−90°)",
    "resonance_peak": "resonance peak",
    "overshoot": "overshoot",
    "rise_time": "rise time",
    "settling_time": "settling time",
    "output_rate": "output rate",
    "motor_current": "motor current at top speed",
    "acceleration": "acceleration",
}


def load_unit(design: Design) -> str:
    """Give the unit of the load at the output."""
    return "N" if design.axis == "linear" else "N m"


def hertz(omega_rad_s: float | None) -> float | None:
    """Turn rad/s into Hz; nothing stays nothing."""
    return None if omega_rad_s is None else omega_rad_s / (2.0 * math.pi)
