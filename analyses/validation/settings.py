"""How much a validation does."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Settings:
    """Extent of a validation; the defaults are those of the report.

    Attributes
    ----------
    frequencies : int
        Of each loop's sweep.
    point_frequencies : int
        Of the sweep at each break point with all loops closed; 0: none.
    multisine : bool
        Measure every loop by multisine as well.
    amplitude_margins : bool
        Margins from small, medium and large deviations.
    rest_frequencies : int
        Of the sweep from rest.
    map_counts : tuple of int
        Amplitudes and frequencies of the large-signal map.
    large_signals, friction_effects, specification : bool
        Whether these parts are computed.
    seconds : float
        Processor time that the whole may take; what is cut is said.
    """

    frequencies: int = 40
    point_frequencies: int = 12
    multisine: bool = True
    amplitude_margins: bool = True
    rest_frequencies: int = 16
    map_counts: tuple[int, int] = (25, 40)
    large_signals: bool = True
    friction_effects: bool = True
    specification: bool = True
    seconds: float = 20.0


QUICK = Settings(
    frequencies=24,
    point_frequencies=0,
    multisine=False,
    amplitude_margins=False,
    rest_frequencies=10,
    map_counts=(10, 16),
    friction_effects=False,
    specification=False,
)
