"""How much a validation does beside its checks, which are always made."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Settings:
    """What a validation looks at beside its checks; the defaults are those of the report.

    Attributes
    ----------
    own : bool
        What the drive itself does: whether it comes to rest, and what large commands make of it.  The verdict
        is that of the checks and of these.
    sweep : bool
        The injected sweep of every loop, as an analyser on the bench would see it.
    amplitude_margins : bool
        Margins from small, medium and large deviations.
    from_rest : bool
        Sines from rest, and what counts do.
    rest_frequencies : int
        Of the sweep from rest.
    map_counts : tuple of int
        Amplitudes and frequencies of the large-signal map.
    large_signals, friction_effects, specification : bool
        Whether these parts are computed.
    """

    own: bool = True
    sweep: bool = True
    amplitude_margins: bool = True
    from_rest: bool = True
    rest_frequencies: int = 16
    map_counts: tuple[int, int] = (25, 40)
    large_signals: bool = True
    friction_effects: bool = True
    specification: bool = True


QUICK = Settings(
    sweep=False,
    amplitude_margins=False,
    from_rest=False,
    large_signals=False,
    friction_effects=False,
    specification=False,
)
"""All that the verdict is made of, without findings."""
CHECKS = Settings(
    own=False,
    sweep=False,
    amplitude_margins=False,
    from_rest=False,
    large_signals=False,
    friction_effects=False,
    specification=False,
)
"""The checks alone."""
