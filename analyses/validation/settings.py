"""How much a validation does beside its checks, which are always made."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Settings:
    """Which findings a validation looks for; the defaults are those of the report.

    Attributes
    ----------
    sweep : bool
        The injected sweep of every loop, as an analyser on the bench would see it.
    amplitude_margins : bool
        Margins from small, medium and large deviations.
    rest_frequencies : int
        Of the sweep from rest.
    map_counts : tuple of int
        Amplitudes and frequencies of the large-signal map.
    from_rest, large_signals, friction_effects, specification : bool
        Whether these parts are computed; ``from_rest`` are steps, sweep, counts and large commands.
    """

    sweep: bool = True
    amplitude_margins: bool = True
    rest_frequencies: int = 16
    map_counts: tuple[int, int] = (25, 40)
    from_rest: bool = True
    large_signals: bool = True
    friction_effects: bool = True
    specification: bool = True


QUICK = Settings(
    sweep=False,
    amplitude_margins=False,
    rest_frequencies=10,
    map_counts=(10, 16),
    friction_effects=False,
    specification=False,
)
CHECKS = Settings(
    sweep=False,
    amplitude_margins=False,
    from_rest=False,
    large_signals=False,
    friction_effects=False,
    specification=False,
)
"""The checks alone."""
