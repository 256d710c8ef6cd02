"""The controller in float against the simulator over a long run: the difference, and its bound."""

from __future__ import annotations

from collections.abc import Iterator

from actuator_lti import load_design
from benchmarks.row import Row
from examples import firmware_controller as firmware

TICKS = 100_000  # ten seconds of the drive


def rows() -> Iterator[Row]:
    """Linear, with its bound; with all effects in both types."""
    design = load_design("ilr33-amber")
    linear, small = firmware.smooth(design), firmware.random_commands(design, TICKS, 2e-3)
    large = firmware.random_commands(design, TICKS, 0.2)
    found = firmware.closed(linear, small, "float")
    bound = firmware.bound_rad(linear, small, found)
    about = f"{TICKS} ticks of random commands"
    yield Row(f"float, linear, {about}", found.difference_rad, "rad", bound)
    exact = firmware.closed(design, large, "double").difference_rad
    yield Row(f"double, all effects, {about}", exact, "rad", 1e-12)
    single = firmware.closed(design, large, "float").difference_rad
    yield Row(f"float, all effects, {about}", single, "rad")
