"""Settings of the tests that ask for the small-signal checks alone."""

from __future__ import annotations

from analyses.validation import Settings

SMALL = Settings(
    frequencies=12,
    point_frequencies=0,
    multisine=False,
    amplitude_margins=False,
    rest_frequencies=4,
    large_signals=False,
    friction_effects=False,
    specification=False,
    seconds=60.0,
)
