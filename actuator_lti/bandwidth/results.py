"""What bandwidths and peaks are returned as: frozen results that print with their units."""

import math
from dataclasses import dataclass
from typing import Literal

Level = Literal["1/sqrt(2)", "-3 dB"]
SQUARES: dict[str, float] = {"1/sqrt(2)": 0.5, "-3 dB": 10.0**-0.3}
Range = tuple[float, float]


@dataclass(frozen=True)
class Bandwidth:
    """Bandwidths of a closed-loop response T.

    ``minus3db_rad_s``: where |T| first falls below ``level`` times its value at zero frequency; ``None``:
    never. Where it comes back above later (a resonance beyond), the first fall is still the one that is
    meant.
    ``crossings_rad_s``: every frequency at which |T| passes that level, falls and rises in turn: the first is
    ``minus3db_rad_s``.
    ``minus90deg_rad_s``: where the unwrapped phase of T first falls below -90 deg against zero frequency.
    ``resonance_peak_db``: largest |T| over its value at zero frequency, dB (0: no resonance).
    ``resonance_rad_s``: where it is reached; 0 where there is no resonance.
    ``dc_gain``: T at zero frequency, with its sign.
    ``definition``: what "-3 dB" means here: 1/sqrt(2) (half the power) or -3 dB exactly.
    ``minus3db_range_rad_s``, ``minus90deg_range_rad_s``, ``resonance_range_db``: measured data: where these
    figures lie, between the points and within the noise.
    ``notes``: what else has to be known to read the figures.
    """

    minus3db_rad_s: float | None
    minus90deg_rad_s: float | None
    resonance_peak_db: float
    resonance_rad_s: float
    dc_gain: float
    definition: str
    crossings_rad_s: tuple[float, ...] = ()
    minus3db_range_rad_s: Range | None = None
    minus90deg_range_rad_s: Range | None = None
    resonance_range_db: Range | None = None
    notes: tuple[str, ...] = ()

    @property
    def minus3db_hz(self) -> float | None:
        """-3 dB bandwidth, Hz."""
        return None if self.minus3db_rad_s is None else self.minus3db_rad_s / (2.0 * math.pi)

    @property
    def minus90deg_hz(self) -> float | None:
        """-90 deg bandwidth, Hz."""
        return None if self.minus90deg_rad_s is None else self.minus90deg_rad_s / (2.0 * math.pi)

    @property
    def resonance_hz(self) -> float:
        """Frequency of the resonance peak, Hz."""
        return self.resonance_rad_s / (2.0 * math.pi)

    def __str__(self) -> str:
        falls = _text(self.minus3db_rad_s, self.minus3db_range_rad_s)
        turns = _text(self.minus90deg_rad_s, self.minus90deg_range_rad_s)
        peak = ""
        if self.resonance_range_db is not None:
            peak = f" (in {self.resonance_range_db[0]:.4g} to {self.resonance_range_db[1]:.4g})"
        line = (
            f"bandwidth: {falls} ({self.definition}), {turns} (-90 deg); "
            f"resonance {self.resonance_peak_db:+.4f} dB{peak} at {self.resonance_hz:.6g} Hz"
        )
        if len(self.crossings_rad_s) > 1:
            again = ", ".join(_text(w) for w in self.crossings_rad_s[1:])
            line = f"{line}; the first fall of the gain is meant, it passes the level again at {again}"
        return "\n".join((line, *(f"note: {note}" for note in self.notes)))


def _text(rad_s: float | None, known: Range | None = None) -> str:
    if rad_s is None:
        return "none"
    hz = f"{rad_s / (2.0 * math.pi):.6g} Hz"
    return (
        hz if known is None else f"{hz} (in {known[0] / (2 * math.pi):.5g} to {known[1] / (2 * math.pi):.5g})"
    )


@dataclass(frozen=True)
class Peaks:
    """Peaks of the sensitivity S = 1/(1 + L) and of the complementary sensitivity T = L/(1 + L).

    And where they are reached (0 and infinity are possible).
    """

    sensitivity_db: float
    sensitivity_rad_s: float
    complementary_db: float
    complementary_rad_s: float

    def __str__(self) -> str:
        return (
            f"peak of S {self.sensitivity_db:.4f} dB at {self.sensitivity_rad_s / (2 * math.pi):.6g} Hz, "
            f"of T {self.complementary_db:.4f} dB at {self.complementary_rad_s / (2 * math.pi):.6g} Hz"
        )
