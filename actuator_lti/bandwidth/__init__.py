"""Bandwidths, resonance, and the peaks of S and T: of systems exactly, of measured data with ranges."""

from actuator_lti.bandwidth.closed_loop import closed_loop_bandwidth, peaks
from actuator_lti.bandwidth.results import Bandwidth, Level, Peaks
from actuator_lti.start.public_arguments import guard

__all__ = ["Bandwidth", "Level", "Peaks", "closed_loop_bandwidth", "peaks"]

guard(__name__)
